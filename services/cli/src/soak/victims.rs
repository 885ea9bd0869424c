//! Who is killed when, drawn by seed.

use mikoshi_ipc_types::ServiceId;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// What happens to a run in one tick.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Strike {
    /// When, by the bridge's tick.
    pub tick: u64,
    /// Who: one service, or two at once.
    pub victims: Vec<ServiceId>,
    /// Whether their successors are killed as soon as they are in charge.
    pub is_repeated: bool,
}

/// Draws `count` strikes at services of a team over a run of `ticks`, in order of time. Every third is at two
/// services at once, every fourth at the successors, too.
pub fn draw(seed: u64, count: usize, ticks: u64, robots: usize) -> Vec<Strike> {
    let mut random = Pcg64::seed_from_u64(seed);
    let services: Vec<_> = ServiceId::of_team(robots).collect();
    let mut strikes: Vec<_> = (0..count)
        .map(|index| {
            let first = random.random_range(0..services.len());
            let other = (first + random.random_range(1..services.len())) % services.len();
            let victims =
                if index % 3 == 2 { vec![services[first], services[other]] } else { vec![services[first]] };
            // Not in the last ticks: a process that has ended can't be killed.
            let tick = random.random_range(0..ticks.saturating_sub(20).max(1));
            Strike { tick, victims, is_repeated: index % 4 == 3 }
        })
        .collect();
    strikes.sort_by_key(|strike| strike.tick);
    strikes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn strikes_are_a_function_of_the_seed_and_hit_everybody() {
        let strikes = draw(3, 200, 8000, 4);
        assert_eq!(strikes, draw(3, 200, 8000, 4));
        assert_ne!(strikes, draw(4, 200, 8000, 4));
        assert!(strikes.is_sorted_by_key(|strike| strike.tick) && strikes.len() == 200);
        for service in ServiceId::of_team(4) {
            assert!(strikes.iter().any(|strike| strike.victims.contains(&service)), "{service}");
        }
        assert!(
            strikes.iter().all(|strike| strike.victims.len() == 1 || strike.victims[0] != strike.victims[1])
        );
        assert!(strikes.iter().all(|strike| strike.tick < 8000));
    }
}
