//! Frames that part are brought together by the object that all hold, and nothing else moves.

#![allow(non_snake_case)]

use mikoshi_cooperation::{BuildLandmarkError, Landmark, LandmarkParameters, Sighting};
use mikoshi_spatial::{Pose, Twist, World, log};
use nalgebra::Vector3;
use proptest::prelude::*;

const PARAMETERS: LandmarkParameters = LandmarkParameters {
    period_s: 0.005,
    time_constant_s: 4.0,
    height_time_constant_s: 1.0,
    height_tolerance_m: 0.002,
    limit_m_s: 0.01,
    limit_rad_s: 0.02,
};
const TICKS_OF_TIME_CONSTANT: usize = 800;
const TICKS_OF_HEIGHT_TIME_CONSTANT: usize = 200;

fn landmark() -> Landmark {
    Landmark::new(&PARAMETERS).expect("a landmark")
}

/// What m robots see of an object, by the tips that each of them has.
#[derive(Debug)]
struct Team {
    tips: Vec<Pose<World, World>>,
    weights: Vec<f64>,
}

impl Team {
    fn sightings(&self) -> Vec<Sighting> {
        let position: Vector3<f64> =
            self.tips.iter().zip(&self.weights).map(|(tip, weight)| tip.translation * *weight).sum();
        let mean = Pose::new(position, self.tips[0].rotation);
        let sighting = |(tip, &weight): (&Pose<World, World>, &f64)| Sighting {
            weight,
            tips: tip.translation,
            deviation: mean.displacement_to(tip),
        };
        self.tips.iter().zip(&self.weights).map(sighting).collect()
    }

    fn correct(&mut self, landmark: &Landmark) {
        let sightings = self.sightings();
        for (tip, correction) in self.tips.iter_mut().zip(landmark.corrections(&sightings)) {
            *tip = correction.motion() * *tip;
        }
    }

    fn mean(&self) -> (Vector3<f64>, f64) {
        let of = |value: fn(&Pose<World, World>) -> Vector3<f64>| -> Vector3<f64> {
            self.tips.iter().zip(&self.weights).map(|(tip, weight)| value(tip) * *weight).sum()
        };
        (of(|tip| tip.translation), of(|tip| log(&tip.rotation)).z)
    }

    /// Largest distance and angle between two robots' tips, on the ground.
    fn apart(&self) -> (f64, f64) {
        let pairs = || self.tips.iter().flat_map(|one| self.tips.iter().map(move |other| (one, other)));
        let gap = |(one, other): (&Pose<World, World>, &Pose<World, World>)| one.displacement_to(other);
        let distance = pairs().map(|pair| gap(pair).linear.xy().norm()).fold(0.0, f64::max);
        (distance, pairs().map(|pair| gap(pair).angular.z.abs()).fold(0.0, f64::max))
    }
}

fn teams() -> impl Strategy<Value = Team> {
    let robot = (
        prop::array::uniform3(-0.05..0.05_f64),
        -0.05..0.05_f64,
        prop::array::uniform3(-3.0..3.0_f64),
        1..=4_u32,
    );
    (prop::collection::vec(robot, 2..=16), prop::array::uniform3(-5.0..5.0_f64)).prop_map(|(robots, at)| {
        let arms: u32 = robots.iter().map(|robot| robot.3).sum();
        let tips = robots.iter().map(|(position, yaw, _, _)| {
            let position = Vector3::from(at) + Vector3::from(*position);
            Pose::identity().displaced(&Twist::new(position, Vector3::new(0.0, 0.0, *yaw)))
        });
        let weights = robots.iter().map(|robot| f64::from(robot.3) / f64::from(arms)).collect();
        Team { tips: tips.collect(), weights }
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_mean_of_the_tips_stays_where_it_is(mut team in teams()) {
        let (position, yaw) = team.mean();
        for _ in 0..100 {
            team.correct(&landmark());
        }
        let (now, yaw_now) = team.mean();
        prop_assert!((now - position).norm() < 1e-12 && (yaw_now - yaw).abs() < 1e-12);
    }

    #[test]
    fn what_is_apart_comes_together_and_heights_as_far_as_no_plane_explains_them(mut team in teams()) {
        // As fast as limits allow, then by the time constant.
        for _ in 0..25 * TICKS_OF_TIME_CONSTANT {
            team.correct(&landmark());
        }
        let (distance, angle) = team.apart();
        prop_assert!(distance < 1e-8 && angle < 1e-8, "{distance} m, {angle} rad are left");
        let (mean, _) = team.mean();
        for tip in &team.tips {
            let height = tip.translation.z - mean.z;
            prop_assert!(height.abs() < PARAMETERS.height_tolerance_m + 1e-6, "{height} m are left");
        }
    }

    #[test]
    fn heights_of_robots_on_one_plane_stay_to_the_last_bit(mut team in teams(), share in 0.0..0.99_f64) {
        // All within the tolerance of their mean, whatever the weights.
        for tip in &mut team.tips {
            tip.translation.z = 0.7 + tip.translation.z.sin() * share * PARAMETERS.height_tolerance_m / 2.0;
        }
        let heights: Vec<_> = team.tips.iter().map(|tip| tip.translation.z).collect();
        for _ in 0..100 {
            team.correct(&landmark());
        }
        for (tip, height) in team.tips.iter().zip(heights) {
            prop_assert_eq!(tip.translation.z.to_bits(), height.to_bits());
        }
    }

    #[test]
    fn no_frame_moves_faster_than_it_may(team in teams()) {
        let sightings = team.sightings();
        for correction in landmark().corrections(&sightings) {
            prop_assert!(correction.linear.xy().norm() <= 0.01 * 0.005 * (1.0 + 1e-9));
            prop_assert!(correction.linear.z.abs() <= 0.01 * 0.005 * (1.0 + 1e-9));
            prop_assert!(correction.yaw.abs() <= 0.02 * 0.005 * (1.0 + 1e-9));
        }
    }
}

#[test]
fn an_offset_shrinks_by_the_time_constant() {
    let at = |x: f64| Pose::new(Vector3::new(x, 0.0, 0.0), nalgebra::UnitQuaternion::identity());
    let mut team = Team { tips: vec![at(0.003), at(-0.001)], weights: vec![0.25, 0.75] };
    for _ in 0..TICKS_OF_TIME_CONSTANT {
        team.correct(&landmark());
    }
    let (distance, _) = team.apart();
    assert!((distance / 0.004 * core::f64::consts::E - 1.0).abs() < 1e-3, "{distance}");
}

/// Of two robots as many as one another, each is half of what parts them off the mean: beyond the tolerance that shrinks.
#[test]
fn a_height_that_is_off_shrinks_by_its_time_constant_to_the_tolerance() {
    let at = |z: f64| Pose::new(Vector3::new(0.0, 0.0, z), nalgebra::UnitQuaternion::identity());
    let mut team = Team { tips: vec![at(0.006), at(-0.006)], weights: vec![0.5, 0.5] };
    for _ in 0..TICKS_OF_HEIGHT_TIME_CONSTANT {
        team.correct(&landmark());
    }
    let beyond = team.tips[0].translation.z - PARAMETERS.height_tolerance_m;
    assert!((beyond / 0.004 * core::f64::consts::E - 1.0).abs() < 3e-3, "{beyond}");
}

/// Limits shorten all corrections alike: one robot that is far off moves nobody else's share of the mean.
#[test]
fn a_robot_that_is_far_off_slows_all() {
    let at = |x: f64| Pose::new(Vector3::new(x, 0.0, 0.0), nalgebra::UnitQuaternion::identity());
    let mut team = Team { tips: vec![at(1.0), at(0.0), at(0.001)], weights: vec![1.0 / 3.0; 3] };
    let (before, _) = team.mean();
    team.correct(&landmark());
    assert!((team.mean().0 - before).norm() < 1e-15);
    assert!((1.0 - team.tips[0].translation.x - 0.01 * 0.005).abs() < 1e-12);
}

#[test]
fn a_lone_robot_has_the_world_where_it_has_it() {
    let sightings = [Sighting {
        weight: 1.0,
        tips: Vector3::new(1.0, 2.0, 3.0),
        deviation: Twist::new(Vector3::repeat(0.1), Vector3::repeat(0.1)),
    }];
    for correction in landmark().corrections(&sightings) {
        assert_eq!((correction.linear, correction.yaw), (Vector3::zeros(), 0.0));
    }
}

#[test]
fn parameters_that_make_no_sense_are_refused() {
    let with = |change: fn(&mut LandmarkParameters)| {
        let mut parameters = PARAMETERS;
        change(&mut parameters);
        Landmark::new(&parameters).map(|_| ())
    };
    assert_eq!(with(|_| ()), Ok(()));
    for change in [
        (|p| p.time_constant_s = 0.005) as fn(&mut LandmarkParameters),
        |p| p.time_constant_s = f64::NAN,
        |p| p.time_constant_s = f64::INFINITY,
        |p| p.height_time_constant_s = 0.005,
        |p| p.period_s = 0.0,
    ] {
        assert_eq!(with(change), Err(BuildLandmarkError::TimeConstant));
    }
    assert_eq!(with(|p| p.height_tolerance_m = -0.001), Err(BuildLandmarkError::HeightTolerance));
    assert_eq!(with(|p| p.height_tolerance_m = f64::NAN), Err(BuildLandmarkError::HeightTolerance));
    assert_eq!(with(|p| p.limit_m_s = 0.0), Err(BuildLandmarkError::Limit));
    assert_eq!(with(|p| p.limit_rad_s = f64::NAN), Err(BuildLandmarkError::Limit));
}
