//! Cables between hosts: packets are delayed, lost and cut here, since few kernels can do so to each other's.
//!
//! Every host has a network interface of its own (a TUN device) in its own namespace. What it sends comes here as
//! packets, and goes on to whoever has the address, when it is due. Packets on the same way keep their order.

use core::ops::Range;
use std::collections::BinaryHeap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read as _, Write as _};
use std::os::fd::AsRawFd as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};

/// A way from one host to another.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// One way.
    pub delay_us: f64,
    /// By which that differs, as a share of it.
    pub jitter: f64,
    /// Share of packets that are lost.
    pub loss: f64,
    /// Nothing comes through.
    pub is_cut: bool,
}

impl Way {
    /// Of this length, with a fifth more or less, and one packet of a hundred lost.
    pub fn bad(delay_ms: f64) -> Self {
        Self { delay_us: 1e3 * delay_ms, jitter: 0.2, loss: 0.01, is_cut: false }
    }

    /// A robot's own cable.
    pub fn own() -> Self {
        Self { delay_us: 50.0, jitter: 0.0, loss: 0.0, is_cut: false }
    }
}

/// The network part of every host's address.
pub const NETWORK: [u8; 3] = [10, 77, 0];
const MTU: usize = 1500;
const TUNSETIFF: libc::c_ulong = 0x4004_54ca;
const IFF_TUN: libc::c_short = 0x0001;
const IFF_NO_PI: libc::c_short = 0x1000;

/// The cables of all hosts.
pub struct Wire {
    ways: Arc<Mutex<Vec<Way>>>,
    hosts: usize,
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// A packet on its way; the one that is due first is the greatest.
struct Packet {
    due_ns: u64,
    number: u64,
    to: usize,
    bytes: Vec<u8>,
}

impl Ord for Packet {
    fn cmp(&self, other: &Self) -> core::cmp::Ordering {
        (other.due_ns, other.number).cmp(&(self.due_ns, self.number))
    }
}

impl PartialOrd for Packet {
    fn partial_cmp(&self, other: &Self) -> Option<core::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Packet {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Packet {}

/// A new network interface of this name, and where its packets come and go.
pub fn interface(name: &str) -> io::Result<File> {
    let tun =
        OpenOptions::new().read(true).write(true).custom_flags(libc::O_NONBLOCK).open("/dev/net/tun")?;
    #[repr(C)]
    struct Request {
        name: [u8; 16],
        flags: libc::c_short,
        rest: [u8; 22],
    }
    let mut request = Request { name: [0; 16], flags: IFF_TUN | IFF_NO_PI, rest: [0; 22] };
    request.name[..name.len()].copy_from_slice(name.as_bytes());
    // SAFETY: the request is as large as the kernel's, and lives longer than the call.
    match unsafe { libc::ioctl(tun.as_raw_fd(), TUNSETIFF, &raw mut request) } {
        0 => Ok(tun),
        _ => Err(io::Error::last_os_error()),
    }
}

impl Wire {
    /// Between these interfaces; host i has the address [`NETWORK`].i + 1.
    pub fn between(interfaces: Vec<File>) -> Self {
        let hosts = interfaces.len();
        let ways = Arc::new(Mutex::new(vec![Way::own(); hosts * hosts]));
        let is_over = Arc::new(AtomicBool::new(false));
        let (shared, over) = (Arc::clone(&ways), Arc::clone(&is_over));
        let thread = thread::spawn(move || carry(interfaces, &shared, &over));
        Self { ways, hosts, is_over, thread: Some(thread) }
    }

    /// Changes the ways between these hosts, both ways.
    pub fn set(&self, one: usize, others: Range<usize>, change: impl Fn(&mut Way)) {
        let mut ways = self.ways.lock().expect("nobody panicked");
        for other in others.filter(|other| *other != one) {
            change(&mut ways[one * self.hosts + other]);
            change(&mut ways[other * self.hosts + one]);
        }
    }
}

impl Drop for Wire {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn now_ns() -> u64 {
    let mut now = libc::timespec { tv_sec: 0, tv_nsec: 0 };
    // SAFETY: it is written to, and lives longer than the call.
    unsafe { libc::clock_gettime(libc::CLOCK_MONOTONIC, &raw mut now) };
    now.tv_sec as u64 * 1_000_000_000 + now.tv_nsec as u64
}

fn carry(mut interfaces: Vec<File>, ways: &Mutex<Vec<Way>>, is_over: &AtomicBool) {
    // A cable does not wait for a core: where that is allowed it comes before all others.
    let priority = libc::sched_param { sched_priority: 60 };
    // SAFETY: plain numbers; a failure leaves things as they are.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const priority) };
    let hosts = interfaces.len();
    let mut polled: Vec<_> = interfaces
        .iter()
        .map(|file| libc::pollfd { fd: file.as_raw_fd(), events: libc::POLLIN, revents: 0 })
        .collect();
    let (mut on_their_way, mut number, mut random) =
        (BinaryHeap::<Packet>::new(), 0_u64, 0x9e37_79b9_7f4a_7c15_u64);
    let mut last_due_ns = vec![0_u64; hosts * hosts];
    let mut uniform = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1_u64 << 53) as f64
    };
    let mut buffer = [0_u8; MTU + 64];
    while !is_over.load(Ordering::Relaxed) {
        let wait_ns = on_their_way.peek().map_or(50_000_000, |packet| packet.due_ns.saturating_sub(now_ns()));
        let timeout = libc::timespec { tv_sec: 0, tv_nsec: wait_ns.min(50_000_000) as libc::c_long };
        // SAFETY: the descriptors are open, and the list is as long as is said.
        unsafe {
            libc::ppoll(
                polled.as_mut_ptr(),
                polled.len() as libc::nfds_t,
                &raw const timeout,
                core::ptr::null(),
            )
        };
        let now = now_ns();
        for from in 0..hosts {
            while let Ok(length) = interfaces[from].read(&mut buffer) {
                let packet = &buffer[..length];
                // IPv4 of our network only.
                if length < 20 || packet[0] >> 4 != 4 || packet[16..19] != NETWORK {
                    continue;
                }
                let Some(to) = usize::from(packet[19]).checked_sub(1).filter(|to| *to < hosts) else {
                    continue;
                };
                let way = ways.lock().expect("nobody panicked")[from * hosts + to];
                if way.is_cut || uniform() < way.loss {
                    continue;
                }
                let delay_us = way.delay_us * (1.0 + way.jitter * (2.0 * uniform() - 1.0));
                let last = &mut last_due_ns[from * hosts + to];
                *last = (*last).max(now + (1e3 * delay_us) as u64);
                number += 1;
                on_their_way.push(Packet { due_ns: *last, number, to, bytes: packet.to_vec() });
            }
        }
        while on_their_way.peek().is_some_and(|packet| packet.due_ns <= now_ns())
            && let Some(Packet { to, bytes, .. }) = on_their_way.pop()
        {
            // A host that is gone hears nothing.
            let _ = interfaces[to].write(&bytes);
        }
    }
}
