//! How time is measured: in many rounds, so that what disturbs some of them disturbs no median; and where two are
//! compared, turn by turn, so that it disturbs both.

#![allow(clippy::disallowed_methods, reason = "a benchmark measures time")]

use serde::Serialize;
use std::time::{Duration, Instant};

const ROUNDS: usize = 400;
/// Of each side.
const ROUND: Duration = Duration::from_micros(200);

/// Of many measurements.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Spread {
    /// One of twenty is less.
    pub p5: f64,
    /// The one in the middle.
    pub median: f64,
    /// One of twenty is more.
    pub p95: f64,
    /// One of a hundred is more.
    pub p99: f64,
}

impl Spread {
    /// Of these, of which there is one at least.
    pub fn of(mut values: Vec<f64>) -> Self {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| values[((values.len() - 1) as f64 * share).round() as usize];
        Self { p5: at(0.05), median: at(0.5), p95: at(0.95), p99: at(0.99) }
    }
}

/// What two sides take for the same.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Comparison {
    /// Ours \[µs a call\].
    pub ours_us: Spread,
    /// The others' \[µs a call\].
    pub theirs_us: Spread,
    /// Ours over theirs, round by round.
    pub ratio: Spread,
}

/// Time that this takes \[µs\].
pub fn time_us<R>(call: impl FnOnce() -> R) -> f64 {
    let start = Instant::now();
    std::hint::black_box(call());
    start.elapsed().as_secs_f64() * 1e6
}

/// Calls of one side: so many, from the given one on.
pub type Calls<'a> = &'a mut dyn FnMut(usize, usize);

/// Time of a call \[µs\].
pub fn measure(calls: Calls) -> Spread {
    let count = calls_a_round(calls);
    Spread::of((0..ROUNDS).map(|round| us_a_call(calls, round, count)).collect())
}

/// Time of a call of either side, who take turns in being first.
pub fn compare(ours: Calls, theirs: Calls) -> Comparison {
    let (our_count, their_count) = (calls_a_round(ours), calls_a_round(theirs));
    let (mut us, mut them) = (vec![], vec![]);
    for round in 0..ROUNDS {
        if round % 2 == 0 {
            us.push(us_a_call(ours, round, our_count));
            them.push(us_a_call(theirs, round, their_count));
        } else {
            them.push(us_a_call(theirs, round, their_count));
            us.push(us_a_call(ours, round, our_count));
        }
    }
    let ratio = us.iter().zip(&them).map(|(us, them)| us / them).collect();
    Comparison { ours_us: Spread::of(us), theirs_us: Spread::of(them), ratio: Spread::of(ratio) }
}

fn us_a_call(calls: Calls, round: usize, count: usize) -> f64 {
    time_us(|| calls(round * count, count)) / count as f64
}

/// As many as take as long as a round does.
fn calls_a_round(calls: Calls) -> usize {
    let mut count = 1;
    while time_us(|| calls(0, count)) < ROUND.as_secs_f64() * 1e6 {
        count *= 2;
    }
    count
}
