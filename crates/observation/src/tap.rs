//! An observer of everything, tick by tick.

use crate::canonical::Observation;
use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand, TeamState,
};
use mikoshi_runtime::{Clock, ConnectError, InOrder, OBSERVER_DEPTH, Observer, Tap, TickError};

/// In wall-clock time frames may be late, when a process was replaced, or lost: for so many ticks they are waited
/// for.
const PATIENCE_TICKS: u64 = OBSERVER_DEPTH as u64;

/// Observers of every topic of a team.
pub struct TeamTap<T: Tap> {
    sensors: Ports<T, Sensors>,
    object_truth: Ports<T, ObjectTruth>,
    robot_truth: Ports<T, RobotTruth>,
    robot_state: Ports<T, RobotState>,
    team_command: Ports<T, TeamCommand>,
    team_state: Ports<T, TeamState>,
    joint_command: Ports<T, JointCommand>,
    /// The next one.
    tick: u64,
    /// How long what is missing is waited for; for ever in lockstep.
    patience_ticks: Option<u64>,
    frames_lost: u64,
}

impl<T: Tap> TeamTap<T> {
    /// Observes a team of `robots` robots, whose ticks begin by this clock.
    ///
    /// # Errors
    /// A topic that can't be observed.
    pub fn new(tap: &T, robots: usize, clock: Clock) -> Result<Self, ConnectError> {
        Ok(Self {
            sensors: ports(tap, robots)?,
            object_truth: ports(tap, 1)?,
            robot_truth: ports(tap, robots)?,
            robot_state: ports(tap, robots)?,
            team_command: ports(tap, robots)?,
            team_state: ports(tap, 1)?,
            joint_command: ports(tap, robots)?,
            tick: 0,
            patience_ticks: match clock {
                Clock::Lockstep => None,
                Clock::Wall { .. } => Some(PATIENCE_TICKS),
            },
            frames_lost: 0,
        })
    }

    /// Collects the frames of the next tick into `observation`; `true` once it holds all of one tick, or in
    /// wall-clock time all that will come. A frame that is lost stays what it was, of an earlier tick.
    ///
    /// # Errors
    /// A frame that can't be read.
    pub fn try_take_tick(&mut self, observation: &mut Observation) -> Result<bool, TickError> {
        let newest = self.gather()?;
        let is_given_up = |tick: u64| match (self.patience_ticks, newest) {
            (Some(patience_ticks), Some(newest)) => newest >= tick.saturating_add(patience_ticks),
            _ => false,
        };
        // Without it nobody knows what a tick was.
        while !are_complete(&self.object_truth, self.tick) {
            if !is_given_up(self.tick) {
                return Ok(false);
            }
            self.frames_lost += 1;
            self.tick += 1;
        }
        if !self.is_complete() && !is_given_up(self.tick) {
            return Ok(false);
        }
        let tick = self.tick;
        self.frames_lost += take(&mut self.sensors, tick, &mut observation.sensors)
            + take(&mut self.object_truth, tick, core::slice::from_mut(&mut observation.object_truth))
            + take(&mut self.robot_truth, tick, &mut observation.robot_truth)
            + take(&mut self.robot_state, tick, &mut observation.robot_state)
            + take(&mut self.team_command, tick, &mut observation.team_command)
            + take(&mut self.team_state, tick, core::slice::from_mut(&mut observation.team_state))
            + take(&mut self.joint_command, tick, &mut observation.joint_command);
        self.tick += 1;
        Ok(true)
    }

    /// Begins with this tick: of those before it is not known what is missing.
    pub fn begin_at(&mut self, tick: u64) {
        self.tick = tick;
    }

    /// Nothing more will come: in wall-clock time, what is missing is lost.
    pub fn give_up_waiting(&mut self) {
        self.patience_ticks = self.patience_ticks.map(|_| 0);
    }

    /// Frames that never came.
    pub fn frames_lost(&self) -> u64 {
        self.frames_lost
    }

    /// Takes in what has come, and returns the latest tick of the world.
    fn gather(&mut self) -> Result<Option<u64>, TickError> {
        let newest = gather(&mut self.object_truth)?;
        gather(&mut self.sensors)?;
        gather(&mut self.robot_truth)?;
        gather(&mut self.robot_state)?;
        gather(&mut self.team_command)?;
        gather(&mut self.team_state)?;
        gather(&mut self.joint_command)?;
        Ok(newest)
    }

    fn is_complete(&self) -> bool {
        are_complete(&self.sensors, self.tick)
            && are_complete(&self.robot_truth, self.tick)
            && are_complete(&self.robot_state, self.tick)
            && are_complete(&self.team_command, self.tick)
            && are_complete(&self.team_state, self.tick)
            && are_complete(&self.joint_command, self.tick)
    }
}

/// The observers of one payload, by robot.
type Ports<T, P> = Vec<InOrder<<T as Tap>::Observer<P>, P>>;

fn ports<T: Tap, P: Payload>(tap: &T, robots: usize) -> Result<Ports<T, P>, ConnectError> {
    (0..robots).map(|robot| Ok(InOrder::new(tap.observer(robot)?))).collect()
}

/// Takes in what has come, and returns the latest tick of it.
fn gather<P: Payload>(ports: &mut [InOrder<impl Observer<P>, P>]) -> Result<Option<u64>, TickError> {
    ports.iter_mut().try_fold(None, |newest, port| Ok(newest.max(port.gather()?)))
}

fn are_complete<P: Payload>(ports: &[InOrder<impl Observer<P>, P>], tick: u64) -> bool {
    ports.iter().all(|port| port.has(tick))
}

/// Returns how many are missing.
fn take<P: Payload>(ports: &mut [InOrder<impl Observer<P>, P>], tick: u64, frames: &mut [Frame<P>]) -> u64 {
    let taken = ports.iter_mut().zip(frames).map(|(port, frame)| port.take(tick, frame));
    taken.filter(|is_there| !is_there).count() as u64
}
