//! The paper's generalized vectors, typed by the axes they are in.

use mikoshi_spatial::{Object, Pose, Twist, World, Wrench};

/// A generalized vector: row 0 belongs to the object, in world axes; the n − 1 rows after it belong to
/// the internal forces, in the object's axes (eqs. 28 to 30).
#[derive(Clone, Debug, PartialEq)]
pub struct Generalized<E, I> {
    /// Row 0.
    pub external: E,
    /// Rows 1 to n − 1, in the order of [`InternalForces`](crate::InternalForces).
    pub internal: Vec<I>,
}

/// h (eq. 28): the wrench of all hands on the object, and the internal wrenches.
pub type GeneralizedForce = Generalized<Wrench<World>, Wrench<Object>>;

/// z (eq. 29): the object's pose, and the relative positions that are dual to the internal wrenches.
///
/// Deviation from eqs. 25 to 29, which average and rotate Euler angles as if they were vectors:
/// attitudes are rotation vectors about the current mean attitude.
pub type GeneralizedPosition = Generalized<Pose<World, Object>, Twist<Object>>;

/// u (eq. 30): the rates of z.
pub type GeneralizedVelocity = Generalized<Twist<World>, Twist<Object>>;

impl GeneralizedForce {
    /// No force anywhere, for n `arms`.
    pub fn zero(arms: usize) -> Self {
        Self { external: Wrench::zero(), internal: vec![Wrench::zero(); arms.saturating_sub(1)] }
    }
}

impl GeneralizedPosition {
    /// The object at `X_WA` with all tips coincident, as at the grasp, for n `arms`.
    pub fn at_grasp(X_WA: Pose<World, Object>, arms: usize) -> Self {
        Self { external: X_WA, internal: vec![Twist::zero(); arms.saturating_sub(1)] }
    }
}

impl GeneralizedVelocity {
    /// At rest, for n `arms`.
    pub fn zero(arms: usize) -> Self {
        Self { external: Twist::zero(), internal: vec![Twist::zero(); arms.saturating_sub(1)] }
    }
}
