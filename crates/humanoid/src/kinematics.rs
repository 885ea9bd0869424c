//! Kinematics of a floating-base tree: poses, geometric Jacobians, centre of mass.
//!
//! Generalized velocities are ν = (v_B, ω_B, q̇): linear velocity of the root link's origin and angular
//! velocity of the root link, both in world axes, then the joint velocities. Every Jacobian maps ν to a
//! velocity in world axes, linear before angular (the paper's eq. 1).

use crate::model::{Frame, FrameId, Joint, JointKind, Model};
use mikoshi_spatial::{Base, CoordinateFrame, Pose, Twist, World, skew};
use nalgebra::{Matrix3, Matrix3xX, Matrix6xX, Rotation3, UnitQuaternion, Vector3, Vector6};

/// Degrees of freedom of the floating base.
pub const BASE_DOF: usize = 6;

/// Workspace of the kinematics of one robot. It allocates at construction and never after; each
/// [`Kinematics::update`] overwrites all of it.
#[derive(Clone, Debug)]
pub struct Kinematics {
    bodies: Vec<BodyPose>,
    /// Joint axes in the world.
    axes: Vec<Vector3<f64>>,
    /// First moment of mass of each body and of all that hangs on it, about the world's origin \[kg m\].
    moments: Vec<Vector3<f64>>,
    com: Vector3<f64>,
}

/// Rotation R_WK and origin p_WK of body K.
#[derive(Clone, Copy, Debug)]
struct BodyPose {
    rotation: Matrix3<f64>,
    position: Vector3<f64>,
}

impl BodyPose {
    /// The body that a joint moves, from the one it hangs on.
    #[inline(always)] // in the loop over all joints a call with its copies takes half as long again
    fn moved_by(&self, model: &Model, joint: usize, q: f64) -> (Self, Vector3<f64>) {
        let joint = &model.joints()[joint];
        let R_WJ = match &joint.origin_rotation {
            Some(rotation) => self.rotation * rotation,
            None => self.rotation,
        };
        let p_WJ = self.position + self.rotation * joint.origin.translation.vector;
        let axis_W = match joint.along {
            Some(along) => R_WJ.column(along).into_owned(),
            None => R_WJ * joint.axis.into_inner(),
        };
        let pose = match joint.kind {
            JointKind::Revolute => Self { rotation: turned(&R_WJ, joint, q), position: p_WJ },
            JointKind::Prismatic => Self { rotation: R_WJ, position: p_WJ + axis_W * q },
        };
        (pose, axis_W)
    }
}

/// R, and then a rotation about the joint's axis.
#[inline(always)] // as above
fn turned(R: &Matrix3<f64>, joint: &Joint, angle_rad: f64) -> Matrix3<f64> {
    let (sin, cos) = angle_rad.sin_cos();
    let Some(along) = joint.along else { return R * rotation_about(&joint.axis, sin, cos) };
    // Of a rotation about a coordinate axis most entries are zero. One rounds as Rodrigues' formula does, so that
    // the result does not depend on how an axis is written.
    let (x, y, z) = (R.column(0), R.column(1), R.column(2));
    let one = cos + (1.0 - cos);
    match along {
        0 => Matrix3::from_columns(&[x * one, y * cos + z * sin, y * -sin + z * cos]),
        1 => Matrix3::from_columns(&[x * cos + z * -sin, y * one, x * sin + z * cos]),
        _ => Matrix3::from_columns(&[x * cos + y * sin, x * -sin + y * cos, z * one]),
    }
}

/// Rodrigues' formula: R = cos θ I + sin θ [a]× + (1 − cos θ) a aᵀ.
fn rotation_about(axis: &Vector3<f64>, sin: f64, cos: f64) -> Matrix3<f64> {
    let a = axis * (1.0 - cos);
    let s = axis * sin;
    Matrix3::new(
        cos + a.x * axis.x,
        a.x * axis.y - s.z,
        a.x * axis.z + s.y,
        a.y * axis.x + s.z,
        cos + a.y * axis.y,
        a.y * axis.z - s.x,
        a.z * axis.x - s.y,
        a.z * axis.y + s.x,
        cos + a.z * axis.z,
    )
}

/// The joints of a set, in ascending order: every joint after those it hangs on.
pub(crate) fn joints_of(mut set: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let joint = set.trailing_zeros() as usize;
        set &= set.wrapping_sub(1);
        (joint < u64::BITS as usize).then_some(joint)
    })
}

impl Kinematics {
    /// A workspace for a robot.
    pub fn new(model: &Model) -> Self {
        let origin = BodyPose { rotation: Matrix3::identity(), position: Vector3::zeros() };
        Self {
            bodies: vec![origin; model.bodies().len()],
            axes: vec![Vector3::zeros(); model.joint_count()],
            moments: vec![Vector3::zeros(); model.bodies().len()],
            com: Vector3::zeros(),
        }
    }

    /// Overwrites the workspace with NaN, for tests that nothing survives from tick to tick.
    pub fn fill_with_nan(&mut self) {
        let nan = Vector3::repeat(f64::NAN);
        self.bodies.fill(BodyPose { rotation: Matrix3::repeat(f64::NAN), position: nan });
        self.axes.fill(nan);
        self.moments.fill(nan);
        self.com = nan;
    }

    /// Poses of all bodies and the centre of mass, for the root link's pose `X_WB` and the joint
    /// positions `q` \[rad or m\] in the order of the model, at least as many as it has joints.
    pub fn update(&mut self, model: &Model, X_WB: &Pose<World, Base>, q: &[f64]) {
        self.bodies[0] = BodyPose {
            rotation: X_WB.rotation.to_rotation_matrix().into_inner(),
            position: X_WB.translation,
        };
        for (j, joint) in model.joints().iter().enumerate() {
            (self.bodies[j + 1], self.axes[j]) = self.bodies[joint.parent_body].moved_by(model, j, q[j]);
        }
        for ((moment, pose), body) in self.moments.iter_mut().zip(&self.bodies).zip(model.bodies()) {
            let inertial = &body.inertial;
            *moment = (pose.position + pose.rotation * inertial.com) * inertial.mass_kg;
        }
        for (j, joint) in model.joints().iter().enumerate().rev() {
            let beyond = self.moments[j + 1];
            self.moments[joint.parent_body] += beyond;
        }
        self.com = self.moments[0] / model.total_mass_kg();
    }

    /// Origin of a frame in the world \[m\].
    pub fn frame_position(&self, model: &Model, frame: FrameId) -> Vector3<f64> {
        let frame = model.frame(frame);
        let body = &self.bodies[frame.body];
        body.position + body.rotation * frame.pose.translation.vector
    }

    /// Pose of a frame in the world, under the name that the caller gives to it.
    pub fn frame_pose<F: CoordinateFrame>(&self, model: &Model, frame: FrameId) -> Pose<World, F> {
        let position = self.frame_position(model, frame);
        let frame = model.frame(frame);
        Pose::new(position, attitude(&self.bodies[frame.body].rotation, frame))
    }

    /// Centre of mass in the world \[m\].
    pub fn com(&self) -> Vector3<f64> {
        self.com
    }

    /// Origin \[m\] and axis of joint j in the world.
    pub(crate) fn joint(&self, j: usize) -> (Vector3<f64>, Vector3<f64>) {
        (self.bodies[j + 1].position, self.axes[j])
    }

    /// Centre of mass of all that joint j moves, which has some mass \[m\].
    pub(crate) fn com_beyond(&self, model: &Model, j: usize) -> Vector3<f64> {
        self.moments[j + 1] / model.subtree_mass_kg(j + 1)
    }

    /// Geometric Jacobian of a frame's origin, 6 × (6 + n): ẋ_F = J ν, world axes, linear before
    /// angular.
    pub fn frame_jacobian(&self, model: &Model, frame: FrameId, jacobian: &mut Matrix6xX<f64>) {
        let p_WF = self.frame_position(model, frame);
        let path = model.path(model.frame(frame).body);
        jacobian.as_mut_slice().fill(0.0);
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        jacobian.fixed_view_mut::<3, 3>(3, 3).fill_with_identity();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&(p_WF - self.bodies[0].position)));
        for j in joints_of(path) {
            jacobian.set_column(BASE_DOF + j, &self.column(model, j, &p_WF));
        }
    }

    /// Jacobian of the centre of mass, 3 × (6 + n): ċ = J ν, world axes.
    pub fn com_jacobian(&self, model: &Model, jacobian: &mut Matrix3xX<f64>) {
        jacobian.fixed_view_mut::<3, 3>(0, 0).fill_with_identity();
        jacobian.fixed_view_mut::<3, 3>(0, 3).copy_from(&-skew(&(self.com - self.bodies[0].position)));
        for j in 0..model.joint_count() {
            jacobian.set_column(BASE_DOF + j, &self.com_column(model, j));
        }
    }

    /// Columns that are not zero of a frame's Jacobian over the joints alone while `stance` stays where it is, in
    /// ascending order of the joints: J_q − J_b J_sb⁻¹ J_sq, with J and J_s the Jacobians of the frame and of the
    /// stance frame, and b, q their parts for base and joints. World axes, linear before angular.
    ///
    /// With a rigid base that product needs no inverse: a joint between the frame and the root moves
    /// the frame; one between the stance and the root moves all the rest the opposite way; one on both
    /// paths moves neither against the other.
    pub fn stance_columns<'a>(
        &'a self,
        model: &'a Model,
        frame: FrameId,
        stance: FrameId,
    ) -> impl Iterator<Item = (usize, Vector6<f64>)> + 'a {
        let p_WF = self.frame_position(model, frame);
        let frame_path = model.path(model.frame(frame).body);
        let stance_path = model.path(model.frame(stance).body);
        joints_of(frame_path ^ stance_path).map(move |j| {
            let column = self.column(model, j, &p_WF);
            (j, if frame_path >> j & 1 == 1 { column } else { -column })
        })
    }

    /// Columns of the Jacobian of the centre of mass over the joints alone while `stance` stays where it is, one for
    /// each joint.
    pub fn stance_com_columns<'a>(
        &'a self,
        model: &'a Model,
        stance: FrameId,
    ) -> impl Iterator<Item = Vector3<f64>> + 'a {
        let stance_path = model.path(model.frame(stance).body);
        (0..model.joint_count()).map(move |j| {
            let column = self.com_column(model, j);
            if stance_path >> j & 1 == 1 { column - self.linear_column(model, j, &self.com) } else { column }
        })
    }

    /// Twist of a frame's origin in world axes, for the base's twist (of the root link's origin, world
    /// axes) and the joint velocities.
    pub fn frame_twist(
        &self,
        model: &Model,
        frame: FrameId,
        base_twist: &Twist<World>,
        joint_velocity: &[f64],
    ) -> Twist<World> {
        let p_WF = self.frame_position(model, frame);
        let from_base = base_twist.shifted(&(p_WF - self.bodies[0].position)).to_vector();
        let twist = joints_of(model.path(model.frame(frame).body))
            .fold(from_base, |sum, j| sum + self.column(model, j, &p_WF) * joint_velocity[j]);
        Twist::from_vector(&twist)
    }

    /// Velocity of the centre of mass in world axes \[m/s\], for the base's twist and the joint
    /// velocities.
    pub fn com_velocity(
        &self,
        model: &Model,
        base_twist: &Twist<World>,
        joint_velocity: &[f64],
    ) -> Vector3<f64> {
        let from_base = base_twist.shifted(&(self.com - self.bodies[0].position)).linear;
        (0..model.joint_count()).fold(from_base, |sum, j| sum + self.com_column(model, j) * joint_velocity[j])
    }

    /// What one unit of joint j's velocity does to a point of a body beyond it.
    #[inline]
    fn column(&self, model: &Model, j: usize, point: &Vector3<f64>) -> Vector6<f64> {
        let linear = self.linear_column(model, j, point);
        let angular = match model.joints()[j].kind {
            JointKind::Revolute => self.axes[j],
            JointKind::Prismatic => Vector3::zeros(),
        };
        Vector6::new(linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    }

    /// Its linear half.
    #[inline]
    fn linear_column(&self, model: &Model, j: usize, point: &Vector3<f64>) -> Vector3<f64> {
        match model.joints()[j].kind {
            JointKind::Revolute => self.axes[j].cross(&(point - self.bodies[j + 1].position)),
            JointKind::Prismatic => self.axes[j],
        }
    }

    /// What one unit of joint j's velocity does to the centre of mass.
    #[inline]
    fn com_column(&self, model: &Model, j: usize) -> Vector3<f64> {
        let axis = &self.axes[j];
        let mass = model.subtree_mass_kg(j + 1);
        let moved = match model.joints()[j].kind {
            JointKind::Revolute => axis.cross(&(self.moments[j + 1] - self.bodies[j + 1].position * mass)),
            JointKind::Prismatic => axis * mass,
        };
        moved / model.total_mass_kg()
    }
}

impl Model {
    /// Pose of a frame in the root link, by the joints between them only: for a chain or two this costs
    /// less than [`Kinematics::update`].
    pub fn pose_in_base<F: CoordinateFrame>(&self, frame: FrameId, q: &[f64]) -> Pose<Base, F> {
        let frame = self.frame(frame);
        let root = BodyPose { rotation: Matrix3::identity(), position: Vector3::zeros() };
        let body = joints_of(self.path(frame.body)).fold(root, |pose, j| pose.moved_by(self, j, q[j]).0);
        Pose::new(
            body.position + body.rotation * frame.pose.translation.vector,
            attitude(&body.rotation, frame),
        )
    }
}

/// Of a frame on a body whose rotation this is: a matrix that is a rotation by construction.
fn attitude(body: &Matrix3<f64>, frame: &Frame) -> UnitQuaternion<f64> {
    let body = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(*body));
    if frame.is_turned { body * frame.pose.rotation } else { body }
}
