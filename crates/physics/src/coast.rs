//! What drives do that hear nothing: they coast to rest.

use mikoshi_ipc_types::{JointCommand, MAX_JOINTS};

/// Of all joints.
pub(crate) type Rates = [f64; MAX_JOINTS];

/// For how long drives go on as if nothing had happened: commands that are late come in this time.
const GO_ON_S: f64 = 0.02;
/// Time constant with which they then come to rest.
const REST_S: f64 = 0.02;

/// How a command goes on that no other follows.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coast {
    period_s: f64,
    go_on_ticks: u64,
    /// What a tick leaves of a rate.
    decay: f64,
}

impl Coast {
    /// At this control period.
    pub(crate) fn of_period(period_s: f64) -> Self {
        let go_on_ticks = (GO_ON_S / period_s).round() as u64;
        Self { period_s, go_on_ticks, decay: (-period_s / REST_S).exp() }
    }

    /// Whether a command may still come that is only late, after so many ticks in a row without one.
    pub(crate) fn is_late(&self, missed: u64) -> bool {
        missed <= self.go_on_ticks
    }

    /// The command one tick after `last`, whose rates came after `rates_before`, where `missed` ticks in a row have
    /// none. Rates go on to change, half as much each tick, q̇ₖ₊₁ = q̇ₖ + ½·(q̇ₖ − q̇ₖ₋₁), and after a while decay,
    /// q̇ₖ₊₁ = q̇ₖ·e^(−T/τ); qₖ₊₁ = qₖ + T·q̇ₖ₊₁.
    pub(crate) fn after(&self, last: &JointCommand, rates_before: &Rates, missed: u64) -> JointCommand {
        let mut next = *last;
        let rates = next.joint_velocity_ref_rad_s.iter_mut().zip(rates_before);
        for (position, (rate, before)) in next.joint_position_ref_rad.iter_mut().zip(rates) {
            *rate =
                if missed > self.go_on_ticks { self.decay * *rate } else { *rate + 0.5 * (*rate - before) };
            *position += *rate * self.period_s;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    /// How far a joint goes on that moved at 1.9 and then at 2 rad/s, and its rate in the end.
    fn travel(missed: u64) -> (f64, f64) {
        let coast = Coast::of_period(0.005);
        let (mut command, mut before) = (JointCommand::zeroed(), [0.0; MAX_JOINTS]);
        before[3] = 1.9;
        command.joint_velocity_ref_rad_s[3] = 2.0;
        command.closed_hands = 0b11;
        for missed in 1..=missed {
            let next = coast.after(&command, &before, missed);
            (before, command) = (command.joint_velocity_ref_rad_s, next);
        }
        assert_eq!((command.joint_position_ref_rad[0], command.closed_hands), (0.0, 0b11));
        (command.joint_position_ref_rad[3], command.joint_velocity_ref_rad_s[3])
    }

    #[test]
    fn drives_go_on_for_a_moment_as_they_were_about_to() {
        let (travel, rate) = travel(2);
        assert!((travel - 0.005 * (2.05 + 2.075)).abs() < 1e-12 && (rate - 2.075).abs() < 1e-12);
    }

    #[test]
    fn drives_come_to_rest_after_the_length_of_their_time_constant() {
        let (travel, rate) = travel(200);
        // Four ticks, and the sum of a geometric series.
        let decay = (-0.005_f64 / REST_S).exp();
        let at_four = 2.0 + 0.1 * (1.0 - 0.5_f64.powi(4));
        let expected = 0.005 * (2.05 + 2.075 + 2.0875 + at_four + at_four * decay / (1.0 - decay));
        assert!((travel - expected).abs() < 1e-9 && (0.07..0.08).contains(&travel), "{travel}");
        assert!(rate < 1e-9);
    }
}
