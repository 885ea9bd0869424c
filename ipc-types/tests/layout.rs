//! The layout of what travels. Where a number here changes, processes of before and after no longer
//! understand each other: that is what their schema hashes say.

use mikoshi_ipc_types::{
    Audience, Envelope, Field, Frame, JointCommand, MAX_FEET, MAX_HANDS, MAX_HANDS_OF_TEAM, MAX_JOINTS,
    MAX_ROBOTS, ObjectTruth, Payload, RobotState, RobotTruth, Scalar, Sensors, TeamCommand, TeamState,
    schema_hash,
};

/// Asks the same of every payload.
macro_rules! for_every_payload {
    ($question:ident) => {
        $question::<Sensors>();
        $question::<RobotState>();
        $question::<TeamCommand>();
        $question::<JointCommand>();
        $question::<TeamState>();
        $question::<ObjectTruth>();
        $question::<RobotTruth>();
    };
}

#[test]
fn fields_cover_their_payload_without_gaps() {
    fn question<P: Payload>() {
        let mut end = 0;
        for field in P::FIELDS {
            assert_eq!(field.offset_bytes, end, "{}: {}", P::NAME, field.name);
            assert!(
                field.size_bytes > 0 && field.size_bytes.is_multiple_of(8),
                "{}: {}",
                P::NAME,
                field.name
            );
            end += field.size_bytes;
        }
        assert_eq!(end, size_of::<P>(), "{}", P::NAME);
    }
    for_every_payload!(question);
}

#[test]
fn a_frame_is_its_envelope_and_its_payload() {
    fn question<P: Payload>() {
        assert_eq!(core::mem::offset_of!(Frame<P>, envelope), 0);
        assert_eq!(core::mem::offset_of!(Frame<P>, payload), 64);
        assert_eq!(size_of::<Frame<P>>(), 64 + size_of::<P>());
        assert_eq!(align_of::<Frame<P>>(), 8);
    }
    for_every_payload!(question);
}

#[test]
fn the_envelope_is_laid_out_as_it_is_written_down() {
    assert_eq!(core::mem::offset_of!(Envelope, schema_hash), 0);
    assert_eq!(core::mem::offset_of!(Envelope, epoch), 8);
    assert_eq!(core::mem::offset_of!(Envelope, tick), 16);
    assert_eq!(core::mem::offset_of!(Envelope, robot), 24);
    assert_eq!(core::mem::offset_of!(Envelope, stamp_ns), 32);
    assert_eq!(core::mem::offset_of!(Envelope, heard_ns), 40);
    assert_eq!(core::mem::offset_of!(Envelope, kept_ns), 48);
    assert_eq!(core::mem::offset_of!(Envelope, due_ns), 56);
    assert_eq!(size_of::<Envelope>(), 64);
}

#[test]
fn sizes_follow_from_the_limits() {
    let word = size_of::<f64>();
    assert_eq!(
        size_of::<Sensors>(),
        word * (3 * MAX_JOINTS + 6 * MAX_HANDS + 6 * MAX_FEET + 3 + 3 + 3),
        "three values by joint, wrists, ankles, gyroscope, accelerometer, hands that hold, two words on the command"
    );
    assert_eq!(
        size_of::<TeamCommand>(),
        word * ((7 + 6 + 6) * MAX_HANDS + 4 + 3),
        "poses, twists and wrenches by hand, step clock, hands to close, mode, tick"
    );
    assert_eq!(
        size_of::<JointCommand>(),
        word * (3 * MAX_JOINTS + 4),
        "two values by joint, hands to close, tick; a part of a plan, when, a value by joint"
    );
    assert_eq!(
        size_of::<TeamState>(),
        word * ((2 * 6 + 1) * MAX_HANDS_OF_TEAM
            + 2 * 7
            + 6
            + 1
            + 4
            + 1
            + 3
            + (1 + 7) * MAX_ROBOTS
            + 2
            + 8
            + 3
            + 2 * (1 + 3 + 6)
            + MAX_ROBOTS
            + 1
            + 3 * MAX_ROBOTS
            + 1),
        "two wrenches by row, two poses, twist, share, step clock, mode, operator, cause and robot of a stop, tick and frame by robot, slip by hand, lost hands and why, what was said last by whoever drives, silence, squeeze, awaited word, mass, centre and inertia of the load with their deviations, share by robot, relief, stage, fault and weight by robot, hands that are away"
    );
    assert_eq!(
        size_of::<ObjectTruth>(),
        word * (7 + 6 + 6 + 1 + 2 + 1 + 3 + 6),
        "pose, twist, support, contacts, their first pair, robots, push, the last push that was heard of"
    );
}

#[test]
fn a_byte_is_named_by_the_field_that_holds_it() {
    let name_at = |offset| Sensors::field_at(offset).map(|field| field.name);
    assert_eq!(name_at(0), Some("joint_position_rad"));
    assert_eq!(name_at(8 * MAX_JOINTS - 1), Some("joint_position_rad"));
    assert_eq!(name_at(8 * MAX_JOINTS), Some("joint_velocity_rad_s"));
    assert_eq!(name_at(size_of::<Sensors>() - 1), Some("next_joint_command_tick"));
    assert_eq!(name_at(size_of::<Sensors>()), None);
}

#[test]
fn names_and_hashes_are_unique_and_the_type_name_carries_the_hash() {
    let mut names = Vec::new();
    let mut hashes = Vec::new();
    fn collect<P: Payload>(names: &mut Vec<&str>, hashes: &mut Vec<u64>) {
        assert_eq!(P::TYPE_NAME, format!("{}:{:016x}", P::NAME, P::SCHEMA_HASH));
        names.push(P::NAME);
        hashes.push(P::SCHEMA_HASH);
    }
    macro_rules! all {
        ($($payload:ty),*) => { $( collect::<$payload>(&mut names, &mut hashes); )* };
    }
    all!(Sensors, RobotState, TeamCommand, JointCommand, TeamState, ObjectTruth, RobotTruth);
    names.sort_unstable();
    names.dedup();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!((names.len(), hashes.len()), (7, 7));
}

const FIELDS: &[Field] = &[
    Field { name: "a", scalar: Scalar::Float, offset_bytes: 0, size_bytes: 8 },
    Field { name: "b", scalar: Scalar::Integer, offset_bytes: 8, size_bytes: 8 },
];

#[test]
fn whatever_changes_in_a_payload_changes_its_hash() {
    let hash = schema_hash("name", "a:f64;b:u64;", FIELDS);
    assert_eq!(hash, schema_hash("name", "a:f64;b:u64;", FIELDS), "it is a function");
    let renamed = schema_hash("other", "a:f64;b:u64;", FIELDS);
    let field_renamed = schema_hash("name", "x:f64;b:u64;", FIELDS);
    let swapped = schema_hash("name", "b:u64;a:f64;", FIELDS);
    let retyped = schema_hash("name", "a:f64;b:f64;", FIELDS);
    // The same text under another limit: two fields shift at the same total size.
    let shifted = [FIELDS[0], Field { offset_bytes: 16, ..FIELDS[1] }];
    let shifted = schema_hash("name", "a:f64;b:u64;", &shifted);
    let grown = [Field { size_bytes: 16, ..FIELDS[0] }, FIELDS[1]];
    let grown = schema_hash("name", "a:f64;b:u64;", &grown);
    for other in [renamed, field_renamed, swapped, retyped, shifted, grown] {
        assert_ne!(other, hash);
    }
}

#[test]
fn ground_truth_and_diagnostics_are_for_observers() {
    let audiences = [
        (Sensors::AUDIENCE, Audience::Everyone),
        (RobotState::AUDIENCE, Audience::Everyone),
        (TeamCommand::AUDIENCE, Audience::Everyone),
        (JointCommand::AUDIENCE, Audience::Everyone),
        (TeamState::AUDIENCE, Audience::Observers),
        (ObjectTruth::AUDIENCE, Audience::Observers),
        (RobotTruth::AUDIENCE, Audience::Observers),
    ];
    for (is, should_be) in audiences {
        assert_eq!(is, should_be);
    }
}

/// Writes a bit pattern over one word of a payload.
fn with_word<P: Payload>(index: usize, bits: u64) -> P {
    let mut payload = P::zeroed();
    bytemuck::cast_slice_mut::<u8, u64>(bytemuck::bytes_of_mut(&mut payload))[index] = bits;
    payload
}

#[test]
fn every_float_that_is_not_finite_is_found_and_named() {
    fn question<P: Payload>() {
        assert_eq!(P::zeroed().first_non_finite(), None);
        for word in 0..size_of::<P>() / 8 {
            let field = P::field_at(8 * word).expect("fields cover it");
            for value in [f64::NAN, -f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let found = with_word::<P>(word, value.to_bits()).first_non_finite();
                // In an integer any pattern is a value.
                let expected = (field.scalar == Scalar::Float).then_some(field);
                assert_eq!(found, expected, "{} word {word}", P::NAME);
            }
            for value in [f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -0.0] {
                assert_eq!(with_word::<P>(word, value.to_bits()).first_non_finite(), None, "{value:e}");
            }
        }
    }
    for_every_payload!(question);
}
