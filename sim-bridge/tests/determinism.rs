//! A world is a function of its run and of the commands, and goes on from a checkpoint to the last bit.

mod common;

use common::{bytes_of, look, standing_team, swinging_commands};
use mikoshi_config::RunSpec;
use mikoshi_physics::{LoadWorldError, Physics as _};
use mikoshi_sim_bridge::World;

const NOISY: &[(&str, &str)] = &[
    ("team", "two"),
    ("sensors.force_noise_n", "0.5"),
    ("sensors.moment_noise_nm", "0.05"),
    ("sensors.encoder_noise_rad", "1e-5"),
    ("sensors.gyro_noise_rad_s", "1e-3"),
    ("sensors.accelerometer_noise_m_s2", "0.02"),
    ("sensors.delay_ticks", "2"),
];

/// Steps through these ticks and returns all that was said on the way.
fn play(world: &mut World, run: &RunSpec, ticks: core::ops::Range<u64>) -> Vec<Vec<u8>> {
    let mut said = vec![];
    for tick in ticks {
        assert_eq!(world.tick(), tick);
        world.step(&swinging_commands(run, tick as f64 * 0.005, 0.02)).expect("physics");
        said.push(bytes_of(&look(world)));
    }
    said
}

#[test]
fn a_world_goes_on_from_a_checkpoint_to_the_last_bit() {
    for grasp in ["hold", "hold_spring"] {
        let run = standing_team(grasp, NOISY);
        let mut world = World::new(&run).expect("a world");
        play(&mut world, &run, 0..37);
        let mut checkpoint = vec![0; world.checkpoint_size()];
        world.save(&mut checkpoint).expect("room");
        let at_checkpoint = bytes_of(&look(&world));
        let expected = play(&mut world, &run, 37..80);

        world.load(&checkpoint).expect("a checkpoint");
        assert_eq!(bytes_of(&look(&world)), at_checkpoint);
        assert!(play(&mut world, &run, 37..80) == expected, "{grasp}: the same world");

        let mut successor = World::new(&run).expect("a world");
        successor.load(&checkpoint).expect("a checkpoint");
        assert_eq!(bytes_of(&look(&successor)), at_checkpoint);
        assert!(play(&mut successor, &run, 37..80) == expected, "{grasp}: a successor");
    }
}

#[test]
fn two_worlds_of_one_run_say_the_same_and_of_another_seed_do_not() {
    let run = standing_team("hold", NOISY);
    let first = play(&mut World::new(&run).expect("a world"), &run, 0..20);
    assert!(first == play(&mut World::new(&run).expect("a world"), &run, 0..20));
    let mut other = run.clone();
    other.scenario.seed = 1;
    assert!(first != play(&mut World::new(&other).expect("a world"), &other, 0..20));
}

#[test]
fn a_checkpoint_of_another_size_is_refused() {
    let run = standing_team("hold", &[("team", "two")]);
    let mut world = World::new(&run).expect("a world");
    let expected = world.checkpoint_size();
    let mut short = vec![0; expected - 1];
    let refusal = Err(LoadWorldError { found: expected - 1, expected });
    assert_eq!(world.save(&mut short), refusal);
    assert_eq!(world.load(&short), refusal);
}
