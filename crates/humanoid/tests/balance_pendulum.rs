//! The pendulum with a load in its hands against Newton and Euler, and the distribution to the feet
//! against its sum.

use mikoshi_humanoid::balance::{
    ExternalLoad, GRAVITY_M_S2, Pendulum, PerFoot, Side, distribute, nearest_in_polygon,
};
use mikoshi_humanoid::estimate::{SupportPolygon, zero_moment_point};
use mikoshi_humanoid::gait::GroundPose;
use mikoshi_spatial::{World, Wrench};
use nalgebra::{Vector2, Vector3};
use proptest::prelude::*;

mod team;
use team::soles;

const ROBOT: Pendulum = Pendulum { mass_kg: 56.0, com_height_m: 0.79 };
const GROUND: f64 = 0.12;

fn any_vector(scale: f64) -> impl Strategy<Value = Vector3<f64>> {
    [-scale..scale, -scale..scale, -scale..scale].prop_map(|[x, y, z]| Vector3::new(x, y, z))
}

fn any_hand() -> impl Strategy<Value = (Vector3<f64>, Wrench<World>)> {
    (any_vector(0.5), any_vector(60.0), any_vector(20.0))
        .prop_map(|(point, force, moment)| (point + Vector3::new(2.0, -1.0, 0.9), Wrench::new(force, moment)))
}

fn rest_points() -> PerFoot<Vector2<f64>> {
    PerFoot { right: Vector2::new(0.015, 0.0), left: Vector2::new(0.015, 0.0) }
}

proptest! {
    #[test]
    fn the_ground_s_wrench_by_newton_and_euler_has_its_zmp_where_the_load_says(
        hands in proptest::collection::vec(any_hand(), 1..4),
        com in any_vector(0.3), acceleration in any_vector(2.0),
    ) {
        let com = Vector3::new(2.0 + com.x, -1.0 + com.y, GROUND + ROBOT.com_height_m);
        let acceleration = Vector3::new(acceleration.x, acceleration.y, 0.0);
        // Sum of forces m a, sum of moments about the centre of mass zero.
        let weight = Vector3::new(0.0, 0.0, -ROBOT.weight_n());
        let mut force = acceleration * ROBOT.mass_kg - weight;
        let mut moment_about_com = Vector3::zeros();
        for (point, wrench) in &hands {
            force += wrench.force;
            moment_about_com += wrench.moment + (point - com).cross(&wrench.force);
        }
        let about_origin = moment_about_com + com.cross(&force);
        prop_assume!(force.z > 0.3 * ROBOT.weight_n());
        let zmp = zero_moment_point(&Wrench::new(force, about_origin), GROUND, 1.0).expect("it stands");

        let load = ExternalLoad::of_hands(&ROBOT, GROUND, hands.iter().copied());
        let extended = ROBOT.extended_zmp(&com.xy(), &acceleration.xy());
        prop_assert!((load.ground_zmp(&extended) - zmp).norm() < 1e-9);
        prop_assert!((load.extended_zmp(&zmp) - extended).norm() < 1e-9);
    }

    #[test]
    fn the_feet_s_loads_add_up_to_the_zmp_anywhere_in_their_hull(
        x in -0.25..0.25, y in 0.15..0.3, yaw in -0.3..0.3, u in 0.0..1.0, v in 0.0..1.0,
    ) {
        let standing = PerFoot {
            right: Some(GroundPose::new(1.0, 2.0, 0.4).at_height(0.0)),
            left: Some(GroundPose::new(1.0, 2.0, 0.4).then(&GroundPose::new(x, y, yaw)).at_height(0.0)),
        };
        let hull = SupportPolygon::of_feet(&soles(), &standing);
        let (low, high) = hull.vertices().iter().fold(
            (Vector2::repeat(f64::MAX), Vector2::repeat(f64::MIN)),
            |(low, high), vertex| (low.inf(vertex), high.sup(vertex)),
        );
        let zmp = low + (high - low).component_mul(&Vector2::new(u, v));
        prop_assume!(hull.signed_distance(&zmp) > 0.0);
        let loads = distribute(500.0, &zmp, &soles(), &rest_points(), &standing);
        prop_assert!((loads.right.force + loads.left.force - 500.0).abs() < 1e-9);
        let sum = (loads.right.zmp * loads.right.force + loads.left.zmp * loads.left.force) / 500.0;
        let tolerance = if hull.signed_distance(&zmp) > 0.02 { 1e-3 } else { 5e-3 };
        prop_assert!((sum - zmp).norm() < tolerance, "{} off", (sum - zmp).norm());
        for side in Side::BOTH {
            prop_assert!(loads[side].force >= 0.0);
            let alone = PerFoot::from_fn(|other| standing[other].filter(|_| other == side));
            prop_assert!(SupportPolygon::of_feet(&soles(), &alone).signed_distance(&loads[side].zmp) > -1e-9);
        }
    }

    #[test]
    fn no_point_of_the_support_is_nearer_than_the_nearest(px in -1.0..1.0, py in -1.0..1.0, s in 0.0..1.0) {
        let standing = PerFoot { right: Some(GroundPose::new(0.0, -0.1, 0.1).at_height(0.0)), left: Some(GroundPose::new(0.2, 0.1, 0.0).at_height(0.0)) };
        let hull = SupportPolygon::of_feet(&soles(), &standing);
        let point = Vector2::new(px, py);
        let nearest = nearest_in_polygon(&hull, &point).expect("two feet stand");
        prop_assert!((hull.signed_distance(&point).min(0.0).abs() - (nearest - point).norm()).abs() < 1e-9);
        for (a, b) in hull.vertices().iter().zip(hull.vertices().iter().cycle().skip(1)) {
            let other: Vector2<f64> = a + (b - a) * s;
            prop_assert!((nearest - point).norm() <= (other - point).norm() + 1e-12);
        }
    }
}

#[test]
fn a_load_carried_about_stays_the_same_load() {
    let hands = |at: f64| {
        [-0.2, 0.2].map(|y| {
            (
                Vector3::new(at + 0.35, y, 0.96),
                Wrench::new(Vector3::new(3.0, 0.0, 10.0), Vector3::new(0.0, 1.0, 0.0)),
            )
        })
    };
    let here = ExternalLoad::of_hands(&ROBOT, 0.0, hands(0.0).into_iter());
    let there = ExternalLoad::of_hands(&ROBOT, 0.0, hands(25.0).into_iter());
    assert!((here.shift - there.shift).norm() < 1e-12 && here.kappa == there.kappa);
    let filtered = here.filtered_towards(&there, 0.1);
    assert!((filtered.about - there.about).norm() == 0.0);
}

#[test]
fn a_robot_that_lifts_a_weight_bears_it() {
    let lifts = (Vector3::new(0.35, 0.0, 0.96), Wrench::new(Vector3::new(0.0, 0.0, 30.0), Vector3::zeros()));
    let load = ExternalLoad::of_hands(&ROBOT, 0.0, [lifts].into_iter());
    assert!((load.kappa - (1.0 + 30.0 / (56.0 * GRAVITY_M_S2))).abs() < 1e-12);
    // Its centre of mass over the origin, the zero moment point lies ahead, towards the weight.
    let ahead = load.ground_zmp(&Vector2::zeros()).x;
    assert!((ahead - 0.35 * 30.0 / (56.0 * GRAVITY_M_S2 + 30.0)).abs() < 1e-12);
}

#[test]
fn empty_hands_and_absurd_ones_leave_a_defined_load() {
    assert_eq!(ExternalLoad::of_hands(&ROBOT, 0.0, core::iter::empty()), ExternalLoad::NONE);
    let hangs = (Vector3::new(0.0, 0.0, 2.0), Wrench::new(Vector3::new(0.0, 0.0, -560.0), Vector3::zeros()));
    let load = ExternalLoad::of_hands(&ROBOT, 0.0, [hangs].into_iter());
    assert_eq!(load.kappa, ExternalLoad::KAPPA_RANGE.0);
    assert!(load.ground_zmp(&Vector2::new(0.1, 0.0)).iter().all(|value| value.is_finite()));
}

#[test]
fn one_foot_bears_all_and_no_foot_nothing() {
    let alone = PerFoot { right: None, left: Some(GroundPose::new(0.0, 0.1, 0.0).at_height(0.0)) };
    let loads = distribute(500.0, &Vector2::new(0.0, -0.5), &soles(), &rest_points(), &alone);
    assert_eq!((loads.right.force, loads.left.force), (0.0, 500.0));
    assert!((loads.left.zmp - Vector2::new(0.0, 0.041)).norm() < 1e-12, "on the edge: {}", loads.left.zmp);
    let none = distribute(500.0, &Vector2::zeros(), &soles(), &rest_points(), &PerFoot::default());
    assert_eq!((none.right.force, none.left.force), (0.0, 0.0));
}
