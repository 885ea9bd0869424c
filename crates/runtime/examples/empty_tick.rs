//! How long a tick takes in which nothing is computed: six processes, a full schedule of frames, and
//! one of two ways to wait.
//!
//! ```text
//! cargo run --release -p mikoshi-runtime --example empty_tick -- [ROBOTS] [TICKS] [WORK_US]
//! ```
//!
//! WORK_US is the time that the bridge computes in each tick, as physics would.

use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{
    Board, Call, Domain, Entry, IceoryxTransport, Member, Participant, Placement, Replaceable, Role,
    RunDirectory, TickError, TickSchedule, WaitPolicy, required_bytes, run_service,
};
use std::error::Error;
use std::path::Path;
use std::process::{Child, Command};
use std::time::{Duration, Instant};

#[path = "../tests/support/mod.rs"]
mod support;
use support::Double;

/// Works in every step, and notes when each tick begins.
struct Timed<T: mikoshi_runtime::Transport> {
    inner: Double<T>,
    work: Duration,
    begins: Vec<Instant>,
}

impl<T: mikoshi_runtime::Transport> Participant for Timed<T> {
    fn id(&self) -> ServiceId {
        self.inner.id()
    }

    #[expect(clippy::disallowed_methods, reason = "a measurement of time")]
    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        match call {
            Call::Publish => self.begins.push(Instant::now()),
            Call::Step => {
                let start = Instant::now();
                while start.elapsed() < self.work {}
            }
            _ => {}
        }
        self.inner.compute(call, tick)
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.inner.publish(call, tick)
    }
}

impl<T: mikoshi_runtime::Transport> Replaceable for Timed<T> {
    fn state_schema(&self) -> u64 {
        self.inner.state_schema()
    }

    fn state_bytes(&self) -> usize {
        self.inner.state_bytes()
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        self.inner.save(checkpoint)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        self.inner.load(checkpoint)
    }
}

fn serve(
    run: &Path,
    id: ServiceId,
    schedule: &TickSchedule,
    ticks: u64,
    work: Duration,
    yield_for: Duration,
) -> Result<(), Box<dyn Error>> {
    let member = Member::join(run, Role::Service(id), WaitPolicy { yield_for }, Entry::Vacant)?;
    let transport = IceoryxTransport::open(run, member, schedule)?;
    let inner = Double::new(schedule, &transport, id)?;
    let work = if id == ServiceId::Bridge { work } else { Duration::ZERO };
    let mut service = Timed { inner, work, begins: Vec::with_capacity(ticks as usize) };
    run_service(schedule, &mut service, &transport, ticks)?;
    if id == ServiceId::Bridge {
        let mut periods: Vec<_> =
            service.begins.windows(2).map(|pair| (pair[1] - pair[0]).as_nanos() as f64 * 1e-3).collect();
        periods.sort_by(f64::total_cmp);
        let at = |share: f64| periods[(share * (periods.len() - 1) as f64) as usize];
        println!(
            "yield {:>6} us: p50 {:>7.1} us  p99 {:>7.1} us  max {:>8.1} us  mean {:>7.1} us",
            yield_for.as_micros(),
            at(0.5),
            at(0.99),
            at(1.0),
            periods.iter().sum::<f64>() / periods.len() as f64
        );
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, default: u64| {
        arguments.get(index).map_or(Ok(default), |argument| argument.parse::<u64>())
    };
    let (robots, ticks, work_us) = (number(0, 4)?, number(1, 20_000)?, number(2, 0)?);
    let schedule = TickSchedule::of_team(robots as usize, 0, &Placement::default())?;
    if let Some(run) = arguments.get(5) {
        let id = schedule.services()[number(4, 0)? as usize];
        let yield_for = Duration::from_micros(number(3, 0)?);
        return serve(Path::new(run), id, &schedule, ticks, Duration::from_micros(work_us), yield_for);
    }
    Domain::check_space(required_bytes(&schedule))?;
    println!("{robots} robots, {ticks} ticks, {work_us} us of work in each");
    for yield_us in [0, 20, 50, 100, 200, 1_000_000] {
        let run = RunDirectory::create(&RunDirectory::default_base())?;
        Board::create(run.path(), &schedule.services(), false)?;
        let children = (0..schedule.services().len())
            .map(|index| {
                Command::new(std::env::current_exe()?)
                    .args([robots, ticks, work_us, yield_us, index as u64].map(|value| value.to_string()))
                    .arg(run.path())
                    .spawn()
            })
            .collect::<Result<Vec<Child>, _>>()?;
        for mut child in children {
            let status = child.wait()?;
            if !status.success() {
                return Err(format!("a service ended early: {status}").into());
            }
        }
    }
    Ok(())
}
