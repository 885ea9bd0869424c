//! Our kinematics and inverse kinematics beside Pinocchio's and Eigen's: first that both sides come to the same
//! numbers, then how long they take.

use crate::pinocchio::{JACOBIANS, POSES, POSES_OF_LINKS, Part, Pinocchio, PoseColumns, SOLVE};
use crate::postures::{Posture, Step, Walk};
use crate::rounds::{Comparison, compare};
use mikoshi_humanoid::balance::Side;
use mikoshi_humanoid::{FrameId, IkReport, IkScratch, Kinematics};
use mikoshi_spatial::{Base, CoordinateFrame, Pose, World};
use nalgebra::{Matrix3xX, Matrix6xX};
use std::hint::black_box;

/// Largest difference of any number \[m, rad, and without unit\].
const TOLERANCE: f64 = 1e-9;

/// What both sides do, and what it takes them.
pub type Row = (&'static str, Comparison);

/// Ours, with the workspaces that it needs.
struct Ours<'a> {
    walk: &'a Walk,
    kinematics: Kinematics,
    scratch: IkScratch,
    jacobian: Matrix6xX<f64>,
    com_jacobian: Matrix3xX<f64>,
    /// Feet and hands.
    extremities: [FrameId; 4],
}

/// Ends the benchmark if the two sides differ.
pub fn measure<'w>(walk: &'w Walk, theirs: &Pinocchio) -> Vec<Row> {
    let mut ours = Ours::new(walk);
    let worst = ours.differences(theirs);
    for (what, difference) in &worst {
        println!("{what}: both sides agree within {difference:.1e}");
    }
    for (what, difference) in worst {
        assert!(difference < TOLERANCE, "{what} differ by {difference:e}, more than {TOLERANCE:e}");
    }
    let mut row = |name, part: Part, call: fn(&mut Ours<'w>, usize)| {
        let comparison = compare(
            &mut |first, count| (first..first + count).for_each(|index| call(&mut ours, index)),
            &mut |first, count| theirs.execute(part, first, count),
        );
        (name, comparison)
    };
    vec![
        row("poses of bodies, centre of mass", POSES, Ours::poses),
        row("poses of bodies and links", POSES_OF_LINKS, Ours::poses_of_links),
        row("the same, Jacobians of feet, hands, centre of mass", JACOBIANS, Ours::jacobians),
        row("tick of inverse kinematics", SOLVE, Ours::solve),
    ]
}

impl<'a> Ours<'a> {
    fn new(walk: &'a Walk) -> Self {
        let (model, config) = (&walk.robot.model, walk.ik.config());
        let columns = 6 + model.joint_count();
        Self {
            walk,
            kinematics: Kinematics::new(model),
            scratch: IkScratch::new(model),
            jacobian: Matrix6xX::zeros(columns),
            com_jacobian: Matrix3xX::zeros(columns),
            extremities: [
                config.feet[Side::Right],
                config.feet[Side::Left],
                config.hands[0],
                config.hands[1],
            ],
        }
    }

    fn posture(&self, index: usize) -> &'a Posture {
        &self.walk.postures[index % self.walk.postures.len()]
    }

    fn step(&self, index: usize) -> &'a Step {
        &self.walk.steps[index % self.walk.steps.len()]
    }

    fn poses(&mut self, index: usize) {
        let posture = self.posture(index);
        self.kinematics.update(&self.walk.robot.model, &posture.base, &posture.joints);
        black_box(self.kinematics.com());
    }

    fn poses_of_links(&mut self, index: usize) {
        self.poses(index);
        for &frame in &self.walk.links {
            black_box(&self.kinematics.frame_pose::<Base>(&self.walk.robot.model, frame));
        }
    }

    fn jacobians(&mut self, index: usize) {
        self.poses(index);
        let model = &self.walk.robot.model;
        for frame in self.extremities {
            self.kinematics.frame_jacobian(model, frame, &mut self.jacobian);
            black_box(&self.jacobian);
        }
        self.kinematics.com_jacobian(model, &mut self.com_jacobian);
        black_box(&self.com_jacobian);
    }

    fn solve(&mut self, index: usize) {
        black_box(self.solved(index));
    }

    /// The joint increments' end, and the report.
    fn solved(&mut self, index: usize) -> (Vec<f64>, IkReport) {
        let step = self.step(index);
        let mut state = step.state;
        let report = self
            .walk
            .ik
            .solve(&self.walk.robot.model, &mut state, &mut self.scratch, &step.targets)
            .expect("it is finite");
        (state.joint_position.to_vec(), report)
    }

    /// The largest of each kind over all postures and steps.
    fn differences(&mut self, theirs: &Pinocchio) -> [(&'static str, f64); 5] {
        let [mut poses, mut com, mut jacobians, mut increments, mut reports] = [0.0_f64; 5];
        let (model, walk) = (&self.walk.robot.model, self.walk);
        let columns = 6 + model.joint_count();
        let (mut jacobian, mut com_jacobian) = (Matrix6xX::zeros(columns), Matrix3xX::zeros(columns));
        for index in 0..walk.postures.len() {
            self.poses(index);
            theirs.execute(POSES_OF_LINKS, index, 1);
            for &frame in &walk.links {
                let ours = self.kinematics.frame_pose::<Base>(model, frame);
                poses = poses.max(pose_difference(&ours, &theirs.link(frame.index())));
            }
            theirs.execute(JACOBIANS, index, 1);
            com = com.max(largest(self.kinematics.com().iter(), theirs.com().iter()));
            for (extremity, frame) in self.extremities.into_iter().enumerate() {
                self.kinematics.frame_jacobian(model, frame, &mut self.jacobian);
                theirs.jacobian(extremity, jacobian.as_mut_slice());
                jacobians = jacobians.max((&self.jacobian - &jacobian).amax());
            }
            self.kinematics.com_jacobian(model, &mut self.com_jacobian);
            theirs.com_jacobian(com_jacobian.as_mut_slice());
            jacobians = jacobians.max((&self.com_jacobian - &com_jacobian).amax());
        }
        for index in 0..walk.steps.len() {
            let (joints, report) = self.solved(index);
            theirs.execute(SOLVE, index, 1);
            let solution = theirs.solution(model.joint_count());
            let start = &self.step(index).state.joint_position;
            let ends = start.iter().zip(&solution.increment).map(|(start, increment)| start + increment);
            increments = ends.zip(&joints).map(|(a, b)| (a - b).abs()).fold(increments, f64::max);
            let own = [
                report.com_error_m,
                report.waist_error_rad,
                report.foot_error_m,
                report.foot_error_rad,
                report.hand_error_m[0],
                report.hand_error_rad[0],
                report.hand_error_m[1],
                report.hand_error_rad[1],
            ];
            let [base, hands @ ..] = &solution.poses;
            reports = reports
                .max(largest(own.iter(), solution.missed.iter()))
                .max(pose_difference(&report.base_pose, base))
                .max(pose_difference(&report.hand_poses[0], &hands[0]))
                .max(pose_difference(&report.hand_poses[1], &hands[1]));
        }
        [
            ("poses", poses),
            ("centres of mass", com),
            ("Jacobians", jacobians),
            ("joint increments", increments),
            ("poses and errors after them", reports),
        ]
    }
}

fn largest<'a>(ours: impl Iterator<Item = &'a f64>, theirs: impl Iterator<Item = &'a f64>) -> f64 {
    ours.zip(theirs).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

fn pose_difference<F: CoordinateFrame>(ours: &Pose<World, F>, theirs: &PoseColumns) -> f64 {
    let rotation = ours.rotation.to_rotation_matrix();
    largest(ours.translation.iter().chain(rotation.matrix().iter()), theirs.iter())
}
