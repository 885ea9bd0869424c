//! `/robot/NAME/joint_states` and `joint_references`: what encoders and drives say, and what they are told.

use crate::convert::timestamp;
use crate::topic::Topic;
use foxglove::messages::{JointState, JointStates};
use mikoshi_humanoid::Model;
use mikoshi_ipc_types::{JointCommand, Sensors};
use mikoshi_observation::{LogWriter, Observation, WriteLogError};

/// The joints of one robot.
pub struct Joints {
    robot: usize,
    states: Topic<JointStates>,
    references: Topic<JointStates>,
    names: Vec<String>,
}

impl Joints {
    pub fn add(log: &mut LogWriter, robot: usize, name: &str, model: &Model) -> Result<Self, WriteLogError> {
        Ok(Self {
            robot,
            states: Topic::add(log, &format!("/robot/{name}/joint_states"))?,
            references: Topic::add(log, &format!("/robot/{name}/joint_references"))?,
            names: model.joints().iter().map(|joint| joint.name.clone()).collect(),
        })
    }

    pub fn write(
        &self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let tick = observation.tick();
        self.states.write(log, tick, &self.states_of(time_ns, &observation.sensors[self.robot].payload))?;
        let references = self.references_of(time_ns, &observation.joint_command[self.robot].payload);
        self.references.write(log, tick, &references)
    }

    fn states_of(&self, time_ns: u64, sensors: &Sensors) -> JointStates {
        let joint = |(index, name): (usize, &String)| JointState {
            name: name.clone(),
            position: sensors.joint_position_rad.get(index).copied(),
            velocity: sensors.joint_velocity_rad_s.get(index).copied(),
            acceleration: None,
            effort: sensors.joint_torque_nm.get(index).copied(),
        };
        let joints = self.names.iter().enumerate().map(joint).collect();
        JointStates { timestamp: Some(timestamp(time_ns)), joints }
    }

    fn references_of(&self, time_ns: u64, command: &JointCommand) -> JointStates {
        let joint = |(index, name): (usize, &String)| JointState {
            name: name.clone(),
            position: command.joint_position_ref_rad.get(index).copied(),
            velocity: command.joint_velocity_ref_rad_s.get(index).copied(),
            acceleration: None,
            effort: None,
        };
        let joints = self.names.iter().enumerate().map(joint).collect();
        JointStates { timestamp: Some(timestamp(time_ns)), joints }
    }
}
