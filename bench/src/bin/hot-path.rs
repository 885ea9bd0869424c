//! `mikoshi-hot-path PATH LOG`: executes one hot path on a recorded walk, and prints how often. An instrument that
//! counts instructions of [`counted`] alone counts that path, and nothing of what surrounds it: see
//! `bench/tests/instructions.rs`.

use mikoshi_bench::postures::Walk;
use mikoshi_bench::recording::{Recording, WALKING};
use mikoshi_bench::services::{CoordinatorOnRecord, ServoOnRecord};
use mikoshi_humanoid::{IkScratch, Kinematics};
use mikoshi_observation::Observation;
use nalgebra::{Matrix3xX, Matrix6xX};
use std::env;
use std::hint::black_box;
use std::path::Path;
use std::process::ExitCode;

fn main() -> ExitCode {
    let arguments: Vec<_> = env::args().collect();
    let [_, path, log] = arguments.as_slice() else {
        eprintln!("usage: mikoshi-hot-path servo-tick|coordinator-tick|kinematics|inverse-kinematics LOG");
        return ExitCode::from(2);
    };
    let recording = Recording::read(Path::new(log));
    let calls = match path.as_str() {
        "servo-tick" => servo_tick(&recording),
        "coordinator-tick" => coordinator_tick(&recording),
        "kinematics" => kinematics(&Walk::of(&recording, 0)),
        "inverse-kinematics" => inverse_kinematics(&Walk::of(&recording, 0)),
        _ => {
            eprintln!("no such path: {path}");
            return ExitCode::from(2);
        }
    };
    println!("{calls}");
    ExitCode::SUCCESS
}

/// What is counted.
#[inline(never)]
fn counted(call: &mut dyn FnMut()) {
    call();
}

/// Executes it in every tick up to the walk's end, and counts those of the walk.
fn through_the_walk<S>(
    recording: &Recording,
    service: &mut S,
    tick: impl Fn(&mut S, &Observation, Count),
) -> usize {
    for observation in recording.ticks.iter().take(WALKING.end as usize) {
        let count: Count = if WALKING.contains(&observation.tick()) { counted } else { |call| call() };
        tick(service, observation, count);
    }
    WALKING.count()
}

type Count = fn(&mut dyn FnMut());

/// Both halves.
fn servo_tick(recording: &Recording) -> usize {
    through_the_walk(recording, &mut ServoOnRecord::new(recording, 0), |servo, tick, count| {
        servo.tell_sensors(tick);
        count(&mut || servo.sense(tick));
        servo.tell_command(tick);
        count(&mut || servo.act(tick));
        servo.check(tick);
    })
}

/// Of four robots.
fn coordinator_tick(recording: &Recording) -> usize {
    through_the_walk(recording, &mut CoordinatorOnRecord::new(recording), |coordinator, tick, count| {
        coordinator.tell(tick);
        count(&mut || coordinator.coordinate(tick));
        coordinator.check(tick);
    })
}

/// Poses, Jacobians of feet and hands, centre of mass and its Jacobian.
fn kinematics(walk: &Walk) -> usize {
    let (model, config) = (&walk.robot.model, walk.ik.config());
    let columns = 6 + model.joint_count();
    let mut kinematics = Kinematics::new(model);
    let (mut jacobian, mut com_jacobian) = (Matrix6xX::zeros(columns), Matrix3xX::zeros(columns));
    let feet = [config.feet.right, config.feet.left];
    for posture in &walk.postures {
        counted(&mut || {
            kinematics.update(model, &posture.base, &posture.joints);
            for &frame in feet.iter().chain(&config.hands) {
                kinematics.frame_jacobian(model, frame, &mut jacobian);
                black_box(&jacobian);
            }
            kinematics.com_jacobian(model, &mut com_jacobian);
            black_box(&com_jacobian);
        });
    }
    walk.postures.len()
}

/// A tick of eq. 41.
fn inverse_kinematics(walk: &Walk) -> usize {
    let model = &walk.robot.model;
    let mut scratch = IkScratch::new(model);
    for step in &walk.steps {
        let mut state = step.state;
        counted(&mut || {
            let report = walk.ik.solve(model, &mut state, &mut scratch, &step.targets);
            assert!(report.is_ok(), "it is finite");
        });
    }
    walk.steps.len()
}
