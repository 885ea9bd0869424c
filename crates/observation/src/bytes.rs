//! All frames of a tick as bytes, for observers in other processes of the same machine and build.

use crate::canonical::Observation;
use mikoshi_ipc_types::{
    Envelope, Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand,
    TeamState,
};

impl Observation {
    /// How many bytes the frames of a team take.
    pub fn size_bytes(robots: usize) -> usize {
        fn of<P: Payload>() -> usize {
            size_of::<Envelope>() + size_of::<P>()
        }
        let of_robot = of::<Sensors>()
            + of::<RobotTruth>()
            + of::<RobotState>()
            + of::<TeamCommand>()
            + of::<JointCommand>();
        robots * of_robot + of::<ObjectTruth>() + of::<TeamState>()
    }

    /// Appends all frames, envelopes and payloads, in canonical order.
    pub fn write_to(&self, bytes: &mut Vec<u8>) {
        fn put<P: Payload>(frames: &[Frame<P>], bytes: &mut Vec<u8>) {
            for frame in frames {
                bytes.extend_from_slice(bytemuck::bytes_of(&frame.envelope));
                bytes.extend_from_slice(bytemuck::bytes_of(&frame.payload));
            }
        }
        put(&self.sensors, bytes);
        put(core::slice::from_ref(&self.object_truth), bytes);
        put(&self.robot_truth, bytes);
        put(&self.robot_state, bytes);
        put(&self.team_command, bytes);
        put(core::slice::from_ref(&self.team_state), bytes);
        put(&self.joint_command, bytes);
    }

    /// Takes in what [`Observation::write_to`] wrote of a team of the same size; `false` if it is something else.
    pub fn read_from(&mut self, mut bytes: &[u8]) -> bool {
        fn take<P: Payload>(frames: &mut [Frame<P>], bytes: &mut &[u8]) -> Option<()> {
            for frame in frames {
                frame.envelope = bytemuck::pod_read_unaligned(bytes.split_off(..size_of::<Envelope>())?);
                frame.payload = bytemuck::pod_read_unaligned(bytes.split_off(..size_of::<P>())?);
                if frame.envelope.schema_hash != P::SCHEMA_HASH {
                    return None;
                }
            }
            Some(())
        }
        let rest = &mut bytes;
        let taken = take(&mut self.sensors, rest)
            .and_then(|()| take(core::slice::from_mut(&mut self.object_truth), rest))
            .and_then(|()| take(&mut self.robot_truth, rest))
            .and_then(|()| take(&mut self.robot_state, rest))
            .and_then(|()| take(&mut self.team_command, rest))
            .and_then(|()| take(core::slice::from_mut(&mut self.team_state), rest))
            .and_then(|()| take(&mut self.joint_command, rest));
        taken.is_some() && bytes.is_empty()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canonical::LogHash;

    fn some() -> Observation {
        let mut observation = Observation::for_team(3);
        observation.object_truth.envelope.tick = 7;
        observation.object_truth.envelope.stamp_ns = 123;
        observation.sensors[2].envelope.tick = 6;
        for (index, frame) in observation.joint_command.iter_mut().enumerate() {
            frame.envelope.tick = 7;
            frame.payload.joint_position_ref_rad[index] = 0.25 * index as f64;
        }
        observation
    }

    fn bytes_of(observation: &Observation) -> Vec<u8> {
        let mut bytes = vec![];
        observation.write_to(&mut bytes);
        bytes
    }

    fn hash_of(observation: &Observation) -> String {
        let mut hash = LogHash::default();
        hash.observe(observation);
        hash.to_hex()
    }

    #[test]
    fn what_is_written_is_read() {
        let (written, mut read) = (some(), Observation::for_team(3));
        let bytes = bytes_of(&written);
        assert_eq!(bytes.len(), Observation::size_bytes(3));
        assert!(read.read_from(&bytes));
        assert_eq!(hash_of(&read), hash_of(&written));
        assert_eq!(read.object_truth.envelope.stamp_ns, 123);
        assert!(!read.is_of_tick(&read.sensors[2]), "it was lost");
    }

    #[test]
    fn what_is_too_short_too_long_or_of_another_build_is_refused() {
        let bytes = bytes_of(&some());
        let mut read = Observation::for_team(3);
        assert!(!read.read_from(&bytes[..bytes.len() - 1]));
        assert!(!read.read_from(&[&bytes[..], &[0]].concat()));
        assert!(!Observation::for_team(2).read_from(&bytes));
        let mut other = bytes.clone();
        // The schema's hash comes first.
        other[0] ^= 1;
        assert!(!read.read_from(&other));
    }
}
