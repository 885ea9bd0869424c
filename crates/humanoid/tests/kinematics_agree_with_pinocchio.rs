//! Kinematics against `goldens/pinocchio_*.json` (made by the script beside them).

#![allow(non_snake_case)]

mod common;

use common::hrp2;
use mikoshi_humanoid::{Kinematics, Model};
use mikoshi_spatial::{Base, Pose, World};
use nalgebra::{Matrix3xX, Matrix6xX};
use serde::Deserialize;

const TOLERANCE: f64 = 1e-10;

#[derive(Deserialize)]
struct Goldens {
    joints: Vec<String>,
    frames: Vec<String>,
    jacobian_frames: Vec<String>,
    postures: Vec<Posture>,
}

#[derive(Deserialize)]
struct Posture {
    base_pose: [f64; 7],
    q: Vec<f64>,
    frame_poses: Vec<[f64; 7]>,
    frame_jacobians: Vec<Vec<Vec<f64>>>,
    com: [f64; 3],
    com_jacobian: Vec<[f64; 3]>,
}

#[test]
fn hrp2_agrees_in_100_random_postures() {
    assert_eq!(compare(&hrp2(), include_str!("goldens/pinocchio_hrp2.json")), 100);
}

#[test]
fn a_tree_with_skew_axes_rotated_origins_and_a_prismatic_joint_agrees() {
    let model = Model::from_urdf(include_str!("goldens/skew_tree.urdf"), &|_| None).unwrap();
    assert_eq!(compare(&model, include_str!("goldens/pinocchio_skew_tree.json")), 10);
}

/// Poses of all frames, Jacobians of some, centre of mass and its Jacobian; the number of postures.
fn compare(model: &Model, goldens: &str) -> usize {
    let goldens: Goldens = serde_json::from_str(goldens).unwrap();
    let mut kinematics = Kinematics::new(model);
    let columns = 6 + model.joint_count();
    let (mut jacobian, mut com_jacobian) = (Matrix6xX::zeros(columns), Matrix3xX::zeros(columns));
    let joint_of: Vec<_> = goldens.joints.iter().map(|name| model.find_joint(name).unwrap()).collect();
    let column_of = |i: usize| if i < 6 { i } else { 6 + joint_of[i - 6] };
    let close = |a: f64, b: f64, what: &str| {
        assert!((a - b).abs() < TOLERANCE, "{what}: {a} is not {b}");
    };

    assert_eq!(goldens.frames.len(), model.frames().len());
    for posture in &goldens.postures {
        let X_WB: Pose<World, Base> = Pose::from_array(&posture.base_pose).unwrap();
        let mut q = vec![0.0; model.joint_count()];
        for (&joint, &value) in joint_of.iter().zip(&posture.q) {
            q[joint] = value;
        }
        kinematics.update(model, &X_WB, &q);

        for (name, golden) in goldens.frames.iter().zip(&posture.frame_poses) {
            let pose = kinematics.frame_pose::<Base>(model, model.find_frame(name).unwrap());
            let golden = Pose::from_array(golden).unwrap();
            let difference = pose.displacement_to(&golden);
            close(difference.to_vector().amax(), 0.0, name);
        }
        for (name, golden) in goldens.jacobian_frames.iter().zip(&posture.frame_jacobians) {
            let mut expected = Matrix6xX::zeros(columns);
            for column in golden {
                expected.column_mut(column_of(column[0] as usize)).copy_from_slice(&column[1..]);
            }
            kinematics.frame_jacobian(model, model.find_frame(name).unwrap(), &mut jacobian);
            close((&jacobian - expected).amax(), 0.0, name);
        }
        for (a, b) in kinematics.com().iter().zip(posture.com) {
            close(*a, b, "centre of mass");
        }
        kinematics.com_jacobian(model, &mut com_jacobian);
        for (i, golden) in posture.com_jacobian.iter().enumerate() {
            for (a, &b) in com_jacobian.column(column_of(i)).iter().zip(golden) {
                close(*a, b, "Jacobian of the centre of mass");
            }
        }
    }
    goldens.postures.len()
}
