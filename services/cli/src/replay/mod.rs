//! Executes services of a recorded run anew, on what they were told, and compares what they say.

mod difference;
mod stage;

use crate::arguments::ReplayArguments;
use crate::binaries::kind_of;
use crate::failure::{Failure, Status};
use crate::outcome::{label_of, robot_name, service_named};
use crate::print::{print_json, print_out};
use crate::revise::revise;
use core::fmt::Write as _;
use difference::Difference;
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::ServiceId;
use mikoshi_observation::{LogReader, Observation, Revision, read_revisions};
use mikoshi_resolution::tick_schedule;
use mikoshi_runtime::{ConnectError, InMemoryTransport, Replaceable, TickError, TickSchedule};
use serde::Serialize;
use stage::Stage;

/// What became of a service.
struct Verdict {
    service: ServiceId,
    /// Where it first said something else, or could not go on.
    first: Option<(u64, Finding)>,
    /// Ticks in which it said something else.
    ticks: u64,
}

/// Why a service is not what it was.
enum Finding {
    Differs(Difference),
    Fails(String),
}

/// What `mikoshi replay --json` prints.
#[derive(Debug, Serialize)]
struct Replayed<'a> {
    /// Whether all services said what they had said, and the log is whole.
    passed: bool,
    ticks: u64,
    ticks_of_run: u64,
    services: Vec<ReplayedService<'a>>,
    damage: Option<Damage>,
}

/// One service.
#[derive(Debug, Serialize)]
struct ReplayedService<'a> {
    service: &'static str,
    robot: Option<&'a str>,
    ticks_differing: u64,
    first_tick: Option<u64>,
    /// What differs there, or why it could not go on.
    first: Option<String>,
}

/// Where the log is no log any more.
#[derive(Debug, Serialize)]
struct Damage {
    after_ticks: u64,
    problem: String,
}

/// `mikoshi replay`; `build` makes a service of a run on its ports.
///
/// # Errors
/// The log can't be read, or a service that it is asked for can't be made: bad usage.
pub fn replay(
    arguments: &ReplayArguments,
    build: impl Fn(&RunSpec, ServiceId, &InMemoryTransport) -> Result<Box<dyn Replaceable>, Failure>,
) -> Result<Status, Failure> {
    let mut log = LogReader::open_unchecked(&arguments.log).map_err(Failure::usage)?;
    let recorded = log.run().clone();
    let revise_again = |run: &RunSpec| match arguments.overrides.as_slice() {
        [] => Ok(run.clone()),
        overrides => revise(run, overrides),
    };
    let run = revise_again(&recorded)?;
    let revisions = read_revisions(&arguments.log).map_err(Failure::usage)?;
    let schedule = tick_schedule(&run).map_err(Failure::usage)?;
    let services = chosen(&run, schedule.services(), &arguments.services)?;
    let mut stages = Vec::new();
    for &service in &services {
        stages.push(Stage::new(&schedule, service, |transport| build(&run, service, transport))?);
    }
    let mut verdicts: Vec<_> =
        services.iter().map(|&service| Verdict { service, first: None, ticks: 0 }).collect();
    let mut ahead = Observation::for_team(run.robots.len());
    let mut is_ahead = log.read_tick(&mut ahead).map_err(Failure::usage)?;
    if is_ahead && ahead.tick() > 0 {
        let first = ahead.tick();
        let message = format!(
            "{} begins in tick {first}: a service is replayed from its first",
            arguments.log.display()
        );
        return Err(Failure::usage(message));
    }
    let mut ticks = 0;
    while is_ahead && arguments.until.is_none_or(|until| ticks < until) {
        let observation = ahead.clone();
        is_ahead = log.read_tick(&mut ahead).map_err(Failure::usage)?;
        let next = is_ahead.then_some(&ahead);
        for Revision { service, run, .. } in revisions.iter().filter(|found| found.tick == observation.tick())
        {
            if let Some(index) = services.iter().position(|other| other == service) {
                let run = revise_again(run)?;
                stages[index].replace(|transport| build(&run, *service, transport))?;
            }
        }
        for (stage, verdict) in stages.iter_mut().zip(&mut verdicts) {
            if !matches!(verdict.first, Some((_, Finding::Fails(_)))) {
                verdict.take(observation.tick(), stage.execute(&observation, next));
            }
        }
        ticks += 1;
    }
    let is_same = verdicts.iter().all(|verdict| verdict.first.is_none());
    let damage = match log.damage() {
        Some(damage) => Some((ticks, damage.to_string())),
        // Something may have changed that no service hears or says.
        None if is_same && arguments.until.is_none() => checked_damage(arguments)?,
        None => None,
    };
    let is_whole = damage.is_none();
    match arguments.json {
        true => print_json(&Replayed::of(&run, &verdicts, ticks, damage))?,
        false => print_out(&tell(&run, &schedule, &verdicts, ticks, damage)),
    }
    Ok(if is_same && is_whole { Status::Met } else { Status::NotMet })
}

impl<'a> Replayed<'a> {
    fn of(run: &'a RunSpec, verdicts: &[Verdict], ticks: u64, damage: Option<(u64, String)>) -> Self {
        let services = verdicts.iter().map(|Verdict { service, first, ticks }| ReplayedService {
            service: kind_of(*service),
            robot: robot_name(run, *service),
            ticks_differing: *ticks,
            first_tick: first.as_ref().map(|(tick, _)| *tick),
            first: first.as_ref().map(|(_, finding)| match finding {
                Finding::Differs(difference) => difference.to_string(),
                Finding::Fails(error) => error.clone(),
            }),
        });
        Self {
            passed: damage.is_none() && verdicts.iter().all(|verdict| verdict.first.is_none()),
            ticks,
            ticks_of_run: run.ticks,
            services: services.collect(),
            damage: damage.map(|(after_ticks, problem)| Damage { after_ticks, problem }),
        }
    }
}

impl Verdict {
    /// What differs first comes first: in a tick, what is published first.
    fn rank(&self, schedule: &TickSchedule) -> (u64, Option<usize>) {
        let place = |topic| schedule.outputs().position(|(_, output)| output.topic == topic);
        match &self.first {
            None => (u64::MAX, None),
            Some((tick, Finding::Differs(difference))) => (*tick, place(difference.topic)),
            Some((tick, Finding::Fails(_))) => (*tick, None),
        }
    }

    fn take(&mut self, tick: u64, executed: Result<Option<Difference>, TickError>) {
        let finding = match executed {
            Ok(None) => return,
            Ok(Some(difference)) => Finding::Differs(difference),
            Err(error) => Finding::Fails(error.to_string()),
        };
        self.ticks += 1;
        self.first.get_or_insert((tick, finding));
    }
}

/// Up to which tick the log's own checksums hold, and why no further.
fn checked_damage(arguments: &ReplayArguments) -> Result<Option<(u64, String)>, Failure> {
    let mut log = LogReader::open(&arguments.log).map_err(Failure::usage)?;
    let mut ticks = 0;
    while let Some(payload) = log.next_payload().map_err(Failure::usage)? {
        ticks = payload.tick + 1;
    }
    Ok(log.damage().map(|damage| (ticks, damage.to_string())))
}

fn chosen(run: &RunSpec, services: Vec<ServiceId>, names: &[String]) -> Result<Vec<ServiceId>, Failure> {
    if names.is_empty() {
        return Ok(services);
    }
    let find =
        |name: &String| service_named(run, name).map_err(|error| Failure::usage(error).context("--service"));
    names.iter().map(find).collect()
}

fn tell(
    run: &RunSpec,
    schedule: &TickSchedule,
    verdicts: &[Verdict],
    ticks: u64,
    damage: Option<(u64, String)>,
) -> String {
    let mut text = String::new();
    for Verdict { service, first, ticks: differing } in verdicts {
        let label = label_of(run, *service);
        // Writing to a String can't fail.
        let _ = match first {
            None => writeln!(text, "{label}: the same to the last bit in {ticks} ticks"),
            Some((tick, Finding::Differs(difference))) => {
                let robot = run.robots.get(difference.topic.robot).filter(|_| service.robot().is_some());
                let of_robot =
                    robot.map_or_else(String::new, |robot| format!(" (robot {})", robot.member.name));
                writeln!(
                    text,
                    "{label}: differs in {differing} of {ticks} ticks, first in tick {tick}{of_robot}: {difference}"
                )
            }
            Some((tick, Finding::Fails(error))) => writeln!(text, "{label}: fails in tick {tick}: {error}"),
        };
    }
    let differing = verdicts.iter().filter(|verdict| verdict.first.is_some());
    if differing.clone().count() > 1
        && let Some(cause) = differing.min_by_key(|verdict| verdict.rank(schedule))
    {
        let _ = writeln!(text, "the first of all: {}", label_of(run, cause.service));
    }
    if let Some((whole_ticks, damage)) = damage {
        let whole = run.ticks;
        let _ = writeln!(text, "the log is cut or damaged after {whole_ticks} of {whole} ticks: {damage}");
    } else if ticks < run.ticks {
        let _ = writeln!(text, "the log holds {ticks} of {} ticks", run.ticks);
    }
    text
}

impl From<TickError> for Failure {
    fn from(error: TickError) -> Self {
        Self::fault(error)
    }
}

impl From<ConnectError> for Failure {
    fn from(error: ConnectError) -> Self {
        Self::fault(error)
    }
}
