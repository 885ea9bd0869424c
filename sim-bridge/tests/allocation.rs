//! A tick of the world allocates nothing.

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use common::{standing_team, swinging_commands};
use mikoshi_ipc_types::{ObjectTruth, RobotTruth, Sensors};
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World;

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

#[test]
fn a_tick_of_the_world_allocates_nothing() {
    for grasp in ["hold", "hold_spring"] {
        let overrides = [("team", "two"), ("sensors.force_noise_n", "0.5"), ("sensors.delay_ticks", "2")];
        let run = standing_team(grasp, &overrides);
        let mut world = World::new(&run).expect("a world");
        let mut checkpoint = vec![0; world.checkpoint_size()];
        let (mut sensors, mut truth, mut object) =
            (Sensors::zeroed(), RobotTruth::zeroed(), ObjectTruth::zeroed());
        for tick in 0..50 {
            let commands = swinging_commands(&run, tick as f64 * 0.005, 0.02);
            assert_no_alloc(|| {
                for robot in 0..world.robot_count() {
                    world.sense(robot, &mut sensors);
                    world.robot_truth(robot, &mut truth);
                }
                world.object_truth(&mut object);
                world.step(&commands).expect("physics");
                world.save(&mut checkpoint).expect("room");
            });
        }
        assert_no_alloc(|| world.load(&checkpoint).expect("a checkpoint"));
    }
}
