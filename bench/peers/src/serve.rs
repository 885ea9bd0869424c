//! One process of a team.

use crate::carrier::Carrier;
use crate::driver::{Driver, DriverError, Wait};
use crate::drivers;
use crate::ports::Ports;
use crate::team::{schedule, services};
use crate::witness::{Fault, Witness};
use clap::Args;
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{
    Call, Double, Entry, IceoryxTransport, Member, Participant, RealTime, Replaceable, Role, Session,
    TickError, TickSchedule, Transport, now_ns, run_service,
};
use std::io::Read;
use std::path::{Path, PathBuf};

/// The file in which the bridge says when its ticks began.
pub const TIMES: &str = "times";

/// Which process of which team it is.
#[derive(Debug, Args)]
pub struct Service {
    #[arg(long)]
    place: PathBuf,
    #[arg(long)]
    service: String,
    #[arg(long)]
    carrier: Carrier,
    #[arg(long)]
    wait: Wait,
    #[arg(long)]
    ticks: u64,
    #[arg(long)]
    check: bool,
    #[arg(long)]
    fault: Option<Fault>,
}

/// Takes part from the first tick to the last, says what it came to, and ends when it is no longer spoken to.
///
/// # Errors
/// It can't take its place, or a frame is not what was sent.
pub fn serve(arguments: &Service) -> Result<(), DriverError> {
    // Who has started it may be killed.
    let signal = Some(rustix::process::Signal::KILL);
    rustix::process::set_parent_process_death_signal(signal).map_err(DriverError::of)?;
    let (schedule, place, wait) = (schedule(), arguments.place.as_path(), arguments.wait);
    let service = services().find(|service| service.to_string() == arguments.service);
    let service = service.ok_or_else(|| DriverError(format!("no service `{}`", arguments.service)))?;
    // Before any other thread: a library's own inherit the core.
    let core = schedule.phases_of(service).find_map(|phase| phase.core);
    let rights = RealTime { core, ..RealTime::default() };
    for missing in rights.apply().map_err(DriverError::of)? {
        eprintln!("warning: {missing}");
    }
    let numbers = match arguments.carrier {
        Carrier::Mikoshi | Carrier::MikoshiUnobserved => {
            let member = Member::join(place, Role::Service(service), wait.policy(), Entry::Vacant);
            let member = member.map_err(DriverError::of)?;
            let transport = IceoryxTransport::open(place, member, &schedule).map_err(DriverError::of)?;
            run(arguments, &schedule, service, &transport)
        }
        Carrier::Raw => run_over::<drivers::raw::Raw>(arguments, &schedule, service),
        Carrier::Iceoryx2 => run_over::<drivers::iceoryx::Iceoryx>(arguments, &schedule, service),
        Carrier::Sockets => run_over::<drivers::sockets::Sockets>(arguments, &schedule, service),
        #[cfg(feature = "zenoh")]
        Carrier::Zenoh => run_over::<drivers::zenoh::Zenoh>(arguments, &schedule, service),
        #[cfg(feature = "dds")]
        Carrier::Cyclonedds => run_over::<drivers::dds::Dds>(arguments, &schedule, service),
    }?;
    println!("{numbers}");
    std::io::stdin().read_to_end(&mut Vec::new()).map_err(DriverError::of)?;
    Ok(())
}

fn run_over<D: Driver>(
    arguments: &Service,
    schedule: &TickSchedule,
    service: ServiceId,
) -> Result<String, DriverError> {
    let driver = D::open(&arguments.place, service, arguments.wait)?;
    let numbers = run(arguments, schedule, service, &Ports::new(driver, schedule, service))?;
    Ok(numbers)
}

fn run<T: Transport + Session>(
    arguments: &Service,
    schedule: &TickSchedule,
    service: ServiceId,
    transport: &T,
) -> Result<String, DriverError> {
    let Service { place, ticks, .. } = arguments;
    if arguments.check {
        let witness = Witness::new(transport, arguments.fault);
        let double = Double::new(schedule, &witness, service).map_err(DriverError::of)?;
        return see_through(schedule, double, transport, *ticks, place);
    }
    let double = Double::new(schedule, transport, service).map_err(DriverError::of)?;
    see_through(schedule, double, transport, *ticks, place)
}

fn see_through<P: Replaceable>(
    schedule: &TickSchedule,
    participant: P,
    session: &impl Session,
    ticks: u64,
    place: &Path,
) -> Result<String, DriverError> {
    let mut timed = Timed { inner: participant, times_ns: Vec::with_capacity(ticks as usize) };
    run_service(schedule, &mut timed, session, ticks).map_err(DriverError::of)?;
    if timed.id() == ServiceId::Bridge {
        let times: Vec<u8> = timed.times_ns.iter().flat_map(|time| time.to_le_bytes()).collect();
        std::fs::write(place.join(TIMES), times).map_err(DriverError::of)?;
    }
    numbers_of(&mut timed.inner)
}

/// What a service came to.
pub fn numbers_of(participant: &mut impl Replaceable) -> Result<String, DriverError> {
    let mut state = vec![0; participant.state_bytes()];
    let length = participant.save(&mut state).map_err(DriverError::of)?;
    Ok(state[..length].iter().map(|byte| format!("{byte:02x}")).collect())
}

/// Notes when the world's ticks begin.
struct Timed<P> {
    inner: P,
    times_ns: Vec<u64>,
}

impl<P: Participant> Participant for Timed<P> {
    fn id(&self) -> ServiceId {
        self.inner.id()
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        if call == Call::Publish {
            self.times_ns.push(now_ns());
        }
        self.inner.compute(call, tick)
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.inner.publish(call, tick)
    }
}

impl<P: Replaceable> Replaceable for Timed<P> {
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
