//! All views of a run, at their rate.

use crate::balance::Balances;
use crate::events::Events;
use crate::frames::Frames;
use crate::joints::Joints;
use crate::recording::RecordError;
use crate::scene::Scene;
use crate::team::Team;
use crate::timing::Timings;
use crate::wrenches::Wrenches;
use mikoshi_config::scenario::Clock;
use mikoshi_config::{RobotSpec, RunSpec};
use mikoshi_observation::{LogWriter, ObjectTracker, Observation, ObservedRun, WriteLogError};
use mikoshi_robot::Robot;

/// What is beside the frames.
pub struct Views {
    every_ticks: u64,
    has_begun: bool,
    tracker: ObjectTracker,
    events: Events,
    frames: Frames,
    scene: Scene,
    team: Team,
    /// By the clock only: in lockstep a log is the same to the last byte, and no time is.
    timings: Option<Timings>,
    robots: Vec<RobotViews>,
}

struct RobotViews {
    joints: Joints,
    wrenches: Wrenches,
    balance: Balances,
}

impl Views {
    /// Of a run, `hz` times a second of it.
    pub fn add(
        log: &mut LogWriter,
        run: &RunSpec,
        observed: &ObservedRun,
        hz: f64,
    ) -> Result<Self, RecordError> {
        let robots = run.robots.iter().map(|spec| Robot::new(&spec.config, &spec.urdf));
        let robots = robots.collect::<Result<Vec<_>, _>>()?;
        let named: Vec<_> = run.robots.iter().zip(robots.iter().map(|robot| &robot.model)).collect();
        let names = || run.robots.iter().map(|spec| spec.member.name.clone()).collect();
        let of_robot = |log: &mut LogWriter, index: usize, spec: &RobotSpec| -> Result<_, WriteLogError> {
            Ok(RobotViews {
                joints: Joints::add(log, index, &spec.member.name, &robots[index].model)?,
                wrenches: Wrenches::add(log, index, spec)?,
                balance: Balances::add(log, index, &spec.member.name)?,
            })
        };
        let is_by_the_clock = run.scenario.clock == Clock::Wall;
        Ok(Self {
            every_ticks: ((hz * run.scenario.control_period_s).recip().round() as u64).max(1),
            has_begun: false,
            tracker: ObjectTracker::new(observed),
            events: Events::add(log, names())?,
            frames: Frames::add(log, &named)?,
            scene: Scene::add(log, run, &robots, &observed.robots)?,
            team: Team::add(log, observed)?,
            timings: is_by_the_clock.then(|| Timings::add(log, names())).transpose()?,
            robots: named
                .iter()
                .enumerate()
                .map(|(index, (spec, _))| of_robot(log, index, spec))
                .collect::<Result<_, _>>()?,
        })
    }

    /// Takes in one tick, and says what is to be said of it. Ticks come in order.
    pub fn write(
        &mut self,
        log: &mut LogWriter,
        time_ns: u64,
        observation: &Observation,
    ) -> Result<(), WriteLogError> {
        let tick = observation.tick();
        if let Some(timings) = &mut self.timings {
            timings.observe(observation);
        }
        // Before anybody says where the object is there is nothing to see.
        let Some(object) = self.tracker.observe(observation) else { return Ok(()) };
        self.events.write(log, time_ns, observation)?;
        if !core::mem::replace(&mut self.has_begun, true) {
            self.frames.write_fixed(log, tick, time_ns)?;
            self.scene.write_fixed(log, tick, time_ns)?;
        } else if !tick.is_multiple_of(self.every_ticks) {
            return Ok(());
        }
        self.frames.write(log, time_ns, observation)?;
        self.scene.write(log, time_ns, observation)?;
        self.team.write(log, time_ns, observation, &object)?;
        if let Some(timings) = &mut self.timings {
            timings.write(log, time_ns, tick)?;
        }
        for robot in &self.robots {
            robot.joints.write(log, time_ns, observation)?;
            robot.wrenches.write(log, time_ns, observation)?;
            robot.balance.write(log, time_ns, observation)?;
        }
        Ok(())
    }
}
