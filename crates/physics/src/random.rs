//! What is random in a world, by the run's seed and by place, so that nothing depends on the order in
//! which it is drawn.

use rand::{Rng, SeedableRng};
use rand_pcg::Pcg64;

/// What a generator is for. Streams of different purposes are independent.
#[derive(Clone, Copy)]
pub enum Purpose {
    /// Where a hand holds the object.
    GraspOffset,
    /// What a robot's sensors add to the truth.
    SensorNoise,
    /// What lies on the floor.
    Ground,
}

/// Numbers by place.
pub struct Draws(Pcg64);

impl Draws {
    /// The draws of one robot for one purpose.
    pub fn new(seed: u64, purpose: Purpose, robot: usize) -> Self {
        // The first outputs of neighbouring states resemble each other: the generator proper is seeded
        // by later ones.
        let mut rough = Pcg64::new(u128::from(seed) << 64 | (purpose as u128) << 32 | robot as u128, 0);
        rough.advance(16);
        let mut seed = [0; 32];
        rough.fill_bytes(&mut seed);
        Self(Pcg64::from_seed(seed))
    }

    /// The same draws from place `place` on.
    pub fn at_place(&self, place: u64) -> Self {
        let mut generator = self.0.clone();
        generator.advance(u128::from(place));
        Self(generator)
    }

    /// Uniform over [0, 1): one place.
    pub fn uniform(&mut self) -> f64 {
        // The 53 bits that an f64 in [0, 1) has room for.
        (self.0.next_u64() >> 11) as f64 * (1.0 / (1u64 << 53) as f64)
    }

    /// Of the normal distribution with deviation 1 (Box and Muller): two places.
    pub fn normal(&mut self) -> f64 {
        let (radius, angle) = (1.0 - self.uniform(), core::f64::consts::TAU * self.uniform());
        (-2.0 * radius.ln()).sqrt() * angle.cos()
    }
}

/// Places that [`Draws::normal`] takes.
pub const PLACES_OF_NORMAL: u64 = 2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_depend_on_seed_purpose_robot_and_place_only() {
        let first = |seed, purpose, robot| Draws::new(seed, purpose, robot).uniform();
        let all = [
            first(0, Purpose::GraspOffset, 0),
            first(1, Purpose::GraspOffset, 0),
            first(0, Purpose::SensorNoise, 0),
            first(0, Purpose::GraspOffset, 1),
        ];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| (a - b).abs() > 1e-3), "{all:?}");
        }
        let mut draws = Draws::new(0, Purpose::GraspOffset, 0);
        let start = draws.at_place(0);
        let drawn: Vec<f64> = (0..5).map(|_| draws.uniform()).collect();
        assert_eq!(start.at_place(3).uniform(), drawn[3]);
    }

    #[test]
    fn normal_draws_have_mean_0_and_deviation_1() {
        let mut draws = Draws::new(3, Purpose::SensorNoise, 2);
        let drawn: Vec<f64> = (0..20_000).map(|_| draws.normal()).collect();
        let mean = drawn.iter().sum::<f64>() / drawn.len() as f64;
        let variance = drawn.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / drawn.len() as f64;
        assert!(mean.abs() < 0.03 && (variance - 1.0).abs() < 0.05, "{mean} {variance}");
    }
}
