//! What can be typed.

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;
use mikoshi_recording::DEFAULT_VIEW_HZ;
use std::num::{NonZeroU32, NonZeroUsize};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples:
  mikoshi run config/scenarios/hold.toml
  mikoshi run config/scenarios/hold.toml --seed 3 --set team=two --set object.mass_kg=10
  mikoshi replay runs/hold-0/run.mcap
  mikoshi report runs/hold-0
  mikoshi sweep config/sweeps/robust.toml
  mikoshi plan config/scenarios/hold.toml
  mikoshi status
  mikoshi top
  mikoshi swap A
  mikoshi drive
  mikoshi doctor --clean";

const RUN_EXAMPLES: &str = "\
Examples:
  mikoshi run config/scenarios/hold.toml
  mikoshi run config/scenarios/hold.toml --in-process --seed 2 --out /tmp/hold
  mikoshi run config/scenarios/hold.toml --set duration_s=5 --set hybrid.start_s=1
  mikoshi run config/scenarios/hold.toml --set hybrid.start_s=     (hybrid control stays off)

Exit status:
  0  the run met its scenario's thresholds
  1  it did not: a robot fell, a figure out of bounds
  2  bad usage or configuration
  3  a fault of the system: a process died or froze, no shared memory, no simulator
  130, 143  interrupted, terminated";

const ADOPT_EXAMPLES: &str = "\
Examples:
  mikoshi adopt
  mikoshi adopt 4711-0 --out runs/after-the-crash

A run goes on if its supervisor is killed, but nobody records it, starts successors, or answers `mikoshi swap`.
Who adopts it does all that from the next tick on. The results are those of the ticks that were seen. It can be
stopped as any run: Ctrl-C ends its services in order.

Exit status:
  0  the rest of the run met its scenario's thresholds
  1  it did not
  2  there is no such run, or its supervisor lives
  3  a fault of the system
  130, 143  interrupted, terminated";

const RECORD_EXAMPLES: &str = "\
Examples:
  mikoshi record --out part.mcap
  mikoshi record 4711-0 --out part.mcap

Every run records itself, unless it was told --no-log; this is for another file, or for a part. In lockstep
nothing is lost: the run waits for the recorder, but not for one that is frozen. By the clock ticks that the
recorder is too slow for are lost, and counted. Ctrl-C ends the recording, not the run.

Exit status:
  0  recorded to the end of the run, or up to Ctrl-C
  1  the supervisor ended, or gave the recorder up: what was seen before is in the file
  2  there is no such run
  3  a fault of the system: the file can't be written";

const WATCH_EXAMPLES: &str = "\
Examples:
  mikoshi view --web                                   (the only run there is, as a page)
  mikoshi view runs/transport-0 --web
  mikoshi view runs/transport-0 --save walk.rrd
  mikoshi view                                         (in a window of `rerun`, which must be on the PATH)

Shows robots, object, support polygons, zero moment points, forces of hands and references in 3D, and beside them
internal forces, errors, margins and times, in Rerun. A run does not wait for those who look at it. Pages are served
on this machine only, and fetch nothing from elsewhere. `make view` builds it.

Exit status:
  0  shown to the end, or up to Ctrl-C
  2  there is no such run, or no window to show it in
  3  a fault of the system: it was not built, the port is taken, the file can't be written";

const REPLAY_EXAMPLES: &str = "\
Examples:
  mikoshi replay runs/hold-0/run.mcap
  mikoshi replay runs/hold-0/run.mcap --service A --service coordinator --until 400
  mikoshi replay runs/hold-0/run.mcap --service A --set balance.stabiliser=false     (what would it have said?)

Every service is executed on the inputs that were recorded, and what it says is compared with what it said,
payload by payload, to the last bit. Of what differs, the first field is told.

Exit status:
  0  all is the same
  1  something differs, or the log is cut or damaged
  2  bad usage: no log of a run, written by another build";

const SWAP_EXAMPLES: &str = "\
Examples:
  mikoshi swap A                                       (the servo of robot A)
  mikoshi swap coordinator --set hybrid.loop_gain=0.04
  mikoshi swap A --program target/release/mikoshi-servo

The new process starts, makes its ports and reads what the old one keeps; then the old one makes room at the
next tick, and the new one goes on from there. In lockstep no tick is lost.

Exit status:
  0  the new process is in charge
  2  it was refused, and nothing has changed: no such service, a setting that is wrong, or another state
  3  a fault of the system";

const DRIVE_EXAMPLES: &str = "\
Examples:
  mikoshi run config/scenarios/drive.toml --real-time   (in another terminal; in lockstep time would fly)
  mikoshi drive
  mikoshi drive --script walk.txt                       (or - for standard input)

A script has lines of a time in seconds since driving began, by the run's clock, and an order:
  0.0  move 0.05 0 0  0 0 0.02   ahead, left, up [m/s], and about these axes [rad/s]
  5.0  squeeze 10                press harder [N]
  8.0  halt
  9.0  end
and stop, resume, grasp, lift, lower, release. Behind # is a comment.

Directions are the object's own. The coordinator bounds speeds, accelerations, heights and tilts, by the
scenario's [operator.drive], and no faster than the slowest robot can follow. If this process ends or hangs, the
object is at rest within operator.drive.timeout_s. What was said is in the run's log, and replays. One process
drives at a time.

Exit status:
  0  somebody quit, the script or the run has ended
  1  another process took over, or the run's supervisor is gone
  2  no such run, one that nobody may drive, a script that is wrong, no terminal
  3  a fault of the system
  130, 143  interrupted, terminated";

const PUSH_EXAMPLES: &str = "\
Examples:
  mikoshi push A --force 0,40,0 --for 0.2       (robot A, at its waist)
  mikoshi push object --force 0,0,-30 --for 1

The force acts at the body's centre of mass, in axes of the world, from the next tick on; it takes the place of what
pushes the same body. It is in the log, and replays. A scenario has the same in [[world.pushes]].

Exit status:
  0  the world has heard of it; the tick is told
  2  no such run or body, or too much force
  3  a fault of the system";

const SET_EXAMPLES: &str = "\
Examples:
  mikoshi set hybrid.loop_gain=0.04
  mikoshi set hybrid.axes.0.reference=30 safety.hand_force_max_n=200

All that is named changes in one tick, or nothing does: a coordinator with these settings gets ready and takes the
old one's place. References of forces go to what is asked for within a second. What other processes read, too, can't
be set: gait, balance, the world. It is in the log, and replays.

Exit status:
  0  in force; the tick is told
  2  refused, and nothing has changed: a value that is wrong, or a key that can't change in the middle of a run
  3  a fault of the system";

const SOAK_EXAMPLES: &str = "\
Examples:
  mikoshi soak config/scenarios/transport.toml                 (200 kills)
  mikoshi soak config/scenarios/transport.toml --seed 3 --kills 20 --out /tmp/soak
  mikoshi soak config/scenarios/transport.toml --kills 0       (memory)
  mikoshi soak config/scenarios/transport.toml --real-time --kills 20 --freezes 20

The run is carried out undisturbed in one thread, and then in processes of which some are killed at ticks drawn
by seed, alone, in pairs, and twice in a row. Both must leave the same log, byte for byte, and nothing else.

In real time, servos and the coordinator are killed and frozen in turn, each with a standby behind it. The run
must meet its thresholds, never stop for safety's sake, and leave nothing; told is for how many ticks a command
was missing.

Exit status:
  0  they do, and the run met its thresholds
  1  they do not, or it did not
  2  bad usage or configuration
  3  a fault of the system";

const LATENCY_EXAMPLES: &str = "\
Examples:
  mikoshi latency config/scenarios/hold.toml --empty               (what the exchange of frames takes)
  mikoshi latency config/scenarios/hold.toml --empty --set placement.yield_us=0
  mikoshi latency config/scenarios/transport.toml --real-time --set placement.fifo_priority=20
  mikoshi latency config/scenarios/transport.toml --load 2 --out /tmp/loaded
  mikoshi latency --compare runs/latency-hold-0/latency.json /tmp/loaded/latency.json

Times come from stamps that every frame carries: when its publisher had heard its inputs, had kept what came of
them, and published it. Threads that only sleep, one on each core, say how late the machine itself wakes up who
sleeps; with a FIFO priority they stand one above the services, and say whose fault a late tick is. The first 200
ticks don't count.

Exit status:
  0  measured
  2  bad usage or configuration
  3  a fault of the system";

const REPORT_EXAMPLES: &str = "\
Examples:
  mikoshi report runs/hold-0                  (runs/hold-0/report/index.html)
  mikoshi report runs/hold-0 runs/hold-1      (runs/hold-0/report/against-hold-1/index.html)
  mikoshi report runs/hold-0 --out /tmp/figures

Draws figures 9, 12, 14, 15, 16 and 18 of the paper from what the run left, as SVG and PNG, and a page with
them. Of two runs, the first is drawn solid and the second dashed. Figures that a run has no data for are
left out, and the page says why.

Exit status: 0 it is written, 2 the folder holds no run that can be read.";

const RENDER_EXAMPLES: &str = "\
Examples:
  mikoshi render runs/transport-0/run.mcap --out walk.mp4
  mikoshi render runs/transport-0/run.mcap --out walk.mp4 --camera top --from 10 --to 20 --size 640x480
  mikoshi render runs/transport-0/run.mcap --out end.png --camera side
  mikoshi render runs/transport-0/run.mcap --out frame.png --at 12.5

The simulator's renderer draws what was truly there. It needs OpenGL through EGL, in hardware or in software, and
neither a display nor a window.

Exit status: 0 it is written, 2 the log can't be read or the file can't be written, 3 there is no OpenGL.";

const CHECK_ROBOT_EXAMPLES: &str = "\
Examples:
  mikoshi check-robot config/robots/hrp2.toml
  mikoshi check-robot /opt/robots/talos.urdf           (what a URDF alone comes to)

Exit status: 0 it can be used, 2 it can't, and what is missing is said, with the line of the key.";

const INSTALL_EXAMPLES: &str = "\
Examples:
  sudo target/release/mikoshi install                       (below /usr/local, configuration in /etc/mikoshi)
  target/release/mikoshi install --root pkg --prefix /usr   (as a package is made)
  sudo systemctl enable --now mikoshi.target

Configuration that is there already stays as it is.

Exit status: 0 it is installed, 2 bad usage, 3 a program is missing or a file can't be written.";

const UNINSTALL_EXAMPLES: &str = "\
Examples:
  sudo mikoshi uninstall              (configuration, results and the user stay)
  sudo mikoshi uninstall --purge

What came as a package goes as one: sudo apt purge mikoshi.

Exit status: 0 it is gone, 2 bad usage, 3 a file can't be removed.";

const SWEEP_EXAMPLES: &str = "\
Examples:
  mikoshi sweep config/sweeps/robust.toml
  mikoshi sweep config/sweeps/robust.toml --runs 6 --out /tmp/robust
  mikoshi sweep config/sweeps/robust.toml --out /tmp/robust     (goes on where the above has ended)

Exit status:
  0  at least as many runs succeeded as the file asks for; of fewer --runs, as large a share
  1  they did not
  2  bad usage or configuration
  3  a fault of the system: a run without a result, no simulator
  130, 143  interrupted, terminated: finished runs stay";

const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  mikoshi completions bash > ~/.local/share/bash-completion/completions/mikoshi
  mikoshi completions zsh > ~/.zfunc/_mikoshi
  mikoshi completions fish > ~/.config/fish/completions/mikoshi.fish";

const TOP_EXAMPLES: &str = "\
Examples:
  mikoshi top
  mikoshi top --run 4711-0
  mikoshi top --once                (one table, without a terminal)
  mikoshi top --once --json

Of each service: the process in charge and its epoch, how far it is, how fast, and for how long each phase of a
tick worked and waited in the last second (median and 99 of 100). `miss` counts its results that came too late since
watching began, and for the bridge ticks that began late. Margins, tilt and torque of a robot are the worst of the
last second, as its own sensors tell.

Keys: q quits, arrows scroll. The run does not notice who watches.

Exit status:
  0  the run has ended, or somebody quit
  1  the supervisor ended
  2  there is no such run, or no terminal
  3  a fault of the system";

/// A team of humanoid robots carries one object.
#[derive(Debug, Parser)]
#[command(name = "mikoshi", version, after_help = EXAMPLES)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a scenario: one process per service, or all of them in one thread
    #[command(after_help = RUN_EXAMPLES)]
    Run(RunArguments),
    /// Look after a run whose supervisor was killed: its services went on without
    #[command(after_help = ADOPT_EXAMPLES)]
    Adopt(AdoptArguments),
    /// Record the frames of a run that goes on, from now to its end
    #[command(after_help = RECORD_EXAMPLES)]
    Record(RecordArguments),
    /// Look at a run that goes on or was recorded, in 3D and in plots
    #[command(after_help = WATCH_EXAMPLES)]
    View(WatchArguments),
    /// Execute the services of a recorded run anew, and compare what they say
    #[command(after_help = REPLAY_EXAMPLES)]
    Replay(ReplayArguments),
    /// Replace a process of a run by another one, while the run goes on
    #[command(after_help = SWAP_EXAMPLES)]
    Swap(SwapArguments),
    /// Stop the team: the object comes to rest, feet finish their step, hands go on to hold
    Stop(OperatorArguments),
    /// Let the team go on after a stop, once nothing is wrong
    Resume(OperatorArguments),
    /// Drive the object of a run, by keys or by a script
    #[command(after_help = DRIVE_EXAMPLES)]
    Drive(DriveArguments),
    /// Push a robot or the object of a simulated run
    #[command(after_help = PUSH_EXAMPLES)]
    Push(PushArguments),
    /// Have a robot let go and walk off while the others carry
    Leave(MembershipArguments),
    /// Have a robot that has left walk up and take hold again
    Join(MembershipArguments),
    /// Change gains, limits and references of a run that goes on
    #[command(after_help = SET_EXAMPLES)]
    Set(SetArguments),
    /// Kill processes of a run at random, and compare it with the same run undisturbed
    #[command(after_help = SOAK_EXAMPLES)]
    Soak(SoakArguments),
    /// Measure how long frames and services take, beside what the machine adds
    #[command(after_help = LATENCY_EXAMPLES)]
    Latency(LatencyArguments),
    /// Draw the paper's figures from a run's results, or from two runs laid over each other
    #[command(after_help = REPORT_EXAMPLES)]
    Report(ReportArguments),
    /// Draw a recorded run as a film or a picture, without a display
    #[command(after_help = RENDER_EXAMPLES)]
    Render(RenderArguments),
    /// Run a scenario many times, by seed over ranges of parameters; finished runs are not done again
    #[command(after_help = SWEEP_EXAMPLES)]
    Sweep(SweepArguments),
    /// Show what a scenario comes to: arms, matrices, gains, schedule, limits
    Plan(PlanArguments),
    /// Check whether a robot's files can be used: frames, limits, inertias, drives, sensors, and how far it reaches
    #[command(after_help = CHECK_ROBOT_EXAMPLES)]
    CheckRobot(CheckRobotArguments),
    /// Watch a run as it goes on: processes, their timing, robots, internal forces, faults
    #[command(after_help = TOP_EXAMPLES)]
    Top(TopArguments),
    /// List the runs of this machine and their processes
    Status(StatusArguments),
    /// Check whether this machine is fit to run, and say how to make it so
    Doctor(DoctorArguments),
    /// Print what a shell needs to complete this command's words
    #[command(after_help = COMPLETIONS_EXAMPLES)]
    Completions(CompletionsArguments),
    /// Write the manual pages of all commands
    Man(ManArguments),
    /// Install programs, systemd units, their user and a configuration on this machine
    #[command(after_help = INSTALL_EXAMPLES)]
    Install(InstallArguments),
    /// Stop the team and its services, and take away what was installed
    #[command(after_help = UNINSTALL_EXAMPLES)]
    Uninstall(UninstallArguments),
    /// What systemd's units call
    #[command(hide = true, subcommand)]
    Service(ServiceCommand),
}

impl Command {
    /// Whether programs, not people, read what it says.
    pub fn wants_json(&self) -> bool {
        match self {
            Self::Run(arguments) => arguments.json,
            Self::Adopt(arguments) => arguments.json,
            Self::Record(arguments) => arguments.json,
            Self::View(arguments) => arguments.json,
            Self::Replay(arguments) => arguments.json,
            Self::Swap(arguments) => arguments.json,
            Self::Stop(arguments) | Self::Resume(arguments) => arguments.json,
            Self::Drive(arguments) => arguments.json,
            Self::Push(arguments) => arguments.json,
            Self::Leave(arguments) | Self::Join(arguments) => arguments.json,
            Self::Set(arguments) => arguments.json,
            Self::Soak(arguments) => arguments.json,
            Self::Latency(arguments) => arguments.json,
            Self::Report(arguments) => arguments.json,
            Self::Render(arguments) => arguments.json,
            Self::Sweep(arguments) => arguments.json,
            Self::Plan(arguments) => arguments.json,
            Self::CheckRobot(arguments) => arguments.json,
            Self::Top(arguments) => arguments.json,
            Self::Status(arguments) => arguments.json,
            Self::Doctor(arguments) => arguments.json,
            Self::Completions(_) | Self::Man(_) => false,
            Self::Install(_) | Self::Uninstall(_) | Self::Service(_) => false,
        }
    }
}

/// `mikoshi install`.
#[derive(Args, Debug)]
pub struct InstallArguments {
    /// Where programs and units go, as they will be seen
    #[arg(long, value_name = "DIR", default_value = "/usr/local")]
    pub prefix: PathBuf,
    /// Install into this folder instead of the machine, as a package is made
    #[arg(long, value_name = "DIR", default_value = "/")]
    pub root: PathBuf,
}

/// `mikoshi uninstall`.
#[derive(Args, Debug)]
pub struct UninstallArguments {
    /// Where it was installed
    #[arg(long, value_name = "DIR", default_value = "/usr/local")]
    pub prefix: PathBuf,
    /// The folder into which it was installed
    #[arg(long, value_name = "DIR", default_value = "/")]
    pub root: PathBuf,
    /// Remove the configuration, all results and the user, too
    #[arg(long)]
    pub purge: bool,
}

/// `mikoshi service`.
#[derive(Debug, Subcommand)]
pub enum ServiceCommand {
    /// Make the run that the services take part in
    Prepare(PrepareArguments),
    /// Remove it
    Clear,
    /// Wait until the team goes
    Await,
    /// Stop the team, and wait until it stands
    Stop,
    /// Write down which services the scenario wants, as a generator of systemd
    Generate {
        /// Where to
        folder: PathBuf,
    },
}

/// `mikoshi service prepare`.
#[derive(Args, Debug)]
pub struct PrepareArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub scenario: ScenarioArguments,
    /// Which of the scenario's hosts this one is [default: the one of this name, if there are several]
    #[arg(long, value_name = "NAME")]
    pub host: Option<String>,
    /// Wait for all inputs, however long they take, instead of pacing ticks by the clock
    #[arg(long)]
    pub lockstep: bool,
}

/// Which scenario, with which changes.
#[derive(Args, Debug)]
pub struct ScenarioArguments {
    /// The scenario's file, such as config/scenarios/hold.toml
    pub scenario: PathBuf,
    /// Seed of everything random, in place of the scenario's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Put a value in place of the scenario's; an empty one takes the key away
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_and_value)]
    pub overrides: Vec<(String, String)>,
}

/// `mikoshi run`.
#[derive(Args, Debug)]
pub struct RunArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub scenario: ScenarioArguments,
    /// Run all services in one thread; the result is the same, byte for byte
    #[arg(long)]
    pub in_process: bool,
    /// Pace ticks by the clock, and go on without what does not come in time
    #[arg(long, conflicts_with = "in_process")]
    pub real_time: bool,
    /// Another program in the place of the simulator: a bridge to robots, or to another world
    #[arg(long, value_name = "FILE", conflicts_with = "in_process")]
    pub bridge: Option<PathBuf>,
    /// Print summary.json instead of a table
    #[arg(long, conflicts_with = "quiet")]
    pub json: bool,
    /// Show the run as a page from its first tick on, and leave it there until Ctrl-C (see `mikoshi view`)
    #[arg(long, conflicts_with = "in_process")]
    pub viewer: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub results: ResultsArguments,
}

/// Where results go, and which.
#[derive(Args, Debug)]
pub struct ResultsArguments {
    /// Where the results go [default: a new folder runs/NAME-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Replace the results of an earlier run in --out
    #[arg(long, requires = "out")]
    pub force: bool,
    /// No progress and no table: errors and exit status only
    #[arg(long, short)]
    pub quiet: bool,
    /// Record no frames: run.mcap takes 3.6 MB for each second of four robots
    #[arg(long)]
    pub no_log: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub views: ViewArguments,
}

/// What logs hold beside frames.
#[derive(Args, Clone, Copy, Debug)]
pub struct ViewArguments {
    /// How often a second of the run is written down for Foxglove and the like; 0: frames only
    #[arg(long, value_name = "HZ", default_value_t = DEFAULT_VIEW_HZ, value_parser = rate)]
    pub view_hz: f64,
}

/// `mikoshi adopt`.
#[derive(Args, Debug)]
pub struct AdoptArguments {
    /// The run, as `mikoshi status` names it [default: the only one without a supervisor]
    pub run: Option<String>,
    /// Print summary.json instead of a table
    #[arg(long, conflicts_with = "quiet")]
    pub json: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub results: ResultsArguments,
}

/// `mikoshi record`.
#[derive(Args, Debug)]
pub struct RecordArguments {
    /// The run, as `mikoshi status` names it [default: the only one]
    pub run: Option<String>,
    /// The log to be written
    #[arg(long, value_name = "FILE.MCAP")]
    pub out: PathBuf,
    /// Replace it if it is there
    #[arg(long)]
    pub force: bool,
    /// Print the result as JSON
    #[arg(long, conflicts_with = "quiet")]
    pub json: bool,
    /// Errors and exit status only
    #[arg(long, short)]
    pub quiet: bool,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub views: ViewArguments,
}

/// `mikoshi view`.
#[derive(Args, Debug)]
pub struct WatchArguments {
    /// The log of a run or its folder, or a run that goes on, as `mikoshi status` names it [default: the only one]
    pub run: Option<String>,
    /// Serve a page on this machine, and open it where there is a display
    #[arg(long)]
    pub web: bool,
    /// The page's port; its data is at the next one [default: 9090, or any if that is taken]
    #[arg(long, value_name = "PORT", requires = "web")]
    pub port: Option<u16>,
    /// Write a file for Rerun instead of showing anything
    #[arg(long, value_name = "FILE.RRD", conflicts_with = "web")]
    pub save: Option<PathBuf>,
    /// Replace it if it is there
    #[arg(long, requires = "save")]
    pub force: bool,
    /// Say as JSON where the page or the file is
    #[arg(long)]
    pub json: bool,
    /// How often a second of the run is shown
    #[arg(long, value_name = "HZ", default_value_t = 25.0, value_parser = positive_rate)]
    pub hz: f64,
}

/// `mikoshi replay`.
#[derive(Args, Debug)]
pub struct ReplayArguments {
    /// The log of a run
    #[arg(value_name = "RUN.MCAP")]
    pub log: PathBuf,
    /// A service: bridge, coordinator, or the name of a robot for its servo [default: all]
    #[arg(long = "service", value_name = "NAME")]
    pub services: Vec<String>,
    /// Stop before this tick
    #[arg(long, value_name = "TICK")]
    pub until: Option<u64>,
    /// Put a value in place of the recorded run's
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_and_value)]
    pub overrides: Vec<(String, String)>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi swap`.
#[derive(Args, Debug)]
pub struct SwapArguments {
    /// bridge, coordinator, or the name of a robot for its servo
    pub service: String,
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Put a value in place of the run's, for the new process
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_and_value)]
    pub overrides: Vec<(String, String)>,
    /// Another build's program
    #[arg(long, value_name = "FILE")]
    pub program: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi stop`, `mikoshi resume`.
#[derive(Args, Debug)]
pub struct OperatorArguments {
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi drive`.
#[derive(Args, Debug)]
pub struct DriveArguments {
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Drive by a script, without a terminal; - reads standard input
    #[arg(long, value_name = "FILE")]
    pub script: Option<PathBuf>,
    /// Drive though another process does, which then ends
    #[arg(long)]
    pub take_over: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi push`.
#[derive(Args, Debug)]
pub struct PushArguments {
    /// object, or the name of a robot
    #[arg(value_name = "ROBOT|object")]
    pub on: String,
    /// How hard, along x, y and z of the world
    #[arg(long = "force", value_name = "X,Y,Z", value_parser = three_numbers, allow_hyphen_values = true)]
    pub force_n: [f64; 3],
    /// For how many seconds of the run
    #[arg(long = "for", value_name = "S")]
    pub for_s: f64,
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi leave` and `mikoshi join`.
#[derive(Args, Debug)]
pub struct MembershipArguments {
    /// The robot's name
    #[arg(value_name = "ROBOT")]
    pub robot: String,
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi set`.
#[derive(Args, Debug)]
pub struct SetArguments {
    /// Values in place of the run's
    #[arg(value_name = "KEY=VALUE", value_parser = key_and_value, required = true)]
    pub settings: Vec<(String, String)>,
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi soak`.
#[derive(Args, Debug)]
pub struct SoakArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub scenario: ScenarioArguments,
    /// Pace ticks by the clock, with standbys: the run must meet its thresholds as if nothing had happened
    #[arg(long)]
    pub real_time: bool,
    /// How often somebody is killed; in lockstep some strikes hit two, or successors too [default: 200, with
    /// --real-time 100]
    #[arg(long, value_name = "N")]
    pub kills: Option<usize>,
    /// How often somebody is frozen, and thawed when another is in charge [default: 100]
    #[arg(long, value_name = "N", requires = "real_time")]
    pub freezes: Option<usize>,
    /// Where the results go [default: runs/soak-NAME-SEED]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long, conflicts_with = "quiet")]
    pub json: bool,
    /// No table: errors and exit status only
    #[arg(long, short)]
    pub quiet: bool,
}

/// `mikoshi latency`.
#[derive(Args, Debug)]
pub struct LatencyArguments {
    /// The scenario's file, such as config/scenarios/hold.toml
    #[arg(required_unless_present = "compare")]
    pub file: Option<PathBuf>,
    /// Seed of everything random, in place of the scenario's
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Put a value in place of the scenario's; an empty one takes the key away
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_and_value)]
    pub overrides: Vec<(String, String)>,
    /// Services compute nothing: what the exchange of frames takes by itself
    #[arg(long)]
    pub empty: bool,
    /// Pace ticks by the clock
    #[arg(long)]
    pub real_time: bool,
    /// Threads that compute beside the run, at ordinary priority
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub load: usize,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
    /// Lay two results beside each other
    #[arg(long, num_args = 2, value_names = ["A.json", "B.json"], conflicts_with = "file")]
    pub compare: Vec<PathBuf>,
    #[command(flatten)]
    #[allow(missing_docs)]
    pub results: ResultsArguments,
}

impl LatencyArguments {
    /// Which scenario, if one is to be measured.
    pub fn scenario(&self) -> Option<ScenarioArguments> {
        let (scenario, overrides) = (self.file.clone()?, self.overrides.clone());
        Some(ScenarioArguments { scenario, seed: self.seed, overrides })
    }
}

/// `mikoshi report`.
#[derive(Args, Debug)]
pub struct ReportArguments {
    /// The folder with a run's results
    pub run: PathBuf,
    /// Another run, to be laid over the first
    pub other: Option<PathBuf>,
    /// Where the report goes [default: a folder in the first run's]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi render`.
#[derive(Args, Debug)]
pub struct RenderArguments {
    /// The log of a run
    #[arg(value_name = "RUN.MCAP")]
    pub log: PathBuf,
    /// What to draw: a film, or a picture of one moment
    #[arg(long, value_name = "FILE.mp4|FILE.png")]
    pub out: PathBuf,
    /// Where to look from
    #[arg(long, value_enum, default_value_t = CameraChoice::Follow)]
    pub camera: CameraChoice,
    /// The moment of a picture [default: the last one]
    #[arg(long, value_name = "SECONDS")]
    pub at: Option<f64>,
    /// Where a film begins
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0)]
    pub from: f64,
    /// Where a film ends [default: with the run]
    #[arg(long, value_name = "SECONDS")]
    pub to: Option<f64>,
    /// Pictures a second of a film
    #[arg(long, value_name = "HZ", default_value_t = 30.0, value_parser = positive_rate)]
    pub fps: f64,
    /// Width and height in pixels, even numbers, at most 1920x1080
    #[arg(long, value_name = "WxH", default_value = "1280x720", value_parser = width_and_height)]
    pub size: (u32, u32),
    /// Replace the file if it is there
    #[arg(long)]
    pub force: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

/// Where to look from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum CameraChoice {
    /// From above, all of the way
    Top,
    /// From aside, all of the way
    Side,
    /// From ahead and above, along with the object
    Follow,
}

/// `mikoshi sweep`.
#[derive(Args, Debug)]
pub struct SweepArguments {
    /// The sweep's file, such as config/sweeps/robust.toml
    pub sweep: PathBuf,
    /// Where the results go, and where those of an earlier sweep are found [default: runs/sweep-NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Runs at once [default: as many as there are cores]
    #[arg(long, value_name = "N")]
    pub jobs: Option<NonZeroUsize>,
    /// Number of runs, in place of the file's
    #[arg(long, value_name = "N")]
    pub runs: Option<NonZeroU32>,
    /// Keep every frame of every run, about 3 MB for each second
    #[arg(long)]
    pub keep_logs: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
    /// No progress and no table: errors and exit status only
    #[arg(long, short, conflicts_with = "json")]
    pub quiet: bool,
}

/// `mikoshi plan`.
#[derive(Args, Debug)]
pub struct PlanArguments {
    #[command(flatten)]
    #[allow(missing_docs)]
    pub scenario: ScenarioArguments,
    /// Say which delay and gain go with a way between hosts: what `mikoshi-link measure ask` printed, or a link's report
    #[arg(long, value_name = "FILE.json")]
    pub way: Option<PathBuf>,
    /// Print it as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi check-robot`.
#[derive(Args, Debug)]
pub struct CheckRobotArguments {
    /// A robot's configuration, or a URDF
    #[arg(value_name = "ROBOT.toml|URDF")]
    pub file: PathBuf,
    /// Print it as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi top`.
#[derive(Args, Debug)]
pub struct TopArguments {
    /// The run, as `mikoshi status` names it [default: the only one]
    #[arg(long, value_name = "RUN")]
    pub run: Option<String>,
    /// Watch for a second, print one table, and end; it needs no terminal
    #[arg(long)]
    pub once: bool,
    /// Print it as JSON
    #[arg(long, requires = "once")]
    pub json: bool,
}

/// `mikoshi status`.
#[derive(Args, Debug)]
pub struct StatusArguments {
    /// Print it as JSON
    #[arg(long)]
    pub json: bool,
}

/// `mikoshi doctor`.
#[derive(Args, Debug)]
pub struct DoctorArguments {
    /// Print it as JSON
    #[arg(long)]
    pub json: bool,
    /// Remove what dead runs have left
    #[arg(long)]
    pub clean: bool,
}

/// `mikoshi completions`.
#[derive(Args, Debug)]
pub struct CompletionsArguments {
    /// For which shell
    pub shell: Shell,
}

/// `mikoshi man`.
#[derive(Args, Debug)]
pub struct ManArguments {
    /// The folder for mikoshi.1, mikoshi-run.1 and so on; it is made if it is not there
    #[arg(value_name = "DIR")]
    pub folder: PathBuf,
}

fn positive_rate(typed: &str) -> Result<f64, String> {
    let hz = typed.parse().ok().filter(|hz: &f64| (0.1..=1000.0).contains(hz));
    hz.ok_or_else(|| "expected a rate from 0.1 to 1000 Hz".to_owned())
}

fn width_and_height(typed: &str) -> Result<(u32, u32), String> {
    let size =
        typed.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    let fits = |edge: u32, most| (16..=most).contains(&edge) && edge.is_multiple_of(2);
    size.filter(|&(width, height)| fits(width, 1920) && fits(height, 1080))
        .ok_or_else(|| "expected WIDTHxHEIGHT, even numbers from 16x16 to 1920x1080".to_owned())
}

fn rate(typed: &str) -> Result<f64, String> {
    let hz = typed.parse().ok().filter(|hz: &f64| hz.is_finite() && *hz >= 0.0);
    hz.ok_or_else(|| "expected a rate in Hz, or 0".to_owned())
}

fn three_numbers(typed: &str) -> Result<[f64; 3], String> {
    let numbers: Option<Vec<f64>> = typed.split(',').map(|number| number.trim().parse().ok()).collect();
    let numbers: Option<[f64; 3]> = numbers.and_then(|numbers| numbers.try_into().ok());
    let finite = numbers.filter(|numbers| numbers.iter().all(|number| number.is_finite()));
    finite.ok_or_else(|| "expected three numbers with commas between them".to_owned())
}

fn key_and_value(typed: &str) -> Result<(String, String), String> {
    match typed.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("expected KEY=VALUE, such as object.mass_kg=4".to_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_commands_are_consistent() {
        Arguments::command().debug_assert();
    }

    #[test]
    fn overrides_are_keys_and_values_and_a_value_may_be_empty_or_hold_an_equals_sign() {
        assert_eq!(key_and_value("a.b=4"), Ok(("a.b".into(), "4".into())));
        assert_eq!(key_and_value("a="), Ok(("a".into(), String::new())));
        assert_eq!(key_and_value("a=b=c"), Ok(("a".into(), "b=c".into())));
        assert!(key_and_value("a").is_err());
        assert!(key_and_value("=4").is_err());
    }
}
