//! What several tests share.
#![allow(dead_code)] // each test uses its part

use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::{IkConfig, IkGains, IkScratch, IkState, IkTargets, Model, WholeBodyIk};
use mikoshi_spatial::Pose;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// The URDF of HRP-2.
pub const HRP2_URDF: &str = include_str!("../../../../config/robots/hrp2.urdf");

/// HRP-2.
pub fn hrp2() -> Model {
    Model::from_urdf(HRP2_URDF, &|_| None).expect("the repository's own description is valid")
}

/// What these tests need of HRP-2's configuration.
#[derive(serde::Deserialize)]
struct Configuration {
    hands: Vec<Hand>,
    carry_posture_deg: BTreeMap<String, f64>,
}

#[derive(serde::Deserialize)]
struct Hand {
    carry_position_m: [f64; 3],
    carry_rotation: [[f64; 3]; 3],
}

fn configuration() -> Configuration {
    let text = include_str!("../../../../config/robots/hrp2.toml");
    toml::from_str(text).expect("the repository's own configuration is valid")
}

/// HRP-2's joint angles while it carries, from its configuration.
pub fn carry_posture(model: &Model) -> Vec<f64> {
    let angles = configuration().carry_posture_deg;
    model.joints().iter().map(|joint| angles[&joint.name].to_radians()).collect()
}

/// HRP-2 as it carries, and what it should hold to.
pub struct Carrying {
    pub model: Model,
    pub ik: WholeBodyIk,
    pub scratch: IkScratch,
    pub targets: IkTargets,
}

/// HRP-2's whole-body inverse kinematics at 200 Hz, with the references of its configuration: feet
/// 0.19 m apart, centre of mass 0.79 m above the middle between the ankles.
pub fn carrying() -> Carrying {
    let model = hrp2();
    let frame = |name| model.find_frame(name).expect("the description has it");
    let config = IkConfig {
        hands: vec![frame("r_palm"), frame("l_palm")],
        feet: PerFoot { right: frame("r_sole"), left: frame("l_sole") },
        waist: frame("BODY"),
        posture: carry_posture(&model),
        period_s: 0.005,
        gains: IkGains::default(),
    };
    let palm = |hand: &Hand| {
        let rotation = Matrix3::from_fn(|row, column| hand.carry_rotation[row][column]);
        Some(Pose::new(hand.carry_position_m.into(), UnitQuaternion::from_matrix(&rotation)))
    };
    let hands = &configuration().hands;
    let targets = IkTargets {
        stance: Side::Right,
        feet: PerFoot::from_fn(|side| {
            Pose::new(Vector3::new(0.0, 0.095 * side.sign(), 0.0), UnitQuaternion::identity())
        }),
        com: Vector3::new(0.0, 0.0, 0.79),
        waist_attitude: UnitQuaternion::identity(),
        hands: [palm(&hands[0]), palm(&hands[1]), None, None],
    };
    let ik = WholeBodyIk::new(&model, config).expect("a valid configuration");
    Carrying { scratch: IkScratch::new(&model), model, ik, targets }
}

/// The same, at rest where it should be.
pub fn settled() -> (Carrying, IkState) {
    let mut setup = carrying();
    let posture = setup.ik.config().posture.clone();
    let state = setup.ik.settle(&setup.model, &mut setup.scratch, &posture, &setup.targets);
    (setup, state.expect("the carry posture is within reach"))
}
