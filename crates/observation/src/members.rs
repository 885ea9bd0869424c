//! Robots that leave and join: when, and what it cost the others.

use crate::canonical::Observation;
use crate::internal::{JUDGED_AFTER_S, raise};
use crate::summary::MemberSummary;
use crate::truth::TrackedObject;
use mikoshi_ipc_types::{MAX_ROBOTS, PoseWire, member_fault, member_stage, mode};
use nalgebra::Vector3;

/// The stages of robots that leave or join, one after the other, each with what was largest while it lasted.
#[derive(Clone, Debug)]
pub(crate) struct MemberFigures {
    /// How long after its start the law is judged.
    judged_after: u64,
    start_tick: Option<u64>,
    names: Vec<String>,
    hands: Vec<usize>,
    /// Where in `stages` each robot's present one is.
    present: Vec<usize>,
    /// Why each could not go on, as it was last said.
    faults: [u64; MAX_ROBOTS],
    stages: Vec<Stage>,
    /// References of all hands in the last tick.
    references: Vec<PoseWire>,
}

#[derive(Clone, Debug)]
struct Stage {
    robot: usize,
    stage: u64,
    tick: u64,
    figures: MemberSummary,
}

impl MemberFigures {
    pub(crate) fn new(control_period_s: f64, robots: impl Iterator<Item = (String, usize)>) -> Self {
        let (names, hands) = robots.unzip();
        let judged_after = (JUDGED_AFTER_S / control_period_s).round() as u64;
        Self {
            judged_after,
            start_tick: None,
            names,
            hands,
            present: vec![],
            faults: [0; MAX_ROBOTS],
            stages: vec![],
            references: vec![],
        }
    }

    pub(crate) fn observe(&mut self, observation: &Observation, object: &TrackedObject) {
        let team = &observation.team_state.payload;
        if !mode::is_hybrid(team.team_mode) {
            self.references.clear();
            return;
        }
        let references = observation.team_command.iter().zip(&self.hands);
        let references: Vec<_> = references
            .flat_map(|(command, hands)| &command.payload.hand_pose_ref[..*hands])
            .copied()
            .collect();
        let step_m = largest_step_m(&self.references, &references);
        self.references = references;
        let of_row = |row: &mikoshi_spatial::Wrench<_>| row.force.norm();
        let internal_n = object.internal.iter().map(of_row).fold(0.0, f64::max);
        let error = object.X_WA_ref.map(|X_WA_ref| X_WA_ref.displacement_to(&object.X_WA));
        let object_m = error.map_or(0.0, |error| error.linear.norm());
        let start = *self.start_tick.get_or_insert(observation.tick());
        let is_judged = observation.tick() >= start + self.judged_after;
        let robots = team.member_stage.iter().zip(&team.member_fault).take(self.names.len().min(MAX_ROBOTS));
        for (robot, (&stage, &fault)) in robots.enumerate() {
            let is_new = self.present.get(robot).is_none_or(|&present| self.stages[present].stage != stage);
            if is_new {
                let present = self.stages.len();
                match self.present.get_mut(robot) {
                    Some(slot) => *slot = present,
                    None => self.present.push(present),
                }
                let figures = MemberSummary {
                    robot: self.names[robot].clone(),
                    stage: member_stage::name(stage).to_owned(),
                    tick: observation.tick(),
                    ..MemberSummary::default()
                };
                self.stages.push(Stage { robot, stage, tick: observation.tick(), figures });
            }
            let figures = &mut self.stages[self.present[robot]].figures;
            figures.ticks += 1;
            raise(&mut figures.hand_step_max_m, step_m);
            if is_judged {
                raise(&mut figures.internal_peak_n, internal_n);
            }
            raise(&mut figures.object_peak_m, object_m);
            if core::mem::replace(&mut self.faults[robot], fault) != fault && fault != 0 {
                figures.fault = Some(member_fault::name(fault).to_owned());
            }
        }
    }

    /// Of robots that have ever been anything else than members.
    pub(crate) fn finish(self) -> Vec<MemberSummary> {
        let others = self
            .stages
            .iter()
            .filter(|stage| stage.stage != member_stage::MEMBER || stage.figures.fault.is_some());
        let concerned = others.fold(0_u64, |set, stage| set | 1 << stage.robot);
        let mut stages = self.stages;
        stages.retain(|stage| concerned >> stage.robot & 1 != 0);
        stages.sort_by_key(|stage| (stage.tick, stage.robot));
        stages.into_iter().map(|stage| stage.figures).collect()
    }
}

/// How far the hand went that went farthest.
fn largest_step_m(before: &[PoseWire], now: &[PoseWire]) -> f64 {
    let position = |[x, y, z, ..]: &PoseWire| Vector3::new(*x, *y, *z);
    before.iter().zip(now).map(|(before, now)| (position(now) - position(before)).norm()).fold(0.0, f64::max)
}
