//! What others may try, with and without a certificate: it is refused and counted, and the walk goes on.

use crate::or_skip;
use crate::team::{HEAD, Plan, RUN, STAGE, Team, robot_host};
use crate::walk::{stopped_by, tell, walk};
use crate::wire::Way;
use mikoshi_runtime::{now_ns, sleep_until};
use serde_json::Value;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};

fn hostile() -> PathBuf {
    crate::team::program("examples/hostile")
}

/// Where the attacker's own certificates are.
struct Attack<'t> {
    team: &'t Team<'t>,
    certificates: PathBuf,
    incarnation: u64,
}

impl Attack<'_> {
    /// From the host of robot B at the coordinator's, under this key, as a child that still goes on.
    fn start(&self, key: &str, kind: &str, more: &[&str]) -> Child {
        let host = robot_host("B");
        let mut command: Command = self.team.host(&host).command(&hostile());
        command.arg("--certificates").arg(&self.certificates).args([
            "--host",
            &host,
            "--connect",
            "10.77.0.2:7447",
        ]);
        command.args(["--key", key, "--run", RUN, "--robot", "1", "--kind", kind]);
        command.args(["--incarnation", &self.incarnation.to_string()]).args(more);
        command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it can be started")
    }

    fn run(&self, key: &str, kind: &str, more: &[&str]) -> Value {
        let output = self.start(key, kind, more).wait_with_output().expect("it was started");
        serde_json::from_slice(&output.stdout).expect("it says what it did")
    }
}

/// How often the coordinator's host has refused what came as robot B's state, by this reason.
fn refused(team: &Team<'_>, reason: &str) -> u64 {
    let report = team.report(HEAD);
    let topics = report["topics"].as_array().expect("a list").clone();
    let topic = topics.iter().find(|topic| topic["topic"] == "robot-state[1]").expect("it comes here");
    topic["frames"][reason].as_u64().unwrap_or(0)
}

/// Certificates of the same names by another authority, or by ours.
fn other_certificates(plan: &Plan, folder: &str, more: &[&str]) -> PathBuf {
    let other = plan.folder().join(folder);
    let mut certify = Command::new(crate::team::program("mikoshi-link"));
    certify.arg("certify").arg(plan.scenario()).arg("--out").arg(&other).args(more);
    assert!(certify.status().expect("it can be started").success());
    other
}

/// Certificates by the team's authority that are good for no day.
fn expired_certificates(plan: &Plan) -> PathBuf {
    let other = plan.folder().join("expired");
    std::fs::create_dir(&other).expect("a folder");
    for name in ["ca.pem", "ca-key.pem"] {
        std::fs::copy(plan.certificates().join(name), other.join(name)).expect("it can be copied");
    }
    other_certificates(plan, "expired", &["--days", "0"])
}

const OWN: &str = "mikoshi/service/servo/B/robot-state/head";
/// Robot A's alone is never sent: who may not say it is not told that somebody listens. One key for all is.
const OTHERS: &str = "mikoshi/service/servo/*/robot-state/head";

#[test]
fn what_others_try_is_refused_and_counted_and_the_team_walks_on() {
    stopped_by(&[], is_attacked);
}

fn is_attacked() -> Value {
    let plan = walk(2, 0.06, &["duration_s=40", "motion.random.duration_s=30"]);
    let mut team = or_skip!(Team::gather(&plan), Value::Null);
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(0.2));
    team.start();
    team.wait_for_tick(600);
    {
        let incarnation = team.report(&robot_host("B"))["incarnation"].as_u64().expect("a number");
        let with = |certificates: PathBuf| Attack { team: &team, certificates, incarnation };
        let ours = with(plan.certificates());

        let nobody = ours.run(OWN, "replay", &["--without"]);
        assert_eq!(nobody["connected"], false, "without a certificate");
        let foreign = with(other_certificates(&plan, "foreign", &[])).run(OWN, "replay", &[]);
        assert_eq!(foreign["connected"], false, "by another authority");
        let expired = with(expired_certificates(&plan)).run(OWN, "replay", &[]);
        assert_eq!(expired["connected"], false, "expired");

        for (kind, reason) in
            [("replay", "stale"), ("schema", "schema"), ("future", "future"), ("noise", "malformed")]
        {
            let before = refused(&team, reason);
            let said = ours.run(OWN, kind, &[]);
            let sent = said["sent"].as_u64().expect("a number");
            // Links report once a second.
            let counted = || refused(&team, reason) - before;
            team.wait_until(1000, || counted() > sent / 2);
            let counted = counted();
            eprintln!("{kind}: {sent} sent, {counted} refused as {reason}");
            assert!(said["connected"] == true && counted > sent / 2, "{kind}: {said}, {counted} refused");
        }
        let stolen = ours.run(OTHERS, "replay", &["--robot", "0"]);
        let by_access_control =
            || team.report(HEAD)["refused_by_access_control"].as_u64().expect("it is counted");
        team.wait_until(1000, || by_access_control() > 100);
        let by_access_control = by_access_control();
        eprintln!("another robot's key: {stolen}, {by_access_control} refused by access control");
        assert!(stolen["connected"] == true && by_access_control > 100);
    }
    for host in [STAGE, HEAD] {
        tell(&team, host);
    }
    team.finish()
}

/// The 99th percentile of a tick over so many seconds, as the world's host sees it.
fn tick_p99_s(team: &Team<'_>, seconds: f64) -> f64 {
    let board = mikoshi_runtime::Board::open(&team.host(STAGE).file(RUN)).expect("it is there");
    let tick = || board.last_position(mikoshi_ipc_types::ServiceId::Bridge).unwrap_or_default().tick;
    let (begin_ns, mut last, mut ticks) = (now_ns(), (tick(), now_ns()), vec![]);
    while (now_ns() - begin_ns) as f64 / 1e9 < seconds {
        sleep_until(now_ns() + 50_000);
        let now = (tick(), now_ns());
        if now.0 != last.0 {
            let count = (now.0 - last.0) as f64;
            ticks.push((now.1 - last.1) as f64 / 1e9 / count);
            last = now;
        }
    }
    ticks.sort_by(f64::total_cmp);
    ticks[ticks.len() * 99 / 100]
}

#[test]
#[ignore = "a measurement of a minute"]
fn a_flood_by_a_host_of_the_team() {
    const PAIRS: usize = 5;
    let plan = walk(2, 0.06, &["duration_s=32", "motion.random.duration_s=27"]);
    let mut team = or_skip!(Team::gather(&plan));
    let head = team.cluster.index_of(HEAD);
    team.cluster.wire.set(head, 0..4, |way| *way = Way::bad(0.2));
    team.start();
    team.wait_for_tick(600);
    let incarnation = team.report(&robot_host("B"))["incarnation"].as_u64().expect("a number");
    let attack = Attack { team: &team, certificates: plan.certificates(), incarnation };
    let mut ratios = vec![];
    for _ in 0..PAIRS {
        let without = tick_p99_s(&team, 3.0);
        let before = refused(&team, "stale");
        let flood = attack.start(OWN, "replay", &["--rate", "100000", "--seconds", "4"]);
        sleep_until(now_ns() + 500_000_000);
        let with = tick_p99_s(&team, 3.0);
        let said = flood.wait_with_output().expect("it was started").stdout;
        sleep_until(now_ns() + 1_200_000_000);
        ratios.push(with / without);
        println!(
            "tick p99 {:.3} ms without, {:.3} ms with: {:.3}; {} {} refused",
            1e3 * without,
            1e3 * with,
            with / without,
            String::from_utf8_lossy(&said).trim(),
            refused(&team, "stale") - before
        );
    }
    ratios.sort_by(f64::total_cmp);
    println!("median of {PAIRS} pairs: {:.3}", ratios[PAIRS / 2]);
    for host in [STAGE, HEAD, &robot_host("A")] {
        tell(&team, host);
    }
    let summary = team.finish();
    println!("{}\n{}", summary["faults"], summary["timing"]);
    assert_eq!(summary["fell"], Value::Array(vec![]));
}
