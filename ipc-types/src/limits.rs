//! How large a team and its robots may be on the wire.
//!
//! The mathematics has no such limits: `mikoshi-cooperation` is used with 1000 robots.

/// Robots in one team.
pub const MAX_ROBOTS: usize = 16;
/// Grasping hands of one robot.
pub const MAX_HANDS: usize = 4;
/// Actuated joints of one robot.
pub const MAX_JOINTS: usize = 64;
/// Feet of one robot.
pub const MAX_FEET: usize = 2;
/// Age in ticks of the oldest team command that a servo may use: it bounds the queues. A loop with more
/// delay has no usable gain left.
pub const MAX_COORDINATION_DELAY_TICKS: u64 = 16;
/// Parts of a robot's plan for the case that its servo is lost; one rides with each joint command. The last but
/// one is where it ends, and the last what changes there if the loss comes this many ticks later.
pub const FALLBACK_PARTS: usize = 24;
/// Grasping hands of one team.
pub const MAX_HANDS_OF_TEAM: usize = MAX_ROBOTS * MAX_HANDS;
