//! Runs of real processes, most of which end badly.
//!
//! The processes are this very test program, started anew: see [`a_process_of_a_run`].

use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, ServiceId, TeamCommand,
    TeamState,
};
use mikoshi_runtime::{
    Board, Call, Domain, FaultCode, IceoryxTap, IceoryxTransport, InMemoryHub, Member, OBSERVER_DEPTH,
    Observer, Participant, Placement, ProcessIdentity, Role, RunDirectory, State, TAP_LEAD_TICKS, Tap,
    TickError, TickSchedule, WaitPolicy, run_in_one_thread, run_service,
};
use rustix::process::{Pid, Signal, kill_process};
use std::ops::ControlFlow;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

mod support;
use support::Double;

const ROBOTS: usize = 4;
/// More than any test waits for.
const ENDLESS: u64 = u64::MAX;
/// Where a tap that stalls stops consuming.
const STALL_AT: u64 = 50;

fn schedule() -> TickSchedule {
    TickSchedule::of_team(ROBOTS, 0, &Placement::default()).expect("a valid team")
}

fn join(run: &Path, role: Role) -> Member {
    Member::join(run, role, WaitPolicy::default()).expect("a place on the board")
}

// What the processes do.

/// Panics in one tick.
struct Panicking<P> {
    inner: P,
    tick: u64,
}

impl<P: Participant> Participant for Panicking<P> {
    fn id(&self) -> ServiceId {
        self.inner.id()
    }

    fn execute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        assert!(tick < self.tick, "as it was told");
        self.inner.execute(call, tick)
    }
}

/// Not a test of its own: what the tests below start. It does nothing unless it is told its role.
#[test]
fn a_process_of_a_run() {
    let variable = |name: &str| std::env::var(format!("MIKOSHI_TEST_{name}")).ok();
    let Some(role) = variable("ROLE") else { return };
    let run = PathBuf::from(variable("RUN").expect("a run"));
    let number = |name| variable(name).map_or(ENDLESS, |value| value.parse().expect("a number"));
    let result = match role.as_str() {
        "supervisor" => {
            let _member = join(&run, Role::Supervisor);
            sleep_for_ever()
        }
        "owner" => {
            let directory = RunDirectory::create(&run).expect("a run");
            Board::create(directory.path(), &schedule().services(), false).expect("a board");
            let member = join(directory.path(), Role::Service(ServiceId::Bridge));
            let transport = IceoryxTransport::open(directory.path(), member, &schedule()).expect("ports");
            let _ports = Double::new(&schedule(), &transport, ServiceId::Bridge).expect("ports");
            std::fs::write(run.join("ready"), directory.id()).expect("it is writable");
            sleep_for_ever()
        }
        "tap" => {
            let tap = IceoryxTap::open(&run, join(&run, Role::Tap), &schedule()).expect("ports");
            let _log = Log::new(&tap);
            tap.start().expect("the run starts");
            tap.set_consumed(STALL_AT);
            sleep_for_ever()
        }
        service => {
            let id = schedule().services()[service.parse::<usize>().expect("an index")];
            serve(&run, id, number("TICKS"), number("PANIC_AT"))
        }
    };
    std::process::exit(result.err().map_or(0, |error| exit_code(error.code())));
}

fn serve(run: &Path, id: ServiceId, ticks: u64, panic_at: u64) -> Result<(), TickError> {
    let schedule = schedule();
    let transport = IceoryxTransport::open(run, join(run, Role::Service(id)), &schedule).expect("ports");
    let inner = Double::new(&schedule, &transport, id).expect("ports");
    let mut participant = Panicking { inner, tick: panic_at };
    run_service(&schedule, &mut participant, &transport, ticks).map(|_| ()).map_err(|fault| fault.error)
}

fn sleep_for_ever() -> ! {
    loop {
        std::thread::park();
    }
}

fn exit_code(fault: FaultCode) -> i32 {
    10 + fault as i32
}

// What the tests see of them.

struct Running {
    children: Children,
    board: Board,
    /// This process, unless another is to be: what it starts ends with it.
    supervisor: Option<Member>,
    directory: RunDirectory,
    base: tempfile::TempDir,
}

fn base() -> tempfile::TempDir {
    tempfile::Builder::new()
        .permissions(std::fs::Permissions::from_mode(0o700))
        .tempdir()
        .expect("a directory")
}

fn spawn(role: &str, run: &Path, settings: &[(&str, u64)]) -> Child {
    let mut command = Command::new(std::env::current_exe().expect("a program"));
    command
        .args(["--exact", "a_process_of_a_run", "--nocapture"])
        .env("MIKOSHI_TEST_ROLE", role)
        .env("MIKOSHI_TEST_RUN", run)
        .stdout(Stdio::null())
        .stderr(Stdio::null());
    for (name, value) in settings {
        command.env(format!("MIKOSHI_TEST_{name}"), value.to_string());
    }
    command.spawn().expect("it starts")
}

impl Running {
    /// Starts these others, and all services.
    fn start(ticks: u64, others: &[&str]) -> Self {
        Self::start_with(ticks, others, |_| vec![])
    }

    fn start_with(
        ticks: u64,
        others: &[&str],
        settings_of: impl Fn(ServiceId) -> Vec<(&'static str, u64)>,
    ) -> Self {
        let mut running = Self::prepare(others.contains(&"tap"));
        let path = running.directory.path();
        if !others.contains(&"supervisor") {
            running.supervisor = Some(join(path, Role::Supervisor));
        }
        for role in others {
            running.children.0.push((role.to_string(), spawn(role, path, &[])));
        }
        for service in schedule().services() {
            let role = Self::index_of(service);
            let settings = [settings_of(service), vec![("TICKS", ticks)]].concat();
            let child = spawn(&role, path, &settings);
            running.children.0.push((role, child));
        }
        running
    }

    /// A run without processes.
    fn prepare(expects_tap: bool) -> Self {
        let base = base();
        let directory = RunDirectory::create(base.path()).expect("a run");
        let board = Board::create(directory.path(), &schedule().services(), expects_tap).expect("a board");
        Self { children: Children(Vec::new()), board, supervisor: None, directory, base }
    }

    fn index_of(service: ServiceId) -> String {
        schedule().services().iter().position(|other| *other == service).expect("it is there").to_string()
    }

    fn tick_of(&self, service: ServiceId) -> u64 {
        let statuses = self.board.statuses();
        statuses.iter().find(|status| status.role == Role::Service(service)).expect("a slot").tick
    }

    fn wait_for_tick(&self, tick: u64) {
        while self.tick_of(ServiceId::Bridge) < tick {
            assert!(
                !self.board.states().any(|(_, state)| state == State::Failed),
                "{:#?}",
                self.board.statuses()
            );
            std::thread::yield_now();
        }
    }

    fn take(&mut self, role: &str) -> Children {
        let index = self.children.0.iter().position(|(other, _)| other == role).expect("it runs");
        Children(vec![self.children.0.remove(index)])
    }

    fn kill(&mut self, role: &str) {
        self.take(role).end();
    }

    fn freeze(&mut self, service: ServiceId) -> Children {
        let frozen = self.take(&Self::index_of(service));
        let pid = Pid::from_raw(frozen.0[0].1.id() as i32).expect("a pid");
        kill_process(pid, Signal::STOP).expect("it is ours");
        frozen
    }

    /// Waits for all processes to end, and says how.
    fn exit_codes(&mut self) -> Vec<(String, i32)> {
        let children = self.children.0.drain(..);
        children
            .map(|(role, mut child)| (role, child.wait().expect("it ends").code().unwrap_or(-1)))
            .collect()
    }

    /// The run is over: nothing of it remains.
    fn assert_leaves_nothing(self) {
        let domain = Domain::of(self.directory.path());
        let path = self.directory.path().to_path_buf();
        self.directory.remove().expect("it can be removed");
        assert!(!path.exists());
        assert!(domain.shared_memory_files().expect("shared memory").is_empty());
        assert_eq!(RunDirectory::list(self.base.path()).expect("a list"), []);
    }
}

/// Processes by role. None outlives its test.
struct Children(Vec<(String, Child)>);

impl Children {
    fn end(&mut self) {
        for (_, child) in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

impl Drop for Children {
    fn drop(&mut self) {
        self.end();
    }
}

#[test]
fn a_killed_process_ends_the_run_of_all_others_and_nothing_remains() {
    for victim in [ServiceId::Bridge, ServiceId::Servo(2), ServiceId::Coordinator] {
        let mut running = Running::start(ENDLESS, &[]);
        running.wait_for_tick(100);
        running.kill(&Running::index_of(victim));
        let lost = exit_code(FaultCode::PeerLost);
        for (role, code) in running.exit_codes() {
            assert_eq!(code, lost, "service {role}, {victim} killed");
        }
        // All name the one that was killed, and not one another.
        for status in running.board.statuses().iter().filter(|status| status.fault.is_some()) {
            let (_, text) = status.fault.as_ref().expect("a fault");
            assert_eq!(text, &format!("{victim} is gone"), "{}", status.role);
        }
        running.assert_leaves_nothing();
    }
}

#[test]
fn a_process_that_panics_ends_the_run_of_all_others() {
    let panicking = ServiceId::Servo(1);
    let mut running =
        Running::start_with(
            ENDLESS,
            &[],
            |service| {
                if service == panicking { vec![("PANIC_AT", 20)] } else { vec![] }
            },
        );
    for (role, code) in running.exit_codes() {
        let expected =
            if role == Running::index_of(panicking) { 101 } else { exit_code(FaultCode::PeerLost) };
        assert_eq!(code, expected, "service {role}");
    }
    let statuses = running.board.statuses();
    let status = statuses.iter().find(|status| status.role == Role::Service(panicking)).expect("a slot");
    assert_eq!((status.state, status.tick), (State::Failed, 20));
    assert_eq!(status.fault.as_ref().map(|(code, _)| *code), Some(FaultCode::Aborted));
    running.assert_leaves_nothing();
}

#[test]
fn a_request_to_stop_ends_a_run_in_which_a_process_is_frozen() {
    let mut running = Running::start(ENDLESS, &[]);
    running.wait_for_tick(10);
    let mut frozen = running.freeze(ServiceId::Servo(0));
    running.board.request_stop();
    for (role, code) in running.exit_codes() {
        assert_eq!(code, exit_code(FaultCode::Stopped), "service {role}");
    }
    frozen.end();
    running.assert_leaves_nothing();
}

#[test]
fn a_run_ends_when_its_supervisor_dies() {
    let mut running = Running::start(ENDLESS, &["supervisor"]);
    running.wait_for_tick(10);
    while running.board.states().any(|entry| entry == (Role::Supervisor, State::Absent)) {
        std::thread::yield_now();
    }
    running.kill("supervisor");
    for (role, code) in running.exit_codes() {
        assert_eq!(code, exit_code(FaultCode::SupervisorLost), "service {role}");
    }
    running.assert_leaves_nothing();
}

#[test]
fn a_run_waits_for_a_tap_that_stalls_and_goes_on_without_one_that_died() {
    let ticks = 2 * (STALL_AT + TAP_LEAD_TICKS);
    let mut running = Running::start(ticks, &["tap"]);
    let furthest = STALL_AT + TAP_LEAD_TICKS;
    running.wait_for_tick(furthest);
    // Give it the chance to go too far: the run's state is stable once the bridge sleeps.
    for _ in 0..10_000 {
        std::thread::yield_now();
    }
    assert_eq!(running.tick_of(ServiceId::Bridge), furthest);
    running.kill("tap");
    for (role, code) in running.exit_codes() {
        assert_eq!(code, 0, "service {role}");
    }
    assert_eq!(running.tick_of(ServiceId::Bridge), ticks - 1);
    running.assert_leaves_nothing();
}

#[test]
fn what_a_killed_supervisor_leaves_is_cleaned_at_the_next_start() {
    let base = base();
    let mut owner = spawn("owner", base.path(), &[]);
    let ready = base.path().join("ready");
    while !ready.exists() || std::fs::read(&ready).is_ok_and(|id| id.is_empty()) {
        assert_eq!(owner.try_wait().expect("it is ours"), None, "it ended early");
        std::thread::yield_now();
    }
    let path = base.path().canonicalize().expect("a path");
    let path = path.join(std::fs::read_to_string(&ready).expect("a name"));
    assert!(ProcessIdentity::of(owner.id()).expect("/proc is there").is_some());
    assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), Vec::<PathBuf>::new());
    assert!(!Domain::of(&path).shared_memory_files().expect("shared memory").is_empty());

    owner.kill().expect("it is ours");
    owner.wait().expect("it ends");
    assert_eq!(RunDirectory::clean_dead(base.path()).expect("nothing fails"), std::slice::from_ref(&path));
    assert!(Domain::of(&path).shared_memory_files().expect("shared memory").is_empty());
    assert!(!path.exists());
}

/// Every payload of a run, in the order of its schedule.
struct Log<T: Tap> {
    sensors: Vec<T::Observer<Sensors>>,
    robot_truth: Vec<T::Observer<RobotTruth>>,
    object_truth: T::Observer<ObjectTruth>,
    robot_state: Vec<T::Observer<RobotState>>,
    team_command: Vec<T::Observer<TeamCommand>>,
    team_state: T::Observer<TeamState>,
    joint_command: Vec<T::Observer<JointCommand>>,
    bytes: Vec<u8>,
}

impl<T: Tap> Log<T> {
    fn new(tap: &T) -> Self {
        fn all<T: Tap, P: Payload>(tap: &T) -> Vec<T::Observer<P>> {
            (0..ROBOTS).map(|robot| tap.observer(robot).expect("it is published")).collect()
        }
        Self {
            sensors: all(tap),
            robot_truth: all(tap),
            object_truth: tap.observer(0).expect("it is published"),
            robot_state: all(tap),
            team_command: all(tap),
            team_state: tap.observer(0).expect("it is published"),
            joint_command: all(tap),
            bytes: Vec::new(),
        }
    }

    fn record(&mut self, tick: u64) {
        let bytes = &mut self.bytes;
        self.sensors.iter_mut().for_each(|observer| append(observer, tick, bytes));
        self.robot_truth.iter_mut().for_each(|observer| append(observer, tick, bytes));
        append(&mut self.object_truth, tick, bytes);
        self.robot_state.iter_mut().for_each(|observer| append(observer, tick, bytes));
        self.team_command.iter_mut().for_each(|observer| append(observer, tick, bytes));
        append(&mut self.team_state, tick, bytes);
        self.joint_command.iter_mut().for_each(|observer| append(observer, tick, bytes));
    }
}

fn append<P: Payload>(observer: &mut impl Observer<P>, tick: u64, bytes: &mut Vec<u8>) {
    let mut frame = Frame::<P>::zeroed();
    assert_eq!(observer.receive(&mut frame), Ok(true), "{} of tick {tick}", P::NAME);
    assert_eq!(frame.envelope.tick, tick, "{}", P::NAME);
    bytes.extend_from_slice(bytemuck::bytes_of(&frame.payload));
}

#[test]
fn six_processes_say_byte_for_byte_what_one_thread_says() {
    // Long enough for every queue to wrap around.
    let ticks = 10 * OBSERVER_DEPTH as u64;
    let schedule = schedule();

    let hub = InMemoryHub::new(schedule.clone());
    let mut in_one_thread = Log::new(&hub.tap());
    let mut services: Vec<_> = schedule
        .services()
        .into_iter()
        .map(|id| Double::new(&schedule, &hub.transport(id), id).expect("ports"))
        .collect();
    let run = run_in_one_thread(&schedule, &mut services, ticks, |tick| {
        in_one_thread.record(tick);
        ControlFlow::Continue(())
    });
    assert_eq!(run, Ok(ticks));

    for _ in 0..2 {
        // The tap is this process.
        let mut running = Running::prepare(true);
        for service in schedule.services() {
            let role = Running::index_of(service);
            let child = spawn(&role, running.directory.path(), &[("TICKS", ticks)]);
            running.children.0.push((role, child));
        }
        let path = running.directory.path().to_path_buf();
        let tap = IceoryxTap::open(&path, join(&path, Role::Tap), &schedule).expect("ports");
        let mut between_processes = Log::new(&tap);
        tap.start().expect("the run starts");
        for tick in 0..ticks {
            between_processes.record(tick);
            tap.set_consumed(tick + 1);
        }
        let mut frame = Frame::zeroed();
        assert_eq!(between_processes.object_truth.receive(&mut frame), Ok(false), "the run has ended");
        assert!(running.exit_codes().iter().all(|(_, code)| *code == 0));
        assert!(in_one_thread.bytes == between_processes.bytes);
        drop((tap, between_processes));
        running.assert_leaves_nothing();
    }
}
