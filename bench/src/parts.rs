//! What a robot's and the team's ticks take while they walk, and what the parts of a robot's do.

use crate::postures::Walk;
use crate::recording::{Recording, WALKING};
use crate::rounds::{Spread, measure, time_us};
use crate::services::{CoordinatorOnRecord, ServoOnRecord};
use crate::team::{Robot as IdealRobot, soles};
use mikoshi_humanoid::balance::{
    ExternalLoad, Pendulum, PerFoot, Stabiliser, StabiliserConfig, StabiliserInputs, StabiliserState,
};
use mikoshi_humanoid::estimate::{BaseEstimator, BaseEstimatorGains, FootContact, Readings};
use mikoshi_humanoid::gait::{GaitConfig, GaitInputs, GroundPose, StepClock, TeamClock};
use mikoshi_humanoid::{IkScratch, Kinematics};
use mikoshi_spatial::{Twist, Wrench};
use nalgebra::{Vector2, Vector3};
use std::hint::black_box;

/// A part, and its time \[µs\].
pub type Row = (&'static str, Spread);

/// As often each tick of the walk is timed.
const REPETITIONS: usize = 5;

/// From frame to frame, over all ticks of the walk.
pub fn of_walking_services(recording: &Recording) -> Vec<Row> {
    let [mut sense, mut act, mut both, mut keep, mut coordinate] = [const { Vec::<f64>::new() }; 5];
    let mut checkpoint = vec![];
    for repetition in 0..REPETITIONS {
        let mut servo = ServoOnRecord::new(recording, repetition % recording.run.robots.len());
        let mut coordinator = CoordinatorOnRecord::new(recording);
        for tick in recording.ticks.iter().take(WALKING.end as usize) {
            servo.tell_sensors(tick);
            let sense_us = time_us(|| servo.sense(tick));
            coordinator.tell(tick);
            let coordinate_us = time_us(|| coordinator.coordinate(tick));
            coordinator.check(tick);
            servo.tell_command(tick);
            let act_us = time_us(|| servo.act(tick));
            servo.check(tick);
            let keep_us = time_us(|| servo.keep(&mut checkpoint));
            if WALKING.contains(&tick.tick()) {
                sense.push(sense_us);
                act.push(act_us);
                both.push(sense_us + act_us);
                keep.push(keep_us);
                coordinate.push(coordinate_us);
            }
        }
    }
    vec![
        ("servo, whole tick", Spread::of(both)),
        ("  senses", Spread::of(sense)),
        ("  acts", Spread::of(act)),
        ("  its state is kept, each half", Spread::of(keep)),
        ("coordinator, whole tick, four robots", Spread::of(coordinate)),
    ]
}

/// Parts of a servo's tick, each by itself.
pub fn of_a_servo(walk: &Walk) -> Vec<Row> {
    vec![
        ("estimate of the base", estimate(walk)),
        ("kinematics", kinematics(walk)),
        ("Jacobians against the stance foot, centre of mass", jacobians(walk)),
        ("inverse kinematics", inverse_kinematics(walk)),
        ("inverse kinematics, hands out of reach", out_of_reach(walk)),
        ("gait with preview", gait()),
        ("stabiliser", stabiliser()),
    ]
}

fn estimate(walk: &Walk) -> Spread {
    let (model, config) = (&walk.robot.model, walk.ik.config());
    let estimator = BaseEstimator {
        imu: walk.robot.imu,
        feet: config.feet,
        period_s: config.period_s,
        gains: BaseEstimatorGains::default(),
    };
    let first = &walk.postures[0];
    let mut state = estimator.start(model, &first.base, &first.joints);
    let mut kinematics = Kinematics::new(model);
    kinematics.update(model, &first.base, &first.joints);
    let feet = PerFoot::from_fn(|side| FootContact {
        pose: kinematics.frame_pose(model, config.feet[side]),
        weight: 0.5,
    });
    measure(&mut |first, count| {
        for posture in walk.postures.iter().cycle().skip(first % walk.postures.len()).take(count) {
            let readings = Readings {
                joint_position: &posture.joints,
                joint_velocity: &posture.rates,
                angular_velocity: posture.angular_velocity,
                specific_force: posture.specific_force,
            };
            black_box(estimator.update(model, &mut state, &mut kinematics, &readings, &feet));
        }
    })
}

fn kinematics(walk: &Walk) -> Spread {
    let mut kinematics = Kinematics::new(&walk.robot.model);
    measure(&mut |first, count| {
        for posture in walk.postures.iter().cycle().skip(first % walk.postures.len()).take(count) {
            kinematics.update(&walk.robot.model, &posture.base, &posture.joints);
            black_box(kinematics.com());
        }
    })
}

fn jacobians(walk: &Walk) -> Spread {
    let (model, config) = (&walk.robot.model, walk.ik.config());
    let mut kinematics = Kinematics::new(model);
    kinematics.update(model, &walk.postures[0].base, &walk.postures[0].joints);
    let stance = config.feet.right;
    let tasks = [config.waist, config.feet.left].into_iter().chain(config.hands.iter().copied());
    let tasks: Vec<_> = tasks.collect();
    measure(&mut |_, count| {
        for _ in 0..count {
            for &frame in &tasks {
                kinematics.stance_columns(model, frame, black_box(stance)).for_each(|column| {
                    black_box(column);
                });
            }
            kinematics.stance_com_columns(model, black_box(stance)).for_each(|column| {
                black_box(column);
            });
        }
    })
}

fn inverse_kinematics(walk: &Walk) -> Spread {
    let mut scratch = IkScratch::new(&walk.robot.model);
    measure(&mut |first, count| {
        for step in walk.steps.iter().cycle().skip(first % walk.steps.len()).take(count) {
            let mut state = step.state;
            black_box(walk.ik.solve(&walk.robot.model, &mut state, &mut scratch, &step.targets))
                .expect("it is finite");
        }
    })
}

/// The worst that references do: both hands at speed limits, on the way to where they can't go.
fn out_of_reach(walk: &Walk) -> Spread {
    let mut scratch = IkScratch::new(&walk.robot.model);
    let first = &walk.steps[0];
    let mut state = first.state;
    measure(&mut |first_call, count| {
        for call in first_call..first_call + count {
            let side = if call % 400 < 200 { 1.0 } else { -1.0 };
            let mut targets = first.targets;
            for hand in targets.hands.iter_mut().flatten() {
                let way = Vector3::new(0.5 * side, -0.3 * side, 0.2);
                *hand = hand.displaced(&Twist::new(way, Vector3::zeros()));
            }
            black_box(walk.ik.solve(&walk.robot.model, &mut state, &mut scratch, &targets))
                .expect("it is finite");
        }
    })
}

/// In its second step's swing.
fn walking() -> IdealRobot {
    let mut robot = IdealRobot::standing_at(GroundPose::default(), GaitConfig::standard(soles()));
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

fn gait() -> Spread {
    let robot = walking();
    let inputs = GaitInputs {
        clock: robot.state.clock,
        hand_centre: Some(robot.centre),
        foot_force: PerFoot { right: 550.0, left: 0.0 },
        soles: None,
        sole_heights: None,
        load: ExternalLoad::NONE,
        divergent_component: None,
        soles_turn: PerFoot { right: false, left: false },
    };
    measure(&mut |_, count| {
        for _ in 0..count {
            let mut state = robot.state;
            robot.gait.act(black_box(&mut state), &inputs);
            black_box(&state);
        }
    })
}

fn stabiliser() -> Spread {
    let robot = IdealRobot::standing_at(GroundPose::default(), GaitConfig::standard(soles()));
    let pendulum = Pendulum { mass_kg: 56.0, com_height_m: 0.79 };
    let rest = robot.gait.config().zmp_in_foot;
    let stabiliser = Stabiliser::new(StabiliserConfig::standard(0.005, pendulum, soles(), rest));
    let now = robot.gait.reference(&robot.state);
    let wrench = Wrench::new(Vector3::new(0.0, 0.0, 275.0), Vector3::new(1.0, -4.0, 0.0));
    let inputs = StabiliserInputs {
        com_ref: now.com.xy(),
        com_velocity_ref: now.com_velocity.xy(),
        com_acceleration_ref: now.com_acceleration.xy(),
        com: now.com.xy() + Vector2::new(0.03, 0.05),
        com_velocity: now.com_velocity.xy(),
        standing: PerFoot::from_fn(|side| Some(now.feet[side].pose)),
        ground_wrench: PerFoot { right: wrench, left: wrench },
        load: ExternalLoad::NONE,
        rests: false,
    };
    let mut state = StabiliserState::default();
    measure(&mut |_, count| {
        for _ in 0..count {
            black_box(stabiliser.act(&mut state, black_box(&inputs)));
        }
    })
}
