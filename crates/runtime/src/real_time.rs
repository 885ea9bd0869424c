//! What a process asks of the operating system's scheduler: a core, a priority, memory that stays.
//!
//! None of it changes what is computed. A right that is missing is therefore a warning by default,
//! which says how to grant it.

use std::io;

/// What to do about a right that is missing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum OnMissingRight {
    /// Go on without, and say so.
    #[default]
    Warn,
    /// Refuse to run.
    Fail,
}

/// What a process asks for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RealTime {
    /// The core it runs on; the operating system's choice when absent.
    pub core: Option<usize>,
    /// Its priority among first-in-first-out processes; the ordinary scheduler when absent. All services
    /// of a run share one: with two, the lower would wait for the higher to yield, which waits for it.
    pub fifo_priority: Option<u8>,
    /// Whether its memory is kept from being paged out.
    pub lock_memory: bool,
    /// What to do about a right that is missing.
    pub on_missing_right: OnMissingRight,
}

/// Something that was asked for and not granted.
#[derive(Debug, thiserror::Error)]
pub enum MissingRight {
    /// There is no such core, or it is not ours.
    #[error("core {core} can't be used; this process may use {available:?} (see its cpuset)")]
    Core {
        /// The core.
        core: usize,
        /// The cores that can.
        available: Vec<usize>,
    },
    /// The priority is not granted.
    #[error(
        "FIFO priority {priority} is not granted: {source}. `setcap cap_sys_nice=ep` on the binary, \
         `LimitRTPRIO={priority}` in its systemd unit, or `rtprio {priority}` in \
         /etc/security/limits.conf would grant it"
    )]
    FifoPriority {
        /// The priority.
        priority: u8,
        /// Why.
        source: io::Error,
    },
    /// The memory is not kept.
    #[error(
        "memory can't be locked: {source}. `LimitMEMLOCK=infinity` in the systemd unit, or `memlock \
         unlimited` in /etc/security/limits.conf would allow it"
    )]
    LockMemory {
        /// Why.
        source: io::Error,
    },
}

impl RealTime {
    /// Asks for all of it, for the calling thread (memory: for the process), and returns what was not
    /// granted, for the caller to report.
    ///
    /// # Errors
    /// The first right that is missing, if that is to be an error.
    pub fn apply(&self) -> Result<Vec<MissingRight>, MissingRight> {
        let requests = [
            self.core.map(pin_to),
            self.lock_memory.then(lock_memory),
            // Last: nobody on this core is to wait for what takes long.
            self.fifo_priority.map(use_fifo_priority),
        ];
        let missing = requests.into_iter().flatten().filter_map(Result::err);
        match self.on_missing_right {
            OnMissingRight::Warn => Ok(missing.collect()),
            OnMissingRight::Fail => missing.map(Err).next().unwrap_or(Ok(Vec::new())),
        }
    }
}

impl RealTime {
    /// Until [`RealTime::rush_again`] this process has no priority over others: while it sets itself up, no tick of
    /// another on its core is to wait for it.
    pub fn linger(&self) {
        if self.fifo_priority.is_some() {
            let ordinary = libc::sched_param { sched_priority: 0 };
            // SAFETY: the parameter lives across the call, which only reads it; 0 is the calling thread. Giving up a
            // priority is always granted.
            unsafe { libc::sched_setscheduler(0, libc::SCHED_OTHER, &ordinary) };
        }
    }

    /// Takes the priority again that was granted before.
    pub fn rush_again(&self) {
        if let Some(priority) = self.fifo_priority {
            // Where it was not granted that has been said.
            let _ = use_fifo_priority(priority);
        }
    }
}

fn pin_to(core: usize) -> Result<(), MissingRight> {
    let available = core_affinity::get_core_ids().unwrap_or_default();
    match available.iter().find(|id| id.id == core) {
        Some(id) if core_affinity::set_for_current(*id) => Ok(()),
        _ => Err(MissingRight::Core { core, available: available.iter().map(|id| id.id).collect() }),
    }
}

fn use_fifo_priority(priority: u8) -> Result<(), MissingRight> {
    let parameter = libc::sched_param { sched_priority: priority.into() };
    // SAFETY: the parameter lives across the call, which only reads it; 0 is the calling thread.
    let result = unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &parameter) };
    if result == 0 {
        return Ok(());
    }
    Err(MissingRight::FifoPriority { priority, source: io::Error::last_os_error() })
}

fn lock_memory() -> Result<(), MissingRight> {
    let flags = rustix::mm::MlockAllFlags::CURRENT | rustix::mm::MlockAllFlags::FUTURE;
    rustix::mm::mlockall(flags).map_err(|errno| MissingRight::LockMemory { source: errno.into() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No machine has it.
    const NO_CORE: RealTime = RealTime {
        core: Some(usize::MAX),
        fifo_priority: None,
        lock_memory: false,
        on_missing_right: OnMissingRight::Warn,
    };

    #[test]
    fn a_missing_right_is_a_warning_that_names_it() {
        let missing = NO_CORE.apply().expect("a warning");
        assert!(matches!(missing[..], [MissingRight::Core { core: usize::MAX, .. }]));
        assert!(missing[0].to_string().contains("cpuset"));
    }

    #[test]
    fn where_rights_are_demanded_a_missing_one_is_an_error() {
        let demanding = RealTime { on_missing_right: OnMissingRight::Fail, ..NO_CORE };
        assert!(matches!(demanding.apply(), Err(MissingRight::Core { .. })));
    }

    #[test]
    fn a_priority_that_does_not_exist_is_not_granted() {
        // 255 is above what Linux has, for every user.
        let missing =
            RealTime { fifo_priority: Some(255), ..RealTime::default() }.apply().expect("a warning");
        assert!(matches!(missing[..], [MissingRight::FifoPriority { priority: 255, .. }]));
        assert!(missing[0].to_string().contains("LimitRTPRIO"));
    }

    #[test]
    fn a_thread_can_be_pinned_to_a_core_that_it_may_use() {
        let core = core_affinity::get_core_ids().expect("a list")[0].id;
        let pinned = std::thread::spawn(move || {
            let missing = RealTime { core: Some(core), ..RealTime::default() }.apply().expect("no error");
            (missing.len(), core_affinity::get_core_ids().expect("a list").len())
        });
        assert_eq!(pinned.join().expect("it ends"), (0, 1));
    }
}
