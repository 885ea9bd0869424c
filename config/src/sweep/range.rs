//! A key whose value every run draws.

use serde::{Deserialize, Serialize};

/// A key of the scenario whose value is drawn, evenly between two limits.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ParameterRange {
    /// The key's full path.
    pub key: String,
    /// The least value.
    pub min: f64,
    /// The largest value.
    pub max: f64,
    /// Whether only whole numbers are drawn, both limits among them.
    #[serde(default)]
    pub whole: bool,
}

impl ParameterRange {
    /// The value of the run with this seed. It depends on seed and key only: other ranges may come and go.
    pub fn draw(&self, seed: u64) -> f64 {
        let hash = blake3::hash(format!("{seed} {}", self.key).as_bytes());
        let bits = hash.as_bytes()[..8].iter().fold(0_u64, |bits, byte| bits << 8 | u64::from(*byte));
        // The 53 bits that an f64 in [0, 1) has room for.
        let share = (bits >> 11) as f64 * (1.0 / (1_u64 << 53) as f64);
        match self.whole {
            true => (self.min + (share * (self.max - self.min + 1.0)).floor()).min(self.max),
            false => (self.min + share * (self.max - self.min)).min(self.max),
        }
    }
}
