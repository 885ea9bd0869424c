//! What drives are told in a tick.

use crate::{BuildWorldError, StepWorldError};
use mikoshi_config::Scenario;
use mikoshi_ipc_types::JointCommand;

/// The position that a drive of stiffness `kp` and damping `kv` is to be at, `share` of the way from one command to the
/// next. Rates feed its damping forward: `(1 − s) q₀ + s q₁ + q̇₁ kv / kp`.
pub fn drive_reference(
    (from, to): (&JointCommand, &JointCommand),
    joint: usize,
    share: f64,
    (kp, kv): (f64, f64),
) -> f64 {
    let (start, end) = (from.joint_position_ref_rad[joint], to.joint_position_ref_rad[joint]);
    let feed_forward = if kp > 0.0 { kv / kp * to.joint_velocity_ref_rad_s[joint] } else { 0.0 };
    start + share * (end - start) + feed_forward
}

/// How many steps of physics drives take to a new command.
///
/// # Errors
/// A step does not divide a tick.
pub fn steps_in_a_tick(scenario: &Scenario) -> Result<u64, BuildWorldError> {
    let (steps, step_s, period_s) = (scenario.substeps(), scenario.physics.step_s, scenario.control_period_s);
    if steps == 0 || (steps as f64 * step_s - period_s).abs() > 1e-9 {
        return Err(BuildWorldError::Inconsistent {
            place: "[physics]".to_owned(),
            what: format!("step_s = {step_s} does not divide control_period_s = {period_s}"),
        });
    }
    Ok(steps)
}

/// Whether so many robots can follow these.
///
/// # Errors
/// [`StepWorldError::CommandCount`], [`StepWorldError::NotFinite`].
pub fn check_commands(commands: &[JointCommand], robots: usize) -> Result<(), StepWorldError> {
    if commands.len() != robots {
        return Err(StepWorldError::CommandCount);
    }
    let mut values =
        commands.iter().flat_map(|c| c.joint_position_ref_rad.iter().chain(&c.joint_velocity_ref_rad_s));
    if values.all(|value| value.is_finite()) { Ok(()) } else { Err(StepWorldError::NotFinite) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    fn command(position_rad: f64, rate_rad_s: f64) -> JointCommand {
        let mut command = JointCommand::zeroed();
        (command.joint_position_ref_rad[1], command.joint_velocity_ref_rad_s[1]) = (position_rad, rate_rad_s);
        command
    }

    #[test]
    fn references_run_to_the_new_command_and_lead_by_what_damping_holds_back() {
        let (from, to) = (command(1.0, 7.0), command(2.0, 4.0));
        let reference = |share, gains| drive_reference((&from, &to), 1, share, gains);
        assert_eq!(reference(0.25, (100.0, 10.0)), 1.25 + 0.4);
        assert_eq!(reference(1.0, (100.0, 0.0)), 2.0);
        // A drive that can't hold a position follows none.
        assert_eq!(reference(1.0, (0.0, 10.0)), 2.0);
    }

    #[test]
    fn what_no_drive_can_follow_is_refused() {
        let good = command(1.0, 0.0);
        assert_eq!(check_commands(&[good, good], 2), Ok(()));
        assert_eq!(check_commands(&[good], 2), Err(StepWorldError::CommandCount));
        for bad in [command(f64::NAN, 0.0), command(0.0, f64::INFINITY)] {
            assert_eq!(check_commands(&[good, bad], 2), Err(StepWorldError::NotFinite));
        }
    }
}
