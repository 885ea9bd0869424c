//! States of services as bytes, for checkpoints.

use crate::TickError;
use bincode::config::{Configuration, Fixint, LittleEndian};
use serde::Serialize;
use serde::de::DeserializeOwned;
use xxhash_rust::xxh3::xxh3_64;

/// Every number in full: the same state takes the same time in every tick.
const CODE: Configuration<LittleEndian, Fixint> = bincode::config::standard().with_fixed_int_encoding();

/// Writes a state to the beginning of `bytes`, and returns how much that is. It allocates nothing.
///
/// # Errors
/// There is too little room.
pub fn write_state<T: Serialize>(state: &T, bytes: &mut [u8]) -> Result<usize, TickError> {
    bincode::serde::encode_into_slice(state, bytes, CODE)
        .map_err(|_| TickError::Checkpoint("the state is larger than it said"))
}

/// Reads a state that [`write_state`] wrote, and nothing else.
///
/// # Errors
/// These bytes are not of such a state.
pub fn read_state<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, TickError> {
    let read = bincode::serde::decode_from_slice(bytes, CODE);
    read.ok()
        .filter(|(_, length)| *length == bytes.len())
        .map(|(state, _)| state)
        .ok_or(TickError::Checkpoint("the state can't be read"))
}

/// Writes these parts of a state, one after the other, to the beginning of `bytes`, and returns how much that
/// is. It allocates nothing.
///
/// # Errors
/// There is too little room.
pub fn write_parts<'a>(
    parts: impl IntoIterator<Item = &'a mut [u8]>,
    bytes: &mut [u8],
) -> Result<usize, TickError> {
    let mut length = 0;
    for part in parts {
        let room = bytes.get_mut(length..length + part.len());
        room.ok_or(TickError::Checkpoint("no room"))?.copy_from_slice(part);
        length += part.len();
    }
    Ok(length)
}

/// Reads what [`write_parts`] wrote of parts of the same lengths, which are `bytes` long together.
///
/// # Errors
/// There are fewer bytes: then the first parts may have been read.
pub fn read_parts<'a>(parts: impl IntoIterator<Item = &'a mut [u8]>, bytes: &[u8]) -> Result<(), TickError> {
    let mut rest = bytes;
    for part in parts {
        let (head, tail) =
            rest.split_at_checked(part.len()).ok_or(TickError::Checkpoint("the state is too short"))?;
        part.copy_from_slice(head);
        rest = tail;
    }
    Ok(())
}

/// Names what a service keeps: its `name`, the `version` of its state's layout, and the frames that it keeps
/// beside it or the world that it is the state of.
pub fn state_schema(name: &str, version: u64, parts: &[u64]) -> u64 {
    let words = parts.iter().chain([&version]).flat_map(|word| word.to_le_bytes());
    xxh3_64(&name.bytes().chain(words).collect::<Vec<u8>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
    enum State {
        Standing(f64),
        Walking { step: u64, to: Option<[f64; 2]> },
    }

    const STATES: [State; 3] = [
        State::Standing(0.1),
        State::Walking { step: 3, to: None },
        State::Walking { step: 4, to: Some([-0.0, 1e-300]) },
    ];

    #[test]
    fn states_survive_to_the_last_bit() {
        for state in STATES {
            let mut bytes = [0xff; 64];
            let length = write_state(&state, &mut bytes).expect("there is room");
            assert_eq!(read_state(&bytes[..length]), Ok(state));
        }
    }

    #[test]
    fn what_is_cut_longer_or_something_else_is_no_state() {
        let mut bytes = [0; 64];
        let length = write_state(&STATES[2], &mut bytes).expect("there is room");
        for wrong in (0..64).filter(|wrong| *wrong != length) {
            assert!(read_state::<State>(&bytes[..wrong]).is_err(), "{wrong} bytes");
        }
        bytes[0] = 7;
        assert!(read_state::<State>(&bytes[..length]).is_err());
        assert!(write_state(&STATES[2], &mut bytes[..length - 1]).is_err());
    }

    #[test]
    fn parts_survive_and_what_is_too_short_for_them_is_an_error() {
        let (mut one, mut other) = ([1_u8, 2], [3_u8, 4, 5]);
        let mut bytes = [0xff; 6];
        assert_eq!(write_parts([&mut one[..], &mut other], &mut bytes), Ok(5));
        assert_eq!(bytes, [1, 2, 3, 4, 5, 0xff]);
        assert!(write_parts([&mut one[..], &mut other], &mut bytes[..4]).is_err());
        let (mut first, mut second) = ([0_u8; 2], [0_u8; 3]);
        assert_eq!(read_parts([&mut first[..], &mut second], &bytes[..5]), Ok(()));
        assert_eq!((first, second), (one, other));
        assert!(read_parts([&mut first[..], &mut second], &bytes[..4]).is_err());
    }

    #[test]
    fn schemas_differ_in_every_part() {
        let schemas = [("a", 1, [1, 2]), ("b", 1, [1, 2]), ("a", 2, [1, 2]), ("a", 1, [1, 3])];
        let schemas = schemas.map(|(name, version, parts)| state_schema(name, version, &parts));
        for (index, schema) in schemas.iter().enumerate() {
            assert_eq!(schemas.iter().position(|other| other == schema), Some(index));
        }
    }
}
