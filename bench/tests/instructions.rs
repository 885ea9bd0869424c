//! Hot paths execute no more instructions than was accepted in `instructions.toml`.
//!
//! Instructions don't depend on how busy a machine is, and hardly on which one it is: functions of the C library that
//! it has for several kinds of processors are those for all of them here. Valgrind counts them; without it this test
//! says so, and judges nothing.

use mikoshi_bench::recording::walk;
use mikoshi_tests::run::Results;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::io::{self, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::{env, fs};

/// Set to anything, what is counted now is accepted.
const ACCEPT: &str = "MIKOSHI_ACCEPT_INSTRUCTIONS";

/// Makes the C library take the functions that it has for all x86-64 processors, in both spellings of its versions.
const OF_ANY_PROCESSOR: (&str, &str) = (
    "GLIBC_TUNABLES",
    "glibc.cpu.hwcaps=-AVX2,-AVX2_Usable,-FMA,-FMA_Usable,-FMA4,-FMA4_Usable,-SSSE3,-ERMS,-FSRM,\
     -AVX_Fast_Unaligned_Load,-Fast_Unaligned_Copy",
);

#[derive(Deserialize, Serialize)]
struct Accepted {
    /// By which they were compiled: another one makes other instructions of the same text.
    compiler: String,
    /// Share by which a count may grow.
    tolerance: f64,
    /// Instructions of one call.
    instructions: BTreeMap<String, u64>,
}

/// Of one path.
struct Count {
    path: String,
    accepted: u64,
    now: u64,
}

#[test]
fn hot_paths_execute_no_more_instructions_than_was_accepted() {
    if let Some(reason) = why_not() {
        return say(&format!("skipped: instructions are not counted: {reason}"));
    }
    let accepted: Accepted =
        toml::from_str(&fs::read_to_string(file()).expect("it is there")).expect("it is valid");
    let results = Results::new();
    walk(&results, &[OF_ANY_PROCESSOR]);
    let counts: Vec<_> = accepted
        .instructions
        .iter()
        .map(|(path, &accepted)| Count { path: path.clone(), accepted, now: count(path, &results.log()) })
        .collect();
    say(&table(&counts));
    if env::var_os(ACCEPT).is_some() {
        return accept(&counts, accepted.tolerance);
    }
    let grown = grown(&counts, accepted.tolerance);
    assert!(grown.is_empty(), "{}", complaint(&grown, &accepted));
}

#[test]
fn growth_beyond_the_tolerance_is_told_with_its_size() {
    let count = |path: &str, now| Count { path: path.to_owned(), accepted: 1000, now };
    let counts = [count("servo-tick", 1049), count("kinematics", 1051), count("coordinator-tick", 700)];
    let grown = grown(&counts, 0.05);
    let accepted =
        Accepted { compiler: "rustc 1.0".to_owned(), tolerance: 0.05, instructions: BTreeMap::new() };
    let told = complaint(&grown, &accepted);
    assert!(told.contains("kinematics executes 1051 instructions a call, 5.1 % more than"), "{told}");
    assert!(told.contains(ACCEPT) && !told.contains("servo-tick") && !told.contains("coordinator"), "{told}");
}

/// Why nothing can be counted here.
fn why_not() -> Option<String> {
    if cfg!(debug_assertions) {
        return Some("this is no release build".to_owned());
    }
    if cfg!(not(target_arch = "x86_64")) {
        return Some("accepted are those of x86-64 processors".to_owned());
    }
    let mut valgrind = Command::new("valgrind");
    let found = valgrind.arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status();
    let is_there = found.is_ok_and(|status| status.success());
    (!is_there).then(|| "valgrind is not installed (on Debian and Ubuntu: apt install valgrind)".to_owned())
}

/// Instructions of one call.
fn count(path: &str, log: &Path) -> u64 {
    let output = Command::new("valgrind")
        .args(["--tool=callgrind", "--toggle-collect=*mikoshi_hot_path*counted*"])
        .arg("--callgrind-out-file=/dev/null")
        .args([env!("CARGO_BIN_EXE_mikoshi-hot-path"), path])
        .arg(log)
        .env(OF_ANY_PROCESSOR.0, OF_ANY_PROCESSOR.1)
        .output()
        .expect("it can be started");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{path}: {said}");
    let calls = String::from_utf8_lossy(&output.stdout).trim().parse::<u64>().expect("a number of calls");
    let collected = said.lines().find_map(|line| line.split_once("Collected :")).expect("what it counted");
    let collected = collected.1.trim().parse::<u64>().expect("a number of instructions");
    assert!(collected > calls, "{path}: nothing was counted");
    collected / calls
}

/// Those that grew too much.
fn grown(counts: &[Count], tolerance: f64) -> Vec<&Count> {
    counts.iter().filter(|count| count.now as f64 > count.accepted as f64 * (1.0 + tolerance)).collect()
}

fn complaint(grown: &[&Count], accepted: &Accepted) -> String {
    let mut text = String::new();
    for count in grown {
        text += &format!(
            "{} executes {} instructions a call, {:.1} % more than the {} that were accepted; {:.0} % are allowed\n",
            count.path,
            count.now,
            count.growth_percent(),
            count.accepted,
            1e2 * accepted.tolerance
        );
    }
    text += &format!("accepted were those by {}; this is {}\n", accepted.compiler, compiler());
    text += "where they come from: valgrind --tool=callgrind --toggle-collect='*mikoshi_hot_path*counted*' \
             target/release/mikoshi-hot-path PATH run.mcap, and callgrind_annotate\n";
    text += &format!(
        "if they are worth it: {ACCEPT}=1 cargo test --release --workspace --test instructions, and commit the file"
    );
    text
}

fn table(counts: &[Count]) -> String {
    let mut text = "instructions a call:".to_owned();
    for count in counts {
        text += &format!(
            "\n  {:<20} {:>8}, accepted {:>8} ({:+.1} %)",
            count.path,
            count.now,
            count.accepted,
            count.growth_percent()
        );
    }
    text
}

fn accept(counts: &[Count], tolerance: f64) {
    let instructions = counts.iter().map(|count| (count.path.clone(), count.now)).collect();
    let accepted = Accepted { compiler: compiler(), tolerance, instructions };
    let text = toml::to_string(&accepted).expect("names and numbers");
    let header = "# Instructions of one call of each hot path, on any x86-64 processor. `tests/instructions.rs` \
                  compares them, and\n# writes them anew with MIKOSHI_ACCEPT_INSTRUCTIONS=1.\n";
    fs::write(file(), format!("{header}{text}")).expect("it can be written");
    say(&format!("accepted: {}", file().display()));
}

impl Count {
    fn growth_percent(&self) -> f64 {
        1e2 * (self.now as f64 / self.accepted as f64 - 1.0)
    }
}

fn compiler() -> String {
    let rustc = env::var_os("RUSTC").unwrap_or_else(|| "rustc".into());
    let said = Command::new(rustc).arg("--version").output();
    said.map_or("a compiler that is not here".to_owned(), |output| {
        String::from_utf8_lossy(&output.stdout).trim().to_owned()
    })
}

fn file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("instructions.toml")
}

/// Also where tests are quiet: nobody is to take what was skipped for what has passed.
fn say(text: &str) {
    let _ = writeln!(io::stderr(), "{text}");
}
