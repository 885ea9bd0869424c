//! What the parts cost, all in one run: `make bench-parts`, or without Pinocchio `cargo bench --workspace --bench parts`.
//!
//! Prints tables, and leaves all of it in `target/parts.json`.

use mikoshi_bench::pinocchio::{self, Pinocchio};
use mikoshi_bench::postures::Walk;
use mikoshi_bench::recording::Recording;
use mikoshi_bench::table::{print_comparisons, print_times};
use mikoshi_bench::{beside_pinocchio, bridge, parts, recorder};
use mikoshi_tests::programs;
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::Path;
use std::{env, fs};

fn main() {
    let recording = Recording::of_walking();
    let walk = Walk::of(&recording, 0);

    let services = parts::of_walking_services(&recording);
    print_times("while four robots walk", &services);
    let of_a_servo = parts::of_a_servo(&walk);
    print_times("parts of a servo's tick", &of_a_servo);

    println!();
    let physics = [("tick of the bridge, beside as many steps of MuJoCo", bridge::measure(&recording))];
    print_comparisons("", "MuJoCo", &physics);

    let log = recorder::measure(&recording);
    println!(
        "\nthe recorder writes {:.0} frames/s, {:.0} MB/s; four robots have {:.0} frames/s, {:.1} MB/s",
        log.frames_per_s, log.megabytes_per_s, log.needed_frames_per_s, log.needed_megabytes_per_s
    );
    println!(
        "a tick's frames take {:.0} µs in the median, {:.0} µs in 99 of 100; a log has {:.0} % of their size",
        log.tick_us.median,
        log.tick_us.p99,
        1e2 * log.packed_to
    );

    println!();
    let beside = match env::var_os(pinocchio::FOLDER) {
        Some(folder) => {
            let rows = beside_pinocchio::measure(&walk, &Pinocchio::open(Path::new(&folder), &walk));
            print_comparisons("kinematics of HRP-2", "Pinocchio", &rows);
            table_of(rows)
        }
        None => {
            println!("Pinocchio is not asked: `make bench-parts` does so ({} is not set)", pinocchio::FOLDER);
            Value::Null
        }
    };
    let all = json!({
        "walking_us": table_of(services),
        "servo_parts_us": table_of(of_a_servo),
        "bridge_beside_mujoco": table_of(physics),
        "recorder": log,
        "beside_pinocchio": beside,
    });
    let path = programs::folder().with_file_name("parts.json");
    let text = serde_json::to_string_pretty(&all).expect("numbers and names");
    fs::write(&path, text + "\n").unwrap_or_else(|error| panic!("{}: {error}", path.display()));
}

fn table_of<T: serde::Serialize>(rows: impl IntoIterator<Item = (&'static str, T)>) -> Value {
    let rows: BTreeMap<_, _> = rows.into_iter().map(|(name, row)| (name.trim(), row)).collect();
    json!(rows)
}
