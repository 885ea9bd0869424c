//! Hands that lose the object when the scenario says so.

mod common;

use common::{bytes_of, constant_commands, look, standing_team, wrench};
use mikoshi_config::RunSpec;
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World;

/// The tick from which the second robot's left hand holds nothing.
const LOST: usize = 20;

fn failing(scenario: &str, how: &str) -> RunSpec {
    let failure = format!(r#"[{{robot = "B", hand = "left", at_s = 0.1, {how}}}]"#);
    standing_team(scenario, &[("team", "two"), ("world.grasp_failures", failure.as_str())])
}

fn step(world: &mut World, run: &RunSpec, ticks: usize) {
    let commands = constant_commands(run);
    (0..ticks).for_each(|_| world.step(&commands).expect("physics"));
}

/// Index of the left hand among the hands that grasp.
fn left(run: &RunSpec) -> usize {
    let robot = &run.robots[1];
    robot.grasping_hands.iter().position(|&hand| robot.config.hands[hand].name == "left").expect("it has one")
}

fn force_n(world: &World, robot: usize, hand: usize) -> f64 {
    wrench(&look(world).robots[robot].hand_wrench[hand]).0.norm()
}

#[test]
fn a_hand_that_opens_passes_nothing_on_and_says_that_it_holds() {
    for scenario in ["hold", "hold_spring"] {
        let run = failing(scenario, r#"kind = "open""#);
        let mut world = World::new(&run).expect("a world");
        step(&mut world, &run, LOST);
        assert!(force_n(&world, 1, left(&run)) > 1.0, "{scenario}");
        step(&mut world, &run, 2);
        assert_eq!(force_n(&world, 1, left(&run)), 0.0, "{scenario}");
        assert!(force_n(&world, 1, 1 - left(&run)) > 1.0, "{scenario}");
        assert_eq!(look(&world).sensors[1].holding_hands, 0b11, "{scenario}");
    }
}

#[test]
fn a_gripper_that_notices_says_so() {
    let run = failing("hold", r#"kind = "open", is_noticed = true"#);
    let mut world = World::new(&run).expect("a world");
    step(&mut world, &run, LOST);
    assert_eq!(look(&world).sensors[1].holding_hands, 0b11);
    step(&mut world, &run, 5);
    assert_eq!(look(&world).sensors[1].holding_hands, 0b11 & !(1 << left(&run)));
    assert_eq!(force_n(&world, 1, left(&run)), 0.0);
}

#[test]
fn a_hand_that_slips_passes_on_what_friction_bears() {
    let run = failing("hold", r#"kind = "slip", friction_n = 3.0"#);
    let mut world = World::new(&run).expect("a world");
    step(&mut world, &run, LOST + 2);
    for _ in 0..200 {
        let force_n = force_n(&world, 1, left(&run));
        assert!(force_n > 0.0 && force_n < 3.0 + 1e-9, "{force_n}");
        step(&mut world, &run, 1);
    }
    // Told to open, it slips no more.
    let mut commands = constant_commands(&run);
    commands[1].closed_hands = 0b11 & !(1 << left(&run));
    (0..2).for_each(|_| world.step(&commands).expect("physics"));
    assert_eq!(force_n(&world, 1, left(&run)), 0.0);
}

#[test]
fn before_it_fails_nothing_is_different() {
    let failing = failing("hold", r#"kind = "slip""#);
    let sound = standing_team("hold", &[("team", "two")]);
    let at = |run: &RunSpec, ticks| {
        let mut world = World::new(run).expect("a world");
        step(&mut world, run, ticks);
        bytes_of(&look(&world))
    };
    assert!(at(&failing, LOST) == at(&sound, LOST));
    assert!(at(&failing, LOST + 2) != at(&sound, LOST + 2));
}

#[test]
fn a_successor_loses_what_its_predecessor_was_to_lose() {
    for ticks in [LOST - 5, LOST + 5] {
        let run = failing("hold", r#"kind = "slip""#);
        let mut world = World::new(&run).expect("a world");
        step(&mut world, &run, ticks);
        let mut checkpoint = vec![0; world.checkpoint_size()];
        world.save(&mut checkpoint).expect("room");
        let mut successor = World::new(&run).expect("a world");
        successor.load(&checkpoint).expect("it is of this world");
        step(&mut world, &run, 20);
        step(&mut successor, &run, 20);
        assert!(bytes_of(&look(&world)) == bytes_of(&look(&successor)));
    }
}
