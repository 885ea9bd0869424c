//! Hosts: each a network, a shared memory, a name and a clock of its own, on this machine.

use crate::wire::{NETWORK, Wire, interface};
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

/// What the test needs is not here.
#[derive(Debug)]
pub struct Lacking(pub String);

/// One host. Whatever runs on it ends with it.
pub struct Host {
    /// Its name.
    pub name: String,
    holder: Child,
    pid: u32,
}

/// All hosts of a team, and what is between them.
pub struct Cluster {
    /// In the order of the scenario.
    pub hosts: Vec<Host>,
    /// Their cables.
    pub wire: Wire,
}

/// Interfaces have names of their own on this machine before they are moved.
static NUMBER: AtomicU32 = AtomicU32::new(0);

impl Host {
    /// Starts one whose clock is ahead of this machine's by so much; with the cable of another one, if there is one.
    fn start(name: &str, clock_ahead_s: u32, cable: Option<&Self>) -> Result<Self, Lacking> {
        let script = "mount -t tmpfs -o size=256M none /dev/shm && mount -t tmpfs none /run && hostname \"$0\" && \
                      ip link set lo up && echo $$ && exec cat";
        let mut command = match cable {
            Some(other) => {
                let mut command = Command::new("nsenter");
                command.arg(format!("--target={}", other.pid)).args(["--net", "--", "unshare"]);
                command
            }
            None => {
                let mut command = Command::new("unshare");
                command.arg("--net");
                command
            }
        };
        command.args(["--mount", "--uts", "--ipc", "--time", "--propagation", "private"]);
        command.arg(format!("--monotonic={clock_ahead_s}"));
        command.args(["--fork", "--kill-child", "sh", "-c", script, name]);
        let spawned = command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut holder = spawned.map_err(|error| Lacking(format!("unshare: {error}")))?;
        let mut line = String::new();
        let out = holder.stdout.as_mut().expect("it is piped");
        let _ = BufReader::new(out).read_line(&mut line);
        match line.trim().parse() {
            Ok(pid) => Ok(Self { name: name.to_owned(), holder, pid }),
            Err(_) => {
                let _ = holder.kill();
                let output = holder.wait_with_output().expect("it was started");
                Err(Lacking(String::from_utf8_lossy(&output.stderr).trim().to_owned()))
            }
        }
    }

    /// A program on this host.
    pub fn command(&self, program: &Path) -> Command {
        let mut command = Command::new("nsenter");
        command.arg(format!("--target={}", self.pid));
        command
            .args(["--mount", "--net", "--uts", "--ipc", "--time"])
            .arg(format!("--wd={}", std::env::current_dir().expect("there is one").display()));
        command.arg("--").arg(program).stdin(Stdio::null());
        command
    }

    /// Runs a program on this host to its end, which must be a good one.
    #[track_caller]
    pub fn run(&self, program: &Path, arguments: &[&str]) -> Output {
        let output = self.command(program).args(arguments).output().expect("it can be started");
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        assert!(
            output.status.success(),
            "{} on {}: {}{}{}",
            program.display(),
            self.name,
            output.status,
            text(&output.stdout),
            text(&output.stderr)
        );
        output
    }

    /// A file of its shared memory, as seen from here.
    pub fn file(&self, path: &str) -> PathBuf {
        PathBuf::from(format!("/proc/{}/root{path}", self.pid))
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        let _ = self.holder.kill();
        let _ = self.holder.wait();
    }
}

impl Cluster {
    /// Hosts of these names, with addresses from 10.77.0.1 on, and clocks that differ.
    pub fn start(names: &[&str]) -> Result<Self, Lacking> {
        // SAFETY: it asks for a number.
        if unsafe { libc::geteuid() } != 0 {
            return Err(Lacking("must be root".to_owned()));
        }
        let mut hosts = Vec::new();
        let mut interfaces = Vec::new();
        for (index, name) in names.iter().enumerate() {
            let host = Host::start(name, 1000 * index as u32, None)?;
            let number = NUMBER.fetch_add(1, Ordering::Relaxed);
            let own = format!("mk{}x{number}", std::process::id());
            interfaces.push(interface(&own).map_err(|error| Lacking(format!("/dev/net/tun: {error}")))?);
            attach(&host, &own, index)?;
            hosts.push(host);
        }
        Ok(Self { hosts, wire: Wire::between(interfaces) })
    }

    /// Another machine in the place of a host, at its cable: nothing that was there is there.
    pub fn replace(&mut self, name: &str) {
        let index = self.index_of(name);
        let other = Host::start(name, 5000, Some(&self.hosts[index])).expect("the first one could be had");
        self.hosts[index] = other;
    }

    /// The index of the host of this name.
    pub fn index_of(&self, name: &str) -> usize {
        self.hosts.iter().position(|host| host.name == name).expect("there is such a host")
    }
}

fn attach(host: &Host, interface: &str, index: usize) -> Result<(), Lacking> {
    let [a, b, c] = NETWORK;
    let address = format!("{a}.{b}.{c}.{}/24", index + 1);
    let ip = |arguments: &[&str]| {
        let done =
            Command::new("ip").args(arguments).output().map_err(|error| Lacking(format!("ip: {error}")))?;
        match done.status.success() {
            true => Ok(()),
            false => Err(Lacking(String::from_utf8_lossy(&done.stderr).trim().to_owned())),
        }
    };
    ip(&["link", "set", interface, "netns", &host.pid.to_string()])?;
    let script = format!("ip address add {address} dev {interface} && ip link set {interface} up");
    let done = host.command(Path::new("sh")).args(["-c", &script]).output().expect("nsenter is there");
    match done.status.success() {
        true => Ok(()),
        false => Err(Lacking(String::from_utf8_lossy(&done.stderr).trim().to_owned())),
    }
}
