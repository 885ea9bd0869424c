//! A team on several hosts: its scenario, its certificates, its processes.

use crate::hosts::{Cluster, Host, Lacking};
use mikoshi_ipc_types::ServiceId;
use mikoshi_runtime::{Role, State};
use serde_json::Value;
use std::env;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use tempfile::TempDir;

/// Where a run is on each host.
pub const RUN: &str = "/dev/shm/mikoshi-0/team";
/// The host of the simulated world; it records, too.
pub const STAGE: &str = "stage";
/// The host of the coordinator.
pub const HEAD: &str = "head";

/// Where programs are: beside the test's folder.
pub fn program(name: &str) -> PathBuf {
    let test = env::current_exe().expect("a test knows where it is");
    test.parent().and_then(Path::parent).expect("tests lie two folders deep").join(name)
}

fn workspace() -> &'static Path {
    Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
}

/// A scenario with hosts, and what belongs to it.
pub struct Plan {
    folder: TempDir,
    /// The robots' names, in order; each has a host of its own.
    pub robots: Vec<String>,
    overrides: Vec<String>,
    is_lockstep: bool,
    /// Of whom which host stands by for whom.
    standbys: Vec<(String, String)>,
}

impl Plan {
    /// This scenario of the project's, by a team of this many robots on as many hosts and two more.
    pub fn of(scenario: &str, robots: &[&str], overrides: &[&str], is_lockstep: bool) -> Self {
        Self::with_standbys(scenario, robots, overrides, is_lockstep, &[])
    }

    /// The same, with hosts that stand by for services of others.
    pub fn with_standbys(
        scenario: &str,
        robots: &[&str],
        overrides: &[&str],
        is_lockstep: bool,
        standbys: &[(&str, &str)],
    ) -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let config = workspace().join("config").canonicalize().expect("it is there");
        for name in ["teams", "robots"] {
            symlink(config.join(name), folder.path().join(name)).expect("a link");
        }
        fs::create_dir(folder.path().join("scenarios")).expect("a folder");
        let mut text = fs::read_to_string(config.join("scenarios").join(scenario)).expect("it is there");
        let team = ["", "", "two", "three", "four"][robots.len()];
        let of_team =
            text.lines().find(|line| line.starts_with("team = ")).expect("it has a team").to_owned();
        text = text.replacen(&of_team, &format!("team = \"{team}\""), 1);
        let mut host = |name: &str, service: &str, number: usize| {
            let of_host: Vec<_> =
                standbys.iter().filter(|(host, _)| *host == name).map(|(_, service)| service).collect();
            text += &format!(
                "\n[[hosts]]\nname = \"{name}\"\nservices = [\"{service}\"]\nlisten = \"10.77.0.{number}:7447\"\n\
                 standbys = {of_host:?}\n"
            );
        };
        host(STAGE, "bridge", 1);
        host(HEAD, "coordinator", 2);
        for (index, robot) in robots.iter().enumerate() {
            host(&robot_host(robot), robot, index + 3);
        }
        let plan = Self {
            folder,
            robots: robots.iter().map(|robot| (*robot).to_owned()).collect(),
            overrides: overrides.iter().map(|set| (*set).to_owned()).collect(),
            is_lockstep,
            standbys: standbys.iter().map(|(host, of)| ((*host).to_owned(), (*of).to_owned())).collect(),
        };
        fs::write(plan.scenario(), text).expect("it is writable");
        plan.certify(&[]);
        plan
    }

    /// The scenario's file.
    pub fn scenario(&self) -> PathBuf {
        self.folder.path().join("scenarios/cluster.toml")
    }

    /// Where certificates are.
    pub fn certificates(&self) -> PathBuf {
        self.folder.path().join("certificates")
    }

    /// What was measured, and results.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Makes certificates.
    pub fn certify(&self, arguments: &[&str]) {
        let done = Command::new(program("mikoshi-link"))
            .arg("certify")
            .arg(self.scenario())
            .arg("--out")
            .arg(self.certificates())
            .args(arguments)
            .status();
        assert!(done.expect("it can be started").success());
    }

    /// The names of all hosts.
    pub fn hosts(&self) -> Vec<String> {
        let robots = self.robots.iter().map(|robot| robot_host(robot));
        [STAGE.to_owned(), HEAD.to_owned()].into_iter().chain(robots).collect()
    }

    fn settings(&self) -> Vec<&str> {
        self.overrides.iter().flat_map(|set| ["--set", set]).collect()
    }
}

/// Gives way to those who are tested.
fn pause() {
    mikoshi_runtime::sleep_until(mikoshi_runtime::now_ns() + 20_000_000);
}

/// The name of a robot's host.
pub fn robot_host(robot: &str) -> String {
    format!("robot-{}", robot.to_lowercase())
}

/// A team whose processes run.
pub struct Team<'p> {
    plan: &'p Plan,
    /// Where they run.
    pub cluster: Cluster,
    /// Who, on which host, under which name.
    processes: Vec<(String, &'static str, Child)>,
    recorder: Option<Child>,
}

impl<'p> Team<'p> {
    /// Starts hosts alone.
    pub fn gather(plan: &'p Plan) -> Result<Self, Lacking> {
        let names = plan.hosts();
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        Ok(Self { plan, cluster: Cluster::start(&names)?, processes: vec![], recorder: None })
    }

    /// Starts everybody on every host.
    pub fn start(&mut self) {
        for host in self.plan.hosts() {
            self.prepare(&host);
        }
        let stage = self.host(STAGE);
        let mut recorder = stage.command(&program("mikoshi"));
        recorder.args(["adopt", "--json", "--out"]).arg(self.plan.folder().join("results"));
        self.recorder = Some(self.spawn(recorder, "recorder"));
        // It is there before the first tick.
        while !self.is_recorded() {
            self.check();
            pause();
        }
        for host in self.plan.hosts() {
            self.start_services(&host);
        }
    }

    fn is_recorded(&self) -> bool {
        let board = mikoshi_runtime::Board::open(&self.host(STAGE).file(RUN));
        board.is_ok_and(|board| {
            board.states().any(|(role, state)| {
                role == mikoshi_runtime::Role::Tap && state >= mikoshi_runtime::State::Starting
            })
        })
    }

    /// Makes the run on a host.
    pub fn prepare(&self, host: &str) {
        let mut arguments = vec!["service", "prepare", "--host", host];
        let scenario = self.plan.scenario();
        arguments.extend(self.plan.is_lockstep.then_some("--lockstep"));
        arguments.extend(self.plan.settings());
        arguments.push(scenario.to_str().expect("it is text"));
        self.host(host).run(&program("mikoshi"), &arguments);
    }

    /// Starts the link and the services of a host.
    pub fn start_services(&mut self, host: &str) {
        self.start_link(host);
        self.start_service(host);
        let stands_by = |(on, of): &(String, String)| on == host && of == "coordinator";
        if self.plan.standbys.iter().any(stands_by) {
            self.start_program(host, "mikoshi-coordinator", &[]);
        }
    }

    fn start_service(&mut self, host: &str) {
        let (name, arguments): (_, Vec<&str>) = match host {
            STAGE => ("mikoshi-bridge", vec![]),
            HEAD => ("mikoshi-coordinator", vec![]),
            robot => {
                let robot =
                    self.plan.robots.iter().find(|name| robot_host(name) == robot).expect("there is one");
                ("mikoshi-servo", vec!["--robot", robot.as_str()])
            }
        };
        self.start_program(host, name, &arguments);
    }

    fn start_program(&mut self, host: &str, name: &'static str, arguments: &[&str]) {
        let mut command = self.host(host).command(&program(name));
        command.args(["--run", RUN, "--enlist"]).args(arguments);
        let child = self.spawn(command, name);
        self.processes.push((host.to_owned(), name, child));
    }

    /// Puts another machine in the place of a host, and starts what runs there.
    pub fn replace(&mut self, host: &str) {
        for name in ["mikoshi-link", "mikoshi-servo", "mikoshi-coordinator"] {
            self.kill(host, name);
        }
        self.cluster.replace(host);
        self.prepare(host);
        self.start_services(host);
    }

    /// Sends this signal to all processes of a host.
    pub fn signal(&self, host: &str, signal: libc::c_int) {
        for (_, _, child) in self.processes.iter().filter(|(on, _, _)| on == host) {
            // SAFETY: it is a process of ours, which nobody has waited for.
            unsafe { libc::kill(child.id() as libc::pid_t, signal) };
        }
    }

    /// Waits for the end of what is called so on a host, and returns its status.
    pub fn wait_for_end(&mut self, host: &str, name: &str) -> Option<i32> {
        let of = |(on, what, _): &&mut (String, &str, Child)| on == host && *what == name;
        let (_, _, child) = self.processes.iter_mut().find(of).expect("it was started");
        child.wait().expect("it was started").code()
    }

    /// How far a service is, by the board of a host.
    pub fn state(&self, host: &str, service: ServiceId) -> (State, u64) {
        let board = mikoshi_runtime::Board::open(&self.host(host).file(RUN)).expect("it is there");
        let state = board.states().find(|(role, _)| *role == Role::Service(service));
        (
            state.map_or(State::Absent, |(_, state)| state),
            board.last_position(service).unwrap_or_default().tick,
        )
    }

    /// How often a service has moved, as a host knows.
    pub fn moves(&self, host: &str, service: ServiceId) -> u64 {
        mikoshi_runtime::Board::open(&self.host(host).file(RUN)).expect("it is there").moves_of(service)
    }

    /// What a host's link says of a service that has a standby.
    pub fn standby(&self, host: &str, service: &str) -> Value {
        let report = self.report(host);
        let standbys = report["standbys"].as_array().expect("a list").clone();
        standbys.into_iter().find(|standby| standby["service"] == service).unwrap_or(Value::Null)
    }

    /// Starts the link of a host.
    pub fn start_link(&mut self, host: &str) {
        let mut command = self.host(host).command(&program("mikoshi-link"));
        command.args(["carry", "--run", RUN, "--host", host, "--certificates"]).arg(self.plan.certificates());
        let child = self.spawn(command, "mikoshi-link");
        self.processes.push((host.to_owned(), "mikoshi-link", child));
    }

    fn spawn(&self, mut command: Command, what: &str) -> Child {
        let log = |kind: &str| {
            let path = self.plan.folder().join(format!("{what}.{kind}"));
            Stdio::from(fs::OpenOptions::new().create(true).append(true).open(path).expect("it is writable"))
        };
        command.stdout(log("out")).stderr(log("error")).spawn().expect("it can be started")
    }

    /// The host of this name.
    pub fn host(&self, name: &str) -> &Host {
        &self.cluster.hosts[self.cluster.index_of(name)]
    }

    /// The tick that a host's board has the world in.
    pub fn tick(&self, host: &str) -> u64 {
        let board = mikoshi_runtime::Board::open(&self.host(host).file(RUN)).expect("it is there");
        board.last_position(mikoshi_ipc_types::ServiceId::Bridge).unwrap_or_default().tick
    }

    /// Waits until the world is in this tick.
    pub fn wait_for_tick(&mut self, tick: u64) {
        while self.tick(STAGE) < tick {
            self.check();
            pause();
        }
    }

    /// Waits until something is so, or so many ticks have gone by.
    pub fn wait_until(&self, ticks: u64, is_so: impl Fn() -> bool) {
        let begin = self.tick(STAGE);
        while !is_so() && self.tick(STAGE) < begin + ticks {
            pause();
        }
    }

    fn check(&mut self) {
        let ended = self.recorder.as_mut().and_then(|recorder| recorder.try_wait().expect("it was started"));
        assert!(ended.is_none(), "the run has ended: {ended:?}\n{}", self.words());
    }

    /// What the link of a host counts.
    pub fn report(&self, host: &str) -> Value {
        let text = fs::read_to_string(self.host(host).file(&format!("{RUN}/link.json"))).expect("it reports");
        serde_json::from_str(&text).expect("a report is JSON")
    }

    /// Waits for the end of the run, and returns its summary.
    pub fn finish(&mut self) -> Value {
        let status = self.recorder.take().expect("it was started").wait().expect("it was started");
        let path = self.plan.folder().join("results/summary.json");
        let text =
            fs::read_to_string(&path).unwrap_or_else(|_| panic!("no summary: {status}\n{}", self.words()));
        let summary = serde_json::from_str(&text).expect("a summary is JSON");
        eprintln!("{}", self.words());
        summary
    }

    /// Kills what is called so on a host.
    pub fn kill(&mut self, host: &str, name: &str) {
        for (_, _, child) in self.processes.iter_mut().filter(|(on, what, _)| on == host && *what == name) {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.processes.retain(|(on, what, _)| on != host || *what != name);
    }

    /// What processes said on standard error.
    pub fn words(&self) -> String {
        let files = fs::read_dir(self.plan.folder()).expect("it is there").flatten();
        let errors =
            files.filter(|file| file.path().extension().is_some_and(|extension| extension == "error"));
        let words = errors.map(|file| {
            format!("{}:\n{}", file.path().display(), fs::read_to_string(file.path()).unwrap_or_default())
        });
        words.collect::<Vec<_>>().join("\n")
    }
}

impl Drop for Team<'_> {
    fn drop(&mut self) {
        for (_, _, child) in &mut self.processes {
            let _ = child.kill();
            let _ = child.wait();
        }
        if let Some(mut recorder) = self.recorder.take() {
            let _ = recorder.kill();
            let _ = recorder.wait();
        }
    }
}
