//! What is shown of a run.
//!
//! ```text
//! /world/robots/NAME/...      the robot as it truly is, of the shapes in its URDF, in its colour
//! /world/object               the object as it truly is
//! /world/reference/...        where object and hands are asked to be: ghosts
//! /world/balance/NAME/...     soles, support polygon, zero moment point
//! /world/forces/NAME          what its hands apply to the object
//! /plots/...                  internal forces, errors, margins, times
//! /events                     modes, stops and lost hands, in words
//! ```

mod balance;
mod bodies;
mod colors;
mod convert;
mod object;
pub mod plots;

use balance::Balance;
use bodies::Bodies;
use mikoshi::failure::Failure;
use mikoshi::watched_run::WatchedRun;
use mikoshi_observation::{Events, LongestTimes, ObjectTracker, Observation};
use mikoshi_robot::Robot;
use object::Objects;
use plots::Plots;
use re_sdk::{RecordingStream, RecordingStreamResult};
use re_sdk_types::archetypes::{TextLog, ViewCoordinates};
use re_sdk_types::components::TextLogLevel;

/// By which everything is shown: seconds of the run.
pub const TIME: &str = "time";

/// Everything that is shown.
pub struct Stage {
    stream: RecordingStream,
    period_s: f64,
    every_ticks: u64,
    /// The next tick to be shown.
    due: u64,
    tracker: ObjectTracker,
    events: Events,
    times: LongestTimes,
    robots: Vec<(Bodies, Balance)>,
    objects: Objects,
    plots: Plots,
}

impl Stage {
    /// Of a run, so many times a second of it. What never changes is shown at once.
    ///
    /// # Errors
    /// A robot can't be read, or nobody takes what is shown.
    pub fn set(stream: RecordingStream, watched: &WatchedRun, hz: f64) -> Result<Self, Failure> {
        let (run, observed) = (&watched.run, &watched.observed);
        stream.set_log_time_enabled(false);
        stream.set_log_tick_enabled(false);
        stream.log_static("/world", &ViewCoordinates::RIGHT_HAND_Z_UP()).map_err(Failure::fault)?;
        let mut robots = vec![];
        for (index, (spec, seen)) in run.robots.iter().zip(&observed.robots).enumerate() {
            let robot = Robot::new(&spec.config, &spec.urdf).map_err(Failure::fault)?;
            let bodies = Bodies::set(&stream, index, spec, &robot.model)?;
            let balance =
                Balance::set(&stream, index, spec, &robot, seen.weight_n()).map_err(Failure::fault)?;
            robots.push((bodies, balance));
        }
        Ok(Self {
            period_s: run.scenario.control_period_s,
            every_ticks: ((hz * run.scenario.control_period_s).recip().round() as u64).max(1),
            due: 0,
            tracker: ObjectTracker::new(observed),
            events: Events::of_team(observed.robots.iter().map(|robot| robot.name.clone()).collect()),
            times: LongestTimes::for_team(run.robots.len()),
            robots,
            objects: Objects::set(&stream, run).map_err(Failure::fault)?,
            plots: Plots::set(&stream, run, observed).map_err(Failure::fault)?,
            stream,
        })
    }

    /// Takes in one tick, and shows it if its turn has come. Ticks come in order.
    ///
    /// # Errors
    /// Nobody takes it.
    pub fn show(&mut self, observation: &Observation) -> RecordingStreamResult<()> {
        let tick = observation.tick();
        self.times.observe(observation);
        self.plots.observe(observation);
        self.stream.set_duration_secs(TIME, tick as f64 * self.period_s);
        self.stream.set_time_sequence("tick", i64::try_from(tick).unwrap_or(i64::MAX));
        for event in self.events.observe(observation) {
            let level = if event.is_warning { TextLogLevel::WARN } else { TextLogLevel::INFO };
            self.stream.log("/events", &TextLog::new(event.message).with_level(level))?;
        }
        let object = self.tracker.observe(observation);
        if tick < self.due {
            return Ok(());
        }
        self.due = tick - tick % self.every_ticks + self.every_ticks;
        let stream = &self.stream;
        for (bodies, balance) in &mut self.robots {
            bodies.show(stream, observation)?;
            balance.show(stream, observation)?;
        }
        // Before anybody says where the object is, there is nothing more to see.
        let Some(object) = object else { return Ok(()) };
        self.objects.show(stream, observation, &object, self.tracker.X_BodyA())?;
        self.plots.show(stream, &object, observation, &self.times.take())
    }
}
