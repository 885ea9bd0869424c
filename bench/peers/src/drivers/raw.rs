//! The floor: one slot of shared memory for each topic, a number that says which frame is in it, and nothing else. No
//! queues, no checks, nobody who may die, no observer.

use crate::driver::{Driver, DriverError, End, Receiver, Sender, Wait};
use core::sync::atomic::{AtomicU32, Ordering, fence};
use memmap2::MmapRaw;
use mikoshi_ipc_types::ServiceId;
use rustix::thread::futex;
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

/// What precedes a frame, on a cache line of its own.
#[repr(C, align(64))]
struct Head {
    /// Frames that have been sent: the futex.
    sent: AtomicU32,
    /// Not 0 while the receiver sleeps.
    sleeps: AtomicU32,
}

/// One end of a topic's file.
pub struct Slot {
    map: MmapRaw,
    frame_bytes: usize,
    /// Frames that this end has seen or sent.
    count: u32,
    wait: Wait,
}

impl Slot {
    fn open(place: &Path, end: End, wait: Wait) -> Result<Self, DriverError> {
        let frame_bytes = end.frame_bytes;
        let path = place.join(end.name());
        // Whoever comes first makes it: zeros, nothing has been sent.
        let file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path);
        let file = file.map_err(DriverError::of)?;
        let bytes = size_of::<Head>() + frame_bytes;
        file.set_len(bytes as u64).map_err(DriverError::of)?;
        let map = memmap2::MmapOptions::new().len(bytes).populate().map_raw(&file);
        Ok(Self { map: map.map_err(DriverError::of)?, frame_bytes, count: 0, wait })
    }

    fn head(&self) -> &Head {
        // SAFETY: the mapping begins with a head, aligned to a page, and lives as long as `self`; a head is made of
        // atomics, which others may change.
        unsafe { &*self.map.as_ptr().cast() }
    }

    fn frame(&self) -> *mut u8 {
        // SAFETY: the mapping goes on behind the head.
        unsafe { self.map.as_mut_ptr().add(size_of::<Head>()) }
    }
}

impl Sender for Slot {
    fn send(&mut self, frame: &[u8]) -> Result<(), DriverError> {
        let bytes = frame.len().min(self.frame_bytes);
        // SAFETY: the slot has room for so many bytes. In lockstep its receiver has copied the frame before, and
        // does not look until the count says that this one is there.
        unsafe { core::ptr::copy_nonoverlapping(frame.as_ptr(), self.frame(), bytes) };
        self.count = self.count.wrapping_add(1);
        let head = self.head();
        head.sent.store(self.count, Ordering::Release);
        if self.wait == Wait::Blocking {
            fence(Ordering::SeqCst);
            if head.sleeps.load(Ordering::Relaxed) != 0 {
                futex::wake(&head.sent, futex::Flags::empty(), 1).map_err(DriverError::of)?;
            }
        }
        Ok(())
    }
}

impl Receiver for Slot {
    fn receive(&mut self, frame: &mut [u8]) -> Result<(), DriverError> {
        let before = self.count;
        self.count = before.wrapping_add(1);
        let head = self.head();
        match self.wait {
            Wait::Yielding => {
                while head.sent.load(Ordering::Acquire) == before {
                    rustix::thread::sched_yield();
                }
            }
            Wait::Blocking => {
                while head.sent.load(Ordering::Acquire) == before {
                    head.sleeps.store(1, Ordering::Relaxed);
                    fence(Ordering::SeqCst);
                    if head.sent.load(Ordering::Acquire) == before {
                        // Whatever ends it, the count is looked at again.
                        let _ = futex::wait(&head.sent, futex::Flags::empty(), before, None);
                    }
                    head.sleeps.store(0, Ordering::Relaxed);
                }
            }
        }
        let bytes = frame.len().min(self.frame_bytes);
        // SAFETY: as for sending; its sender waits for what comes of this frame.
        unsafe { core::ptr::copy_nonoverlapping(self.frame(), frame.as_mut_ptr(), bytes) };
        Ok(())
    }
}

/// Raw shared memory.
pub struct Raw {
    place: PathBuf,
    wait: Wait,
}

impl Driver for Raw {
    type Sender = Slot;
    type Receiver = Slot;

    fn open(place: &Path, _: ServiceId, wait: Wait) -> Result<Self, DriverError> {
        Ok(Self { place: place.to_owned(), wait })
    }

    fn sender(&self, end: End) -> Result<Slot, DriverError> {
        Slot::open(&self.place, end, self.wait)
    }

    fn receiver(&self, end: End) -> Result<Slot, DriverError> {
        Slot::open(&self.place, end, self.wait)
    }
}
