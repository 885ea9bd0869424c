//! What is carried, and who bears how much of it.

mod identify;
mod share;

pub use identify::{CarriedBody, LoadIdentifier, LoadIdentifierState};
pub use share::{Bearer, largest_moment_of_equal_tips_nm, share_load};
