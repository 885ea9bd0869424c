//! Who bears how much of the object.

use serde::{Deserialize, Serialize};

/// How the team bears what it carries.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct LoadSharing {
    /// Moment up to which hands bear what internal forces of zero bring, the paper's way: each its force times the length
    /// of its stick. Of a load that brings more they are relieved, wholly from twice as much on: internal references are
    /// then those of hands that lift by forces alone.
    pub hand_moment_nm: f64,
    /// Parts of the load that robots bear, as numbers of any size; by what each says that it can bear where there are none.
    pub shares: Vec<f64>,
}

impl Default for LoadSharing {
    fn default() -> Self {
        Self { hand_moment_nm: 4.0, shares: vec![] }
    }
}
