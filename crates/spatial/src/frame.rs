//! Marker types of coordinate frames.

use core::fmt::Debug;

/// A coordinate frame. Crates may define their own markers.
pub trait CoordinateFrame: Copy + Debug + Send + Sync + 'static {}

macro_rules! frames {
    ($($(#[$meta:meta])* $name:ident),* $(,)?) => { $(
        $(#[$meta])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name {}
        impl CoordinateFrame for $name {}
    )* };
}

frames! {
    /// Σo: the common frame of the team, z up.
    World,
    /// Where one robot's own odometry has Σo.
    Odometry,
    /// Σa: fixed to the carried object, origin at its reference point.
    Object,
    /// Σh: fixed to a grasping hand.
    Hand,
    /// Σb: the tip of a virtual stick, fixed to its hand; it coincides with Σa at the grasp.
    Tip,
    /// Fixed to a robot's root link.
    Base,
    /// Fixed to a sole.
    Foot,
    /// Fixed to a sensor.
    Sensor,
}
