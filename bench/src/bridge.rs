//! What the bridge adds to physics: a tick of ours beside the steps of MuJoCo that it consists of, on the same way.

use crate::recording::{Recording, WALKING};
use crate::rounds::{Comparison, Spread, time_us};
use bytemuck::Zeroable;
use mikoshi_ipc_types::{JointCommand, ObjectTruth, RobotTruth, Sensors};
use mikoshi_physics::Physics as _;
use mikoshi_robot::Robot;
use mikoshi_sim_bridge::{World, world_xml};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase, MjtState};

const INTEGRATION: u32 = MjtState::mjSTATE_INTEGRATION as u32;
/// Ticks that each side takes before the other does.
const BATCH: usize = 5;

/// A joint's drive, as the simulator has it.
struct Drive {
    actuator: usize,
    robot: usize,
    joint: usize,
    kv_over_kp: f64,
}

/// Physics alone.
struct Bare {
    data: MjData<Box<MjModel>>,
    drives: Vec<Drive>,
    substeps: usize,
}

/// Both sides go through the whole recording; the walk is timed.
pub fn measure(recording: &Recording) -> Comparison {
    let mut world = World::new(&recording.run).expect("it was run");
    let mut bare = Bare::of(recording, &mut world);
    let commands: Vec<Vec<JointCommand>> = recording
        .ticks
        .iter()
        .map(|tick| tick.joint_command.iter().map(|frame| frame.payload).collect())
        .collect();
    let mut last = world.commands().to_vec();
    let (mut us, mut them) = (vec![], vec![]);
    for (index, batch) in commands[..WALKING.end as usize].chunks_exact(BATCH).enumerate() {
        let mut ours = || time_us(|| batch.iter().for_each(|commands| tick(&mut world, commands)));
        // What they hold to is made before, as physics alone would be given it.
        let controls = bare.controls(&last, batch);
        let mut theirs = || time_us(|| controls.iter().for_each(|control| bare.step(control)));
        let (ours, theirs) = if index % 2 == 0 {
            (ours(), theirs())
        } else {
            let theirs = theirs();
            (ours(), theirs)
        };
        last.clone_from(&batch[BATCH - 1]);
        if WALKING.contains(&((index * BATCH) as u64)) {
            us.push(ours / BATCH as f64);
            them.push(theirs / BATCH as f64);
        }
    }
    bare.check(&mut world);
    let ratio = us.iter().zip(&them).map(|(us, them)| us / them).collect();
    Comparison { ours_us: Spread::of(us), theirs_us: Spread::of(them), ratio: Spread::of(ratio) }
}

/// All that the bridge does in a tick, but for the transport.
fn tick(world: &mut World, commands: &[JointCommand]) {
    world.step(commands).expect("it was run");
    let (mut sensors, mut truth, mut object) =
        (Sensors::zeroed(), RobotTruth::zeroed(), ObjectTruth::zeroed());
    for robot in 0..world.robot_count() {
        world.sense(robot, &mut sensors);
        world.robot_truth(robot, &mut truth);
        std::hint::black_box((&sensors, &truth));
    }
    world.object_truth(&mut object);
    std::hint::black_box(&object);
}

impl Bare {
    /// Where the world is.
    fn of(recording: &Recording, world: &mut World) -> Self {
        let run = &recording.run;
        let xml = world_xml(run).expect("it was run");
        let model = MjModel::from_xml_string(&xml).expect("it was run");
        let mut drives = vec![];
        for (robot, spec) in run.robots.iter().enumerate() {
            let body = Robot::new(&spec.config, &spec.urdf).expect("it was run");
            for (joint, described) in body.model.joints().iter().enumerate() {
                let name = format!("{}/{}", spec.member.name, described.name);
                let actuator = model.name_to_id(MjtObjBase::mjOBJ_ACTUATOR, &name).expect("it has a drive");
                let (kp, kv) =
                    (model.actuator_gainprm()[actuator][0], -model.actuator_biasprm()[actuator][2]);
                drives.push(Drive { actuator, robot, joint, kv_over_kp: kv / kp });
            }
        }
        let substeps = run.scenario.substeps() as usize;
        let mut bare = Self { data: MjData::new(Box::new(model)), drives, substeps };
        let state = bare.state_of(world);
        bare.data.set_state(&state, INTEGRATION).expect("it is of this model");
        bare
    }

    /// The simulator's part of a world's checkpoint, which comes first.
    fn state_of(&self, world: &mut World) -> Vec<f64> {
        let mut checkpoint = vec![0; world.checkpoint_size()];
        world.save(&mut checkpoint).expect("there is room");
        let size = self.data.model().state_size(INTEGRATION);
        let numbers = checkpoint[..size * size_of::<f64>()].chunks_exact(size_of::<f64>());
        numbers.map(|bytes| f64::from_ne_bytes(bytes.try_into().expect("eight bytes"))).collect()
    }

    /// What drives hold to in each physics step: on a line from each tick's references to the next one's, and what
    /// makes up for their damping.
    fn controls(&self, last: &[JointCommand], batch: &[Vec<JointCommand>]) -> Vec<Vec<f64>> {
        let starts = core::iter::once(last).chain(batch.iter().map(Vec::as_slice));
        let ticks = starts.zip(batch);
        let steps = ticks.flat_map(|(from, to)| (1..=self.substeps).map(move |step| (from, to, step)));
        let control = |(from, to, step): (&[JointCommand], &Vec<JointCommand>, usize)| {
            let share = step as f64 / self.substeps as f64;
            let mut control = vec![0.0; self.drives.len()];
            for drive in &self.drives {
                let (from, to) = (&from[drive.robot], &to[drive.robot]);
                let start = from.joint_position_ref_rad[drive.joint];
                let end = to.joint_position_ref_rad[drive.joint];
                let feed_forward = drive.kv_over_kp * to.joint_velocity_ref_rad_s[drive.joint];
                control[drive.actuator] = start + share * (end - start) + feed_forward;
            }
            control
        };
        steps.map(control).collect()
    }

    fn step(&mut self, control: &[f64]) {
        self.data.ctrl_mut().copy_from_slice(control);
        self.data.step();
    }

    /// Ends the benchmark unless it has come where the world has.
    fn check(&self, world: &mut World) {
        let expected = self.state_of(world);
        let mut state = vec![0.0; expected.len()];
        self.data.read_state_into(INTEGRATION, &mut state);
        let worst = state.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!("physics alone ends where the bridge does, within {worst:.1e}");
        assert!(worst < 1e-6, "physics alone went another way: {worst:e}");
    }
}
