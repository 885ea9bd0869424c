//! One robot as a multibody: its links, its drives, and how its sensors feel.

use crate::convert::{force_and_torque, from_isometry, from_vector, isometry, matrix, pose, vector};
use mikoshi_config::RobotSpec;
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::estimate::ForceTorqueSensor;
use mikoshi_humanoid::model::{FrameId, Geometry, JointKind, Shape};
use mikoshi_ipc_types::JointCommand;
use mikoshi_physics::{BuildWorldError, GRAVITY_M_S2, drive_reference};
use mikoshi_robot::Robot;
use mikoshi_spatial::{Base, CoordinateFrame, Pose, Sensor, Twist, World, Wrench};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::*;

/// A joint's drive: a position servo within its effort.
struct Drive {
    kp: f64,
    kv: f64,
    effort: f64,
    limits: [f64; 2],
    kind: JointKind,
    /// In the moved body.
    axis: Vector3<f64>,
    /// Its place among the multibody's velocities.
    dof: usize,
    /// Its link in the multibody.
    link: usize,
    /// What it was told to be at in this step, and what it pushes with instead where it stands at its limit.
    reference: f64,
    at_limit: Option<f64>,
}

/// Where a link was going at the beginning of a step.
#[derive(Clone, Copy, Default)]
struct Motion {
    linear: Vector3<f64>,
    angular: Vector3<f64>,
}

/// One robot.
pub struct Articulation {
    pub body: Robot,
    links: Vec<RigidBodyHandle>,
    drives: Vec<Drive>,
    before: Vec<Motion>,
    /// How each link came to move otherwise in the last step: of its centre of mass, and about it.
    acceleration: Vec<Motion>,
}

/// What a robot's colliders say of themselves: which robot's and which link's they are.
pub fn tag(robot: usize, link: usize) -> u128 {
    (robot as u128 + 1) << 32 | link as u128
}

impl Articulation {
    /// Puts a robot into the world, as the run has it at tick 0.
    pub fn insert(spec: &RobotSpec, index: usize, world: &mut PhysicsWorld) -> Result<Self, BuildWorldError> {
        let name = spec.member.name.clone();
        let body = Robot::new(&spec.config, &spec.urdf)
            .and_then(|robot| robot.with_hands(&spec.grasping_hands))
            .map_err(|source| BuildWorldError::Robot { robot: name.clone(), source })?;
        let model = &body.model;
        let X_WB = Pose::<World, Base>::from_array(&spec.initial_base_pose).ok_or_else(|| {
            let what = format!("{:?} is not a pose", spec.initial_base_pose);
            BuildWorldError::Inconsistent { place: format!("robot '{name}'"), what }
        })?;
        let mut kinematics = Kinematics::new(model);
        kinematics.update(model, &X_WB, &spec.initial_posture_rad);

        let mut links = vec![];
        for (number, part) in model.bodies().iter().enumerate() {
            let frame = model.find_frame(&part.name).map_err(|error| rejects(&error.to_string()))?;
            let at: Pose<World, Base> = kinematics.frame_pose(model, frame);
            let mass = &part.inertial;
            let mass =
                MassProperties::with_inertia_matrix(vector(&mass.com), mass.mass_kg, matrix(&mass.inertia));
            let link = RigidBodyBuilder::dynamic()
                .pose(isometry(&Isometry3::from_parts(at.translation.into(), at.rotation)))
                .additional_mass_properties(mass)
                .can_sleep(false);
            let link = world.insert_body(link);
            for shape in &part.collisions {
                let collider = ColliderBuilder::new(form(shape, &name)?)
                    .position(isometry(&shape.pose))
                    .density(0.0)
                    .user_data(tag(index, number))
                    .active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
                world.insert_collider(collider, Some(link));
            }
            links.push(link);
        }
        let mut drives = vec![];
        for (joint, child) in model.joints().iter().zip(1..) {
            let drive = spec
                .config
                .drive_of(&joint.name)
                .ok_or_else(|| BuildWorldError::NoDrive { robot: name.clone(), joint: joint.name.clone() })?;
            let along = UnitQuaternion::rotation_between(&Vector3::x(), &joint.axis)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI));
            let along = Isometry3::from_parts(Vector3::zeros().into(), along);
            let locked = match joint.kind {
                JointKind::Revolute => JointAxesMask::LOCKED_REVOLUTE_AXES,
                JointKind::Prismatic => JointAxesMask::LOCKED_PRISMATIC_AXES,
            };
            let joined = GenericJointBuilder::new(locked)
                .local_frame1(isometry(&(joint.origin * along)))
                .local_frame2(isometry(&along))
                .contacts_enabled(false);
            let parent = links[joint.parent_body];
            world
                .insert_multibody_joint(parent, links[child], joined.build())
                .ok_or_else(|| rejects("a loop"))?;
            drives.push(Drive {
                kp: drive.kp_nm_rad,
                kv: drive.kv_nms_rad,
                effort: joint.effort,
                limits: [joint.lower, joint.upper],
                kind: joint.kind,
                axis: joint.axis.into_inner(),
                dof: 0,
                link: 0,
                reference: 0.0,
                at_limit: None,
            });
        }
        let motions = vec![Motion::default(); links.len()];
        let mut robot = Self { body, links, drives, before: motions.clone(), acceleration: motions };
        robot.assume(spec, world)?;
        Ok(robot)
    }

    /// Puts all joints where they are at tick 0, and gives drives their inertia.
    fn assume(&mut self, spec: &RobotSpec, world: &mut PhysicsWorld) -> Result<(), BuildWorldError> {
        let PhysicsWorld { multibody_joints, bodies, .. } = world;
        let root = multibody_joints.rigid_body_link(self.links[0]).copied();
        let root = root.ok_or_else(|| rejects("a robot without joints"))?;
        for (drive, link) in self.drives.iter_mut().zip(&self.links[1..]) {
            drive.link = multibody_joints.rigid_body_link(*link).map_or(0, |link| link.id);
        }
        let multibody =
            multibody_joints.get_multibody_mut(root.multibody).ok_or_else(|| rejects("no body"))?;
        multibody.set_self_contacts_enabled(true);
        // The root's degrees of freedom are there once it is known to float.
        multibody.forward_kinematics(bodies, true);
        let mut displacements = vec![0.0; multibody.ndofs()];
        for (id, dof) in (1..multibody.num_links()).zip(6..) {
            let owner = self.drives.iter().position(|drive| drive.link == id);
            let owner = owner.ok_or_else(|| rejects("a joint that is nobody's"))?;
            self.drives[owner].dof = dof;
            displacements[dof] = spec.initial_posture_rad[owner];
        }
        multibody.apply_displacements(&displacements);
        multibody.damping_mut().fill(0.0);
        for (drive, joint) in self.drives.iter_mut().zip(self.body.model.joints()) {
            let config = spec.config.drive_of(&joint.name);
            multibody.armature_mut()[drive.dof] = config.map_or(0.0, |config| config.armature_kg_m2);
        }
        multibody.forward_kinematics(bodies, true);
        multibody.update_rigid_bodies(bodies, true);
        Ok(())
    }

    /// Number of joints.
    pub fn joint_count(&self) -> usize {
        self.drives.len()
    }

    /// Lower and upper limit of every joint.
    pub fn limits(&self) -> Vec<[f64; 2]> {
        self.drives.iter().map(|drive| drive.limits).collect()
    }

    fn multibody<'a>(&self, world: &'a PhysicsWorld) -> Option<&'a Multibody> {
        let root = world.multibody_joints.rigid_body_link(self.links[0])?;
        world.multibody_joints.get_multibody(root.multibody)
    }

    /// Angle and rate of a joint.
    fn joint(&self, multibody: &Multibody, joint: usize) -> (f64, f64) {
        let drive = &self.drives[joint];
        let place = match drive.kind {
            JointKind::Revolute => 3,
            JointKind::Prismatic => 0,
        };
        let angle = multibody.link(drive.link).map_or(0.0, |link| link.joint().coords()[place]);
        (angle, multibody.generalized_velocity()[drive.dof])
    }

    /// Angles and rates of all joints.
    pub fn joints(&self, world: &PhysicsWorld) -> impl Iterator<Item = (f64, f64)> {
        let multibody = self.multibody(world);
        (0..self.drives.len()).map(move |joint| multibody.map_or((0.0, 0.0), |it| self.joint(it, joint)))
    }

    /// The drives' references at `share` of the way from one command to the next: a spring and a damper each, within
    /// its effort. Says of each how much torque it asks for.
    pub fn set_drives(
        &mut self,
        world: &mut PhysicsWorld,
        (from, to, share): (&JointCommand, &JointCommand, f64),
        mut demand_nm: impl FnMut(usize, f64, bool),
    ) {
        for link in &self.links {
            if let Some(body) = world.bodies.get_mut(*link) {
                body.reset_forces(false);
                body.reset_torques(false);
            }
        }
        let Some(root) = world.multibody_joints.rigid_body_link(self.links[0]).copied() else { return };
        for joint in 0..self.drives.len() {
            let Some(multibody) = world.multibody_joints.get_multibody(root.multibody) else { return };
            let (angle, rate) = self.joint(multibody, joint);
            let drive = &mut self.drives[joint];
            drive.reference = drive_reference((from, to), joint, share, (drive.kp, drive.kv));
            let demand = drive.kp * (drive.reference - angle) - drive.kv * rate;
            drive.at_limit = (demand.abs() >= drive.effort).then(|| drive.effort.copysign(demand));
            demand_nm(joint, demand.abs(), drive.at_limit.is_some());
            let (stiffness, damping) =
                if drive.at_limit.is_some() { (0.0, 0.0) } else { (drive.kp, drive.kv) };
            let Some(multibody) = world.multibody_joints.get_multibody_mut(root.multibody) else { return };
            multibody.damping_mut()[drive.dof] = damping;
            let place = if drive.kind == JointKind::Revolute { 3 } else { 0 };
            if let Some(link) = multibody.link_mut(drive.link) {
                link.joint.set_spring(place, stiffness, drive.reference);
            }
            if let Some(push) = drive.at_limit {
                self.push_joint(world, joint, push);
            }
        }
    }

    /// Force or torque between the two links of a joint.
    fn push_joint(&self, world: &mut PhysicsWorld, joint: usize, push: f64) {
        let parent = self.links[self.body.model.joints()[joint].parent_body];
        let child = self.links[joint + 1];
        let Some(X_WL) = world.bodies.get(child).map(|body| *body.position()) else { return };
        let drive = &self.drives[joint];
        let along = X_WL.rotation * vector(&drive.axis) * push;
        for (link, along) in [(child, along), (parent, -along)] {
            let Some(body) = world.bodies.get_mut(link) else { continue };
            match drive.kind {
                JointKind::Revolute => body.add_torque(along, false),
                JointKind::Prismatic => body.add_force_at_point(along, X_WL.translation, false),
            }
        }
    }

    /// What each drive applied in the last step.
    pub fn torques(&self, world: &PhysicsWorld) -> impl Iterator<Item = f64> {
        self.joints(world).zip(&self.drives).map(|((angle, rate), drive)| {
            drive.at_limit.unwrap_or(drive.kp * (drive.reference - angle) - drive.kv * rate)
        })
    }

    /// Before a step: how links move.
    pub fn note_motions(&mut self, world: &PhysicsWorld) {
        for (before, link) in self.before.iter_mut().zip(&self.links) {
            *before = motion(world, *link);
        }
    }

    /// After a step: how that has changed.
    pub fn note_accelerations(&mut self, world: &PhysicsWorld, step_s: f64) {
        for ((acceleration, before), link) in self.acceleration.iter_mut().zip(&self.before).zip(&self.links)
        {
            let now = motion(world, *link);
            *acceleration = Motion {
                linear: (now.linear - before.linear) / step_s,
                angular: (now.angular - before.angular) / step_s,
            };
        }
    }

    /// Where a frame is.
    pub fn frame_pose<F: CoordinateFrame>(&self, world: &PhysicsWorld, frame: FrameId) -> Pose<World, F> {
        let frame = self.body.model.frame(frame);
        pose(&(self.link_pose(world, frame.body) * frame.pose))
    }

    pub fn link_pose(&self, world: &PhysicsWorld, link: usize) -> Isometry3<f64> {
        world
            .bodies
            .get(self.links[link])
            .map_or_else(Isometry3::identity, |body| from_isometry(body.position()))
    }

    /// The twist of a frame, at its origin.
    pub fn frame_twist(&self, world: &PhysicsWorld, frame: FrameId) -> Twist<World> {
        let link = self.links[self.body.model.frame(frame).body];
        let at = self.frame_pose::<Sensor>(world, frame).translation;
        world.bodies.get(link).map_or_else(Twist::zero, |body| {
            Twist::new(from_vector(body.velocity_at_point(vector(&at))), from_vector(body.angvel()))
        })
    }

    /// A wrench on the link that carries a frame, at the frame's origin, for the step to come.
    pub fn apply(&self, world: &mut PhysicsWorld, frame: FrameId, wrench: &Wrench<World>) {
        let at = self.frame_pose::<Sensor>(world, frame).translation;
        let (force, torque) = force_and_torque(wrench);
        if let Some(body) = world.bodies.get_mut(self.links[self.body.model.frame(frame).body]) {
            body.add_force_at_point(force, vector(&at), false);
            body.add_torque(torque, false);
        }
    }

    /// A force at the base's origin, for the step to come.
    pub fn push(&self, world: &mut PhysicsWorld, force_n: Vector3<f64>) {
        if let Some(base) = world.bodies.get_mut(self.links[0]) {
            let at = base.position().translation;
            base.add_force_at_point(vector(&force_n), at, false);
        }
    }

    /// Centre of mass.
    pub fn com(&self, world: &PhysicsWorld) -> Vector3<f64> {
        let bodies = self.links.iter().filter_map(|link| world.bodies.get(*link));
        let (moment, mass) = bodies.fold((Vector3::zeros(), 0.0), |(moment, mass), body| {
            (moment + from_vector(body.center_of_mass()) * body.mass(), mass + body.mass())
        });
        moment / mass
    }

    /// What a sensor reads: what it takes to move what it carries as it moves, against gravity and what touches that part.
    /// `F = m (a − g) − F_touch`, `n = I α + ω × I ω + c × m (a − g) − n_touch`, at the sensor in its axes; `touch` is
    /// at the sensor's origin, too.
    pub fn reading(
        &self,
        world: &PhysicsWorld,
        sensor: &ForceTorqueSensor,
        touch: &Wrench<World>,
    ) -> [f64; 6] {
        let frame = self.body.model.frame(sensor.frame);
        let X_WS: Pose<World, Sensor> = self.frame_pose(world, sensor.frame);
        let R = X_WS.rotation;
        let Motion { linear, angular: alpha } = self.acceleration[frame.body];
        let Some(link) = world.bodies.get(self.links[frame.body]) else { return [0.0; 6] };
        let omega = from_vector(link.angvel());
        let carried = &sensor.carried;
        let com = X_WS.translation + R * carried.com;
        let from_link = com - from_vector(link.center_of_mass());
        let acceleration = linear + alpha.cross(&from_link) + omega.cross(&omega.cross(&from_link));
        let force = (acceleration + Vector3::z() * GRAVITY_M_S2) * carried.mass_kg;
        let turn = |v: Vector3<f64>| R * (carried.inertia * R.inverse_transform_vector(&v));
        let moment = turn(alpha) + omega.cross(&turn(omega)) + (R * carried.com).cross(&force);
        let at_sensor = Wrench::<World>::new(force, moment) - *touch;
        let (force, moment) = (R.inverse() * at_sensor.force, R.inverse() * at_sensor.moment);
        [force.x, force.y, force.z, moment.x, moment.y, moment.z]
    }

    /// What gyroscope and accelerometer read.
    pub fn inertial(&self, world: &PhysicsWorld) -> ([f64; 3], [f64; 3]) {
        let frame = self.body.model.frame(self.body.imu);
        let X_WI: Pose<World, Sensor> = self.frame_pose(world, self.body.imu);
        let Some(link) = world.bodies.get(self.links[frame.body]) else { return Default::default() };
        let Motion { linear, angular: alpha } = self.acceleration[frame.body];
        let omega = from_vector(link.angvel());
        let from_com = X_WI.translation - from_vector(link.center_of_mass());
        let acceleration = linear + alpha.cross(&from_com) + omega.cross(&omega.cross(&from_com));
        let turned = X_WI.rotation.inverse();
        ((turned * omega).into(), (turned * (acceleration + Vector3::z() * GRAVITY_M_S2)).into())
    }
}

fn motion(world: &PhysicsWorld, link: RigidBodyHandle) -> Motion {
    world.bodies.get(link).map_or_else(Motion::default, |body| Motion {
        linear: from_vector(body.linvel()),
        angular: from_vector(body.angvel()),
    })
}

pub fn rejects(what: &str) -> BuildWorldError {
    BuildWorldError::Simulator { engine: "Rapier", what: what.to_owned() }
}

fn form(shape: &Shape, robot: &str) -> Result<SharedShape, BuildWorldError> {
    // Rapier's cylinders and capsules stand along y.
    let upright = |it: SharedShape| {
        let turn = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::FRAC_PI_2);
        SharedShape::compound(vec![(isometry(&Isometry3::from_parts(Vector3::zeros().into(), turn)), it)])
    };
    Ok(match &shape.geometry {
        Geometry::Box { size } => SharedShape::cuboid(0.5 * size.x, 0.5 * size.y, 0.5 * size.z),
        Geometry::Cylinder { radius, length } => upright(SharedShape::cylinder(0.5 * length, *radius)),
        Geometry::Capsule { radius, length } => upright(SharedShape::capsule_y(0.5 * length, *radius)),
        Geometry::Sphere { radius } => SharedShape::ball(*radius),
        Geometry::Mesh { file, .. } => {
            return Err(BuildWorldError::Inconsistent {
                place: format!("robot '{robot}'"),
                what: format!(
                    "{} is a mesh, and this engine is given boxes, cylinders, capsules and spheres only: \
                     set meshes = \"left-out\"",
                    file.display()
                ),
            });
        }
    })
}
