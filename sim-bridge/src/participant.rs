//! The bridge on a transport.

use crate::{BuildWorldError, World};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{Frame, JointCommand, ObjectTruth, RobotTruth, Sensors, ServiceId};
use mikoshi_runtime::{Call, ConnectError, Loan, Participant, Publisher, Subscriber, TickError, Transport};
use thiserror::Error;

/// Why a bridge could not be made.
#[derive(Debug, Error)]
#[allow(missing_docs)]
pub enum BuildBridgeError {
    #[error("{0}")]
    World(#[from] BuildWorldError),
    #[error("{0}")]
    Connect(#[from] ConnectError),
}

impl BuildBridgeError {
    /// Whether the system is to blame, and not the run that was asked for.
    pub fn is_fault(&self) -> bool {
        matches!(self, Self::Connect(_) | Self::World(BuildWorldError::Simulator(_)))
    }
}

/// The simulated world with its ports.
pub struct BridgeParticipant<T: Transport> {
    world: World,
    frame: Frame<JointCommand>,
    commands: Vec<JointCommand>,
    robots: Vec<RobotPorts<T>>,
    object_truth: T::Publisher<ObjectTruth>,
}

struct RobotPorts<T: Transport> {
    sensors: T::Publisher<Sensors>,
    truth: T::Publisher<RobotTruth>,
    command: T::Subscriber<JointCommand>,
}

impl<T: Transport> BridgeParticipant<T> {
    /// Builds the run's world and connects it.
    ///
    /// # Errors
    /// No world can be built from the run, or a port can't be made.
    pub fn new(run: &RunSpec, transport: &T) -> Result<Self, BuildBridgeError> {
        let ports = |robot| {
            Ok(RobotPorts {
                sensors: transport.publisher(robot)?,
                truth: transport.publisher(robot)?,
                command: transport.subscriber(robot)?,
            })
        };
        let robots = (0..run.robots.len()).map(ports).collect::<Result<Vec<_>, ConnectError>>()?;
        let frame = Frame::zeroed();
        Ok(Self {
            world: World::new(run)?,
            commands: vec![frame.payload; robots.len()],
            frame,
            robots,
            object_truth: transport.publisher(0)?,
        })
    }

    /// The world.
    pub fn world(&self) -> &World {
        &self.world
    }

    fn publish(&mut self, tick: u64) -> Result<(), TickError> {
        if self.world.tick() != tick {
            return Err(TickError::Service("the world is at another tick"));
        }
        for (robot, ports) in self.robots.iter_mut().enumerate() {
            let mut loan = ports.sensors.loan(tick)?;
            self.world.sense(robot, loan.payload_mut());
            loan.send()?;
        }
        for (robot, ports) in self.robots.iter_mut().enumerate() {
            let mut loan = ports.truth.loan(tick)?;
            self.world.robot_truth(robot, loan.payload_mut());
            loan.send()?;
        }
        let mut loan = self.object_truth.loan(tick)?;
        self.world.object_truth(loan.payload_mut());
        loan.send()
    }

    fn step(&mut self, tick: u64) -> Result<(), TickError> {
        for (ports, command) in self.robots.iter_mut().zip(&mut self.commands) {
            ports.command.receive(tick, &mut self.frame)?;
            *command = self.frame.payload;
        }
        self.world.step(&self.commands).map_err(|error| TickError::Service(error.text()))
    }
}

impl<T: Transport> Participant for BridgeParticipant<T> {
    fn id(&self) -> ServiceId {
        ServiceId::Bridge
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Publish => self.publish(tick),
            Call::Step => self.step(tick),
            _ => Err(TickError::UnknownCall),
        }
    }
}
