//! `/team/internal_forces` and `/team/state`: what the coordinator controls.

use crate::convert::{half, timestamp, vector};
use crate::topic::Topic;
use foxglove::messages::{Timestamp, Vector3};
use mikoshi_ipc_types::{mode, stop_cause};
use mikoshi_observation::{LogWriter, Observation, ObservedRun, TrackedObject, WriteLogError};

/// All internal forces (a row of C each), in the object's axes.
#[derive(foxglove::Encode)]
pub struct InternalForces {
    timestamp: Timestamp,
    rows: Vec<InternalForce>,
}

/// One of them: true and unfiltered, as measured and filtered, and its reference.
#[derive(foxglove::Encode)]
pub struct InternalForce {
    name: String,
    force_n: Vector3,
    torque_nm: Vector3,
    force_measured_n: Vector3,
    torque_measured_nm: Vector3,
    force_ref_n: Vector3,
    torque_ref_nm: Vector3,
}

/// What the team does, and how well the object follows.
#[derive(foxglove::Encode)]
pub struct TeamState {
    timestamp: Timestamp,
    mode: String,
    /// Empty if the team is in no safe stop.
    stop_cause: String,
    /// Share of the operator's velocity that the slowest robot allows.
    speed_share: f64,
    /// From the object's reference to where it truly is, in the world's axes; zero without a reference.
    object_error_m: Vector3,
    object_error_rad: Vector3,
    object_velocity_m_s: Vector3,
    object_angular_velocity_rad_s: Vector3,
    /// How far the hand that has parted furthest has done so: it slips from 1 on.
    slip_max: f64,
    /// Bit i: hand i of the team takes no part any more.
    absent_hands: u64,
}

/// The team.
pub struct Team {
    internal_forces: Topic<InternalForces>,
    state: Topic<TeamState>,
    names: Vec<String>,
}

impl Team {
    pub fn add(log: &mut LogWriter, observed: &ObservedRun) -> Result<Self, WriteLogError> {
        Ok(Self {
            internal_forces: Topic::add(log, "/team/internal_forces")?,
            state: Topic::add(log, "/team/state")?,
            names: observed.internal_rows.iter().map(|(name, _)| name.clone()).collect(),
        })
    }

    pub fn write(
        &self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
        object: &TrackedObject,
    ) -> Result<(), WriteLogError> {
        let tick = observation.tick();
        self.internal_forces.write(log, tick, &self.internal_forces_of(time_ns, observation, object))?;
        self.state.write(log, tick, &state_of(time_ns, observation, object))
    }

    fn internal_forces_of(
        &self,
        time_ns: u64,
        observation: &Observation,
        object: &TrackedObject,
    ) -> InternalForces {
        let team = &observation.team_state.payload;
        // Row 0 is the external force.
        let measured = team.generalized_force.iter().zip(&team.generalized_force_ref).skip(1);
        let rows = self.names.iter().zip(&object.internal).zip(measured);
        let row = |((name, actual), (measured, reference)): ((&String, _), (&[f64; 6], &[f64; 6]))| {
            let actual: &mikoshi_spatial::Wrench<mikoshi_spatial::Object> = actual;
            InternalForce {
                name: name.clone(),
                force_n: vector(&actual.force),
                torque_nm: vector(&actual.moment),
                force_measured_n: half(measured, 0),
                torque_measured_nm: half(measured, 3),
                force_ref_n: half(reference, 0),
                torque_ref_nm: half(reference, 3),
            }
        };
        InternalForces { timestamp: timestamp(time_ns), rows: rows.map(row).collect() }
    }
}

fn state_of(time_ns: u64, observation: &Observation, object: &TrackedObject) -> TeamState {
    let team = &observation.team_state.payload;
    let twist = &observation.object_truth.payload.twist;
    let error = object.X_WA_ref.map(|X_WA_ref| X_WA_ref.displacement_to(&object.X_WA)).unwrap_or_default();
    let cause = if team.stop_cause == 0 { "" } else { stop_cause::name(team.stop_cause) };
    TeamState {
        timestamp: timestamp(time_ns),
        mode: mode::name(team.team_mode).to_owned(),
        stop_cause: cause.to_owned(),
        speed_share: team.speed_share,
        object_error_m: vector(&error.linear),
        object_error_rad: vector(&error.angular),
        object_velocity_m_s: half(twist, 0),
        object_angular_velocity_rad_s: half(twist, 3),
        slip_max: team.hand_slip.iter().copied().fold(0.0, f64::max),
        absent_hands: team.absent_hands,
    }
}
