//! The object's reference velocity: what is given, and what is drawn by seed.

use mikoshi_config::scenario::{Motion, RandomMotion, Segment};
use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// Every segment of a motion, drawn ones included.
pub(crate) fn segments(motion: &Motion, seed: u64) -> Vec<Segment> {
    let drawn = motion.random.iter().flat_map(|random| drawn_segments(random, seed));
    motion.segments.iter().copied().chain(drawn).collect()
}

/// Departures of each axis are uniform, less their mean: they change the way and not where it ends.
fn drawn_segments(random: &RandomMotion, seed: u64) -> Vec<Segment> {
    let mut generator = Pcg64::seed_from_u64(seed);
    let mut uniform = || 2.0 * (generator.next_u64() >> 11) as f64 / (1u64 << 53) as f64 - 1.0;
    let count = (random.duration_s / random.change_s).round() as usize;
    let at_rest =
        Segment { duration_s: random.change_s, velocity_m_s: [0.0; 3], angular_velocity_rad_s: [0.0; 3] };
    let mut segments = vec![at_rest; count];
    for axis in 0..6 {
        let (travel, deviation) = match axis {
            0..3 => (random.travel_m[axis], random.deviation_m_s[axis]),
            _ => (random.travel_rad[axis - 3], random.deviation_rad_s[axis - 3]),
        };
        let mean = travel / random.duration_s * uniform().signum();
        let departures: Vec<f64> = (0..count).map(|_| deviation * uniform()).collect();
        let mean_departure = departures.iter().sum::<f64>() / count as f64;
        for (segment, departure) in segments.iter_mut().zip(departures) {
            let velocity = mean + departure - mean_departure;
            match axis {
                0..3 => segment.velocity_m_s[axis] = velocity,
                _ => segment.angular_velocity_rad_s[axis - 3] = velocity,
            }
        }
    }
    segments
}

#[cfg(test)]
mod tests {
    use super::*;

    const RANDOM: RandomMotion = RandomMotion {
        duration_s: 12.0,
        change_s: 3.0,
        travel_m: [1.1, -0.3, 0.0],
        travel_rad: [0.0, 0.0, 0.5],
        deviation_m_s: [0.02, 0.02, 0.01],
        deviation_rad_s: [0.005, 0.005, 0.01],
    };

    fn way(segments: &[Segment]) -> [f64; 6] {
        let mut way = [0.0; 6];
        for segment in segments {
            for axis in 0..3 {
                way[axis] += segment.duration_s * segment.velocity_m_s[axis];
                way[axis + 3] += segment.duration_s * segment.angular_velocity_rad_s[axis];
            }
        }
        way
    }

    #[test]
    fn drawn_velocities_change_and_cover_the_way() {
        for seed in 0..20 {
            let segments = drawn_segments(&RANDOM, seed);
            assert_eq!(segments.len(), 4);
            for (covered, asked) in way(&segments).iter().zip([1.1, 0.3, 0.0, 0.0, 0.0, 0.5]) {
                assert!((covered.abs() - asked).abs() < 1e-12, "{covered} {asked}");
            }
            assert!(segments.windows(2).all(|pair| pair[0].velocity_m_s != pair[1].velocity_m_s));
            assert_eq!(segments, drawn_segments(&RANDOM, seed));
            assert_ne!(segments, drawn_segments(&RANDOM, seed + 1));
        }
    }

    #[test]
    fn all_ways_are_drawn() {
        let ends: Vec<_> = (0..20).map(|seed| way(&drawn_segments(&RANDOM, seed))).collect();
        for axis in [0, 1, 5] {
            assert!(ends.iter().any(|way| way[axis] > 0.0) && ends.iter().any(|way| way[axis] < 0.0));
        }
    }
}
