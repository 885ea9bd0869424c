//! One robot's gait: from the team's step clock and the hands' references to references of the feet and
//! of the centre of mass.

use super::expected_ground::ExpectedGround;
use super::foot_placement::{FootError, FootPlacement, HandCentre};
use super::ground_pose::{GroundPose, wrap};
use super::machine::{GaitPhase, SwingingFoot, TransitionInputs};
use super::preview::{PreviewConfig, PreviewControl, PreviewState, SolvePreviewError};
use super::settling::Settling;
use super::step_adjustment::{StepAdjustment, StepInHand};
use super::step_clock::{StepClock, StepTiming};
use super::step_planner::StepLimits;
use super::swing::{Foothold, SwingConfig, SwingContact};
use super::team_clock::StepWish;
use super::zmp_reference::ZmpReference;
use crate::balance::{ExternalLoad, GRAVITY_M_S2, PerFoot, Side};
use crate::estimate::{SoleRectangle, SupportPolygon};
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
    /// Whether steps change while they are made, for a robot that was pushed.
    pub adjusts_steps: bool,
    /// How long both feet stay on the ground for a sole that turns to it \[s\].
    pub settling_s: f64,
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
            adjusts_steps: true,
            settling_s: 0.4,
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
    /// What only a step can do about it.
    pub trouble: Trouble,
    /// Whether the foot that is to bear next has found its ground.
    pub settling: Settling,
    /// Where swings end.
    pub ground: ExpectedGround,
}

/// How a robot is off balance beyond what its soles can do about it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Trouble {
    /// What of its divergent component's error is left to steps \[m, world\]; zero where all is well.
    pub excess: Vector2<f64>,
    /// Whether its divergent component is past the edge of what it stands on.
    pub falls: bool,
    /// Whether the foot that is to swing next bears too much for the other one to be trusted: ground that gave way, or an edge.
    pub bears: bool,
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
    /// Heights of soles by the same; as planned when absent \[m\].
    pub sole_heights: Option<PerFoot<f64>>,
    /// The measured hands' load.
    pub load: ExternalLoad,
    /// The divergent component as measured \[m, world\]; as planned when absent.
    pub divergent_component: Option<Vector2<f64>>,
    /// Whether each sole stands on the edge of something and turns to find its ground.
    pub soles_turn: PerFoot<bool>,
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
    adjustment: StepAdjustment,
}

impl Gait {
    /// Solves for the preview gains.
    pub fn new(config: GaitConfig) -> Result<Self, SolvePreviewError> {
        let preview = PreviewControl::new(&config.preview)?;
        let adjustment = StepAdjustment::standard((GRAVITY_M_S2 / config.preview.com_height_m).sqrt());
        Ok(Self { preview, adjustment, config })
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
            trouble: Trouble::default(),
            settling: Settling::default(),
            ground: ExpectedGround::default(),
        }
    }

    /// What the robot tells the team, from the state after the last tick and the hands' references.
    ///
    /// All is judged by eq. 40 for both feet, against references as they will be at the NEXT landing.
    pub fn wish(&self, state: &GaitState, hand_centre: Option<&HandCentre>) -> StepWish {
        // Who is off balance on both feet stays there until he is not, if he is not falling.
        let is_in_trouble = state.trouble.excess != Vector2::zeros();
        let waits = is_in_trouble && !state.trouble.falls && state.clock != StepClock::Standing;
        let ready = state.phase.is_ready(&state.clock)
            && !(state.phase.planned_step().is_some() && (waits || state.trouble.bears))
            && !state.settling.waits(self.ticks(self.config.settling_s));
        let land_in_ticks = state.phase.swinging_foot().map_or(0, |foot| foot.swing.change.land_in_ticks);
        let content = StepWish { ready, land_in_ticks, ..StepWish::CONTENT };
        let (Some(placement), Some(centre)) = (&state.placement, hand_centre) else { return content };
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
            _ => return content,
        };
        let at_landing = placement.reference_feet(&centre.after(self.seconds(ticks)));
        let urgency = relative_error(&at_landing, &feet, &self.config.start);

        let mut stepped = feet;
        stepped[swing] = self.foothold(placement, centre, &feet, swing, ticks);
        // By the time of another first landing: who would want to walk again at once must not stop.
        let later = ticks + timing.finish() + timing.step(0);
        let at_restart = placement.reference_feet(&centre.after(self.seconds(later)));
        let stands = state.clock == StepClock::Standing;
        let falls = stands && state.trouble.falls && is_in_trouble;
        StepWish {
            wants_step: stands && (urgency > 1.0 || falls),
            can_stop: relative_error(&at_landing, &stepped, &self.config.stop) < 1.0
                && relative_error(&at_restart, &stepped, &self.config.start) < 1.0,
            ready,
            first_swing: if falls { self.catching_foot(state) } else { swing }.mirrored(self.config.mirrored),
            urgency: if falls { urgency.max(FALLING_URGENCY) } else { urgency },
            land_in_ticks: if falls { 1 } else { land_in_ticks },
        }
    }

    /// The share of its speed that the object may keep without leaving the robot behind (Fig. 10b): 1 up
    /// to the error `slow`, 0 from `halt` on, beside what a walk at that speed brings.
    pub fn speed_share(&self, state: &GaitState, hand_centre: Option<&HandCentre>) -> f64 {
        let (Some(placement), Some(centre)) = (&state.placement, hand_centre) else { return 1.0 };
        let (feet, reference) = (footholds(state), placement.reference_feet(&centre.pose));
        let middle = |feet: &PerFoot<GroundPose>| GroundPose {
            position: (feet.right.position + feet.left.position) / 2.0,
            yaw: wrap(feet.right.yaw + wrap(feet.left.yaw - feet.right.yaw) / 2.0),
        };
        let error = FootError::between(&middle(&reference), &middle(&feet));
        let GaitConfig { slow, halt, timing, .. } = &self.config;
        // Feet go in steps, and who walks as fast as the hands is half a step ahead of them or behind, in turn.
        let half_step_s = 0.5 * self.seconds(timing.step(1));
        let share = |error: f64, speed: f64, slow: f64, halt: f64| {
            ((halt + speed * half_step_s - error) / (halt - slow)).clamp(0.0, 1.0)
        };
        let position = share(error.position, centre.velocity.norm(), slow.position, halt.position);
        position.min(share(error.yaw, centre.yaw_rate.abs(), slow.yaw, halt.yaw))
    }

    /// One tick: the phase follows the clock, the step that is planned follows the hands, the centre of
    /// mass follows the zero moment point's reference. Returns the references at the end of the tick.
    pub fn act(&self, state: &mut GaitState, inputs: &GaitInputs) -> GaitReference {
        let timing = &self.config.timing;
        self.follow_hurry(state, &inputs.clock);
        state.clock = inputs.clock;
        state.phase = state.phase.next(&TransitionInputs {
            clock: inputs.clock,
            timing,
            feet: &state.feet,
            plane_m: state.ground.plane_m,
            zmp_ref: state.zmp_ref,
            middle: self.middle(&footholds(state)),
            mirrored: self.config.mirrored,
        });
        let share = self.swing_share(&inputs.clock);
        let (duration, dt) = (self.seconds(timing.single_support), self.config.preview.control_period_s);
        if self.config.adjusts_steps {
            self.adjust_step(state, inputs, share, duration);
        }
        let landed = state.phase.meet_ground(&self.config.swing, &inputs.foot_force, share, duration, dt);
        if let Some(foot) = state.phase.swinging_foot_mut() {
            foot.swing.advance(&self.config.swing, (1.0 - share) * duration, dt);
        }
        if let Some((side, foothold)) = landed {
            let tolerance_m = self.config.swing.plane_tolerance_m;
            let foothold = foothold.on_plane_within(state.ground.plane_m, tolerance_m);
            // A leg sags, and its foot lands some tenths of a millimetre from where it was sent, step for step
            // on the same side: whoever believes that it stands where it was sent walks astray.
            let pose = inputs.soles.map_or(foothold.pose, |soles| soles[side]);
            state.feet[side] = Foothold { pose, ..foothold };
            state.ground = state.ground.after_landing(&state.feet, tolerance_m);
        }
        state.settling = state.settling.after(&state.phase, &inputs.soles_turn);
        self.plan_step(state, inputs);
        state.stance = stance(&state.phase).unwrap_or(state.stance);

        let blend = dt / (self.config.load_filter_s + dt);
        state.load = state.load.filtered_towards(&inputs.load, blend);
        let reference = self.zmp_reference(state, inputs);
        let load = state.load;
        // Hands move on, and their load with them.
        let velocity = inputs.hand_centre.map_or_else(Vector2::zeros, |centre| centre.velocity);
        let (drift, horizon) = (load.drift(&(velocity * dt)), (self.config.preview.horizon_s / dt) as i64);
        let extended = reference.mapped(|zmp| load.extended_zmp(zmp)).with_drift(&drift, horizon);
        self.preview.advance(&mut state.preview, &extended);
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

    fn ticks(&self, seconds: f64) -> u64 {
        (seconds / self.config.preview.control_period_s).round() as u64
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

    /// A foot in the air whose clock leaves out ticks goes on from where it is, in the time that is left.
    fn follow_hurry(&self, state: &mut GaitState, clock: &StepClock) {
        let (
            StepClock::Stepping { step_index: before, tick_in_step: from, .. },
            StepClock::Stepping { step_index: now, tick_in_step: to, .. },
        ) = (state.clock, *clock)
        else {
            return;
        };
        let duration = self.seconds(self.config.timing.single_support);
        let share_before = self.swing_share(&state.clock);
        let seconds_left = (1.0 - self.swing_share(clock)) * duration;
        if let (true, Some(foot)) = (now == before && to > from + 1, state.phase.swinging_foot_mut()) {
            foot.swing.bend(&self.config.swing, share_before, duration);
            if let Some(bent) = &mut foot.swing.bent {
                bent.hurry(seconds_left);
            }
        }
    }

    /// Where the robot is off balance beyond what its soles can do about it, the swinging foot goes where that leads, and
    /// the plan with it.
    fn adjust_step(&self, state: &mut GaitState, inputs: &GaitInputs, share: f64, duration: f64) {
        let dt = self.config.preview.control_period_s;
        let omega = self.adjustment.frequency_1_s;
        let planned_dcm = state.preview.com + state.preview.com_velocity / omega;
        let measured_dcm = inputs.divergent_component.unwrap_or(planned_dcm);
        let swinging = state.phase.swinging_foot();
        let stance = swinging.map_or(state.stance, |foot| foot.side.opposite());
        let pose = state.feet[stance].pose;
        let GaitConfig { limits, zmp_in_foot, .. } = &self.config;
        let excess =
            self.adjustment.excess(&(measured_dcm - planned_dcm), &limits.soles, zmp_in_foot, stance, &pose);
        let falls = || {
            let standing = PerFoot::from_fn(|side| {
                let is_up = swinging.is_some_and(|foot| foot.side == side);
                (!is_up).then(|| state.feet[side].in_world())
            });
            let support = SupportPolygon::of_feet(&limits.soles, &standing);
            support.signed_distance(&state.load.ground_zmp(&measured_dcm)) < 0.0
        };
        let force = &inputs.foot_force;
        let bears = |foot: Side| force[foot] > MOST_BEFORE_SWING * (force.right + force.left);
        state.trouble = Trouble {
            excess,
            falls: excess != Vector2::zeros() && falls(),
            bears: inputs.divergent_component.is_some()
                && state.phase.planned_step().is_some_and(|step| bears(step.side)),
        };

        if inputs.divergent_component.is_some() {
            self.lower_stance(state, inputs, dt);
        }
        let pivot = state.load.extended_zmp(&self.zmp_under(stance, &pose));
        let GaitPhase::SingleSupport { foot: SwingingFoot { side, swing }, .. } = &mut state.phase else {
            return;
        };
        swing.change.land_in_ticks = 0;
        if !matches!(swing.contact, SwingContact::Swinging { .. }) {
            return;
        }
        let step = StepInHand {
            swing: *side,
            stance: pose,
            pivot,
            planned: GroundPose { position: swing.to.pose.position - swing.change.moved, ..swing.to.pose },
            offset: swing.change.offset,
            seconds_left: (1.0 - share) * duration + dt,
            planned_dcm,
        };
        let Some(adjusted) = self.adjustment.adjust(&step, &excess, limits, dt) else { return };
        swing.bend(&self.config.swing, share - dt / duration, duration);
        swing.to.pose = adjusted.to;
        swing.change.moved = adjusted.to.position - step.planned.position;
        swing.change.offset = Some(adjusted.offset);
        if adjusted.land_in_s < step.seconds_left - HURRY_WORTH_S {
            swing.change.land_in_ticks = (adjusted.land_in_s / dt).round().max(1.0) as u64;
        }
        state.preview.com_velocity += adjusted.take_over * omega;
    }

    /// Weight that is to go to a foot and does not come finds the ground lower than it was felt to be: at the edge of
    /// something, under a sole that turns, or soft.
    fn lower_stance(&self, state: &mut GaitState, inputs: &GaitInputs, dt: f64) {
        let GaitPhase::DoubleSupport { step, landing: None, .. } = state.phase else { return };
        let stance = step.side.opposite();
        let [from, to] = [step.side, stance].map(|side| self.zmp_under(side, &state.feet[side].pose));
        let way = to - from;
        let wanted = ((state.zmp_ref - from).dot(&way) / way.norm_squared().max(1e-9)).clamp(0.0, 1.0);
        let force = &inputs.foot_force;
        let comes = force[stance] / (force.right + force.left).max(1.0);
        let swing = &self.config.swing;
        let height = &mut state.feet[stance].height;
        if let Some(heights) = &inputs.sole_heights {
            // What a foot does that comes to bear, the other one sees.
            let off = heights[stance] - *height;
            *height += (off - off.clamp(-SETTLED_M, SETTLED_M)) * (dt / SETTLE_S).min(1.0);
        }
        if wanted - comes > MISSING_SHARE && *height > state.ground.plane_m - swing.lowering_max_m {
            *height -= swing.reaching_m_s * dt;
        }
    }

    /// The foot that had better swing first where a robot that stands is about to fall: the one on whose side it falls, if
    /// it falls aside; else the one that bears less.
    fn catching_foot(&self, state: &GaitState) -> Side {
        let middle = (state.feet.right.pose.position + state.feet.left.pose.position) / 2.0;
        let to_left = state.feet.left.pose.position - middle;
        let off = state.preview.com + state.trouble.excess - middle;
        if off.dot(&to_left) > 0.0 { Side::Right } else { Side::Left }
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

/// What a robot that falls says of how urgent its step is.
const FALLING_URGENCY: f64 = 100.0;
/// Share of the robot's weight on a foot that may leave the ground.
const MOST_BEFORE_SWING: f64 = 0.4;
/// By how much a sole's height is not worth a correction once it has landed \[m\], and the correction's time constant \[s\].
const SETTLED_M: f64 = 0.002;
const SETTLE_S: f64 = 0.05;
/// Share of the weight that has not come to a foot whose ground is lower than it was felt to be.
const MISSING_SHARE: f64 = 0.35;
/// A landing that is sooner by less is not worth the others' hurry \[s\].
const HURRY_WORTH_S: f64 = 0.02;

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
