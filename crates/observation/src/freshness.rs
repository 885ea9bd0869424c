//! Which commands did not come in time: in wall-clock time one goes on without.

use crate::canonical::Observation;
use mikoshi_ipc_types::ServiceId;
use std::collections::{BTreeMap, BTreeSet};

/// How long before and after a process was replaced its commands may be missing for that reason.
const BEFORE_TICKS: u64 = 8;
const AFTER_TICKS: u64 = 64;

/// Ticks in which a service's command was not there when it was needed.
#[derive(Clone, Debug)]
pub struct Freshness {
    delay_ticks: u64,
    missing: BTreeMap<ServiceId, BTreeSet<u64>>,
}

impl Freshness {
    /// Of a run whose servos use team commands of this age.
    pub fn with_delay(delay_ticks: u64) -> Self {
        Self { delay_ticks, missing: BTreeMap::new() }
    }

    /// Takes in one tick.
    pub fn observe(&mut self, observation: &Observation) {
        let tick = observation.tick();
        for (robot, frame) in observation.sensors.iter().enumerate() {
            // What was used in the tick before.
            if observation.is_of_tick(frame) && tick > 0 && frame.payload.next_joint_command_tick < tick {
                self.missing.entry(ServiceId::Servo(robot)).or_default().insert(tick - 1);
            }
        }
        for frame in observation.joint_command.iter().filter(|frame| observation.is_of_tick(frame)) {
            let expected = (tick + 1).saturating_sub(self.delay_ticks);
            if frame.payload.next_team_command_tick < expected {
                self.missing.entry(ServiceId::Coordinator).or_default().insert(tick);
            }
        }
    }

    /// Ticks in which the world moved on without a robot's command.
    pub fn ticks_held(&self) -> u64 {
        let of_servos = self.missing.iter().filter(|(service, _)| service.robot().is_some());
        of_servos.flat_map(|(_, ticks)| ticks).collect::<BTreeSet<_>>().len() as u64
    }

    /// Ticks in which this service's command was not there when it was needed.
    pub fn ticks_missed(&self, service: ServiceId) -> u64 {
        self.missing.get(&service).map_or(0, |ticks| ticks.len() as u64)
    }

    /// Ticks that were lost around the one in which this service's process was replaced.
    pub fn ticks_lost(&self, service: ServiceId, tick: u64) -> u64 {
        let around = tick.saturating_sub(BEFORE_TICKS)..tick.saturating_add(AFTER_TICKS);
        self.missing.get(&service).map_or(0, |ticks| ticks.range(around).count() as u64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A team of two that hears everything in time.
    fn well(tick: u64) -> Observation {
        let mut observation = Observation::for_team(2);
        observation.object_truth.envelope.tick = tick;
        for frame in &mut observation.sensors {
            frame.envelope.tick = tick;
            frame.payload.next_joint_command_tick = tick;
        }
        for frame in &mut observation.joint_command {
            frame.envelope.tick = tick;
            frame.payload.next_team_command_tick = tick;
        }
        observation
    }

    #[test]
    fn what_was_missing_is_counted_by_whose_it_was_and_when() {
        let mut freshness = Freshness::with_delay(1);
        for tick in 0..200 {
            let mut observation = well(tick);
            // Commands of ticks 99 to 101.
            if (100..103).contains(&tick) {
                observation.sensors[1].payload.next_joint_command_tick = 99;
            }
            if tick == 150 {
                observation.joint_command[0].payload.next_team_command_tick = 149;
                observation.joint_command[1].payload.next_team_command_tick = 149;
            }
            freshness.observe(&observation);
        }
        assert_eq!(freshness.ticks_held(), 3);
        assert_eq!(freshness.ticks_lost(ServiceId::Servo(1), 100), 3);
        assert_eq!(freshness.ticks_lost(ServiceId::Servo(1), 190), 0);
        assert_eq!(freshness.ticks_missed(ServiceId::Servo(1)), 3);
        assert_eq!(freshness.ticks_missed(ServiceId::Servo(0)), 0);
        assert_eq!(freshness.ticks_lost(ServiceId::Servo(0), 100), 0);
        assert_eq!(freshness.ticks_lost(ServiceId::Coordinator, 148), 1);
    }

    #[test]
    fn a_frame_that_was_lost_says_nothing() {
        let mut freshness = Freshness::with_delay(0);
        let mut observation = well(50);
        observation.sensors[0].envelope.tick = 49;
        observation.sensors[0].payload.next_joint_command_tick = 0;
        observation.joint_command.iter_mut().for_each(|frame| frame.payload.next_team_command_tick = 51);
        freshness.observe(&observation);
        assert_eq!(freshness.ticks_held(), 0);
    }
}
