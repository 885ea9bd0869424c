//! One robot: how it stands and holds at tick 0.

use crate::surface::distance_to_box;
use core::fmt::Display;
use mikoshi_config::robot::HandConfig;
use mikoshi_config::scenario::{Member, Object as ObjectConfig, Scenario};
use mikoshi_config::{LoadConfigError, LoadedRobot, LoadedScenario, RobotConfig, RobotSpec};
use mikoshi_humanoid::Kinematics;
use mikoshi_humanoid::balance::{GRAVITY_M_S2, PerFoot, Side};
use mikoshi_humanoid::ik::{IkScratch, IkTargets, SettlePostureError};
use mikoshi_humanoid::statics::Burden;
use mikoshi_ipc_types::MAX_HANDS;
use mikoshi_robot::Robot;
use mikoshi_spatial::{Base, CoordinateFrame, Foot, Hand, Object, Pose, World};
use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};
use std::collections::BTreeMap;

/// How far a palm may be from the surface that it holds.
const PALM_TO_SURFACE_M: f64 = 0.020;

/// Part of a robot's weight from which on what it bears decides how it stands.
const HEAVY_SHARE: f64 = 0.05;
/// What another stance must spare at least, as a share of a joint's limit.
const WORTH_IT: f64 = 0.01;
/// How far a robot may stand nearer to its hands than configured, and with its centre of mass higher: parts of that
/// centre's height.
const NEARER: f64 = 0.09;
const HIGHER: f64 = 0.038;
/// In so many steps.
const STANCE_STEPS: usize = 4;

/// A robot's own frame on the ground: midpoint between its soles, x ahead, z up.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Ground {}
impl CoordinateFrame for Ground {}

/// Every model of the team, read once.
pub(crate) struct Models<'a>(BTreeMap<&'a str, UsableModel<'a>>);

/// A model whose configuration fits its URDF, with all its hands.
struct UsableModel<'a> {
    loaded: &'a LoadedRobot,
    robot: Robot,
}

impl<'a> Models<'a> {
    pub(crate) fn load(scenario: &'a LoadedScenario) -> Result<Self, LoadConfigError> {
        let usable = |(name, loaded): (&'a String, &'a LoadedRobot)| {
            let robot = Robot::new(&loaded.config, &loaded.urdf)
                .map_err(|error| loaded.error_at(&error.key, error.problem))?;
            Ok((name.as_str(), UsableModel { loaded, robot }))
        };
        scenario.models.iter().map(usable).collect::<Result<_, _>>().map(Self)
    }
}

/// Where this robot's grasping hands are, and a posture at rest that has them there.
pub(crate) fn resolve_robot(
    scenario: &LoadedScenario,
    models: &Models<'_>,
    index: usize,
    member: &Member,
) -> Result<RobotSpec, LoadConfigError> {
    let Some(usable) = models.0.get(member.model.as_str()) else {
        let problem = format!("found {:?}, expected a model that is loaded", member.model);
        return Err(scenario.error_at(&format!("robots.{index}.model"), problem));
    };
    let config = &usable.loaded.config;
    let grasping_hands = grasping_hands(scenario, index, member, &config.hands)?;

    let X_WG = ground_pose(member);
    let X_WA = object_pose(&scenario.scenario.object);
    let mut hand_in_object = vec![];
    let mut hands = [None; MAX_HANDS];
    for (target, &hand) in hands.iter_mut().zip(&grasping_hands) {
        let X_WH = X_WG * carry_pose(&config.hands[hand]);
        let X_AH = X_WA.inverse() * X_WH;
        let distance_m = distance_to_box(&X_AH.translation, &scenario.scenario.object.size_m);
        if distance_m.abs() > PALM_TO_SURFACE_M {
            let (hand, robot) = (&config.hands[hand].name, &member.name);
            let side = if distance_m < 0.0 { "inside" } else { "off" };
            let problem = format!(
                "unreachable grasp: the {hand} palm of robot {robot} is {:.0} mm {side} the object's surface, \
                 expected at most {:.0} mm",
                distance_m.abs() * 1e3,
                PALM_TO_SURFACE_M * 1e3
            );
            return Err(scenario.error_at(&format!("robots.{index}"), problem));
        }
        *target = Some(X_WH);
        hand_in_object.push(X_AH.to_array());
    }

    let force_n = expected_force_n(&scenario.scenario, index);
    let settle = |targets: &IkTargets| settle(scenario, usable, index, member, &grasping_hands, targets);
    let (mut targets, mut settled) = stance(usable, &X_WG, hands, force_n, settle)?;
    if let Some(job) = &scenario.scenario.job {
        for hand in targets.hands.iter_mut().flatten() {
            *hand = *hand * drawn_back(job.draw_back_m);
        }
        settled = settle(&targets)?;
    }
    let mut X_WB = base_pose(&usable.robot, &settled, &targets);
    if let Some(entry) =
        scenario.scenario.membership_of(&member.name).next().filter(|entry| entry.begins_away())
    {
        X_WB.translation -= X_WG.rotation * Vector3::new(entry.distance_m, 0.0, 0.0);
    }
    Ok(RobotSpec {
        member: member.clone(),
        config: config.clone(),
        urdf: usable.loaded.urdf.clone(),
        initial_base_pose: X_WB.to_array(),
        initial_posture_rad: settled,
        grasping_hands,
        hand_in_object,
    })
}

/// Of its share of the object's weight, as the scenario has both.
fn expected_force_n(scenario: &Scenario, robot: usize) -> f64 {
    let shares = &scenario.load.shares;
    let sum: f64 = shares.iter().sum();
    let share = shares.get(robot).map_or(1.0 / scenario.robots.len() as f64, |share| share / sum);
    scenario.object.mass_kg * GRAVITY_M_S2 * share
}

/// Where a robot stands that will bear so much, and the posture in which it does: as its configuration has it; with a heavy
/// load nearer to its hands and with straighter legs, as far as that spares the joint that needs most of its limit.
fn stance(
    usable: &UsableModel<'_>,
    X_WG: &Pose<World, Ground>,
    hands: [Option<Pose<World, Hand>>; MAX_HANDS],
    force_n: f64,
    settle: impl Fn(&IkTargets) -> Result<Vec<f64>, LoadConfigError>,
) -> Result<(IkTargets, Vec<f64>), LoadConfigError> {
    let (robot, config) = (&usable.robot, &usable.loaded.config);
    let targets = standing(X_WG, config, hands);
    let mut best = (targets, settle(&targets)?);
    let is_heavy = force_n > HEAVY_SHARE * robot.model.total_mass_kg() * GRAVITY_M_S2;
    if !is_heavy {
        return Ok(best);
    }
    let judge = |targets: &IkTargets, settled: &[f64]| {
        // Under its load it stands farther back.
        let Burden { moment_nm, .. } = burden(robot, targets, settled, force_n);
        let palms = targets.hands.iter().flatten().map(|hand| hand.translation);
        let centre = palms.clone().sum::<Vector3<f64>>() / palms.count().max(1) as f64;
        let lever = (centre - targets.com).xy().push(0.0);
        let relieved = 1.0 - moment_nm.norm() / (force_n * lever.norm()).max(1e-9);
        let weight_n = robot.model.total_mass_kg() * GRAVITY_M_S2;
        let back = lever * (relieved.clamp(0.0, 1.0) * force_n / weight_n);
        let loaded = IkTargets { com: targets.com - back, ..*targets };
        settle(&loaded).map(|settled| burden(robot, &loaded, &settled, force_n).torque_share)
    };
    // Even what it can't bear it may try.
    let mut least = judge(&best.0, &best.1).unwrap_or(f64::INFINITY);
    for step in 1..=STANCE_STEPS {
        let part = config.com_height_m * step as f64 / STANCE_STEPS as f64;
        let ahead = Pose::new(Vector3::new(NEARER * part, 0.0, 0.0), UnitQuaternion::identity());
        let mut targets = standing(&(*X_WG * ahead), config, hands);
        targets.com.z += HIGHER * part;
        // What is out of reach ends the search.
        let Ok(settled) = settle(&targets) else { break };
        let Ok(share) = judge(&targets, &settled) else { break };
        if share < least - WORTH_IT {
            (best, least) = ((targets, settled), share);
        }
    }
    Ok(best)
}

/// What a posture costs with so much in its hands.
fn burden(robot: &Robot, targets: &IkTargets, posture_rad: &[f64], force_n: f64) -> Burden {
    let mut kinematics = Kinematics::new(&robot.model);
    kinematics.update(&robot.model, &base_pose(robot, posture_rad, targets), posture_rad);
    robot.burden(&kinematics, force_n, None)
}

/// A robot that stands here, with its hands there.
pub(crate) fn standing(
    X_WG: &Pose<World, Ground>,
    config: &RobotConfig,
    hands: [Option<Pose<World, Hand>>; MAX_HANDS],
) -> IkTargets {
    IkTargets {
        stance: Side::Right,
        feet: PerFoot::from_fn(|side| *X_WG * standing_foot(side, config.foot_spacing_m)),
        com: X_WG.transform_point(&Vector3::new(0.0, 0.0, config.com_height_m)),
        waist_attitude: X_WG.rotation,
        hands,
    }
}

fn grasping_hands(
    scenario: &LoadedScenario,
    index: usize,
    member: &Member,
    hands: &[HandConfig],
) -> Result<Vec<usize>, LoadConfigError> {
    let Some(names) = &member.hands else { return Ok((0..hands.len()).collect()) };
    let find = |(place, name): (usize, &String)| {
        hands.iter().position(|hand| hand.name == *name).ok_or_else(|| {
            let known = hands.iter().map(|hand| hand.name.as_str()).collect::<Vec<_>>().join(", ");
            let key = format!("robots.{index}.hands.{place}");
            scenario.error_at(&key, format!("found {name:?}, expected one of {known}"))
        })
    };
    names.iter().enumerate().map(find).collect()
}

/// Where a member stands: X_WG.
fn ground_pose(member: &Member) -> Pose<World, Ground> {
    Pose::new(Vector3::new(member.x_m, member.y_m, 0.0), heading(member.yaw_deg))
}

/// Where the object is at tick 0: X_WA.
fn object_pose(object: &ObjectConfig) -> Pose<World, Object> {
    Pose::new(Vector3::from(object.position_m), heading(object.yaw_deg))
}

fn heading(yaw_deg: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw_deg.to_radians())
}

/// Where a robot holds: X_GH.
pub(crate) fn carry_pose(hand: &HandConfig) -> Pose<Ground, Hand> {
    let rows = &hand.carry_rotation;
    let matrix = Matrix3::from_fn(|row, column| rows[row][column]);
    // The configuration's rotation is checked to be one, to the digits that people write.
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix(&matrix));
    Pose::new(Vector3::from(hand.carry_position_m), rotation)
}

/// Where an open hand begins, from where it will hold: the palm's −z points to the object.
fn drawn_back(by_m: f64) -> Pose<Hand, Hand> {
    Pose::new(Vector3::new(0.0, 0.0, by_m), UnitQuaternion::identity())
}

fn standing_foot(side: Side, spacing_m: f64) -> Pose<Ground, Foot> {
    let y_m = match side {
        Side::Right => -0.5 * spacing_m,
        Side::Left => 0.5 * spacing_m,
    };
    Pose::new(Vector3::new(0.0, y_m, 0.0), UnitQuaternion::identity())
}

fn settle(
    scenario: &LoadedScenario,
    usable: &UsableModel<'_>,
    index: usize,
    member: &Member,
    grasping_hands: &[usize],
    targets: &IkTargets,
) -> Result<Vec<f64>, LoadConfigError> {
    let unusable = |error: &dyn Display| {
        let problem = format!("found {:?}, expected a model that can be moved: {error}", member.model);
        scenario.error_at(&format!("robots.{index}.model"), problem)
    };
    let robot = usable.robot.clone().with_hands(grasping_hands).map_err(|error| unusable(&error))?;
    let ik = robot.whole_body_ik(scenario.scenario.control_period_s).map_err(|error| unusable(&error))?;
    let mut scratch = IkScratch::new(&robot.model);
    let guess = &robot.carry_posture_rad;
    let settled = ik.settle(&robot.model, &mut scratch, guess, targets).map_err(|source| {
        let name = &member.name;
        let problem = match &source {
            SettlePostureError::UnreachableGrasp { hand, .. } => {
                let hand = grasping_hands.get(*hand).map(|&hand| &usable.loaded.config.hands[hand].name);
                let hand = hand.map_or("?", String::as_str);
                format!("unreachable grasp: the {hand} hand of robot {name}: {source}")
            }
            _ => format!("robot {name} can't stand as it should: {source}"),
        };
        scenario.error_at(&format!("robots.{index}"), problem)
    })?;
    Ok(settled.joint_position[..robot.model.joint_count()].to_vec())
}

/// The root link in the world, by the stance foot.
fn base_pose(robot: &Robot, posture_rad: &[f64], targets: &IkTargets) -> Pose<World, Base> {
    let X_WF = targets.feet[targets.stance];
    let X_BF: Pose<Base, Foot> = robot.model.pose_in_base(robot.soles[targets.stance], posture_rad);
    X_WF * X_BF.inverse()
}
