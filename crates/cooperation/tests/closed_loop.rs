//! The law in closed loop with hands on springs at a rigid object.

#![allow(non_snake_case)]

mod common;

use common::{ClosedLoop, FILTER_HZ, PERIOD_S, STIFFNESS, parameters, team};
use mikoshi_cooperation::{
    Axis, Control, ForceGains, HybridLaw, HybridParameters, InternalForces, critical_loop_gain,
};
use mikoshi_spatial::{Object, Twist, Wrench};
use nalgebra::Vector3;

const TICKS_OF_3_S: usize = 600;

fn law(
    internal_forces: InternalForces,
    change: impl FnOnce(&mut HybridParameters, &InternalForces),
) -> HybridLaw {
    let mut parameters = parameters(&internal_forces);
    change(&mut parameters, &internal_forces);
    HybridLaw::new(internal_forces, parameters).unwrap()
}

fn two_robots() -> InternalForces {
    InternalForces::balanced_tree(&team(&[2; 2]))
}

fn teams() -> impl Iterator<Item = InternalForces> {
    let teams: [&[usize]; 7] = [&[2], &[1, 1], &[2, 2], &[2, 2, 2], &[2, 2, 2, 2], &[1, 2, 3], &[3, 1]];
    teams.into_iter().map(|arms| InternalForces::balanced_tree(&team(arms)))
}

/// The paper's section 4.3.
#[test]
fn all_internal_forces_go_to_zero_and_the_object_stays() {
    for internal_forces in teams() {
        let names = internal_forces.names().to_vec();
        let mut world = ClosedLoop::new(law(internal_forces, |_, _| {}), 0.04, 1);
        let start = world.X_WA;
        world.run(1);
        let (force, moment) = world.largest_internal();
        assert!(force > 10.0 && moment > 5.0, "{names:?} start at {force} N and {moment} Nm");
        // The law holds the mean of the tips where it is now: grasp offsets are not the object's motion.
        world.position_ref.external = world.out.position.external;
        world.run(TICKS_OF_3_S);
        let (force, moment) = world.largest_internal();
        assert!(force < 0.05 && moment < 0.05, "{names:?} end at {force} N and {moment} Nm");
        let moved = start.displacement_to(&world.X_WA);
        assert!(moved.linear.norm() < 0.02 && moved.angular.norm() < 0.03, "{names:?} moved by {moved:?}");
        let error = world.out.position.external.displacement_to(&world.position_ref.external);
        assert!(error.linear.norm() < 1e-5 && error.angular.norm() < 1e-5, "{names:?} are off by {error:?}");
    }
}

#[test]
fn a_chain_of_internal_forces_converges_too() {
    let mut world = ClosedLoop::new(law(InternalForces::chain(&team(&[1; 3])), |_, _| {}), 0.04, 1);
    world.run(2 * TICKS_OF_3_S);
    let (force, moment) = world.largest_internal();
    assert!(force < 0.05 && moment < 0.05, "{force} N, {moment} Nm");
}

#[test]
fn without_control_forces_and_hands_stay_as_they_are() {
    let mut world = ClosedLoop::new(law(two_robots(), |_, _| {}), 0.04, 1);
    world.tick(false);
    let (h, hands) = (world.out.force.clone(), world.hands.clone());
    for _ in 0..100 {
        world.tick(false);
    }
    assert_eq!(world.hands, hands);
    for (now, then) in world.out.force.internal.iter().zip(&h.internal) {
        assert!((*now - *then).to_vector().norm() < 1e-9);
    }
}

#[test]
fn an_internal_force_follows_its_reference_and_the_others_stay_at_zero() {
    let mut world = ClosedLoop::new(law(two_robots(), |_, _| {}), 0.01, 1);
    let squeeze = Vector3::new(20.0, 0.0, 0.0);
    world.force_ref.internal[0].force = squeeze;
    world.run(2 * TICKS_OF_3_S);
    for (row, wrench) in world.out.force.internal.iter().enumerate() {
        let expected = if row == 0 { squeeze } else { Vector3::zeros() };
        assert!((wrench.force - expected).norm() < 0.02, "row {row}: {wrench:?}");
    }
}

#[test]
fn a_position_controlled_internal_axis_follows_its_reference() {
    let law = law(two_robots(), |parameters, _| {
        parameters.selection.select(1, Axis::Y, Control::Position).unwrap();
    });
    let mut world = ClosedLoop::new(law, 0.01, 1);
    world.position_ref.internal[0].linear.y = 0.01;
    // Moments of a force-controlled row would be at odds with the force of a position-controlled one.
    world.run(2 * TICKS_OF_3_S);
    assert!(
        (world.out.position.internal[0].linear.y - 0.01).abs() < 1e-5,
        "{:?}",
        world.out.position.internal[0]
    );
    let force = world.out.force.internal[0].force;
    assert!(force.x.abs() < 0.05 && force.z.abs() < 0.05, "{force:?}");
    assert!(force.y.abs() > 5.0, "{force:?}");
}

/// With an object axis under force control the object gives way until the reference is met; here nothing
/// resists it, so it moves at the force error's rate.
#[test]
fn a_force_controlled_object_axis_moves_the_object() {
    let law = law(two_robots(), |parameters, _| {
        parameters.selection.select(0, Axis::X, Control::Force).unwrap();
    });
    let mut world = ClosedLoop::new(law, 0.0, 1);
    let start = world.X_WA;
    world.force_ref.external.force.x = 2.0;
    world.run(200);
    let moved = start.displacement_to(&world.X_WA).linear;
    // Each of four hands gives way to a quarter of 2 N, kz kh · 2 N / 4 a tick: the first shows after one tick
    // of delay, the last doesn't yet.
    let expected = 199.0 * 0.05 * 1e-3 * 2.0 / 4.0;
    assert!((moved.x - expected).abs() < 1e-6 * expected, "{moved:?}");
    assert!(moved.yz().norm() < 1e-6 * expected, "{moved:?}");
    // All hands go as one body: nobody strains against another.
    let (force, moment) = world.largest_internal();
    assert!(force < 1e-9 && moment < 1e-9, "{force} N, {moment} Nm");
}

#[test]
fn an_approach_is_no_faster_than_its_limit() {
    let law = law(two_robots(), |parameters, _| {
        parameters.selection.select(0, Axis::X, Control::Force).unwrap();
        parameters.selection.select(0, Axis::Yaw, Control::Force).unwrap();
        (parameters.approach_limit_m_s, parameters.approach_limit_rad_s) = (0.004, 0.008);
    });
    let mut world = ClosedLoop::new(law, 0.0, 0);
    let start = world.X_WA;
    (world.force_ref.external.force.x, world.force_ref.external.moment.z) = (-1e6, 1e6);
    world.run(100);
    let moved = start.displacement_to(&world.X_WA);
    assert!((moved.linear.x + 100.0 * PERIOD_S * 0.004).abs() < 1e-6, "{moved:?}");
    assert!((moved.angular.z - 100.0 * PERIOD_S * 0.008).abs() < 1e-6, "{moved:?}");
}

/// Whatever an object is pressed against: the loop through a rigid wall has the loop gain of a single hand.
#[test]
fn external_forces_against_a_rigid_wall_come_at_the_rate_of_the_loop_gain() {
    for arms in [vec![1, 1], vec![2; 4], vec![1, 3, 2]] {
        let slow = law(InternalForces::balanced_tree(&team(&arms)), |parameters, _| {
            for axis in [Axis::X, Axis::Y, Axis::Z, Axis::Roll, Axis::Pitch, Axis::Yaw] {
                parameters.selection.select(0, axis, Control::Force).unwrap();
            }
            parameters.kh = ForceGains::of_loop_gain(0.01, parameters.kz, STIFFNESS);
        });
        let mut world = ClosedLoop::new(slow, 0.0, 0);
        world.is_object_fixed = true;
        world.force_ref.external = Wrench::new(Vector3::new(8.0, -6.0, 4.0), Vector3::new(1.0, 2.0, -1.5));
        world.run(401);
        let lacking = world.force_ref.external - world.out.force.external;
        let left = lacking.to_vector().component_div(&world.force_ref.external.to_vector());
        // (1 − 0.01)^400 = 0.018; levers that don't cancel couple the axes.
        let [x, y, z, roll, pitch, yaw] = <[f64; 6]>::from(left);
        // (1 − 0.01)^400 = 0.018, a little less for the force at the start; levers that don't cancel
        // couple roll and pitch with the forces.
        assert!([x, y, z, yaw].iter().all(|left| (0.015..0.02).contains(left)), "{arms:?}: {left:?}");
        assert!(roll.abs() < 0.02 && pitch.abs() < 0.02, "{arms:?}: {left:?}");
        world.run(1000);
        let lacking = world.force_ref.external - world.out.force.external;
        assert!(lacking.to_vector().amax() < 0.01, "{arms:?}: {lacking:?}");
        let (force, moment) = world.largest_internal();
        assert!(force < 0.02 && moment < 0.02, "{arms:?}: {force} N, {moment} Nm");
    }
}

#[test]
fn with_feed_forward_the_object_follows_a_moving_reference_without_lag() {
    let mut world = ClosedLoop::new(law(two_robots(), |_, _| {}), 0.0, 0);
    world.twist_ref = Twist::new(Vector3::new(0.1, -0.05, 0.02), Vector3::new(0.02, 0.0, 0.1));
    world.run(800);
    let error = world.X_WA.displacement_to(&world.position_ref.external);
    assert!(error.linear.norm() < 2e-4 && error.angular.norm() < 1e-5, "{error:?}");
    let (force, moment) = world.largest_internal();
    assert!(force < 1e-2 && moment < 1e-2, "{force} N, {moment} Nm");
}

#[test]
fn without_feed_forward_the_object_lags_by_velocity_times_period_over_kz() {
    let mut world = ClosedLoop::new(law(two_robots(), |_, _| {}), 0.0, 0);
    let step_m = 0.1 * PERIOD_S;
    for _ in 0..800 {
        world.tick(true);
        world.position_ref.external.translation.x += step_m;
    }
    let lag_m = world.position_ref.external.translation.x - world.out.position.external.translation.x;
    assert!((lag_m - step_m / 0.05).abs() < 1.1 * step_m, "{lag_m}");
}

/// The bound of `critical_loop_gain` is sharp for the loop gain of the law on its grasp.
#[test]
fn the_loop_is_stable_below_the_critical_gain_and_unstable_above() {
    for (internal_forces, delay_ticks) in [
        (InternalForces::balanced_tree(&team(&[1, 1])), 1),
        (InternalForces::balanced_tree(&team(&[2, 2])), 2),
        (InternalForces::balanced_tree(&team(&[1, 2])), 3),
        (InternalForces::chain(&team(&[1; 3])), 3),
    ] {
        let critical = critical_loop_gain(delay_ticks as u64, FILTER_HZ, PERIOD_S);
        // Largest internal force or moment over ticks 100 to 200, and 1100 to 1200.
        let amplitudes = |share: f64| {
            let scaled = law(internal_forces.clone(), |parameters, _| {
                parameters.kh = ForceGains::of_loop_gain(share * critical, parameters.kz, STIFFNESS);
            });
            let mut world = ClosedLoop::new(scaled, 1e-4, delay_ticks);
            [100, 900].map(|ticks| {
                world.run(ticks);
                (0..100).fold(0.0, |largest, _| {
                    world.run(1);
                    let (force, moment) = world.largest_internal();
                    f64::max(largest, force.max(moment))
                })
            })
        };
        let names = internal_forces.names();
        let [early, late] = amplitudes(0.9);
        assert!(late < 0.7 * early, "below the bound {names:?} went from {early} to {late}");
        let [early, late] = amplitudes(1.1);
        assert!(late > 1.4 * early, "above the bound {names:?} went from {early} to {late}");
    }
}

/// Whatever the grasp and its levers, every combination of internal forces and moments shrinks at the rate
/// of the loop gain: after 3 s the last of them as far as the first.
#[test]
fn all_internal_forces_of_any_team_shrink_at_the_rate_of_the_loop_gain() {
    for arms in [vec![1, 1], vec![2; 4], vec![1, 3, 2], vec![2; 8]] {
        let slow = law(InternalForces::balanced_tree(&team(&arms)), |parameters, _| {
            parameters.kh = ForceGains::of_loop_gain(0.01, parameters.kz, STIFFNESS);
        });
        let mut world = ClosedLoop::new(slow, 1e-3, 0);
        world.run(1);
        let start: Vec<_> = world.out.force.internal.clone();
        world.run(400);
        for (row, (now, start)) in world.out.force.internal.iter().zip(&start).enumerate() {
            // (1 − 0.01)^400 = 0.018; the filter delays it by some ticks.
            let left = now.to_vector().norm() / start.to_vector().norm();
            assert!((0.015..0.022).contains(&left), "{arms:?}, row {row}: {left}");
        }
    }
}

#[test]
fn the_loop_gain_is_that_of_the_stiffer_way() {
    let kh = ForceGains { m_n: 1e-3, rad_nm: 5e-3 };
    assert!((kh.loop_gain(0.05, STIFFNESS) - 0.05 * 5e-3 * STIFFNESS.nm_rad).abs() < 1e-15);
    let same = ForceGains::of_loop_gain(0.03, 0.05, STIFFNESS);
    assert!((same.loop_gain(0.05, STIFFNESS) - 0.03).abs() < 1e-15);
}

#[test]
fn a_reference_waits_for_a_hand_that_does_not_follow() {
    let law = law(two_robots(), |parameters, _| {
        parameters.lead_limit_m = 0.02;
        parameters.lead_limit_rad = 0.05;
    });
    let mut world = ClosedLoop::new(law, 0.0, 0);
    let stuck = world.hands.front().unwrap()[3];
    world.position_ref.external.translation.x += 0.5;
    let mut held_back = 0;
    for _ in 0..100 {
        world.tick(true);
        assert!(world.out.hands_held_back <= 4);
        held_back += world.out.hands_held_back;
        world.hands.back_mut().unwrap()[3] = stuck;
        let lead = stuck.displacement_to(&world.out.hands[3].pose);
        assert!(lead.linear.norm() < 0.02 + 1e-12 && lead.angular.norm() < 0.05 + 1e-12, "{lead:?}");
    }
    assert!(held_back > 50, "{held_back}");
}

#[test]
fn a_reference_waits_for_a_hand_that_does_not_turn() {
    let law = law(two_robots(), |parameters, _| parameters.lead_limit_rad = 0.05);
    let mut world = ClosedLoop::new(law, 0.0, 0);
    let stuck = world.hands.front().unwrap()[3];
    // About the hand itself, which therefore stays in place.
    let turn = Twist::<Object>::new(Vector3::zeros(), Vector3::new(0.0, 0.0, 0.3)).expressed_in(&world.X_WA);
    let p_HA_W = world.X_WA.translation - stuck.translation;
    world.position_ref.external = world.X_WA.displaced(&turn.shifted(&p_HA_W));
    for _ in 0..200 {
        world.tick(true);
        world.hands.back_mut().unwrap()[3] = stuck;
        assert!(stuck.displacement_to(&world.out.hands[3].pose).angular.norm() < 0.05 + 1e-12);
    }
    assert_eq!(world.out.hands_held_back, 1);
}
