//! The two sides of a robot, and one value for each.

use core::ops::{Index, IndexMut};
use serde::{Deserialize, Serialize};

/// A side of one robot, seen by itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum Side {
    /// Right: negative y of the robot.
    Right,
    /// Left: positive y of the robot.
    Left,
}

impl Side {
    /// Both, in the order in which feet travel on the wire.
    pub const BOTH: [Self; 2] = [Self::Right, Self::Left];

    /// The other one.
    pub fn opposite(self) -> Self {
        match self {
            Self::Right => Self::Left,
            Self::Left => Self::Right,
        }
    }

    /// The opposite one if `mirrored`: a team swings on one side of the world, and a robot that faces
    /// back calls it by the other name.
    pub fn mirrored(self, mirrored: bool) -> Self {
        if mirrored { self.opposite() } else { self }
    }

    /// +1 for left, −1 for right: where this side's y points.
    pub fn sign(self) -> f64 {
        match self {
            Self::Right => -1.0,
            Self::Left => 1.0,
        }
    }
}

/// A value for each foot.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PerFoot<T> {
    /// Of the right foot.
    pub right: T,
    /// Of the left foot.
    pub left: T,
}

impl<T> PerFoot<T> {
    /// One value per side.
    pub fn from_fn(mut value: impl FnMut(Side) -> T) -> Self {
        Self { right: value(Side::Right), left: value(Side::Left) }
    }

    /// In the order of the wire.
    pub fn into_array(self) -> [T; 2] {
        [self.right, self.left]
    }
}

impl<T> Index<Side> for PerFoot<T> {
    type Output = T;
    fn index(&self, side: Side) -> &T {
        match side {
            Side::Right => &self.right,
            Side::Left => &self.left,
        }
    }
}

impl<T> IndexMut<Side> for PerFoot<T> {
    fn index_mut(&mut self, side: Side) -> &mut T {
        match side {
            Side::Right => &mut self.right,
            Side::Left => &mut self.left,
        }
    }
}
