//! What is asked for while a run goes on: processes that are replaced while they are in charge, and what the
//! operator says.

use crate::children::Children;
use crate::control::{Client, Control, Request};
use crate::membership::asked_from;
use crate::observer::RunObserver;
use crate::outcome::{label_of, service_named, swap_of};
use crate::revise::{may_be_set, revise};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::PushEvent;
use mikoshi_ipc_types::{Push, ServiceId, operator};
use mikoshi_resolution::{read_spec, write_spec};
use mikoshi_runtime::{Board, RunDirectory};
use std::path::{Path, PathBuf};

/// Who follows gains, limits and references.
const COORDINATOR: &str = "coordinator";

/// Those of a run, and what has become of them so far.
pub struct Requests {
    control: Control,
    run_directory: PathBuf,
    pending: Vec<Pending>,
    push: Option<PendingPush>,
}

/// A push that the world has not heard of yet.
struct PendingPush {
    number: u64,
    client: Client,
    /// In words.
    told: String,
}

/// A successor on its way.
struct Pending {
    service: ServiceId,
    /// Of its predecessor.
    epoch: u64,
    client: Client,
    /// Its run, if it is another.
    revised: Option<RunSpec>,
    /// What is in force then, if that was asked for and not the process.
    settings: Option<String>,
}

impl Requests {
    /// Of the run in this directory.
    ///
    /// # Errors
    /// Nobody could ask.
    pub fn listen(run_directory: &Path) -> std::io::Result<Self> {
        let control = Control::listen(run_directory)?;
        Ok(Self { control, run_directory: run_directory.to_owned(), pending: Vec::new(), push: None })
    }

    /// Whether a successor of this service is on its way.
    pub fn is_pending(&self, service: ServiceId) -> bool {
        self.pending.iter().any(|pending| pending.service == service)
    }

    /// Takes requests, and sees to those that were taken.
    pub fn look(
        &mut self,
        run: &RunSpec,
        board: &Board,
        children: &mut Children,
        observer: &mut RunObserver,
    ) {
        match self.control.next() {
            Some((Request::Swap { service, set, program }, client)) => {
                match self.begin(run, board, children, &service, &set, program, |_, _| Ok(())) {
                    Ok((service, epoch, revised)) => {
                        self.pending.push(Pending { service, epoch, client, revised, settings: None });
                    }
                    Err(message) => client.refuse(message),
                }
            }
            Some((Request::Set { set }, client)) => {
                match self.begin(run, board, children, COORDINATOR, &set, None, may_be_set) {
                    Ok((service, epoch, revised)) => {
                        let told = set.iter().map(|(key, value)| format!("{key}={value}"));
                        let settings = Some(told.collect::<Vec<_>>().join(", "));
                        self.pending.push(Pending { service, epoch, client, revised, settings });
                    }
                    Err(message) => client.refuse(message),
                }
            }
            Some((Request::Membership { robot, leaves }, client)) => {
                match self.begin_membership(run, board, children, &robot, leaves) {
                    Ok((service, epoch, revised)) => {
                        let settings = Some(match leaves {
                            true => format!("{robot} is asked to leave"),
                            false => format!("{robot} is asked to join"),
                        });
                        self.pending.push(Pending { service, epoch, client, revised, settings });
                    }
                    Err(message) => client.refuse(message),
                }
            }
            Some((Request::Push { on, force_n, for_s }, client)) => {
                match self.begin_push(run, board, &on, force_n, for_s) {
                    Ok((number, told)) => self.push = Some(PendingPush { number, client, told }),
                    Err(message) => client.refuse(message),
                }
            }
            Some((Request::Stop, client)) => {
                board.say(operator::STOP);
                client.done("the team is told to stop".to_owned());
            }
            Some((Request::Resume, client)) => {
                board.say(operator::RESUME);
                client.done("the team is told to go on".to_owned());
            }
            None => {}
        }
        let (number, tick) = observer.heard_push();
        if let Some(PendingPush { client, told, .. }) = self.push.take_if(|push| push.number == number) {
            client.done(format!("{told} from tick {tick} on"));
        }
        let mut index = 0;
        while let Some(Pending { service, epoch, .. }) = self.pending.get(index) {
            let (service, epoch) = (*service, *epoch);
            let charge = board.charge_of(service).filter(|(current, _)| *current > epoch);
            let has_ended = children.candidate(service).is_none_or(|process| process.ended.is_some());
            let in_charge = board.process_of(service).map(|process| process.pid);
            let is_candidate = in_charge == children.candidate(service).map(|process| process.id());
            match charge {
                // Its predecessor was lost meanwhile, and a standby was first.
                Some(_) if !is_candidate && !has_ended => {
                    let label = label_of(run, service);
                    let client = self.pending.swap_remove(index).client;
                    client.refuse(format!("{label} was just replaced by its standby: ask again"));
                    children.dismiss(service);
                }
                Some((_, since)) if is_candidate => {
                    let Pending { client, revised, settings, .. } = self.pending.swap_remove(index);
                    children.promote(service);
                    let swap = swap_of(run, service, since.tick + 1, "swap".to_owned());
                    client.done(match settings {
                        Some(settings) => format!("{settings} from tick {} on", swap.tick),
                        None => format!("{} replaced in tick {}", label_of(run, service), swap.tick),
                    });
                    if let Some(revised) = revised {
                        observer.note_revision(&swap, service, &revised);
                    }
                    observer.note_swap(service, swap);
                }
                _ if has_ended => {
                    let words = children.candidate(service).map(|process| process.last_words());
                    let label = label_of(run, service);
                    let words = words.unwrap_or_default();
                    let client = self.pending.swap_remove(index).client;
                    client.refuse(format!("{label} stays: its successor has ended{words}"));
                    children.dismiss(service);
                }
                _ => index += 1,
            }
        }
    }

    /// A name for a description of the run that none has yet.
    fn free_spec(&self) -> PathBuf {
        let named = |number| self.run_directory.join(format!("run-{number}.bin"));
        (1_u32..).map(named).find(|path| !path.exists()).unwrap_or_else(|| named(0))
    }

    fn begin_membership(
        &mut self,
        run: &RunSpec,
        board: &Board,
        children: &mut Children,
        robot: &str,
        leaves: bool,
    ) -> Result<(ServiceId, u64, Option<RunSpec>), String> {
        let current = children.variant(service_named(run, COORDINATOR)?).spec;
        let current = current.as_deref().map(read_spec).transpose().map_err(|error| error.to_string())?;
        let tick = board.last_position(ServiceId::Bridge).map_or(0, |position| position.tick);
        let set = [asked_from(current.as_ref().unwrap_or(run), robot, leaves, tick)?];
        self.begin(run, board, children, COORDINATOR, &set, None, may_be_set)
    }

    fn begin_push(
        &self,
        run: &RunSpec,
        board: &Board,
        on: &str,
        force_n: [f64; 3],
        for_s: f64,
    ) -> Result<(u64, String), String> {
        let scenario = &run.scenario;
        let target = scenario.push_target(on).ok_or_else(|| {
            let names: Vec<_> = scenario.robots.iter().map(|member| member.name.as_str()).collect();
            format!("found {on:?}, expected object or one of {}", names.join(", "))
        })?;
        let ticks = scenario.tick_at(for_s).max(1);
        if !(for_s > 0.0 && for_s <= PushEvent::MAX_S) {
            return Err(format!(
                "--for: found {for_s}, expected more than 0, at most {} s",
                PushEvent::MAX_S
            ));
        }
        let push = Push { number: 0, target, force_n, ticks };
        if !push.is_credible() {
            return Err(format!(
                "--force: found {force_n:?}, expected forces of at most {} N",
                Push::MAX_FORCE_N
            ));
        }
        if self.push.is_some() {
            return Err("a push is on its way already".to_owned());
        }
        let [x, y, z] = force_n;
        let told = format!("{on} is pushed with {x}, {y}, {z} N for {ticks} ticks");
        Ok((board.push(target, force_n, ticks), told))
    }

    #[expect(clippy::too_many_arguments, reason = "what is asked for, of whom, and in which run")]
    fn begin(
        &mut self,
        run: &RunSpec,
        board: &Board,
        children: &mut Children,
        name: &str,
        set: &[(String, String)],
        program: Option<PathBuf>,
        may_be: impl FnOnce(&RunSpec, &RunSpec) -> Result<(), String>,
    ) -> Result<(ServiceId, u64, Option<RunSpec>), String> {
        let service = service_named(run, name)?;
        if RunDirectory::is_kept(&self.run_directory) {
            return Err(format!("{name} is started by systemd: restart its standby's unit, then its own"));
        }
        if self.is_pending(service) {
            return Err(format!("a successor of {name} is on its way already"));
        }
        let (epoch, _) = board.charge_of(service).ok_or("the board has no such service")?;
        // What it does not say stays as it is.
        let mut variant = children.variant(service);
        variant.program = program.or(variant.program);
        let revised = match set {
            [] => None,
            set => {
                let current = variant.spec.as_deref().map(read_spec).transpose();
                let current = current.map_err(|error| error.to_string())?;
                let current = current.as_ref().unwrap_or(run);
                let revised = revise(current, set).map_err(|failure| failure.message)?;
                may_be(current, &revised)?;
                let path = self.free_spec();
                write_spec(&path, &revised).map_err(|error| error.to_string())?;
                variant.spec = Some(path);
                Some(revised)
            }
        };
        children.nominate(service, variant).map_err(|failure| failure.message)?;
        Ok((service, epoch, revised))
    }
}
