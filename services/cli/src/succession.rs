//! Who gets a successor, and when: a service that dies is started anew, later each time and not for ever.

use crate::wall_clock::Stopwatch;
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::Position;
use std::collections::BTreeMap;

/// Before a service is started anew that has died before in the same phase; twice as long each time.
const FIRST_PAUSE: Duration = Duration::from_millis(50);
const LONGEST_PAUSE: Duration = Duration::from_secs(2);

/// What is known of the deaths in a run.
#[derive(Debug)]
pub struct Succession {
    /// How often a service may die in a phase.
    limit: u32,
    deaths: BTreeMap<ServiceId, Deaths>,
    due: Vec<Due>,
}

/// Deaths of one service in one phase.
#[derive(Clone, Copy, Debug, Default)]
struct Deaths {
    at: Position,
    count: u32,
}

/// A service that is to be started anew.
#[derive(Debug)]
struct Due {
    service: ServiceId,
    at: Position,
    cause: String,
    since_death: Stopwatch,
    pause: Duration,
}

/// A service whose time has come.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Vacancy {
    /// Which.
    pub service: ServiceId,
    /// Where its predecessor died.
    pub at: Position,
    /// Of what.
    pub cause: String,
}

impl Succession {
    /// A service may die so often in a phase; with 0 it may not die at all.
    pub fn with_limit(limit: u32) -> Self {
        Self { limit, deaths: BTreeMap::new(), due: Vec::new() }
    }

    /// Whether any death is made good for.
    pub fn is_promised(&self) -> bool {
        self.limit > 0
    }

    /// Whether a successor of this service is on its way.
    pub fn is_due(&self, service: ServiceId) -> bool {
        self.due.iter().any(|due| due.service == service)
    }

    /// Takes note of a death in this phase; `false` if it was one too many.
    #[must_use]
    pub fn take_note(&mut self, service: ServiceId, at: Position, cause: String) -> bool {
        let deaths = self.deaths.entry(service).or_default();
        if deaths.at != at {
            *deaths = Deaths { at, count: 0 };
        }
        deaths.count += 1;
        if deaths.count > self.limit {
            return false;
        }
        let pause = match deaths.count {
            1 => Duration::ZERO,
            // Where it has died before, it may need time for what it lacks.
            again => FIRST_PAUSE.saturating_mul(1 << (again - 2).min(16)).min(LONGEST_PAUSE),
        };
        self.due.push(Due { service, at, cause, since_death: Stopwatch::start(), pause });
        true
    }

    /// The next service whose pause is over.
    pub fn next(&mut self) -> Option<Vacancy> {
        let index = self.due.iter().position(|due| due.since_death.elapsed() >= due.pause)?;
        let Due { service, at, cause, .. } = self.due.swap_remove(index);
        Some(Vacancy { service, at, cause })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SERVICE: ServiceId = ServiceId::Servo(1);

    fn at(tick: u64) -> Position {
        Position { tick, phase: 1 }
    }

    #[test]
    fn who_gets_on_may_die_again_and_who_does_not_may_not() {
        let mut succession = Succession::with_limit(2);
        for tick in 0..100 {
            assert!(succession.take_note(SERVICE, at(tick), String::new()));
        }
        assert!(succession.take_note(SERVICE, at(99), String::new()));
        assert!(!succession.take_note(SERVICE, at(99), String::new()));
        assert!(succession.take_note(ServiceId::Bridge, at(99), String::new()), "another one's deaths");
    }

    #[test]
    fn nobody_may_die_where_nothing_is_promised() {
        let mut succession = Succession::with_limit(0);
        assert!(!succession.is_promised());
        assert!(!succession.take_note(SERVICE, at(0), String::new()));
        assert_eq!(succession.next(), None);
    }

    #[test]
    fn the_first_successor_comes_at_once_and_later_ones_take_their_time() {
        let mut succession = Succession::with_limit(100);
        assert!(succession.take_note(SERVICE, at(3), "killed".to_owned()));
        let expected = Vacancy { service: SERVICE, at: at(3), cause: "killed".to_owned() };
        assert_eq!(succession.next(), Some(expected));
        let mut pauses = vec![];
        for _ in 0..40 {
            assert!(succession.take_note(SERVICE, at(3), String::new()));
            pauses.push(succession.due.pop().expect("it was noted").pause);
        }
        assert_eq!(pauses[..3], [FIRST_PAUSE, 2 * FIRST_PAUSE, 4 * FIRST_PAUSE]);
        assert_eq!(pauses[39], LONGEST_PAUSE);
    }
}
