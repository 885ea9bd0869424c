//! What a tick allocates: in memory nothing; over iceoryx2 nothing of ours, and one small block for each
//! loan, inside iceoryx2 0.10 (`ChunkMutSharedState`), which is freed when the frame is sent. It is of
//! one size, and comes from the thread's own cache of blocks: no lock, no system call. The next frame of each topic may be
//! loaned while its service waits.

use core::alloc::{GlobalAlloc, Layout};
use core::cell::Cell;
use mikoshi_ipc_types::{Frame, ObjectTruth, ServiceId};
use mikoshi_runtime::{
    Board, Call, Double, Entry, IceoryxTap, IceoryxTransport, InMemoryHub, Member, Observer, Participant,
    Placement, Position, Replaceable, Role, RunDirectory, Session, Tap, TickError, TickSchedule, Transport,
    WaitPolicy, run_in_one_thread, run_service,
};
use std::ops::ControlFlow;
use std::os::unix::fs::PermissionsExt;

/// Counts what each thread allocates.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: everything is the system allocator's; counting neither allocates nor unwinds.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's contract is the same.
        unsafe { std::alloc::System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is the same.
        unsafe { std::alloc::System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Fails if `work` allocates more often than this.
fn with_allocations<T>(allowed: usize, work: impl FnOnce() -> T) -> T {
    let before = ALLOCATIONS.get();
    let result = work();
    let counted = ALLOCATIONS.get() - before;
    assert!(counted <= allowed, "{counted} allocations, not {allowed}");
    result
}

#[test]
#[should_panic(expected = "1 allocations, not 0")]
fn an_allocation_is_noticed() {
    with_allocations(0, || drop(Box::new(1_u64)));
}

const TICKS: u64 = 200;

fn schedule() -> TickSchedule {
    TickSchedule::of_team(2, 1, &Placement::default()).expect("a valid team")
}

/// A service that may allocate so often for each frame that it publishes, for one frame of each topic ahead of time.
struct Frugal<P> {
    inner: P,
    schedule: TickSchedule,
    allocations_per_frame: usize,
    /// How often it still may before it publishes anything more.
    allowed: usize,
}

impl<P: Participant> Frugal<P> {
    fn frames_of(&self, is_meant: impl Fn(Call) -> bool) -> usize {
        let phases = self.schedule.phases_of(self.inner.id());
        phases.filter(|phase| is_meant(phase.call)).map(|phase| phase.outputs.len()).sum()
    }

    fn within_allowance<T>(&mut self, work: impl FnOnce(&mut P) -> T) -> T {
        let before = ALLOCATIONS.get();
        let result = with_allocations(self.allowed, || work(&mut self.inner));
        self.allowed -= ALLOCATIONS.get() - before;
        result
    }
}

impl<P: Participant> Participant for Frugal<P> {
    fn id(&self) -> ServiceId {
        self.inner.id()
    }

    fn compute(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.within_allowance(|inner| inner.compute(call, tick))
    }

    fn publish(&mut self, call: Call, tick: u64) -> Result<(), TickError> {
        self.allowed += self.frames_of(|other| other == call) * self.allocations_per_frame;
        self.within_allowance(|inner| inner.publish(call, tick))
    }
}

impl<P: Replaceable> Replaceable for Frugal<P> {
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

fn frugal<T: Transport>(transport: &T, id: ServiceId, allocations_per_frame: usize) -> Frugal<Double<T>> {
    let schedule = schedule();
    let inner = Double::new(&schedule, transport, id).expect("ports");
    let mut service = Frugal { inner, schedule, allocations_per_frame, allowed: 0 };
    service.allowed = service.frames_of(|_| true) * allocations_per_frame;
    service
}

#[test]
fn services_in_one_thread_and_their_observers_do_not_allocate() {
    let hub = InMemoryHub::new(schedule());
    let mut observer = hub.tap().observer::<ObjectTruth>(0).expect("it is published");
    let services = schedule().services().into_iter();
    let mut services: Vec<_> = services.map(|id| frugal(&hub.transport(id), id, 0)).collect();
    let mut frame = Frame::zeroed();
    let run = run_in_one_thread(&schedule(), &mut services, TICKS, |_| {
        assert_eq!(with_allocations(0, || observer.try_receive(&mut frame)), Ok(true));
        ControlFlow::Continue(())
    });
    assert_eq!(run, Ok(TICKS));
}

/// Every service in a thread of its own, as if it were a process: waits and wakes are real.
#[test]
fn services_over_iceoryx2_allocate_no_more_than_its_loans_do() {
    let base = tempfile::Builder::new()
        .permissions(std::fs::Permissions::from_mode(0o700))
        .tempdir()
        .expect("a directory");
    let run = RunDirectory::create(base.path()).expect("a run");
    Board::create(run.path(), &schedule().services(), true).expect("a board");
    let join = |role| Member::join(run.path(), role, WaitPolicy::default(), Entry::Vacant).expect("a place");
    std::thread::scope(|scope| {
        for id in schedule().services() {
            let join = &join;
            let path = run.path();
            scope.spawn(move || {
                let schedule = schedule();
                let transport =
                    IceoryxTransport::open(path, join(Role::Service(id)), &schedule).expect("ports");
                let mut service = frugal(&transport, id, 1);
                let session = FrugalSession(&transport);
                assert_eq!(run_service(&schedule, &mut service, &session, TICKS), Ok(TICKS));
            });
        }
        let tap = IceoryxTap::open(run.path(), join(Role::Tap), &schedule()).expect("ports");
        let mut observer = tap.observer::<ObjectTruth>(0).expect("it is published");
        tap.start().expect("the run starts");
        let mut frame = Frame::zeroed();
        for tick in 0..TICKS {
            assert_eq!(with_allocations(0, || observer.receive(&mut frame)), Ok(true));
            with_allocations(0, || tap.set_consumed(tick + 1));
        }
    });
}

/// A session whose ticks must not allocate either.
struct FrugalSession<'a>(&'a IceoryxTransport);

impl Session for FrugalSession<'_> {
    fn start(&self, participant: &mut impl Replaceable) -> Result<Option<Position>, TickError> {
        self.0.start(participant)
    }

    fn begin_phase(&self, at: Position) -> Result<(), TickError> {
        with_allocations(0, || self.0.begin_phase(at))
    }

    fn keep(&self, at: Position, participant: &mut impl Replaceable) -> Result<(), TickError> {
        with_allocations(0, || self.0.keep(at, participant))
    }

    fn finish(&self, outcome: Result<(), TickError>) -> Result<(), TickError> {
        self.0.finish(outcome)
    }
}
