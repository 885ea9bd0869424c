//! What a posture costs, against the work that it takes to leave it.

#![allow(non_snake_case)]

mod common;

use common::{carry_posture, hrp2};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::{GRAVITY_M_S2, PerFoot};
use mikoshi_humanoid::model::Model;
use mikoshi_humanoid::statics::{BEARABLE_SHARE, Bearing, Burden};
use mikoshi_spatial::{Hand, Pose};
use nalgebra::{Vector2, Vector3};

fn frame(model: &Model, name: &str) -> mikoshi_humanoid::FrameId {
    model.find_frame(name).expect("the description has it")
}

fn burden(model: &Model, posture: &[f64], force_n: f64) -> Burden {
    burden_on(model, posture, force_n, |name| Some(frame(model, name)))
}

fn burden_on(
    model: &Model,
    posture: &[f64],
    force_n: f64,
    foot: impl Fn(&str) -> Option<mikoshi_humanoid::FrameId>,
) -> Burden {
    let hands = [frame(model, "r_palm"), frame(model, "l_palm")];
    let feet = PerFoot { right: foot("r_sole"), left: foot("l_sole") };
    let under = Vector2::new(0.015, 0.0);
    let bearing = Bearing { hands: &hands, feet, zmp_in_foot: PerFoot { right: under, left: under } };
    let mut kinematics = Kinematics::new(model);
    kinematics.update(model, &Pose::identity(), posture);
    bearing.burden(model, &kinematics, force_n)
}

/// Work of leaving `posture` for joint j at q, base held, against weights and what hands are to apply.
fn work(
    model: &Model,
    posture: &[f64],
    joint: usize,
    step: f64,
    (force_n, moment): (f64, &Vector3<f64>),
) -> f64 {
    let mut moved = posture.to_vec();
    moved[joint] += step;
    let (mut from, mut to) = (Kinematics::new(model), Kinematics::new(model));
    from.update(model, &Pose::identity(), posture);
    to.update(model, &Pose::identity(), &moved);
    let lifted = (to.com().z - from.com().z) * model.total_mass_kg() * GRAVITY_M_S2;
    let of_hands: f64 = ["r_palm", "l_palm"]
        .iter()
        .map(|name| {
            let palm = |kinematics: &Kinematics| kinematics.frame_pose::<Hand>(model, frame(model, name));
            let way = palm(&from).displacement_to(&palm(&to));
            0.5 * (force_n * way.linear.z + moment.dot(&way.angular))
        })
        .sum();
    lifted + of_hands
}

#[test]
fn the_joint_that_needs_most_of_its_torque_does_the_work_of_leaving_the_posture() {
    let model = hrp2();
    let posture = carry_posture(&model);
    let chest = model.find_joint("CHEST_JOINT1").expect("the description has it");
    for force_n in [100.0, 200.0] {
        // Sitting, so to speak.
        let found = burden_on(&model, &posture, force_n, |_| None);
        assert_eq!(found.joint as usize, chest, "{found:?}");
        let h = 1e-5;
        let done = |step| work(&model, &posture, chest, step, (force_n, &found.moment_nm));
        let torque_nm = (done(h) - done(-h)) / (2.0 * h);
        let share = torque_nm.abs() / model.joints()[chest].effort;
        assert!((share - found.torque_share).abs() < 1e-4, "{share} {found:?}");
    }
}

#[test]
fn hands_best_bring_a_load_nearer_and_without_one_they_do_nothing() {
    let model = hrp2();
    let posture = carry_posture(&model);
    assert_eq!(burden(&model, &posture, 0.0).moment_nm, Vector3::zeros());
    let (some, more) = (burden(&model, &posture, 100.0), burden(&model, &posture, 200.0));
    // The robot looks along x: a moment about y that its hands apply moves the line of the load towards it.
    assert!(some.moment_nm.y > 5.0 && some.moment_nm.y < 40.0, "{some:?}");
    assert!(more.moment_nm.y > some.moment_nm.y, "{more:?}");
    assert!(more.torque_share > some.torque_share, "{more:?}");
    assert!(some.bearable_n > 0.0 && some.bearable_n < 300.0, "{some:?}");
    let at_most = burden(&model, &posture, some.bearable_n);
    assert!((at_most.torque_share - BEARABLE_SHARE).abs() < 0.1, "{at_most:?}");
}
