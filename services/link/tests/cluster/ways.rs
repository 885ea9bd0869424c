//! What Zenoh's carriers make of ways that lose packets. A measurement: it is asked for by name.
//!
//! cargo test --release --manifest-path services/link/Cargo.toml --test cluster -- --ignored --nocapture carriers

use crate::hosts::Cluster;
use crate::or_skip;
use crate::team::{HEAD, Plan, STAGE, program};
use crate::wire::Way;
use std::process::Stdio;

#[test]
#[ignore = "a measurement of a minute"]
fn carriers_on_bad_ways() {
    let plan = Plan::of("hold.toml", &["A", "B"], &[], true);
    let cluster = or_skip!(Cluster::start(&[STAGE, HEAD]));
    let link = program("mikoshi-link");
    let certificates = plan.certificates();
    let certificates = certificates.to_str().expect("it is text");
    println!("one way [ms]  over         sent      lost   p50 [ms]   p99 [ms]  p99.9 [ms]  max [ms]  ticks");
    for delay_ms in [0.2, 2.0, 10.0] {
        cluster.wire.set(0, 1..2, |way| *way = Way::bad(delay_ms));
        for (over, is_reliable, repeats) in [
            ("tls", true, 0),
            ("quic-stream", true, 0),
            ("quic", false, 0),
            ("quic", false, 1),
            ("quic", false, 2),
        ] {
            let common = |host: &'static str| {
                let mut common = vec!["--certificates", certificates, "--host", host, "--over", over];
                common.extend(is_reliable.then_some("--reliable"));
                common
            };
            let mut answering = cluster.hosts[0].command(&link);
            answering.args(["measure", "answer"]).args(common(STAGE)).args(["--listen", "10.77.0.1:7447"]);
            let mut answering = answering.stderr(Stdio::null()).spawn().expect("it can be started");
            let repeats = repeats.to_string();
            let mut ask = vec!["measure", "ask"];
            ask.extend(common(HEAD));
            ask.extend(["--connect", "10.77.0.1:7447", "--count", "800", "--repeats", &repeats]);
            let asked = cluster.hosts[1].run(&link, &ask);
            let _ = answering.kill();
            let _ = answering.wait();
            let found: serde_json::Value = serde_json::from_slice(&asked.stdout).expect("it is JSON");
            let ms = |key: &str| 1e3 * found["round_trip"][key].as_f64().expect("a number");
            println!(
                "{delay_ms:12.1}  {over:11} {:2}  {:6} {:6} {:10.3} {:10.3} {:11.3} {:9.3} {:6}",
                repeats,
                found["sent"],
                found["lost"],
                ms("p50_s"),
                ms("p99_s"),
                ms("p999_s"),
                ms("max_s"),
                found["fitting_delay_ticks"]
            );
        }
    }
}
