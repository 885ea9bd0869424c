//! What whoever drives sees of the run. It is heard beside the loop that drives, which waits for nobody.

use crate::failure::Failure;
use crate::feed::{Heard, Listener, Wish, listen_to};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{TeamState, TwistWire, mode, operator, stop_cause};
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// The run as it was seen last.
#[derive(Clone, Debug, Default)]
pub struct View {
    /// Scenario and seed.
    pub title: String,
    /// Time of the run; none before the first tick was seen.
    pub time_s: Option<f64>,
    /// What the team does.
    pub mode: &'static str,
    /// Why it is stopped, and whose fault that is.
    pub stop: Option<String>,
    /// The word that the job waits for.
    pub awaited: Option<&'static str>,
    /// Twist that the object is asked for, in the world.
    pub twist_ref: TwistWire,
    /// Share of it that the slowest robot allows.
    pub speed_share: f64,
    /// How much harder hands press.
    pub squeeze_n: f64,
    /// Where the object is, as the team sees it.
    pub position_m: [f64; 3],
    /// How far that is from where it should be.
    pub error_m: f64,
    /// The largest internal force.
    pub internal_n: f64,
}

/// Why nothing more is seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    Run,
    Supervisor,
}

/// Sees a run.
pub struct Watcher {
    seen: Arc<Mutex<Result<View, Ended>>>,
}

impl Watcher {
    /// Begins to.
    ///
    /// # Errors
    /// Nobody tells of the run: bad usage.
    pub fn start(directory: &Path, run: &RunSpec) -> Result<Self, Failure> {
        let listener = listen_to(directory, run.robots.len(), Wish::Some)?;
        let title = format!("{}, seed {}", run.scenario.name, run.scenario.seed);
        let seen = Arc::new(Mutex::new(Ok(View { title, ..View::default() })));
        let robots = run.robots.iter().map(|robot| robot.member.name.clone()).collect();
        let period_s = run.scenario.control_period_s;
        let told = Arc::clone(&seen);
        // It ends with the run, or with this process.
        std::thread::spawn(move || watch(listener, robots, period_s, &told));
        Ok(Self { seen })
    }

    /// What was seen last, or why nothing is.
    pub fn look(&self) -> Result<View, Ended> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

fn watch(mut listener: Listener, robots: Vec<String>, period_s: f64, seen: &Mutex<Result<View, Ended>>) {
    let tell = |change: &dyn Fn(&mut Result<View, Ended>)| {
        change(&mut seen.lock().unwrap_or_else(PoisonError::into_inner));
    };
    loop {
        match listener.hear() {
            Ok(Heard::Tick(observation)) => tell(&|seen| {
                if let Ok(view) = seen {
                    view.time_s = Some(observation.tick() as f64 * period_s);
                    view.take(&observation.team_state.payload, &robots);
                }
            }),
            Ok(Heard::End) => return tell(&|seen| *seen = Err(Ended::Run)),
            Ok(Heard::Silence) | Err(_) => return tell(&|seen| *seen = Err(Ended::Supervisor)),
            Ok(Heard::Lost(_) | Heard::Revision { .. } | Heard::Nothing) => {}
        }
    }
}

impl View {
    fn take(&mut self, team: &TeamState, robots: &[String]) {
        self.mode = mode::name(team.team_mode);
        self.stop = (team.stop_cause != 0).then(|| {
            let robot = (team.stop_robot as usize).checked_sub(1).and_then(|index| robots.get(index));
            let of_robot = robot.map_or_else(String::new, |robot| format!(", robot {robot}"));
            format!("{}{of_robot}", stop_cause::name(team.stop_cause))
        });
        self.awaited = (team.awaited_word != 0).then(|| operator::name(team.awaited_word));
        self.twist_ref = team.object_twist_ref;
        self.speed_share = team.speed_share;
        self.squeeze_n = team.squeeze_n;
        let ([x, y, z, ..], [xr, yr, zr, ..]) = (team.object_pose, team.object_pose_ref);
        self.position_m = [x, y, z];
        self.error_m = (x - xr).hypot(y - yr).hypot(z - zr);
        let forces = team.generalized_force.iter().skip(1);
        let sizes = forces.map(|[x, y, z, ..]| x.hypot(*y).hypot(*z));
        self.internal_n = sizes.fold(0.0, f64::max);
    }
}
