//! Cores that do not fall asleep: one that idles takes tens of microseconds to wake up, and in a tick somebody is woken
//! up four times.
//!
//! Who keeps a core awake keeps watch there, too: it wakes those of the run who sleep on that core.

use crate::{MissingRight, RealTime};
use std::io;

/// Why a core could not be kept awake.
#[derive(Debug, thiserror::Error)]
pub enum AwakeError {
    /// It is not ours.
    #[error(transparent)]
    Core(#[from] MissingRight),
    /// The thread would be in others' way.
    #[error("a thread can't be told to run only when nobody else does: {0}")]
    Policy(#[from] io::Error),
}

/// Has the calling thread run on this core alone, and only while nobody else wants to (`SCHED_IDLE`). It makes room at
/// once, needs no right, and keeps the core awake as long as it does anything ([`Board::keep_watch`]). What it costs is power.
///
/// For the same reason it may take seconds to end where others have enough to do. It belongs in a process of its own,
/// for which nobody waits.
///
/// # Errors
/// The core is not ours, or the thread would be in others' way.
///
/// [`Board::keep_watch`]: crate::Board::keep_watch
pub fn run_when_idle(core: usize) -> Result<(), AwakeError> {
    let on_missing_right = crate::OnMissingRight::Fail;
    RealTime { core: Some(core), on_missing_right, ..RealTime::default() }.apply()?;
    Ok(leave_to_others()?)
}

/// The cores that are to be kept awake: those that services are pinned to or, if none is, all that this process may use,
/// unless these are more than there are services: then most of them have nothing to do with the run.
pub fn cores_to_keep_awake(pinned: impl Iterator<Item = usize>, services: usize) -> Vec<usize> {
    let mut cores: Vec<_> = pinned.collect();
    if cores.is_empty() {
        let ours = core_affinity::get_core_ids().unwrap_or_default();
        cores.extend(ours.iter().map(|core| core.id).filter(|_| ours.len() <= services));
    }
    cores.sort_unstable();
    cores.dedup();
    cores
}

/// Leaves the core of the calling thread to whoever else wants it.
fn leave_to_others() -> io::Result<()> {
    let parameter = libc::sched_param { sched_priority: 0 };
    // SAFETY: the parameter lives across the call, which only reads it; 0 is the calling thread.
    match unsafe { libc::sched_setscheduler(0, libc::SCHED_IDLE, &parameter) } {
        0 => Ok(()),
        _ => Err(io::Error::last_os_error()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn who_runs_only_when_nobody_else_does_needs_no_right() {
        let policy = std::thread::spawn(|| {
            leave_to_others().expect("everybody may");
            // SAFETY: it only reads the calling thread's policy.
            unsafe { libc::sched_getscheduler(0) }
        });
        assert_eq!(policy.join().expect("it ends"), libc::SCHED_IDLE);
    }

    #[test]
    fn a_core_that_is_not_ours_is_left_alone() {
        let error = std::thread::spawn(|| run_when_idle(usize::MAX)).join().expect("no panic");
        assert!(error.is_err_and(|error| error.to_string().contains("cpuset")));
    }

    #[test]
    fn the_cores_of_services_are_kept_awake_and_no_others() {
        assert_eq!(cores_to_keep_awake([3, 1, 3].into_iter(), 6), [1, 3]);
        assert!(!cores_to_keep_awake([].into_iter(), usize::MAX).is_empty());
        assert!(cores_to_keep_awake([].into_iter(), 0).is_empty());
    }
}
