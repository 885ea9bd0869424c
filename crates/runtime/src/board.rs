//! The board of a run: a page of shared memory on which every process of the run says who it is, where
//! it stands and what it sleeps for.
//!
//! It is what `mikoshi status` reads, where services meet before the first tick and after the last, and
//! where one that waits learns that another has died.

use crate::mailbox::Mailbox;
use crate::process::ProcessIdentity;
use crate::wait::{Bed, PLACES};
use crate::watch::Watch;
use crate::{FaultCode, Position, TickError};
use core::fmt;
use core::sync::atomic::{AtomicU32, AtomicU64, Ordering};
use memmap2::MmapRaw;
use mikoshi_ipc_types::{Drive, MAX_ROBOTS, OperatorInput, Push, ServiceId, operator};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::unix::fs::OpenOptionsExt;
use std::path::{Path, PathBuf};

/// Who has a slot on the board.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// Who started the run, and ends it.
    Supervisor,
    /// The one observer that is connected from the first tick; all other observers attach to it.
    Tap,
    /// What carries frames between this host and others, where there are any.
    Link,
    /// A service.
    Service(ServiceId),
}

impl Role {
    const FIRST_SERVO: u64 = 16;

    fn to_wire(self) -> u64 {
        match self {
            Self::Supervisor => 1,
            Self::Tap => 2,
            Self::Service(ServiceId::Bridge) => 3,
            Self::Service(ServiceId::Coordinator) => 4,
            Self::Link => 5,
            Self::Service(ServiceId::Servo(robot)) => Self::FIRST_SERVO + robot as u64,
        }
    }

    fn from_wire(code: u64) -> Option<Self> {
        match code {
            1 => Some(Self::Supervisor),
            2 => Some(Self::Tap),
            3 => Some(Self::Service(ServiceId::Bridge)),
            4 => Some(Self::Service(ServiceId::Coordinator)),
            5 => Some(Self::Link),
            _ => code
                .checked_sub(Self::FIRST_SERVO)
                .filter(|robot| *robot < MAX_ROBOTS as u64)
                .map(|robot| Self::Service(ServiceId::Servo(robot as usize))),
        }
    }
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Supervisor => f.pad("supervisor"),
            Self::Tap => f.pad("tap"),
            Self::Link => f.pad("link"),
            Self::Service(service) => f.pad(&service.to_string()),
        }
    }
}

/// How far a process of the run has come.
///
/// ```text
/// Absent → Starting → Wired → Ready → Running → Done
///             │ └───────┴───────┴────────┤ └──→ Failed
///             └──── its successor ──── Retired
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u32)]
pub enum State {
    /// Nobody has this slot.
    Absent = 0,
    /// The process that had it has made room for its successor.
    Retired,
    /// It sets itself up.
    Starting,
    /// All its ports exist.
    Wired,
    /// Its ports are connected to those of all others.
    Ready,
    /// It executes ticks.
    Running,
    /// It has executed all of them.
    Done,
    /// It ended early.
    Failed,
}

impl State {
    fn from_wire(code: u32) -> Self {
        match code {
            0 => Self::Absent,
            1 => Self::Retired,
            2 => Self::Starting,
            3 => Self::Wired,
            4 => Self::Ready,
            5 => Self::Running,
            6 => Self::Done,
            // A board is written by our processes only; whatever else it says, it is not well.
            _ => Self::Failed,
        }
    }

    /// Whether the process has nothing more to say.
    pub fn has_ended(self) -> bool {
        matches!(self, Self::Done | Self::Failed)
    }
}

impl fmt::Display for State {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Absent => "absent",
            Self::Retired => "retired",
            Self::Starting => "starting",
            Self::Wired => "wired",
            Self::Ready => "ready",
            Self::Running => "running",
            Self::Done => "done",
            Self::Failed => "failed",
        })
    }
}

/// What a slot says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SlotStatus {
    /// Whose it is.
    pub role: Role,
    /// The process that has it, or had it last.
    pub process: Option<ProcessIdentity>,
    /// Whether that process still runs.
    pub alive: bool,
    /// Its incarnation: 1 for the first.
    pub epoch: u64,
    /// How far it has come.
    pub state: State,
    /// The tick that it executes; for the tap, the number of ticks that it has consumed.
    pub tick: u64,
    /// Why it failed.
    pub fault: Option<(FaultCode, String)>,
}

/// Words of text in which a process says why it failed.
const MESSAGE_WORDS: usize = 24;

/// What one process says. The first line changes seldom, the second each tick and is written by its
/// owner only, the beds are written when somebody sleeps: cache lines that don't disturb one another.
#[repr(C, align(64))]
pub(crate) struct Slot {
    role: AtomicU64,
    /// A [`ProcessIdentity`]: who is in charge, or was last.
    owner: AtomicU64,
    epoch: AtomicU64,
    /// A [`Position`]: what was published from here on counts only if it is of this epoch.
    since: AtomicU64,
    state: AtomicU32,
    /// Set when a successor is ready.
    retirement: AtomicU32,
    fault: AtomicU32,
    message_length: AtomicU32,
    /// The board's generation whose processes it is connected to.
    welcomed: AtomicU32,
    /// 1 while no process of this host may be in charge: the service is on another host, or may be.
    reserved: AtomicU32,
    progress: Progress,
    /// Where its owner sleeps alone.
    pub(crate) bed: Bed,
    /// Where those sleep who will be in charge, or were: whoever calls the owner does not wake them.
    pub(crate) porch: Bed,
    /// By phase: where others sleep until its owner has said what they wait for.
    lobbies: [Bed; LOBBIES],
    bells: [Bell; BELLS],
    message: [AtomicU64; MESSAGE_WORDS],
}

#[repr(C, align(64))]
struct Progress {
    /// A [`Position`].
    position: AtomicU64,
    /// A [`ProcessIdentity`]: who stood by last.
    standby: AtomicU64,
    /// Which of the hosts on which it may be the service is on, as far as this one knows: how often it has moved.
    moves: AtomicU64,
    /// How often its owner has asked for memory, where it counts that.
    allocations: AtomicU64,
}

/// Changes whenever a frame of one topic has been sent. On a cache line of its own: its receiver looks at it all the
/// time.
#[repr(C, align(64))]
pub(crate) struct Bell {
    rung: AtomicU64,
    /// One past the latest tick that it was rung for.
    next_tick: AtomicU64,
}

impl Bell {
    /// Says that there may be something.
    fn ring(&self) {
        self.rung.fetch_add(1, Ordering::SeqCst);
    }

    /// Says that the frame of this tick has been sent. Sequentially consistent, as [`Bed::call`] wants it.
    pub(crate) fn ring_for(&self, tick: u64) {
        self.next_tick.fetch_max(tick.saturating_add(1), Ordering::SeqCst);
        self.ring();
    }

    /// Whether the frame of this tick has been sent. Of several who ask after they have rung, one sees all.
    pub(crate) fn has_rung_for(&self, tick: u64) -> bool {
        self.next_tick.load(Ordering::SeqCst) > tick
    }
}

/// Phases of a service that have a lobby of their own; any more share the last one.
const LOBBIES: usize = 2;

/// Topics of a service that have a bell of their own; any more share the last one.
const BELLS: usize = 2 * MAX_ROBOTS + 1;

/// Hears whether something may have been sent since the last look: looking into a queue costs more.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Doorbell {
    /// How the bell stood before that look.
    heard: Option<u64>,
    /// Whether it found something: then there may be more.
    has_found: bool,
}

impl Doorbell {
    /// What `look` finds, if there may be something; of who awaits a tick, something of that tick.
    pub(crate) fn answer<T, E>(
        &mut self,
        bell: &Bell,
        awaited_tick: Option<u64>,
        look: impl FnOnce() -> Result<Option<T>, E>,
    ) -> Result<Option<T>, E> {
        // Before the look, and before asking for the tick: what comes during either is for the next.
        let rung = Some(bell.rung.load(Ordering::Acquire));
        // A tick for which it will yet be rung changes how it stands. What else is still there can wait for that.
        let may_have_more = || self.has_found && awaited_tick.is_none_or(|tick| bell.has_rung_for(tick));
        if self.heard == rung && !may_have_more() {
            return Ok(None);
        }
        let found = look()?;
        *self = Self { heard: rung, has_found: found.is_some() };
        Ok(found)
    }
}

/// Who speaks for a service.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Charge {
    /// Its incarnation.
    pub epoch: u64,
    /// The first phase that it speaks for. What its predecessors published before counts.
    pub since: Position,
}

impl Slot {
    pub(crate) fn role(&self) -> Option<Role> {
        Role::from_wire(self.role.load(Ordering::Relaxed))
    }

    /// Says from which phase on its owner speaks.
    pub(crate) fn set_since(&self, since: Position) {
        self.since.store(since.to_word(), Ordering::Release);
    }

    pub(crate) fn state(&self) -> State {
        State::from_wire(self.state.load(Ordering::Acquire))
    }

    pub(crate) fn set_state(&self, state: State) {
        self.state.store(state as u32, Ordering::Release);
    }

    pub(crate) fn position(&self) -> Position {
        Position::from_word(self.progress.position.load(Ordering::Acquire))
    }

    pub(crate) fn set_position(&self, position: Position) {
        self.progress.position.store(position.to_word(), Ordering::Release);
    }

    pub(crate) fn set_allocations(&self, allocations: u64) {
        self.progress.allocations.store(allocations, Ordering::Relaxed);
    }

    /// The bell of what the schedule lists at this place among its owner's outputs.
    pub(crate) fn bell(&self, index: usize) -> &Bell {
        &self.bells[index.min(BELLS - 1)]
    }

    /// Where those sleep who wait for what its owner says in this phase.
    pub(crate) fn lobby(&self, phase: usize) -> &Bed {
        &self.lobbies[phase.min(LOBBIES - 1)]
    }

    /// All in which anybody sleeps.
    pub(crate) fn beds(&self) -> impl Iterator<Item = &Bed> {
        [&self.bed, &self.porch].into_iter().chain(&self.lobbies)
    }

    /// Rings for everything that its owner may have sent.
    pub(crate) fn ring_all(&self) {
        self.bells.iter().for_each(Bell::ring);
    }

    pub(crate) fn process(&self) -> Option<ProcessIdentity> {
        ProcessIdentity::from_word(self.owner.load(Ordering::Acquire))
    }

    pub(crate) fn epoch(&self) -> u64 {
        self.epoch.load(Ordering::Acquire)
    }

    /// Who speaks for the service. Read while a successor takes over, it may be of the epoch before with a
    /// `since` that matters only to the next.
    pub(crate) fn charge(&self) -> Charge {
        let epoch = self.epoch();
        Charge { epoch, since: Position::from_word(self.since.load(Ordering::Acquire)) }
    }

    /// The living process that has the slot, if there is one.
    pub(crate) fn living_owner(&self) -> Option<ProcessIdentity> {
        self.process().filter(|owner| {
            let state = self.state();
            state != State::Retired && !state.has_ended() && owner.is_alive()
        })
    }

    /// Gives the slot to a process, unless a living one has it; from this phase on it speaks for the
    /// service. Returns its epoch.
    pub(crate) fn claim(&self, process: ProcessIdentity, since: Position) -> Result<u64, ProcessIdentity> {
        let found = self.owner.load(Ordering::Acquire);
        if let Some(owner) = self.living_owner() {
            return Err(owner);
        }
        self.take_from(found, process, since)
    }

    /// Gives the slot to a process though the one that has it lives: it is `frozen`, and fenced from now on.
    pub(crate) fn seize(
        &self,
        frozen: ProcessIdentity,
        process: ProcessIdentity,
        since: Position,
    ) -> Result<u64, ProcessIdentity> {
        self.take_from(frozen.to_word(), process, since)
    }

    fn take_from(
        &self,
        found: u64,
        process: ProcessIdentity,
        since: Position,
    ) -> Result<u64, ProcessIdentity> {
        // Of two successors one is first.
        self.owner
            .compare_exchange(found, process.to_word(), Ordering::AcqRel, Ordering::Acquire)
            .map_err(|word| ProcessIdentity::from_word(word).unwrap_or(process))?;
        self.fault.store(0, Ordering::Relaxed);
        self.retirement.store(0, Ordering::Relaxed);
        self.since.store(since.to_word(), Ordering::Release);
        let epoch = self.epoch.fetch_add(1, Ordering::AcqRel) + 1;
        self.set_state(State::Starting);
        Ok(epoch)
    }

    /// Whether no process of this host may be in charge.
    pub(crate) fn is_reserved(&self) -> bool {
        self.reserved.load(Ordering::Acquire) != 0
    }

    pub(crate) fn set_reserved(&self, is_reserved: bool) {
        self.reserved.store(u32::from(is_reserved), Ordering::Release);
    }

    /// Nobody has it any more.
    pub(crate) fn vacate(&self) {
        self.set_state(State::Absent);
        self.owner.store(0, Ordering::Release);
    }

    /// Says that this process stands by.
    pub(crate) fn set_standby(&self, process: ProcessIdentity) {
        self.progress.standby.store(process.to_word(), Ordering::Release);
    }

    /// Asks whoever has the slot to make room at the next tick.
    pub(crate) fn ask_to_retire(&self) {
        self.retirement.store(1, Ordering::Release);
        self.bed.call_after_fence();
    }

    /// Says that it is connected to all processes of this generation.
    pub(crate) fn welcome(&self, generation: u32) {
        self.welcomed.store(generation, Ordering::Release);
    }

    /// Whether it is connected to the processes of this generation.
    pub(crate) fn has_welcomed(&self, generation: u32) -> bool {
        self.welcomed.load(Ordering::Acquire) >= generation
    }

    pub(crate) fn is_asked_to_retire(&self) -> bool {
        self.retirement.load(Ordering::Acquire) != 0
    }

    pub(crate) fn set_fault(&self, error: &TickError) {
        let text = error.to_string();
        let text = text.as_bytes();
        let length = text.len().min(8 * MESSAGE_WORDS);
        for (word, bytes) in self.message.iter().zip(text[..length].chunks(8)) {
            let mut padded = [0; 8];
            padded[..bytes.len()].copy_from_slice(bytes);
            word.store(u64::from_le_bytes(padded), Ordering::Relaxed);
        }
        self.message_length.store(length as u32, Ordering::Relaxed);
        self.fault.store(error.code() as u32, Ordering::Release);
    }

    pub(crate) fn fault_code(&self) -> Option<FaultCode> {
        FaultCode::from_number(self.fault.load(Ordering::Acquire))
    }

    fn fault(&self) -> Option<(FaultCode, String)> {
        let code = self.fault_code()?;
        let bytes: Vec<u8> =
            self.message.iter().flat_map(|word| word.load(Ordering::Relaxed).to_le_bytes()).collect();
        let length = (self.message_length.load(Ordering::Relaxed) as usize).min(bytes.len());
        Some((code, String::from_utf8_lossy(&bytes[..length]).into_owned()))
    }

    fn status(&self) -> Option<SlotStatus> {
        let process = self.process();
        Some(SlotStatus {
            role: self.role()?,
            process,
            alive: process.is_some_and(|process| process.is_alive()),
            epoch: self.epoch(),
            state: self.state(),
            tick: self.position().tick,
            fault: self.fault(),
        })
    }
}

#[repr(C, align(64))]
struct Header {
    magic: AtomicU64,
    slots: AtomicU64,
    /// Set when the run is to end early: by request, or since a process failed.
    alarm: AtomicU32,
    stop: AtomicU32,
    /// Set while somebody replaces processes that die.
    succession: AtomicU32,
    /// Changes with every successor.
    generation: AtomicU32,
    /// What the operator has said last.
    operator: AtomicU64,
    /// When tick 0 began, by the machine's monotonic clock; 0 before, and in lockstep.
    origin_ns: AtomicU64,
    /// When tick 0 began by the clock of the team, where that is on another host than the bridge's; else 0.
    master_origin_ns: AtomicU64,
    /// Set when ticks are paced by the clock: the run goes on without those that are lost.
    is_paced: AtomicU32,
    /// A [`ProcessIdentity`]: who drives.
    driver: AtomicU64,
    /// A [`Drive`].
    drive: Mailbox<DRIVE_WORDS>,
    /// A [`Push`].
    push: Mailbox<PUSH_WORDS>,
    /// By core.
    watches: [Watch; PLACES],
}

const DRIVE_WORDS: usize = size_of::<Drive>() / size_of::<u64>();
const PUSH_WORDS: usize = size_of::<Push>() / size_of::<u64>();

/// Names the layout too: another one gets another number.
const MAGIC: u64 = u64::from_le_bytes(*b"mikosh12");
const FILE: &str = "board";

/// Why there is no board.
#[derive(Debug, thiserror::Error)]
pub enum BoardError {
    /// Its file can't be made or read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Why.
        source: io::Error,
    },
    /// The file is something else.
    #[error("{}: not the board of a run of this version", path.display())]
    NotABoard {
        /// The file.
        path: PathBuf,
    },
}

/// The mapped board. All that is shared is atomic.
pub struct Board {
    map: MmapRaw,
    slots: usize,
}

impl Board {
    /// Makes the board of a run in its directory. If a tap is expected, the first tick waits for it.
    ///
    /// # Errors
    /// The file can't be made: no space, no rights, or there is one.
    pub fn create(directory: &Path, services: &[ServiceId], expects_tap: bool) -> Result<Self, BoardError> {
        Self::create_for(directory, services, expects_tap, false)
    }

    /// The same for one host of several: with a place for its link, and with those services only that live there or
    /// that those exchange frames with. Nobody takes a `reserved` one before its link says so.
    ///
    /// # Errors
    /// As [`Board::create`].
    pub fn create_for_host(
        directory: &Path,
        services: &[ServiceId],
        reserved: &[ServiceId],
    ) -> Result<Self, BoardError> {
        let board = Self::create_for(directory, services, false, true)?;
        for slot in board.slots() {
            let is_reserved = |service| slot.role() == Some(Role::Service(service));
            slot.set_reserved(reserved.iter().copied().any(is_reserved));
        }
        Ok(board)
    }

    fn create_for(
        directory: &Path,
        services: &[ServiceId],
        expects_tap: bool,
        has_link: bool,
    ) -> Result<Self, BoardError> {
        let path = directory.join(FILE);
        let io_error = |source| BoardError::Io { path: path.clone(), source };
        let roles: Vec<_> = [Role::Supervisor, Role::Tap]
            .into_iter()
            .chain(has_link.then_some(Role::Link))
            .chain(services.iter().copied().map(Role::Service))
            .collect();
        let size = size_of::<Header>() + roles.len() * size_of::<Slot>();
        // It gets its name once it is complete, so that nobody opens half of it.
        let unfinished = directory.join("board.unfinished");
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create_new(true)
            .mode(0o600)
            .open(&unfinished)
            .map_err(io_error)?;
        // Allocated, not only sized: a page that shared memory has no room for would fault later.
        rustix::fs::fallocate(&file, rustix::fs::FallocateFlags::empty(), 0, size as u64)
            .map_err(|errno| io_error(errno.into()))?;
        let board = Self { map: map(&file, size).map_err(io_error)?, slots: roles.len() };
        for (slot, role) in board.slots().iter().zip(&roles) {
            slot.role.store(role.to_wire(), Ordering::Relaxed);
            if *role == Role::Tap && expects_tap {
                slot.set_state(State::Starting);
            }
        }
        board.header().slots.store(roles.len() as u64, Ordering::Relaxed);
        board.header().magic.store(MAGIC, Ordering::Release);
        std::fs::rename(&unfinished, &path).map_err(io_error)?;
        Ok(board)
    }

    /// Opens the board of a run.
    ///
    /// # Errors
    /// There is none, or it is of another version.
    pub fn open(directory: &Path) -> Result<Self, BoardError> {
        let path = directory.join(FILE);
        let io_error = |source| BoardError::Io { path: path.clone(), source };
        let file = OpenOptions::new().read(true).write(true).open(&path).map_err(io_error)?;
        let size = file.metadata().map_err(io_error)?.len() as usize;
        if size < size_of::<Header>() {
            return Err(BoardError::NotABoard { path });
        }
        let mut board = Self { map: map(&file, size).map_err(io_error)?, slots: 0 };
        let slots = board.header().slots.load(Ordering::Relaxed);
        let expected =
            slots.saturating_mul(size_of::<Slot>() as u64).saturating_add(size_of::<Header>() as u64);
        if board.header().magic.load(Ordering::Acquire) != MAGIC || expected != size as u64 {
            return Err(BoardError::NotABoard { path });
        }
        board.slots = slots as usize;
        Ok(board)
    }

    /// How far everybody has come. Cheaper than [`Board::statuses`], which asks the system who lives.
    pub fn states(&self) -> impl Iterator<Item = (Role, State)> {
        self.slots().iter().filter_map(|slot| Some((slot.role()?, slot.state())))
    }

    /// The process in charge of this service, or the last that was.
    pub fn process_of(&self, service: ServiceId) -> Option<ProcessIdentity> {
        self.index_of(Role::Service(service)).and_then(|index| self.slots()[index].process())
    }

    /// How often the process of this service has asked for memory so far, if it counts that; 0 otherwise.
    pub fn allocations_of(&self, service: ServiceId) -> Option<u64> {
        let slot = &self.slots()[self.index_of(Role::Service(service))?];
        Some(slot.progress.allocations.load(Ordering::Relaxed))
    }

    /// Whether a supervisor looks after the run.
    pub fn is_supervised(&self) -> bool {
        let supervisor = self.index_of(Role::Supervisor).map(|index| &self.slots()[index]);
        supervisor.is_some_and(|slot| slot.living_owner().is_some())
    }

    /// Where all services are.
    pub fn positions(&self) -> impl Iterator<Item = (ServiceId, Position)> {
        self.slots().iter().filter_map(|slot| match slot.role()? {
            Role::Service(service) if slot.state().has_ended() => Some((service, Position::END)),
            Role::Service(service) => Some((service, slot.position())),
            _ => None,
        })
    }

    /// Where this service is, or was when it ended.
    pub fn last_position(&self, service: ServiceId) -> Option<Position> {
        self.index_of(Role::Service(service)).map(|index| self.slots()[index].position())
    }

    /// Which incarnation of this service is in charge, and since when: the last phase of its predecessor.
    pub fn charge_of(&self, service: ServiceId) -> Option<(u64, Position)> {
        let charge = self.index_of(Role::Service(service)).map(|index| self.slots()[index].charge())?;
        Some((charge.epoch, charge.since))
    }

    /// Whether no process of this host may be in charge of this service.
    pub fn is_reserved(&self, service: ServiceId) -> bool {
        self.slot_of(service).is_some_and(Slot::is_reserved)
    }

    /// Lets a process of this host take the place of this service.
    pub fn admit(&self, service: ServiceId) {
        if let Some(slot) = self.slot_of(service) {
            slot.set_reserved(false);
            self.wake_all();
        }
    }

    /// Whether a living process stands by for this service, or waits for its place.
    pub fn has_standby(&self, service: ServiceId) -> bool {
        let standby = |slot: &Slot| slot.progress.standby.load(Ordering::Acquire);
        let standby = self.slot_of(service).and_then(|slot| ProcessIdentity::from_word(standby(slot)));
        standby.is_some_and(|process| process.is_alive())
    }

    /// How often this service has moved from host to host, as far as is known here.
    pub fn moves_of(&self, service: ServiceId) -> u64 {
        self.slot_of(service).map_or(0, |slot| slot.progress.moves.load(Ordering::Acquire))
    }

    /// Says how often it has. A number that was said is not taken back.
    pub fn set_moves(&self, service: ServiceId, moves: u64) {
        if let Some(slot) = self.slot_of(service) {
            slot.progress.moves.fetch_max(moves, Ordering::AcqRel);
        }
    }

    fn slot_of(&self, service: ServiceId) -> Option<&Slot> {
        self.index_of(Role::Service(service)).and_then(|index| self.slots().get(index))
    }

    /// What all slots say, in order.
    pub fn statuses(&self) -> Vec<SlotStatus> {
        self.slots().iter().filter_map(Slot::status).collect()
    }

    /// Whether any process of the run still runs.
    pub fn has_living_process(&self) -> bool {
        self.slots().iter().filter_map(Slot::process).any(|process| process.is_alive())
    }

    /// Says that ticks are paced by the clock.
    pub fn set_paced(&self) {
        self.header().is_paced.store(1, Ordering::Release);
    }

    /// Whether ticks are paced by the clock.
    pub fn is_paced(&self) -> bool {
        self.header().is_paced.load(Ordering::Acquire) != 0
    }

    /// When tick 0 began, or would have begun had no time been lost; none before, and in lockstep.
    pub(crate) fn origin_ns(&self) -> Option<u64> {
        Some(self.header().origin_ns.load(Ordering::Acquire)).filter(|origin_ns| *origin_ns != 0)
    }

    pub(crate) fn set_origin_ns(&self, origin_ns: u64) {
        self.header().origin_ns.store(origin_ns, Ordering::Release);
    }

    pub(crate) fn master_origin_ns(&self) -> Option<u64> {
        Some(self.header().master_origin_ns.load(Ordering::Acquire)).filter(|origin_ns| *origin_ns != 0)
    }

    pub(crate) fn set_master_origin_ns(&self, origin_ns: u64) {
        self.header().master_origin_ns.store(origin_ns, Ordering::Release);
    }

    /// How often "stop" was said here, modulo 256.
    pub fn stops(&self) -> u64 {
        operator::stops_of(self.header().operator.load(Ordering::Acquire))
    }

    /// Asks all services to end. Their waits end within a moment.
    pub fn request_stop(&self) {
        self.header().stop.store(1, Ordering::Release);
        self.raise_alarm();
    }

    /// Says whether processes that die are replaced: if so, others wait for their successors.
    pub fn set_succession(&self, is_promised: bool) {
        self.header().succession.store(u32::from(is_promised), Ordering::Release);
        self.wake_all();
    }

    pub(crate) fn succession_is_promised(&self) -> bool {
        self.header().succession.load(Ordering::Acquire) != 0
    }

    /// Lets the operator say something: the coordinator hears it at its next tick.
    pub fn say(&self, command: u64) {
        let word = |last| Some(operator::word_after(last, command));
        let said = self.header().operator.fetch_update(Ordering::AcqRel, Ordering::Acquire, word);
        debug_assert!(said.is_ok(), "there is always a next word");
    }

    /// What the operator says now, after it was heard to say `last`. What whoever drives says counts only if it is
    /// whole, and made of numbers.
    pub(crate) fn operator_input(&self, last: &OperatorInput) -> OperatorInput {
        let word = self.header().operator.load(Ordering::Acquire);
        let drive = self.header().drive.read().map(bytemuck::cast::<_, Drive>);
        let push = self.header().push.read().map(bytemuck::cast::<_, Push>);
        OperatorInput {
            word,
            drive: drive.filter(Drive::is_finite).unwrap_or(last.drive),
            push: push.filter(Push::is_credible).unwrap_or(last.push),
        }
    }

    /// Has the world disturbed from its next tick on. Returns the number by which the world says that it has heard.
    /// One process does so at a time.
    pub fn push(&self, target: u64, force_n: [f64; 3], ticks: u64) -> u64 {
        let last: Push = self.header().push.read().map(bytemuck::cast).unwrap_or_default();
        let number = last.number + 1;
        self.header().push.write(&bytemuck::cast(Push { number, target, force_n, ticks }));
        number
    }

    /// What whoever drives has said last.
    pub(crate) fn drive(&self) -> Drive {
        self.header().drive.read().map(bytemuck::cast).unwrap_or_default()
    }

    pub(crate) fn set_drive(&self, drive: &Drive) {
        self.header().drive.write(&bytemuck::cast(*drive));
    }

    /// Who drives, or drove last.
    pub(crate) fn driver(&self) -> Option<ProcessIdentity> {
        ProcessIdentity::from_word(self.header().driver.load(Ordering::Acquire))
    }

    /// Lets this process drive, unless another living one does that it may not displace.
    pub(crate) fn take_wheel(&self, own: ProcessIdentity, by_force: bool) -> Result<(), ProcessIdentity> {
        let found = self.header().driver.load(Ordering::Acquire);
        match ProcessIdentity::from_word(found) {
            Some(driver) if !by_force && driver.is_alive() => return Err(driver),
            _ => {}
        }
        // Of two who come at once one is first.
        let taken =
            self.header().driver.compare_exchange(found, own.to_word(), Ordering::AcqRel, Ordering::Acquire);
        taken.map(drop).map_err(|word| ProcessIdentity::from_word(word).unwrap_or(own))
    }

    /// Lets others drive, if it was this process that did.
    pub(crate) fn leave_wheel(&self, own: ProcessIdentity) {
        let left =
            self.header().driver.compare_exchange(own.to_word(), 0, Ordering::AcqRel, Ordering::Relaxed);
        // Whoever has taken it over meanwhile keeps it.
        let _ = left;
    }

    /// Tells all others that a process has taken another one's place. Returns the generation that it opens.
    pub(crate) fn announce_successor(&self) -> u32 {
        let generation = self.header().generation.fetch_add(1, Ordering::AcqRel) + 1;
        self.wake_all();
        generation
    }

    pub(crate) fn generation(&self) -> u32 {
        self.header().generation.load(Ordering::Acquire)
    }

    pub(crate) fn stop_is_requested(&self) -> bool {
        self.header().stop.load(Ordering::Acquire) != 0
    }

    /// Makes every wait look around.
    pub(crate) fn raise_alarm(&self) {
        self.header().alarm.store(1, Ordering::Release);
        self.wake_all();
    }

    pub(crate) fn alarm_is_raised(&self) -> bool {
        self.header().alarm.load(Ordering::Acquire) != 0
    }

    pub(crate) fn wake_all(&self) {
        for slot in self.slots() {
            slot.beds().for_each(Bed::call_whoever_sleeps);
        }
    }

    pub(crate) fn index_of(&self, role: Role) -> Option<usize> {
        self.slots().iter().position(|slot| slot.role() == Some(role))
    }

    pub(crate) fn watches(&self) -> &[Watch; PLACES] {
        &self.header().watches
    }

    fn header(&self) -> &Header {
        // SAFETY: the mapping is at least as large as a header (checked when it was made), aligned to a
        // page, lives as long as `self`, and a header consists of atomics only, so that other
        // processes may write to it at any time. That nobody truncates the file is given by the run's
        // directory, which only its owner may enter.
        unsafe { &*self.map.as_ptr().cast::<Header>() }
    }

    pub(crate) fn slots(&self) -> &[Slot] {
        // SAFETY: as for the header; size and alignment were checked when the mapping was made: the
        // header's size is a multiple of the slot's alignment.
        unsafe {
            let first = self.map.as_ptr().add(size_of::<Header>()).cast::<Slot>();
            core::slice::from_raw_parts(first, self.slots)
        }
    }
}

const _: () = assert!(size_of::<Header>().is_multiple_of(align_of::<Slot>()));

fn map(file: &File, size: usize) -> io::Result<MmapRaw> {
    memmap2::MmapOptions::new().len(size).populate().map_raw(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn services() -> Vec<ServiceId> {
        ServiceId::of_team(2).collect()
    }

    fn own() -> ProcessIdentity {
        ProcessIdentity::own().expect("/proc is there")
    }

    #[test]
    fn a_queue_is_looked_into_only_if_the_bell_was_rung_since_nothing_was_found() {
        let bell = Bell { rung: AtomicU64::new(0), next_tick: AtomicU64::new(0) };
        let mut doorbell = Doorbell::default();
        let mut look = |found: Option<u8>| {
            let mut looked = false;
            let answer = doorbell.answer(&bell, None, || {
                looked = true;
                Ok::<_, ()>(found)
            });
            (looked, answer)
        };
        assert_eq!(look(None), (true, Ok(None)), "what was before anybody listened");
        assert_eq!(look(Some(1)), (false, Ok(None)));
        bell.ring_for(7);
        assert_eq!(look(Some(1)), (true, Ok(Some(1))));
        assert_eq!(look(Some(2)), (true, Ok(Some(2))), "there may be more");
        assert_eq!(look(None), (true, Ok(None)));
        assert_eq!(look(Some(3)), (false, Ok(None)));
        bell.ring();
        assert_eq!(look(Some(3)), (true, Ok(Some(3))));
        bell.ring_for(5);
        assert_eq!([5, 7, 8].map(|tick| bell.has_rung_for(tick)), [true, true, false]);
    }

    #[test]
    fn who_awaits_a_tick_looks_for_more_only_once_it_was_rung_for_or_the_bell_was_rung_for_anything() {
        let bell = Bell { rung: AtomicU64::new(0), next_tick: AtomicU64::new(0) };
        let mut doorbell = Doorbell::default();
        let mut looks_for = |tick: u64, found: Option<()>| {
            let mut looked = false;
            let answer = doorbell.answer(&bell, Some(tick), || {
                looked = true;
                Ok::<_, ()>(found)
            });
            assert_eq!(answer, Ok(found.filter(|()| looked)));
            looked
        };
        bell.ring_for(3);
        assert!(looks_for(3, Some(())));
        assert!(looks_for(3, Some(())), "the first was another one");
        assert!(!looks_for(4, Some(())), "of tick 4 nothing was sent");
        bell.ring();
        assert!(looks_for(4, Some(())), "it may have been kept");
        assert!(!looks_for(4, Some(())));
        bell.ring_for(4);
        bell.ring_for(5);
        assert!(looks_for(4, Some(())));
        assert!(looks_for(5, Some(())), "it came before that look");
        assert!(!looks_for(6, Some(())));
        bell.ring_for(6);
        assert!(looks_for(6, None));
        assert!(!looks_for(6, Some(())), "it was rung for, and is lost");
    }

    #[test]
    fn what_one_process_writes_another_reads() {
        let directory = tempfile::tempdir().expect("a directory");
        let ours = Board::create(directory.path(), &services(), false).expect("a board");
        let theirs = Board::open(directory.path()).expect("the same board");
        assert_eq!(theirs.statuses().len(), 2 + 4);

        let index = ours.index_of(Role::Service(ServiceId::Servo(1))).expect("a slot");
        let slot = &ours.slots()[index];
        slot.claim(own(), Position::default()).expect("it is free");
        slot.set_position(Position { tick: 7, phase: 1 });
        slot.set_fault(&TickError::PeerLost(ServiceId::Bridge));
        slot.set_state(State::Failed);
        let status = &theirs.statuses()[index];
        assert_eq!(status.role, Role::Service(ServiceId::Servo(1)));
        assert_eq!((status.process, status.alive), (Some(own()), true));
        assert_eq!((status.epoch, status.state, status.tick), (1, State::Failed, 7));
        assert_eq!(status.fault, Some((FaultCode::PeerLost, "bridge is gone".into())));
        let position_of = |index: usize| theirs.positions().nth(index).expect("a service");
        assert_eq!(position_of(2), (ServiceId::Servo(1), Position::END));
        slot.set_state(State::Running);
        assert_eq!(position_of(2), (ServiceId::Servo(1), Position { tick: 7, phase: 1 }));
        assert_eq!(position_of(0), (ServiceId::Bridge, Position::default()));
    }

    #[test]
    fn a_slot_belongs_to_one_living_process() {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::create(directory.path(), &services(), false).expect("a board");
        let slot = &board.slots()[2];
        assert_eq!(slot.claim(own(), Position::default()), Ok(1));
        assert_eq!(slot.claim(own(), Position::default()), Err(own()));

        // Its owner has died: a successor gets it, with the next epoch.
        let dead = ProcessIdentity { start_time: own().start_time + 1, ..own() };
        slot.owner.store(dead.to_word(), Ordering::Relaxed);
        let since = Position { tick: 7, phase: 1 };
        assert_eq!(slot.claim(own(), since), Ok(2));
        assert_eq!(slot.charge(), Charge { epoch: 2, since });
    }

    #[test]
    fn a_slot_is_free_once_its_owner_has_retired() {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::create(directory.path(), &services(), false).expect("a board");
        let slot = &board.slots()[2];
        slot.claim(own(), Position::default()).expect("it is free");
        slot.ask_to_retire();
        assert_eq!(slot.claim(own(), Position::default()), Err(own()), "it was only asked");
        slot.set_state(State::Retired);
        assert_eq!(slot.claim(own(), Position::default()), Ok(2));
        assert!(!slot.is_asked_to_retire(), "its predecessor was");
    }

    #[test]
    fn processes_survive_the_wire() {
        for process in [own(), ProcessIdentity { pid: (1 << 22) - 1, start_time: (1 << 42) - 1 }] {
            assert_eq!(ProcessIdentity::from_word(process.to_word()), Some(process));
        }
        assert_eq!(ProcessIdentity::from_word(0), None);
    }

    #[test]
    fn a_file_that_is_no_board_is_rejected() {
        let directory = tempfile::tempdir().expect("a directory");
        assert!(matches!(Board::open(directory.path()), Err(BoardError::Io { .. })));
        for content in [vec![], vec![0; size_of::<Header>()], vec![0xff; 4096]] {
            std::fs::write(directory.path().join(FILE), content).expect("it can be written");
            assert!(matches!(Board::open(directory.path()), Err(BoardError::NotABoard { .. })));
        }
    }

    #[test]
    fn a_board_that_was_cut_is_rejected() {
        let directory = tempfile::tempdir().expect("a directory");
        Board::create(directory.path(), &services(), false).expect("a board");
        let path = directory.path().join(FILE);
        let whole = std::fs::read(&path).expect("it is readable");
        std::fs::write(&path, &whole[..whole.len() - 1]).expect("it is writable");
        assert!(matches!(Board::open(directory.path()), Err(BoardError::NotABoard { .. })));
    }

    #[test]
    fn a_run_has_one_board() {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::create(directory.path(), &services(), false).expect("a board");
        assert!(!board.has_living_process());
        std::fs::write(directory.path().join("board.unfinished"), "").expect("it can be written");
        assert!(matches!(Board::create(directory.path(), &services(), false), Err(BoardError::Io { .. })));
    }

    #[test]
    fn roles_survive_the_wire() {
        let roles = [Role::Supervisor, Role::Tap, Role::Link].into_iter();
        for role in roles.chain(ServiceId::of_team(MAX_ROBOTS).map(Role::Service)) {
            assert_eq!(Role::from_wire(role.to_wire()), Some(role));
        }
        for code in [0, 6, Role::FIRST_SERVO + MAX_ROBOTS as u64, u64::MAX] {
            assert_eq!(Role::from_wire(code), None);
        }
    }

    #[test]
    fn long_faults_are_cut() {
        let directory = tempfile::tempdir().expect("a directory");
        let board = Board::create(directory.path(), &services(), false).expect("a board");
        const LONG: &str = "0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef\
            0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef\
            0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef0123456789abcdef";
        board.slots()[0].set_fault(&TickError::Service(LONG));
        let (_, text) = board.slots()[0].fault().expect("a fault");
        assert_eq!(text, LONG[..8 * MESSAGE_WORDS]);
    }
}
