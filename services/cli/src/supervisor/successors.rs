//! Who takes whose place: successors of those that die, standbys, those that are frozen.

use super::{Supervisor, is_paced};
use crate::failure::as_lines;
use crate::observer::RunObserver;
use crate::outcome::{fault_of, label_of, swap_of};
use crate::prepare::Prepared;
use crate::print::print_error;
use crate::succession::Vacancy;
use core::time::Duration;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Clock, Position, State};

/// A service without a standby that is so far behind the clock is taken to be frozen: what queues up for its
/// successor is four times as much in most runs.
const PATIENCE: Duration = Duration::from_millis(40);

impl Supervisor {
    /// Hears what is asked for, and takes note of successors that somebody else has started.
    pub(super) fn look_on(&mut self, prepared: &Prepared, observer: &mut RunObserver) {
        let (run, board) = (&prepared.run, self.member.board());
        self.requests.look(run, board, &mut self.children, observer);
        let Some(known) = &mut self.attended else { return };
        for service in prepared.schedule.services() {
            let Some((epoch, since)) = board.charge_of(service).filter(|(epoch, _)| *epoch > 0) else {
                continue;
            };
            let before = known.insert(service, epoch);
            if before.is_some_and(|before| before < epoch) {
                observer.note_swap(service, swap_of(run, service, since.tick + 1, "taken over".to_owned()));
            }
        }
    }

    /// Sees to successors of processes that were killed; `false` if somebody is lost for good.
    pub(super) fn look_after(&mut self, prepared: &Prepared, observer: &mut RunObserver) -> bool {
        let run = &prepared.run;
        self.children.look();
        self.requests.look(run, self.member.board(), &mut self.children, observer);
        self.see_to_standbys(prepared, observer);
        self.see_to_frozen(prepared, observer);
        let fallen = self.children.processes().iter().filter(|process| {
            let service = process.service;
            // Whose successor waits already needs no other.
            let is_succeeded = self.succession.is_due(service)
                || self.requests.is_pending(service)
                || self.children.has_standby(service);
            process.has_failed() && !is_succeeded && !self.lost.contains(&service)
        });
        let fallen: Vec<_> = fallen.map(|process| (process.service, process.death())).collect();
        for (service, death) in fallen {
            let (at, has_said_why) = self.last_position(service);
            let cause = death.filter(|_| !has_said_why);
            let may_go_on = cause.is_some_and(|cause| self.succession.take_note(service, at, cause));
            if !may_go_on && !self.give_up(prepared, service, at.tick, observer) {
                return false;
            }
        }
        while let Some(Vacancy { service, at, cause }) = self.succession.next() {
            // Where one took over by itself, what is missing is the next that can.
            let is_served =
                self.children.processes().iter().any(|p| p.service == service && p.ended.is_none());
            if is_served {
                if self.children.stand_by(service).is_err() {
                    return false;
                }
                continue;
            }
            if self.children.succeed(service).is_err() {
                return false;
            }
            observer.note_swap(service, swap_of(run, service, at.tick, cause));
        }
        true
    }

    /// Goes on without a service, if a run can: by the clock, and if it is not the world.
    fn give_up(
        &mut self,
        prepared: &Prepared,
        service: ServiceId,
        tick: u64,
        observer: &mut RunObserver,
    ) -> bool {
        let may_go_on = is_paced(prepared) && service != ServiceId::Bridge;
        if may_go_on && self.lost.insert(service) {
            let run = &prepared.run;
            let label = label_of(run, service);
            print_error(&as_lines("warning", &format!("{label} is lost in tick {tick}; the team stops")));
            observer.note_fault(fault_of(run, service, tick, "lost".to_owned()));
        }
        may_go_on
    }

    /// Starts standbys, and sees which have taken over.
    fn see_to_standbys(&mut self, prepared: &Prepared, observer: &mut RunObserver) {
        let run = &prepared.run;
        if !is_paced(prepared) || !run.scenario.supervision.standby {
            return;
        }
        if !self.stands_by && self.all_services_are(State::Running) {
            self.stands_by = true;
            for service in prepared.schedule.services() {
                // Without the world there is nobody to keep up with.
                let needs_one = service != ServiceId::Bridge && !self.children.has_standby(service);
                if needs_one && self.children.stand_by(service).is_err() {
                    print_error(&as_lines("warning", &format!("{} has no standby", label_of(run, service))));
                }
            }
        }
        let board = self.member.board();
        let in_charge = |service| board.process_of(service).map(|process| process.pid);
        for (service, cause) in self.children.note_promotions(in_charge) {
            let since = self.member.board().charge_of(service).map_or(0, |(_, since)| since.tick);
            observer.note_swap(service, swap_of(run, service, since + 1, cause.clone()));
            self.ask_for_standby(service, cause);
        }
        for service in self.children.lost_standbys() {
            if !self.service_states().any(|(other, state)| other == service && state.has_ended()) {
                self.ask_for_standby(service, "the standby ended".to_owned());
            }
        }
    }

    /// Has those replaced that are behind the clock and have no standby, while their successors can still make up
    /// for it. Where nobody is replaced they may still come back.
    fn see_to_frozen(&mut self, prepared: &Prepared, observer: &mut RunObserver) {
        let Clock::Wall { period_ns } = prepared.schedule.clock() else { return };
        if !self.succession.is_promised() {
            return;
        }
        let patience_ticks = PATIENCE.as_nanos() as u64 / period_ns.max(1) + 2;
        let world = self.last_position(ServiceId::Bridge).0.tick;
        let is_behind = |at: Position| at.tick.saturating_add(patience_ticks) < world;
        let behind = self.member.board().positions().filter(|(_, at)| is_behind(*at));
        for (service, at) in behind.collect::<Vec<_>>() {
            let process = self.children.processes().iter().find(|process| process.service == service);
            let is_seen_to = process.is_none_or(|process| process.ended.is_some())
                || self.succession.is_due(service)
                || self.requests.is_pending(service)
                || self.children.has_standby(service)
                || self.lost.contains(&service)
                || self.is_starting(service);
            if is_seen_to {
                continue;
            }
            self.children.kill_frozen(&[service]);
            if !self.succession.take_note(service, at, "fell behind".to_owned()) {
                self.give_up(prepared, service, at.tick, observer);
            }
        }
    }

    /// Whether a process has this place that does not execute ticks yet.
    fn is_starting(&self, service: ServiceId) -> bool {
        self.service_states().any(|(other, state)| other == service && state < State::Running)
            || self.children.processes().iter().any(|process| {
                process.service == service
                    && self.member.board().process_of(service).map(|owner| owner.pid) != Some(process.id())
            })
    }

    fn ask_for_standby(&mut self, service: ServiceId, cause: String) {
        let (at, _) = self.last_position(service);
        // One too many: the last that is in charge has none behind it.
        let _ = self.succession.take_note(service, at, cause);
    }

    /// Kills those that are frozen, for their successors' sake; `false` if they may have none.
    pub(super) fn replace_frozen(&mut self, culprits: &[ServiceId]) -> bool {
        let may_all = culprits.iter().all(|&service| {
            let (at, _) = self.last_position(service);
            self.succession.take_note(service, at, "frozen".to_owned())
        });
        if may_all {
            self.children.kill_frozen(culprits);
        }
        may_all
    }
}
