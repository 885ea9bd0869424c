//! Which arms a team has, in hand order, and what groups of them are called.

use core::ops::Range;
use std::collections::BTreeSet;

/// The grasping arms of one robot.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RobotArms {
    /// The robot's name, unique in the team.
    pub robot: String,
    /// The names of its grasping hands, unique in the robot, in order.
    pub hands: Vec<String>,
}

/// The grasping arms of a team in hand order.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TeamArms {
    robots: Vec<RobotArms>,
}

/// Why a list of robots is not a team.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[allow(missing_docs)]
pub enum BuildTeamArmsError {
    #[error("a team needs at least two grasping arms; this one has {0}")]
    TooFewArms(usize),
    #[error("robot `{0}` has no grasping arm")]
    RobotWithoutArm(String),
    #[error("two robots are called `{0}`")]
    DuplicateRobot(String),
    #[error("robot `{robot}` has two hands called `{hand}`")]
    DuplicateHand { robot: String, hand: String },
}

impl TeamArms {
    /// A team of at least two arms, with unique names and no robot that doesn't grasp.
    pub fn new(robots: Vec<RobotArms>) -> Result<Self, BuildTeamArmsError> {
        let mut names = BTreeSet::new();
        for RobotArms { robot, hands } in &robots {
            if hands.is_empty() {
                return Err(BuildTeamArmsError::RobotWithoutArm(robot.clone()));
            }
            if !names.insert(robot) {
                return Err(BuildTeamArmsError::DuplicateRobot(robot.clone()));
            }
            let mut hand_names = BTreeSet::new();
            if let Some(hand) = hands.iter().find(|hand| !hand_names.insert(*hand)) {
                return Err(BuildTeamArmsError::DuplicateHand { robot: robot.clone(), hand: hand.clone() });
            }
        }
        let team = Self { robots };
        match team.arms() {
            arms @ 0..2 => Err(BuildTeamArmsError::TooFewArms(arms)),
            _ => Ok(team),
        }
    }

    /// Robots A, B, C, … (R27, R28, … after Z) with hands right, left, arm3, …
    pub fn numbered(arms_per_robot: &[usize]) -> Result<Self, BuildTeamArmsError> {
        let robot_name = |index: usize| match u8::try_from(index) {
            Ok(letter @ 0..26) => char::from(b'A' + letter).to_string(),
            _ => format!("R{}", index + 1),
        };
        let hand_name = |index| match index {
            0 => "right".to_owned(),
            1 => "left".to_owned(),
            _ => format!("arm{}", index + 1),
        };
        let robot = |(index, &arms): (usize, &usize)| RobotArms {
            robot: robot_name(index),
            hands: (0..arms).map(hand_name).collect(),
        };
        Self::new(arms_per_robot.iter().enumerate().map(robot).collect())
    }

    /// The robots in order.
    pub fn robots(&self) -> &[RobotArms] {
        &self.robots
    }

    /// Number n of arms.
    pub fn arms(&self) -> usize {
        self.robots.iter().map(|robot| robot.hands.len()).sum()
    }

    /// The arms of each robot as ranges of hand order.
    pub(crate) fn arms_by_robot(&self) -> Vec<Range<usize>> {
        let mut start = 0;
        let mut next = |robot: &RobotArms| {
            let range = start..start + robot.hands.len();
            start = range.end;
            range
        };
        self.robots.iter().map(&mut next).collect()
    }

    /// What a group of robots is called: `A`, `AB`, `ABCD`, `A..H`; with longer names `ann+bob`,
    /// `ann..eve`. Its length doesn't grow with the group.
    pub(crate) fn name_of_robots(&self, group: Range<usize>) -> String {
        let names: Vec<&str> = self.robots[group].iter().map(|robot| robot.robot.as_str()).collect();
        let are_letters = names.iter().all(|name| name.chars().count() == 1);
        if are_letters && names.len() <= 4 { names.concat() } else { name_of_group(&names) }
    }

    /// What a group of hands of one robot is called: `A.right`, `A.right+left`, `A.arm1..arm4`.
    pub(crate) fn name_of_hands(&self, robot: usize, group: Range<usize>) -> String {
        let RobotArms { robot, hands } = &self.robots[robot];
        let names: Vec<&str> = hands[group].iter().map(String::as_str).collect();
        format!("{robot}.{}", name_of_group(&names))
    }
}

fn name_of_group(names: &[&str]) -> String {
    match names {
        [] => String::new(),
        [only] => (*only).to_owned(),
        [first, second] => format!("{first}+{second}"),
        [first, .., last] => format!("{first}..{last}"),
    }
}
