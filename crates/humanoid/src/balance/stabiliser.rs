//! The stabiliser: from what the centre of mass does to what the feet of a position-controlled robot do
//! about it.
//!
//! Sources: Kajita et al., IROS 2010 (linear inverted pendulum tracking); Caron et al., "Stair Climbing
//! Stabilization of the HRP-4 Humanoid Robot using Whole-body Admittance Control", ICRA 2019; with hand
//! loads as in Murooka et al., RA-L 2021.

use super::distribution::{FootLoad, distribute};
use super::nearest::nearest_in_polygon;
use super::{ExternalLoad, Pendulum, PerFoot, Side};
use crate::estimate::{SoleRectangle, SupportPolygon};
use mikoshi_spatial::{Foot, Pose, Twist, World, Wrench};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Everything that is constant over a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StabiliserConfig {
    /// Control period \[s\].
    pub control_period_s: f64,
    /// Mass and height of the robot.
    pub pendulum: Pendulum,
    /// Soles in their feet's frames.
    pub soles: PerFoot<SoleRectangle>,
    /// Where under each foot the zero moment point rests, in the foot's frame \[m\]: the gait's.
    pub zmp_in_foot: PerFoot<Vector2<f64>>,
    /// kp: metres of zero moment point per metre of divergent component; stable above 1.
    pub dcm_gain: f64,
    /// ki \[1/s\].
    pub dcm_integral_gain_1_s: f64,
    /// Bound of the integral's part of the zero moment point \[m\].
    pub dcm_integral_max_m: f64,
    /// Time in which integral and offsets forget \[s\].
    pub leak_s: f64,
    /// Distance that the desired zero moment point keeps from the soles' edges \[m\].
    pub sole_margin_m: f64,
    /// Ankle admittance.
    pub ankle_rad_s_nm: f64,
    /// Largest tilt of a sole \[rad\].
    pub ankle_max_rad: f64,
    /// Way of a foot's centre of pressure past where it is wanted, beyond which the foot stands on the edge of something and is
    /// turned faster and faster \[m\].
    pub edge_m: f64,
    /// Error of the divergent component from which on a foot is at its edge because its robot falls \[m\].
    pub edge_dcm_m: f64,
    /// For how long: the way that is past, by time \[m s\]. What alternates is no edge.
    pub edge_patience_m_s: f64,
    /// By how much faster \[rad/s² by Nm\].
    pub edge_rad_s2_nm: f64,
    /// At most \[rad/s\].
    pub edge_max_rad_s: f64,
    /// τ: soles of a robot that has rested for t move τ / (τ + t) as fast as they would \[s\].
    pub rest_s: f64,
    /// Admittance of the force difference between the feet.
    pub force_difference_m_s_n: f64,
    /// Largest difference of the feet's heights \[m\].
    pub height_difference_max_m: f64,
    /// Acceleration of the centre of mass per metre that the measured zero moment point lies past the
    /// desired one \[1/s²\]; 0 leaves the gait's centre of mass alone.
    pub com_admittance_1_s2: f64,
    /// Largest offset of the centre of mass \[m\].
    pub com_offset_max_m: f64,
}

impl StabiliserConfig {
    /// Parameters that work for HRP-2's stiff drives.
    pub fn standard(
        control_period_s: f64,
        pendulum: Pendulum,
        soles: PerFoot<SoleRectangle>,
        zmp_in_foot: PerFoot<Vector2<f64>>,
    ) -> Self {
        Self {
            control_period_s,
            pendulum,
            soles,
            zmp_in_foot,
            dcm_gain: 2.0,
            dcm_integral_gain_1_s: 1.0,
            dcm_integral_max_m: 0.03,
            leak_s: 0.3,
            sole_margin_m: 0.01,
            ankle_rad_s_nm: 1e-3,
            ankle_max_rad: 0.15,
            edge_m: 0.022,
            edge_dcm_m: 0.02,
            edge_patience_m_s: 0.0008,
            edge_rad_s2_nm: 0.15,
            edge_max_rad_s: 0.4,
            rest_s: 0.3,
            force_difference_m_s_n: 3e-5,
            height_difference_max_m: 0.03,
            com_admittance_1_s2: 0.0,
            com_offset_max_m: 0.03,
        }
    }

    /// The same for legs of which the most strongly damped drive has `damping_nms_rad`: admittances shrink where that is
    /// more than HRP-2's 500.
    ///
    /// Drives take velocity references, too. A displacement δ that a tick of T brings is a velocity δ/T for its time, and
    /// with damping B a moment B δ/T. An admittance A answers it by −A T times that, so that the loop's gain is A B whatever
    /// the period. At 2 it turns over and alternates from tick to tick; with HRP-2's drives it is at .5, where what bends
    /// elsewhere has been seen to do no harm.
    pub fn for_leg_drives(mut self, damping_nms_rad: f64) -> Self {
        let share = (STANDARD_DAMPING_NMS_RAD / damping_nms_rad).min(1.0);
        self.ankle_rad_s_nm *= share;
        self.force_difference_m_s_n *= share;
        self.edge_rad_s2_nm *= share;
        self
    }
}

/// How many times lighter than the whole robot a foot may be that feels an edge as if it bore all.
const LIGHTEST: f64 = 4.0;
/// Share of the weight below which a foot does not say where it bears.
const LEAST_SHARE: f64 = 0.1;

/// Time constant in which a sole comes to rest that has found the ground: damped drives answer a turn that ends at once by a
/// blow that throws the centre of pressure to the other edge \[s\].
const EDGE_SETTLE_S: f64 = 0.015;
/// Share of the patience below which what is left of a turn is nothing.
const EDGE_SETTLED: f64 = 0.02;

/// Of the drives for which [`StabiliserConfig::standard`] is.
const STANDARD_DAMPING_NMS_RAD: f64 = 500.0;

/// All that matters from tick to tick: floats only, without padding.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StabiliserState {
    /// Leaky integral of the divergent component's error \[m s, world\].
    pub dcm_error_integral: Vector2<f64>,
    /// Tilt of each sole about its own x and y axes \[rad\].
    pub sole_tilt: PerFoot<Vector2<f64>>,
    /// Of a sole that stands on an edge: its moment past what is usual, since it is \[Nm s\].
    pub sole_turning: PerFoot<Vector2<f64>>,
    /// Height of the left sole over the right one \[m\].
    pub height_difference: f64,
    /// For how long the robot has rested in balance \[s\].
    pub rested_s: f64,
    /// Offset of the centre of mass \[m, world\].
    pub com_offset: Vector2<f64>,
    /// Its velocity \[m/s\].
    pub com_offset_velocity: Vector2<f64>,
}

/// What one tick takes; all in the world, at the start of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StabiliserInputs {
    /// Centre of mass of the gait \[m\].
    pub com_ref: Vector2<f64>,
    /// Its velocity \[m/s\].
    pub com_velocity_ref: Vector2<f64>,
    /// Its acceleration \[m/s²\].
    pub com_acceleration_ref: Vector2<f64>,
    /// Measured centre of mass \[m\].
    pub com: Vector2<f64>,
    /// Its velocity \[m/s\].
    pub com_velocity: Vector2<f64>,
    /// Where each foot stands; `None` in the air.
    pub standing: PerFoot<Option<Pose<World, Foot>>>,
    /// Measured wrench of the ground on each foot, at the foot's origin.
    pub ground_wrench: PerFoot<Wrench<World>>,
    /// The measured hands' load.
    pub load: ExternalLoad,
    /// Whether the robot is to rest: on both feet, none of which is to be lifted, and on ground that is not level.
    pub rests: bool,
}

/// What the feet and the centre of mass shall do beside the gait, and why.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stabilisation {
    /// Zero moment point on the ground that would bring the divergent component back, within the support
    /// \[m\].
    pub zmp: Vector2<f64>,
    /// Error of the divergent component, measured minus reference \[m\].
    pub dcm_error: Vector2<f64>,
    /// What each foot shall bear.
    pub loads: PerFoot<FootLoad>,
    /// How each sole is to be displaced: height, and tilt about its own horizontal axes.
    pub sole_offset: PerFoot<Twist<Foot>>,
    /// To be added to the gait's centre of mass \[m\].
    pub com_offset: Vector2<f64>,
}

impl Stabilisation {
    /// A foot's reference pose with its sole's offset.
    pub fn apply(&self, side: Side, reference: &Pose<World, Foot>) -> Pose<World, Foot> {
        let offset = &self.sole_offset[side];
        *reference * Pose::<Foot, Foot>::identity().displaced(offset)
    }
}

/// The stabiliser of one robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stabiliser {
    config: StabiliserConfig,
    inner_soles: PerFoot<SoleRectangle>,
}

impl Stabiliser {
    /// For these parameters.
    pub fn new(config: StabiliserConfig) -> Self {
        let margin = config.sole_margin_m;
        let inner_soles = PerFoot::from_fn(|side| {
            let sole = config.soles[side];
            SoleRectangle {
                x_min: sole.x_min + margin,
                x_max: sole.x_max - margin,
                y_min: sole.y_min + margin,
                y_max: sole.y_max - margin,
            }
        });
        Self { config, inner_soles }
    }

    /// Its parameters.
    pub fn config(&self) -> &StabiliserConfig {
        &self.config
    }

    /// Whether a sole stands on the edge of something and turns to find its ground.
    pub fn turns(&self, state: &StabiliserState, side: Side) -> bool {
        state.sole_turning[side].amax() > self.patience_nm_s()
    }

    /// What a sole that turns has felt past what is usual \[Nm s\].
    fn patience_nm_s(&self) -> f64 {
        self.config.edge_patience_m_s * self.config.pendulum.weight_n()
    }

    /// One tick.
    ///
    /// 1. Divergent component: ξ = c + ċ / ω, error e = ξ − ξ_ref; extended zero moment point
    ///    `c_ref − c̈_ref / ω² + kp e + ki ∫e`, with which ξ̇ = ω (ξ − ·) makes ė = ω (1 − kp) e − …
    /// 2. On the ground by the measured load of the hands ([`ExternalLoad`]), into the support.
    /// 3. To the feet ([`distribute`]).
    /// 4. Ankle admittance, in the foot's axes: `d(tilt)/dt = A (τ − τ_desired) − tilt / leak`: a sole
    ///    yields to the ground's moment and so brings it to what is desired.
    ///    One that stands on the edge of something does not feel its turning: it turns faster and faster until it does.
    /// 5. Force difference: `d(h)/dt = A ((f_L − f_R) − desired) − h / leak`, h the left sole's height
    ///    over the right one's, half of it to each: the foot that bears too much is drawn up.
    /// 6. Soles of a robot that has rested for t, balanced, do 4 and 5 `τ / (τ + t)` as fast: what contacts rattle is
    ///    averaged out over all the time that it has stood, as by any gain that falls with 1/t (Robbins and Monro 1951),
    ///    and what soles rest at is the same.
    /// 7. Admittance of the centre of mass to the error of the zero moment point (off by default).
    ///
    /// Where nothing stands, everything leaks.
    pub fn act(&self, state: &mut StabiliserState, inputs: &StabiliserInputs) -> Stabilisation {
        let config = &self.config;
        let dt = config.control_period_s;
        let pendulum = &config.pendulum;
        let dcm_error = pendulum.divergent_component(&inputs.com, &inputs.com_velocity)
            - pendulum.divergent_component(&inputs.com_ref, &inputs.com_velocity_ref);

        let support = SupportPolygon::of_feet(&self.inner_soles, &inputs.standing);
        let integral = &mut state.dcm_error_integral;
        let stands = !support.vertices().is_empty();
        let learned = if stands { dcm_error } else { Vector2::zeros() };
        *integral += (learned - *integral / config.leak_s) * dt;
        let integral_max = config.dcm_integral_max_m / config.dcm_integral_gain_1_s.max(1e-9);
        *integral = integral.map(|value| value.clamp(-integral_max, integral_max));

        let extended = pendulum.extended_zmp(&inputs.com_ref, &inputs.com_acceleration_ref)
            + dcm_error * config.dcm_gain
            + *integral * config.dcm_integral_gain_1_s;
        let wished = inputs.load.ground_zmp(&extended);
        let zmp = nearest_in_polygon(&support, &wished).unwrap_or(wished);
        let force = pendulum.weight_n() * inputs.load.kappa;
        let loads = distribute(force, &zmp, &self.inner_soles, &config.zmp_in_foot, &inputs.standing);

        let is_balanced = dcm_error.norm() < config.edge_dcm_m;
        state.rested_s = if inputs.rests && is_balanced { state.rested_s + dt } else { 0.0 };
        // All that follows moves soles.
        let dt = dt * (config.rest_s / (config.rest_s + state.rested_s));
        for side in Side::BOTH {
            let tilt = &mut state.sole_tilt[side];
            let turning = &mut state.sole_turning[side];
            let mut rate = -*tilt / config.leak_s;
            if inputs.standing[side].is_none() {
                *turning = Vector2::zeros();
            }
            if let Some(foot) = &inputs.standing[side] {
                let excess =
                    inputs.ground_wrench[side].moment.xy() - loads[side].moment_about(&foot.translation.xy());
                let in_foot = |moment: Vector2<f64>| (foot.rotation.inverse() * moment.push(0.0)).xy();
                let excess = in_foot(excess);
                // By where a foot bears and not by how much: one that has just landed feels an edge as well.
                let bears = inputs.ground_wrench[side].force.z;
                let wanted = FootLoad { force: bears, ..loads[side] };
                let feels = is_balanced && bears > LEAST_SHARE * pendulum.weight_n();
                let off = if feels {
                    in_foot(
                        inputs.ground_wrench[side].moment.xy() - wanted.moment_about(&foot.translation.xy()),
                    ) * (pendulum.weight_n() / bears.max(1.0)).clamp(1.0, LIGHTEST)
                } else {
                    Vector2::zeros()
                };
                let usual = config.edge_m * pendulum.weight_n();
                let patience = self.patience_nm_s();
                let most = patience + config.edge_max_rad_s / config.edge_rad_s2_nm.max(1e-9);
                *turning = turning.zip_map(&off, |turning, off| {
                    let beyond = off - off.clamp(-usual, usual);
                    let kept = if beyond * turning > 0.0 { turning } else { settled(turning, patience, dt) };
                    (kept + beyond * dt).clamp(-most, most)
                });
                let turned = turning.map(|turning| turning - turning.clamp(-patience, patience));
                rate += excess * config.ankle_rad_s_nm + turned * config.edge_rad_s2_nm;
            }
            *tilt = (*tilt + rate * dt).map(|value| value.clamp(-config.ankle_max_rad, config.ankle_max_rad));
        }

        let mut rate = -state.height_difference / config.leak_s;
        if inputs.standing.right.is_some() && inputs.standing.left.is_some() {
            let measured = inputs.ground_wrench.left.force.z - inputs.ground_wrench.right.force.z;
            rate += config.force_difference_m_s_n * (measured - (loads.left.force - loads.right.force));
        }
        let most = config.height_difference_max_m;
        state.height_difference = (state.height_difference + rate * dt).clamp(-most, most);

        self.yield_with_com(state, inputs, &zmp);
        let sole_offset = PerFoot::from_fn(|side| {
            let tilt = state.sole_tilt[side];
            let height = side.sign() * state.height_difference / 2.0;
            Twist::new(Vector3::new(0.0, 0.0, height), Vector3::new(tilt.x, tilt.y, 0.0))
        });
        Stabilisation { zmp, dcm_error, loads, sole_offset, com_offset: state.com_offset }
    }

    /// c̈_offset = A (z_measured − z_desired), with a critically damped return within the leak.
    fn yield_with_com(&self, state: &mut StabiliserState, inputs: &StabiliserInputs, zmp: &Vector2<f64>) {
        let config = &self.config;
        let (mut force, mut moment) = (0.0, Vector2::zeros());
        for side in Side::BOTH {
            let Some(foot) = &inputs.standing[side] else { continue };
            let wrench = &inputs.ground_wrench[side];
            force += wrench.force.z;
            moment +=
                foot.translation.xy() * wrench.force.z + Vector2::new(-wrench.moment.y, wrench.moment.x);
        }
        let stands = force > 0.1 * config.pendulum.weight_n();
        let excess = if stands { moment / force - zmp } else { Vector2::zeros() };
        let rate = 1.0 / config.leak_s;
        let acceleration = excess * config.com_admittance_1_s2
            - state.com_offset_velocity * (2.0 * rate)
            - state.com_offset * (rate * rate);
        let most = config.com_offset_max_m;
        state.com_offset_velocity += acceleration * config.control_period_s;
        let next = state.com_offset + state.com_offset_velocity * config.control_period_s;
        state.com_offset = next.map(|value| value.clamp(-most, most));
        // At its bound an offset has no speed outwards.
        for axis in 0..2 {
            if state.com_offset[axis] != next[axis] {
                state.com_offset_velocity[axis] = 0.0;
            }
        }
    }
}

/// What is left after a tick of the turning of a sole that stands on no edge any more: what is past the patience, and so turns
/// the sole, fades within [`EDGE_SETTLE_S`]; then all is forgotten.
fn settled(turning: f64, patience: f64, dt: f64) -> f64 {
    let turns = turning - turning.clamp(-patience, patience);
    let fades = turns.abs() > EDGE_SETTLED * patience;
    if fades { turning - turns * (dt / EDGE_SETTLE_S).min(1.0) } else { 0.0 }
}

const _: () = assert!(size_of::<StabiliserState>() == 16 * size_of::<f64>());
