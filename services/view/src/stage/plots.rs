//! Numbers over time.

use super::colors;
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::Clock;
use mikoshi_observation::{LongestTimes, Observation, ObservedRun, TrackedObject};
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{Scalars, SeriesLines};

/// Every plot, by its entity.
pub const INTERNAL_FORCES: &str = "/plots/internal_forces_n";
/// Of the object, beside its reference.
pub const TRACKING: &str = "/plots/object_error";
/// Of each robot.
pub const MARGINS: &str = "/plots/zmp_margin_mm";
/// The longest of each since it was last shown; only as stamps tell, which no log has.
pub const TIMES: &str = "/plots/longest_ms";
/// By the clock: how old what was used was, at most, since it was last shown.
pub const AGES: &str = "/plots/oldest_input_ticks";

/// All plots of a run.
pub struct Plots {
    is_by_the_clock: bool,
    /// Of joint commands in the world, and of team commands in servos.
    oldest_ticks: [u64; 2],
}

impl Plots {
    /// Of a run.
    ///
    /// # Errors
    /// Nobody takes what is shown.
    pub fn set(
        stream: &RecordingStream,
        run: &RunSpec,
        observed: &ObservedRun,
    ) -> RecordingStreamResult<Self> {
        let robots = || observed.robots.iter().map(|robot| robot.name.clone());
        let lines = |names: Vec<String>| SeriesLines::new().with_names(names);
        let name = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let rows = observed.internal_rows.iter().map(|(name, _)| name.clone());
        stream.log_static(INTERNAL_FORCES, &lines(rows.collect()))?;
        stream.log_static(TRACKING, &lines(name(&["position, mm", "attitude, mrad"])))?;
        let of_robots = (0..observed.robots.len()).map(colors::of_robot);
        stream.log_static(MARGINS, &lines(robots().collect()).with_colors(of_robots))?;
        let mut times = name(&["tick", "late", "bridge", "coordinator"]);
        times.extend(robots().map(|robot| format!("servo {robot}")));
        stream.log_static(TIMES, &lines(times))?;
        stream.log_static(AGES, &lines(name(&["joint commands", "team commands"])))?;
        Ok(Self { is_by_the_clock: run.scenario.clock == Clock::Wall, oldest_ticks: [0; 2] })
    }

    /// Takes in one tick.
    pub fn observe(&mut self, observation: &Observation) {
        let tick = observation.tick();
        let age = |next: u64| (tick + 1).saturating_sub(next);
        let of_tick = observation.sensors.iter().filter(|frame| observation.is_of_tick(frame));
        // The world moves to this tick with commands of the tick before, if all is well.
        let joint = of_tick.map(|frame| age(frame.payload.next_joint_command_tick + 1)).max();
        let of_tick = observation.joint_command.iter().filter(|frame| observation.is_of_tick(frame));
        let team = of_tick.map(|frame| age(frame.payload.next_team_command_tick)).max();
        for (oldest, age) in self.oldest_ticks.iter_mut().zip([joint, team]) {
            *oldest = (*oldest).max(age.unwrap_or_default());
        }
    }

    /// Shows a tick.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn show(
        &mut self,
        stream: &RecordingStream,
        object: &TrackedObject,
        observation: &Observation,
        longest: &LongestTimes,
    ) -> RecordingStreamResult<()> {
        let internal = object.internal.iter().map(|row| row.force.norm());
        stream.log(INTERNAL_FORCES, &Scalars::new(internal))?;
        if let Some(X_WA_ref) = object.X_WA_ref {
            let error = X_WA_ref.displacement_to(&object.X_WA);
            stream
                .log(TRACKING, &Scalars::new([error.linear, error.angular].map(|half| half.norm() * 1e3)))?;
        }
        let margins = observation.robot_truth.iter().map(|frame| frame.payload.zmp_margin_m * 1e3);
        stream.log(MARGINS, &Scalars::new(margins))?;
        let servos = longest.servos.iter().map(|servo| servo.sense_s + servo.act_s);
        let times = [longest.tick_s, longest.late_s, longest.bridge_s, longest.coordinator_s];
        if longest.tick_s > 0.0 {
            let times = times.into_iter().chain(servos).map(|time_s| time_s * 1e3);
            stream.log(TIMES, &Scalars::new(times))?;
        }
        let oldest = core::mem::take(&mut self.oldest_ticks);
        if self.is_by_the_clock {
            stream.log(AGES, &Scalars::new(oldest.map(|age| age as f64)))?;
        }
        Ok(())
    }
}
