//! What can be wrong with a robot's description.

use thiserror::Error;

/// A URDF that is not a robot this crate can move: what, where, and what was expected.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum LoadModelError {
    /// The text is not XML, or not URDF.
    #[error("malformed URDF: {place}: {reason}")]
    Malformed {
        /// Line and element, as far as they are known.
        place: String,
        /// What is wrong with it.
        reason: String,
    },
    /// Two elements share a name.
    #[error("{element} '{name}' is described twice; names must be unique")]
    DuplicateName {
        /// `link` or `joint`.
        element: &'static str,
        /// The name.
        name: String,
    },
    /// A joint refers to a link that is not described.
    #[error("joint '{joint}' refers to link '{link}', which is not described")]
    UnknownLink {
        /// The joint.
        joint: String,
        /// The link.
        link: String,
    },
    /// A link hangs on two joints.
    #[error("link '{link}' is the child of joints '{first}' and '{second}'; a tree was expected")]
    SecondParent {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other.
        second: String,
    },
    /// Every link is the child of another, or there is no link.
    #[error("no link is without a parent; one root was expected")]
    NoRoot,
    /// More than one link is without a parent.
    #[error("links '{first}' and '{second}' are both without a parent; one root was expected")]
    SecondRoot {
        /// One root.
        first: String,
        /// The other.
        second: String,
    },
    /// A link cannot be reached from the root.
    #[error("link '{link}' is part of a loop; a tree was expected")]
    Loop {
        /// The link.
        link: String,
    },
    /// The joint's type has no place in the control of this crate.
    #[error(
        "joint '{joint}' is of type {kind}; expected revolute, continuous, prismatic or fixed (the root floats by itself)"
    )]
    UnsupportedJoint {
        /// The joint.
        joint: String,
        /// Its type.
        kind: String,
    },
    /// The joint mimics another.
    #[error(
        "joint '{joint}' mimics '{mimicked}'; expected independent joints: fix it, or drive it by itself"
    )]
    MimicJoint {
        /// The joint.
        joint: String,
        /// What it mimics.
        mimicked: String,
    },
    /// More joints than a robot may have.
    #[error("{count} moving joints; expected at most {limit}")]
    TooManyJoints {
        /// Moving joints of the description.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// A joint's limits are absent or contradict each other.
    #[error("joint '{joint}': {what}")]
    InvalidLimits {
        /// The joint.
        joint: String,
        /// What was found, and what was expected.
        what: String,
    },
    /// A joint's axis has no direction.
    #[error("joint '{joint}' has axis ({}, {}, {}); expected a vector of length 1", axis[0], axis[1], axis[2])]
    InvalidAxis {
        /// The joint.
        joint: String,
        /// The axis.
        axis: [f64; 3],
    },
    /// A number is NaN or infinite.
    #[error("{place} holds {value}; expected a finite number")]
    NotFinite {
        /// Element and attribute.
        place: String,
        /// NaN or an infinity.
        value: f64,
    },
    /// A mass or an inertia that no body can have.
    #[error("link '{link}': {what}")]
    InvalidInertial {
        /// The link.
        link: String,
        /// What was found, and what was expected.
        what: String,
    },
    /// A shape that has no size.
    #[error("link '{link}' has a {shape} of size {size}; expected a positive size")]
    InvalidShape {
        /// The link.
        link: String,
        /// Kind of the shape.
        shape: &'static str,
        /// The size that is not positive.
        size: f64,
    },
    /// A mesh that is not there.
    #[error(
        "link '{link}' needs mesh '{uri}', which was not found; is its package in the robot's table of packages?"
    )]
    MissingMesh {
        /// The link.
        link: String,
        /// The mesh, as the description names it.
        uri: String,
    },
}

/// A name that the model does not have.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("robot '{robot}' has no {element} '{name}'; it has {known}")]
pub struct FindElementError {
    /// The robot.
    pub robot: String,
    /// `link` or `joint`.
    pub element: &'static str,
    /// What was asked for.
    pub name: String,
    /// All names, separated by commas.
    pub known: String,
}
