//! What the team does and why it stops, in words, when it changes.

use crate::canonical::Observation;
use mikoshi_ipc_types::{MAX_ROBOTS, TeamState, member_fault, member_stage, mode, stop_cause};

/// What was last said.
#[derive(Clone, Debug)]
pub struct Events {
    robots: Vec<String>,
    mode: u64,
    stop_cause: u64,
    lost_hands: u64,
    members: [(u64, u64); MAX_ROBOTS],
    push: u64,
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Event {
    /// Whether something is wrong.
    pub is_warning: bool,
    /// In words.
    pub message: String,
}

impl Events {
    /// Of a team of these robots; nothing has happened yet.
    pub fn of_team(robots: Vec<String>) -> Self {
        Self { robots, mode: 0, stop_cause: 0, lost_hands: 0, members: [(0, 0); MAX_ROBOTS], push: 0 }
    }

    /// What has happened in this tick. Ticks come in order, all of them.
    pub fn observe(&mut self, observation: &Observation) -> Vec<Event> {
        let team = &observation.team_state.payload;
        let mut events = vec![];
        let mut say = |is_warning, message| events.push(Event { is_warning, message });
        if core::mem::replace(&mut self.mode, team.team_mode) != team.team_mode {
            say(false, mode::name(team.team_mode).to_owned());
        }
        if core::mem::replace(&mut self.stop_cause, team.stop_cause) != team.stop_cause
            && team.stop_cause != 0
        {
            say(true, self.stop(team));
        }
        let lost = lost_hands(team);
        let lost = lost & !core::mem::replace(&mut self.lost_hands, lost);
        let cause = stop_cause::name(team.loss_cause);
        for hand in (0..u64::BITS).filter(|hand| lost >> hand & 1 != 0) {
            say(true, format!("hand {hand} of the team lost the object: {cause}"));
        }
        let members = self.robots.iter().zip(&mut self.members);
        let said = team.member_stage.iter().zip(&team.member_fault);
        for ((robot, (stage, fault)), (stage_now, fault_now)) in members.zip(said) {
            if core::mem::replace(stage, *stage_now) != *stage_now {
                say(false, format!("{robot}: {}", member_stage::name(*stage_now)));
            }
            if core::mem::replace(fault, *fault_now) != *fault_now && *fault_now != 0 {
                say(true, format!("{robot} does not go on as asked: {}", member_fault::name(*fault_now)));
            }
        }
        let truth = &observation.object_truth.payload;
        if core::mem::replace(&mut self.push, truth.heard_push_number) != truth.heard_push_number {
            let robot =
                (truth.heard_push_target as usize).checked_sub(1).and_then(|index| self.robots.get(index));
            let whom = robot.map_or("the object", String::as_str);
            let [x, y, z] = truth.heard_push_force_n;
            say(true, format!("{whom} is pushed with {x}, {y}, {z} N for {} ticks", truth.heard_push_ticks));
        }
        events
    }

    fn stop(&self, team: &TeamState) -> String {
        safe_stop_text(team, |index| self.robots.get(index).map(String::as_str))
    }
}

/// Hands that have lost the object, in hand order: those that are away with their robots have not.
pub fn lost_hands(team: &TeamState) -> u64 {
    team.absent_hands & !team.away_hands
}

/// Why a team is in a safe stop, in words; `robot` names each by its index.
pub fn safe_stop_text<'a>(team: &TeamState, robot: impl FnOnce(usize) -> Option<&'a str>) -> String {
    let robot = (team.stop_robot as usize).checked_sub(1).and_then(robot);
    let of_robot = robot.map_or_else(String::new, |robot| format!(", robot {robot}"));
    format!("safe stop: {}{of_robot}", stop_cause::name(team.stop_cause))
}
