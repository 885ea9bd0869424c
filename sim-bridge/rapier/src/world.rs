//! The world of a run, tick by tick.

use crate::articulation::{Articulation, rejects};
use crate::contacts::{self, Exclusions, FIXED_BOX, FLOOR, OBJECT, Touched, Touching};
use crate::convert::{from_isometry, from_vector, isometry, matrix, pose, vector};
use crate::hand::{self, Hand};
use bytemuck::Zeroable;
use mikoshi_config::{RunSpec, Scenario};
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_ipc_types::{
    JointCommand, MAX_FEET, MAX_JOINTS, ObjectTruth, Push, RobotTruth, Sensors, all_hands,
};
use mikoshi_physics::{
    ActivePush, BuildWorldError, GRAVITY_M_S2, LoadWorldError, Noise, ObjectBody, Physics, PushScript,
    SETTLING_S, SensorCounts, Spring, Stance, Standing, StepWorldError, begin, check_commands, force_n,
    grasp_offsets, steps_in_a_tick,
};
use mikoshi_spatial::{Foot, Hand as HandFrame, Object, Pose, Twist, Wrench};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rapier3d_f64::prelude::*;
use xxhash_rust::xxh3::xxh3_64;

/// Sweeps over all contacts in a physics step.
const SWEEPS: usize = 20;
/// How soft contacts are. Rapier's own ratio, 10, lets soles creep back for a second after they have landed.
const CONTACT_HZ: f64 = 30.0;
const CONTACT_DAMPING_RATIO: f64 = 1.0;
/// Half of the floor's edge.
const FLOOR_M: f64 = 20.0;

/// One simulated world: the robots of a run, their object, the floor, and the boxes that stand on it.
pub struct World {
    world: PhysicsWorld,
    exclusions: Exclusions,
    robots: Vec<Robot>,
    object: RigidBodyHandle,
    /// What the object is from which tick on.
    bodies: Vec<(u64, ObjectBody)>,
    spring: Spring,
    push_script: PushScript,
    substeps: u64,
    depth: usize,
    fingerprint: u64,
    tick: u64,
    commands: Vec<JointCommand>,
    /// The hands of each robot that hold the object: bit h for hand h.
    holding: Vec<u64>,
    pushes: Vec<ActivePush>,
    rejected: u64,
    touched: Vec<Touched>,
    touching: Touching,
    object_truth: ObjectTruth,
}

/// A robot, its hands, and what is said of it.
struct Robot {
    body: Articulation,
    hands: Vec<Hand>,
    standing: Standing,
    noise: Option<Noise>,
    /// The readings of the last ticks: tick k at place k mod their number.
    readings: Vec<Sensors>,
    truth: RobotTruth,
    torque_sum_nm: [f64; MAX_JOINTS],
    torque_peak_nm: [f64; MAX_JOINTS],
    saturated_joints: u64,
}

impl Physics for World {
    const ENGINE: &'static str = "Rapier";

    fn new(run: &RunSpec) -> Result<Self, BuildWorldError> {
        let scenario = &run.scenario;
        refuse_what_is_not_here(run)?;
        let substeps = steps_in_a_tick(scenario)?;
        let mut world =
            PhysicsWorld { gravity: vector(&(Vector3::z() * -GRAVITY_M_S2)), ..Default::default() };
        set_up_solver(&mut world.integration_parameters, scenario);
        let friction = scenario.physics.friction;
        let floor =
            ColliderBuilder::cuboid(FLOOR_M, FLOOR_M, 0.5).translation(vector(&Vector3::new(0.0, 0.0, -0.5)));
        world.insert_collider(floor.friction(friction).user_data(FLOOR), None);
        for fixed in &scenario.world.boxes {
            let [x, y, z] = fixed.size_m.map(|edge| 0.5 * edge);
            let collider = ColliderBuilder::cuboid(x, y, z)
                .position(isometry(&placed(fixed.position_m, fixed.yaw_deg)))
                .friction(fixed.friction.unwrap_or(friction))
                .user_data(FIXED_BOX);
            world.insert_collider(collider, None);
        }
        let object = insert_object(&mut world, scenario);
        let mut robots = vec![];
        for (index, spec) in run.robots.iter().enumerate() {
            robots.push(Robot::insert(run, index, spec, &mut world)?);
        }
        for (_, collider) in world.colliders.iter_mut() {
            if collider.user_data > FIXED_BOX {
                collider.set_friction(friction);
            }
        }
        let hands = robots.iter().map(|robot| robot.hands.len()).sum();
        let bodies: Vec<&Articulation> = robots.iter().map(|robot| &robot.body).collect();
        let exclusions = Exclusions::of(&bodies);
        let count = robots.len();
        let first_commands =
            run.robots.iter().zip(&robots).map(|(spec, robot)| robot.first_command(scenario, spec));
        let commands: Vec<_> = first_commands.collect();
        let mut it = Self {
            world,
            exclusions,
            object,
            bodies: vec![],
            spring: hand::spring(scenario, hands)?,
            push_script: PushScript::default(),
            substeps,
            depth: scenario.sensors.delay_ticks as usize + 1,
            fingerprint: xxh3_64(format!("{} {run:?}", Self::ENGINE).as_bytes()),
            tick: 0,
            holding: commands.iter().map(|command| command.closed_hands).collect(),
            commands,
            pushes: vec![ActivePush::default(); count + 1],
            rejected: 0,
            touched: vec![Touched::default(); count],
            touching: Touching::default(),
            object_truth: ObjectTruth::zeroed(),
            robots,
        };
        it.settle()?;
        it.push_script = PushScript::of(run);
        it.bodies = ObjectBody::all(scenario);
        Ok(it)
    }

    fn robot_count(&self) -> usize {
        self.robots.len()
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn joint_limits(&self) -> impl Iterator<Item = Vec<[f64; 2]>> {
        self.robots.iter().map(|robot| robot.body.limits())
    }

    fn commands(&self) -> &[JointCommand] {
        &self.commands
    }

    fn push(&mut self, push: &Push) {
        begin(&mut self.pushes, push, self.tick);
    }

    fn note_rejected(&mut self, robots: u64) {
        self.rejected = robots;
    }

    fn tick(&self) -> u64 {
        self.tick
    }

    fn sense(&self, robot: usize, sensors: &mut Sensors) {
        // Tick k lies at k mod depth; the oldest, `delay` = depth − 1 ticks ago, follows it.
        *sensors = self.robots[robot].readings[(self.tick as usize + 1) % self.depth];
    }

    fn robot_truth(&self, robot: usize, truth: &mut RobotTruth) {
        *truth = self.robots[robot].truth;
    }

    fn object_truth(&self, truth: &mut ObjectTruth) {
        *truth = self.object_truth;
    }

    fn step(&mut self, commands: &[JointCommand]) -> Result<(), StepWorldError> {
        check_commands(commands, self.robot_count())?;
        self.change_object();
        self.push_script.begin(&mut self.pushes, self.tick);
        self.close_and_open(commands);
        self.touching = Touching::default();
        self.touched.fill(Touched::default());
        self.robots.iter_mut().for_each(Robot::forget);
        for substep in 1..=self.substeps {
            self.substep(commands, substep as f64 / self.substeps as f64);
        }
        let is_physics = self.world.bodies.get(self.object).is_some_and(|object| {
            from_vector(object.translation()).iter().all(|p| p.is_finite() && p.abs() < 2.0 * FLOOR_M)
        });
        if !is_physics {
            return Err(StepWorldError::Diverged);
        }
        self.commands.copy_from_slice(commands);
        self.note_pushes();
        self.tick += 1;
        self.observe();
        Ok(())
    }

    fn checkpoint_size(&self) -> usize {
        0
    }

    fn save(&mut self, _: &mut [u8]) -> Result<(), LoadWorldError> {
        Ok(())
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), LoadWorldError> {
        Err(LoadWorldError { found: checkpoint.len(), expected: usize::MAX })
    }
}

/// What a scenario may ask for and this engine does not do.
fn refuse_what_is_not_here(run: &RunSpec) -> Result<(), BuildWorldError> {
    let scenario = &run.scenario;
    let refuse =
        |place: &str, what: String| Err(BuildWorldError::Inconsistent { place: place.to_owned(), what });
    if !scenario.world.grasp_failures.is_empty() {
        return refuse(
            "[[world.grasp_failures]]",
            "hands don't fail in this engine: leave them out".to_owned(),
        );
    }
    if scenario.world.ground.is_some() {
        return refuse("[world.ground]", "the floor is flat in this engine: leave it out".to_owned());
    }
    Ok(())
}

fn set_up_solver(solver: &mut IntegrationParameters, scenario: &Scenario) {
    solver.dt = scenario.physics.step_s;
    // One solution of the dynamics a step: its contact impulses are all there are.
    solver.num_solver_iterations = 1;
    solver.num_internal_pgs_iterations = SWEEPS;
    solver.static_contact_softness = SpringCoefficients::new(CONTACT_HZ, CONTACT_DAMPING_RATIO);
    solver.contact_softness = solver.static_contact_softness;
    solver.friction_model = FrictionModel::Coulomb;
    solver.contact_clustering = false;
    solver.contact_recycling = false;
    solver.friction_in_bias_pass = true;
    solver.max_ccd_substeps = 0;
}

fn placed(position_m: [f64; 3], yaw_deg: f64) -> Isometry3<f64> {
    Isometry3::from_parts(
        Vector3::from(position_m).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians()),
    )
}

fn mass_of(body: &ObjectBody) -> MassProperties {
    MassProperties::with_inertia_matrix(vector(&body.com_m), body.mass_kg, matrix(&body.inertia_kg_m2))
}

fn insert_object(world: &mut PhysicsWorld, scenario: &Scenario) -> RigidBodyHandle {
    let object = &scenario.object;
    let [x, y, z] = object.size_m;
    let body = RigidBodyBuilder::dynamic()
        .pose(isometry(&placed(object.position_m, object.yaw_deg)))
        .additional_mass_properties(mass_of(&ObjectBody::of(object)))
        .can_sleep(false);
    let body = world.insert_body(body);
    let collider = ColliderBuilder::cuboid(0.5 * x, 0.5 * y, 0.5 * z)
        .density(0.0)
        .friction(scenario.physics.friction)
        .user_data(OBJECT)
        .active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS);
    world.insert_collider(collider, Some(body));
    body
}

impl Robot {
    fn insert(
        run: &RunSpec,
        index: usize,
        spec: &mikoshi_config::RobotSpec,
        world: &mut PhysicsWorld,
    ) -> Result<Self, BuildWorldError> {
        let scenario = &run.scenario;
        let body = Articulation::insert(spec, index, world)?;
        let pulled_to = grasp_offsets(scenario, index, spec);
        let hands = body.body.palms.iter().zip(pulled_to).zip(&spec.hand_in_object);
        let hands: Vec<_> = hands
            .map(|((palm, pulled_to), place)| Hand {
                palm: *palm,
                pulled_to,
                place: Pose::from_array(place).unwrap_or_else(Pose::identity),
                wrench: Wrench::zero(),
            })
            .collect();
        let counts = SensorCounts { joints: body.joint_count(), hands: hands.len(), feet: MAX_FEET };
        Ok(Self {
            standing: Standing {
                soles: body.body.sole_rectangles,
                weight_n: body.body.model.total_mass_kg() * GRAVITY_M_S2,
                initial_base_height_m: spec.initial_base_pose[2],
            },
            noise: Noise::of(&scenario.sensors, scenario.seed, index, counts, scenario.control_period_s),
            readings: vec![Sensors::zeroed(); scenario.sensors.delay_ticks as usize + 1],
            truth: RobotTruth::zeroed(),
            torque_sum_nm: [0.0; MAX_JOINTS],
            torque_peak_nm: [0.0; MAX_JOINTS],
            saturated_joints: 0,
            body,
            hands,
        })
    }

    /// What its drives were told before tick 0.
    fn first_command(&self, scenario: &Scenario, spec: &mikoshi_config::RobotSpec) -> JointCommand {
        let holds = scenario.begins_closed(&spec.member.name);
        let closed_hands = if holds { all_hands(self.hands.len()) } else { 0 };
        let mut command = JointCommand { closed_hands, ..JointCommand::zeroed() };
        let posture = command.joint_position_ref_rad.iter_mut().zip(&spec.initial_posture_rad);
        posture.for_each(|(to, from)| *to = *from);
        command
    }

    fn forget(&mut self) {
        self.torque_sum_nm = [0.0; MAX_JOINTS];
        self.torque_peak_nm = [0.0; MAX_JOINTS];
        self.saturated_joints = 0;
    }

    /// The link that carries a sole.
    fn foot_links(&self) -> [usize; MAX_FEET] {
        Side::BOTH.map(|side| self.body.body.model.frame(self.body.body.soles[side]).body)
    }

    fn observe(
        &mut self,
        world: &PhysicsWorld,
        touched: &Touched,
        (tick, depth, substeps): (u64, usize, u64),
        (holding, is_rejected): (u64, bool),
    ) {
        let mean = 1.0 / substeps as f64;
        let reading = &mut self.readings[tick as usize % depth];
        for (joint, (angle, rate)) in self.body.joints(world).enumerate() {
            reading.joint_position_rad[joint] = angle;
            reading.joint_velocity_rad_s[joint] = rate;
            reading.joint_torque_nm[joint] = self.torque_sum_nm[joint] * mean;
            self.truth.joint_position_rad[joint] = angle;
        }
        for (index, hand) in self.hands.iter().enumerate() {
            let sensor = &self.body.body.wrist_sensors[index];
            let at_sensor: Pose<mikoshi_spatial::World, HandFrame> =
                self.body.frame_pose(world, sensor.frame);
            let palm: Pose<mikoshi_spatial::World, HandFrame> = self.body.frame_pose(world, hand.palm);
            let touch = (-hand.wrench).shifted(&(palm.translation - at_sensor.translation));
            reading.wrist_wrench[index] = self.body.reading(world, sensor, &touch);
            self.truth.hand_pose[index] = palm.to_array();
            self.truth.hand_wrench[index] = hand.wrench.to_array();
        }
        for (index, side) in Side::BOTH.into_iter().enumerate() {
            let sensor = &self.body.body.ankle_sensors[side];
            let at_sensor: Pose<mikoshi_spatial::World, HandFrame> =
                self.body.frame_pose(world, sensor.frame);
            let touch = touched.ground[index].shifted(&-at_sensor.translation);
            reading.ankle_wrench[index] = self.body.reading(world, sensor, &touch);
        }
        (reading.imu_angular_velocity_rad_s, reading.imu_specific_force_m_s2) = self.body.inertial(world);
        reading.holding_hands = holding;
        reading.command_rejected = u64::from(is_rejected);
        if let Some(noise) = &self.noise {
            noise.add(tick, reading);
        }
        self.truth.joint_torque_peak_nm = self.torque_peak_nm;
        self.truth.saturated_joints = self.saturated_joints;
        let soles = self.body.body.soles;
        let stance = Stance {
            base: pose(&self.body.link_pose(world, 0)),
            soles: PerFoot::from_fn(|side| self.body.frame_pose::<Foot>(world, soles[side])),
            ground: PerFoot::from_fn(|side| touched.ground_sum[side as usize] * mean),
            com_m: self.body.com(world),
            is_on_the_floor: touched.is_on_the_floor,
        };
        self.standing.judge(&stance, &mut self.truth);
    }
}

impl World {
    /// One step of physics, with drives told to be at `share` of the way from the last commands to these.
    fn substep(&mut self, commands: &[JointCommand], share: f64) {
        let Self { world, robots, commands: last, holding, .. } = self;
        if let Some(object) = world.bodies.get_mut(self.object) {
            object.reset_forces(false);
            object.reset_torques(false);
        }
        let pushed = Vector3::from(force_n(&self.pushes, 0, self.tick));
        if let Some(object) = world.bodies.get_mut(self.object) {
            object.add_force(vector(&pushed), false);
        }
        for (index, (robot, (from, to))) in robots.iter_mut().zip(last.iter().zip(commands)).enumerate() {
            let Robot { body, hands, torque_peak_nm, saturated_joints, .. } = robot;
            body.set_drives(world, (from, to, share), |joint, demand_nm, is_saturated| {
                torque_peak_nm[joint] = torque_peak_nm[joint].max(demand_nm);
                *saturated_joints |= u64::from(is_saturated) << joint;
            });
            for (bit, hand) in hands.iter_mut().enumerate() {
                hand.pull(world, body, self.object, &self.spring, holding[index] & 1 << bit != 0);
            }
            body.push(world, Vector3::from(force_n(&self.pushes, index + 1, self.tick)));
            body.note_motions(world);
        }
        world.step_with_events(&self.exclusions, &());
        let step_s = world.integration_parameters.dt;
        for robot in robots.iter_mut() {
            robot.body.note_accelerations(world, step_s);
            for (sum, torque) in robot.torque_sum_nm.iter_mut().zip(robot.body.torques(world)) {
                *sum += torque;
            }
        }
        let feet: Vec<_> = robots.iter().map(Robot::foot_links).collect();
        let object =
            world.bodies.get(self.object).map_or_else(Vector3::zeros, |it| from_vector(it.translation()));
        contacts::sort(world, &feet, object, &mut self.touched, &mut self.touching);
    }

    /// Makes the object heavier or lighter where that is due.
    fn change_object(&mut self) {
        let due = self.bodies.iter().rfind(|(tick, _)| *tick == self.tick);
        if let (Some((_, body)), Some(object)) = (due, self.world.bodies.get_mut(self.object)) {
            object.set_additional_mass_properties(mass_of(body), false);
        }
    }

    fn close_and_open(&mut self, commands: &[JointCommand]) {
        let Self { world, robots, holding, object, .. } = self;
        mikoshi_physics::close_and_open(holding, commands, |robot, hand, grip| {
            let Robot { body, hands, .. } = &mut robots[robot];
            hands.get_mut(hand).is_some_and(|hand| hand.change(world, body, *object, grip))
        });
    }

    fn note_pushes(&mut self) {
        self.object_truth.push_force_n = force_n(&self.pushes, 0, self.tick);
        for (index, robot) in self.robots.iter_mut().enumerate() {
            robot.truth.push_force_n = force_n(&self.pushes, index + 1, self.tick);
        }
    }

    fn observe(&mut self) {
        let rejected = core::mem::take(&mut self.rejected);
        for (index, (robot, touched)) in self.robots.iter_mut().zip(&self.touched).enumerate() {
            let of_tick = (self.tick, self.depth, self.substeps);
            let of_robot = (self.holding[index], rejected & 1 << index != 0);
            robot.observe(&self.world, touched, of_tick, of_robot);
        }
        let truth = &mut self.object_truth;
        if let Some(object) = self.world.bodies.get(self.object) {
            let X_WO: Pose<mikoshi_spatial::World, Object> = pose(&from_isometry(object.position()));
            truth.pose = X_WO.to_array();
            let twist: Twist<mikoshi_spatial::World> = Twist::new(
                from_vector(object.velocity_at_point(object.translation())),
                from_vector(object.angvel()),
            );
            truth.twist = twist.to_array();
        }
        truth.support_wrench = (self.touching.support_sum * (1.0 / self.substeps as f64)).to_array();
        truth.unintended_contacts = self.touching.unintended;
        truth.unintended_pair = self.touching.pair;
        truth.robot_count = self.robots.len() as u64;
    }

    /// Lets the world come to rest before tick 0, as a real team stands before it is asked to do anything.
    fn settle(&mut self) -> Result<(), BuildWorldError> {
        let period_s = self.world.integration_parameters.dt * self.substeps as f64;
        let commands = self.commands.clone();
        for _ in 0..(SETTLING_S / period_s).ceil() as u64 {
            self.step(&commands).map_err(|error| rejects(error.text()))?;
        }
        self.tick = 0;
        self.observe();
        for robot in &mut self.robots {
            let first = robot.readings[0];
            robot.readings.fill(first);
        }
        Ok(())
    }
}
