//! Which hands hold the object: a hand closes where its palm is near its place, and opens when it is told to. It is pulled to
//! its place where the object rests. Of an object that hangs in other robots' hands it takes hold where it is, near where it
//! held before.

use mikoshi_ipc_types::{JointCommand, MAX_HANDS};
use mikoshi_spatial::{CoordinateFrame, Hand, Pose};

/// How near its place on the object a palm must be for its hand to close on it.
const REACH_M: f64 = 0.02;
/// The same about an axis.
const REACH_RAD: f64 = 0.1;

/// What a hand is to do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// To let go.
    Open,
    /// To take hold, if it is in reach of its place.
    Close,
    /// To take hold where it is of what others hold, if it is in reach of where it held before.
    CloseBesideOthers,
}

/// Closes and opens hands as commanded; bit h of `holding` says for each robot whether hand h holds. `change` is asked
/// for each robot and hand that is to change, and returns whether it does.
pub fn close_and_open(
    holding: &mut [u64],
    commands: &[JointCommand],
    mut change: impl FnMut(usize, usize, Grip) -> bool,
) {
    let held = holding.iter().enumerate();
    let holders = held.fold(0_u64, |set, (robot, holding)| set | u64::from(*holding != 0) << robot);
    for (robot, (holding, command)) in holding.iter_mut().zip(commands).enumerate() {
        let close = if holders & !(1 << robot) == 0 { Grip::Close } else { Grip::CloseBesideOthers };
        for hand in 0..MAX_HANDS {
            let bit = 1 << hand;
            let (holds, shall_hold) = (*holding & bit != 0, command.closed_hands & bit != 0);
            if holds != shall_hold && change(robot, hand, if shall_hold { close } else { Grip::Open }) {
                *holding ^= bit;
            }
        }
    }
}

/// Whether a hand can close: its palm is near its place, both seen from the same frame.
pub fn is_in_reach<F: CoordinateFrame>(place: &Pose<F, Hand>, palm: &Pose<F, Hand>) -> bool {
    let gap = place.displacement_to(palm);
    gap.linear.norm() <= REACH_M && gap.angular.norm() <= REACH_RAD
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use mikoshi_spatial::{Twist, World};
    use nalgebra::Vector3;

    fn command(closed_hands: u64) -> JointCommand {
        JointCommand { closed_hands, ..JointCommand::zeroed() }
    }

    #[test]
    fn hands_change_that_are_told_to_and_can() {
        let mut holding = [0b01, 0b11, 0];
        let commands = [command(0b10), command(0b11), command(0b11)];
        let mut asked = vec![];
        close_and_open(&mut holding, &commands, |robot, hand, grip| {
            asked.push((robot, hand, grip));
            (robot, hand) != (2, 0)
        });
        let beside = Grip::CloseBesideOthers;
        assert_eq!(asked, [(0, 0, Grip::Open), (0, 1, beside), (2, 0, beside), (2, 1, beside)]);
        assert_eq!(holding, [0b10, 0b11, 0b10]);
    }

    #[test]
    fn who_comes_first_takes_hold_at_its_place() {
        let mut holding = [0, 0];
        let mut asked = vec![];
        close_and_open(&mut holding, &[command(0b1), command(0b1)], |robot, _, grip| {
            asked.push((robot, grip));
            true
        });
        // Both at once: nobody held before.
        assert_eq!(asked, [(0, Grip::Close), (1, Grip::Close)]);
    }

    #[test]
    fn a_palm_reaches_two_centimetres_and_a_tenth_of_a_radian() {
        let place = Pose::<World, Hand>::identity();
        let reaches = |linear: Vector3<f64>, angular: Vector3<f64>| {
            is_in_reach(&place, &place.displaced(&Twist::new(linear, angular)))
        };
        let none = Vector3::zeros();
        assert!(reaches(Vector3::x() * 0.019, Vector3::y() * 0.099));
        assert!(!reaches(Vector3::x() * 0.021, none) && !reaches(none, Vector3::y() * 0.101));
    }
}
