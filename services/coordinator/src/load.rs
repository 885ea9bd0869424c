//! What the team carries, as its hands feel it, and who bears how much of it.
//!
//! Virtual sticks make the paper's zero internal forces those of tips: hands at the ends of long sticks then bear moments
//! that nothing asks for, and grasps yield to them where no encoder sees it. Of a load that brings more than
//! `load.hand_moment_nm` hands are relieved: the references of internal forces become those of hands that lift by forces
//! alone, each robot its share.

use crate::reference::smooth_step;
use bytemuck::{Pod, Zeroable};
use mikoshi_config::scenario::Scenario;
use mikoshi_cooperation::{
    Bearer, CarriedBody, FormedForces, GeneralizedForce, HandInput, LoadIdentifier, LoadIdentifierState,
    VirtualStick, largest_moment_of_equal_tips_nm, share_load,
};
use mikoshi_humanoid::balance::GRAVITY_M_S2;
use mikoshi_ipc_types::{MAX_ROBOTS, RobotState, TeamState};
use mikoshi_spatial::{Object, Odometry, Pose, World, Wrench};
use nalgebra::Vector3;

/// Time in which what is borne follows what is found.
const BORNE_S: f64 = 0.5;
/// Time in which shares follow what robots say that they can bear, or what the operator wants.
const SHARES_S: f64 = 2.0;
/// No robot is asked for more moment.
const MOST_NM: f64 = 60.0;
/// A mass that is less certain than this part of it is not relied upon.
const CERTAIN: f64 = 0.2;

/// What is carried and how it is shared. Immutable.
#[derive(Clone, Debug)]
pub(crate) struct Load {
    identifier: LoadIdentifier,
    hand_moment_nm: f64,
    /// By robot; empty where robots say themselves.
    shares: Vec<f64>,
    hands_of_robots: Vec<usize>,
    borne_blend: f64,
    shares_blend: f64,
}

/// All of it that matters between ticks.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LoadState {
    identifier: LoadIdentifierState,
    /// The mass that is shared out, and its first moment in the object's axes.
    borne: [f64; 4],
    /// By robot, of a sum of one.
    shares: [f64; MAX_ROBOTS],
    relief: f64,
    /// By robot, the moment that its hands together would best apply, in the world.
    moments: [[f64; 3]; MAX_ROBOTS],
}

// SAFETY: zeros are a valid value of floats, and of the identifier's state.
unsafe impl Zeroable for LoadState {}
// SAFETY: `repr(C)` over Pod fields of 8-byte units and alignment only: no padding, any bit pattern valid.
unsafe impl Pod for LoadState {}

/// Buffers for n arms.
#[derive(Clone, Debug)]
pub(crate) struct LoadScratch {
    tips: Vec<Wrench<World>>,
    rows: Vec<Wrench<World>>,
    work: Vec<Wrench<World>>,
    shares: Vec<f64>,
}

impl LoadScratch {
    /// For these internal forces.
    pub(crate) fn new(arms: usize, work: usize) -> Self {
        Self {
            tips: vec![Wrench::zero(); arms],
            rows: vec![Wrench::zero(); arms],
            work: vec![Wrench::zero(); work],
            shares: vec![0.0; arms],
        }
    }

    /// Overwrites every number with NaN.
    pub(crate) fn poison(&mut self) {
        let nan = Wrench::from_array(&[f64::NAN; 6]);
        [&mut self.tips, &mut self.rows, &mut self.work].into_iter().for_each(|buffer| buffer.fill(nan));
        self.shares.fill(f64::NAN);
    }
}

/// How the team holds, in a tick.
pub(crate) struct Holding<'a> {
    pub forces: FormedForces<'a>,
    pub hands: &'a [HandInput],
    pub sticks: &'a [[f64; 7]],
    /// Of each hand, the part that it bears of what it would as a member's: less than 1 where its robot leaves or joins.
    pub weights: &'a [f64],
}

impl Holding<'_> {
    /// What each tip bears of the load if none is preferred: W⁻, by the hands' weights. Whether some hand bears less than it
    /// would.
    fn fill_shares(&self, shares: &mut [f64]) -> bool {
        let formation = self.forces.formation();
        let weights = self.weights.iter().zip(formation.w_inverse());
        let sum: f64 = weights.clone().map(|(weight, share)| weight * share).sum();
        let is_shifting = weights.clone().any(|(weight, share)| *share > 0.0 && *weight < 1.0) && sum > 0.0;
        for (slot, (weight, share)) in shares.iter_mut().zip(weights) {
            *slot = if is_shifting { weight * share / sum } else { *share };
        }
        is_shifting
    }
}

impl Load {
    /// As the scenario has it.
    pub(crate) fn new(scenario: &Scenario, hands_of_robots: Vec<usize>) -> Self {
        let blend = |time_s: f64| scenario.control_period_s / (time_s + scenario.control_period_s);
        Self {
            identifier: LoadIdentifier::new(scenario.control_period_s),
            hand_moment_nm: scenario.load.hand_moment_nm,
            shares: scenario.load.shares.clone(),
            hands_of_robots,
            borne_blend: blend(BORNE_S),
            shares_blend: blend(SHARES_S),
        }
    }

    /// Looks at what is carried. Unless it hangs in the hands alone nothing is to be seen, and nothing is known of what
    /// lies on something.
    pub(crate) fn look(
        &self,
        state: &mut LoadState,
        X_WA: &Pose<World, Object>,
        holding: &Holding<'_>,
        is_free: bool,
    ) {
        if !is_free {
            state.identifier = LoadIdentifierState::zeroed();
            return;
        }
        let formation = holding.forces.formation();
        let mut wrench = Wrench::zero();
        for (_, hand) in holding.hands.iter().enumerate().filter(|(arm, _)| formation.takes_part(*arm)) {
            wrench += hand.wrench.shifted(&(hand.pose.translation - X_WA.translation));
        }
        self.identifier.observe(&mut state.identifier, X_WA, &wrench);
    }

    /// One tick of what follows what was found; then adds to the references of internal forces what relieves the hands,
    /// as far as these references are in force.
    pub(crate) fn share<'a, 'b>(
        &self,
        state: &mut LoadState,
        scratch: &mut LoadScratch,
        X_WA: &Pose<World, Object>,
        holding: &Holding<'_>,
        robots: impl Iterator<Item = (&'a RobotState, &'b Pose<World, Odometry>)>,
        (force, in_force): (&mut GeneralizedForce, f64),
    ) {
        self.follow(state, robots);
        let Some(load) = state.borne(X_WA) else { return };
        let formation = holding.forces.formation();
        let sticks = holding
            .sticks
            .iter()
            .map(|stick| VirtualStick { X_HB: Pose::from_array(stick).unwrap_or_else(Pose::identity) });
        let hands = holding.hands.iter().map(|hand| &hand.pose).zip(sticks);
        let LoadScratch { tips, rows, work, shares } = scratch;
        let is_shifting = holding.fill_shares(shares);
        let moment_nm = largest_moment_of_equal_tips_nm(&load, hands.clone(), shares);
        state.relief = match self.hand_moment_nm > 0.0 {
            true => smooth_step(moment_nm / self.hand_moment_nm - 1.0),
            false => 1.0,
        };
        if state.relief <= 0.0 && !is_shifting {
            return;
        }
        let bearers = holding.hands.iter().zip(self.by_hand(state)).zip(holding.weights).enumerate();
        let bearers = bearers.map(|(arm, ((hand, (share, moment_nm)), weight))| Bearer {
            position_m: hand.pose.translation,
            weight: if formation.takes_part(arm) { share * weight } else { 0.0 },
            moment_nm: moment_nm * *weight,
        });
        if !share_load(&load, &X_WA.translation, bearers, tips) {
            return;
        }
        for (tip, (pose, stick)) in tips.iter_mut().zip(hands) {
            *tip = stick.tip_wrench(pose, tip);
        }
        let mut part = state.relief;
        if is_shifting {
            // As far as hands are not relieved tips bear the load alike, by weight: no internal force among equals.
            for (tip, share) in tips.iter_mut().zip(shares.iter()) {
                *tip = *tip * part + load * (*share * (1.0 - part));
            }
            part = 1.0;
        }
        holding.forces.generalized_force(tips, rows, work);
        let X_AW = X_WA.inverse();
        for (force, row) in force.internal.iter_mut().zip(rows.iter().skip(1)) {
            *force += row.expressed_in(&X_AW) * (part * in_force);
        }
    }

    /// What is borne follows what is found, and shares what each can bear.
    fn follow<'a, 'b>(
        &self,
        state: &mut LoadState,
        robots: impl Iterator<Item = (&'a RobotState, &'b Pose<World, Odometry>)>,
    ) {
        let found = state.body().filter(|body| body.mass_std_kg < CERTAIN * body.mass_kg);
        let found = found.map_or([0.0; 4], |body| {
            let [x, y, z]: [f64; 3] = (body.com_m * body.mass_kg).into();
            [body.mass_kg, x, y, z]
        });
        let is_first = state.borne[0] == 0.0;
        let blend = if is_first { 1.0 } else { self.borne_blend };
        for (borne, found) in state.borne.iter_mut().zip(found) {
            *borne += blend * (found - *borne);
        }
        let mut wanted = [0.0; MAX_ROBOTS];
        let wishes = wanted.iter_mut().zip(&mut state.moments).zip(robots);
        for (robot, ((wanted, moment), (said, X_WO))) in wishes.enumerate() {
            let said_moment = X_WO.rotation * Vector3::from(said.bearing_moment_nm);
            let blend = if is_first { 1.0 } else { self.shares_blend };
            for (moment, said) in moment.iter_mut().zip(said_moment.iter()) {
                *moment += blend * (said.clamp(-MOST_NM, MOST_NM) - *moment);
            }
            // Who has not said how much bears as much as the others.
            let able =
                if said.bearable_n.is_finite() && said.bearable_n > 0.0 { said.bearable_n } else { 0.0 };
            *wanted = self.shares.get(robot).copied().unwrap_or(able);
        }
        let robots = self.hands_of_robots.len();
        let sum: f64 = wanted.iter().take(robots).sum();
        let is_first = is_first || state.shares == [0.0; MAX_ROBOTS];
        let blend = if is_first { 1.0 } else { self.shares_blend };
        for (share, wanted) in state.shares.iter_mut().zip(wanted).take(robots) {
            let wanted = if sum > 0.0 { wanted / sum } else { 1.0 / robots.max(1) as f64 };
            *share += blend * (wanted - *share);
        }
    }

    /// By hand, its weight and its moment: a robot's share is that of all its hands.
    fn by_hand<'a>(&'a self, state: &'a LoadState) -> impl Iterator<Item = (f64, Vector3<f64>)> + Clone + 'a {
        let robots = state.shares.iter().zip(&state.moments).zip(&self.hands_of_robots);
        robots.flat_map(|((share, moment), hands)| {
            let part = 1.0 / (*hands).max(1) as f64;
            core::iter::repeat_n((share * part, Vector3::from(*moment) * part), *hands)
        })
    }
}

impl LoadState {
    fn body(&self) -> Option<CarriedBody> {
        self.identifier.body()
    }

    /// What is borne at rest, at the object's origin.
    fn borne(&self, X_WA: &Pose<World, Object>) -> Option<Wrench<World>> {
        let [mass_kg, x, y, z] = self.borne;
        (mass_kg > 0.0).then(|| {
            let force = Vector3::new(0.0, 0.0, mass_kg * GRAVITY_M_S2);
            Wrench::new(
                force,
                (X_WA.rotation * Vector3::new(x, y, z)).cross(&Vector3::new(0.0, 0.0, GRAVITY_M_S2)),
            )
        })
    }

    /// Says it to observers.
    pub(crate) fn write(&self, team_state: &mut TeamState) {
        team_state.load_share = self.shares;
        team_state.load_relief = self.relief;
        let Some(body) = self.body() else { return };
        team_state.load_mass_kg = body.mass_kg;
        team_state.load_mass_std_kg = body.mass_std_kg;
        team_state.load_com_m = body.com_m.into();
        team_state.load_com_std_m = body.com_std_m.into();
        team_state.load_inertia_kg_m2 = body.inertia_kg_m2;
        team_state.load_inertia_std_kg_m2 = body.inertia_std_kg_m2;
    }
}
