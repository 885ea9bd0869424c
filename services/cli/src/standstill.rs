//! Tells a run that stands still from one that is slow.

use core::time::Duration;

/// A look that comes later than this counts as no later: then it was we who did not run, and perhaps
/// nobody could.
const LONGEST_LOOK: Duration = Duration::from_millis(100);

/// How long nothing has moved.
#[derive(Debug, Default)]
pub struct Standstill {
    progress: u64,
    lasted: Duration,
}

impl Standstill {
    /// For how long `progress`, a number that changes with every move, has been the same. `elapsed` is
    /// the time since the last look.
    pub fn look(&mut self, progress: u64, elapsed: Duration) -> Duration {
        if progress == self.progress {
            self.lasted += elapsed.min(LONGEST_LOOK);
        } else {
            *self = Self { progress, lasted: Duration::ZERO };
        }
        self.lasted
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    #[test]
    fn time_adds_up_while_nothing_moves_and_a_move_ends_it() {
        let mut standstill = Standstill::default();
        assert_eq!(standstill.look(7, 50 * MS), Duration::ZERO);
        assert_eq!(standstill.look(7, 50 * MS), 50 * MS);
        assert_eq!(standstill.look(7, 30 * MS), 80 * MS);
        assert_eq!(standstill.look(8, 30 * MS), Duration::ZERO);
        assert_eq!(standstill.look(8, MS), MS);
    }

    #[test]
    fn a_machine_that_stood_still_as_a_whole_is_not_held_against_the_run() {
        let mut standstill = Standstill::default();
        assert_eq!(standstill.look(0, 3600 * 1000 * MS), LONGEST_LOOK);
    }
}
