//! One tick of the team's controller. No allocation, no clock, no I/O, no panic path.

use crate::build::{BuildCoordinatorError, build_hybrid_law, build_resting_law, virtual_sticks};
use crate::grasp::GraspCompliance;
use crate::grips::{self, GripState, Grips};
use crate::job::{Job, Phase, PhaseWords, Seen};
use crate::leading::{Leading, LeadingState};
use crate::load::{Holding, Load, LoadScratch, LoadState};
use crate::membership::{self, Change, MembershipState, Memberships};
use crate::object_motion::{ObjectMotion, ObjectMotionState};
use crate::odometry::{self, OdometryFrames, OdometryState};
use crate::operator::{Operator, OperatorState};
use crate::reference::References;
use crate::safety::{Safety, SafetyState};
use crate::step_clock::{TeamClockState, Wishes, step_timing};
use crate::tips::Tip;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::RunSpec;
use mikoshi_cooperation::{
    Control, Formation, Gap, GeneralizedForce, GeneralizedPosition, HandInput, HandReference, HybridInputs,
    HybridLaw, HybridOutput, HybridReference, HybridScratch, HybridState, VirtualStick,
};
use mikoshi_humanoid::gait::StepTiming;
use mikoshi_ipc_types::{
    Drive, MAX_HANDS, MAX_HANDS_OF_TEAM, MAX_ROBOTS, OperatorInput, RobotState, TeamCommand, TeamState,
    all_hands, mode, operator, stop_cause,
};
use mikoshi_spatial::{Hand, Object, Odometry, Pose, Twist, World, Wrench};
use nalgebra::{UnitQuaternion, Vector3};

/// How near its place on the object a hand must be, by its robot's word, to be closed.
const REACH_M: f64 = 0.01;
/// The same about an axis.
const REACH_RAD: f64 = 0.05;

/// The team's controller. Immutable.
#[derive(Clone, Debug)]
pub struct Coordinator {
    law: HybridLaw,
    /// While the object rests on something.
    resting_law: HybridLaw,
    references: References,
    compliance: GraspCompliance,
    grips: Grips,
    odometry: OdometryFrames,
    /// Whether the team presses the object against something: an axis of it is under force control.
    presses: bool,
    /// One robot leads; absent where the team is coordinated by symmetry.
    leading: Option<Leading>,
    load: Load,
    memberships: Memberships,
    motion: ObjectMotion,
    timing: StepTiming,
    job: Job,
    operator: Operator,
    safety: Safety,
    /// When the object is first asked to move, by the job's clock of the motion; it never is when absent.
    motion_start_tick: Option<u64>,
    hands_of_robots: Vec<usize>,
    sticks: Vec<VirtualStick>,
    /// Where the object is in the beginning.
    X_WA_start: Pose<World, Object>,
}

/// Of [`CoordinatorState`]'s layout: another one gets another number, so that no coordinator goes on from a
/// state that it would misread.
pub(crate) const STATE_VERSION: u64 = 9;

/// All that matters between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoordinatorState {
    hybrid: HybridState<MAX_HANDS_OF_TEAM>,
    /// The object's reference, from where the virtual sticks saw it when the hybrid law started.
    motion: ObjectMotionState,
    clock: TeamClockState,
    /// Where each robot has the world.
    odometry: OdometryState,
    /// Where one robot leads.
    leading: LeadingState,
    /// What each hand applies to the object, filtered.
    hand_wrench: [[f64; 6]; MAX_HANDS_OF_TEAM],
    /// Generalized force when the law started, row by row.
    force_at_start: [[f64; 6]; MAX_HANDS_OF_TEAM],
    /// How far the object's reference was off when the team was last formed, so that its error went on.
    off_at_start: [f64; 6],
    /// The tick in which it started, or in which another one took its place.
    hybrid_since: u64,
    /// The tick since which it controls forces for the hands that it does.
    formed_since: u64,
    /// Of the references of forces that are in force.
    references: u64,
    /// Which hands hold the object.
    grips: GripState,
    phase: PhaseWords,
    safety: SafetyState,
    operator: OperatorState,
    /// What was heard of the operator before this tick.
    heard_word: u64,
    /// The same of whoever drives.
    heard_drive: Drive,
    /// What is carried.
    load: LoadState,
    /// Who is away, or on his way.
    memberships: MembershipState,
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for CoordinatorState {}
// SAFETY: `repr(C)` over Pod fields of 8-byte units and alignment only: no padding, any bit pattern valid.
unsafe impl Pod for CoordinatorState {}

/// Workspaces: filled with NaN between ticks they change nothing.
#[derive(Clone, Debug)]
pub struct CoordinatorScratch {
    team: TeamScratch,
    law_output: HybridOutput,
    hands: Vec<HandInput>,
    force_ref: GeneralizedForce,
    position_ref: GeneralizedPosition,
    load: LoadScratch,
}

/// Of what is found anew in every tick of the team as it is formed.
#[derive(Clone, Debug)]
struct TeamScratch {
    law: HybridScratch,
    formation: Formation,
    /// What each hand applies to the object, filtered.
    hand_wrench: Vec<[f64; 6]>,
    /// Where each hand has the object.
    tips: Vec<Option<Tip>>,
    gaps: Vec<Option<Gap>>,
}

/// What a tick has found.
struct Now<'a> {
    tick: u64,
    law: &'a HybridOutput,
    hands: &'a [HandInput],
    /// The object touches nothing but hands.
    is_free: bool,
}

/// What a tick says: a command for each robot, and the team's view for observers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoordinatorOutputs {
    /// By robot.
    pub commands: [TeamCommand; MAX_ROBOTS],
    /// For observers.
    pub team_state: TeamState,
}

/// Why a tick could not be computed. The state is as it was.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{}", self.text())]
#[allow(missing_docs)]
pub enum CoordinateError {
    HandPose,
    State,
    Law,
}

impl CoordinateError {
    /// In words that a tick can pass on: without allocation.
    pub fn text(self) -> &'static str {
        match self {
            Self::HandPose => "a hand's pose is not a pose",
            Self::State => "the state holds a value that no tick leaves",
            Self::Law => "the hybrid law rejects its inputs",
        }
    }
}

impl Coordinator {
    /// For this run.
    ///
    /// # Errors
    /// The scenario's hybrid law or its grasp can't be built; the error says which key.
    pub fn new(run: &RunSpec) -> Result<Self, BuildCoordinatorError> {
        let law = build_hybrid_law(run)?;
        let references = References::new(&run.scenario, law.internal_forces())?;
        let scenario = &run.scenario;
        let object_row = law.parameters().selection.rows().first();
        Ok(Self {
            presses: object_row.is_some_and(|row| row.contains(&Control::Force)),
            odometry: OdometryFrames::new(scenario, &law)?,
            operator: Operator::new(scenario, &law)?,
            law,
            resting_law: build_resting_law(run)?,
            references,
            compliance: GraspCompliance::new(scenario),
            grips: Grips::new(scenario, hands_of_robots(run)),
            leading: Leading::new(run)?,
            load: Load::new(scenario, hands_of_robots(run)),
            memberships: Memberships::new(scenario, hands_of_robots(run)),
            motion: ObjectMotion::new(run),
            timing: step_timing(scenario),
            motion_start_tick: scenario.motion.as_ref().map(|motion| scenario.tick_at(motion.start_s)),
            job: Job::new(scenario),
            safety: Safety::new(scenario),
            hands_of_robots: hands_of_robots(run),
            sticks: virtual_sticks(run)?,
            X_WA_start: Pose::new(
                Vector3::from(scenario.object.position_m),
                UnitQuaternion::from_axis_angle(&Vector3::z_axis(), scenario.object.yaw_deg.to_radians()),
            ),
        })
    }

    /// The state at the grasp.
    ///
    /// # Errors
    /// More hands grasp than a team may have.
    pub fn initial_state(&self) -> Result<CoordinatorState, BuildCoordinatorError> {
        let memberships = self.memberships.initial_state();
        let mut hybrid = HybridState::at_grasp(&self.sticks)?;
        for robot in (0..self.hands_of_robots.len()).filter(|&robot| memberships.is_led(robot)) {
            let away = self.memberships.hands(robot);
            let hands = hybrid.is_absent.iter_mut().enumerate();
            hands.for_each(|(arm, is_absent)| *is_absent |= away >> arm & 1);
        }
        Ok(CoordinatorState {
            hybrid,
            motion: ObjectMotionState::at_rest(&Pose::identity()),
            clock: TeamClockState::default(),
            odometry: OdometryState::default(),
            leading: LeadingState::at_start(None, &Pose::identity(), &[]),
            hand_wrench: [[0.0; 6]; MAX_HANDS_OF_TEAM],
            force_at_start: [[0.0; 6]; MAX_HANDS_OF_TEAM],
            off_at_start: [0.0; 6],
            hybrid_since: 0,
            formed_since: 0,
            references: self.references.fingerprint(),
            grips: GripState::zeroed(),
            phase: Phase::default().to_words(),
            safety: SafetyState::default(),
            operator: OperatorState::default(),
            heard_word: 0,
            heard_drive: Drive::default(),
            load: LoadState::zeroed(),
            memberships,
        })
    }

    /// Grasping hands of each robot.
    pub(crate) fn hands_of_robots(&self) -> &[usize] {
        &self.hands_of_robots
    }

    /// Workspaces of its size.
    pub fn scratch(&self) -> CoordinatorScratch {
        let arms = self.law.arms();
        CoordinatorScratch {
            team: TeamScratch {
                law: self.law.scratch(),
                formation: self.law.internal_forces().whole().clone(),
                hand_wrench: vec![[0.0; 6]; arms],
                tips: vec![None; arms],
                gaps: vec![None; arms],
            },
            law_output: self.law.output(),
            hands: Vec::with_capacity(arms),
            force_ref: GeneralizedForce::zero(arms),
            position_ref: GeneralizedPosition::at_grasp(Pose::identity(), arms),
            load: LoadScratch::new(arms, self.law.internal_forces().work_len()),
        }
    }

    /// One tick: h_c and z_c from the robots' hands, the hybrid law if it has started, a command for each
    /// robot. On an error, state and outputs are as they were.
    pub fn tick<'a>(
        &self,
        tick: u64,
        state: &mut CoordinatorState,
        scratch: &mut CoordinatorScratch,
        robots: impl Iterator<Item = &'a RobotState> + Clone,
        out: &mut CoordinatorOutputs,
    ) -> Result<(), CoordinateError> {
        let CoordinatorScratch { team, law_output, hands, force_ref, position_ref, load: load_scratch } =
            scratch;
        self.law.form(&state.hybrid, &mut team.formation).map_err(|_| CoordinateError::State)?;
        let present = self.grips.present(&state.hybrid);
        let X_WO = state.odometry.frames(self.hands_of_robots.len()).ok_or(CoordinateError::State)?;
        read_hands(robots.clone(), &self.hands_of_robots, &X_WO, hands)?;
        let in_step = robots.clone().enumerate();
        let in_step = in_step.filter(|(robot, _)| state.memberships.own_clock(*robot).is_none());
        let wishes = Wishes::of(in_step.map(|(_, robot)| robot));

        let phase = Phase::from_words(state.phase).ok_or(CoordinateError::State)?;
        let (mut safety, mut operator) = (state.safety, state.operator);
        let of_team = robots.clone().zip(present);
        let carries = mode::is_hybrid(phase.mode());
        let says = self.operator.listen(&mut operator, &state.heard_of_operator(), tick);
        self.safety.look(&mut safety, of_team, state.clock.is_standing(), says);
        let is_stopped = safety.is_stopped();
        if is_stopped {
            self.operator.rest(&mut operator);
        }
        let is_free = self.job.is_in_the_air(&phase) && !self.presses;
        let grasp_yield = self.grasp_yield(state, team, hands, is_free)?;
        // Control ends with the first tick of doubt, and starts again after the last.
        let is_blind = safety.is_blind() || state.safety.is_blind();
        let is_hybrid = carries && !is_blind;
        let motion_ticks = self.job.motion_ticks(&phase, tick);
        // Whoever drives does so from the beginning.
        let motion_start_tick = if self.operator.is_driven() { Some(0) } else { self.motion_start_tick };
        let is_moving = motion_ticks.zip(motion_start_tick).is_some_and(|(ticks, start)| ticks >= start);
        let may_move = is_moving && !is_stopped && !state.memberships.object_rests();
        let speed_share = if may_move { wishes.speed_share } else { 0.0 };
        // State changes only when nothing can fail any more.
        let mut motion = state.motion;
        let X_WA_ref = match self.job.object_step_m(&phase, tick) {
            Some(_) if is_stopped => self.motion.lift(&mut motion, 0.0),
            Some(step_m) => self.motion.lift(&mut motion, step_m),
            // What the paper compares with, a leader, does not wait for anybody's feet.
            None => {
                let feet_follow = self.leading.is_some() || state.clock.has_landed();
                let X_WA = Pose::from_array(&motion.pose).ok_or(CoordinateError::State)?;
                match self.operator.wanted(&operator, tick, &X_WA) {
                    Some(wanted) => self.motion.follow(&mut motion, &(wanted * speed_share), feet_follow),
                    None => self.motion.advance(&mut motion, speed_share, feet_follow),
                }
            }
        };
        let X_WA_ref = X_WA_ref.ok_or(CoordinateError::State)?;
        let may_walk = phase.mode() == mode::CARRY;
        let clock = state.clock.advance(&self.timing, &wishes, may_walk).ok_or(CoordinateError::State)?;

        if state.references != self.references.fingerprint() {
            // They were set to others: those begin with what is there (ADR 0010), too.
            let since = tick.saturating_sub(state.formed_since);
            state.off_at_start = self.references.off_after(since, &state.off_at_start).to_array();
            state.force_at_start = state.hybrid.filtered_force;
            (state.references, state.formed_since) = (self.references.fingerprint(), tick);
            operator.squeeze_n = 0.0;
        }
        let since_start = [state.hybrid_since, state.formed_since].map(|since| tick.saturating_sub(since));
        let start = (&state.force_at_start[..], &state.off_at_start);
        self.references.fill(since_start, &X_WA_ref, start, force_ref, position_ref);
        self.operator.squeeze(&mut operator, tick, !is_hybrid || phase.is_resting());
        self.operator.add_squeeze(&operator, force_ref);
        let mut load = state.load;
        let weights = self.memberships.weights(&state.memberships);
        let holding = Holding {
            forces: self.law.internal_forces().among(&team.formation),
            hands,
            sticks: &state.hybrid.sticks,
            weights: &weights,
        };
        let in_force = self.references.share_in_force(since_start[1]);
        let bearers = robots.clone().zip(&X_WO);
        self.load.share(&mut load, load_scratch, &X_WA_ref, &holding, bearers, (force_ref, in_force));
        // A leader's team has no hybrid law: hands are where leader and followers have them.
        let is_led = is_hybrid && self.leading.is_some();
        let reference = (is_hybrid && !is_led).then_some(HybridReference {
            force: force_ref,
            position: position_ref,
            object_twist: motion.twist(),
        });
        let inputs = HybridInputs { hands, grasp_yield, reference };
        let law = if phase.is_resting() { &self.resting_law } else { &self.law };
        law.act(&mut state.hybrid, &mut team.law, &inputs, law_output).map_err(|_| CoordinateError::Law)?;
        if let Some(leading) = self.leading.as_ref().filter(|_| is_led) {
            let object = (&X_WA_ref, &motion.twist());
            leading
                .act(&mut state.leading, object, hands, &mut law_output.hands)
                .and_then(|()| leading.advance_clocks(&mut state.leading, &self.timing, &wishes))
                .ok_or(CoordinateError::State)?;
        }
        if is_blind && carries {
            carry_hands(state, &mut law_output.hands, &X_WA_ref);
        }
        let holding = Holding {
            forces: self.law.internal_forces().among(&team.formation),
            hands,
            sticks: &state.hybrid.sticks,
            weights: &weights,
        };
        self.load.look(&mut load, &law_output.position.external, &holding, is_free && !is_blind);
        state.load = load;
        (state.motion, state.clock, state.safety, state.operator) = (motion, clock, safety, operator);
        state.hand_wrench.iter_mut().zip(&team.hand_wrench).for_each(|(kept, wrench)| *kept = *wrench);
        let hand_step_m = if is_stopped { 0.0 } else { self.job.hand_step_m(&phase, tick) };
        move_open_hands(state, &mut law_output.hands, hand_step_m);
        let in_team = membership::Team {
            tick,
            phase: &phase,
            X_WA_ref: &X_WA_ref,
            rests: motion.twist == [0.0; 6] && clock.is_standing() && wishes.are_content(),
            clock_stands: clock.is_standing(),
        };
        let references = (&mut law_output.hands[..], &mut state.hybrid.hand_pose_ref[..]);
        self.memberships
            .lead(&mut state.memberships, &in_team, robots.clone(), is_stopped || is_blind, references)
            .and_then(|()| self.memberships.step(&mut state.memberships, &self.timing, robots.clone()))
            .ok_or(CoordinateError::State)?;

        self.write_commands(tick, state, &phase, &X_WO, law_output, out);
        let reference = is_hybrid.then_some((&*force_ref, &*position_ref));
        write_team_state(state, &phase, law_output, reference, out);
        out.team_state.odometry_pose = X_WO.map(|X_WO| X_WO.to_array());
        out.team_state.speed_share = speed_share;
        state.memberships.write(|robot| self.memberships.hands(robot), &mut out.team_state);
        state.load.write(&mut out.team_state);
        out.team_state.drive_silent_ticks = self.operator.silent_ticks(&state.operator, tick);
        out.team_state.awaited_word = self.job.awaited(&phase);
        if is_hybrid && !is_led {
            Tip::fill(&mut team.tips, &state.hybrid, &team.law, &law_output.position.external);
            if !state.clock.is_standing() {
                self.correct_odometry(state, team);
            }
        }
        if carries && !is_blind {
            let now = Now { tick, law: law_output, hands, is_free };
            self.watch_grips(state, team, &now, robots.clone(), &mut out.team_state.hand_slip)?;
            if !is_stopped {
                self.go_on_leaving_and_joining(state, team, &now, &in_team, robots.clone())?;
            }
        }

        if is_blind && !safety.is_blind() && carries {
            let X_WA = &law_output.position.external;
            let path_time_s = state.motion.path_time_s;
            state.motion = ObjectMotionState { path_time_s, ..ObjectMotionState::at_rest(X_WA) };
            self.start_law(state, tick + 1, hands, &grasp_yield, X_WA, law_output);
        }
        if is_stopped || is_blind {
            state.phase = phase.delayed().to_words();
            state.memberships.delay();
            return Ok(());
        }
        let seen = self.look(state, hands, robots, &present, &wishes, law_output);
        // Where the others carry on without a hand, letting go is no failure.
        let all_hold = seen.all_hold || carries && self.grips.carries_on;
        let next = self.job.next(phase, tick + 1, &Seen { all_hold, ..seen });
        if next != phase {
            if self.job.awaited(&phase) == state.operator.asked {
                state.operator.asked = 0;
            }
            // Whatever a phase moves comes to rest in its end.
            state.motion.twist = [0.0; 6];
            state.phase = next.to_words();
            if mode::is_hybrid(next.mode()) && !is_hybrid {
                // Control starts where the object is, not where it should be: nothing jumps.
                let X_WA = &law_output.position.external;
                state.motion = ObjectMotionState::at_rest(X_WA);
                state.leading = LeadingState::at_start(self.leading.as_ref(), X_WA, hands);
                self.start_law(state, tick + 1, hands, &grasp_yield, X_WA, law_output);
            } else if is_hybrid && next.is_resting() != phase.is_resting() {
                self.start_law(state, tick + 1, hands, &grasp_yield, &X_WA_ref, law_output);
            }
            if next.mode() == mode::CARRY {
                self.operator.begin(&mut state.operator, &state.motion.pose);
            }
        }
        Ok(())
    }

    /// The team steps with the object in its hands, which tells how far robots' odometries have parted.
    fn correct_odometry(&self, state: &mut CoordinatorState, team: &TeamScratch) {
        let seen = odometry::Seen {
            tips: &team.tips,
            hand_wrench: &state.hand_wrench,
            shares: team.formation.w_inverse(),
            hands_of_robots: &self.hands_of_robots,
            compliance: &self.compliance,
        };
        self.odometry.correct(&mut state.odometry, &mut state.hybrid, &seen);
    }

    /// Whether all hands that take part still hold; who doesn't is left out from the next tick on.
    fn watch_grips<'a>(
        &self,
        state: &mut CoordinatorState,
        team: &mut TeamScratch,
        now: &Now<'_>,
        robots: impl Iterator<Item = &'a RobotState>,
        hand_slip: &mut [f64; MAX_HANDS_OF_TEAM],
    ) -> Result<(), CoordinateError> {
        let CoordinatorState { grips, hybrid, hand_wrench, .. } = state;
        let is_led = self.leading.is_some();
        // A leader's followers are not where the law would have them.
        if !is_led {
            let seen = grips::Seen { X_WA: &now.law.position.external, hands: now.hands, hand_wrench };
            self.grips.find_gaps(grips, &team.tips, &seen, &mut team.gaps);
            self.grips.find_slips(&team.gaps, hand_slip);
        }
        let Some(loss) = self.grips.find_loss(grips, hybrid, hand_slip, robots) else { return Ok(()) };
        grips.loss_cause = loss.cause;
        let are_too_few = self.grips.are_too_few(hybrid, loss.hands);
        let is_formed = !is_led && self.do_without(state, team, now, loss.hands)?;
        let is_blind = !is_led && !is_formed;
        if are_too_few {
            state.safety.stop(stop_cause::TOO_FEW_HANDS, loss.robot, is_blind);
        } else if !is_formed || !self.grips.carries_on {
            state.safety.stop(loss.cause, loss.robot, is_blind);
        }
        Ok(())
    }

    /// Robots leave and join.
    fn go_on_leaving_and_joining<'a>(
        &self,
        state: &mut CoordinatorState,
        team: &mut TeamScratch,
        now: &Now<'_>,
        in_team: &membership::Team<'_>,
        robots: impl Iterator<Item = &'a RobotState>,
    ) -> Result<(), CoordinateError> {
        for (robot, said) in robots.enumerate().filter(|(robot, _)| self.memberships.concerns(*robot)) {
            let seen = self.look_at_member(state, now, robot, said);
            let clock = state.clock;
            let change = self.memberships.next(&mut state.memberships, robot, in_team, &seen, &clock);
            let absent = grips::absent(&state.hybrid);
            let hands = self.memberships.hands(robot);
            match change {
                None => {}
                Some(Change::Leaves(_)) if self.form_for(state, team, now, absent | hands)? => {
                    let references = &now.law.hands;
                    self.memberships.let_go(&mut state.memberships, robot, in_team.X_WA_ref, references);
                }
                Some(Change::Joins(_)) if self.form_for(state, team, now, absent & !hands)? => {}
                Some(Change::Leaves(_)) => self.memberships.stay(&mut state.memberships, robot),
                Some(Change::Joins(_) | Change::Stuck(_)) => {
                    state.safety.stop(stop_cause::GRASP, robot, false);
                }
            }
        }
        Ok(())
    }

    /// What decides how a robot goes on leaving or joining.
    fn look_at_member(
        &self,
        state: &CoordinatorState,
        now: &Now<'_>,
        robot: usize,
        said: &RobotState,
    ) -> membership::Seen {
        let wish = Wishes::of(core::iter::once(said));
        let clock = state.memberships.own_clock(robot).unwrap_or(&state.clock);
        let count = self.hands_of_robots.get(robot).copied().unwrap_or(0);
        let hands = self.memberships.hands(robot);
        let mut seen = membership::Seen {
            stands: clock.is_standing() && wish.are_content(),
            in_reach: true,
            all_hold: grips::all_hold(said, all_hands(count)),
            none_holds: said.holding_hands & all_hands(count) == 0,
            is_spare: !self.grips.are_too_few(&state.hybrid, hands),
            ..membership::Seen::default()
        };
        let arms = now.hands.iter().zip(&state.hand_wrench).enumerate();
        for (hand, (_, (input, wrench))) in arms.filter(|(arm, _)| hands >> arm & 1 != 0).enumerate() {
            let wrench = Wrench::<World>::from_array(wrench);
            seen.force_n = seen.force_n.max(wrench.force.norm());
            seen.moment_nm = seen.moment_nm.max(wrench.moment.norm());
            let place = self.memberships.place(&state.memberships, (robot, hand), &now.law.position.external);
            seen.in_reach &= place.is_some_and(|place| is_in_reach(&input.pose, &place));
        }
        seen
    }

    /// Forms the team anew without the lost hands, from the next tick on; false if it can't be.
    fn do_without(
        &self,
        state: &mut CoordinatorState,
        team: &mut TeamScratch,
        now: &Now<'_>,
        lost: u64,
    ) -> Result<bool, CoordinateError> {
        let gone = grips::absent(&state.hybrid) | lost;
        if self.law.internal_forces().form(|arm| gone & 1 << arm == 0, &mut team.formation).is_err() {
            return Ok(false);
        }
        // Those who stay are seen off their grips by what the lost have brought into the mean: Σa is where they have it.
        let mut off = gaps_of(team);
        let mut mean = Twist::zero();
        for (off, share) in off.iter().zip(team.formation.w_inverse()) {
            mean += *off * *share;
        }
        off.iter_mut().for_each(|off| *off = *off - mean);
        self.form_anew(state, team, now, gone, (&off, &mean))
    }

    /// Forms the team anew for all hands but those that are `gone`, from the next tick on; false if it can't be. Nobody has
    /// lost anything: Σa is where all have it.
    fn form_for(
        &self,
        state: &mut CoordinatorState,
        team: &mut TeamScratch,
        now: &Now<'_>,
        gone: u64,
    ) -> Result<bool, CoordinateError> {
        if self.law.internal_forces().form(|arm| gone & 1 << arm == 0, &mut team.formation).is_err() {
            return Ok(false);
        }
        let off = gaps_of(team);
        self.form_anew(state, team, now, gone, (&off, &Twist::zero()))
    }

    /// The same with Σa displaced by `mean`, from which hands are off their grips by `off`. The formation is made already.
    fn form_anew(
        &self,
        state: &mut CoordinatorState,
        team: &mut TeamScratch,
        now: &Now<'_>,
        gone: u64,
        (off, mean): (&[Twist<World>; MAX_HANDS_OF_TEAM], &Twist<World>),
    ) -> Result<bool, CoordinateError> {
        let stays = |arm: usize| gone & 1 << arm == 0;
        let came = grips::absent(&state.hybrid) & !gone;
        let X_WA = now.law.position.external.displaced(mean);
        let grasp_yield = self.grasp_yield(state, team, now.hands, now.is_free)?;
        let X_WB = X_WA.displaced(&-grasp_yield);
        if self.law.reform(&mut state.hybrid, &mut team.law, &X_WB, now.hands, stays).is_err() {
            return Ok(false);
        }
        let seen = grips::Seen { X_WA: &X_WA, hands: now.hands, hand_wrench: &state.hand_wrench };
        self.grips.take_in(&mut state.grips, came, &seen);
        self.grips.remember(&mut state.grips, &state.hybrid, &seen, off);
        // References begin with what is there (ADR 0010), and the object's with the error that there was.
        state.force_at_start = state.hybrid.filtered_force;
        let since = now.tick.saturating_sub(state.formed_since);
        state.off_at_start = (self.references.off_after(since, &state.off_at_start) + *mean).to_array();
        state.formed_since = now.tick + 1;
        state.operator.squeeze_n = 0.0;
        Ok(true)
    }

    /// A law starts at `tick`, with the object's frame at `X_WA`: references of forces begin with what is there,
    /// and the virtual sticks are created anew from the hands as they are now (section 4.3, step 2). Whatever the
    /// grasps have done since the hands closed, all tips now coincide with Σa, which stays fixed to the object, and all
    /// who take part are in their grips.
    fn start_law(
        &self,
        state: &mut CoordinatorState,
        tick: u64,
        hands: &[HandInput],
        grasp_yield: &Twist<World>,
        X_WA: &Pose<World, Object>,
        law: &HybridOutput,
    ) {
        // Where they coincide if nothing yields: what yields is added to their mean in every tick.
        let X_WB = X_WA.displaced(&-*grasp_yield);
        for (slot, hand) in state.hybrid.sticks.iter_mut().zip(hands) {
            *slot = VirtualStick::at_grasp(&hand.pose, &X_WB).X_HB.to_array();
        }
        (state.hybrid_since, state.formed_since, state.off_at_start) = (tick, tick, [0.0; 6]);
        state.operator.squeeze_n = 0.0;
        write_force(&law.force, &mut state.force_at_start);
        let seen = grips::Seen { X_WA, hands, hand_wrench: &state.hand_wrench };
        self.grips.begin(&mut state.grips, &state.hybrid, &seen);
    }

    /// What decides how the job goes on.
    fn look<'a>(
        &self,
        state: &CoordinatorState,
        hands: &[HandInput],
        robots: impl Iterator<Item = &'a RobotState> + Clone,
        present: &[u64; MAX_ROBOTS],
        wishes: &Wishes,
        law: &HybridOutput,
    ) -> Seen {
        let is_in_reach = |(hand, stick): (&HandInput, &VirtualStick)| {
            // At the grasp the stick's tip coincides with the object's frame.
            is_in_reach(&hand.pose, &(self.X_WA_start * stick.X_HB.inverse().relabel::<Object, Hand>()))
        };
        let mut holding = robots.clone().zip(present);
        Seen {
            in_reach: hands.iter().zip(&self.sticks).all(is_in_reach),
            all_hold: holding.all(|(robot, &present)| grips::all_hold(robot, present)),
            none_holds: robots.clone().all(|robot| robot.holding_hands == 0),
            motion_is_over: state.memberships.is_settled()
                && match self.operator.is_driven() {
                    true => state.operator.asked == operator::LOWER && state.motion.twist == [0.0; 6],
                    false => self.motion.is_over(&state.motion),
                },
            team_stands: state.clock.is_standing() && wishes.are_content(),
            carried_n: law.force.external.force.z,
            applied_n: law.force.external.force.norm(),
            asked: state.operator.asked,
            is_strained: state.safety.is_strained(),
        }
    }

    /// How far the object is from where rigid grasps would have it, and in `team` the filtered wrenches that say so.
    fn grasp_yield(
        &self,
        state: &CoordinatorState,
        team: &mut TeamScratch,
        hands: &[HandInput],
        is_free: bool,
    ) -> Result<Twist<World>, CoordinateError> {
        let mut levers = [Vector3::zeros(); MAX_HANDS_OF_TEAM];
        for (arm, (lever, hand)) in levers.iter_mut().zip(hands).enumerate() {
            *lever = state.hybrid.stick(arm).ok_or(CoordinateError::State)?.vector(&hand.pose);
        }
        let TeamScratch { formation, hand_wrench, .. } = team;
        hand_wrench.iter_mut().zip(&state.hand_wrench).for_each(|(wrench, last)| *wrench = *last);
        let hands = hands.iter().zip(&levers);
        Ok(self.compliance.object_yield(hand_wrench, hands, formation.w_inverse(), is_free))
    }

    fn write_commands(
        &self,
        tick: u64,
        state: &CoordinatorState,
        phase: &Phase,
        X_WO: &[Pose<World, Odometry>; MAX_ROBOTS],
        law: &HybridOutput,
        out: &mut CoordinatorOutputs,
    ) {
        let mut references = law.hands.iter();
        let present = self.grips.present(&state.hybrid);
        let robots = self.hands_of_robots.iter().zip(&state.leading.clocks).zip(X_WO).zip(present);
        for (robot, (command, (((&hands, own_clock), X_WO), present))) in
            out.commands.iter_mut().zip(robots).enumerate()
        {
            let X_OW = X_WO.inverse();
            let team_clock = if self.leading.is_some() { own_clock } else { &state.clock };
            let closed_hands = membership::closed_hands(&state.memberships, robot, present, hands);
            *command = TeamCommand {
                // Its feet go on to follow its hands, whatever the team does.
                team_mode: if state.memberships.is_led(robot) { mode::CARRY } else { mode_of(state, phase) },
                state_tick: tick,
                step_clock: state.memberships.own_clock(robot).unwrap_or(team_clock).clock,
                closed_hands: if self.job.closes_hands(phase) { closed_hands } else { 0 },
                ..TeamCommand::zeroed()
            };
            for (hand, reference) in references.by_ref().take(hands.min(MAX_HANDS)).enumerate() {
                command.hand_pose_ref[hand] = (X_OW * reference.pose).to_array();
                command.hand_twist_ref[hand] = reference.twist.expressed_in(&X_OW).to_array();
                command.hand_wrench_ref[hand] = reference.wrench.expressed_in(&X_OW).to_array();
            }
        }
    }
}

impl CoordinatorScratch {
    /// Overwrites every number with NaN.
    pub fn poison(&mut self) {
        let nan = f64::NAN;
        self.team.law.poison();
        self.team.formation.poison();
        self.team.hand_wrench.fill([nan; 6]);
        self.team.tips.fill(None);
        self.team.gaps.fill(None);
        self.hands.clear();
        self.load.poison();
        self.force_ref.external = Wrench::from_array(&[nan; 6]);
        self.force_ref.internal.fill(Wrench::from_array(&[nan; 6]));
        self.position_ref.internal.fill(Twist::from_array(&[nan; 6]));
        for reference in &mut self.law_output.hands {
            reference.twist = Twist::from_array(&[nan; 6]);
            reference.pose.translation.fill(nan);
        }
        self.law_output.force.internal.fill(Wrench::from_array(&[nan; 6]));
        self.law_output.position.internal.fill(Twist::from_array(&[nan; 6]));
    }
}

impl CoordinatorState {
    /// What the operator was last heard to say.
    pub fn heard_of_operator(&self) -> OperatorInput {
        OperatorInput { word: self.heard_word, drive: self.heard_drive, ..OperatorInput::default() }
    }

    /// Hears the operator.
    pub fn hear_operator(&mut self, heard: &OperatorInput) {
        (self.heard_word, self.heard_drive) = (heard.word, heard.drive);
    }
}

impl CoordinatorOutputs {
    /// Of a team of so many robots, as bytes.
    pub(crate) fn parts(&mut self, robots: usize) -> [&mut [u8]; 2] {
        let (commands, _) = self.commands.split_at_mut(robots.min(MAX_ROBOTS));
        [bytemuck::cast_slice_mut(commands), bytemuck::bytes_of_mut(&mut self.team_state)]
    }
}

impl Default for CoordinatorOutputs {
    fn default() -> Self {
        Self { commands: [TeamCommand::zeroed(); MAX_ROBOTS], team_state: TeamState::zeroed() }
    }
}

fn hands_of_robots(run: &RunSpec) -> Vec<usize> {
    run.robots.iter().map(|robot| robot.grasping_hands.len()).collect()
}

/// What robots say of their hands, each in its own frame O, in the world of the team.
fn read_hands<'a>(
    robots: impl Iterator<Item = &'a RobotState>,
    hands_of_robots: &[usize],
    X_WO: &[Pose<World, Odometry>; MAX_ROBOTS],
    hands: &mut Vec<HandInput>,
) -> Result<(), CoordinateError> {
    hands.clear();
    for ((robot, &count), X_WO) in robots.zip(hands_of_robots).zip(X_WO) {
        let poses = robot.hand_pose.iter().zip(&robot.hand_pose_commanded);
        for ((pose, commanded), wrench) in poses.zip(&robot.hand_wrench).take(count) {
            let pose = Pose::<Odometry, Hand>::from_array(pose).ok_or(CoordinateError::HandPose)?;
            let commanded = Pose::<Odometry, Hand>::from_array(commanded).ok_or(CoordinateError::HandPose)?;
            let wrench = Wrench::<Odometry>::from_array(wrench).expressed_in(X_WO);
            hands.push(HandInput { pose: *X_WO * pose, pose_commanded: *X_WO * commanded, wrench });
        }
    }
    Ok(())
}

/// Whether a hand is so near its place that it may close.
fn is_in_reach(hand: &Pose<World, Hand>, place: &Pose<World, Hand>) -> bool {
    let way = hand.translation - place.translation;
    way.norm() <= REACH_M && place.displacement_to(hand).angular.norm() <= REACH_RAD
}

/// How far each hand was seen off its grip in this tick.
fn gaps_of(team: &TeamScratch) -> [Twist<World>; MAX_HANDS_OF_TEAM] {
    let mut off = [Twist::zero(); MAX_HANDS_OF_TEAM];
    for (off, gap) in off.iter_mut().zip(&team.gaps) {
        *off = gap.map_or_else(Twist::zero, |gap| gap.tip);
    }
    off
}

/// Moves every hand's reference along its palm; it stays there.
fn move_open_hands(state: &mut CoordinatorState, references: &mut [HandReference], step_m: f64) {
    if step_m == 0.0 {
        return;
    }
    let back = Pose::<Hand, Hand>::new(Vector3::new(0.0, 0.0, step_m), UnitQuaternion::identity());
    for (reference, array) in references.iter_mut().zip(&mut state.hybrid.hand_pose_ref) {
        reference.pose = reference.pose * back;
        *array = reference.pose.to_array();
    }
}

/// The team's mode in a phase of its job.
fn mode_of(state: &CoordinatorState, phase: &Phase) -> u64 {
    if state.safety.is_stopped() { mode::SAFE_STOP } else { phase.mode() }
}

/// Moves every hand's reference as the object's reference moves in this tick; it stays there.
fn carry_hands(state: &mut CoordinatorState, references: &mut [HandReference], X_WA: &Pose<World, Object>) {
    let Some(X_WA_before) = Pose::<World, Object>::from_array(&state.motion.pose) else { return };
    let step: Pose<World, World> = *X_WA * X_WA_before.inverse();
    for (reference, array) in references.iter_mut().zip(&mut state.hybrid.hand_pose_ref) {
        reference.pose = step * reference.pose;
        *array = reference.pose.to_array();
    }
}

fn write_team_state(
    state: &CoordinatorState,
    phase: &Phase,
    law: &HybridOutput,
    reference: Option<(&GeneralizedForce, &GeneralizedPosition)>,
    out: &mut CoordinatorOutputs,
) {
    let measured = &law.position.external;
    let object_pose_ref = reference.map_or(*measured, |(_, position)| position.external);
    // In place: it is large.
    let team_state = &mut out.team_state;
    bytemuck::write_zeroes(team_state);
    team_state.object_pose = measured.to_array();
    team_state.object_pose_ref = object_pose_ref.to_array();
    team_state.object_twist_ref = state.motion.twist;
    team_state.step_clock = state.clock.clock;
    team_state.team_mode = mode_of(state, phase);
    team_state.operator_word = state.operator.word;
    team_state.drive_number = state.operator.drive.number;
    team_state.drive_twist = state.operator.drive.twist;
    team_state.drive_squeeze_n = state.operator.drive.squeeze_n;
    team_state.squeeze_n = state.operator.squeeze_n;
    team_state.stop_cause = state.safety.cause;
    team_state.stop_robot = state.safety.robot;
    team_state.absent_hands = grips::absent(&state.hybrid);
    team_state.loss_cause = state.grips.loss_cause;
    write_force(&law.force, &mut team_state.generalized_force);
    if let Some((force_ref, _)) = reference {
        write_force(force_ref, &mut team_state.generalized_force_ref);
    }
}

fn write_force(force: &GeneralizedForce, rows: &mut [[f64; 6]; MAX_HANDS_OF_TEAM]) {
    let internal = force.internal.iter().map(Wrench::to_array);
    let all = core::iter::once(force.external.to_array()).chain(internal);
    for (row, wrench) in rows.iter_mut().zip(all) {
        *row = wrench;
    }
}
