//! The swing foot and how it meets the ground.

use mikoshi_humanoid::gait::{Foothold, GroundPose, Swing, SwingConfig, SwingContact, swing_foot};
use proptest::prelude::*;

const DURATION: f64 = 0.6;
const DT: f64 = 0.005;
const TICKS: u64 = 120;

fn config() -> SwingConfig {
    SwingConfig::default()
}

fn from() -> Foothold {
    Foothold::on_ground(GroundPose::new(0.0, 0.085, 0.0))
}

fn to() -> Foothold {
    Foothold::on_ground(GroundPose::new(0.2, 0.1, 0.25))
}

/// Swings with `force` by share of the swing and, past 1, of the time after it; returns all contacts.
fn swing(force: impl Fn(u64) -> f64, ticks: u64) -> Vec<SwingContact> {
    let mut swing = Swing::new(from(), to());
    (0..ticks)
        .map(|tick| {
            let s = ((tick + 1) as f64 / TICKS as f64).min(1.0 + 1.0 / TICKS as f64);
            swing.contact = swing.contact_after(&config(), force(tick), s, DURATION, DT);
            swing.contact
        })
        .collect()
}

proptest! {
    #[test]
    fn position_velocity_and_acceleration_vanish_at_lift_off_apex_and_touchdown(
        x in -0.3..0.3, y in -0.3..0.3, yaw in -0.5..0.5, h0 in -0.02..0.02, h1 in -0.02..0.02,
    ) {
        let (a, b) = (Foothold { height: h0, ..from() }, Foothold { pose: GroundPose::new(x, y, yaw), height: h1 });
        let at = |s: f64| swing_foot(&a, &b, 0.05, s, DURATION);
        prop_assert!((at(0.0).0.translation - a.in_world().translation).norm() < 1e-12);
        prop_assert!((at(1.0).0.translation - b.in_world().translation).norm() < 1e-12);
        prop_assert!((at(0.5).0.translation.z - h0.max(h1) - 0.05).abs() < 1e-12);
        let step = 1e-5;
        for s in [0.0, 1.0] {
            prop_assert!(at(s).1.to_vector().norm() < 1e-12);
        }
        for s in [step, 0.5 - step, 0.5 + step, 1.0 - step] {
            // v = a t + … with a = 0: what is left is of second order in the step.
            let z = at(s).1.linear.z;
            prop_assert!(z.abs() < 1e3 * step * step, "{z}");
        }
    }

    #[test]
    fn the_velocity_is_the_derivative_of_the_pose(s in 0.01..0.99) {
        let (h, at) = (1e-6, |s: f64| swing_foot(&from(), &to(), 0.05, s, DURATION));
        let numeric = at(s - h).0.displacement_to(&at(s + h).0) * (1.0 / (2.0 * h * DURATION));
        prop_assert!((numeric - at(s).1).to_vector().norm() < 1e-5);
    }
}

#[test]
fn the_foot_stays_over_the_ground_and_lifts_by_five_centimetres() {
    let mut highest = 0.0_f64;
    for tick in 0..=TICKS {
        let z = swing_foot(&from(), &to(), 0.05, tick as f64 / TICKS as f64, DURATION).0.translation.z;
        assert!(z >= 0.0);
        highest = highest.max(z);
    }
    assert!((highest - 0.05).abs() < 1e-12);
}

#[test]
fn early_contact_freezes_the_foot_where_it_felt_the_ground() {
    let contacts = swing(|tick| if tick >= 100 { 200.0 } else { 0.0 }, TICKS);
    let SwingContact::Landed { at } = contacts[101] else { panic!("{:?}", contacts[101]) };
    let end = Foothold { height: to().height + config().touchdown_m, ..to() };
    let (pose, _) = swing_foot(&from(), &end, 0.05, 101.0 / TICKS as f64, DURATION);
    assert!((at.in_world().translation - pose.translation).norm() < 1e-12);
    assert!(at.height > 0.001);
    assert_eq!(contacts[TICKS as usize - 1], contacts[101], "and there it stays");
}

#[test]
fn a_foot_that_has_landed_has_no_velocity() {
    let swing = Swing { contact: SwingContact::Landed { at: to() }, ..Swing::new(from(), to()) };
    let (pose, twist) = swing.foot(&config(), 0.8, DURATION);
    assert_eq!(pose, to().in_world());
    assert_eq!(twist.to_vector().norm(), 0.0);
}

#[test]
fn force_before_the_foot_comes_down_is_no_landing() {
    let contacts = swing(|tick| if tick < 60 { 300.0 } else { 0.0 }, TICKS);
    assert!(contacts.iter().all(|contact| matches!(contact, SwingContact::Swinging { .. })));
}

#[test]
fn one_noisy_sample_is_no_ground() {
    let contacts = swing(|tick| if tick == 100 { 500.0 } else { 0.0 }, TICKS);
    assert!(contacts.iter().all(|contact| matches!(contact, SwingContact::Swinging { .. })));
}

#[test]
fn a_foot_whose_ground_gives_way_is_lowered_on() {
    let contacts = swing(|tick| if (95..105).contains(&tick) { 200.0 } else { 0.0 }, TICKS);
    let SwingContact::Landed { at } = contacts[104] else { panic!("{:?}", contacts[104]) };
    let SwingContact::Lowering { at: lower } = contacts[110] else { panic!("{:?}", contacts[110]) };
    assert!(lower.height < at.height);
    assert_eq!(lower.pose, at.pose);
}

#[test]
fn late_contact_lowers_slowly_until_the_ground_is_there() {
    let contacts = swing(|tick| if tick >= TICKS + 40 { 200.0 } else { 0.0 }, TICKS + 60);
    let heights: Vec<f64> = contacts
        .iter()
        .filter_map(|contact| match contact {
            SwingContact::Lowering { at } | SwingContact::Landed { at } => Some(at.height),
            SwingContact::Swinging { .. } => None,
        })
        .collect();
    assert!(heights.windows(2).all(|pair| (0.0..=0.02 * DT + 1e-12).contains(&(pair[0] - pair[1]))));
    let SwingContact::Landed { at } = contacts[TICKS as usize + 50] else { panic!("it found the ground") };
    assert!((-0.0035..-0.0025).contains(&at.height), "{}", at.height);
}

#[test]
fn a_foot_that_finds_no_ground_stops_at_its_bound() {
    let contacts = swing(|_| 0.0, TICKS + 1000);
    let Some(SwingContact::Lowering { at }) = contacts.last() else { panic!("no ground, no landing") };
    assert_eq!(at.height, -config().lowering_max_m);
}

#[test]
fn a_foot_at_its_bound_has_no_speed() {
    let at = Foothold { height: -config().lowering_max_m, ..to() };
    let swing = Swing { contact: SwingContact::Lowering { at }, ..Swing::new(from(), to()) };
    assert_eq!(swing.foot(&config(), 1.01, DURATION).1.linear.z, 0.0);
}

/// Positions of a swing whose foothold moves by `moved` and whose landing comes `sooner` ticks sooner, from tick 60 on.
fn bent(moved: f64, sooner: u64) -> Vec<[f64; 3]> {
    let mut swing = Swing::new(from(), to());
    let share = |tick: u64| (tick + if tick > 60 { sooner } else { 0 }) as f64 / TICKS as f64;
    (1..=TICKS - sooner)
        .map(|tick| {
            if tick == 61 {
                swing.bend(&config(), share(60), DURATION);
                swing.bent.as_mut().expect("bent").hurry((1.0 - share(61)) * DURATION);
                swing.to.pose.position.y += moved;
            }
            swing.advance(&config(), (1.0 - share(tick)) * DURATION, DT);
            let translation = swing.foot(&config(), share(tick), DURATION).0.translation;
            translation.into()
        })
        .collect()
}

#[test]
fn a_swing_that_is_bent_without_need_goes_where_it_would_have_gone() {
    for (tick, position) in bent(0.0, 0).into_iter().enumerate() {
        let end = Foothold { height: to().height + config().touchdown_m, ..to() };
        let (pose, _) = swing_foot(&from(), &end, 0.05, (tick + 1) as f64 / TICKS as f64, DURATION);
        assert!((pose.translation - nalgebra::Vector3::from(position)).norm() < 1e-9, "{tick}");
    }
}

#[test]
fn a_swing_whose_foothold_and_time_change_lands_there_then_and_without_a_jolt() {
    let way = bent(0.05, 20);
    let end = way[way.len() - 1];
    assert!(
        (end[1] - (to().pose.position.y + 0.05)).abs() < 1e-9 && (end[2] - 0.001).abs() < 1e-9,
        "{end:?}"
    );
    let most = way.windows(3).flat_map(|three| {
        (0..3).map(|axis| (three[2][axis] - 2.0 * three[1][axis] + three[0][axis]).abs() / (DT * DT))
    });
    let most = most.fold(0.0, f64::max);
    assert!(most < 15.0, "{most} m/s²");
}
