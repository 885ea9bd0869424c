//! The files that Mikoshi ships load, and say what their comments say.

use mikoshi_config::scenario::{Grasp, Scenario};
use mikoshi_config::{LoadedScenario, SweepFile, load_scenario, load_sweep_file};
use std::fs;
use std::path::{Path, PathBuf};

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(name)
}

fn names_in(name: &str) -> Vec<String> {
    let files = fs::read_dir(folder(name)).unwrap().map(|entry| entry.unwrap().path());
    files
        .filter(|path| path.is_file())
        .map(|path| path.file_stem().unwrap().to_str().unwrap().to_owned())
        .collect()
}

fn load(name: &str, overrides: &[(&str, &str)]) -> LoadedScenario {
    let overrides: Vec<_> =
        overrides.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    let path = folder("scenarios").join(name).with_extension("toml");
    load_scenario(&path, &overrides, None).unwrap_or_else(|error| panic!("{error}"))
}

/// Palm centres of the whole team in the world, by the carry positions of the models.
fn palms(loaded: &LoadedScenario) -> Vec<[f64; 3]> {
    let of_member = |member: &mikoshi_config::scenario::Member| {
        let (sin, cos) = member.yaw_deg.to_radians().sin_cos();
        let hands = loaded.models[&member.model].config.hands.clone();
        let (x, y) = (member.x_m, member.y_m);
        hands.into_iter().map(move |hand| {
            let [ahead, left, up] = hand.carry_position_m;
            [x + cos * ahead - sin * left, y + sin * ahead + cos * left, up]
        })
    };
    loaded.scenario.robots.iter().flat_map(of_member).collect()
}

#[test]
fn every_scenario_is_called_as_its_file() {
    for name in names_in("scenarios") {
        assert_eq!(load(&name, &[]).scenario.name, name);
    }
}

#[test]
fn teams_of_all_sizes_have_a_scenario_that_carries_for_twenty_seconds() {
    for (file, robots) in [("2", 2), ("3", 3), ("5", 5), ("8", 8)] {
        let scenario = load(&format!("teams/{file}"), &[]).scenario;
        assert_eq!(
            (scenario.name.as_str(), scenario.robots.len()),
            (format!("team_{file}").as_str(), robots)
        );
        let random = scenario.motion.expect("it moves").random.expect("by seed");
        assert_eq!(random.duration_s, 20.0);
    }
}

/// As people type them who are in a folder of scenarios, or in one within.
#[test]
fn a_scenario_finds_its_team_from_wherever_it_is_typed() {
    let scenarios = folder("scenarios");
    for path in ["teams/8.toml", "teams/../hold.toml", "./hold.toml", "../scenarios/teams/2.toml"] {
        load_scenario(&scenarios.join(path), &[], None).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
}

#[test]
fn every_team_can_run_the_hold_scenario() {
    for team in names_in("teams") {
        let scenario = load("hold", &[("team", &team)]).scenario;
        assert_eq!(scenario.team, Some(team));
        assert_eq!(scenario.ticks(), 4400);
        assert_eq!(scenario.substeps(), 5);
    }
}

#[test]
fn teams_have_as_many_robots_as_they_are_called() {
    for (team, robots) in [("two", 2), ("three", 3), ("four", 4), ("five", 5), ("eight", 8)] {
        assert_eq!(load("hold", &[("team", team)]).scenario.robots.len(), robots);
    }
}

#[test]
fn all_palms_of_all_teams_touch_the_objects_long_faces() {
    for team in names_in("teams") {
        let loaded = load("hold", &[("team", &team)]);
        let Scenario { object, .. } = &loaded.scenario;
        for [x, y, z] in palms(&loaded) {
            assert!((x.abs() - object.size_m[0] / 2.0).abs() < 1e-9, "{team}: palm at x = {x}");
            assert!(y.abs() < object.size_m[1] / 2.0, "{team}: palm at y = {y}");
            assert!((z - object.position_m[2]).abs() < 1e-9, "{team}: palm at z = {z}");
        }
    }
}

#[test]
fn robots_of_one_side_stand_nine_tenths_of_a_metre_apart_or_further() {
    for team in names_in("teams") {
        let robots = load("hold", &[("team", &team)]).scenario.robots;
        for (i, a) in robots.iter().enumerate() {
            for b in &robots[..i] {
                let same_side = a.x_m == b.x_m;
                assert!(!same_side || (a.y_m - b.y_m).abs() > 0.899, "{team}: {} and {}", a.name, b.name);
            }
        }
    }
}

#[test]
fn hold_is_the_papers_section_4_3() {
    let scenario = load("hold", &[]).scenario;
    assert_eq!(scenario.hybrid.start_s, Some(10.5));
    assert_eq!(scenario.object.mass_kg, 3.0);
    assert_eq!(scenario.object.size_m, [0.6, 1.6, 0.3]);
    assert_eq!(scenario.grasp, Grasp::Weld { offset_m: 0.002 });
}

#[test]
fn every_sweep_is_called_as_its_file_and_can_be_run() {
    for name in names_in("sweeps") {
        let path = folder("sweeps").join(&name).with_extension("toml");
        let loaded = load_sweep_file(&path).unwrap_or_else(|error| panic!("{error}"));
        let sweeps = match loaded {
            SweepFile::Sweep(sweep) => vec![(name, *sweep)],
            SweepFile::Survey(survey) => {
                assert_eq!(survey.survey.name, name);
                survey.survey.sweeps.into_iter().zip(survey.sweeps).collect()
            }
        };
        for (name, loaded) in sweeps {
            assert_eq!(loaded.sweep.name, name);
            let scenario = load_scenario(&loaded.scenario, &loaded.runs(1)[0].overrides, None);
            scenario.unwrap_or_else(|error| panic!("{error}"));
        }
    }
}

#[test]
fn pick_and_place_leads_from_one_pedestal_to_the_other() {
    let scenario = load("pick_and_place", &[]).scenario;
    let object = &scenario.object;
    let [start, goal] = scenario.world.boxes.as_slice() else { panic!("two pedestals") };
    for pedestal in [start, goal] {
        let top_m = pedestal.position_m[2] + pedestal.size_m[2] / 2.0;
        assert!((top_m - (object.position_m[2] - object.size_m[2] / 2.0)).abs() < 1e-9);
    }
    let motion = scenario.motion.expect("the object moves");
    let (mut way_m, mut turn_rad) = ([0.0; 3], 0.0);
    for segment in &motion.segments {
        for (way, velocity) in way_m.iter_mut().zip(segment.velocity_m_s) {
            *way += segment.duration_s * velocity;
        }
        turn_rad += segment.duration_s * segment.angular_velocity_rad_s[2];
    }
    for ((start, way), goal) in start.position_m.iter().zip(way_m).zip(goal.position_m) {
        assert!((start + way - goal).abs() < 1e-9);
    }
    assert!((turn_rad - (goal.yaw_deg - start.yaw_deg).to_radians()).abs() < 1e-3);
    // They pass between the robots of both sides: toes are 0.14 m ahead.
    for pedestal in [start, goal] {
        let [x, y, _] = pedestal.size_m;
        let reach_m = 0.5 * x.hypot(y);
        assert!(scenario.robots.iter().all(|robot| robot.x_m.abs() - 0.14 - reach_m > 0.25));
    }
}
