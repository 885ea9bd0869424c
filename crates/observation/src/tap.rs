//! An observer of everything, tick by tick.

use crate::canonical::Observation;
use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand, TeamState,
};
use mikoshi_runtime::{ConnectError, InOrder, Tap, TickError};

/// Observers of every topic of a team.
pub struct TeamTap<T: Tap> {
    sensors: Vec<Port<T, Sensors>>,
    object_truth: Vec<Port<T, ObjectTruth>>,
    robot_truth: Vec<Port<T, RobotTruth>>,
    robot_state: Vec<Port<T, RobotState>>,
    team_command: Vec<Port<T, TeamCommand>>,
    team_state: Vec<Port<T, TeamState>>,
    joint_command: Vec<Port<T, JointCommand>>,
}

impl<T: Tap> TeamTap<T> {
    /// Observes a team of `robots` robots.
    ///
    /// # Errors
    /// A topic that can't be observed.
    pub fn new(tap: &T, robots: usize) -> Result<Self, ConnectError> {
        Ok(Self {
            sensors: ports(tap, robots)?,
            object_truth: ports(tap, 1)?,
            robot_truth: ports(tap, robots)?,
            robot_state: ports(tap, robots)?,
            team_command: ports(tap, robots)?,
            team_state: ports(tap, 1)?,
            joint_command: ports(tap, robots)?,
        })
    }

    /// Collects the frames of the next tick into `observation`; `true` once it holds all of one tick.
    /// Until then it may be called again, and goes on where frames are still to come.
    ///
    /// # Errors
    /// A frame that can't be read.
    pub fn try_take_tick(&mut self, observation: &mut Observation) -> Result<bool, TickError> {
        // In the order in which a tick produces them: while one is missing, later ones are not there yet.
        let object_truth = core::slice::from_mut(&mut observation.object_truth);
        let team_state = core::slice::from_mut(&mut observation.team_state);
        let is_complete = take(&mut self.sensors, &mut observation.sensors)?
            && take(&mut self.object_truth, object_truth)?
            && take(&mut self.robot_truth, &mut observation.robot_truth)?
            && take(&mut self.robot_state, &mut observation.robot_state)?
            && take(&mut self.team_command, &mut observation.team_command)?
            && take(&mut self.team_state, team_state)?
            && take(&mut self.joint_command, &mut observation.joint_command)?;
        if is_complete {
            forget(&mut self.sensors);
            forget(&mut self.object_truth);
            forget(&mut self.robot_truth);
            forget(&mut self.robot_state);
            forget(&mut self.team_command);
            forget(&mut self.team_state);
            forget(&mut self.joint_command);
        }
        Ok(is_complete)
    }
}

/// One topic, and whether its frame of the current tick has been taken.
struct Port<T: Tap, P: Payload> {
    observer: InOrder<T::Observer<P>, P>,
    is_taken: bool,
}

fn ports<T: Tap, P: Payload>(tap: &T, robots: usize) -> Result<Vec<Port<T, P>>, ConnectError> {
    let port = |robot| Ok(Port { observer: InOrder::new(tap.observer(robot)?), is_taken: false });
    (0..robots).map(port).collect()
}

fn take<T: Tap, P: Payload>(ports: &mut [Port<T, P>], frames: &mut [Frame<P>]) -> Result<bool, TickError> {
    let mut is_complete = true;
    for (port, frame) in ports.iter_mut().zip(frames) {
        port.is_taken = port.is_taken || port.observer.try_receive(frame)?;
        is_complete &= port.is_taken;
    }
    Ok(is_complete)
}

fn forget<T: Tap, P: Payload>(ports: &mut [Port<T, P>]) {
    for port in ports {
        port.is_taken = false;
    }
}
