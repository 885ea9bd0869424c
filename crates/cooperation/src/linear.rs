//! What the coefficient matrices act on.

use core::ops::{Add, Mul, Sub};

/// An element of a vector space over `f64`: a scalar, a wrench, a twist. Its default is zero.
///
/// The blocks of W, C and U are scalar multiples of I₆, so one scalar matrix acts on any of these.
pub trait Linear: Copy + Default + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {}

impl<T> Linear for T where T: Copy + Default + Add<Output = T> + Sub<Output = T> + Mul<f64, Output = T> {}
