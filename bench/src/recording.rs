//! A team that walks, as it was recorded: what its services are told in a benchmark.

use mikoshi_config::RunSpec;
use mikoshi_observation::{LogReader, Observation};
use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, say};
use mikoshi_tests::scenarios::of_project;
use std::ops::Range;
use std::path::Path;

/// `transport` at its pace, without its long way.
const OVERRIDES: [&str; 6] = [
    "duration_s=8.0",
    "motion.start_s=1.5",
    "motion.random.duration_s=6",
    "motion.random.travel_m=[0.22, 0.06, 0.004]",
    "motion.random.travel_rad=[0.004, 0.004, 0.11]",
    "thresholds={}",
];

/// Ticks in which all robots walk: from the first swing on, several steps of each.
pub const WALKING: Range<u64> = 800..1400;

/// A run and all of its frames.
pub struct Recording {
    /// The run.
    pub run: RunSpec,
    /// Its ticks, from the first one on.
    pub ticks: Vec<Observation>,
    /// Size of the file that it was read from.
    pub file_bytes: u64,
}

impl Recording {
    /// Lets four robots walk, in one thread, as `mikoshi run --in-process` does, and reads the log that they leave.
    pub fn of_walking() -> Self {
        let results = Results::new();
        walk(&results, &[]);
        Self::read(&results.log())
    }

    /// Reads a log.
    pub fn read(path: &Path) -> Self {
        let mut log = LogReader::open(path).expect("a log of this build");
        let run = log.run().clone();
        let mut ticks = vec![];
        loop {
            let mut tick = Observation::for_team(run.robots.len());
            if !log.read_tick(&mut tick).expect("it is whole") {
                break;
            }
            ticks.push(tick);
        }
        let file_bytes = path.metadata().expect("it was read").len();
        Self { run, ticks, file_bytes }
    }

    /// What is recorded of [`WALKING`].
    pub fn walking(&self) -> impl Iterator<Item = &Observation> {
        self.ticks.iter().filter(|tick| WALKING.contains(&tick.tick()))
    }
}

/// Leaves the log of a walk, with these variables in the environment.
pub fn walk(results: &Results, environment: &[(&str, &str)]) {
    let mut command = mikoshi();
    command.envs(environment.iter().copied());
    command
        .args(["run", "--quiet", "--in-process", "--out"])
        .arg(results.path())
        .arg(of_project("transport"));
    for value in OVERRIDES {
        command.args(["--set", value]);
    }
    let said = say(&mut command);
    assert_eq!(said.status, Some(0), "{said:#?}");
}
