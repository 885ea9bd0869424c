//! The world of a run, tick by tick.

use crate::failures::GraspFailures;
use crate::grasp::{self, GraspSite};
use crate::grip::{self, Taken};
use crate::layout::{HandLayout, Layout};
use crate::object_body::ObjectBodies;
use crate::pose::{site_pose, site_twist};
use crate::pushes;
use crate::readings;
use crate::robot::Robot;
use crate::tally::{self, Contacts, Tally};
use crate::truth;
use crate::{ENGINE, logging, mjcf, rejects};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{JointCommand, MAX_HANDS, ObjectTruth, Push, RobotTruth, Sensors, all_hands};
use mikoshi_physics::{
    ActivePush, BuildWorldError, LoadWorldError, Noise, ObjectBody, Physics, PushScript, SETTLING_S,
    SensorCounts, Spring, StepWorldError, are_active, begin, check_commands, drive_reference, force_n,
    steps_in_a_tick,
};
use mikoshi_runtime::{read_parts, write_parts};
use mikoshi_spatial::{Hand, Wrench};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase, MjtState, MjtWarning};
use nalgebra::Vector3;
use xxhash_rust::xxh3::xxh3_64;

/// One simulated world: the robots of a run, their object, the floor, and the boxes that stand on it.
///
/// # What is of which time
/// After tick k's [`step`](Self::step) the world is at tick k + 1. Positions and velocities are of that
/// instant. Forces and accelerations belong to the way there: they are those of the last physics step,
/// unfiltered; where a frame says so, they are averaged over all physics steps of the tick.
pub struct World {
    data: MjData<Box<MjModel>>,
    layout: Layout,
    spring: Option<Spring>,
    failures: GraspFailures,
    push_script: PushScript,
    bodies: ObjectBodies,
    noise: Vec<Option<Noise>>,
    substeps: u64,
    /// Readings that are kept for each robot: the delay in ticks, plus one.
    depth: usize,
    /// Of the model and of the simulator.
    fingerprint: u64,
    state: State,
    scratch: Scratch,
}

/// What matters from tick to tick besides the simulator's own state.
struct State {
    tick: u64,
    /// The commands of the last tick: where interpolation starts.
    commands: Box<[JointCommand]>,
    /// The hands of each robot that hold the object: bit h for hand h.
    holding: Box<[u64]>,
    /// Where they have taken hold.
    taken: Box<[Taken]>,
    /// The readings of the last `depth` ticks of each robot, tick k at place k mod `depth`.
    readings: Box<[Sensors]>,
    robots: Box<[RobotTruth]>,
    object: ObjectTruth,
    pushes: Box<[ActivePush]>,
}

/// Workspace: nothing in it matters after a tick.
struct Scratch {
    tallies: Box<[Tally]>,
    contacts: Contacts,
    hand_wrenches: Box<[[Wrench<mikoshi_spatial::World>; MAX_HANDS]]>,
    /// Robots whose command of this tick could not be used.
    rejected: u64,
    simulator_state: Box<[f64]>,
}

/// What a world is made from.
struct Description<'a> {
    robots: Vec<Robot<'a>>,
    grasps: Vec<GraspSite>,
    spring: Option<Spring>,
    xml: String,
}

impl<'a> Description<'a> {
    fn of(run: &'a RunSpec) -> Result<Self, BuildWorldError> {
        let robots = run.robots.iter().map(Robot::resolve).collect::<Result<Vec<_>, _>>()?;
        let grasps = grasp::sites(&run.scenario, &robots);
        let spring = Spring::of(&run.scenario, grasps.len())?;
        let xml = mjcf::world(&run.scenario, &ObjectBody::of(&run.scenario.object), &robots, &grasps);
        Ok(Self { robots, grasps, spring, xml })
    }
}

/// A run's world in MuJoCo's language.
///
/// # Errors
/// A run that no world can be described for; whether the simulator takes it is another question.
pub fn world_xml(run: &RunSpec) -> Result<String, BuildWorldError> {
    Description::of(run).map(|description| description.xml)
}

/// All that the simulator integrates, warm start included: without it a replay differs in the last bits.
const INTEGRATION: u32 = MjtState::mjSTATE_INTEGRATION as u32;

impl Physics for World {
    const ENGINE: &'static str = ENGINE;

    /// The world at tick 0, with the hands on the object. It is put where the run says, and has come to
    /// rest there: soles have sunk in, drives have given way, grasps strain. That moves palms and object
    /// by millimetres.
    ///
    /// # Errors
    /// A run that no world can be built from; see [`BuildWorldError`].
    fn new(run: &RunSpec) -> Result<Self, BuildWorldError> {
        logging::install();
        let scenario = &run.scenario;
        let substeps = steps_in_a_tick(scenario)?;
        let Description { robots, grasps, spring, xml } = Description::of(run)?;
        let model = MjModel::from_xml_string(&xml).map_err(rejects)?;
        let bodies = ObjectBodies::new(run, |body| {
            let xml = mjcf::world(scenario, body, &robots, &grasps);
            MjModel::from_xml_string(&xml).map_err(rejects)
        })?;
        let layout = Layout::of(&model, &scenario.world.boxes, &robots, &grasps)?;
        let noise = layout.robots.iter().enumerate().map(|(index, robot)| {
            let counts =
                SensorCounts { joints: robot.joints.len(), hands: robot.hands.len(), feet: robot.feet.len() };
            Noise::of(&scenario.sensors, scenario.seed, index, counts, scenario.control_period_s)
        });
        let noise = noise.collect();
        let state_size = model.state_size(INTEGRATION);
        let mut data = MjData::try_new(Box::new(model)).map_err(rejects)?;

        let closed_hands = |robot: usize, hands: usize| match robots.get(robot) {
            Some(robot) if scenario.begins_closed(robot.name()) => all_hands(hands),
            _ => 0,
        };
        let mut commands = vec![bytemuck::Zeroable::zeroed(); robots.len()].into_boxed_slice();
        let postures = run.robots.iter().map(|robot| &robot.initial_posture_rad);
        let described = layout.robots.iter().zip(postures).zip(&mut commands).enumerate();
        for (robot, ((layout, posture), command)) in described {
            let command: &mut JointCommand = command;
            command.closed_hands = closed_hands(robot, layout.hands.len());
            for (index, (joint, angle_rad)) in layout.joints.iter().zip(posture).enumerate() {
                data.qpos_mut()[joint.qpos] = *angle_rad;
                data.ctrl_mut()[joint.actuator] = *angle_rad;
                command.joint_position_ref_rad[index] = *angle_rad;
            }
        }
        let depth = scenario.sensors.delay_ticks as usize + 1;
        let state = State {
            tick: 0,
            holding: commands.iter().map(|command| command.closed_hands).collect(),
            commands,
            taken: vec![bytemuck::Zeroable::zeroed(); robots.len()].into(),
            readings: vec![bytemuck::Zeroable::zeroed(); robots.len() * depth].into(),
            robots: vec![bytemuck::Zeroable::zeroed(); robots.len()].into(),
            object: bytemuck::Zeroable::zeroed(),
            pushes: vec![ActivePush::default(); robots.len() + 1].into(),
        };
        let scratch = Scratch {
            tallies: vec![Tally::empty(); robots.len()].into(),
            contacts: Contacts::default(),
            hand_wrenches: vec![[Wrench::zero(); MAX_HANDS]; robots.len()].into(),
            rejected: 0,
            simulator_state: vec![0.0; state_size].into(),
        };
        let fingerprint = xxh3_64(format!("{} {xml}", mujoco_rs::mujoco_version()).as_bytes());
        let failures = GraspFailures::default();
        let push_script = PushScript::default();
        let mut world = Self {
            data,
            layout,
            spring,
            failures,
            push_script,
            bodies: ObjectBodies::default(),
            noise,
            substeps,
            depth,
            fingerprint,
            state,
            scratch,
        };
        world.settle(scenario.physics.step_s)?;
        world.failures = GraspFailures::of(run);
        world.push_script = PushScript::of(run);
        world.bodies = bodies;
        // Readings from before tick 0 are those of tick 0.
        for ring in world.state.readings.chunks_exact_mut(depth) {
            let first = ring[0];
            ring.fill(first);
        }
        Ok(world)
    }

    fn robot_count(&self) -> usize {
        self.state.robots.len()
    }

    fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    fn joint_limits(&self) -> impl Iterator<Item = Vec<[f64; 2]>> {
        let robots = self.layout.robots.iter();
        robots.map(|robot| robot.joints.iter().map(|joint| joint.limits).collect())
    }

    fn commands(&self) -> &[JointCommand] {
        &self.state.commands
    }

    fn push(&mut self, push: &Push) {
        begin(&mut self.state.pushes, push, self.state.tick);
    }

    fn note_rejected(&mut self, robots: u64) {
        self.scratch.rejected = robots;
    }

    fn tick(&self) -> u64 {
        self.state.tick
    }

    fn sense(&self, robot: usize, sensors: &mut Sensors) {
        // Tick k lies at k mod depth; the oldest, `delay` = depth − 1 ticks ago, follows it.
        let oldest = (self.state.tick as usize + 1) % self.depth;
        *sensors = self.state.readings[robot * self.depth + oldest];
    }

    fn robot_truth(&self, robot: usize, truth: &mut RobotTruth) {
        *truth = self.state.robots[robot];
    }

    fn object_truth(&self, truth: &mut ObjectTruth) {
        *truth = self.state.object;
    }

    fn step(&mut self, commands: &[JointCommand]) -> Result<(), StepWorldError> {
        check_commands(commands, self.robot_count())?;
        let State { tick, holding, taken, pushes, .. } = &mut self.state;
        if self.bodies.turn_to(*tick, &mut self.data) {
            grip::restore(&mut self.data, &self.layout, taken);
            self.data.step1();
        }
        self.push_script.begin(pushes, *tick);
        let is_pushed = are_active(pushes, *tick);
        let failures = &self.failures;
        let has_failed = |robot, hand| failures.of_hand(*tick, robot, hand).is_some();
        grip::close_and_open(&mut self.data, &self.layout, commands, (holding, taken), has_failed);
        self.failures.undo(*tick, &mut self.data, &self.layout, holding);
        self.scratch.tallies.fill(Tally::empty());
        self.scratch.contacts = Contacts::default();
        for substep in 1..=self.substeps {
            self.set_drives(commands, substep as f64 / self.substeps as f64);
            self.pull(is_pushed);
            for (tally, layout) in self.scratch.tallies.iter_mut().zip(&self.layout.robots) {
                tally.count_demands(&self.data, layout);
            }
            self.data.step2();
            // Between the halves of a step its forces and contacts stand.
            for (tally, layout) in self.scratch.tallies.iter_mut().zip(&self.layout.robots) {
                tally.count_torques(&self.data, layout);
            }
            let Scratch { tallies, contacts, .. } = &mut self.scratch;
            tally::count_contacts(&self.data, &self.layout, tallies, contacts);
            if substep == self.substeps {
                self.read_hand_wrenches();
            }
            self.data.step1();
            self.check()?;
        }
        if is_pushed {
            pushes::clear(&mut self.data, &self.layout);
        }
        self.note_pushes();
        self.state.commands.copy_from_slice(commands);
        self.state.tick += 1;
        self.observe();
        Ok(())
    }

    fn checkpoint_size(&self) -> usize {
        let State { tick, commands, holding, taken, readings, robots, object, pushes } = &self.state;
        size_of_val(&*self.scratch.simulator_state)
            + size_of_val(tick)
            + size_of_val(&**commands)
            + size_of_val(&**holding)
            + size_of_val(&**taken)
            + size_of_val(&**readings)
            + size_of_val(&**robots)
            + size_of_val(object)
            + size_of_val(&**pushes)
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<(), LoadWorldError> {
        self.check_size(checkpoint)?;
        self.data.read_state_into(INTEGRATION, &mut self.scratch.simulator_state);
        write_parts(self.state.parts(&mut self.scratch.simulator_state), checkpoint)
            .map(drop)
            .map_err(|_| LoadWorldError { found: checkpoint.len(), expected: self.checkpoint_size() })
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), LoadWorldError> {
        self.check_size(checkpoint)?;
        let rejected = LoadWorldError { found: checkpoint.len(), expected: self.checkpoint_size() };
        if read_parts(self.state.parts(&mut self.scratch.simulator_state), checkpoint).is_err()
            || self.data.set_state(&self.scratch.simulator_state, INTEGRATION).is_err()
        {
            return Err(rejected);
        }
        self.bodies.turn_to(self.state.tick, &mut self.data);
        grip::restore(&mut self.data, &self.layout, &self.state.taken);
        self.data.step1();
        Ok(())
    }
}

impl World {
    /// The name of a geom: `ROBOT/LINK#INDEX`, `world/BOX`, `object` or `floor`.
    pub fn geom_name(&self, geom: usize) -> Option<&str> {
        let model = self.data.model();
        (geom < model.ngeom() as usize).then(|| model.id_to_name(MjtObjBase::mjOBJ_GEOM, geom))?
    }

    fn check_size(&self, checkpoint: &[u8]) -> Result<(), LoadWorldError> {
        let (found, expected) = (checkpoint.len(), self.checkpoint_size());
        if found == expected { Ok(()) } else { Err(LoadWorldError { found, expected }) }
    }

    /// Lets the world come to rest before tick 0.
    fn settle(&mut self, step_s: f64) -> Result<(), BuildWorldError> {
        self.data.step1();
        let ticks = (SETTLING_S / (step_s * self.substeps as f64)).ceil() as u64;
        let commands = self.state.commands.clone();
        for _ in 0..ticks {
            self.step(&commands).map_err(rejects)?;
        }
        self.state.tick = 0;
        self.data.set_time(0.0);
        self.observe();
        Ok(())
    }

    /// The drives' references at `share` of the way from the last commands to these.
    fn set_drives(&mut self, commands: &[JointCommand], share: f64) {
        let ctrl = self.data.ctrl_mut();
        for ((layout, from), to) in self.layout.robots.iter().zip(&self.state.commands).zip(commands) {
            for (index, joint) in layout.joints.iter().enumerate() {
                ctrl[joint.actuator] = drive_reference((from, to), index, share, (joint.kp, joint.kv));
            }
        }
    }

    /// Says in the truth what has pushed whom.
    fn note_pushes(&mut self) {
        let State { tick, robots, object, pushes, .. } = &mut self.state;
        object.push_force_n = force_n(pushes, 0, *tick);
        for (robot, truth) in robots.iter_mut().enumerate() {
            truth.push_force_n = force_n(pushes, robot + 1, *tick);
        }
    }

    /// Sets, for the step to come, the forces of grasps that are no welds, springs and what slips, and those from
    /// outside.
    fn pull(&mut self, is_pushed: bool) {
        let tick = self.state.tick;
        if self.spring.is_none() && !self.failures.have_begun(tick) && !is_pushed {
            return;
        }
        let object = self.layout.object.body;
        self.data.xfrc_applied_mut()[object] = [0.0; 6];
        let robots = self.layout.robots.iter().zip(&self.state.holding);
        let robots = robots.zip(&mut self.scratch.hand_wrenches).enumerate();
        for (robot, ((layout, holding), wrenches)) in robots {
            for (index, (hand, wrench)) in layout.hands.iter().zip(wrenches).enumerate() {
                *wrench = match (self.failures.of_hand(tick, robot, index), self.spring) {
                    _ if holding & 1 << index == 0 => Wrench::zero(),
                    (Some(lost), _) => lost.wrench_on_object(&self.data, hand),
                    (None, Some(spring)) => pull_of(&spring, &self.data, hand),
                    (None, None) => Wrench::zero(),
                };
                let palm = Vector3::from(self.data.site_xpos()[hand.palm_site]);
                // The simulator wants forces at centres of mass.
                let at_com = |body: usize, wrench: &Wrench<mikoshi_spatial::World>| {
                    wrench.shifted(&(palm - Vector3::from(self.data.xipos()[body]))).to_array()
                };
                let (on_object, on_hand) = (at_com(object, wrench), at_com(hand.palm_body, &-*wrench));
                let applied = self.data.xfrc_applied_mut();
                for (sum, component) in applied[object].iter_mut().zip(on_object) {
                    *sum += component;
                }
                applied[hand.palm_body] = on_hand;
            }
        }
        if is_pushed {
            pushes::apply(&mut self.data, &self.layout, &self.state.pushes, tick);
        }
    }

    /// Takes the welds' wrenches while the last step's constraint forces stand; all others are known.
    fn read_hand_wrenches(&mut self) {
        if self.spring.is_some() {
            return;
        }
        let (tick, robots) = (self.state.tick, self.layout.robots.iter());
        for (robot, (layout, wrenches)) in robots.zip(&mut self.scratch.hand_wrenches).enumerate() {
            for (index, (hand, wrench)) in layout.hands.iter().zip(wrenches).enumerate() {
                if self.failures.of_hand(tick, robot, index).is_some() {
                    continue;
                }
                // SAFETY: called between the halves of a step, or after a forward pass.
                *wrench = unsafe { truth::weld_wrench(&self.data, &self.layout.object, hand) };
            }
        }
    }

    /// Writes truth and readings of this tick.
    fn observe(&mut self) {
        let tick = self.state.tick;
        let place = tick as usize % self.depth;
        let rings = self.state.readings.chunks_exact_mut(self.depth);
        let robots = self.layout.robots.iter().zip(&self.scratch.tallies).zip(&self.scratch.hand_wrenches);
        let holding = self.state.holding.iter();
        let mut rejected = core::mem::take(&mut self.scratch.rejected);
        for (((((layout, tally), wrenches), ring), holding), (truth, noise)) in
            robots.zip(rings).zip(holding).zip(self.state.robots.iter_mut().zip(&self.noise))
        {
            let reading = &mut ring[place];
            readings::read(&self.data, layout, tally, reading);
            reading.holding_hands = *holding;
            reading.command_rejected = rejected & 1;
            rejected >>= 1;
            if let Some(noise) = noise {
                noise.add(tick, reading);
            }
            truth::of_robot(&self.data, layout, tally, wrenches, truth);
        }
        truth::of_object(&self.data, &self.layout, &self.scratch.contacts, &mut self.state.object);
    }

    fn check(&self) -> Result<(), StepWorldError> {
        let has_warned = |warning: MjtWarning| self.data.warning()[warning as usize].number > 0;
        let not_physics = [
            MjtWarning::mjWARN_BADQPOS,
            MjtWarning::mjWARN_BADQVEL,
            MjtWarning::mjWARN_BADQACC,
            MjtWarning::mjWARN_BADCTRL,
        ];
        if not_physics.into_iter().any(has_warned) {
            return Err(StepWorldError::Diverged);
        }
        if [MjtWarning::mjWARN_CONTACTFULL, MjtWarning::mjWARN_CNSTRFULL].into_iter().any(has_warned) {
            return Err(StepWorldError::OutOfMemory);
        }
        Ok(())
    }
}

impl State {
    /// All parts of a checkpoint as bytes, the simulator's first.
    fn parts<'a>(&'a mut self, simulator: &'a mut [f64]) -> [&'a mut [u8]; 9] {
        [
            bytemuck::cast_slice_mut(simulator),
            bytemuck::bytes_of_mut(&mut self.tick),
            bytemuck::cast_slice_mut(&mut self.commands),
            bytemuck::cast_slice_mut(&mut self.holding),
            bytemuck::cast_slice_mut(&mut self.taken),
            bytemuck::cast_slice_mut(&mut self.readings),
            bytemuck::cast_slice_mut(&mut self.robots),
            bytemuck::bytes_of_mut(&mut self.object),
            bytemuck::cast_slice_mut(&mut self.pushes),
        ]
    }
}

/// What the spring at a hand does to the object, at the palm's origin.
fn pull_of(
    spring: &Spring,
    data: &MjData<Box<MjModel>>,
    hand: &HandLayout,
) -> Wrench<mikoshi_spatial::World> {
    let at = |site| (site_pose::<Hand>(data, site), site_twist(data, site));
    let ((palm, palm_twist), (place, place_twist)) = (at(hand.palm_site), at(hand.object_site));
    spring.wrench_on_object((&palm, palm_twist), (&place, place_twist))
}
