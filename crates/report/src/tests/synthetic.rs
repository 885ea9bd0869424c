//! A run of two robots that no simulator made: object, forces and feet move as formulas say.

use crate::run_data::RunData;
use crate::write::{JudgedLimit, ReportedRun};
use core::f64::consts::PI;
use mikoshi_config::{RunSpec, load_scenario};
use mikoshi_ipc_types::mode;
use mikoshi_observation::{Figures, Observation, ObservedRobot, ObservedRun, Summary};
use mikoshi_spatial::{Object, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};
use std::path::Path;

const PERIOD_S: f64 = 0.005;
const MASS_KG: f64 = 54.0;
/// Of the hybrid law.
pub const START_S: f64 = 1.0;
pub const DURATION_S: f64 = 10.0;
const STEP_S: f64 = 0.8;
const SWING_S: f64 = 0.6;

/// What a run is to look like.
#[derive(Clone, Copy)]
pub struct Kind {
    pub walks: bool,
    /// Whether hybrid control starts.
    pub is_controlled: bool,
    /// Scales forces and errors.
    pub strength: f64,
    /// Ticks that are there to be read.
    pub ticks: u64,
}

pub const WALK: Kind =
    Kind { walks: true, is_controlled: true, strength: 1.0, ticks: (DURATION_S / PERIOD_S) as u64 };
pub const STAND: Kind = Kind { walks: false, ..WALK };

/// A run of this kind and what it comes to.
pub fn run(label: &str, kind: Kind) -> ReportedRun {
    let spec = spec(kind);
    let observed = observed(&spec);
    let (mut figures, mut data) = (Figures::new(observed.clone()), RunData::new(&spec, &observed));
    for tick in 0..kind.ticks {
        let observation = observation(tick, kind);
        figures.observe(&observation);
        data.observe(&observation);
    }
    let judged = figures.finish();
    let summary = Summary {
        scenario: spec.scenario.name,
        ticks: kind.ticks,
        control_period_s: PERIOD_S,
        passed: true,
        object: judged.object,
        internal: judged.internal,
        robots: judged.robots,
        drift_between_robots_m: judged.drift_between_robots_m,
        minutes: judged.minutes,
        load: judged.load,
        ..Summary::default()
    };
    let limit = |what: &str, measured: &str, is_met| JudgedLimit {
        what: what.to_owned(),
        measured: measured.to_owned(),
        limit: "at most 5 N".to_owned(),
        is_met,
    };
    let limits = vec![limit("largest force", "4.321 N", true), limit("last force", "5.432 N", false)];
    ReportedRun { label: label.to_owned(), summary, data, limits, damage: None }
}

fn spec(kind: Kind) -> RunSpec {
    let scenario = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../config/scenarios/hold.toml");
    let start = if kind.is_controlled { START_S.to_string() } else { String::new() };
    let overrides = [
        ("team".to_owned(), "two".to_owned()),
        ("duration_s".to_owned(), DURATION_S.to_string()),
        ("hybrid.start_s".to_owned(), start),
    ];
    let loaded = load_scenario(&scenario, &overrides, None).expect("it is one of the project's");
    mikoshi_resolution::resolve(&loaded).expect("it is in reach")
}

fn observed(spec: &RunSpec) -> ObservedRun {
    let robot = |robot: &mikoshi_config::RobotSpec| ObservedRobot {
        name: robot.member.name.clone(),
        mass_kg: MASS_KG,
        hands: 2,
        joints: vec![],
    };
    let row = |name: &str, coefficients: [f64; 4]| (name.to_owned(), coefficients.to_vec());
    ObservedRun {
        control_period_s: PERIOD_S,
        ticks: spec.ticks,
        is_controlled: spec.scenario.is_controlled(),
        X_WBody_goal: None,
        robots: spec.robots.iter().map(robot).collect(),
        internal_rows: vec![
            row("A|B", [0.5, 0.5, -0.5, -0.5]),
            row("A.right|A.left", [0.5, -0.5, 0.0, 0.0]),
            row("B.right|B.left", [0.0, 0.0, 0.5, -0.5]),
        ],
    }
}

fn observation(tick: u64, kind: Kind) -> Observation {
    let t = tick as f64 * PERIOD_S;
    let mut observation = Observation::for_team(2);
    let motion = if kind.walks { 0.1 * (t - START_S).max(0.0) } else { 0.0 };
    let reference = pose([motion, 0.2 * motion, 0.9], 0.3 * motion);
    let error = 1e-3 * kind.strength * (7.0 * t).sin();
    let actual = pose([motion + error, 0.2 * motion - 0.5 * error, 0.9 + 0.2 * error], 0.3 * motion + error);
    observation.object_truth.envelope.tick = tick;
    observation.object_truth.payload.pose = actual.to_array();
    let team_state = &mut observation.team_state.payload;
    team_state.team_mode = if t < START_S || !kind.is_controlled { mode::HOLD } else { mode::CARRY };
    team_state.object_pose_ref = reference.to_array();

    let decay = (-(t - START_S).max(0.0)).exp() + 0.2 * (9.0 * t).sin().powi(9);
    for (robot, truth) in observation.robot_truth.iter_mut().enumerate() {
        let (truth, side) = (&mut truth.payload, if robot == 0 { -1.0 } else { 1.0 });
        for hand in 0..2 {
            let aside = if hand == 0 { -0.2 } else { 0.2 };
            truth.hand_pose[hand] =
                pose([side * 0.3 + actual.translation.x, aside + actual.translation.y, 0.9], 0.0).to_array();
            let force_n = kind.strength * decay * (20.0 + 5.0 * hand as f64);
            truth.hand_wrench[hand] = [-side * force_n, 3.0 * decay, 1.0, 0.5 * decay, 0.0, side * decay];
        }
        for foot in 0..2 {
            let (x, z) = sole(t - START_S, foot, kind);
            let y = if foot == 0 { -0.095 } else { 0.095 };
            let yaw = if robot == 0 { 0.0 } else { PI };
            truth.sole_pose[foot] = pose([side * 0.65 + x, -side * y, z], yaw).to_array();
            truth.ground_wrench[foot][2] = if z > 0.0 { 0.0 } else { 0.5 * MASS_KG * 9.81 };
        }
        truth.zmp_position_m = [side * 0.65 + motion, 0.03 * (4.0 * t).sin()];
        truth.zmp_margin_m = 0.05 - 0.01 * (4.0 * t).sin();
        truth.com_position_m = [side * 0.65 + motion, 0.05 * (4.0 * t).sin(), 0.79];
    }
    observation
}

fn pose(translation: [f64; 3], yaw: f64) -> Pose<World, Object> {
    Pose::new(Vector3::from(translation), UnitQuaternion::from_euler_angles(0.0, 0.0, yaw))
}

/// Way and height of a sole: the feet take turns.
fn sole(t: f64, foot: usize, kind: Kind) -> (f64, f64) {
    if !kind.walks || t < 0.0 {
        return (0.0, 0.0);
    }
    let (step, since) = ((t / STEP_S).floor(), t.rem_euclid(STEP_S));
    let swings = step as usize % 2 == foot && since < SWING_S;
    let done = if swings { step } else { step + f64::from(step as usize % 2 == foot) };
    (0.08 * (done * 0.5).floor(), if swings { 0.05 } else { 0.0 })
}
