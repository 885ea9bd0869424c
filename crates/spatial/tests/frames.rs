//! Mixing frames does not compile, for the reason we mean: the trait isn't implemented.
//!
//! (The examples in the crate's documentation show what the compiler rejects; these say why.)

#![allow(non_snake_case)]

use core::ops::{Add, AddAssign, Mul, Sub};
use mikoshi_spatial::{Hand, Object, Pose, Tip, Twist, World, Wrench};

/// Fails to compile, by ambiguity, if the type implements the trait.
macro_rules! assert_not_implemented {
    ($type:ty: $trait:path) => {{
        trait AmbiguousIfImplemented<A> {
            fn is_not_implemented() {}
        }
        impl<T: ?Sized> AmbiguousIfImplemented<()> for T {}
        #[allow(dead_code)]
        struct Implemented;
        impl<T: ?Sized + $trait> AmbiguousIfImplemented<Implemented> for T {}
        <$type as AmbiguousIfImplemented<_>>::is_not_implemented();
    }};
}

#[test]
fn poses_compose_only_over_a_common_frame() {
    assert_not_implemented!(Pose<World, Hand>: Mul<Pose<World, Hand>>);
    assert_not_implemented!(Pose<World, Hand>: Mul<Pose<Object, Tip>>);
    let X_WB: Pose<World, Tip> = Pose::<World, Hand>::identity() * Pose::<Hand, Tip>::identity();
    assert_eq!(X_WB, Pose::identity());
}

#[test]
fn vectors_add_up_only_in_common_axes() {
    assert_not_implemented!(Wrench<World>: Add<Wrench<Object>>);
    assert_not_implemented!(Wrench<World>: AddAssign<Wrench<Object>>);
    assert_not_implemented!(Wrench<World>: Sub<Wrench<Object>>);
    assert_not_implemented!(Twist<World>: Add<Twist<Object>>);
    assert_not_implemented!(Wrench<World>: Add<Twist<World>>);
    assert_eq!(Wrench::<World>::zero() + Wrench::zero(), Wrench::zero());
}
