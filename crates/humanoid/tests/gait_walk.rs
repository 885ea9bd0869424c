//! A team walks by references alone: object, clock, feet, zero moment point, centre of mass.

mod team;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use mikoshi_humanoid::balance::{ExternalLoad, PerFoot, Side};
use mikoshi_humanoid::gait::{
    GaitConfig, GaitInputs, GaitPhase, GaitReference, GroundPose, HandCentre, StepClock, StepWish,
    SwingConfig,
};
use nalgebra::{Vector2, Vector3};
use team::{Robot, Team, on_rigid_ground, sole_margin};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

const DT: f64 = 0.005;
const STILL: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);

/// x, y and yaw velocities that start, turn and end at once, without a ramp: harder than any real
/// reference.
fn wandering(time: f64) -> Vector3<f64> {
    let pieces = [
        (1.0, [0.0, 0.0, 0.0]),
        (8.0, [0.1, 0.0, 0.0]),
        (14.0, [0.03, 0.05, 0.06]),
        (20.0, [-0.05, -0.04, 0.02]),
        (26.0, [0.04, -0.05, -0.05]),
        (30.0, [0.0, 0.06, 0.04]),
    ];
    pieces.iter().find(|(end, _)| time < *end).map_or(STILL, |piece| Vector3::from(piece.1))
}

/// Least distance of the reference motion's zero moment point from the edge of what it may use: the
/// stance sole while one foot swings; both soles' hull by its inner half, else.
fn margin(robot: &Robot) -> f64 {
    let under = |side| sole_margin(side, &robot.state.feet[side].pose, robot.zmp());
    if let Some(foot) = robot.state.phase.swinging_foot() {
        under(foot.side.opposite())
    } else {
        // On the line between two points of both soles, a point is within the hull by at least what
        // it is within the nearer sole moved along that line.
        let [right, left] = [robot.state.feet.right.pose, robot.state.feet.left.pose];
        let along = left.position - right.position;
        let share = ((robot.zmp() - right.position).dot(&along) / along.norm_squared()).clamp(0.0, 1.0);
        sole_margin(Side::Right, &right, robot.zmp() - along * share).min(sole_margin(
            Side::Left,
            &left,
            robot.zmp() + along * (1.0 - share),
        ))
    }
}

fn feet_pass_by_each_other(robot: &Robot) {
    let step = robot.state.feet.right.pose.inverse().then(&robot.state.feet.left.pose);
    assert!(step.position.y > 0.12, "{step:?}");
}

#[test]
fn a_team_of_four_follows_a_wandering_object_and_comes_to_rest_under_it() {
    let mut team = Team::around_an_object(on_rigid_ground());
    let (mut worst_error, mut worst_margin, mut worst_foot) = (0.0_f64, f64::MAX, 0.0_f64);
    for tick in 0..8000 {
        team.tick(wandering(tick as f64 * DT));
        for robot in &team.robots {
            worst_error = worst_error.max((robot.zmp() - robot.state.zmp_ref).norm());
            worst_margin = worst_margin.min(margin(robot));
            worst_foot =
                Side::BOTH.map(|side| robot.foot_error(side).position).into_iter().fold(worst_foot, f64::max);
            feet_pass_by_each_other(robot);
        }
    }
    println!("zmp error {worst_error:.4} margin {worst_margin:.4} foot {worst_foot:.3} steps {}", team.steps);
    assert!(team.steps > 30 && team.walks == 1, "{} steps, {} walks", team.steps, team.walks);
    assert_eq!(team.clock.clock, StepClock::Standing);
    for robot in &team.robots {
        for side in Side::BOTH {
            let error = robot.foot_error(side);
            assert!(error.relative_to(&robot.gait.config().stop) < 1.0, "{error:?}");
        }
        assert!(robot.state.preview.com_velocity.norm() < 1e-4);
    }
    assert!(worst_error < 0.045, "{worst_error}");
    assert!(worst_margin > 0.034, "{worst_margin}");
    assert!(worst_foot < 0.3, "{worst_foot}");
}

#[test]
fn between_decisions_the_zmp_is_followed_within_five_millimetres() {
    let mut team = Team::around_an_object(on_rigid_ground());
    let mut worst = 0.0_f64;
    for tick in 0..4000 {
        team.tick(Vector3::new(0.1, 0.0, 0.0));
        if tick > 200 {
            worst = team
                .robots
                .iter()
                .map(|robot| (robot.zmp() - robot.state.zmp_ref).norm())
                .fold(worst, f64::max);
        }
    }
    assert!(worst < 0.005, "{worst}");
}

#[test]
fn a_walk_goes_on_while_the_object_moves() {
    for velocity in [0.03, 0.1, 0.2] {
        let mut team = Team::around_an_object(on_rigid_ground());
        for _ in 0..6000 {
            team.tick(Vector3::new(velocity, 0.0, 0.0));
        }
        assert_eq!(team.walks, 1, "{velocity} m/s");
        assert!(matches!(team.clock.clock, StepClock::Stepping { .. }));
    }
}

#[test]
fn an_object_that_hardly_moves_makes_nobody_step() {
    let mut team = Team::around_an_object(on_rigid_ground());
    for tick in 0..2000 {
        let sway = 0.01 * (tick as f64 * DT * 2.0).cos() * 2.0;
        team.tick(Vector3::new(sway, 0.0, 0.0) * 0.5);
    }
    assert_eq!(team.steps, 0);
}

#[test]
fn at_two_decimetres_per_second_the_feet_still_keep_up() {
    let mut team = Team::around_an_object(on_rigid_ground());
    for tick in 0..4000 {
        team.tick(Vector3::new(0.2, 0.0, 0.0));
        if tick > 1000 {
            for robot in &team.robots {
                // Less than the way of two steps: a foot is never late by more than its own stance.
                assert!(Side::BOTH.iter().all(|side| robot.foot_error(*side).position < 0.2 * 1.6));
            }
        }
    }
}

#[test]
fn all_robots_swing_on_the_same_ticks_and_on_the_same_side_of_the_world() {
    let mut team = Team::around_an_object(on_rigid_ground());
    let mut swings = 0;
    for tick in 0..4000 {
        team.tick(wandering(tick as f64 * DT));
        let side_in_world = |robot: &Robot| {
            let foot = robot.state.phase.swinging_foot()?;
            let across = robot.state.feet[foot.side].pose.position
                - robot.state.feet[foot.side.opposite()].pose.position;
            Some(across.y > 0.0)
        };
        let sides: Vec<_> = team.robots.iter().map(side_in_world).collect();
        assert!(sides.iter().all(|side| *side == sides[0]), "tick {tick}: {sides:?}");
        swings += usize::from(sides[0].is_some());
    }
    assert!(swings > 1000);
}

#[test]
fn references_are_continuous() {
    let mut team = Team::around_an_object(on_rigid_ground());
    team.robots[1].ground_height = 0.006;
    team.robots[2].ground_height = -0.006;
    let references = |team: &Team| -> Vec<GaitReference> {
        team.robots.iter().map(|robot| robot.gait.reference(&robot.state)).collect()
    };
    let mut before = references(&team);
    for tick in 0..8000 {
        team.tick(wandering(tick as f64 * DT));
        let now = references(&team);
        for (before, now) in before.iter().zip(&now) {
            assert!((now.com - before.com - before.com_velocity * DT).norm() < 1e-4);
            assert!((now.com_acceleration - before.com_acceleration).norm() < 1.2);
            for side in Side::BOTH {
                let moved = before.feet[side].pose.displacement_to(&now.feet[side].pose);
                let fastest = Vector3::new(1.2, 0.6, 0.5) * DT;
                assert!(moved.linear.xy().norm() < fastest.x, "tick {tick}: {moved:?}");
                assert!(
                    moved.linear.z.abs() < fastest.y && moved.angular.norm() < 3.0 * fastest.z,
                    "{moved:?}"
                );
            }
        }
        before = now;
    }
}

#[test]
fn the_velocity_of_a_foot_is_that_of_its_pose() {
    // Slow enough for the stop of a foot that is lowered, which is sudden.
    let config = on_rigid_ground();
    let swing = SwingConfig { lowering_m_s: 0.01, ..config.swing };
    let mut robot = Robot::standing_at(GroundPose::default(), GaitConfig { swing, ..config });
    robot.centre = HandCentre { velocity: Vector2::new(0.1, 0.02), yaw_rate: 0.05, ..robot.centre };
    let timing = robot.gait.config().timing;
    let mut clock =
        StepClock::Stepping { step_index: 0, tick_in_step: 0, swing: Side::Left, will_continue: true };
    let mut before = robot.act(clock);
    for _ in 0..timing.step(0) + timing.step(1) - 2 {
        clock = clock.extrapolated(&timing, 1);
        let now = robot.act(clock);
        for side in Side::BOTH {
            let moved = before.feet[side].pose.displacement_to(&now.feet[side].pose) * (1.0 / DT);
            let mean = (before.feet[side].twist + now.feet[side].twist) * 0.5;
            assert!((moved - mean).to_vector().norm() < 0.01, "{moved:?} {mean:?}");
        }
        before = now;
    }
}

#[test]
fn ground_that_comes_early_or_late_moves_footholds_and_not_the_clock() {
    for height in [0.008, -0.008] {
        let mut team = Team::around_an_object(on_rigid_ground());
        team.robots[1].ground_height = height;
        for tick in 0..3000 {
            team.tick(wandering(tick as f64 * DT));
            let foot = team.robots[1].state.feet.left.height;
            assert!(foot.abs() <= height.abs() + 0.002, "{foot}");
        }
        assert!((team.robots[1].state.feet.left.height - height).abs() < 0.002);
        assert_eq!(team.waited, 0, "there is time in double support");
    }
}

#[test]
fn a_robot_whose_foot_finds_its_ground_too_late_makes_the_team_wait_in_balance() {
    let mut team = Team::around_an_object(on_rigid_ground());
    for tick in 0..4000 {
        // From the third step on, robot 1 feels its ground for a while only .18 m below, i.e. never.
        let gone = (700..900).contains(&tick);
        team.robots[1].ground_height = if gone { -0.18 } else { 0.0 };
        team.tick(wandering(tick as f64 * DT));
        for robot in &team.robots {
            if !matches!(robot.state.phase, GaitPhase::DoubleSupport { landing: Some(_), .. }) {
                assert!(margin(robot) > 0.02, "tick {tick}: {}", margin(robot));
            }
        }
    }
    assert!(team.waited > 10, "{}", team.waited);
    assert_eq!(team.walks, 1, "it goes on afterwards");
}

#[test]
fn a_robot_that_never_finds_its_ground_ends_the_walk_of_all() {
    let mut team = Team::around_an_object(on_rigid_ground());
    for tick in 0..3000 {
        team.robots[3].ground_height = if tick < 300 { 0.0 } else { -0.1 };
        team.tick(wandering(tick as f64 * DT));
    }
    assert_eq!(team.clock.clock, StepClock::Standing);
    for robot in &team.robots[..3] {
        assert!(matches!(robot.state.phase, GaitPhase::Standing { .. }));
        assert!(robot.state.preview.com_velocity.norm() < 1e-4);
    }
    assert!(!team.robots[3].wish().ready);
}

#[test]
fn a_clock_that_freezes_in_mid_swing_keeps_the_foot_where_it_is() {
    let mut robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
    let timing = robot.gait.config().timing;
    let mut clock =
        StepClock::Stepping { step_index: 0, tick_in_step: 0, swing: Side::Left, will_continue: true };
    for _ in 0..timing.lift_off(0) + 50 {
        robot.act(clock);
        clock = clock.extrapolated(&timing, 1);
    }
    let first = robot.act(clock);
    let second = robot.act(clock);
    assert_eq!(first.feet, second.feet);
}

#[test]
fn without_a_grasp_feet_march_in_place() {
    let mut robot = Robot::standing_at(GroundPose::new(0.3, -0.2, 0.4), on_rigid_ground());
    robot.state.placement = None;
    let feet = robot.state.feet;
    let timing = robot.gait.config().timing;
    let mut clock =
        StepClock::Stepping { step_index: 0, tick_in_step: 0, swing: Side::Left, will_continue: true };
    assert_eq!(robot.wish(), StepWish::CONTENT);
    while clock != StepClock::Standing {
        robot.act(clock);
        clock = clock.extrapolated(&timing, 1);
    }
    for side in Side::BOTH {
        assert!((robot.state.feet[side].pose.position - feet[side].pose.position).norm() < 1e-9);
    }
}

/// Legs that sag set each foot down where it was not sent. Where it is felt, the next steps begin, and no
/// sooner than it has landed.
#[test]
fn a_foot_stands_where_it_was_felt_to_land() {
    let mut robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
    robot.state.placement = None;
    let (start, off) = (robot.state.feet, Vector2::new(-0.0004, 0.0001));
    let timing = robot.gait.config().timing;
    let first_landing = timing.step(0);
    let mut clock =
        StepClock::Stepping { step_index: 0, tick_in_step: 0, swing: Side::Left, will_continue: true };
    for _ in 0..first_landing + timing.step(1) / 2 {
        robot.act_where(clock, ExternalLoad::NONE, Some(off));
        clock = clock.extrapolated(&timing, 1);
    }
    let moved = |side: Side| robot.state.feet[side].pose.position - start[side].pose.position;
    assert!((moved(Side::Left) - off).norm() < 1e-12, "{}", moved(Side::Left));
    assert_eq!(moved(Side::Right), Vector2::zeros(), "it has not left the ground, or not come down yet");
}

#[test]
fn a_load_in_the_hands_moves_the_centre_of_mass_and_not_the_zmp() {
    let mut robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
    let hands = Vector2::new(0.35, 0.0);
    // 100 N down at the hands of a robot of 550 N.
    let load = ExternalLoad { kappa: 1.0 + 100.0 / 550.0, shift: Vector2::zeros(), about: hands };
    for _ in 0..3000 {
        let inputs = GaitInputs {
            clock: StepClock::Standing,
            hand_centre: Some(robot.centre),
            foot_force: PerFoot { right: 300.0, left: 300.0 },
            soles: None,
            sole_heights: None,
            load,
            divergent_component: None,
            soles_turn: PerFoot { right: false, left: false },
        };
        robot.gait.act(&mut robot.state, &inputs);
    }
    let zmp = robot.state.load.ground_zmp(&robot.zmp());
    assert!((zmp - robot.state.zmp_ref).norm() < 1e-4, "{zmp}");
    let back = (hands.x - 0.015) * 100.0 / 550.0;
    assert!((robot.state.preview.com.x - (0.015 - back)).abs() < 1e-4);
}

#[test]
fn a_tick_allocates_nothing_and_a_copy_of_the_state_goes_on_alike() {
    let mut team = Team::around_an_object(on_rigid_ground());
    for tick in 0..1500 {
        team.tick(wandering(tick as f64 * DT));
        let robot = &team.robots[0];
        let mut copy = robot.state;
        let inputs = GaitInputs {
            clock: team.clock.clock,
            hand_centre: Some(robot.centre),
            foot_force: PerFoot { right: 275.0, left: 275.0 },
            soles: None,
            sole_heights: None,
            load: ExternalLoad::NONE,
            divergent_component: None,
            soles_turn: PerFoot { right: false, left: false },
        };
        let mut twin = copy;
        let (reference, _) = assert_no_alloc(|| {
            (robot.gait.act(&mut copy, &inputs), robot.gait.wish(&copy, Some(&robot.centre)))
        });
        assert_eq!(robot.gait.act(&mut twin, &inputs), reference);
        assert_eq!(twin, copy);
    }
}

#[test]
fn both_feet_are_judged_by_the_stopping_threshold_after_the_next_landing() {
    let wish = |left: f64, right: f64| {
        let mut robot = Robot::standing_at(GroundPose::default(), on_rigid_ground());
        robot.state.feet.left.pose.position.x -= left;
        robot.state.feet.right.pose.position.x -= right;
        robot.wish()
    };
    assert!(!wish(0.025, 0.025).wants_step, "below the starting threshold");
    let one = wish(0.05, 0.015);
    assert!(one.wants_step && one.can_stop && one.first_swing == Side::Left, "one step is enough");
    let two = wish(0.05, 0.025);
    assert!(two.wants_step && !two.can_stop, "the other foot stays too far off to stop there");
    assert!((two.urgency - 0.05 / 0.03).abs() < 1e-9);
}

#[test]
fn a_mirrored_robot_does_under_the_mirrored_clock_what_the_other_one_does() {
    let config = on_rigid_ground();
    let mut plain = Robot::standing_at(GroundPose::default(), config);
    let mut mirrored = Robot::standing_at(GroundPose::default(), GaitConfig { mirrored: true, ..config });
    let mut clock =
        StepClock::Stepping { step_index: 0, tick_in_step: 0, swing: Side::Left, will_continue: true };
    for tick in 0..600 {
        let velocity = Vector2::new(0.1, 0.03) * f64::from(tick < 200);
        for robot in [&mut plain, &mut mirrored] {
            robot.centre.velocity = velocity;
            robot.centre.pose.position += velocity * DT;
        }
        let StepClock::Stepping { step_index, tick_in_step, swing, will_continue } = clock else { break };
        let opposite =
            StepClock::Stepping { step_index, tick_in_step, swing: swing.opposite(), will_continue };
        assert_eq!(plain.act(clock), mirrored.act(opposite), "tick {tick}");
        let (wish, other) = (plain.wish(), mirrored.wish());
        assert_eq!(wish, StepWish { first_swing: other.first_swing.opposite(), ..other }, "tick {tick}");
        // As a team of one that always takes another step.
        clock = clock.extrapolated(&config.timing, 1);
        if let StepClock::Stepping { will_continue, .. } = &mut clock {
            *will_continue = true;
        }
    }
}

#[test]
fn from_any_tick_a_robot_left_alone_comes_to_stand_on_two_feet() {
    let mut team = Team::around_an_object(on_rigid_ground());
    let timing = team.robots[0].gait.config().timing;
    for tick in 0..2400 {
        team.tick(wandering(tick as f64 * DT));
        if tick % 29 != 0 {
            continue;
        }
        for robot in &team.robots {
            let mut alone = robot.clone();
            alone.centre = HandCentre { velocity: Vector2::zeros(), yaw_rate: 0.0, ..alone.centre };
            let mut clock = team.clock.clock;
            while clock != StepClock::Standing {
                clock = clock.extrapolated(&timing, 1);
                alone.act(clock);
                assert!(margin(&alone) > 0.02, "from tick {tick}, {clock:?}: {}", margin(&alone));
            }
            assert!(matches!(alone.state.phase, GaitPhase::Standing { .. }));
            assert!(alone.state.preview.com_velocity.norm() < 5e-3);
        }
    }
}
