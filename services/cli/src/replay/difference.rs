//! Where two payloads part.

use core::fmt;
use mikoshi_ipc_types::{Payload, Scalar};
use mikoshi_runtime::Topic;

/// The first word in which what a service says differs from what it said.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// In which frame.
    pub topic: Topic,
    /// In which of its fields.
    pub field: &'static str,
    /// In which of the field's numbers.
    pub index: usize,
    scalar: Scalar,
    recorded: u64,
    replayed: u64,
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { topic, field, index, recorded, replayed, .. } = self;
        write!(f, "{topic}.{field}[{index}]: recorded ")?;
        match self.scalar {
            Scalar::Integer => write!(f, "{recorded}, replayed {replayed}"),
            // Of two floats that are printed alike the bits tell the difference.
            Scalar::Float => {
                let (from, to) = (f64::from_bits(*recorded), f64::from_bits(*replayed));
                write!(f, "{from} ({recorded:016x}), replayed {to} ({replayed:016x})")
            }
        }
    }
}

/// The first word in which `replayed` is not `recorded`.
pub fn first_difference<P: Payload>(recorded: &P, replayed: &P, topic: Topic) -> Option<Difference> {
    let words = |payload| bytemuck::cast_slice::<u8, u64>(bytemuck::bytes_of::<P>(payload));
    let pairs = words(recorded).iter().zip(words(replayed));
    let (at, (&recorded, &replayed)) = pairs.enumerate().find(|(_, (one, other))| one != other)?;
    let field = P::field_at(at * size_of::<u64>())?;
    let index = at - field.offset_bytes / size_of::<u64>();
    Some(Difference { topic, field: field.name, index, scalar: field.scalar, recorded, replayed })
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use mikoshi_ipc_types::JointCommand;

    const TOPIC: Topic = Topic::of::<JointCommand>(2);

    #[test]
    fn payloads_that_are_alike_to_the_last_bit_do_not_differ() {
        let mut command = JointCommand::zeroed();
        assert_eq!(first_difference(&command, &command, TOPIC), None);
        command.joint_velocity_ref_rad_s[3] = f64::NAN;
        assert_eq!(first_difference(&command, &command, TOPIC), None, "a NaN is itself");
    }

    #[test]
    fn every_flipped_bit_is_found_and_named() {
        let recorded = JointCommand::zeroed();
        for bit in 0..8 * size_of::<JointCommand>() {
            let mut replayed = recorded;
            bytemuck::bytes_of_mut(&mut replayed)[bit / 8] ^= 1 << (bit % 8);
            let found = first_difference(&recorded, &replayed, TOPIC).expect("a bit was flipped");
            let expected = JointCommand::field_at(bit / 8).expect("there is no padding");
            assert_eq!((found.field, found.index), (expected.name, bit / 64 - expected.offset_bytes / 8));
        }
    }

    #[test]
    fn a_difference_says_where_it_is() {
        let recorded = JointCommand::zeroed();
        let mut replayed = recorded;
        replayed.joint_position_ref_rad[7] = -0.5;
        let told = first_difference(&recorded, &replayed, TOPIC).expect("it differs").to_string();
        let expected = "joint-command[2].joint_position_ref_rad[7]: recorded 0 (0000000000000000), \
                        replayed -0.5 (bfe0000000000000)";
        assert_eq!(told, expected);
        replayed = recorded;
        replayed.closed_hands = 3;
        let told = first_difference(&recorded, &replayed, TOPIC).expect("it differs").to_string();
        assert_eq!(told, "joint-command[2].closed_hands[0]: recorded 0, replayed 3");
    }
}
