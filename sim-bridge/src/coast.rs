//! What drives do that hear nothing: they coast to rest.

use mikoshi_ipc_types::JointCommand;

/// Time constant with which drives come to rest.
const REST_S: f64 = 0.02;

/// How a command goes on that no other follows. For a tick or two it is as if nothing had happened; after a few
/// more the drives hold.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coast {
    period_s: f64,
    /// What a tick leaves of a rate.
    decay: f64,
}

impl Coast {
    /// At this control period.
    pub(crate) fn of_period(period_s: f64) -> Self {
        Self { period_s, decay: (-period_s / REST_S).exp() }
    }

    /// The command one tick after this one: q ← q + T·q̇, q̇ ← q̇·e^(−T/τ).
    pub(crate) fn after(&self, last: &JointCommand) -> JointCommand {
        let mut next = *last;
        for (position, rate) in next.joint_position_ref_rad.iter_mut().zip(&mut next.joint_velocity_ref_rad_s) {
            *rate *= self.decay;
            *position += *rate * self.period_s;
        }
        next
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn drives_come_to_rest_after_the_length_of_their_time_constant() {
        let coast = Coast::of_period(0.005);
        let mut command = JointCommand::zeroed();
        command.joint_position_ref_rad[3] = 0.5;
        command.joint_velocity_ref_rad_s[3] = 2.0;
        command.closed_hands = 0b11;
        for _ in 0..200 {
            command = coast.after(&command);
        }
        let travel = command.joint_position_ref_rad[3] - 0.5;
        // The sum of a geometric series.
        let expected = 2.0 * 0.005 * coast.decay / (1.0 - coast.decay);
        assert!((travel - expected).abs() < 1e-9 && (0.03..0.04).contains(&travel), "{travel}");
        assert!(command.joint_velocity_ref_rad_s[3] < 1e-9);
        assert_eq!((command.joint_position_ref_rad[0], command.closed_hands), (0.0, 0b11));
    }
}
