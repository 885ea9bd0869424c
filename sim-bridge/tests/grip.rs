//! Hands that close and open while the world goes on.

mod common;

use common::{bytes_of, constant_commands, look, standing_team, wrench};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::JointCommand;
use mikoshi_physics::{GRAVITY_M_S2, Physics as _};
use mikoshi_sim_bridge::World;

/// Two robots with open hands where they would hold an object that rests on a pedestal.
fn about_to_grasp(scenario: &str, overrides: &[(&str, &str)]) -> RunSpec {
    let pedestal = r#"[{name = "pedestal", position_m = [0.0, 0.0, 0.405], size_m = [0.3, 0.3, 0.81]}]"#;
    let mut all = vec![
        ("team", "two"),
        ("world.boxes", pedestal),
        ("hybrid.start_s", ""),
        ("job.start_s", "1.0"),
        ("job.draw_back_m", "0.05"),
        ("job.lift_m", "0.03"),
    ];
    all.extend(overrides);
    standing_team(scenario, &all)
}

fn commands(run: &RunSpec, closed_hands: u64) -> Vec<JointCommand> {
    let mut commands = constant_commands(run);
    commands.iter_mut().for_each(|command| command.closed_hands = closed_hands);
    commands
}

fn step(world: &mut World, commands: &[JointCommand], ticks: usize) {
    (0..ticks).for_each(|_| world.step(commands).expect("physics"));
}

fn holding(world: &World) -> Vec<u64> {
    look(world).sensors.iter().map(|sensors| sensors.holding_hands).collect()
}

/// Largest force of a hand on the object.
fn largest_n(world: &World) -> f64 {
    let hands = look(world).robots.into_iter().flat_map(|robot| robot.hand_wrench);
    hands.map(|hand| wrench(&hand).0.norm()).fold(0.0, f64::max)
}

#[test]
fn open_hands_leave_the_object_where_it_rests() {
    for scenario in ["hold", "hold_spring"] {
        let run = about_to_grasp(scenario, &[]);
        let mut world = World::new(&run).expect("a world");
        step(&mut world, &commands(&run, 0), 50);
        assert_eq!(holding(&world), [0, 0], "{scenario}");
        assert_eq!(largest_n(&world), 0.0, "{scenario}");
        let truth = look(&world).object;
        let weight_n = run.scenario.object.mass_kg * GRAVITY_M_S2;
        assert!((truth.support_wrench[2] - weight_n).abs() < 0.01, "{scenario}: {:?}", truth.support_wrench);
        assert_eq!(truth.unintended_contacts, 0, "{scenario}");
    }
}

#[test]
fn hands_close_as_they_are_told_one_by_one_and_open_again() {
    for scenario in ["hold", "hold_spring"] {
        let run = about_to_grasp(scenario, &[("grasp.offset_m", "0.002")]);
        let mut world = World::new(&run).expect("a world");
        let mut half = commands(&run, 0);
        half[0].closed_hands = 0b10;
        step(&mut world, &half, 20);
        assert_eq!(holding(&world), [0b10, 0], "{scenario}");
        let seen = look(&world);
        assert!(wrench(&seen.robots[0].hand_wrench[1]).0.norm() > 0.5, "{scenario}");
        assert_eq!(seen.robots[0].hand_wrench[0], [0.0; 6], "{scenario}");

        step(&mut world, &commands(&run, 0b11), 20);
        assert_eq!(holding(&world), [0b11, 0b11], "{scenario}");
        step(&mut world, &commands(&run, 0), 1);
        assert_eq!(holding(&world), [0, 0], "{scenario}");
        step(&mut world, &commands(&run, 0), 1);
        assert_eq!(largest_n(&world), 0.0, "{scenario}");
    }
}

#[test]
fn a_hand_that_is_not_near_its_place_does_not_close() {
    let mut run = about_to_grasp("hold", &[]);
    // A place 3 cm from where the palm is.
    run.robots[1].hand_in_object[0][1] += 0.03;
    let mut world = World::new(&run).expect("a world");
    step(&mut world, &commands(&run, 0b11), 20);
    assert_eq!(holding(&world), [0b11, 0b10]);
}

#[test]
fn without_a_job_hands_hold_from_the_beginning() {
    let run = standing_team("hold", &[("team", "two")]);
    assert_eq!(holding(&World::new(&run).expect("a world")), [0b11, 0b11]);
}

#[test]
fn what_hands_hold_is_in_a_checkpoint() {
    let run = about_to_grasp("hold", &[]);
    let mut world = World::new(&run).expect("a world");
    step(&mut world, &commands(&run, 0b01), 10);
    let mut checkpoint = vec![0; world.checkpoint_size()];
    world.save(&mut checkpoint).expect("room");
    let go_on = |world: &mut World| {
        step(world, &commands(&run, 0b11), 7);
        step(world, &commands(&run, 0b10), 7);
        bytes_of(&look(world))
    };
    let expected = go_on(&mut world);
    let mut successor = World::new(&run).expect("a world");
    successor.load(&checkpoint).expect("it is of this world");
    assert!(go_on(&mut successor) == expected);
    assert_eq!(holding(&successor), [0b10, 0b10]);
}
