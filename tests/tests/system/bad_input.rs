//! What is wrong is said, with its place, before anything runs; and the exit status tells whose fault it is.

use mikoshi_tests::programs::mikoshi;
use mikoshi_tests::run::{Results, Said, left_behind, run, say, say_mikoshi};
use mikoshi_tests::scenarios::{Copy, SHORT, of_project};
use std::fs;
use std::path::{Path, PathBuf};

fn plan(scenario: &Path, arguments: &[&str]) -> Said {
    say(mikoshi().arg("plan").arg(scenario).args(arguments))
}

fn plan_hold_with(setting: &str) -> Said {
    plan(&of_project("hold"), &["--set", setting])
}

#[test]
fn malformed_toml_is_found_in_its_line() {
    let copy = Copy::new();
    copy.replace("scenarios/hold.toml", "[grasp]", "[grasp");
    plan(&copy.hold(), &[]).expect_error(2, &["hold.toml:", "not valid TOML"]);
}

#[test]
fn an_unknown_key_is_named_with_what_was_expected() {
    let copy = Copy::new();
    copy.replace("scenarios/hold.toml", "start_s =", "strat_s =");
    let line = fs::read_to_string(copy.hold()).expect("it is there");
    let line = 1 + line.lines().position(|line| line.starts_with("strat_s")).expect("it was written");
    plan(&copy.hold(), &[])
        .expect_error(2, &[&format!("hold.toml:{line}: hybrid.strat_s: unknown key"), "start_s"]);
    plan_hold_with("hybrid.strat_s=1").expect_error(2, &["--set hybrid.strat_s=1: "]);
}

#[test]
fn what_is_not_a_number_is_refused() {
    plan_hold_with("object.mass_kg=nan")
        .expect_error(2, &["--set object.mass_kg=nan: object.mass_kg: found"]);
    plan_hold_with("object.mass_kg=heavy").expect_error(2, &["object.mass_kg", "heavy"]);
}

#[test]
fn dependent_internal_forces_are_named() {
    let said = plan(
        &of_project("hold"),
        &["--set", "team=two", "--set", "hybrid.internal_forces.matrix=[[1,-1,0,0],[0,0,1,-1],[2,-2,1,-1]]"],
    );
    said.expect_error(2, &["hybrid.internal_forces", "r1 = -0.5 r2 + 0.5 r3"]);
}

#[test]
fn an_internal_force_that_does_not_exist_is_named_with_those_that_do() {
    let copy = Copy::new();
    copy.replace("scenarios/squeeze.toml", "\"AB|CD\"", "\"AB|DC\"");
    plan(&copy.path("scenarios/squeeze.toml"), &[]).expect_error(
        2,
        &["squeeze.toml:", "hybrid.axes.0.row: found \"AB|DC\", expected one of object, AB|CD, "],
    );
}

#[test]
fn an_unreachable_grasp_names_robot_hand_and_distance() {
    plan_hold_with("robots.1.x_m=-0.75").expect_error(
        2,
        &["unreachable grasp: the right palm of robot B is 100 mm off the object's surface"],
    );
}

#[test]
fn a_urdf_that_is_missing_or_broken_is_named_where_it_is_used() {
    let copy = Copy::new();
    fs::remove_file(copy.path("robots/hrp2.urdf")).expect("it was copied");
    plan(&copy.hold(), &[]).expect_error(2, &["hrp2.toml:", "urdf: found \"hrp2.urdf\", expected a file"]);

    let copy = Copy::new();
    copy.replace("robots/hrp2.urdf", "</robot>", "");
    plan(&copy.hold(), &[]).expect_error(2, &["hrp2.toml:", "hrp2.urdf"]);
}

#[test]
fn a_joint_or_link_that_the_urdf_lacks_is_named_where_it_is_used() {
    let copy = Copy::new();
    copy.replace("robots/hrp2.toml", "RLEG_JOINT3 =", "RLEG_JOINT7 =");
    plan(&copy.hold(), &[]).expect_error(2, &["hrp2.toml:", "carry_posture_deg.RLEG_JOINT7: found"]);

    let copy = Copy::new();
    copy.replace("robots/hrp2.toml", "\"r_palm\"", "\"r_plam\"");
    plan(&copy.hold(), &[])
        .expect_error(2, &["hrp2.toml:", "hands.0.palm_link: found \"r_plam\", expected a link"]);
}

#[test]
fn a_mesh_that_is_missing_is_named() {
    let copy = Copy::new();
    let urdf = fs::read_to_string(copy.path("robots/hrp2.urdf")).expect("it was copied");
    let start = urdf.find("<box ").expect("it has boxes");
    let end = start + urdf[start..].find("/>").expect("it is closed") + "/>".len();
    copy.replace("robots/hrp2.urdf", &urdf[start..end], "<mesh filename=\"package://nobody/arm.stl\"/>");
    plan(&copy.hold(), &[]).expect_error(2, &["hrp2.toml:", "package://nobody/arm.stl", "not found"]);
}

#[test]
fn files_and_arguments_that_make_no_sense_are_refused() {
    say_mikoshi(["plan", "nowhere.toml"]).expect_error(2, &["nowhere.toml: cannot be read"]);
    say_mikoshi(["run"]).expect_error(2, &["<SCENARIO>"]);
    say_mikoshi(["walk"]).expect_error(2, &["walk"]);
    say_mikoshi(["run", "x.toml", "--set", "mass"]).expect_error(2, &["expected KEY=VALUE"]);
    say_mikoshi(["run", "x.toml", "--seed", "-1"]).expect_error(2, &["-1"]);
    say_mikoshi(["run", "x.toml", "--force"]).expect_error(2, &["--out"]);
}

/// Only the bridge can tell that the springs of this run would explode.
#[test]
fn what_a_service_refuses_is_bad_configuration_too() {
    for arguments in [&[][..], &["--in-process"]] {
        let results = Results::new();
        let settings = ["--set", "grasp.damping_ns_m=5000"];
        let said = run(&of_project("hold_spring"), &[&settings, arguments].concat(), &results);
        said.expect_error(2, &["damping"]);
    }
}

#[test]
fn a_run_that_could_not_begin_leaves_no_results() {
    let results = Results::new();
    let out = results.path().join("out");
    let said = say(mikoshi().args(["run", "--out"]).arg(&out).arg(of_project("hold")).args([
        "--in-process",
        "--set",
        "grasp.kind=spring",
        "--set",
        "grasp.stiffness_n_m=1000",
        "--set",
        "grasp.damping_ns_m=5000",
        "--set",
        "grasp.stiffness_nm_rad=300",
        "--set",
        "grasp.damping_nms_rad=1",
    ]));
    said.expect_error(2, &["damping"]);
    assert!(!out.exists());
}

#[test]
fn a_world_that_the_simulator_rejects_is_a_fault_and_can_be_looked_at() {
    let copy = Copy::new();
    fs::write(copy.path("robots/arm.stl"), "no mesh").expect("it can be written");
    let urdf = fs::read_to_string(copy.path("robots/hrp2.urdf")).expect("it was copied");
    let collision = urdf.find("<collision>").expect("it has collisions");
    let start = collision + urdf[collision..].find("<box ").expect("it has boxes");
    let end = start + urdf[start..].find("/>").expect("it is closed") + "/>".len();
    copy.replace("robots/hrp2.urdf", &urdf[start..end], "<mesh filename=\"package://here/arm.stl\"/>");
    copy.replace("robots/hrp2.toml", "urdf = ", "packages = { here = \".\" }\nurdf = ");
    for arguments in [&[][..], &["--in-process"]] {
        let results = Results::new();
        run(&copy.hold(), arguments, &results).expect_error(3, &["MuJoCo rejects the world", "arm.stl"]);
        assert!(fs::read_to_string(results.world()).expect("it was described").contains("arm.stl"));
    }
}

/// The loader finds a file of the library's name that is no library.
#[test]
fn a_simulator_that_can_not_be_loaded_is_a_fault_with_a_way_out() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::write(folder.path().join("libmujoco.so.3.17.0"), "").expect("it can be written");
    for arguments in [&[][..], &["--in-process"]] {
        let results = Results::new();
        let said = say(mikoshi()
            .args(["run", "--quiet", "--out"])
            .arg(results.path())
            .arg(of_project("hold"))
            .args(arguments)
            .env("LD_LIBRARY_PATH", folder.path()));
        said.expect_error(3, &["MuJoCo's library can't be loaded", "make setup"]);
    }
    let said = say(mikoshi().arg("doctor").env("LD_LIBRARY_PATH", folder.path()));
    assert_eq!(said.status, Some(3));
    assert!(said.out.contains("FAIL   simulator"), "{said:#?}");
}

/// In a mount namespace of its own, where the system allows one.
#[test]
fn too_little_shared_memory_is_a_fault_that_says_how_much_is_needed() {
    let results = Results::new();
    let mut command = std::process::Command::new("unshare");
    let script = "mount -t tmpfs -o size=1m tmpfs /dev/shm || exit 77; exec \"$@\"";
    command.args(["--user", "--map-root-user", "--mount", "sh", "-c", script, "sh"]);
    command.arg(mikoshi().get_program()).args(["run", "--quiet", "--out"]).arg(results.path());
    command.arg(of_project("hold")).args(SHORT);
    let said = match command.output() {
        Ok(output) => Said::from(output),
        Err(error) => return eprintln!("not tested here: unshare: {error}"),
    };
    // By util-linux, or by the script.
    if said.error.starts_with("unshare: ") || said.status == Some(77) {
        return eprintln!("not tested here: no mount namespaces: {}", said.error);
    }
    said.expect_error(3, &["shared memory is full: the run needs", "1 MiB are free"]);
    assert!(!results.log().exists());
}

#[test]
fn a_program_that_is_missing_is_named_with_the_way_to_get_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let alone = folder.path().join("mikoshi");
    fs::copy(mikoshi().get_program(), &alone).expect("it can be copied");
    let results = Results::new();
    let mut command = std::process::Command::new(&alone);
    command.args(["run", "--quiet", "--out"]).arg(results.path()).arg(of_project("hold"));
    let supervisor = command.stderr(std::process::Stdio::piped()).spawn().expect("it can be started");
    let directory: PathBuf =
        mikoshi_runtime::RunDirectory::default_base().join(format!("{}-0", supervisor.id()));
    let said = Said::from(supervisor.wait_with_output().expect("it was started"));
    said.expect_error(3, &["mikoshi-bridge is missing", "make build"]);
    assert_eq!(left_behind(&directory), Vec::<PathBuf>::new());
}
