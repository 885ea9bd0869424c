//! What types can't say: ranges, units that must fit each other, names that must agree.

mod checks;
mod hosts;
mod membership;
mod operator;
mod robot;
mod scenario;
mod survey;
mod sweep;

pub(crate) use checks::Violation;
pub(crate) use robot::robot;
pub(crate) use scenario::{grasping_hands, scenario};
pub(crate) use survey::survey;
pub(crate) use sweep::sweep;
