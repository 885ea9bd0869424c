//! `mikoshi latency`: how long frames take between services, and services from input to output, with what the
//! machine adds to that.

mod compare;
mod costs;
mod load;
mod machine;
mod page;
mod result;

use crate::arguments::LatencyArguments;
use crate::failure::{Failure, Status};
use crate::observer::RunObserver;
use crate::outcome::Outcome;
use crate::output_directory::{LATENCY, OutputDirectory};
use crate::prepare::prepare_paced;
use crate::print::{print_json, print_out};
use crate::supervisor;
use core::time::Duration;
pub use costs::Costs;
use load::Load;
use machine::{CoreLateness, MachineWatch, is_the_machines};
use mikoshi_config::scenario::Clock;
use mikoshi_observation::LatencyFigures;
use mikoshi_report::write_latency;
use result::{LatencyResult, Lateness};
use std::fs;

/// How long the idle machine is watched.
const IDLE: Duration = Duration::from_secs(2);
/// Ticks in which memory is touched for the first time, and caches fill.
pub const WARM_UP_TICKS: u64 = 200;

/// Measures a run, or compares two measurements.
///
/// # Errors
/// Bad usage or configuration, or a fault of the system.
pub fn latency(arguments: &LatencyArguments) -> Result<Status, Failure> {
    if let [first, second] = &arguments.compare[..] {
        let rows = compare::compare(first, second)?;
        match arguments.json {
            true => print_json(&rows)?,
            false => print_out(&compare::to_text(&rows)),
        }
        return Ok(Status::Met);
    }
    let Some(scenario) = arguments.scenario() else {
        return Err(Failure::usage("a scenario is missing, or --compare A.json B.json"));
    };
    let mut prepared = prepare_paced(&scenario, arguments.real_time)?;
    prepared.is_empty = arguments.empty;
    let run = &prepared.run;
    if run.ticks <= 2 * WARM_UP_TICKS {
        let least = 2.0 * WARM_UP_TICKS as f64 * run.scenario.control_period_s;
        return Err(Failure::usage(format!(
            "duration_s: expected more than {least} s, to have something left"
        )));
    }
    let name = format!("latency-{}", run.scenario.name);
    let out = OutputDirectory::of(&arguments.results, &name, run.scenario.seed)?;
    let fifo_priority = run.scenario.placement.fifo_priority;
    let machine_idle = machine::idle(IDLE, fifo_priority);
    let mut observer = RunObserver::new(&prepared, &arguments.results, &out)?.measuring(&prepared);
    let (load, watch) = (Load::start(arguments.load), MachineWatch::start(fifo_priority));
    let outcome = supervisor::supervise(&prepared, &out, &mut observer);
    let machine = watch.stop();
    drop(load);
    match outcome? {
        Outcome::Completed => {}
        Outcome::Interrupted(signal) => {
            return Err(Failure { status: Status::Signal(signal), message: "interrupted".to_owned() });
        }
        Outcome::Fault { failure, .. } => return Err(failure),
    }
    let (figures, costs) = observer.measured();
    let summary = observer.finish(run, vec![]);
    let is_lockstep = run.scenario.clock == Clock::Lockstep;
    let spans = figures.spans();
    let path_ns = result::critical_path_ns(&spans, run.robots.len(), machine.len());
    let result = LatencyResult {
        scenario: run.scenario.name.clone(),
        robots: run.robots.len(),
        seed: run.scenario.seed,
        empty: arguments.empty,
        clock: match run.scenario.clock {
            Clock::Lockstep => "lockstep".to_owned(),
            Clock::Wall => "wall".to_owned(),
        },
        control_period_s: run.scenario.control_period_s,
        yield_us: run.scenario.placement.yield_us,
        fifo_priority,
        load: arguments.load,
        ticks: figures.ticks(),
        spans,
        critical_path_ns: path_ns.filter(|_| is_lockstep && !arguments.empty),
        late: lateness(&figures, &machine),
        late_ticks: figures.late().to_vec(),
        // Services that compute nothing don't say what they heard.
        ticks_held: if arguments.empty { 0 } else { summary.timing.ticks_held },
        frames_lost: summary.timing.frames_lost,
        processes: costs.of(run),
        machine_idle,
        machine,
        worst: figures.worst().to_vec(),
    };
    let mut text = serde_json::to_string_pretty(&result).map_err(Failure::fault)?;
    text.push('\n');
    let file = out.path().join(LATENCY);
    fs::write(&file, &text).map_err(|error| Failure::fault(error).context(file.display()))?;
    write_latency(&page::page_of(&result), out.path()).map_err(Failure::fault)?;
    if arguments.json {
        print_out(&text);
    } else if !arguments.results.quiet {
        print_out(&result.to_text(out.path()));
    }
    Ok(Status::Met)
}

fn lateness(figures: &LatencyFigures, machine: &[CoreLateness]) -> Lateness {
    let mut lateness = Lateness::default();
    for late in figures.late() {
        lateness.ticks += 1;
        match is_the_machines(late, machine) {
            Some(true) => lateness.by_the_machine += 1,
            Some(false) => lateness.by_us += 1,
            None => lateness.by_nobody_knows += 1,
        }
    }
    lateness
}
