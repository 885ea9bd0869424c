//! The stabiliser alone, and in a loop with compliant legs.

mod plant;
mod team;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use mikoshi_humanoid::balance::{
    ExternalLoad, Pendulum, PerFoot, Side, Stabiliser, StabiliserConfig, StabiliserInputs, StabiliserState,
};
use mikoshi_humanoid::estimate::SupportPolygon;
use mikoshi_humanoid::gait::{GaitConfig, GroundPose, TeamClock};
use mikoshi_spatial::{Twist, World, Wrench};
use nalgebra::{Vector2, Vector3};
use plant::{Command, Plant};
use proptest::prelude::*;
use team::{Robot, on_rigid_ground, soles};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const DT: f64 = 0.005;
const PENDULUM: Pendulum = Pendulum { mass_kg: 56.0, com_height_m: 0.79 };
const STILL: Vector2<f64> = Vector2::new(0.0, 0.0);

fn config() -> StabiliserConfig {
    StabiliserConfig::standard(DT, PENDULUM, soles(), GaitConfig::standard(soles()).zmp_in_foot)
}

/// For ankles like the real robot's rubber bushes: the admittance is to their stiffness what the standard
/// one is to stiff drives.
fn config_for_soft_ankles() -> StabiliserConfig {
    StabiliserConfig { ankle_rad_s_nm: 0.01, force_difference_m_s_n: 3e-4, leak_s: 1.0, ..config() }
}

/// One robot on compliant legs that walks where its hands go.
struct Loop {
    robot: Robot,
    plant: Plant,
    stabiliser: Option<Stabiliser>,
    state: StabiliserState,
    clock: TeamClock,
    hands: GroundPose,
    /// What the stabiliser is told of the load.
    senses_load: bool,
    /// Farthest that the centre of mass was from its reference \[m\].
    worst: f64,
    fallen: bool,
}

impl Loop {
    fn standing(config: Option<StabiliserConfig>) -> Self {
        let robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
        let com = robot.state.preview.com;
        Self {
            robot,
            plant: Plant::new(PENDULUM, soles(), com),
            stabiliser: config.map(Stabiliser::new),
            state: StabiliserState::default(),
            clock: TeamClock::default(),
            hands: GroundPose::default(),
            senses_load: true,
            worst: 0.0,
            fallen: false,
        }
    }

    fn on_soft_ankles(mut self) -> Self {
        (self.plant.ankle_nm_rad, self.plant.ankle_nms_rad) = (350.0, 5.0);
        (self.plant.leg_n_m, self.plant.leg_ns_m) = (30_000.0, 400.0);
        self
    }

    fn tick(&mut self, velocity: Vector2<f64>, push: Vector2<f64>, load: &ExternalLoad) {
        self.hands.position += velocity * DT;
        let by = self.hands.at_height::<World>(0.0);
        self.robot.move_hands(&by, |_| Twist::new(velocity.push(0.0), Vector3::zeros()));
        let now = self.robot.gait.reference(&self.robot.state);
        let sensed = if self.senses_load { *load } else { ExternalLoad::NONE };
        let inputs = StabiliserInputs {
            com_ref: now.com.xy(),
            com_velocity_ref: now.com_velocity.xy(),
            com_acceleration_ref: now.com_acceleration.xy(),
            com: self.plant.com,
            com_velocity: self.plant.com_velocity,
            standing: PerFoot::from_fn(|side| now.feet[side].in_contact.then_some(now.feet[side].pose)),
            ground_wrench: self.plant.ground_wrench,
            load: sensed,
            rests: false,
        };
        let stabilisation = self.stabiliser.map(|stabiliser| stabiliser.act(&mut self.state, &inputs));
        self.clock = self.clock.advance(&self.robot.gait.config().timing, &[self.robot.wish()], true);
        let next = self.robot.act_under(self.clock.clock, sensed);
        let offset = |side: Side| stabilisation.map_or(Twist::zero(), |it| it.sole_offset[side]);
        let command = Command {
            com: next.com.xy() + stabilisation.map_or(STILL, |it| it.com_offset),
            standing: PerFoot::from_fn(|side| {
                let foot = &next.feet[side];
                (foot.in_contact || foot.pose.translation.z <= 1e-6).then_some(foot.pose)
            }),
            tilt: PerFoot::from_fn(|side| offset(side).angular.xy()),
            height: PerFoot::from_fn(|side| offset(side).linear.z),
        };
        self.plant.step(&command, push, load, DT);
        let error = (self.plant.com - next.com.xy()).norm();
        self.worst = self.worst.max(error);
        self.fallen |= error > 0.3;
    }

    fn pushed(mut self, push: Vector2<f64>) -> Self {
        for tick in 0..1600 {
            let push = if (100..140).contains(&tick) { push } else { STILL };
            if !self.fallen {
                self.tick(STILL, push, &ExternalLoad::NONE);
            }
        }
        self
    }

    fn walked(mut self) -> Self {
        for tick in 0..4000 {
            let velocity = if tick < 2000 { Vector2::new(0.1, 0.0) } else { STILL };
            if !self.fallen {
                self.tick(velocity, STILL, &ExternalLoad::NONE);
            }
        }
        self
    }

    fn error(&self) -> f64 {
        (self.plant.com - self.robot.state.preview.com).norm()
    }
}

/// How far a sole tilts on ground that does not yield, under an ankle's drive of which only damping counts, from a tilt of
/// 1 mrad on: what is left after a hundred ticks.
fn tilt_left(config: StabiliserConfig, damping_nms_rad: f64) -> f64 {
    let stabiliser = Stabiliser::new(StabiliserConfig { leak_s: 1e9, ..config });
    let robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
    let now = robot.gait.reference(&robot.state);
    let standing = PerFoot::from_fn(|side| Some(now.feet[side].pose));
    let mut inputs = StabiliserInputs {
        com_ref: now.com.xy(),
        com_velocity_ref: STILL,
        com_acceleration_ref: STILL,
        com: now.com.xy(),
        com_velocity: STILL,
        standing,
        ground_wrench: PerFoot::from_fn(|_| Wrench::zero()),
        load: ExternalLoad::NONE,
        rests: false,
    };
    let mut state = StabiliserState::default();
    let desired = stabiliser.act(&mut state.clone(), &inputs).loads;
    state.sole_tilt.right.y = 1e-3;
    let mut before = 0.0;
    for _ in 0..100 {
        let foot = inputs.standing.right.expect("it stands").translation.xy();
        let moment = desired.right.moment_about(&foot)
            - Vector2::new(0.0, damping_nms_rad * (state.sole_tilt.right.y - before) / DT);
        before = state.sole_tilt.right.y;
        inputs.ground_wrench.right = Wrench::new(Vector3::zeros(), moment.push(0.0));
        stabiliser.act(&mut state, &inputs);
    }
    (state.sole_tilt.right.y - before).abs()
}

#[test]
fn soles_under_drives_that_damp_more_do_not_alternate_from_tick_to_tick() {
    for damping in [500.0, 700.0, 3000.0] {
        let left = tilt_left(config().for_leg_drives(damping), damping);
        assert!(left < 1e-9, "{damping} Nms/rad: {left} rad");
    }
    assert!(tilt_left(config(), 3000.0) > 0.01, "what is for softer drives alternates");
    assert_eq!(config().for_leg_drives(400.0), config());
}

#[test]
fn on_soft_ankles_a_push_that_tips_the_robot_is_withstood_with_the_stabiliser() {
    for push in [Vector2::new(80.0, 0.0), Vector2::new(-100.0, 0.0), Vector2::new(0.0, 120.0)] {
        let without = Loop::standing(None).on_soft_ankles().pushed(push);
        assert!(without.fallen, "{push}");
        let with = Loop::standing(Some(config_for_soft_ankles())).on_soft_ankles().pushed(push);
        assert!(!with.fallen, "{push}");
        assert!(with.error() < 0.005 && with.plant.com_velocity.norm() < 0.002, "{push}: {}", with.error());
    }
}

#[test]
fn on_soft_ankles_a_walk_that_tips_the_robot_succeeds_with_the_stabiliser() {
    assert!(Loop::standing(None).on_soft_ankles().walked().fallen);
    let with = Loop::standing(Some(config_for_soft_ankles())).on_soft_ankles().walked();
    assert!(!with.fallen && with.worst < 0.03, "{}", with.worst);
}

#[test]
fn on_stiff_legs_the_standard_parameters_follow_closer_and_come_to_rest() {
    let without = Loop::standing(None).walked();
    let with = Loop::standing(Some(config())).walked();
    assert!(!with.fallen && with.worst < 0.95 * without.worst, "{} {}", with.worst, without.worst);
    assert!(with.error() < 0.95 * without.error(), "{} {}", with.error(), without.error());
    assert!(with.plant.com_velocity.norm() < 1e-4);
    for push in [Vector2::new(100.0, 0.0), Vector2::new(0.0, 140.0)] {
        let (without, with) =
            (Loop::standing(None).pushed(push), Loop::standing(Some(config())).pushed(push));
        assert!(!with.fallen && with.worst <= without.worst + 1e-3, "{} {}", with.worst, without.worst);
    }
}

#[test]
fn yielding_with_the_centre_of_mass_brings_the_walk_nearer_to_its_reference() {
    let yielding = StabiliserConfig { com_admittance_1_s2: 10.0, ..config() };
    let (stiff, yielding) =
        (Loop::standing(Some(config())).walked(), Loop::standing(Some(yielding)).walked());
    assert!(!yielding.fallen && yielding.error() < 0.5 * stiff.error());
    assert!(yielding.worst < stiff.worst, "{} {}", yielding.worst, stiff.worst);
}

#[test]
fn hands_that_push_forty_newtons_leave_the_zmp_where_it_is() {
    let mut it = Loop::standing(Some(config()));
    let forward = Vector3::new(20.0, 0.0, 0.0);
    let hands =
        [-0.25, 0.25].map(|y| (Vector3::new(0.35, y, 0.96), Wrench::<World>::new(forward, Vector3::zeros())));
    let load = ExternalLoad::of_hands(&PENDULUM, 0.0, hands.into_iter());
    for tick in 0..3000 {
        let ramp = ExternalLoad::NONE.filtered_towards(&load, (tick as f64 / 600.0).min(1.0));
        it.tick(STILL, STILL, &ramp);
    }
    // The robot leans into it by the moment over the weight.
    let lean = 0.96 * 40.0 / PENDULUM.weight_n();
    assert!((it.plant.com.x - 0.015 - lean).abs() < 0.004, "{}", it.plant.com.x);
    assert!((it.plant.zmp - it.robot.state.zmp_ref).norm() < 0.004, "{}", it.plant.zmp);
}

#[test]
fn a_jerk_at_the_hands_moves_a_robot_less_that_feels_it_there() {
    let worst = |senses_load| {
        let mut it = Loop { senses_load, ..Loop::standing(Some(config_for_soft_ankles())).on_soft_ankles() };
        let pull = Wrench::<World>::new(Vector3::new(60.0, 0.0, 0.0), Vector3::zeros());
        let load =
            ExternalLoad::of_hands(&PENDULUM, 0.0, [(Vector3::new(0.35, 0.0, 0.96), pull)].into_iter());
        let mut farthest = 0.0_f64;
        for tick in 0..1600 {
            it.tick(STILL, STILL, if (100..130).contains(&tick) { &load } else { &ExternalLoad::NONE });
            farthest = farthest.max((it.plant.com.x - 0.015).abs());
        }
        assert!(!it.fallen);
        farthest
    };
    assert!(worst(true) < 0.95 * worst(false), "{} {}", worst(true), worst(false));
}

fn feet() -> PerFoot<GroundPose> {
    PerFoot { right: GroundPose::new(0.0, -0.085, 0.0), left: GroundPose::new(0.0, 0.085, 0.0) }
}

/// At rest over the middle, each foot bearing half at its rest point.
fn balanced() -> StabiliserInputs {
    let force = PENDULUM.weight_n() / 2.0;
    let wrench = Wrench::new(Vector3::new(0.0, 0.0, force), Vector3::new(0.0, -0.015 * force, 0.0));
    StabiliserInputs {
        com_ref: Vector2::new(0.015, 0.0),
        com_velocity_ref: STILL,
        com_acceleration_ref: STILL,
        com: Vector2::new(0.015, 0.0),
        com_velocity: STILL,
        standing: PerFoot::from_fn(|side| Some(feet()[side].at_height(0.0))),
        ground_wrench: PerFoot { right: wrench, left: wrench },
        load: ExternalLoad::NONE,
        rests: false,
    }
}

fn act(
    inputs: &StabiliserInputs,
    ticks: usize,
) -> (StabiliserState, mikoshi_humanoid::balance::Stabilisation) {
    let (stabiliser, mut state) = (Stabiliser::new(config()), StabiliserState::default());
    for _ in 1..ticks {
        stabiliser.act(&mut state, inputs);
    }
    let out = stabiliser.act(&mut state, inputs);
    (state, out)
}

#[test]
fn a_robot_in_balance_is_left_alone() {
    let (state, out) = act(&balanced(), 1000);
    assert!(out.com_offset.norm() < 1e-12 && out.dcm_error.norm() < 1e-12);
    assert!((out.zmp - Vector2::new(0.015, 0.0)).norm() < 1e-12);
    for side in Side::BOTH {
        assert!(out.sole_offset[side].to_vector().norm() < 1e-9, "{:?}", state);
    }
}

#[test]
fn a_divergent_component_ahead_is_met_by_a_zmp_twice_as_far_ahead() {
    let inputs = StabiliserInputs { com_velocity: Vector2::new(0.05, 0.0), ..balanced() };
    let (_, out) = act(&inputs, 1);
    let error = 0.05 / PENDULUM.frequency();
    assert!((out.dcm_error.x - error).abs() < 1e-12);
    assert!((out.zmp.x - 0.015 - 2.0 * error - error * DT).abs() < 1e-12);
}

#[test]
fn a_sole_that_presses_too_far_ahead_yields_by_lifting_its_toe() {
    let mut inputs = balanced();
    inputs.ground_wrench.right.moment.y -= 10.0;
    inputs.ground_wrench.left.moment.x += 10.0;
    let (state, _) = act(&inputs, 10);
    // About +y turns the toe down; about +x lifts the left edge.
    assert!((state.sole_tilt.right.y + 1e-3 * 10.0 * DT * 10.0).abs() < 5e-5, "{}", state.sole_tilt.right);
    assert!(
        (state.sole_tilt.left.x - 1e-3 * 10.0 * DT * 10.0).abs() < 5e-5,
        "pressing left lifts the left edge"
    );
    assert!(state.sole_tilt.left.y.abs() < 1e-9 && state.sole_tilt.right.x.abs() < 1e-9);
}

/// How far soles go to and fro in the last second of `seconds`, under moments that come and go at random by 10 Nm a tick.
fn unrest_rad(rests: bool, seconds: usize) -> f64 {
    let (stabiliser, mut state) = (Stabiliser::new(config()), StabiliserState::default());
    let (ticks, mut noise) = ((seconds as f64 / DT) as usize, 1_u64);
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for tick in 0..ticks {
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let mut inputs = StabiliserInputs { rests, ..balanced() };
        inputs.ground_wrench.right.moment.x += if noise >> 63 == 1 { 10.0 } else { -10.0 };
        stabiliser.act(&mut state, &inputs);
        if tick + (1.0 / DT) as usize >= ticks {
            (least, most) = (least.min(state.sole_tilt.right.x), most.max(state.sole_tilt.right.x));
        }
    }
    most - least
}

#[test]
fn soles_of_a_robot_that_rests_come_to_rest_on_ground_that_rattles() {
    let (restless, early, late) = (unrest_rad(false, 12), unrest_rad(true, 3), unrest_rad(true, 12));
    assert!(late < 0.05 * restless && late < 0.5 * early, "{restless} {early} {late}");
}

#[test]
fn soles_come_to_rest_where_they_would_have_come_without() {
    let tilt = |rests| {
        let (stabiliser, mut state) = (Stabiliser::new(config()), StabiliserState::default());
        for _ in 0..(12.0 / DT) as usize {
            let mut inputs = StabiliserInputs { rests, ..balanced() };
            inputs.ground_wrench.right.moment.x += 4.0;
            stabiliser.act(&mut state, &inputs);
        }
        state.sole_tilt.right.x
    };
    assert!((tilt(true) / tilt(false) - 1.0).abs() < 0.05, "{} {}", tilt(true), tilt(false));
}

#[test]
fn a_robot_that_is_pushed_has_not_rested_any_more() {
    let (stabiliser, mut state) = (Stabiliser::new(config()), StabiliserState::default());
    let resting = StabiliserInputs { rests: true, ..balanced() };
    for _ in 0..2000 {
        stabiliser.act(&mut state, &resting);
    }
    let pushed = StabiliserInputs { com_velocity: Vector2::new(0.0, 0.1), ..resting };
    let mut awake = StabiliserState { rested_s: 0.0, ..state };
    stabiliser.act(&mut state, &pushed);
    stabiliser.act(&mut awake, &StabiliserInputs { rests: false, ..pushed });
    assert_eq!(state, awake);
}

#[test]
fn the_tilt_is_about_the_axes_of_a_turned_foot() {
    let mut inputs = balanced();
    let turned = GroundPose { yaw: core::f64::consts::FRAC_PI_2, ..feet().right };
    inputs.standing.right = Some(turned.at_height(0.0));
    inputs.standing.left = None;
    let (bare, _) = act(&inputs, 1);
    inputs.ground_wrench.right.moment.y -= 10.0;
    let (state, out) = act(&inputs, 1);
    // In the world about −y: in the foot, whose x points along the world's y, about −x.
    let change = state.sole_tilt.right - bare.sole_tilt.right;
    assert!((change - Vector2::new(-1e-3 * 10.0 * DT, 0.0)).norm() < 1e-12, "{change}");
    let pose = out.apply(Side::Right, &turned.at_height(0.0));
    let tilt = state.sole_tilt.right;
    let expected = turned.at_height::<World>(0.0).rotation * mikoshi_spatial::exp(&tilt.push(0.0));
    assert!(pose.rotation.angle_to(&expected) < 1e-12);
}

#[test]
fn the_foot_that_bears_too_much_is_drawn_up() {
    let mut inputs = balanced();
    for (side, sign) in [(Side::Left, 1.0), (Side::Right, -1.0)] {
        inputs.ground_wrench[side].force.z += sign * 50.0;
    }
    let (_, out) = act(&inputs, 1);
    let height = 3e-5 * 100.0 * DT / 2.0;
    assert!((out.sole_offset.left.linear.z - height).abs() < 1e-12);
    assert!((out.sole_offset.right.linear.z + height).abs() < 1e-12);
}

/// Whose left foot bears all, as far past where it is wanted.
fn bearing_aside(off_m: f64) -> StabiliserInputs {
    let mut inputs = balanced();
    inputs.standing.right = None;
    inputs.com_ref = inputs.standing.left.map_or(inputs.com_ref, |foot| foot.translation.xy());
    inputs.com = inputs.com_ref;
    let weight = PENDULUM.weight_n();
    inputs.ground_wrench.right = Wrench::zero();
    inputs.ground_wrench.left =
        Wrench::new(Vector3::new(0.0, 0.0, weight), Vector3::new(off_m * weight, 0.0, 0.0));
    inputs
}

#[test]
fn a_sole_that_has_turned_on_an_edge_comes_to_rest_without_a_blow() {
    let stabiliser = Stabiliser::new(config());
    let mut state = StabiliserState::default();
    let on_edge_then_flat = [0.04, 0.0].map(|off_m| vec![bearing_aside(off_m); 60]).concat();
    let rates = on_edge_then_flat.iter().map(|inputs| {
        let before = state.sole_tilt.left.x;
        stabiliser.act(&mut state, inputs);
        (state.sole_tilt.left.x - before) / DT
    });
    let rates: Vec<f64> = rates.collect();
    let fastest = rates.iter().copied().fold(0.0, f64::max);
    assert!(fastest > 0.2, "it turns at {fastest} rad/s only");
    let blow = rates.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
    assert!(blow < 0.5 * config().edge_max_rad_s, "its speed changes by {blow} rad/s at once");
    assert!(state.sole_turning.left == Vector2::zeros(), "{:?}", state.sole_turning.left);
}

#[test]
fn in_the_air_everything_is_forgotten() {
    let stabiliser = Stabiliser::new(StabiliserConfig { com_admittance_1_s2: 10.0, ..config() });
    let mut state = StabiliserState::default();
    let mut inputs = StabiliserInputs { com: Vector2::new(0.03, 0.02), ..balanced() };
    for _ in 0..400 {
        stabiliser.act(&mut state, &inputs);
    }
    assert!(state.sole_tilt.left.norm() > 1e-3 && state.dcm_error_integral.norm() > 1e-3);
    inputs.standing = PerFoot::default();
    for _ in 0..2000 {
        stabiliser.act(&mut state, &inputs);
    }
    assert!(state.dcm_error_integral.norm() < 1e-4 && state.com_offset.norm() < 1e-2);
    assert!(state.sole_tilt.left.norm() < 1e-4 && state.height_difference.abs() < 1e-4);
}

fn any_point(scale: f64) -> impl Strategy<Value = Vector2<f64>> {
    [-scale..scale, -scale..scale].prop_map(Vector2::from)
}

fn any_inputs() -> impl Strategy<Value = StabiliserInputs> {
    let wrench = [-2e3..2e3, -500.0..500.0, -500.0..500.0_f64]
        .prop_map(|[z, x, y]| Wrench::<World>::new(Vector3::new(0.0, 0.0, z), Vector3::new(x, y, 0.0)));
    (
        any_point(1.0),
        any_point(2.0),
        any_point(20.0),
        wrench.clone(),
        wrench,
        any::<[bool; 2]>(),
        0.2..2.0,
        any_point(0.3),
    )
        .prop_map(|(com, com_velocity, acceleration, right, left, [r, l], kappa, shift)| {
            let standing = balanced().standing;
            StabiliserInputs {
                com,
                com_velocity,
                com_acceleration_ref: acceleration,
                standing: PerFoot { right: standing.right.filter(|_| r), left: standing.left.filter(|_| l) },
                ground_wrench: PerFoot { right, left },
                load: ExternalLoad { kappa, shift, about: STILL },
                ..balanced()
            }
        })
}

proptest! {
    #[test]
    fn whatever_is_measured_offsets_stay_bounded_and_the_zmp_within_the_soles(
        inputs in proptest::collection::vec(any_inputs(), 1..60),
    ) {
        let config = StabiliserConfig {
            com_admittance_1_s2: 50.0,
            ankle_max_rad: 2e-3,
            height_difference_max_m: 2e-4,
            ..config()
        };
        let (stabiliser, mut state) = (Stabiliser::new(config), StabiliserState::default());
        for inputs in inputs {
            let out = assert_no_alloc(|| stabiliser.act(&mut state, &inputs));
            let support = SupportPolygon::of_feet(&soles(), &inputs.standing);
            if !support.vertices().is_empty() {
                prop_assert!(support.signed_distance(&out.zmp) >= config.sole_margin_m - 1e-9);
            }
            prop_assert!(out.com_offset.iter().all(|value| value.abs() <= config.com_offset_max_m));
            for side in Side::BOTH {
                prop_assert!(out.sole_offset[side].linear.z.abs() <= config.height_difference_max_m / 2.0 + 1e-12);
                prop_assert!(out.sole_offset[side].angular.iter().all(|value| value.abs() <= config.ankle_max_rad));
                prop_assert!(out.loads[side].force >= 0.0 && out.loads[side].zmp.iter().all(|value| value.is_finite()));
            }
        }
    }
}
