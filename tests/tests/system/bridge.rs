//! Another program in the place of the simulator.

use mikoshi_ipc_types::ServiceId;
use mikoshi_tests::programs::folder;
use mikoshi_tests::run::{Results, Running, run};
use mikoshi_tests::scenarios::of_project;
use rustix::process::Signal;
use serde_json::json;

#[test]
fn a_team_holds_through_another_bridge_and_through_the_loss_of_it() {
    let bridge = folder().join("mikoshi-loopback-bridge").display().to_string();
    let arguments = [
        &["--set", "team=two", "--set", "duration_s=60", "--set", "hybrid.start_s=1"][..],
        &["--set", "thresholds.internal_start_min_n=", "--bridge", &bridge],
    ]
    .concat();
    let calm = Results::new();
    let said = run(&of_project("hold"), &arguments, &calm);
    assert_eq!((said.status, calm.summary()["faults"].clone()), (Some(0), json!([])), "{said:#?}");
    let rough = Results::new();
    let running = Running::start(&of_project("hold"), &arguments, &rough);
    running.signal_service(ServiceId::Bridge, Signal::KILL);
    let said = running.wait();
    assert_eq!(said.status, Some(0), "{said:#?}");
    let (calm, rough) = (calm.summary(), rough.summary());
    assert_eq!(rough["swaps"][0]["service"], "bridge");
    assert_eq!(rough["log_hash"], calm["log_hash"], "its successor goes on from there, to the last bit");
}
