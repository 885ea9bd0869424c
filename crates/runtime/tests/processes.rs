//! Runs of real processes, most of which end badly.
//!
//! The processes are this very test program, started anew: see [`a_process_of_a_run`].

use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, ServiceId, TeamCommand,
    TeamState,
};
use mikoshi_runtime::{
    Board, Call, Domain, Double, Entry, FaultCode, IceoryxTap, IceoryxTransport, InMemoryHub, InOrder,
    Member, OBSERVER_DEPTH, Observer, Participant, Placement, ProcessIdentity, Replaceable, Role,
    RunDirectory, State, TAP_LEAD_TICKS, Tap, TickError, TickSchedule, WaitPolicy, run_in_one_thread,
    run_service,
};
use rustix::event::{PollFd, PollFlags, poll};
use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open};
use std::ops::ControlFlow;
use std::os::unix::fs::PermissionsExt;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const ROBOTS: usize = 4;
/// More than any test waits for.
const ENDLESS: u64 = u64::MAX;
/// Where a tap that stalls stops consuming.
const STALL_AT: u64 = 50;

fn schedule() -> TickSchedule {
    schedule_with(0)
}

fn schedule_with(coordination_delay_ticks: u64) -> TickSchedule {
    TickSchedule::of_team(ROBOTS, coordination_delay_ticks, &Placement::default()).expect("a valid team")
}

fn join(run: &Path, role: Role) -> Member {
    Member::join(run, role, WaitPolicy::default(), Entry::Replace).expect("a place on the board")
}

// What the processes do.

/// Does as the service that it holds, but ends badly in one tick.
struct Faulty<P> {
    inner: P,
    panic_at: u64,
    /// In this tick, and this phase of it, it is killed at this point.
    kill_at: (u64, u64),
    kill_point: Point,
    tick: u64,
    phase: u64,
}

/// What a process is about when it is killed.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
enum Point {
    /// It has not received its inputs.
    Waiting,
    /// It keeps what it has computed.
    Keeping,
    /// It has kept it, and not published it.
    Kept,
    /// It has published it.
    Published,
}

impl Point {
    const ALL: [Self; 4] = [Self::Waiting, Self::Keeping, Self::Kept, Self::Published];
}

impl<P> Faulty<P> {
    fn pass(&self, point: Point) {
        if (self.tick, self.phase, point) == (self.kill_at.0, self.kill_at.1, self.kill_point) {
            let own = rustix::process::getpid();
            kill_process(own, Signal::KILL).expect("it is ours");
        }
    }
}

impl<P: Participant> Participant for Faulty<P> {
    fn id(&self) -> ServiceId {
        self.inner.id()
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        assert!(tick < self.panic_at, "as it was told");
        (self.tick, self.phase) = (tick, u64::from(matches!(call, Call::Act | Call::Step)));
        self.pass(Point::Waiting);
        self.inner.compute(call, tick)
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.pass(Point::Kept);
        self.inner.publish(call, tick)?;
        self.pass(Point::Published);
        Ok(())
    }
}

impl<P: Replaceable> Replaceable for Faulty<P> {
    fn state_schema(&self) -> u64 {
        self.inner.state_schema()
    }

    fn state_bytes(&self) -> usize {
        self.inner.state_bytes()
    }

    fn save(&mut self, checkpoint: &mut [u8]) -> Result<usize, TickError> {
        checkpoint.fill(0xff);
        self.pass(Point::Keeping);
        self.inner.save(checkpoint)
    }

    fn load(&mut self, checkpoint: &[u8]) -> Result<(), TickError> {
        self.inner.load(checkpoint)
    }
}

/// Not a test of its own: what the tests below start. It does nothing unless it is told its role.
#[test]
fn a_process_of_a_run() {
    let variable = |name: &str| std::env::var(format!("MIKOSHI_TEST_{name}")).ok();
    let Some(role) = variable("ROLE") else { return };
    std::thread::spawn(end_with_parent);
    let run = PathBuf::from(variable("RUN").expect("a run"));
    let number = |name: &str| variable(name).map_or(ENDLESS, |value| value.parse().expect("a number"));
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
            serve(&run, id, number)
        }
    };
    std::process::exit(result.err().map_or(0, |error| exit_code(error.code())));
}

/// Whatever becomes of the tests, their processes end with them.
fn end_with_parent() {
    let parent = rustix::process::getppid().expect("who started this");
    let parent = pidfd_open(parent, PidfdFlags::empty()).expect("it lives");
    let _ = poll(&mut [PollFd::new(&parent, PollFlags::IN)], None);
    std::process::exit(1);
}

fn serve(run: &Path, id: ServiceId, number: impl Fn(&str) -> u64) -> Result<(), TickError> {
    let schedule = schedule_with(match number("DELAY") {
        ENDLESS => 0,
        delay_ticks => delay_ticks,
    });
    let transport = IceoryxTransport::open(run, join(run, Role::Service(id)), &schedule).expect("ports");
    let mut participant = Faulty {
        inner: Double::new(&schedule, &transport, id).expect("ports"),
        panic_at: number("PANIC_AT"),
        kill_at: (number("KILL_AT"), number("KILL_PHASE")),
        kill_point: Point::ALL[number("KILL_POINT") as usize % Point::ALL.len()],
        tick: 0,
        phase: 0,
    };
    let run = run_service(&schedule, &mut participant, &transport, number("TICKS"));
    run.map(|_| ()).map_err(|fault| fault.error)
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
    /// This process, unless another is to be.
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

    fn wait_for_supervisor(&self) {
        while self.board.states().any(|entry| entry == (Role::Supervisor, State::Absent)) {
            std::thread::yield_now();
        }
    }

    fn take(&mut self, role: &str) -> Children {
        self.children.take(role)
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
    fn take(&mut self, role: &str) -> Children {
        let index = self.0.iter().position(|(other, _)| other == role).expect("it runs");
        Children(vec![self.0.remove(index)])
    }

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
fn a_run_goes_on_when_its_supervisor_dies() {
    let ticks = 20_000;
    let mut running = Running::start(ticks, &["supervisor"]);
    running.board.set_succession(true);
    running.wait_for_tick(10);
    running.wait_for_supervisor();
    assert!(running.board.is_supervised());
    running.kill("supervisor");
    assert!(!running.board.is_supervised());
    for (role, code) in running.exit_codes() {
        assert_eq!(code, 0, "service {role}");
    }
    assert_eq!(running.tick_of(ServiceId::Bridge), ticks - 1);
    running.assert_leaves_nothing();
}

#[test]
fn without_a_supervisor_who_replaces_it_a_process_that_dies_ends_the_run() {
    let mut running = Running::start(ENDLESS, &["supervisor"]);
    running.board.set_succession(true);
    running.wait_for_tick(10);
    running.wait_for_supervisor();
    running.kill("supervisor");
    running.kill(&Running::index_of(ServiceId::Servo(1)));
    for (role, code) in running.exit_codes() {
        assert_eq!(code, exit_code(FaultCode::PeerLost), "service {role}");
    }
    running.assert_leaves_nothing();
}

#[test]
fn a_run_whose_supervisor_dies_before_all_have_come_does_not_wait_for_ever() {
    let mut running = Running::prepare(false);
    let path = running.directory.path().to_path_buf();
    running.children.0.push(("supervisor".to_owned(), spawn("supervisor", &path, &[])));
    running.wait_for_supervisor();
    let coordinator = Running::index_of(ServiceId::Coordinator);
    let all_but_one = schedule().services().into_iter().map(Running::index_of);
    for role in all_but_one.filter(|role| *role != coordinator) {
        running.children.0.push((role.clone(), spawn(&role, &path, &[("TICKS", ENDLESS)])));
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
fn a_successor_says_nothing_before_the_tap_can_hear_it() {
    let (victim, ticks) = (ServiceId::Coordinator, 2 * STALL_AT);
    let last = STALL_AT + 5;
    let mut running = Running::start_with(ticks, &["tap"], |service| {
        if service == victim { vec![("KILL_AT", last), ("KILL_PHASE", 0), ("KILL_POINT", 2)] } else { vec![] }
    });
    running.board.set_succession(true);
    let path = running.directory.path().to_path_buf();
    let settings = |_| vec![("TICKS", ticks)];
    replace_the_killed(&mut running.children, &path, [victim].into_iter(), settings);
    while running.board.charge_of(victim).is_none_or(|(epoch, _)| epoch < 2) {
        std::thread::yield_now();
    }
    // Give it the chance to say what would be lost.
    for _ in 0..10_000 {
        std::thread::yield_now();
    }
    assert_eq!(running.tick_of(victim), last);
    running.kill("tap");
    for (role, code) in running.exit_codes() {
        assert_eq!(code, 0, "service {role}");
    }
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
    sensors: Ports<T, Sensors>,
    robot_truth: Ports<T, RobotTruth>,
    object_truth: Ports<T, ObjectTruth>,
    robot_state: Ports<T, RobotState>,
    team_command: Ports<T, TeamCommand>,
    team_state: Ports<T, TeamState>,
    joint_command: Ports<T, JointCommand>,
    bytes: Vec<u8>,
}

type Ports<T, P> = Vec<InOrder<<T as Tap>::Observer<P>, P>>;

impl<T: Tap> Log<T> {
    fn new(tap: &T) -> Self {
        fn all<T: Tap, P: Payload>(tap: &T, robots: usize) -> Ports<T, P> {
            (0..robots).map(|robot| InOrder::new(tap.observer(robot).expect("it is published"))).collect()
        }
        Self {
            sensors: all(tap, ROBOTS),
            robot_truth: all(tap, ROBOTS),
            object_truth: all(tap, 1),
            robot_state: all(tap, ROBOTS),
            team_command: all(tap, ROBOTS),
            team_state: all(tap, 1),
            joint_command: all(tap, ROBOTS),
            bytes: Vec::new(),
        }
    }

    fn record(&mut self, tick: u64) {
        let bytes = &mut self.bytes;
        self.sensors.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.robot_truth.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.object_truth.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.robot_state.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.team_command.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.team_state.iter_mut().for_each(|frames| append(frames, tick, bytes));
        self.joint_command.iter_mut().for_each(|frames| append(frames, tick, bytes));
    }

    fn is_at_its_end(&mut self) -> bool {
        let mut frame = Frame::zeroed();
        self.object_truth.iter_mut().all(|frames| frames.receive(&mut frame) == Ok(false))
    }
}

fn append<P: Payload>(frames: &mut InOrder<impl Observer<P>, P>, tick: u64, bytes: &mut Vec<u8>) {
    let mut frame = Frame::<P>::zeroed();
    assert_eq!(frames.receive(&mut frame), Ok(true), "{} of tick {tick}", P::NAME);
    assert_eq!(frame.envelope.tick, tick, "{}", P::NAME);
    bytes.extend_from_slice(bytemuck::bytes_of(&frame.payload));
}

/// What a run of so many ticks says if nothing happens to it.
fn undisturbed(schedule: &TickSchedule, ticks: u64) -> Vec<u8> {
    let hub = InMemoryHub::new(schedule.clone());
    let mut log = Log::new(&hub.tap());
    let mut services: Vec<_> = schedule
        .services()
        .into_iter()
        .map(|id| Double::new(schedule, &hub.transport(id), id).expect("ports"))
        .collect();
    let run = run_in_one_thread(schedule, &mut services, ticks, |tick| {
        log.record(tick);
        ControlFlow::Continue(())
    });
    assert_eq!(run, Ok(ticks));
    log.bytes
}

/// What a run between processes says, of which this process is the tap; `meanwhile` may see to successors.
fn between_processes(
    schedule: &TickSchedule,
    ticks: u64,
    settings_of: impl Fn(ServiceId) -> Vec<(&'static str, u64)>,
    meanwhile: impl FnOnce(&mut Children, &Path) + Send,
) -> Vec<u8> {
    let mut running = Running::prepare(true);
    let path = running.directory.path().to_path_buf();
    running.supervisor = Some(join(&path, Role::Supervisor));
    running.board.set_succession(true);
    for service in schedule.services() {
        let role = Running::index_of(service);
        let child = spawn(&role, &path, &[settings_of(service), vec![("TICKS", ticks)]].concat());
        running.children.0.push((role, child));
    }
    let tap = IceoryxTap::open(&path, join(&path, Role::Tap), schedule).expect("ports");
    let mut log = Log::new(&tap);
    tap.start().expect("the run starts");
    std::thread::scope(|scope| {
        let children = &mut running.children;
        scope.spawn(|| meanwhile(children, &path));
        for tick in 0..ticks {
            log.record(tick);
            tap.set_consumed(tick + 1);
        }
        assert!(log.is_at_its_end(), "the run has ended");
    });
    for (role, code) in running.exit_codes() {
        assert_eq!(code, 0, "service {role}");
    }
    let bytes = log.bytes;
    drop((tap, log.sensors));
    running.assert_leaves_nothing();
    bytes
}

#[test]
fn six_processes_say_byte_for_byte_what_one_thread_says() {
    // Long enough for every queue to wrap around.
    let ticks = 10 * OBSERVER_DEPTH as u64;
    let expected = undisturbed(&schedule(), ticks);
    for _ in 0..2 {
        assert!(between_processes(&schedule(), ticks, |_| vec![], |_, _| ()) == expected);
    }
}

/// Waits for these to be killed, as they were told, in whatever order, and starts successors.
fn replace_the_killed(
    children: &mut Children,
    run: &Path,
    victims: impl Iterator<Item = ServiceId>,
    settings_of: impl Fn(ServiceId) -> Vec<(&'static str, u64)>,
) {
    let mut alive: Vec<_> = victims.collect();
    while !alive.is_empty() {
        alive.retain(|victim| {
            let role = Running::index_of(*victim);
            let (_, child) = children.0.iter_mut().find(|(other, _)| *other == role).expect("it runs");
            let Some(status) = child.try_wait().expect("it is ours") else { return true };
            assert_eq!(status.signal(), Some(Signal::KILL.as_raw()), "{victim}: {status}");
            *child = spawn(&role, run, &settings_of(*victim));
            false
        });
        std::thread::yield_now();
    }
}

const KILL_TICKS: u64 = 60;

/// A service, a phase of it, and a point of that: where it is killed.
type Death = (ServiceId, u64, Point);

fn all_deaths() -> Vec<Death> {
    let victims = [(ServiceId::Bridge, 2), (ServiceId::Servo(2), 2), (ServiceId::Coordinator, 1)];
    let deaths = victims.into_iter().flat_map(|(victim, phases)| {
        (0..phases).flat_map(move |phase| Point::ALL.map(|point| (victim, phase, point)))
    });
    // What only says what the state holds already is not kept.
    deaths.filter(|death| *death != (ServiceId::Bridge, 0, Point::Keeping)).collect()
}

/// Kills these in one tick of a run, their successors too if so wished, and compares what all have said.
fn expect_no_difference(deaths: &[Death], tick: u64, delay_ticks: u64, again: bool, expected: &[u8]) {
    let settings_of = |service, dies: bool| {
        let mut settings = vec![("DELAY", delay_ticks), ("TICKS", KILL_TICKS)];
        if let Some((_, phase, point)) = deaths.iter().find(|(victim, ..)| dies && *victim == service) {
            settings.extend([("KILL_AT", tick), ("KILL_PHASE", *phase), ("KILL_POINT", *point as u64)]);
        }
        settings
    };
    let of_first = |service| settings_of(service, true);
    let log = between_processes(&schedule_with(delay_ticks), KILL_TICKS, of_first, |children, run| {
        let victims = || deaths.iter().map(|(victim, ..)| *victim);
        if again {
            replace_the_killed(children, run, victims(), of_first);
        }
        replace_the_killed(children, run, victims(), |service| settings_of(service, false));
    });
    assert!(log == expected, "{deaths:?} in tick {tick}, delay {delay_ticks}, again: {again}");
}

#[test]
fn wherever_a_process_is_killed_its_successor_goes_on_and_nobody_sees_a_difference() {
    for delay_ticks in [0, 2] {
        let expected = undisturbed(&schedule_with(delay_ticks), KILL_TICKS);
        for death in all_deaths() {
            // In the beginning, on the way, and at the end.
            for tick in [0, 20, KILL_TICKS - 1] {
                expect_no_difference(&[death], tick, delay_ticks, false, &expected);
            }
        }
    }
}

#[test]
fn processes_may_be_killed_in_pairs() {
    for delay_ticks in [0, 2] {
        let expected = undisturbed(&schedule_with(delay_ticks), KILL_TICKS);
        for one in all_deaths() {
            for other in all_deaths().into_iter().filter(|other| other.0 > one.0 && other.2 == one.2) {
                expect_no_difference(&[one, other], 20, delay_ticks, false, &expected);
            }
        }
    }
}

#[test]
fn a_successor_may_be_killed_where_its_predecessor_was() {
    let expected = undisturbed(&schedule(), KILL_TICKS);
    // One that was killed after it had kept its state is not killed there again: that phase is behind it.
    for death in all_deaths().into_iter().filter(|(_, _, point)| *point <= Point::Keeping) {
        expect_no_difference(&[death], 20, 0, true, &expected);
    }
}

#[test]
fn a_process_is_replaced_while_it_works_and_nobody_sees_a_difference() {
    let ticks = 20_000;
    for delay_ticks in [0, 2] {
        let settings = [("DELAY", delay_ticks), ("TICKS", ticks)];
        let expected = undisturbed(&schedule_with(delay_ticks), ticks);
        for service in [ServiceId::Bridge, ServiceId::Servo(2), ServiceId::Coordinator] {
            let role = Running::index_of(service);
            let schedule = schedule_with(delay_ticks);
            let log = between_processes(
                &schedule,
                ticks,
                |_| settings.to_vec(),
                |children, run| {
                    let board = Board::open(run).expect("a board");
                    while board.last_position(service).is_none_or(|at| at.tick < 100) {
                        std::thread::yield_now();
                    }
                    let successor = spawn(&role, run, &settings);
                    let mut retired = children.take(&role);
                    let status = retired.0[0].1.wait().expect("it is ours");
                    assert_eq!(status.code(), Some(exit_code(FaultCode::Retired)), "{service}");
                    assert!(
                        board.last_position(service).is_some_and(|at| at.tick < ticks - 1),
                        "while it works"
                    );
                    children.0.push((role.clone(), successor));
                },
            );
            assert!(log == expected, "{service}, delay {delay_ticks}");
        }
    }
}
