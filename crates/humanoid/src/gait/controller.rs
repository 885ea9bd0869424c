//! One robot's gait: from the team's step clock and the hands' references to references of the feet and
//! of the centre of mass.

use super::foot_placement::{FootError, FootPlacement, HandCentre};
use super::ground_pose::{GroundPose, wrap};
use super::machine::{GaitPhase, SwingingFoot, TransitionInputs};
use super::preview::{PreviewConfig, PreviewControl, PreviewState, SolvePreviewError};
use super::step_clock::{StepClock, StepTiming};
use super::step_planner::StepLimits;
use super::swing::{Foothold, SwingConfig, SwingContact};
use super::team_clock::StepWish;
use super::zmp_reference::ZmpReference;
use crate::balance::{ExternalLoad, PerFoot, Side};
use crate::estimate::SoleRectangle;
use mikoshi_spatial::{Foot, Pose, Twist, World};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Everything that is constant over a run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaitConfig {
    /// Lengths of the team's step clock.
    pub timing: StepTiming,
    /// Limits of one step.
    pub limits: StepLimits,
    /// Swing and landing.
    pub swing: SwingConfig,
    /// Preview control; its period is the control period, its height that of the centre of mass.
    pub preview: PreviewConfig,
    /// Foot errors (eq. 40) from which on the robot wants to walk.
    pub start: FootError,
    /// Foot errors (eq. 40) below which it can stop.
    pub stop: FootError,
    /// Distance of the body from where it belongs under the hands (eq. 40 for the middle of both feet)
    /// from which on the object has to slow down.
    pub slow: FootError,
    /// Distance at which it has to stand.
    pub halt: FootError,
    /// Where under each foot the zero moment point shall rest, in the foot's frame \[m\].
    pub zmp_in_foot: PerFoot<Vector2<f64>>,
    /// Whether the robot swings its right foot where the team's clock says left, so that robots that
    /// face each other swing on one side of the world and sway together.
    pub mirrored: bool,
    /// How far past its landing a step aims along the references' motion: half a step keeps the hands
    /// about where they were over the feet.
    pub reference_lead_s: f64,
    /// Time constant of the low-pass through which the hands' load moves the centre of mass.
    pub load_filter_s: f64,
}

impl GaitConfig {
    /// Parameters that work for HRP-2, for feet with these soles: the zero moment point rests halfway
    /// between toe and heel, under the ankle's axis.
    pub fn standard(soles: PerFoot<SoleRectangle>) -> Self {
        let preview = PreviewConfig::default();
        Self {
            timing: StepTiming::standard(preview.control_period_s),
            limits: StepLimits::standard(soles),
            swing: SwingConfig::default(),
            preview,
            start: FootError { position: 0.03, yaw: 0.05 },
            stop: FootError { position: 0.02, yaw: 0.03 },
            slow: FootError { position: 0.08, yaw: 0.12 },
            halt: FootError { position: 0.14, yaw: 0.20 },
            zmp_in_foot: PerFoot::from_fn(|side| {
                Vector2::new((soles[side].x_min + soles[side].x_max) / 2.0, 0.0)
            }),
            mirrored: false,
            reference_lead_s: 0.4,
            load_filter_s: 1.0,
        }
    }
}

/// All that matters from tick to tick.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GaitState {
    /// What the legs do.
    pub phase: GaitPhase,
    /// The foot that the body moves about: the one that stands, or of two the one that does next.
    pub stance: Side,
    /// Where each foot stands, or last stood: once it has landed, where it was felt to land.
    pub feet: PerFoot<Foothold>,
    /// d₁, d₂ of Fig. 6, once there is a grasp.
    pub placement: Option<FootPlacement>,
    /// Centre of mass.
    pub preview: PreviewState,
    /// The hands' load as the centre of mass follows it.
    pub load: ExternalLoad,
    /// The clock of the last tick.
    pub clock: StepClock,
    /// Reference of the zero moment point on the ground \[m, world\].
    pub zmp_ref: Vector2<f64>,
}

/// What one tick takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaitInputs {
    /// The team's clock in this tick.
    pub clock: StepClock,
    /// Centre of the hands' references; without a grasp the feet stay where they are.
    pub hand_centre: Option<HandCentre>,
    /// Measured vertical force on each foot \[N\].
    pub foot_force: PerFoot<f64>,
    /// Where each sole is by encoders, from the base that the standing foot bears; as planned when absent.
    pub soles: Option<PerFoot<GroundPose>>,
    /// The measured hands' load.
    pub load: ExternalLoad,
}

/// Reference of one foot at the end of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FootReference {
    /// Of the sole.
    pub pose: Pose<World, Foot>,
    /// Of the sole's origin.
    pub twist: Twist<World>,
    /// Whether it bears.
    pub in_contact: bool,
}

/// References at the end of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GaitReference {
    /// The foot that the body moves about.
    pub stance: Side,
    /// Feet.
    pub feet: PerFoot<FootReference>,
    /// Centre of mass \[m, world\].
    pub com: Vector3<f64>,
    /// Its velocity \[m/s\].
    pub com_velocity: Vector3<f64>,
    /// Its acceleration \[m/s²\].
    pub com_acceleration: Vector3<f64>,
    /// Zero moment point as planned from the footholds \[m, world\].
    pub zmp: Vector2<f64>,
}

/// The gait of one robot.
#[derive(Clone, Debug, PartialEq)]
pub struct Gait {
    config: GaitConfig,
    preview: PreviewControl,
}

impl Gait {
    /// Solves for the preview gains.
    pub fn new(config: GaitConfig) -> Result<Self, SolvePreviewError> {
        Ok(Self { preview: PreviewControl::new(&config.preview)?, config })
    }

    /// Its parameters.
    pub fn config(&self) -> &GaitConfig {
        &self.config
    }

    /// A robot that stands on `feet` with its centre of mass at rest over `com`: there its zero moment
    /// point's reference rests until the first step.
    pub fn standing(&self, feet: PerFoot<GroundPose>, com: Vector2<f64>) -> GaitState {
        GaitState {
            phase: GaitPhase::Standing { zmp: com },
            stance: Side::Right,
            feet: PerFoot::from_fn(|side| Foothold::on_ground(feet[side])),
            placement: None,
            preview: PreviewState::at_rest(com),
            load: ExternalLoad::NONE,
            clock: StepClock::Standing,
            zmp_ref: com,
        }
    }

    /// What the robot tells the team, from the state after the last tick and the hands' references.
    ///
    /// All is judged by eq. 40 for both feet, against references as they will be at the NEXT landing.
    pub fn wish(&self, state: &GaitState, hand_centre: Option<&HandCentre>) -> StepWish {
        let ready = state.phase.is_ready(&state.clock);
        let (Some(placement), Some(centre)) = (&state.placement, hand_centre) else {
            return StepWish { ready, ..StepWish::CONTENT };
        };
        let timing = &self.config.timing;
        // Feet and swing foot as they are when the next undecided step starts, and ticks to its landing.
        let feet = footholds(state);
        let (feet, swing, ticks) = match state.clock {
            StepClock::Stepping { step_index, tick_in_step, swing, will_continue: true } => {
                let side = swing.mirrored(self.config.mirrored);
                let remaining = timing.step(step_index).saturating_sub(tick_in_step + 1);
                (after_step(feet, &state.phase), side.opposite(), remaining + timing.step(step_index + 1))
            }
            StepClock::Standing => {
                let ticks = timing.step(0);
                let reference = placement.reference_feet(&centre.after(self.seconds(ticks)));
                (feet, self.config.limits.first_swing(&feet, &reference), ticks)
            }
            _ => return StepWish { ready, ..StepWish::CONTENT },
        };
        let at_landing = placement.reference_feet(&centre.after(self.seconds(ticks)));
        let urgency = relative_error(&at_landing, &feet, &self.config.start);

        let mut stepped = feet;
        stepped[swing] = self.foothold(placement, centre, &feet, swing, ticks);
        // By the time of another first landing: who would want to walk again at once must not stop.
        let later = ticks + timing.finish() + timing.step(0);
        let at_restart = placement.reference_feet(&centre.after(self.seconds(later)));
        StepWish {
            wants_step: state.clock == StepClock::Standing && urgency > 1.0,
            can_stop: relative_error(&at_landing, &stepped, &self.config.stop) < 1.0
                && relative_error(&at_restart, &stepped, &self.config.start) < 1.0,
            ready,
            first_swing: swing.mirrored(self.config.mirrored),
            urgency,
        }
    }

    /// The share of its speed that the object may keep without leaving the robot behind (Fig. 10b): 1 up
    /// to the error `slow`, 0 from `halt` on.
    pub fn speed_share(&self, state: &GaitState, hand_centre: Option<&HandCentre>) -> f64 {
        let (Some(placement), Some(centre)) = (&state.placement, hand_centre) else { return 1.0 };
        let (feet, reference) = (footholds(state), placement.reference_feet(&centre.pose));
        let middle = |feet: &PerFoot<GroundPose>| GroundPose {
            position: (feet.right.position + feet.left.position) / 2.0,
            yaw: wrap(feet.right.yaw + wrap(feet.left.yaw - feet.right.yaw) / 2.0),
        };
        let error = FootError::between(&middle(&reference), &middle(&feet));
        let GaitConfig { slow, halt, .. } = &self.config;
        let share = |error: f64, slow: f64, halt: f64| ((halt - error) / (halt - slow)).clamp(0.0, 1.0);
        share(error.position, slow.position, halt.position).min(share(error.yaw, slow.yaw, halt.yaw))
    }

    /// One tick: the phase follows the clock, the step that is planned follows the hands, the centre of
    /// mass follows the zero moment point's reference. Returns the references at the end of the tick.
    pub fn act(&self, state: &mut GaitState, inputs: &GaitInputs) -> GaitReference {
        let timing = &self.config.timing;
        state.clock = inputs.clock;
        state.phase = state.phase.next(&TransitionInputs {
            clock: inputs.clock,
            timing,
            feet: &state.feet,
            zmp_ref: state.zmp_ref,
            middle: self.middle(&footholds(state)),
            mirrored: self.config.mirrored,
        });
        let share = self.swing_share(&inputs.clock);
        let (duration, dt) = (self.seconds(timing.single_support), self.config.preview.control_period_s);
        let landed = state.phase.meet_ground(&self.config.swing, &inputs.foot_force, share, duration, dt);
        if let Some((side, foothold)) = landed {
            let foothold = foothold.on_plane_within(self.config.swing.plane_tolerance_m);
            // A leg sags, and its foot lands some tenths of a millimetre from where it was sent, step for step
            // on the same side: whoever believes that it stands where it was sent walks astray.
            let pose = inputs.soles.map_or(foothold.pose, |soles| soles[side]);
            state.feet[side] = Foothold { pose, ..foothold };
        }
        self.plan_step(state, inputs);
        state.stance = stance(&state.phase).unwrap_or(state.stance);

        let blend = dt / (self.config.load_filter_s + dt);
        state.load = state.load.filtered_towards(&inputs.load, blend);
        let reference = self.zmp_reference(state, inputs);
        let load = state.load;
        self.preview.advance(&mut state.preview, &reference.mapped(|zmp| load.extended_zmp(zmp)));
        state.zmp_ref = reference.at(1);
        self.reference(state)
    }

    /// The references at the end of the last tick, i.e. now.
    pub fn reference(&self, state: &GaitState) -> GaitReference {
        let share = self.swing_share(&state.clock);
        let duration = self.seconds(self.config.timing.single_support);
        let swinging = state.phase.swinging_foot();
        let feet = PerFoot::from_fn(|side| match swinging {
            Some(SwingingFoot { side: swinging, swing }) if swinging == side => {
                let (pose, twist) = swing.foot(&self.config.swing, share, duration);
                FootReference {
                    pose,
                    twist,
                    in_contact: matches!(swing.contact, SwingContact::Landed { .. }),
                }
            }
            _ => FootReference { pose: state.feet[side].in_world(), twist: Twist::zero(), in_contact: true },
        });
        let PreviewState { com, com_velocity, com_acceleration, .. } = state.preview;
        GaitReference {
            stance: state.stance,
            feet,
            com: com.push(self.config.preview.com_height_m),
            com_velocity: com_velocity.push(0.0),
            com_acceleration: com_acceleration.push(0.0),
            zmp: state.zmp_ref,
        }
    }

    /// Where the centre of mass rests that stays over the feet as they are \[m, world\].
    pub fn resting_com(&self, state: &GaitState) -> Vector2<f64> {
        let zmp = match state.phase {
            GaitPhase::Standing { zmp } => zmp,
            _ => self.middle(&footholds(state)),
        };
        state.load.extended_zmp(&zmp)
    }

    fn seconds(&self, ticks: u64) -> f64 {
        ticks as f64 * self.config.preview.control_period_s
    }

    /// Share of the swing at the end of the clock's tick; more than one when the swing is over.
    fn swing_share(&self, clock: &StepClock) -> f64 {
        let timing = &self.config.timing;
        let ticks = timing.single_support as f64;
        match *clock {
            StepClock::Stepping { step_index, tick_in_step, .. }
                if tick_in_step >= timing.lift_off(step_index) =>
            {
                (tick_in_step + 1 - timing.lift_off(step_index)) as f64 / ticks
            }
            _ => (ticks + 1.0) / ticks,
        }
    }

    /// The step that is planned but not begun follows the moving references.
    fn plan_step(&self, state: &mut GaitState, inputs: &GaitInputs) {
        let feet = footholds(state);
        let (Some(step), StepClock::Stepping { step_index, tick_in_step, .. }) =
            (state.phase.planned_step_mut(), inputs.clock)
        else {
            return;
        };
        let ticks = self.config.timing.step(step_index).saturating_sub(tick_in_step);
        if let (Some(placement), Some(centre)) = (&state.placement, &inputs.hand_centre) {
            step.to = self.foothold(placement, centre, &feet, step.side, ticks);
        }
    }

    /// The foothold of a step that lands in `ticks`.
    fn foothold(
        &self,
        placement: &FootPlacement,
        centre: &HandCentre,
        feet: &PerFoot<GroundPose>,
        swing: Side,
        ticks: u64,
    ) -> GroundPose {
        let aim = placement.reference_feet(&centre.after(self.seconds(ticks) + self.config.reference_lead_s));
        self.config.limits.foothold(swing, &feet[swing.opposite()], &aim[swing])
    }

    /// Where the zero moment point shall rest under a foot.
    fn zmp_under(&self, side: Side, foot: &GroundPose) -> Vector2<f64> {
        foot.point(&self.config.zmp_in_foot[side])
    }

    fn middle(&self, feet: &PerFoot<GroundPose>) -> Vector2<f64> {
        (self.zmp_under(Side::Right, &feet.right) + self.zmp_under(Side::Left, &feet.left)) / 2.0
    }

    /// The reference of the zero moment point over the horizon, from the step that goes on, the one
    /// that follows if the clock says so, and after that a stop: what isn't decided is farther ahead
    /// than the preview feels.
    fn zmp_reference(&self, state: &GaitState, inputs: &GaitInputs) -> ZmpReference {
        let timing = &self.config.timing;
        let feet = footholds(state);
        let shift_to = |reference: ZmpReference, start: i64, ticks: u64, point| {
            reference.shift(start, start + ticks as i64, point)
        };
        match (state.phase, inputs.clock) {
            (GaitPhase::Standing { zmp }, _) => ZmpReference::resting(zmp),
            (GaitPhase::Finishing { zmp_from, .. }, clock) => {
                let start =
                    if let StepClock::Finishing { tick } = clock { -(tick as i64) } else { -i64::MAX / 4 };
                shift_to(ZmpReference::resting(zmp_from), start, timing.double_support, self.middle(&feet))
            }
            (phase, StepClock::Stepping { step_index, tick_in_step, swing, will_continue }) => {
                let side = swing.mirrored(self.config.mirrored);
                let stance = side.opposite();
                let under_stance = self.zmp_under(stance, &feet[stance]);
                let step_start = -(tick_in_step as i64);
                let lift_off = step_start + timing.lift_off(step_index) as i64;
                let shift_ticks = if step_index == 0 { timing.first_shift } else { timing.double_support };
                let reference = match phase {
                    GaitPhase::ShiftingWeight { zmp_from, .. }
                    | GaitPhase::DoubleSupport { zmp_from, .. } => {
                        let resting = ZmpReference::resting(zmp_from);
                        shift_to(resting, lift_off - shift_ticks as i64, shift_ticks, under_stance)
                    }
                    _ => ZmpReference::resting(under_stance),
                };
                let landing = step_start + timing.step(step_index) as i64;
                let landed = after_step(feet, &phase);
                if !will_continue {
                    return shift_to(reference, landing, timing.double_support, self.middle(&landed));
                }
                let reference =
                    shift_to(reference, landing, timing.double_support, self.zmp_under(side, &landed[side]));
                let next_landing = landing + timing.step(step_index + 1) as i64;
                let mut stepped = landed;
                if let (Some(placement), Some(centre)) = (&state.placement, &inputs.hand_centre) {
                    stepped[stance] =
                        self.foothold(placement, centre, &landed, stance, next_landing.max(0) as u64);
                }
                shift_to(
                    reference,
                    next_landing,
                    timing.double_support,
                    self.zmp_under(stance, &stepped[stance]),
                )
            }
            (_, _) => ZmpReference::resting(state.zmp_ref),
        }
    }
}

/// The worst error (eq. 40) of both feet as a multiple of `threshold`.
fn relative_error(reference: &PerFoot<GroundPose>, feet: &PerFoot<GroundPose>, threshold: &FootError) -> f64 {
    let of = |side| FootError::between(&reference[side], &feet[side]).relative_to(threshold);
    of(Side::Right).max(of(Side::Left))
}

/// Where each foot stands, or will when it comes down.
fn footholds(state: &GaitState) -> PerFoot<GroundPose> {
    let mut feet = PerFoot::from_fn(|side| state.feet[side].pose);
    if let Some(SwingingFoot { side, swing }) = state.phase.swinging_foot() {
        feet[side] = match swing.contact {
            SwingContact::Swinging { .. } => swing.to.pose,
            SwingContact::Landed { at } | SwingContact::Lowering { at, .. } => at.pose,
        };
    }
    feet
}

/// The foot that stands while the other one swings, or will.
fn stance(phase: &GaitPhase) -> Option<Side> {
    let moving = match phase.swinging_foot() {
        Some(foot) => Some(foot.side),
        None => phase.planned_step().map(|step| step.side),
    };
    moving.map(Side::opposite)
}

/// Footholds after the step that is planned, if one is.
fn after_step(mut feet: PerFoot<GroundPose>, phase: &GaitPhase) -> PerFoot<GroundPose> {
    if let Some(step) = phase.planned_step() {
        feet[step.side] = step.to;
    }
    feet
}
