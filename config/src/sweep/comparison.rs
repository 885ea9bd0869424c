//! What runs are compared with beyond their thresholds.

use serde::{Deserialize, Serialize};

/// A prediction, of the paper or from it, that the runs of a sweep are laid beside.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Comparison {
    /// Eq. 42: when the zero moment point of a follower that stands still reaches the edge of its feet.
    TimeToEdge {
        /// How far the measured time may be from the predicted one, as a share of it.
        within: f64,
    },
    /// Section 4.1: how late a follower may start before the leader loses its balance.
    FollowerDelay {
        /// The delay with which the paper's leader falls.
        paper_falls_s: f64,
    },
}
