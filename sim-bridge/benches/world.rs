//! What a tick of physics costs, by team: five steps of 1 ms, standing, the object in all hands.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{constant_commands, standing_team};
use mikoshi_physics::Physics as _;
use mikoshi_sim_bridge::World;

fn main() {
    divan::main();
}

#[divan::bench(args = ["two", "four", "eight"], sample_count = 200, sample_size = 5)]
fn tick(bencher: divan::Bencher, team: &str) {
    let run = standing_team("hold", &[("team", team)]);
    let mut world = World::new(&run).expect("a world");
    let commands = constant_commands(&run);
    bencher.bench_local(|| world.step(&commands));
}
