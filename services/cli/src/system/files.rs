//! What an installation consists of, beside programs.

use clap_complete::Shell;
use core::fmt::Write as _;

/// Below the prefix: units, where systemd looks for them.
pub const UNITS: &str = "lib/systemd/system";
/// Below the prefix: what the simulator needs, and where programs look for it.
pub const LIBRARIES: &str = "lib/mikoshi";
/// What its user configures.
pub const CONFIGURATION: &str = "/etc/mikoshi";
/// What the services carry out.
pub const SCENARIO: &str = "/etc/mikoshi/scenarios/service.toml";
/// A program in place of the simulated world, where there is one.
pub const HARDWARE_BRIDGE: &str = "/etc/mikoshi/hardware-bridge";
/// What runs have left.
pub const STATE: &str = "/var/lib/mikoshi";
/// The user of all services.
pub const USER: &str = "mikoshi";
/// By which all units are started and stopped.
pub const TARGET: &str = "mikoshi.target";

/// A file that is written as it stands, but for the prefix.
pub struct TextFile {
    /// Below the prefix, or below [`CONFIGURATION`].
    pub path: &'static str,
    text: &'static str,
    /// Whether it is a program.
    pub is_executable: bool,
}

impl TextFile {
    /// What it says where programs are below this prefix.
    pub fn text(&self, prefix: &str) -> String {
        self.text.replace("@PREFIX@", prefix)
    }
}

macro_rules! files {
    ($($path:literal = $source:literal),* $(,)?) => {
        [$(TextFile {
            path: $path,
            text: include_str!(concat!("../../../../", $source)),
            is_executable: false,
        }),*]
    };
}

/// Below the prefix.
pub static SYSTEM: [TextFile; 17] = files![
    "lib/systemd/system/mikoshi.target" = "config/systemd/mikoshi.target",
    "lib/systemd/system/mikoshi-.service.d/50-mikoshi.conf" =
        "config/systemd/mikoshi-.service.d/50-mikoshi.conf",
    "lib/systemd/system/mikoshi-run.service" = "config/systemd/mikoshi-run.service",
    "lib/systemd/system/mikoshi-recorder.service" = "config/systemd/mikoshi-recorder.service",
    "lib/systemd/system/mikoshi-bridge.service" = "config/systemd/mikoshi-bridge.service",
    "lib/systemd/system/mikoshi-hardware-bridge@.service" = "config/systemd/mikoshi-hardware-bridge@.service",
    "lib/systemd/system/mikoshi-hardware-bridge@.service.d/60-devices.conf" =
        "config/systemd/mikoshi-hardware-bridge@.service.d/60-devices.conf",
    "lib/systemd/system/mikoshi-coordinator.service" = "config/systemd/mikoshi-coordinator.service",
    "lib/systemd/system/mikoshi-coordinator-standby.service" =
        "config/systemd/mikoshi-coordinator-standby.service",
    "lib/systemd/system/mikoshi-servo@.service" = "config/systemd/mikoshi-servo@.service",
    "lib/systemd/system/mikoshi-servo-standby@.service" = "config/systemd/mikoshi-servo-standby@.service",
    "lib/systemd/system/mikoshi-link.service" = "config/systemd/mikoshi-link.service",
    "lib/systemd/system/mikoshi-link.service.d/60-network.conf" =
        "config/systemd/mikoshi-link.service.d/60-network.conf",
    "lib/systemd/system/mikoshi-team.service" = "config/systemd/mikoshi-team.service",
    "lib/sysusers.d/mikoshi.conf" = "config/systemd/sysusers.conf",
    "lib/tmpfiles.d/mikoshi.conf" = "config/systemd/tmpfiles.conf",
    "share/doc/mikoshi/NOTICE" = "config/systemd/NOTICE",
];

/// Below the prefix: which services there are to be is told to systemd by the command itself.
pub static GENERATOR: TextFile = TextFile {
    path: "lib/systemd/system-generators/mikoshi-generator",
    text: include_str!("../../../../config/systemd/mikoshi-generator"),
    is_executable: true,
};

/// Below [`CONFIGURATION`].
pub static CONFIGURED: [TextFile; 8] = files![
    "scenarios/service.toml" = "config/scenarios/service.toml",
    "scenarios/transport.toml" = "config/scenarios/transport.toml",
    "scenarios/hold.toml" = "config/scenarios/hold.toml",
    "teams/two.toml" = "config/teams/two.toml",
    "teams/three.toml" = "config/teams/three.toml",
    "teams/four.toml" = "config/teams/four.toml",
    "robots/hrp2.toml" = "config/robots/hrp2.toml",
    "robots/hrp2.urdf" = "config/robots/hrp2.urdf",
];

/// Below the prefix: what shells need to complete words.
pub static COMPLETIONS: [(Shell, &str); 3] = [
    (Shell::Bash, "share/bash-completion/completions/mikoshi"),
    (Shell::Fish, "share/fish/vendor_completions.d/mikoshi.fish"),
    (Shell::Zsh, "share/zsh/vendor-completions/_mikoshi"),
];
/// Below the prefix: the manual pages of all commands.
pub const MANUAL: &str = "share/man/man1";

/// What to do next, for people.
pub fn next_steps(prefix: &str) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "installed below {prefix}; the team and what it does: {SCENARIO}");
    let _ = writeln!(text, "  systemctl enable --now {TARGET}    starts it, now and at every boot");
    let _ = writeln!(text, "  systemctl stop {TARGET}            stops the team, then its services");
    text
}
