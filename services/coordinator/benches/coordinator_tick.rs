//! What a tick of the coordinator costs, by number of two-armed robots: the mean of many ticks, and its share
//! for each robot, which does not grow if the cost is linear.
//!
//! Frames have room for 16 robots. The mathematics has no limit: beside the whole tick stands what grows with
//! the team in it, the hybrid law over a balanced tree and the step clock, up to a thousand robots.

#![allow(non_snake_case)]

use bytemuck::Zeroable;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_cooperation::{
    ForceGains, GeneralizedForce, GeneralizedPosition, HandInput, HybridInputs, HybridLaw, HybridParameters,
    HybridReference, HybridState, InternalForces, Selection, TeamArms, VirtualStick,
};
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs};
use mikoshi_humanoid::gait::{StepTiming, StepWish, TeamClock};
use mikoshi_ipc_types::{MAX_ROBOTS, RobotState, all_hands, flag, mode};
use mikoshi_spatial::{Hand, Object, Pose, Twist, World, Wrench, exp};
use nalgebra::{UnitQuaternion, Vector3};
use std::hint::black_box;
use std::path::Path;
use std::time::{Duration, Instant};

const TEAMS: [usize; 6] = [1, 4, 16, 64, 256, 1000];
const LARGEST: usize = 2 * 1000;
/// For each number, after as long without being timed.
const TIMED_FOR: Duration = Duration::from_millis(500);

fn main() {
    println!("robots   whole tick   per robot   law and clock   per robot");
    for robots in TEAMS {
        let whole = (robots <= MAX_ROBOTS).then(|| whole_tick_us(robots));
        let parts = law_and_clock_us(robots);
        let cell = |us: Option<f64>| us.map_or("−".to_owned(), |us| format!("{us:.2} µs"));
        let share = |us: f64| us / robots as f64;
        println!(
            "{robots:6} {:>12} {:>11} {:>15} {:>11}",
            cell(whole),
            cell(whole.map(share)),
            cell(Some(parts)),
            cell(Some(share(parts)))
        );
    }
}

/// Mean time of a call \[µs\].
#[allow(clippy::disallowed_methods, reason = "a benchmark measures time")]
fn mean_us(mut call: impl FnMut()) -> f64 {
    let mut timed = || {
        let (start, mut calls) = (Instant::now(), 0_u32);
        while start.elapsed() < TIMED_FOR {
            // Reading the clock is not to count.
            (0..16).for_each(|_| call());
            calls += 16;
        }
        1e6 * start.elapsed().as_secs_f64() / f64::from(calls)
    };
    timed();
    timed()
}

/// All that the coordinator does with `robots` robots that carry, from frames to frames.
fn whole_tick_us(robots: usize) -> f64 {
    let run = run_of(robots);
    let coordinator = Coordinator::new(&run).expect("a coordinator");
    let (mut state, mut scratch) = (coordinator.initial_state().expect("a state"), coordinator.scratch());
    let mut out = CoordinatorOutputs::default();
    let mut frames = frames(&run);
    let mut tick = 0;
    let us = mean_us(|| {
        let result = coordinator.tick(tick, &mut state, &mut scratch, black_box(&frames).iter(), &mut out);
        assert!(result.is_ok(), "{result:?}");
        // Hands are where they are asked to be, and apply what they are asked to but for a shiver, each its own: what is
        // filtered must not fade into numbers that processors are slow with.
        let sign = if tick.is_multiple_of(2) { 1.0 } else { -1.0 };
        let mut shiver = 1e-6 * sign;
        for (frame, command) in frames.iter_mut().zip(&out.commands) {
            frame.hand_pose = command.hand_pose_ref;
            frame.hand_pose_commanded = command.hand_pose_ref;
            frame.hand_wrench = command.hand_wrench_ref;
            for value in frame.hand_wrench.as_flattened_mut() {
                *value += shiver;
                shiver += 1e-8 * sign;
            }
        }
        tick += 1;
    });
    assert_eq!(out.team_state.team_mode, mode::CARRY);
    us
}

/// `transport` with so many robots, in pairs that face each other.
fn run_of(robots: usize) -> RunSpec {
    let length_m = 0.9 * robots.div_ceil(2) as f64;
    let member = |index: usize| {
        let (x, yaw) = if index.is_multiple_of(2) { (-0.65, 0.0) } else { (0.65, 180.0) };
        let y = 0.9 * (index / 2) as f64 + 0.45 - 0.5 * length_m;
        format!("{{ name = \"R{index}\", model = \"hrp2\", x_m = {x:?}, y_m = {y:?}, yaw_deg = {yaw:?} }}")
    };
    let members: Vec<_> = (0..robots).map(member).collect();
    let overrides = [
        ("robots", format!("[{}]", members.join(", "))),
        ("object.size_m", format!("[0.6, {:?}, 0.3]", length_m + 0.2)),
        ("hybrid.start_s", "0.05".to_owned()),
        ("motion.start_s", "0.1".to_owned()),
        ("duration_s", "3600.0".to_owned()),
    ];
    let overrides = overrides.map(|(key, value)| (key.to_owned(), value));
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/transport.toml");
    let loaded = load_scenario(&path, &overrides, None).expect("it loads");
    mikoshi_resolution::resolve(&loaded).expect("it resolves")
}

/// What the robots say at first: their hands are where the run begins, and each pulls a little.
fn frames(run: &RunSpec) -> Vec<RobotState> {
    let object = &run.scenario.object;
    let X_WA = Pose::<World, Object>::new(Vector3::from(object.position_m), UnitQuaternion::identity());
    let frame = |(index, robot): (usize, &mikoshi_config::RobotSpec)| {
        let mut frame = RobotState {
            speed_share: 1.0,
            flags: flag::CAN_STOP | flag::READY_TO_STEP,
            holding_hands: all_hands(robot.hand_in_object.len()),
            ..RobotState::zeroed()
        };
        for (hand, X_AH) in robot.hand_in_object.iter().enumerate() {
            let X_AH = Pose::<Object, Hand>::from_array(X_AH).expect("a pose");
            frame.hand_pose[hand] = (X_WA * X_AH).to_array();
            frame.hand_pose_commanded[hand] = frame.hand_pose[hand];
            let pull = index as f64 - 0.5 * hand as f64;
            frame.hand_wrench[hand] = [pull, -0.5 * pull, 3.7, 0.1 * pull, 0.2, -0.3];
        }
        frame
    };
    run.robots.iter().enumerate().map(frame).collect()
}

/// What grows with the team, with the robots' hands around the object.
fn law_and_clock_us(robots: usize) -> f64 {
    let team = TeamArms::numbered(&vec![2; robots]).expect("a team");
    let arms = 2 * robots;
    let X_WA: Pose<World, Object> =
        Pose::new(Vector3::new(1.0, 2.0, 0.96), exp(&Vector3::new(0.0, 0.02, 0.3)));
    let hand = |index: usize| {
        let angle = index as f64;
        let p_HA_W = Vector3::new(angle.cos(), angle.sin(), 0.1);
        let pose = Pose::new(X_WA.translation - p_HA_W, exp(&Vector3::new(0.1, 0.2, angle.sin())));
        let wrench = Wrench::new(p_HA_W * 5.0, Vector3::new(1.0, -2.0, angle.cos()));
        HandInput { pose, pose_commanded: pose, wrench }
    };
    let hands: Vec<_> = (0..arms).map(hand).collect();
    let sticks: Vec<_> = hands.iter().map(|hand| VirtualStick::at_grasp(&hand.pose, &X_WA)).collect();
    let parameters = HybridParameters {
        period_s: 0.005,
        kz: 0.05,
        kh: ForceGains { m_n: 1e-4, rad_nm: 2e-4 },
        selection: Selection::object_position_internal_force(arms),
        filter_hz: 10.0,
        lead_limit_m: 0.02,
        lead_limit_rad: 0.05,
        approach_limit_m_s: 0.01,
        approach_limit_rad_s: 0.02,
    };
    let law = HybridLaw::new(InternalForces::balanced_tree(&team), parameters).expect("a law");
    let mut state = Box::new(HybridState::<LARGEST>::at_grasp(&sticks).expect("there is room"));
    let (mut scratch, mut out) = (law.scratch(), law.output());
    let (force, position) = (GeneralizedForce::zero(arms), GeneralizedPosition::at_grasp(X_WA, arms));
    let object_twist = Twist::new(Vector3::new(0.1, 0.0, 0.0), Vector3::new(0.0, 0.0, 0.05));
    let reference = Some(HybridReference { force: &force, position: &position, object_twist });

    let timing = StepTiming::standard(0.005);
    let wishes =
        vec![StepWish { can_stop: false, wants_step: true, urgency: 2.0, ..StepWish::CONTENT }; robots];
    let mut clock = TeamClock::default();
    mean_us(|| {
        let inputs = HybridInputs { hands: black_box(&hands), grasp_yield: Twist::zero(), reference };
        let result = law.act(&mut state, &mut scratch, &inputs, &mut out);
        assert!(result.is_ok(), "{result:?}");
        clock = clock.advance(&timing, black_box(&wishes), true);
    })
}
