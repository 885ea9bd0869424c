//! What several tests share.
#![allow(dead_code)] // each test uses its part

use mikoshi_humanoid::Model;

/// The URDF of HRP-2.
pub const HRP2_URDF: &str = include_str!("../../../../config/robots/hrp2.urdf");

/// HRP-2.
pub fn hrp2() -> Model {
    Model::from_urdf(HRP2_URDF, &|_| None).expect("the repository's own description is valid")
}
