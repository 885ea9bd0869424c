//! Six-vectors: twists and wrenches, in the axes of one coordinate frame.

use crate::{CoordinateFrame, Pose, finite::are_finite};
use core::marker::PhantomData;
use core::ops::{Add, AddAssign, Mul, Neg, Sub};
use nalgebra::{Vector3, Vector6};
use serde::{Deserialize, Serialize};

macro_rules! six_vector {
    ($(#[$meta:meta])* $name:ident { $(#[$first_meta:meta])* $first:ident, $(#[$second_meta:meta])* $second:ident }) => {
        $(#[$meta])*
        #[derive(Debug, Serialize, Deserialize)]
        #[serde(bound = "")]
        pub struct $name<F: CoordinateFrame> {
            $(#[$first_meta])*
            pub $first: Vector3<f64>,
            $(#[$second_meta])*
            pub $second: Vector3<f64>,
            #[serde(skip)]
            axes: PhantomData<F>,
        }

        impl<F: CoordinateFrame> Clone for $name<F> {
            fn clone(&self) -> Self { *self }
        }
        impl<F: CoordinateFrame> Copy for $name<F> {}
        impl<F: CoordinateFrame> PartialEq for $name<F> {
            fn eq(&self, other: &Self) -> bool {
                self.$first == other.$first && self.$second == other.$second
            }
        }
        impl<F: CoordinateFrame> Default for $name<F> {
            fn default() -> Self { Self::zero() }
        }

        impl<F: CoordinateFrame> $name<F> {
            /// From its parts.
            pub fn new($first: Vector3<f64>, $second: Vector3<f64>) -> Self {
                Self { $first, $second, axes: PhantomData }
            }
            /// All zero.
            pub fn zero() -> Self { Self::new(Vector3::zeros(), Vector3::zeros()) }
            /// Stacked in the paper's order.
            pub fn to_vector(&self) -> Vector6<f64> {
                let (a, b) = (&self.$first, &self.$second);
                Vector6::new(a.x, a.y, a.z, b.x, b.y, b.z)
            }
            /// From the paper's order.
            pub fn from_vector(v: &Vector6<f64>) -> Self {
                Self::new(v.fixed_rows::<3>(0).into(), v.fixed_rows::<3>(3).into())
            }
            /// In the paper's order.
            pub fn to_array(&self) -> [f64; 6] { self.to_vector().into() }
            /// From the paper's order.
            pub fn from_array(array: &[f64; 6]) -> Self { Self::from_vector(&Vector6::from(*array)) }
            /// In axes of `E`; the reference point stays.
            pub fn expressed_in<E: CoordinateFrame>(&self, X_EF: &Pose<E, F>) -> $name<E> {
                $name::new(X_EF.rotation * self.$first, X_EF.rotation * self.$second)
            }
            /// Whether every component is finite.
            pub fn is_finite(&self) -> bool {
                are_finite(&self.$first) & are_finite(&self.$second)
            }
        }

        impl<F: CoordinateFrame> Add for $name<F> {
            type Output = Self;
            fn add(self, other: Self) -> Self {
                Self::new(self.$first + other.$first, self.$second + other.$second)
            }
        }
        impl<F: CoordinateFrame> AddAssign for $name<F> {
            fn add_assign(&mut self, other: Self) { *self = *self + other; }
        }
        impl<F: CoordinateFrame> Sub for $name<F> {
            type Output = Self;
            fn sub(self, other: Self) -> Self {
                Self::new(self.$first - other.$first, self.$second - other.$second)
            }
        }
        impl<F: CoordinateFrame> Neg for $name<F> {
            type Output = Self;
            fn neg(self) -> Self { Self::new(-self.$first, -self.$second) }
        }
        impl<F: CoordinateFrame> Mul<f64> for $name<F> {
            type Output = Self;
            fn mul(self, scale: f64) -> Self { Self::new(self.$first * scale, self.$second * scale) }
        }
    };
}

six_vector! {
    /// A wrench in axes of `F`: force \[N\] before moment \[Nm\], as in the paper's eq. 1.
    Wrench {
        /// Force \[N\].
        force,
        /// Moment about the reference point \[Nm\].
        moment
    }
}

six_vector! {
    /// A twist in axes of `F`, or a small displacement: linear \[m/s or m\] before angular \[rad/s or
    /// rad\].
    Twist {
        /// Velocity of the reference point, or its displacement.
        linear,
        /// Angular velocity, or rotation vector.
        angular
    }
}

impl<F: CoordinateFrame> Wrench<F> {
    /// The same wrench at another reference point (eq. A1): with `offset` = `p_BH_F` from the new
    /// point B to the old one H, `f` stays and `n_B = n_H + p_BH × f`.
    ///
    /// The paper's A1 writes `n_b = n_h − l × f` with the virtual stick l = `p_HB` = −`offset`.
    pub fn shifted(&self, offset: &Vector3<f64>) -> Self {
        Self::new(self.force, self.moment + offset.cross(&self.force))
    }

    /// Power \[W\] of this wrench on a body that moves with `twist` at the same reference point; work \[J\]
    /// for a small displacement.
    pub fn power(&self, twist: &Twist<F>) -> f64 {
        self.force.dot(&twist.linear) + self.moment.dot(&twist.angular)
    }
}

impl<F: CoordinateFrame> Twist<F> {
    /// The twist of the same rigid body at another point: with `offset` = `p_HB_F` from the old point
    /// H to the new one B, `v_B = v_H + ω × p_HB`.
    pub fn shifted(&self, offset: &Vector3<f64>) -> Self {
        Self::new(self.linear + self.angular.cross(offset), self.angular)
    }
}
