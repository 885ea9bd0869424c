//! What the team does and why it stops, in words, when it changes.

use crate::canonical::Observation;
use mikoshi_ipc_types::{TeamState, mode, stop_cause};

/// What was last said.
#[derive(Clone, Debug)]
pub struct Events {
    robots: Vec<String>,
    mode: u64,
    stop_cause: u64,
    absent_hands: u64,
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
        Self { robots, mode: 0, stop_cause: 0, absent_hands: 0, push: 0 }
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
        let lost = team.absent_hands & !core::mem::replace(&mut self.absent_hands, team.absent_hands);
        let cause = stop_cause::name(team.loss_cause);
        for hand in (0..u64::BITS).filter(|hand| lost >> hand & 1 != 0) {
            say(true, format!("hand {hand} of the team lost the object: {cause}"));
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

/// Why a team is in a safe stop, in words; `robot` names each by its index.
pub fn safe_stop_text<'a>(team: &TeamState, robot: impl FnOnce(usize) -> Option<&'a str>) -> String {
    let robot = (team.stop_robot as usize).checked_sub(1).and_then(robot);
    let of_robot = robot.map_or_else(String::new, |robot| format!(", robot {robot}"));
    format!("safe stop: {}{of_robot}", stop_cause::name(team.stop_cause))
}
