//! Hands that part from what they hold, and what only looks like it.

#![allow(non_snake_case)]

mod common;

use common::{pseudo_random, random_vector};
use mikoshi_cooperation::{Gap, Parting, PartingLimits};
use mikoshi_spatial::Twist;
use nalgebra::Vector3;
use proptest::prelude::*;

const LIMITS: PartingLimits =
    PartingLimits { slip: Parting { m: 0.003, rad: 0.01 }, odometry: Parting { m: 0.006, rad: 0.01 } };

/// Four robots with two hands each around an object, all in their grips.
fn holding() -> Vec<Option<Gap>> {
    let lever = |i: usize| Vector3::new(if i < 4 { -0.3 } else { 0.3 }, 0.2 * i as f64 - 0.7, 0.0);
    (0..8).map(|i| Some(Gap { tip: Twist::zero(), lever: lever(i), doubt: Parting::NONE })).collect()
}

/// The hands as the team sees them: against the mean of all that take part.
fn slips(hands: &[Option<Gap>], of_robots: &[usize]) -> Vec<f64> {
    let n = hands.iter().flatten().count() as f64;
    let mean = hands.iter().flatten().fold(Twist::zero(), |sum, hand| sum + hand.tip) * (1.0 / n);
    let seen: Vec<_> =
        hands.iter().map(|hand| hand.map(|hand| Gap { tip: hand.tip - mean, ..hand })).collect();
    let mut slips = vec![f64::NAN; hands.len()];
    LIMITS.slips(&seen, of_robots, &mut slips);
    slips
}

/// Hand `i` is off by this at its own origin.
fn displace(hands: &mut [Option<Gap>], i: usize, at_hand: Twist<mikoshi_spatial::World>) {
    let hand = hands[i].as_mut().unwrap();
    hand.tip += at_hand.shifted(&-hand.lever);
}

#[test]
fn a_hand_that_leaves_its_robots_other_hand_is_told_by_how_far() {
    for off in [0.5, 1.0, 2.0] {
        for (linear, angular) in [
            (Vector3::new(0.0, 0.003, 0.0), Vector3::zeros()),
            (Vector3::zeros(), Vector3::new(0.01, 0.0, 0.0)),
        ] {
            let mut hands = holding();
            displace(&mut hands, 3, Twist::new(linear * off, angular * off));
            let slips = slips(&hands, &[2; 4]);
            assert!((slips[3] - off).abs() < 1e-9, "{slips:?}");
            assert!(slips.iter().enumerate().all(|(i, slip)| i == 3 || *slip < 0.1), "{slips:?}");
        }
    }
}

#[test]
fn what_odometry_explains_is_no_slip_of_a_robots_hands() {
    let mut hands = holding();
    let drift = Twist::new(Vector3::new(0.004, -0.003, 0.0), Vector3::new(0.0, 0.0, 0.004));
    for i in [4, 5] {
        hands[i].as_mut().unwrap().tip += drift;
    }
    assert!(slips(&hands, &[2; 4]).iter().all(|slip| *slip < 0.4));
    // Robots with one hand each have nothing else to go by.
    assert!(slips(&hands, &[1; 8]).iter().all(|slip| *slip < 0.4));
    // And one of them slips all the same where drift is there too.
    displace(&mut hands, 4, Twist::new(Vector3::new(0.003, 0.0, 0.0), Vector3::zeros()));
    let slips = slips(&hands, &[2; 4]);
    assert!(slips[4] > 0.99 && slips[5] < 0.5, "{slips:?}");
}

#[test]
fn a_hand_without_companions_slips_when_odometry_does_not_explain_it() {
    let mut hands = holding();
    hands[2] = None;
    displace(&mut hands, 3, Twist::new(Vector3::new(0.0, 0.0, -0.009), Vector3::zeros()));
    let slips = slips(&hands, &[2; 4]);
    assert!((slips[3] - 1.0).abs() < 1e-9 && slips[2] == 0.0, "{slips:?}");
}

#[test]
fn what_a_grasp_may_have_yielded_is_no_slip() {
    let mut hands = holding();
    displace(&mut hands, 3, Twist::new(Vector3::new(0.0, 0.0, 0.004), Vector3::zeros()));
    assert!(slips(&hands, &[2; 4])[3] > 1.0);
    hands[3].as_mut().unwrap().doubt.m = 0.001;
    hands[2].as_mut().unwrap().doubt.m = 0.0005;
    let slips = slips(&hands, &[2; 4]);
    assert!((slips[3] - (0.004 - 0.001 - 0.001) / 0.003).abs() < 1e-9, "{slips:?}");
}

#[test]
fn whoever_is_alone_has_nobody_to_part_from() {
    let mut hands = vec![None; 8];
    hands[6] = holding()[6];
    displace(&mut hands, 6, Twist::new(Vector3::new(1.0, 0.0, 0.0), Vector3::zeros()));
    assert_eq!(slips(&hands, &[2; 4]), [0.0; 8]);
    assert_eq!(slips(&[None; 8], &[2; 4]), [0.0; 8]);
}

proptest! {
    /// By a quarter of a slip in each direction at once nobody is accused; the one that slips is, whoever else is off.
    #[test]
    fn noise_is_no_slip_and_hides_none(seed in 0..1000_u64, slipping in 0..8_usize) {
        let mut random = pseudo_random();
        for _ in 0..seed % 37 {
            random();
        }
        let mut hands = holding();
        for i in 0..8 {
            displace(&mut hands, i, Twist::new(random_vector(&mut random, 2e-4), random_vector(&mut random, 5e-4)));
        }
        prop_assert!(slips(&hands, &[2; 4]).iter().all(|slip| *slip < 0.4));
        displace(&mut hands, slipping, Twist::new(random_vector(&mut random, 1.0).normalize() * 0.005, Vector3::zeros()));
        let slips = slips(&hands, &[2; 4]);
        for (i, slip) in slips.iter().enumerate() {
            prop_assert_eq!(*slip >= 1.0, i == slipping, "{:?}", slips);
        }
    }
}
