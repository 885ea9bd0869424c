//! Runs of a sweep beside what the paper predicts of them: a figure, and what it shows in words that are
//! made of its numbers.

mod follower_delay;
mod time_to_edge;

pub use follower_delay::{FollowerDelay, LateRobot, LateRun};
pub use time_to_edge::{EdgeTime, TimeToEdge};

use crate::scene::Figure;
use serde::Serialize;

/// Runs beside a prediction.
#[derive(Clone, Debug, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ComparedRuns {
    /// Eq. 42 for followers that stand still.
    TimeToEdge(TimeToEdge),
    /// Section 4.1 over the follower's delay.
    FollowerDelay(FollowerDelay),
}

impl ComparedRuns {
    /// Whether all runs agree as they are required to; a comparison that only tells is always met.
    pub fn is_met(&self) -> bool {
        match self {
            Self::TimeToEdge(comparison) => comparison.is_met(),
            Self::FollowerDelay(_) => true,
        }
    }

    /// Where runs and prediction agree, and where not, in sentences.
    pub fn findings(&self) -> Vec<String> {
        match self {
            Self::TimeToEdge(comparison) => comparison.findings(),
            Self::FollowerDelay(comparison) => comparison.findings(),
        }
    }

    pub(crate) fn figure(&self) -> Figure {
        match self {
            Self::TimeToEdge(comparison) => comparison.figure(),
            Self::FollowerDelay(comparison) => comparison.figure(),
        }
    }
}

/// `1 run`, `2 runs`.
fn runs(count: usize) -> String {
    if count == 1 { "1 run".to_owned() } else { format!("{count} runs") }
}
