//! Robots that leave the team while it carries, and join it.
//!
//! ```text
//!            asked to leave     object and feet rest       hands bear nothing: formed anew without it
//!   Member ───────────────▶ Halting ─────────────▶ Unburdening ─────────────▶ Opening
//!     ▲                                                                          │ none holds
//!     │ bears its share, steps with the others                                   ▼
//!   Joining                                                                 Withdrawing ◀── asked to leave, or
//!     ▲ all hold: formed anew with it                                            │ drawn back   what fails
//!     │                                                                          ▼
//!   Closing ◀── Reaching ◀── Approaching ◀── Returning ◀── Away ◀───────────── Leaving
//!       it stands,    palms        in its      near         asked to join  walked off
//!       in reach      drawn        place       its place
//! ```
//!
//! What a robot is asked for is a function of the tick. It is followed one robot at a time, and given up as long as it is
//! not asked for anew when it takes too long: who can't leave stays, who can't join goes back and stands aside. Only a hand
//! that does not open stops the team.
//!
//! From Opening to Closing a robot's hands are led by its [`Rig`], in the world of the team; from Opening until feet of all
//! stand after it has joined it has a step clock of its own.

use crate::job::Phase;
use crate::reference::smooth_step;
use crate::rig::{Goal, Rig};
use crate::step_clock::{TeamClockState, Wishes};
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::{Membership, Scenario};
use mikoshi_cooperation::HandReference;
use mikoshi_humanoid::gait::StepTiming;
use mikoshi_ipc_types::{
    MAX_HANDS_OF_TEAM, MAX_ROBOTS, RobotState, TeamState, all_hands, member_fault as fault,
    member_stage as stage, mode,
};
use mikoshi_spatial::{Object, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

/// In which a robot's share of the load goes, and comes.
const SHIFT_S: f64 = 2.0;
/// A hand that is about to open applies no more, and changes nothing by much when it does.
const UNBURDENED_N: f64 = 1.5;
const UNBURDENED_NM: f64 = 0.3;
/// How much longer than it must anything may take, but for walks.
const PATIENCE_S: f64 = 10.0;
/// How long hands may take to open and to close.
const GRIP_S: f64 = 2.0;
/// How long the object may take to come to rest under feet that walk.
const HALT_S: f64 = 20.0;
/// How much longer than its way takes a robot may walk.
const WALK_PATIENCE_S: f64 = 60.0;
/// A robot that returns goes straight to its place from where it is within so much of the spot in front of it.
const ALIGNED_M: f64 = 0.03;
const ALIGNED_RAD: f64 = 0.05;

/// Who is asked to leave and to join, and when. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Memberships {
    /// By robot, in the order of time; nothing where it stays.
    entries: Vec<Vec<Entry>>,
    hands_of_robots: Vec<usize>,
    period_s: f64,
    ticks: Ticks,
}

/// Lengths in ticks.
#[derive(Clone, Copy, Debug)]
struct Ticks {
    patience: u64,
    grip: u64,
    halt: u64,
    walk_patience: u64,
}

/// One entry of the scenario.
#[derive(Clone, Debug)]
struct Entry {
    leave: Option<u64>,
    join: Option<u64>,
    /// Where Σa would be if the robot, away, held it.
    X_AG_away: Pose<Object, Object>,
    draw_back_m: f64,
    speed_m_s: f64,
    /// Longest walk.
    walk: u64,
}

/// All robots.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MembershipState {
    robots: [RobotMembership; MAX_ROBOTS],
}

/// How far a robot is on its way.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
struct RobotMembership {
    /// One of [`stage`].
    stage: u64,
    /// The first tick of the stage.
    since: u64,
    /// 1 where it was last asked to be away.
    asked_away: u64,
    /// 1 where that has failed, and is not tried any more.
    gave_up: u64,
    /// Why: one of [`fault`].
    fault: u64,
    /// How much of its share has gone, 0 to 1.
    relieved: f64,
    rig: Rig,
    /// 1 where it steps by a clock of its own.
    has_own_clock: u64,
    clock: TeamClockState,
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for RobotMembership {}
// SAFETY: `repr(C)` over Pod fields of 8-byte units and alignment only: no padding, any bit pattern valid.
unsafe impl Pod for RobotMembership {}
// SAFETY: as above.
unsafe impl Zeroable for MembershipState {}
// SAFETY: as above.
unsafe impl Pod for MembershipState {}

/// The team in a tick.
pub(crate) struct Team<'a> {
    pub tick: u64,
    pub phase: &'a Phase,
    /// What the object is to follow.
    pub X_WA_ref: &'a Pose<World, Object>,
    /// The reference is at rest, and the team's feet stand and want to.
    pub rests: bool,
    /// The team's own clock stands.
    pub clock_stands: bool,
}

/// One robot in a tick.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Seen {
    /// Its feet stand and want to.
    pub stands: bool,
    /// Its hands are where they may close.
    pub in_reach: bool,
    /// All its hands hold, and none does.
    pub all_hold: bool,
    pub none_holds: bool,
    /// The largest wrench that a hand of it applies, filtered.
    pub force_n: f64,
    pub moment_nm: f64,
    /// Enough hands of others hold.
    pub is_spare: bool,
}

/// What has to become of the team because of a robot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Change {
    /// It is formed anew without this robot.
    Leaves(usize),
    /// It is formed anew with this robot.
    Joins(usize),
    /// Hands of this robot do not open.
    Stuck(usize),
}

impl Memberships {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario, hands_of_robots: Vec<usize>) -> Self {
        let ticks = |time_s: f64| scenario.tick_at(time_s);
        let of_robot = |robot: &mikoshi_config::scenario::Member| {
            // Backwards is backwards for the robot, whose place at the object stays.
            let heading = (robot.yaw_deg - scenario.object.yaw_deg).to_radians();
            let back = -Vector3::new(heading.cos(), heading.sin(), 0.0);
            let entry = |entry: &Membership| Entry {
                leave: entry.leave_s.map(ticks),
                join: entry.join_s.map(ticks),
                X_AG_away: Pose::new(back * entry.distance_m, UnitQuaternion::identity()),
                draw_back_m: entry.draw_back_m,
                speed_m_s: entry.speed_m_s,
                walk: ticks(entry.distance_m / entry.speed_m_s + WALK_PATIENCE_S),
            };
            scenario.membership_of(&robot.name).map(entry).collect()
        };
        Self {
            entries: scenario.robots.iter().map(of_robot).collect(),
            hands_of_robots,
            period_s: scenario.control_period_s,
            ticks: Ticks {
                patience: ticks(PATIENCE_S),
                grip: ticks(GRIP_S),
                halt: ticks(HALT_S),
                walk_patience: ticks(WALK_PATIENCE_S),
            },
        }
    }

    /// At tick 0: who joins later is away.
    pub(crate) fn initial_state(&self) -> MembershipState {
        let mut state = MembershipState::zeroed();
        for (robot, entries) in state.robots.iter_mut().zip(&self.entries) {
            if entries.first().is_some_and(|entry| entry.leave.is_none()) {
                robot.stage = stage::AWAY;
                (robot.asked_away, robot.relieved, robot.has_own_clock) = (1, 1.0, 1);
            }
        }
        state
    }

    /// The entry in force: the last that has begun, or the first.
    fn entry(&self, robot: usize, tick: u64) -> Option<&Entry> {
        let entries = self.entries.get(robot)?;
        let has_begun = |entry: &&Entry| entry.leave.or(entry.join).is_some_and(|first| first <= tick);
        entries.iter().rev().find(has_begun).or(entries.first())
    }

    /// Whether a robot is asked to be away.
    fn is_asked_away(&self, robot: usize, tick: u64) -> bool {
        self.entry(robot, tick).is_some_and(|entry| match (entry.leave, entry.join) {
            (Some(leave), join) => leave <= tick && join.is_none_or(|join| tick < join),
            (None, join) => join.is_some_and(|join| tick < join),
        })
    }

    /// Hands of each robot, in hand order of the team.
    fn arms(&self, robot: usize) -> core::ops::Range<usize> {
        let before = self.hands_of_robots.iter().take(robot).sum();
        before..before + self.hands_of_robots.get(robot).copied().unwrap_or(0)
    }

    /// The same as a set.
    pub(crate) fn hands(&self, robot: usize) -> u64 {
        self.arms(robot).fold(0, |set, arm| set | 1 << arm)
    }

    /// How much each hand of the team is to bear, as a part of what it would as a member's.
    pub(crate) fn weights(&self, state: &MembershipState) -> [f64; MAX_HANDS_OF_TEAM] {
        let mut weights = [1.0; MAX_HANDS_OF_TEAM];
        let of_robots = state.robots.iter().zip(&self.hands_of_robots);
        let of_hands = of_robots.flat_map(|(robot, hands)| core::iter::repeat_n(robot.weight(), *hands));
        for (weight, of_hand) in weights.iter_mut().zip(of_hands) {
            *weight = of_hand;
        }
        weights
    }

    /// One tick of hands that are away: their references, in `references`, and those that the law keeps, in `kept`. They
    /// stay where they are while the team is stopped. `None` if the state is none.
    pub(crate) fn lead<'a>(
        &self,
        state: &mut MembershipState,
        team: &Team<'_>,
        robots: impl Iterator<Item = &'a RobotState>,
        is_stopped: bool,
        (references, kept): (&mut [HandReference], &mut [[f64; 7]]),
    ) -> Option<()> {
        for (index, (robot, said)) in state.robots.iter_mut().zip(robots).enumerate() {
            let Some(entry) = self.entry(index, team.tick).filter(|_| robot.is_led()) else { continue };
            let arms = self.arms(index);
            let (references, kept) = (references.get_mut(arms.clone())?, kept.get_mut(arms)?);
            if !robot.rig.is_there() {
                // Away from the beginning: where it is, as soon as it is known where the object is.
                if !mode::is_hybrid(team.phase.mode()) {
                    continue;
                }
                robot.rig = Rig::at(&(*team.X_WA_ref * entry.X_AG_away), references);
            }
            let share = if is_stopped { 0.0 } else { said.speed_share };
            // Nonsense is no reason to run.
            let share = if (0.0..=1.0).contains(&share) { share } else { 0.0 };
            match robot.goal(entry, team.X_WA_ref, share) {
                Some(goal) => robot.rig.advance(&goal, self.period_s)?,
                None => robot.rig.rest(),
            }
            robot.rig.refer(references);
            for (array, reference) in kept.iter_mut().zip(references) {
                *array = reference.pose.to_array();
            }
        }
        Some(())
    }

    /// One tick of the feet of robots that step by themselves. `None` if a clock is none.
    pub(crate) fn step<'a>(
        &self,
        state: &mut MembershipState,
        timing: &StepTiming,
        robots: impl Iterator<Item = &'a RobotState>,
    ) -> Option<()> {
        for (robot, said) in state.robots.iter_mut().zip(robots) {
            if robot.has_own_clock != 0 {
                robot.clock = robot.clock.advance(timing, &Wishes::of(core::iter::once(said)), true)?;
            }
        }
        Some(())
    }

    /// How a robot goes on after this tick, and what that changes for the team. `clock` is the team's.
    pub(crate) fn next(
        &self,
        state: &mut MembershipState,
        index: usize,
        team: &Team<'_>,
        seen: &Seen,
        clock: &TeamClockState,
    ) -> Option<Change> {
        let is_turn = state.others_are_settled(index);
        let entry = self.entry(index, team.tick)?;
        let asked = u64::from(self.is_asked_away(index, team.tick + 1));
        let robot = state.robots.get_mut(index)?;
        if core::mem::replace(&mut robot.asked_away, asked) != asked {
            robot.gave_up = 0;
        }
        let shift = self.period_s / SHIFT_S;
        let part = if robot.loses_share() { shift } else { -shift };
        if robot.holds() {
            robot.relieved = (robot.relieved + part).clamp(0.0, 1.0);
        }
        let shall_leave = (robot.asked_away != 0) != (robot.gave_up != 0);
        let lasted = team.tick.saturating_sub(robot.since);
        let goal = robot.goal(entry, team.X_WA_ref, 1.0);
        let goal = goal.as_ref();
        let arrived = goal.is_some_and(|goal| robot.rig.has_arrived(goal));
        let drawn = goal.is_some_and(|goal| robot.rig.has_drawn(goal));
        let Ticks { patience, grip, halt, walk_patience } = self.ticks;
        let may_begin = is_turn && matches!(team.phase, Phase::Carrying { .. });
        let bears_nothing = seen.force_n < UNBURDENED_N && seen.moment_nm < UNBURDENED_NM;

        let next = match robot.stage {
            stage::MEMBER if shall_leave && may_begin && !seen.is_spare => robot.give_up(fault::NEEDED),
            stage::MEMBER if shall_leave && may_begin => stage::HALTING,
            stage::HALTING if !shall_leave => stage::MEMBER,
            stage::HALTING if team.rests => stage::UNBURDENING,
            stage::HALTING if lasted > halt => robot.give_up(fault::RESTLESS),
            stage::UNBURDENING if !shall_leave => stage::JOINING,
            // Somebody else has lost the object meanwhile.
            stage::UNBURDENING if !seen.is_spare => robot.give_up(fault::NEEDED),
            stage::UNBURDENING if robot.relieved >= 1.0 && bears_nothing => stage::OPENING,
            stage::UNBURDENING if lasted > patience => robot.give_up(fault::BURDENED),
            stage::OPENING if seen.none_holds => stage::WITHDRAWING,
            stage::OPENING if lasted == grip => {
                robot.fault = fault::HOLDING;
                return Some(Change::Stuck(index));
            }
            stage::WITHDRAWING if drawn => stage::LEAVING,
            stage::LEAVING if arrived && seen.stands => stage::AWAY,
            stage::LEAVING if lasted > entry.walk => {
                robot.fault = fault::STRANDED;
                stage::AWAY
            }
            stage::AWAY if !shall_leave && may_begin => stage::RETURNING,
            stage::RETURNING | stage::APPROACHING | stage::REACHING | stage::CLOSING if shall_leave => {
                stage::WITHDRAWING
            }
            stage::RETURNING if goal.is_some_and(|goal| robot.rig.is_near(goal, ALIGNED_M, ALIGNED_RAD)) => {
                stage::APPROACHING
            }
            stage::APPROACHING if arrived => stage::REACHING,
            stage::REACHING if drawn && seen.in_reach && seen.stands && team.rests => stage::CLOSING,
            stage::CLOSING if seen.all_hold => stage::JOINING,
            stage::RETURNING | stage::APPROACHING if lasted > entry.walk + walk_patience => {
                robot.give_up(fault::OUT_OF_REACH)
            }
            stage::REACHING if lasted > 2 * patience => robot.give_up(fault::OUT_OF_REACH),
            stage::CLOSING if lasted > grip => robot.give_up(fault::NOT_HOLDING),
            stage::JOINING if robot.has_own_clock != 0 && team.clock_stands && robot.clock.is_standing() => {
                robot.has_own_clock = 0;
                robot.stage
            }
            stage::JOINING if shall_leave && may_begin => stage::UNBURDENING,
            stage::JOINING if robot.relieved <= 0.0 && robot.has_own_clock == 0 => stage::MEMBER,
            same => same,
        };
        let last = core::mem::replace(&mut robot.stage, next);
        if next == last {
            return None;
        }
        robot.since = team.tick + 1;
        match (last, next) {
            (stage::MEMBER, stage::HALTING) | (stage::AWAY, stage::RETURNING) => robot.fault = 0,
            (_, stage::OPENING) => {
                if robot.has_own_clock == 0 {
                    (robot.has_own_clock, robot.clock) = (1, *clock);
                }
                return Some(Change::Leaves(index));
            }
            (stage::CLOSING, stage::JOINING) => return Some(Change::Joins(index)),
            _ => {}
        }
        None
    }

    /// A robot that has left takes its hands with it where these references have them.
    pub(crate) fn let_go(
        &self,
        state: &mut MembershipState,
        index: usize,
        X_WA_ref: &Pose<World, Object>,
        references: &[HandReference],
    ) {
        let references = references.get(self.arms(index)).unwrap_or_default();
        if let Some(robot) = state.robots.get_mut(index) {
            robot.rig = Rig::at(X_WA_ref, references);
        }
    }

    /// It goes on as a member after all: the team could not be formed.
    pub(crate) fn stay(&self, state: &mut MembershipState, index: usize) {
        if let Some(robot) = state.robots.get_mut(index) {
            robot.give_up(fault::NEEDED);
            (robot.stage, robot.has_own_clock) = (stage::JOINING, 0);
        }
    }

    /// Where a robot's hand belongs on an object at `X_WA`.
    pub(crate) fn place(
        &self,
        state: &MembershipState,
        (robot, hand): (usize, usize),
        X_WA: &Pose<World, Object>,
    ) -> Option<Pose<World, mikoshi_spatial::Hand>> {
        state.robots.get(robot)?.rig.place(hand, X_WA)
    }

    /// Whether this robot ever leaves or joins.
    pub(crate) fn concerns(&self, robot: usize) -> bool {
        self.entries.get(robot).is_some_and(|entries| !entries.is_empty())
    }
}

impl MembershipState {
    /// Whether a robot's hands are led apart from the others'.
    pub(crate) fn is_led(&self, robot: usize) -> bool {
        self.robots.get(robot).is_some_and(RobotMembership::is_led)
    }

    /// Whether a robot that is away shall close its hands.
    pub(crate) fn closes(&self, robot: usize) -> bool {
        self.robots.get(robot).is_some_and(|robot| robot.stage == stage::CLOSING)
    }

    /// The clock of a robot that steps by itself.
    pub(crate) fn own_clock(&self, robot: usize) -> Option<&TeamClockState> {
        self.robots.get(robot).filter(|robot| robot.has_own_clock != 0).map(|robot| &robot.clock)
    }

    /// Whether the object has to rest for somebody's sake.
    pub(crate) fn object_rests(&self) -> bool {
        self.robots.iter().any(|robot| !matches!(robot.stage, stage::MEMBER | stage::AWAY | stage::RETURNING))
    }

    /// Whether nobody is on his way.
    pub(crate) fn is_settled(&self) -> bool {
        self.others_are_settled(MAX_ROBOTS)
    }

    fn others_are_settled(&self, but: usize) -> bool {
        let mut others = self.robots.iter().enumerate().filter(|(index, _)| *index != but);
        others.all(|(_, robot)| matches!(robot.stage, stage::MEMBER | stage::AWAY))
    }

    /// A tick in which nothing of it passes.
    pub(crate) fn delay(&mut self) {
        self.robots.iter_mut().for_each(|robot| robot.since += 1);
    }

    /// Says it to observers.
    pub(crate) fn write(&self, hands: impl Fn(usize) -> u64, team_state: &mut TeamState) {
        let said = team_state.member_stage.iter_mut().zip(&mut team_state.member_fault);
        let said = said.zip(&mut team_state.member_weight);
        for (index, (robot, ((stage, fault), weight))) in self.robots.iter().zip(said).enumerate() {
            (*stage, *fault, *weight) = (robot.stage, robot.fault, robot.weight());
            if robot.is_led() {
                team_state.away_hands |= hands(index);
            }
        }
    }
}

impl RobotMembership {
    fn weight(&self) -> f64 {
        1.0 - smooth_step(self.relieved)
    }

    fn is_led(&self) -> bool {
        matches!(self.stage, stage::OPENING..=stage::CLOSING)
    }

    fn holds(&self) -> bool {
        !self.is_led()
    }

    fn loses_share(&self) -> bool {
        self.stage == stage::UNBURDENING
    }

    /// What it was asked for is not tried any more; it stays in its stage, and goes from there where it came from.
    fn give_up(&mut self, fault: u64) -> u64 {
        (self.gave_up, self.fault) = (1, fault);
        self.stage
    }

    /// Where its rig is to go, for an object whose reference is `X_WA`; none where it is to stay.
    fn goal(&self, entry: &Entry, X_WA: &Pose<World, Object>, speed_share: f64) -> Option<Goal> {
        let Entry { X_AG_away, draw_back_m, speed_m_s, .. } = *entry;
        let goal = |frame, draw_m| Some(Goal { frame, draw_m, speed_m_s, speed_share });
        match self.stage {
            stage::WITHDRAWING => goal(self.rig.frame()?, draw_back_m),
            stage::LEAVING | stage::RETURNING => goal(*X_WA * X_AG_away, draw_back_m),
            stage::APPROACHING => goal(*X_WA, draw_back_m),
            stage::REACHING => goal(*X_WA, 0.0),
            _ => None,
        }
    }
}

/// Sets of hands of robots travel as those of the team.
pub(crate) fn closed_hands(state: &MembershipState, robot: usize, present: u64, hands: usize) -> u64 {
    if state.closes(robot) { all_hands(hands) } else { present }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_spatial::{Twist, Wrench};

    const WELL: Seen = Seen {
        stands: true,
        in_reach: true,
        all_hold: true,
        none_holds: true,
        force_n: 0.1,
        moment_nm: 0.01,
        is_spare: true,
    };

    /// One robot that is to leave in tick 10 and to join in tick 20000, with what it is told so far.
    struct Trial {
        memberships: Memberships,
        state: MembershipState,
        references: [HandReference; 1],
        tick: u64,
        rests: bool,
        speed_share: f64,
    }

    impl Trial {
        fn new() -> Self {
            let away = Pose::new(Vector3::new(-0.5, 0.0, 0.0), UnitQuaternion::identity());
            let entry = Entry {
                leave: Some(10),
                join: Some(20_000),
                X_AG_away: away,
                draw_back_m: 0.05,
                speed_m_s: 0.06,
                walk: 4000,
            };
            let ticks = Ticks { patience: 2000, grip: 400, halt: 4000, walk_patience: 1000 };
            let reference =
                HandReference { pose: Pose::identity(), twist: Twist::zero(), wrench: Wrench::zero() };
            Self {
                memberships: Memberships {
                    entries: vec![vec![entry]],
                    hands_of_robots: vec![1],
                    period_s: 0.005,
                    ticks,
                },
                state: MembershipState::zeroed(),
                references: [reference],
                tick: 0,
                rests: true,
                speed_share: 1.0,
            }
        }

        /// The stages that begin until `tick`, all being as `seen`; and the changes that they ask for.
        fn go_on(&mut self, tick: u64, seen: &Seen) -> (Vec<u64>, Vec<Change>) {
            let (mut stages, mut changes) = (vec![], vec![]);
            let robot = RobotState { speed_share: self.speed_share, ..RobotState::zeroed() };
            let phase = Phase::Carrying { since: 0 };
            while self.tick < tick {
                let team = Team {
                    tick: self.tick,
                    phase: &phase,
                    X_WA_ref: &Pose::identity(),
                    rests: self.rests,
                    clock_stands: true,
                };
                let mut kept = [[0.0; 7]];
                let references = (&mut self.references[..], &mut kept[..]);
                let robots = core::iter::once(&robot);
                self.memberships.lead(&mut self.state, &team, robots, false, references).expect("a state");
                let before = self.state.robots[0].stage;
                let clock = TeamClockState::default();
                let change = self.memberships.next(&mut self.state, 0, &team, seen, &clock);
                if let Some(Change::Leaves(robot)) = change {
                    self.memberships.let_go(&mut self.state, robot, team.X_WA_ref, &self.references);
                }
                changes.extend(change);
                let now = self.state.robots[0].stage;
                stages.extend((now != before).then_some(now));
                self.tick += 1;
            }
            (stages, changes)
        }

        fn fault(&self) -> u64 {
            self.state.robots[0].fault
        }
    }

    #[test]
    fn all_goes_well() {
        let mut trial = Trial::new();
        let (out, changes) = trial.go_on(19_999, &WELL);
        let way = [
            stage::HALTING,
            stage::UNBURDENING,
            stage::OPENING,
            stage::WITHDRAWING,
            stage::LEAVING,
            stage::AWAY,
        ];
        assert_eq!((&out[..], changes), (&way[..], vec![Change::Leaves(0)]));
        assert_eq!(trial.memberships.weights(&trial.state)[..2], [0.0, 1.0]);
        let (back, changes) = trial.go_on(40_000, &WELL);
        let way = [
            stage::RETURNING,
            stage::APPROACHING,
            stage::REACHING,
            stage::CLOSING,
            stage::JOINING,
            stage::MEMBER,
        ];
        assert_eq!((&back[..], changes), (&way[..], vec![Change::Joins(0)]));
        assert_eq!((trial.memberships.weights(&trial.state)[0], trial.fault()), (1.0, 0));
    }

    #[test]
    fn an_object_that_does_not_come_to_rest_is_not_left() {
        let mut trial = Trial::new();
        trial.rests = false;
        assert_eq!(trial.go_on(15_000, &WELL), (vec![stage::HALTING, stage::MEMBER], vec![]));
        assert_eq!(trial.fault(), fault::RESTLESS);
        // It is not tried again, and nothing is left to join.
        trial.rests = true;
        assert_eq!(trial.go_on(40_000, &WELL), (vec![], vec![]));
    }

    #[test]
    fn hands_that_go_on_to_bear_something_are_not_opened() {
        for seen in [Seen { force_n: 3.0, ..WELL }, Seen { moment_nm: 1.0, ..WELL }] {
            let mut trial = Trial::new();
            let stages = vec![stage::HALTING, stage::UNBURDENING, stage::JOINING, stage::MEMBER];
            assert_eq!(trial.go_on(15_000, &seen), (stages, vec![]));
            assert_eq!(trial.fault(), fault::BURDENED);
            assert_eq!(trial.memberships.weights(&trial.state)[0], 1.0);
        }
    }

    #[test]
    fn who_does_not_get_away_stands_where_it_is_and_who_does_not_come_near_goes_back() {
        let mut trial = Trial::new();
        trial.go_on(1500, &WELL);
        trial.speed_share = 0.0;
        assert_eq!(trial.go_on(19_000, &WELL).0, [stage::AWAY]);
        assert_eq!(trial.fault(), fault::STRANDED);
        trial.speed_share = 1.0;
        let (stages, changes) = trial.go_on(40_000, &Seen { in_reach: false, ..WELL });
        let back = [stage::WITHDRAWING, stage::LEAVING, stage::AWAY];
        assert_eq!((&stages[stages.len() - 3..], &changes[..]), (&back[..], &[][..]), "{stages:?}");
        assert_eq!(trial.fault(), fault::OUT_OF_REACH);
    }

    #[test]
    fn who_is_needed_meanwhile_stays() {
        let mut trial = Trial::new();
        assert_eq!(trial.go_on(200, &WELL).0, [stage::HALTING, stage::UNBURDENING]);
        let needed = Seen { is_spare: false, ..WELL };
        assert_eq!(trial.go_on(2000, &needed), (vec![stage::JOINING, stage::MEMBER], vec![]));
        assert_eq!(trial.fault(), fault::NEEDED);
    }

    #[test]
    fn whoever_is_asked_back_on_the_way_out_turns_round() {
        let mut trial = Trial::new();
        trial.memberships.entries[0][0].join = Some(300);
        let (stages, changes) = trial.go_on(3000, &WELL);
        assert_eq!(stages, [stage::HALTING, stage::UNBURDENING, stage::JOINING, stage::MEMBER]);
        assert_eq!(changes, []);
    }
}
