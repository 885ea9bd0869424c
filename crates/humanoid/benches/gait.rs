//! What one robot's gait and balance cost per tick.

#[path = "../tests/team/mod.rs"]
mod team;

use divan::{Bencher, black_box};
use mikoshi_humanoid::balance::{
    ExternalLoad, Pendulum, PerFoot, Stabiliser, StabiliserConfig, StabiliserInputs, StabiliserState,
};
use mikoshi_humanoid::gait::{GaitConfig, GaitInputs, GroundPose, StepClock, TeamClock};
use mikoshi_spatial::Wrench;
use nalgebra::Vector3;
use team::{Robot, soles};

fn main() {
    divan::main();
}

/// In its second step's swing.
fn walking() -> Robot {
    let mut robot = Robot::standing_at(GroundPose::default(), GaitConfig::standard(soles()));
    robot.centre.velocity.x = 0.1;
    let timing = robot.gait.config().timing;
    let mut clock = TeamClock::default();
    for _ in 0..timing.step(0) + timing.step(1) / 2 {
        clock = clock.advance(&timing, &[robot.wish()], true);
        robot.act(clock.clock);
    }
    assert!(matches!(clock.clock, StepClock::Stepping { step_index: 1, .. }));
    robot
}

#[divan::bench]
fn gait_with_preview(bencher: Bencher) {
    let robot = walking();
    let inputs = GaitInputs {
        clock: robot.state.clock,
        hand_centre: Some(robot.centre),
        foot_force: PerFoot { right: 550.0, left: 0.0 },
        soles: None,
        load: ExternalLoad::NONE,
    };
    bencher.bench_local(|| {
        let mut state = robot.state;
        robot.gait.act(black_box(&mut state), &inputs)
    });
}

#[divan::bench]
fn wish(bencher: Bencher) {
    let robot = walking();
    bencher.bench_local(|| black_box(&robot).wish());
}

#[divan::bench]
fn stabiliser_on_two_feet(bencher: Bencher) {
    let robot = Robot::standing_at(GroundPose::default(), GaitConfig::standard(soles()));
    let pendulum = Pendulum { mass_kg: 56.0, com_height_m: 0.79 };
    let rest = robot.gait.config().zmp_in_foot;
    let stabiliser = Stabiliser::new(StabiliserConfig::standard(0.005, pendulum, soles(), rest));
    let now = robot.gait.reference(&robot.state);
    let wrench = Wrench::new(Vector3::new(0.0, 0.0, 275.0), Vector3::new(1.0, -4.0, 0.0));
    let inputs = StabiliserInputs {
        com_ref: now.com.xy(),
        com_velocity_ref: now.com_velocity.xy(),
        com_acceleration_ref: now.com_acceleration.xy(),
        com: now.com.xy() + nalgebra::Vector2::new(0.03, 0.05),
        com_velocity: now.com_velocity.xy(),
        standing: PerFoot::from_fn(|side| Some(now.feet[side].pose)),
        ground_wrench: PerFoot { right: wrench, left: wrench },
        load: ExternalLoad::NONE,
    };
    let mut state = StabiliserState::default();
    bencher.bench_local(|| stabiliser.act(black_box(&mut state), black_box(&inputs)));
}
