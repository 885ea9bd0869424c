//! What sensors add to the truth: noise and delay, by seed.

mod common;

use common::{constant_commands, look, standing_team, swinging_commands};
use mikoshi_ipc_types::Sensors;
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World;

/// What robot `robot` reads at each of the first ticks, all joints swinging.
fn readings(overrides: &[(&str, &str)], robot: usize, ticks: u64) -> Vec<Sensors> {
    let mut all = vec![("team", "two")];
    all.extend(overrides);
    let run = standing_team("hold", &all);
    let mut world = World::new(&run).expect("a world");
    let mut readings = vec![look(&world).sensors[robot]];
    for tick in 0..ticks {
        world.step(&swinging_commands(&run, tick as f64 * 0.005, 0.02)).expect("physics");
        readings.push(look(&world).sensors[robot]);
    }
    readings
}

#[test]
fn delayed_sensors_say_what_they_would_have_said_and_tick_0_before_that() {
    let (prompt, late) = (readings(&[], 1, 12), readings(&[("sensors.delay_ticks", "3")], 1, 12));
    for (tick, reading) in late.iter().enumerate() {
        assert!(*reading == prompt[tick.saturating_sub(3)], "tick {tick}");
    }
    assert!(prompt[5] != prompt[4]);
}

#[test]
fn noise_has_the_configured_deviation_in_every_channel() {
    let noisy = [
        ("sensors.force_noise_n", "0.5"),
        ("sensors.moment_noise_nm", "0.05"),
        ("sensors.encoder_noise_rad", "1e-4"),
        ("sensors.gyro_noise_rad_s", "1e-3"),
        ("sensors.accelerometer_noise_m_s2", "0.02"),
    ];
    let (truth, noisy) = (readings(&[], 0, 1500), readings(&noisy, 0, 1500));
    let deviation = |channel: &dyn Fn(&Sensors) -> f64| {
        let squares = truth.iter().zip(&noisy).map(|(a, b)| (channel(b) - channel(a)).powi(2));
        (squares.sum::<f64>() / truth.len() as f64).sqrt()
    };
    let check = |name: &str, found: f64, expected: f64| {
        assert!((found / expected - 1.0).abs() < 0.1, "{name}: {found}, expected {expected}");
    };
    for joint in 0..28 {
        check("angle", deviation(&|s| s.joint_position_rad[joint]), 1e-4);
        // The quotient of two angles, each with its own noise.
        check("rate", deviation(&|s| s.joint_velocity_rad_s[joint]), 1e-4 * 2.0_f64.sqrt() / 0.005);
    }
    for side in 0..2 {
        for axis in 0..6 {
            let expected = if axis < 3 { 0.5 } else { 0.05 };
            check("wrist", deviation(&|s| s.wrist_wrench[side][axis]), expected);
            check("ankle", deviation(&|s| s.ankle_wrench[side][axis]), expected);
        }
    }
    for axis in 0..3 {
        check("gyroscope", deviation(&|s| s.imu_angular_velocity_rad_s[axis]), 1e-3);
        check("accelerometer", deviation(&|s| s.imu_specific_force_m_s2[axis]), 0.02);
    }
    let torques = truth.iter().zip(&noisy);
    assert!(torques.into_iter().all(|(a, b)| a.joint_torque_nm == b.joint_torque_nm));
}

#[test]
fn encoder_rates_are_the_quotients_of_noisy_angles() {
    let overrides = [("sensors.encoder_noise_rad", "1e-3")];
    let (truth, noisy) = (readings(&[], 0, 20), readings(&overrides, 0, 20));
    let noise = |tick: usize, joint: usize| {
        noisy[tick].joint_position_rad[joint] - truth[tick].joint_position_rad[joint]
    };
    for tick in 1..=20 {
        for joint in 0..28 {
            let added = noisy[tick].joint_velocity_rad_s[joint] - truth[tick].joint_velocity_rad_s[joint];
            let quotient = (noise(tick, joint) - noise(tick - 1, joint)) / 0.005;
            assert!((added - quotient).abs() < 1e-9);
        }
    }
}

#[test]
fn no_noise_is_drawn_twice() {
    let overrides = [("sensors.encoder_noise_rad", "1e-3")];
    let (truth, noisy) = (readings(&[], 0, 40), readings(&overrides, 0, 40));
    let pairs = truth
        .iter()
        .zip(&noisy)
        .flat_map(|(a, b)| a.joint_position_rad[..28].iter().zip(&b.joint_position_rad[..28]));
    let mut noise: Vec<i64> = pairs.map(|(a, b)| ((b - a) * 1e13).round() as i64).collect();
    noise.sort_unstable();
    assert!(noise.windows(2).all(|pair| pair[0] != pair[1]));
}

#[test]
fn robots_do_not_share_their_noise() {
    let run = standing_team("hold", &[("team", "two"), ("sensors.gyro_noise_rad_s", "1.0")]);
    let mut world = World::new(&run).expect("a world");
    world.step(&constant_commands(&run)).expect("physics");
    let sensors = look(&world).sensors;
    assert_ne!(sensors[0].imu_angular_velocity_rad_s, sensors[1].imu_angular_velocity_rad_s);
}
