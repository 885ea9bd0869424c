//! Bad input: the exact text that its writer sees.
//!
//! Each case changes one file of `fixture/` or adds options; paths in the expected text are relative to it.

mod common;

use common::{fixture, original};
use mikoshi_config::{LoadConfigError, LoadedScenario, load_robot, load_scenario};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

const SCENARIO: &str = "scenarios/lift.toml";
const TEAM: &str = "teams/pair.toml";
const ROBOT: &str = "robots/arm.toml";

fn load(root: &Path, options: &[&str]) -> Result<LoadedScenario, LoadConfigError> {
    let pairs = options.iter().map(|option| option.split_once('=').unwrap());
    let overrides: Vec<_> = pairs.map(|(key, value)| (key.to_owned(), value.to_owned())).collect();
    load_scenario(&root.join(SCENARIO), &overrides, None)
}

fn text_of<T>(root: &Path, result: Result<T, LoadConfigError>) -> String {
    let error = result.err().expect("the input is bad").to_string();
    error.replace(&format!("{}/", root.display()), "")
}

/// The text for `file` with `good` replaced by `bad`.
#[track_caller]
fn file_gives(file: &str, good: &str, bad: &str, expected: &str) {
    let root = fixture();
    let path = root.path().join(file);
    let text = fs::read_to_string(&path).unwrap();
    assert_eq!(text.matches(good).count(), 1, "{good:?} is to be found once");
    fs::write(&path, text.replace(good, bad)).unwrap();
    assert_eq!(text_of(root.path(), load(root.path(), &[])), expected);
}

/// The text for options `key=value`.
#[track_caller]
fn options_give(options: &[&str], expected: &str) {
    let root = fixture();
    assert_eq!(text_of(root.path(), load(root.path(), options)), expected);
}

#[test]
fn the_fixture_itself_is_good() {
    let root = fixture();
    let loaded = load(root.path(), &[]).unwrap();
    assert_eq!(loaded.scenario.robots[1].hands, Some(vec!["tool".to_owned()]));
    assert_eq!(loaded.models["arm"].urdf_path, root.path().join("robots/arm.urdf"));
}

#[test]
fn no_object_is_carried_faster_than_anybody_can() {
    for key in ["travel_m", "travel_rad", "deviation_m_s", "deviation_rad_s"] {
        let root = fixture();
        let random = ["motion.random.duration_s=1", "motion.random.change_s=1", "motion.start_s=0.5"];
        let fast = format!("motion.random.{key}=[0.0, 0.0, 1e308]");
        let options = [&random[..], &[fast.as_str()]].concat();
        let told = text_of(root.path(), load(root.path(), &options));
        assert!(told.contains(&format!("motion.random.{key}")) && told.contains("at most 10"), "{told}");
    }
}

#[test]
fn malformed_toml_names_the_line() {
    file_gives(
        SCENARIO,
        "kind = \"weld\"",
        "kind = \"weld",
        "scenarios/lift.toml:8: not valid TOML: invalid basic string, expected `\"`",
    );
    file_gives(
        TEAM,
        "[object]",
        "[object",
        "teams/pair.toml:1: not valid TOML: unclosed table, expected `]`",
    );
    file_gives(
        SCENARIO,
        "kz = 0.05",
        "kz = 0.05\nkz = 0.06",
        "scenarios/lift.toml:14: not valid TOML: duplicate key",
    );
}

#[test]
fn unknown_keys_are_rejected_everywhere() {
    file_gives(
        SCENARIO,
        "duration_s",
        "durations_s",
        "scenarios/lift.toml:4: durations_s: unknown key; did you mean \"duration_s\"?",
    );
    file_gives(
        SCENARIO,
        "kz = ",
        "kv = ",
        "scenarios/lift.toml:13: hybrid.kv: unknown key; did you mean \"kz\"?",
    );
    file_gives(
        SCENARIO,
        "offset_m",
        "ofset_m",
        "scenarios/lift.toml:9: grasp.ofset_m: unknown key; did you mean \"offset_m\"?",
    );
    file_gives(
        SCENARIO,
        "axis = ",
        "direction = ",
        "scenarios/lift.toml:21: hybrid.axes.0.direction: unknown key, expected one of row, axis, control, reference, expected_force",
    );
    file_gives(
        TEAM,
        "mass_kg",
        "weight",
        "teams/pair.toml:2: object.weight: unknown key, expected one of mass_kg, size_m, position_m, yaw_deg, com_m",
    );
    file_gives(
        TEAM,
        "yaw_deg = 180.0",
        "yaw_rad = 3.14",
        "teams/pair.toml:22: robots.1.yaw_rad: unknown key, expected one of name, model, x_m, y_m, yaw_deg, hands",
    );
    file_gives(
        ROBOT,
        "sole_link = \"left\"",
        "sole = \"left\"",
        "robots/arm.toml:23: feet.1.sole: unknown key; did you mean \"sole_m\"?",
    );
}

#[test]
fn missing_keys_are_named_where_they_belong() {
    file_gives(SCENARIO, "name = \"lift\"", "", "scenarios/lift.toml: name: found nothing, expected a value");
    file_gives(
        SCENARIO,
        "kz = 0.05",
        "",
        "scenarios/lift.toml:11: hybrid.kz: found nothing, expected a value",
    );
    file_gives(
        TEAM,
        "mass_kg = 3.0",
        "",
        "teams/pair.toml:1: object.mass_kg: found nothing, expected a value",
    );
    file_gives(TEAM, "x_m = 0.5", "", "teams/pair.toml:17: robots.1.x_m: found nothing, expected a value");
    file_gives(
        SCENARIO,
        "team = \"pair\"",
        "",
        "scenarios/lift.toml: team: found nothing, expected a team, or robots here",
    );
}

#[test]
fn wrong_types_say_what_was_found() {
    file_gives(
        TEAM,
        "mass_kg = 3.0",
        "mass_kg = \"3 kg\"",
        "teams/pair.toml:2: object.mass_kg: found \"3 kg\", expected a finite number",
    );
    file_gives(
        TEAM,
        "    0.7,",
        "    true,",
        "teams/pair.toml:5: object.size_m.1: found true, expected a finite number",
    );
    file_gives(
        TEAM,
        "position_m = [0.0, 0.0, 1.0]",
        "position_m = [0.0, 0.0]",
        "teams/pair.toml:8: object.position_m: found an array of length 2, expected an array of length 3",
    );
    file_gives(
        TEAM,
        "position_m = [0.0, 0.0, 1.0]",
        "position_m = [0.0, 0.0, 1.0, 0.0]",
        "teams/pair.toml:8: object.position_m: found an array of length 4, expected an array of length 3",
    );
    file_gives(
        SCENARIO,
        "servo_cores = [0, 1]",
        "servo_cores = [0, -1]",
        "scenarios/lift.toml:30: placement.servo_cores.1: found -1, expected a whole number from 0",
    );
    file_gives(
        SCENARIO,
        "servo_cores = [0, 1]",
        "fifo_priority = 300",
        "scenarios/lift.toml:30: placement.fifo_priority: found 300, expected a whole number from 0 to 255",
    );
    file_gives(
        SCENARIO,
        "[physics]\nstep_s = 0.001\nfriction = 0.8",
        "physics = 1",
        "scenarios/lift.toml:25: hybrid.axes.0.physics: unknown key, expected one of row, axis, control, reference, expected_force",
    );
    file_gives(
        SCENARIO,
        "duration_s = 2.0",
        "duration_s = 2024-01-01",
        "scenarios/lift.toml:4: duration_s: found the date 2024-01-01, expected a finite number",
    );
    file_gives(
        SCENARIO,
        "[grasp]",
        "[[grasp]]",
        "scenarios/lift.toml:7: grasp: found an array of length 1, expected a table",
    );
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for (bad, shown) in [("nan", "NaN"), ("inf", "inf"), ("-inf", "-inf"), ("1e999", "inf")] {
        let expected = format!("scenarios/lift.toml:13: hybrid.kz: found {shown}, expected a finite number");
        file_gives(SCENARIO, "kz = 0.05", &format!("kz = {bad}"), &expected);
    }
    options_give(
        &["object.mass_kg=nan"],
        "--set object.mass_kg=nan: object.mass_kg: found NaN, expected a finite number",
    );
}

#[test]
fn names_out_of_a_list_show_the_list() {
    file_gives(
        SCENARIO,
        "\"weld\"",
        "\"wild\"",
        "scenarios/lift.toml:8: grasp.kind: found \"wild\", expected one of \"weld\", \"spring\"; did you mean \"weld\"?",
    );
    file_gives(
        SCENARIO,
        "axis = \"x\"",
        "axis = \"up\"",
        "scenarios/lift.toml:21: hybrid.axes.0.axis: found \"up\", expected one of \"x\", \"y\", \"z\", \"roll\", \"pitch\", \"yaw\"",
    );
    file_gives(
        SCENARIO,
        "\"balanced-tree\"",
        "\"tree\"",
        "scenarios/lift.toml:17: hybrid.internal_forces: found \"tree\", expected one of \"balanced-tree\", \"chain\", \"matrix\"",
    );
    file_gives(
        SCENARIO,
        "\"balanced-tree\"",
        "\"matrix\"",
        "scenarios/lift.toml:17: hybrid.internal_forces: found \"matrix\" alone, expected { matrix = a value }",
    );
    file_gives(
        SCENARIO,
        "\"balanced-tree\"",
        "7",
        "scenarios/lift.toml:17: hybrid.internal_forces: found 7, expected one of \"balanced-tree\", \"chain\", \"matrix\"",
    );
}

#[test]
fn unknown_teams_models_and_hands_are_found_before_anything_starts() {
    file_gives(
        SCENARIO,
        "team = \"pair\"",
        "team = \"pear\"",
        "scenarios/lift.toml:3: team: found \"pear\", expected one of pair, solo in teams; did you mean \"pair\"?",
    );
    options_give(
        &["team=crowd"],
        "--set team=crowd: team: found \"crowd\", expected one of pair, solo in teams",
    );
    file_gives(
        TEAM,
        "model = \"arm\"\nx_m = 0.5",
        "model = \"harm\"\nx_m = 0.5",
        "teams/pair.toml:19: robots.1.model: found \"harm\", expected one of arm in robots; did you mean \"arm\"?",
    );
    file_gives(
        TEAM,
        "hands = [\"tool\"]",
        "hands = [\"left\"]",
        "teams/pair.toml:23: robots.1.hands.0: found \"left\", expected a hand of arm: tool",
    );
}

#[test]
fn a_team_can_t_lead_out_of_its_folder() {
    options_give(
        &["team=../robots/arm"],
        "--set team=../robots/arm: team: found \"../robots/arm\", expected one of pair, solo in teams",
    );
}

#[test]
fn robots_have_names_of_their_own_and_arms_enough() {
    file_gives(
        TEAM,
        "name = \"R\"",
        "name = \"L\"",
        "teams/pair.toml:18: robots.1.name: found \"L\" again, expected each name once",
    );
    options_give(
        &["robots.0.name=left arm"],
        "--set robots.0.name=left arm: robots.0.name: found \"left arm\", expected 1 to 64 letters, digits, _ or -",
    );
    options_give(
        &["world.boxes.1.name=wall"],
        "--set world.boxes.1.name=wall: world.boxes.1.name: found \"wall\" again, expected each name once",
    );
    options_give(
        &["world.boxes.0.name=the wall"],
        "--set world.boxes.0.name=the wall: world.boxes.0.name: found \"the wall\", expected 1 to 64 letters, digits, _ or -",
    );
    file_gives(
        SCENARIO,
        "position_m = [2.0",
        "centre_m = [2.0",
        "scenarios/lift.toml:37: world.boxes.0.centre_m: unknown key, expected one of name, position_m, size_m, yaw_deg, friction",
    );
    options_give(
        &["robots=[]"],
        "--set robots=[]: robots: found 0, expected 1 to 16 robots\n\
        --set robots=[]: robots: found 0 arms, expected at least 2 arms in the team",
    );
    options_give(
        &["robots.1.hands=[]"],
        "--set robots.1.hands=[]: robots.1.hands: found 0, expected 1 to 1 hands\n\
         teams/pair.toml:10: robots: found 1 arms, expected at least 2 arms in the team",
    );
}

#[test]
fn quantities_lie_in_their_ranges() {
    for (key, value, expected) in [
        ("object.mass_kg", "0", "a finite number above 0"),
        ("object.size_m.2", "-0.3", "a finite number above 0"),
        ("grasp.offset_m", "-0.001", "a finite number from 0"),
        ("hybrid.kz", "1.5", "a number above 0, up to 1"),
        ("hybrid.kz", "0", "a number above 0, up to 1"),
        ("hybrid.loop_gain", "-0.0001", "a finite number above 0"),
        ("hybrid.filter_hz", "0", "a finite number above 0"),
        ("hybrid.start_s", "-1", "a finite number from 0"),
        ("hybrid.start_s", "2", "a time before the end (2 s); leave it out for never"),
        ("physics.friction", "-1", "a finite number from 0"),
        ("world.boxes.0.size_m.2", "0", "a finite number above 0"),
        ("world.boxes.0.position_m.1", "inf", "a finite number"),
        ("world.boxes.0.yaw_deg", "inf", "a finite number"),
        ("world.boxes.0.friction", "-0.1", "a finite number from 0"),
        ("sensors.force_noise_n", "-1", "a finite number from 0"),
        ("coordination_delay_ticks", "17", "at most 16 ticks"),
        ("sensors.delay_ticks", "1001", "at most 1000 ticks"),
        ("thresholds.foot_slip_max_m", "-1", "a finite number from 0"),
        ("thresholds.axis_reference_error_end_n", "-1", "a finite number from 0"),
        ("hybrid.axes.0.expected_force", "5", "none: an axis that is controlled by force has its reference"),
        ("placement.fifo_priority", "0", "a priority from 1 to 99"),
    ] {
        options_give(
            &[&format!("{key}={value}")],
            &format!("--set {key}={value}: {key}: found {value}, expected {expected}"),
        );
    }
}

#[test]
fn the_keys_of_a_job_lie_in_their_ranges_and_fit_each_other() {
    const JOB: [&str; 5] =
        ["hybrid.start_s=", "duration_s=60", "job.start_s=1", "job.draw_back_m=0.05", "job.lift_m=0.03"];
    let root = fixture();
    assert!(load(root.path(), &JOB).is_ok());
    for (key, value, expected) in [
        ("job.start_s", "-1", "a finite number from 0"),
        ("job.draw_back_m", "0", "a finite number above 0"),
        ("job.approach_s", "0", "a finite number above 0"),
        ("job.grasp_s", "-0.5", "a finite number from 0"),
        ("job.settle_s", "-1", "a finite number from 0"),
        ("job.lift_m", "-0.03", "a finite number above 0"),
        ("job.lift_s", "0", "a finite number above 0"),
        ("job.creep_m", "0.03", "less than job.lift_m (0.03 m)"),
        ("job.creep_m_s", "-1", "a finite number above 0"),
        ("job.unload_s", "-1", "a finite number from 0"),
        ("job.time_limit_s", "0", "a finite number above 0"),
        ("hybrid.start_s", "0.5", "none: a job starts the law when the hands hold"),
        ("coordination.policy", "leader-follower", "symmetry: there is a job"),
    ] {
        let option = format!("{key}={value}");
        let options: Vec<&str> = JOB.into_iter().chain([option.as_str()]).collect();
        let text = text_of(root.path(), load(root.path(), &options));
        let first = text.lines().next().unwrap();
        assert_eq!(first, format!("--set {option}: {key}: found {value}, expected {expected}"));
    }
    let short = ["duration_s=10"];
    let options: Vec<&str> = JOB.into_iter().chain(short).collect();
    assert_eq!(
        text_of(root.path(), load(root.path(), &options)),
        "--set job.start_s=1: job: found one that takes 19.5 s, expected a job that ends before the run does (10 s)"
    );
    file_gives(
        SCENARIO,
        "[physics]",
        "[job]\nstart_s = 0.1\ndraw_back_m = 0.05\nlift_cm = 3\n\n[physics]",
        "scenarios/lift.toml:28: job.lift_cm: unknown key; did you mean \"lift_m\"?",
    );
}

#[test]
fn periods_divide_each_other() {
    options_give(
        &["physics.step_s=0.002"],
        "--set physics.step_s=0.002: physics.step_s: found 0.002, expected a whole fraction of control_period_s (0.005 s)",
    );
    options_give(
        &["physics.step_s=0.01"],
        "--set physics.step_s=0.01: physics.step_s: found 0.01, expected a whole fraction of control_period_s (0.005 s)",
    );
    options_give(
        &["duration_s=2.001"],
        "--set duration_s=2.001: duration_s: found 2.001, expected a whole number of control periods (0.005 s), at most 8.64e7",
    );
    options_give(
        &["control_period_s=0", "physics.step_s=0"],
        "--set control_period_s=0: control_period_s: found 0, expected a finite number above 0\n\
         --set physics.step_s=0: physics.step_s: found 0, expected a finite number above 0",
    );
}

#[test]
fn a_matrix_of_internal_forces_has_the_teams_shape() {
    options_give(
        &["hybrid.internal_forces={matrix=[[1, -1], [1, 1]]}"],
        "--set hybrid.internal_forces={matrix=[[1, -1], [1, 1]]}: hybrid.internal_forces.matrix: found 2 rows, expected 1 rows: one less than the team's 2 arms",
    );
    options_give(
        &["hybrid.internal_forces={matrix=[[1]]}"],
        "--set hybrid.internal_forces={matrix=[[1]]}: hybrid.internal_forces.matrix.0: found 1 numbers, expected one for each of the team's 2 arms",
    );
    options_give(
        &["hybrid.internal_forces={matrix=[[1, \"-1\"]]}"],
        "--set hybrid.internal_forces={matrix=[[1, \"-1\"]]}: hybrid.internal_forces.matrix.0.1: found \"-1\", expected a finite number",
    );
}

#[test]
fn one_axis_has_one_exception() {
    let exception = "{row=\"L|R\", axis=\"x\", control=\"force\"}";
    options_give(
        &[&format!("hybrid.axes=[{exception}, {exception}]")],
        &format!(
            "--set hybrid.axes=[{exception}, {exception}]: hybrid.axes.1: found row \"l|r\", axis x again, expected each axis of a row once"
        ),
    );
}

#[test]
fn a_grasp_has_the_keys_of_its_kind() {
    options_give(
        &["grasp.kind=spring"],
        "scenarios/lift.toml:7: grasp: found no stiffness_n_m, damping_ns_m, stiffness_nm_rad, damping_nms_rad, expected them with kind = \"spring\"",
    );
    options_give(
        &["grasp.damping_ns_m=1"],
        "scenarios/lift.toml:7: grasp: found damping_ns_m, expected them with kind = \"spring\" only",
    );
}

#[test]
fn options_must_lead_to_a_place() {
    options_give(
        &["object.mas_kg=4"],
        "--set object.mas_kg=4: object.mas_kg: unknown key; did you mean \"mass_kg\"?",
    );
    options_give(
        &["robots.2.x_m=1"],
        "--set robots.2.x_m=1: robots.2.x_m: found \"2\", expected the index of one of 2 elements",
    );
    options_give(
        &["name.first=1"],
        "--set name.first=1: name.first: found a part of \"lift\", expected a table there",
    );
    options_give(
        &["object..mass_kg=1"],
        "--set object..mass_kg=1: object..mass_kg: found an empty part, expected names joined by single dots",
    );
    options_give(
        &["robots.0="],
        "--set robots.0=: robots.0: found no value for a part of an array of length 2, expected one",
    );
}

#[test]
fn options_that_are_not_toml_are_strings() {
    options_give(
        &["object.mass_kg=3kg"],
        "--set object.mass_kg=3kg: object.mass_kg: found \"3kg\", expected a finite number",
    );
    options_give(
        &["object.mass_kg=1\nname = \"x\""],
        "--set object.mass_kg=1\nname = \"x\": object.mass_kg: found \"1\\nname = \\\"x\\\"\", expected a finite number",
    );
}

#[test]
fn packages_of_a_loaded_robot_are_absolute_wherever_it_was_loaded_from() {
    let root = fixture();
    let (path, line) = (root.path().join(ROBOT), "foot_spacing_m = 0.2\n");
    let text = fs::read_to_string(&path).unwrap();
    fs::write(&path, text.replace(line, &format!("{line}packages = {{ team = \"../teams\" }}\n"))).unwrap();

    let upwards = "../".repeat(std::env::current_dir().unwrap().components().count() - 1);
    let relative = Path::new(&upwards).join(path.strip_prefix("/").unwrap().parent().unwrap());
    let package = PathBuf::from(&load_robot(&relative, "arm").unwrap().config.packages["team"]);
    assert!(package.is_absolute(), "{}", package.display());
    assert!(package.join("pair.toml").is_file(), "{}", package.display());
}

#[test]
fn robots_are_checked_as_scenarios_are() {
    for (good, bad, expected) in [
        (
            "urdf = \"arm.urdf\"",
            "urdf = \"leg.urdf\"",
            "robots/arm.toml:2: urdf: found \"leg.urdf\", expected a file beside this one: No such file or directory (os error 2)",
        ),
        (
            "name = \"arm\"",
            "name = \"leg\"",
            "robots/arm.toml:1: name: found \"leg\", expected \"arm\", as the file is called",
        ),
        (
            "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            "[[1, 0, 0], [0, 1, 0], [0, 0, -1]]",
            "robots/arm.toml:13: hands.0.carry_rotation: found [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]], expected a rotation: orthonormal rows, right-handed",
        ),
        (
            "joints = \"*\"",
            "joints = \"*ARM*\"",
            "robots/arm.toml:28: drives.0.joints: found \"*ARM*\", expected a joint's name with at most one *",
        ),
        (
            "elbow = 90.0",
            "elbow = 900.0",
            "robots/arm.toml:34: carry_posture_deg.elbow: found 900, expected degrees from -360 to 360",
        ),
        (
            "com_height_m = 0.5",
            "com_height_m = -0.5",
            "robots/arm.toml:5: com_height_m: found -0.5, expected a finite number above 0",
        ),
        (
            "foot_spacing_m = 0.2",
            "foot_spacing_m = 0.2\npackages = { arm = \"meshes\" }",
            "robots/arm.toml:7: packages.arm: found \"meshes\", expected a folder beside this file",
        ),
    ] {
        file_gives(ROBOT, good, bad, expected);
    }
}

#[test]
fn an_unknown_robot_is_told_from_those_that_exist() {
    let root = fixture();
    let error = text_of(root.path(), load_robot(&root.path().join("robots"), "arms"));
    let dir = root.path().join("robots");
    assert_eq!(
        error.replace(&dir.display().to_string(), "robots"),
        "robots: model: found \"arms\", expected one of arm in robots; did you mean \"arm\"?"
    );
}

#[test]
fn files_that_can_t_be_read_say_why() {
    let root = fixture();
    fs::remove_file(root.path().join(SCENARIO)).unwrap();
    let missing = text_of(root.path(), load(root.path(), &[]));
    assert_eq!(missing, "scenarios/lift.toml: cannot be read: No such file or directory (os error 2)");
    fs::write(root.path().join(SCENARIO), [0xff, 0xfe]).unwrap();
    let binary = text_of(root.path(), load(root.path(), &[]));
    assert_eq!(binary, "scenarios/lift.toml: cannot be read: stream did not contain valid UTF-8");
}

#[test]
fn errors_found_later_still_know_the_line() {
    let root = fixture();
    let loaded = load(root.path(), &["hybrid.kz=0.1"]).unwrap();
    let at = |key: &str| text_of(root.path(), Err::<(), _>(loaded.error_at(key, "found x, expected y")));
    assert_eq!(at("hybrid.axes.0.row"), "scenarios/lift.toml:20: hybrid.axes.0.row: found x, expected y");
    assert_eq!(at("object.size_m"), "teams/pair.toml:3: object.size_m: found x, expected y");
    assert_eq!(at("hybrid.kz"), "--set hybrid.kz=0.1: hybrid.kz: found x, expected y");
    assert_eq!(at("physics.gravity"), "scenarios/lift.toml:25: physics.gravity: found x, expected y");
    assert_eq!(at("sensors.delay_ticks"), "scenarios/lift.toml: sensors.delay_ticks: found x, expected y");
    let robot = &loaded.models["arm"];
    let error =
        text_of(root.path(), Err::<(), _>(robot.error_at("hands.0.palm_link", "found x, expected y")));
    assert_eq!(error, "robots/arm.toml:10: hands.0.palm_link: found x, expected y");
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Whatever happens to a file, its reader gets a scenario or an error that names a place.
    #[test]
    fn damaged_files_never_panic(
        file in prop::sample::select(vec![SCENARIO, TEAM, ROBOT]),
        at in any::<prop::sample::Index>(),
        length in 0..40_usize,
        patch in "[a-z0-9 =.,\"\\[\\]{}\n#-]{0,12}",
    ) {
        let root = fixture();
        let path = root.path().join(file);
        let mut text = fs::read_to_string(&path).unwrap();
        let start = at.index(text.len());
        text.replace_range(start..(start + length).min(text.len()), &patch);
        fs::write(&path, text).unwrap();
        if let Err(error) = load(root.path(), &[]) {
            prop_assert!(error.to_string().contains(".toml"), "{}", error);
        }
    }

    /// Whatever is typed, too.
    #[test]
    fn options_never_panic(key in "[a-z_.0-9]{1,20}", value in ".{0,20}") {
        let root = original();
        let _ = load(&root, &[&format!("{key}={value}")]);
        let _ = load(&root, &[&format!("robots.{key}={value}")]);
    }
}

#[test]
fn a_grasp_failure_of_nobody_or_with_a_friction_that_shakes_the_object_is_refused() {
    let with = |failure: &str| format!("world.grasp_failures=[{{{failure}}}]");
    let text = |option: String| {
        let root = fixture();
        text_of(root.path(), load(root.path(), &[&option]))
    };
    let of_nobody = text(with(r#"robot = "Z", hand = "left", at_s = 1.0, kind = "open""#));
    assert!(
        of_nobody.contains("world.grasp_failures.0.robot") && of_nobody.contains("a robot of the team"),
        "{of_nobody}"
    );
    let without_kind = text(with(r#"robot = "Z", hand = "left", at_s = 1.0"#));
    assert!(without_kind.contains("kind"), "{without_kind}");
    let shaking = text(with(r#"robot = "Z", hand = "left", at_s = 1.0, kind = "slip", friction_n = 1e6"#));
    assert!(shaking.contains("world.grasp_failures.0.friction_n"), "{shaking}");
}

#[test]
fn who_leaves_is_of_the_team_goes_and_comes_by_turns_and_leaves_enough_to_carry() {
    let says = |entries: &str| {
        let root = fixture();
        text_of(root.path(), load(root.path(), &[&format!("membership=[{entries}]")]))
    };
    for (entries, key, expected) in [
        (r#"{robot = "Z", leave_s = 1.0}"#, "membership.0.robot: found \"Z\"", "a robot of the team"),
        (r#"{robot = "L"}"#, "membership.0.leave_s: found neither", "a time to leave"),
        (r#"{robot = "L", leave_s = 2.0, join_s = 1.0}"#, "membership.0.join_s: found 1", "a time later"),
        (r#"{robot = "L", leave_s = 1.0}, {robot = "L", leave_s = 2.0}"#, "membership.1.leave_s", "by turns"),
        (
            r#"{robot = "L", leave_s = 1.0, distance_m = 9.0}"#,
            "membership.0.distance_m: found 9",
            "at most 5",
        ),
        (
            r#"{robot = "L", leave_s = 1.0, speed_m_s = 0.0}"#,
            "membership.0.speed_m_s: found 0",
            "more than 0",
        ),
        (r#"{robot = "L", leave_s = 1.0}"#, "membership.0.leave_s: found 1 robots", "at least 2"),
        (r#"{robot = "L", leave_s = 1.0, when = 3.0}"#, "membership.0.when", "unknown key"),
    ] {
        let told = says(entries);
        assert!(told.contains(key) && told.contains(expected), "{entries}: {told}");
    }
}

#[test]
fn a_team_whose_internal_forces_are_not_formed_anew_does_not_carry_on() {
    let root = fixture();
    let options = ["safety.lost_grasp=carry-on", "hybrid.internal_forces=chain"];
    let text = text_of(root.path(), load(root.path(), &options));
    assert!(text.contains("safety.lost_grasp") && text.contains("balanced tree"), "{text}");
}

#[test]
fn whoever_drives_can_be_stopped_in_time_and_is_alone() {
    let drive = |keys: &str| format!("operator.drive={{{keys}}}");
    let says = |options: &[&str]| text_of(&original(), load(&original(), options));
    let hasty = says(&[&drive("timeout_s = 0.3")]);
    assert!(hasty.contains("operator.drive.timeout_s: found 0.3, expected at least 0.15 s more"), "{hasty}");
    for (keys, expected) in [
        ("braking_m_s2 = 0.0", "operator.drive.braking_m_s2: found 0, expected more than 0"),
        (
            "velocity_max_m_s = 3.0",
            "operator.drive.velocity_max_m_s: found 3, expected more than 0, at most 0.5",
        ),
        ("squeeze = {row = \"L\", axis = \"x\", max_n = 1e3}", "operator.drive.squeeze.max_n: found 1000"),
        ("squeeze = {row = \"L\", axis = \"yaw\", max_n = 9.0}", "operator.drive.squeeze.axis"),
    ] {
        let text = says(&[&drive(keys)]);
        assert!(text.contains(expected), "{text}");
    }
    let both = says(&[&drive(""), "motion={start_s = 1.0}"]);
    assert!(both.contains("motion: found one, expected none"), "{both}");
    let nobody = says(&["operator.script=[{at_s = 1.0, says = \"lift\"}]"]);
    assert!(nobody.contains("operator.script.0.says: found lift, expected stop or resume"), "{nobody}");
    let still = says(&["operator.script=[{at_s = 1.0, says = \"stop\", squeeze_n = 3.0}]"]);
    assert!(still.contains("operator.script.0: found velocities or a squeeze"), "{still}");
}

#[test]
fn nothing_is_pushed_that_is_not_there_or_out_of_all_measure() {
    let says = |push: &str| {
        let option = format!("world.pushes=[{{at_s = 1.0, {push}}}]");
        text_of(&original(), load(&original(), &[&option]))
    };
    for (push, expected) in [
        (
            "for_s = 0.2, on = \"moon\", force_n = [0.0, 1.0, 0.0]",
            "world.pushes.0.on: found \"moon\", expected object",
        ),
        ("for_s = 0.2, on = \"object\", force_n = [0.0, 1e6, 0.0]", "world.pushes.0.force_n"),
        ("for_s = 60.0, on = \"object\", force_n = [0.0, 1.0, 0.0]", "world.pushes.0.for_s: found 60"),
    ] {
        let text = says(push);
        assert!(text.contains(expected), "{text}");
    }
}
