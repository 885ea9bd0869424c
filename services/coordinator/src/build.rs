//! From a run's description to the law that controls it.

use mikoshi_config::scenario::{Axis, Control, InternalForces as Representation, Scenario};
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_cooperation as cooperation;
use mikoshi_cooperation::{
    BuildHybridLawError, BuildInternalForcesError, BuildLandmarkError, BuildTeamArmsError, ForceGains,
    HandStiffness, HybridLaw, HybridParameters, InternalForces, RobotArms, Selection, StartHybridError,
    TeamArms, VirtualStick,
};
use mikoshi_spatial::{Hand, Object, Pose};

/// How far a hand's reference may lead what its robot makes of it.
const LEAD_LIMIT_M: f64 = 0.02;
const LEAD_LIMIT_RAD: f64 = 0.05;
/// How fast force control may bring the object to what it is to press against: object and forearms, some
/// 30 kg, that meet a wall of 200 kN/m at this speed press it with 12 N at once.
const APPROACH_LIMIT_M_S: f64 = 0.005;
const APPROACH_LIMIT_RAD_S: f64 = 0.01;

/// Why a run has no coordinator.
#[derive(Debug, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildCoordinatorError {
    #[error("team: {0}")]
    Team(#[from] BuildTeamArmsError),
    #[error("hybrid.internal_forces: {0}")]
    InternalForces(#[from] BuildInternalForcesError),
    #[error("hybrid: {0}")]
    Law(#[from] BuildHybridLawError),
    #[error("robots' odometry: {0}")]
    Landmark(#[from] BuildLandmarkError),
    #[error("grasp: {0}")]
    Grasp(#[from] StartHybridError),
    #[error("hybrid.axes: there is no row `{found}`; expected one of {expected}")]
    UnknownRow { found: String, expected: String },
    #[error("coordination.leader: there is no robot `{found}`; expected one of {expected}")]
    UnknownLeader { found: String, expected: String },
    #[error(
        "operator.drive.squeeze.row: found `{found}`, expected an internal force that is controlled along this axis"
    )]
    Squeeze { found: String },
    #[error("robot {robot}, hand {hand}: its pose in the object is not a pose")]
    HandPose { robot: String, hand: usize },
    #[error("{0}")]
    Connect(#[from] mikoshi_runtime::ConnectError),
}

/// The grasping arms of the team, in hand order.
pub fn team_arms(run: &RunSpec) -> Result<TeamArms, BuildTeamArmsError> {
    let arms_of = |robot: &RobotSpec| RobotArms {
        robot: robot.member.name.clone(),
        hands: robot.grasping_hands.iter().map(|&hand| robot.config.hands[hand].name.clone()).collect(),
    };
    TeamArms::new(run.robots.iter().map(arms_of).collect())
}

/// The internal forces that the scenario chose.
pub fn build_internal_forces(run: &RunSpec) -> Result<InternalForces, BuildCoordinatorError> {
    let team = team_arms(run)?;
    Ok(match &run.scenario.hybrid.internal_forces {
        Representation::BalancedTree => InternalForces::balanced_tree(&team),
        Representation::Chain => InternalForces::chain(&team),
        Representation::Matrix(rows) => InternalForces::from_matrix(rows, team.arms())?,
    })
}

/// The hybrid law with the scenario's gains and selection.
pub fn build_hybrid_law(run: &RunSpec) -> Result<HybridLaw, BuildCoordinatorError> {
    let internal_forces = build_internal_forces(run)?;
    let selection = build_selection(&run.scenario, &internal_forces)?;
    law_with(run, internal_forces, selection)
}

/// The law for an object that rests on something: the same, with the object under force control along all
/// axes.
pub(crate) fn build_resting_law(run: &RunSpec) -> Result<HybridLaw, BuildCoordinatorError> {
    let internal_forces = build_internal_forces(run)?;
    let mut selection = build_selection(&run.scenario, &internal_forces)?;
    for axis in cooperation::Axis::ALL {
        let selected = selection.select(0, axis, cooperation::Control::Force);
        debug_assert!(selected.is_some(), "row 0 is the object");
    }
    law_with(run, internal_forces, selection)
}

fn law_with(
    run: &RunSpec,
    internal_forces: InternalForces,
    selection: Selection,
) -> Result<HybridLaw, BuildCoordinatorError> {
    let hybrid = &run.scenario.hybrid;
    let stiffness = HandStiffness { n_m: hybrid.hand_stiffness_n_m, nm_rad: hybrid.hand_stiffness_nm_rad };
    let parameters = HybridParameters {
        period_s: run.scenario.control_period_s,
        kz: hybrid.kz,
        kh: ForceGains::of_loop_gain(hybrid.loop_gain, hybrid.kz, stiffness),
        selection,
        filter_hz: hybrid.filter_hz,
        lead_limit_m: LEAD_LIMIT_M,
        lead_limit_rad: LEAD_LIMIT_RAD,
        approach_limit_m_s: APPROACH_LIMIT_M_S,
        approach_limit_rad_s: APPROACH_LIMIT_RAD_S,
    };
    Ok(HybridLaw::new(internal_forces, parameters)?)
}

/// The virtual sticks of all hands, in hand order, as the run's description has the grasp.
pub(crate) fn virtual_sticks(run: &RunSpec) -> Result<Vec<VirtualStick>, BuildCoordinatorError> {
    let mut sticks = vec![];
    for robot in &run.robots {
        for (hand, X_AH) in robot.hand_in_object.iter().enumerate() {
            let X_AH = Pose::<Object, Hand>::from_array(X_AH)
                .ok_or_else(|| BuildCoordinatorError::HandPose { robot: robot.member.name.clone(), hand })?;
            sticks.push(VirtualStick::from_hand_in_object(&X_AH));
        }
    }
    Ok(sticks)
}

fn build_selection(
    scenario: &Scenario,
    internal_forces: &InternalForces,
) -> Result<Selection, BuildCoordinatorError> {
    let mut selection = Selection::object_position_internal_force(internal_forces.arms());
    for exception in &scenario.hybrid.axes {
        let row = find_row(internal_forces, &exception.row)?;
        let control = match exception.control {
            Control::Position => cooperation::Control::Position,
            Control::Force => cooperation::Control::Force,
        };
        let axis = match exception.axis {
            Axis::X => cooperation::Axis::X,
            Axis::Y => cooperation::Axis::Y,
            Axis::Z => cooperation::Axis::Z,
            Axis::Roll => cooperation::Axis::Roll,
            Axis::Pitch => cooperation::Axis::Pitch,
            Axis::Yaw => cooperation::Axis::Yaw,
        };
        let selected = selection.select(row, axis, control);
        debug_assert!(selected.is_some(), "the row was just found");
    }
    Ok(selection)
}

/// The row of this name, or what rows there are.
pub(crate) fn find_row(internal_forces: &InternalForces, name: &str) -> Result<usize, BuildCoordinatorError> {
    internal_forces.row(name).ok_or_else(|| BuildCoordinatorError::UnknownRow {
        found: name.to_owned(),
        expected: internal_forces.names().join(", "),
    })
}
