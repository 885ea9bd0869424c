//! Where ticks spend their time, by the stamps that frames carry: the longest of each since somebody looked.

use crate::canonical::Observation;
use mikoshi_ipc_types::Envelope;

/// The longest of each, in seconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LongestTimes {
    /// From a tick's sensors to the next one's.
    pub tick_s: f64,
    /// From when a tick was due to its sensors.
    pub late_s: f64,
    /// The physical world.
    pub bridge_s: f64,
    /// The team's tick.
    pub coordinator_s: f64,
    /// Of each servo, what it senses and what it commands.
    pub servos: Vec<ServoTimes>,
    /// When the last tick began.
    began_ns: u64,
}

/// The same of one servo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs)]
pub struct ServoTimes {
    pub sense_s: f64,
    pub act_s: f64,
}

impl LongestTimes {
    /// Of a team.
    pub fn for_team(robots: usize) -> Self {
        Self { servos: vec![ServoTimes::default(); robots], ..Self::default() }
    }

    /// Takes in one tick. Ticks come in order.
    pub fn observe(&mut self, observation: &Observation) {
        let bridge = &observation.object_truth.envelope;
        let began_ns = core::mem::replace(&mut self.began_ns, bridge.stamp_ns);
        raise(&mut self.tick_s, began_ns, bridge.stamp_ns);
        raise(&mut self.late_s, bridge.due_ns, bridge.stamp_ns);
        raise_by(&mut self.bridge_s, bridge);
        raise_by(&mut self.coordinator_s, &observation.team_state.envelope);
        let frames = observation.robot_state.iter().zip(&observation.joint_command);
        for (servo, (state, command)) in self.servos.iter_mut().zip(frames) {
            raise_by(&mut servo.sense_s, &state.envelope);
            raise_by(&mut servo.act_s, &command.envelope);
        }
    }

    /// What was longest; it begins anew.
    pub fn take(&mut self) -> Self {
        let anew = Self { began_ns: self.began_ns, ..Self::for_team(self.servos.len()) };
        core::mem::replace(self, anew)
    }
}

fn raise_by(longest_s: &mut f64, phase: &Envelope) {
    raise(longest_s, phase.heard_ns, phase.kept_ns);
}

fn raise(longest_s: &mut f64, from_ns: u64, to_ns: u64) {
    if from_ns > 0 && to_ns >= from_ns {
        *longest_s = longest_s.max((to_ns - from_ns) as f64 * 1e-9);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_longest_since_somebody_looked_is_told() {
        let mut times = LongestTimes::for_team(1);
        let mut ticks = [1_000_u64, 3_000, 4_000, 9_000].map(|stamp_ns| {
            let mut observation = Observation::for_team(1);
            observation.object_truth.envelope.stamp_ns = stamp_ns;
            observation.joint_command[0].envelope.heard_ns = stamp_ns;
            observation.joint_command[0].envelope.kept_ns = stamp_ns + stamp_ns / 10;
            observation
        });
        // What has no stamps, as in a log, says nothing.
        ticks[2].joint_command[0].envelope.heard_ns = 0;
        let close = |found: f64, expected_ns: f64| (found * 1e9 - expected_ns).abs() < 1e-6;
        ticks[..3].iter().for_each(|tick| times.observe(tick));
        let first = times.take();
        assert!(close(first.tick_s, 2_000.0) && close(first.servos[0].act_s, 300.0), "{first:?}");
        times.observe(&ticks[3]);
        let second = times.take();
        assert!(close(second.tick_s, 5_000.0) && close(second.servos[0].act_s, 900.0), "{second:?}");
        assert_eq!(times.take().tick_s, 0.0);
    }
}
