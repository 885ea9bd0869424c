//! Where the simulator's messages go.

use mujoco_rs::prelude::{MjLogMessage, MjtLogLevel, set_log_handler};
use std::sync::Once;

static INSTALLED: Once = Once::new();

/// The exit status of a process that its system has failed, as the `mikoshi` command documents it.
const SYSTEM_FAULT: i32 = 3;

/// Sends the simulator's messages to `tracing`, instead of to MUJOCO_LOG.TXT in whatever directory the
/// process runs in.
pub fn install() {
    INSTALLED.call_once(|| {
        // SAFETY: every use of the simulator in this crate comes after this call, which runs once and
        // which others wait for.
        unsafe { set_log_handler(forward) };
    });
}

fn forward(message: &MjLogMessage) {
    match message.level() {
        MjtLogLevel::mjLOG_ERROR => {
            // MuJoCo ends the process whatever is done here, but with the status of a run that failed.
            eprintln!("error: MuJoCo: {}", message.subject());
            std::process::exit(SYSTEM_FAULT);
        }
        MjtLogLevel::mjLOG_WARNING => tracing::warn!("MuJoCo: {}", message.subject()),
        _ => tracing::debug!("MuJoCo: {}", message.subject()),
    }
}
