//! A description that is wrong is refused, and the message names what, where, and what was expected.

use mikoshi_humanoid::Model;
use mikoshi_humanoid::model::{LoadModelError, PackageTable};
use std::collections::BTreeMap;
use std::path::PathBuf;

const MASS: &str =
    r#"<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>"#;
const LIMIT: &str = r#"<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="1" velocity="1"/>"#;

fn link(name: &str, content: &str) -> String {
    format!(r#"<link name="{name}">{content}</link>"#)
}

fn joint(name: &str, kind: &str, parent: &str, child: &str, content: &str) -> String {
    format!(
        r#"<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>{content}</joint>"#
    )
}

fn load(parts: &[String]) -> Result<Model, LoadModelError> {
    Model::from_urdf(&format!(r#"<robot name="test">{}</robot>"#, parts.concat()), &|_| None)
}

fn refusal(parts: &[String]) -> String {
    load(parts).expect_err("it should have been refused").to_string()
}

/// A base and an arm whose joint and link hold what the test says.
fn arm(joint_content: &str, link_content: &str) -> Vec<String> {
    vec![
        link("base", MASS),
        link("arm", link_content),
        joint("shoulder", "revolute", "base", "arm", joint_content),
    ]
}

#[test]
fn the_arm_of_these_tests_is_valid_as_it_stands() {
    let model = load(&arm(LIMIT, MASS)).unwrap();
    assert_eq!((model.joint_count(), model.total_mass_kg()), (1, 2.0));
}

#[test]
fn malformed_xml_is_refused_with_its_line() {
    let message = |text: &str| Model::from_urdf(text, &|_| None).unwrap_err().to_string();
    assert!(message("<robot name='x'>\n<link name='a'>\n</lnk></robot>").contains("line 3"));
    assert!(message("").contains("malformed"));
    assert!(message("<model/>").contains("<model>; expected <robot>"));
}

#[test]
fn an_element_that_cannot_be_read_is_refused_with_its_line_and_name() {
    let screw = refusal(&[link("a", MASS), link("b", MASS), joint("j", "screw", "a", "b", LIMIT)]);
    assert!(screw.contains("'j'") && screw.contains("screw") && screw.contains("revolute"), "{screw}");
    let no_velocity = refusal(&arm(&LIMIT.replace(r#"velocity="1""#, ""), MASS));
    assert!(no_velocity.contains("'shoulder'") && no_velocity.contains("velocity"), "{no_velocity}");
    let no_number = format!("\n{}", link("arm", &MASS.replace("\"1\"", "\"one\"")));
    let no_number = refusal(&[link("base", MASS), no_number]);
    assert!(no_number.contains("line 2: link 'arm'"), "{no_number}");
}

#[test]
fn a_joint_type_without_a_place_in_control_is_refused_by_name() {
    let message = refusal(&[link("a", MASS), link("b", MASS), joint("j", "planar", "a", "b", LIMIT)]);
    assert!(message.contains("'j'") && message.contains("planar"), "{message}");
}

#[test]
fn a_mimic_joint_is_refused() {
    let message = refusal(&arm(&format!(r#"{LIMIT}<mimic joint="elbow"/>"#), MASS));
    assert!(message.contains("'shoulder'") && message.contains("'elbow'"), "{message}");
}

#[test]
fn missing_limits_are_refused() {
    let message = refusal(&arm(r#"<axis xyz="0 0 1"/>"#, MASS));
    assert!(message.contains("'shoulder'") && message.contains("velocity"), "{message}");
    let no_range = r#"<axis xyz="0 0 1"/><limit effort="1" velocity="1"/>"#;
    let message = refusal(&arm(no_range, MASS));
    assert!(message.contains("'shoulder'") && message.contains("lower"), "{message}");
    let nan = r#"<axis xyz="0 0 1"/><limit lower="NaN" upper="1" effort="1" velocity="1"/>"#;
    assert!(refusal(&arm(nan, MASS)).contains("NaN"));
}

#[test]
fn a_continuous_joint_needs_no_range_but_effort_and_velocity() {
    let limit = r#"<axis xyz="0 0 1"/><limit effort="1" velocity="1"/>"#;
    let parts = [link("a", MASS), link("b", MASS), joint("j", "continuous", "a", "b", limit)];
    assert_eq!(load(&parts).unwrap().joints()[0].upper, f64::INFINITY);
}

#[test]
fn an_axis_without_direction_is_refused() {
    let content = LIMIT.replace("0 0 1", "0 0 0");
    assert!(matches!(load(&arm(&content, MASS)), Err(LoadModelError::InvalidAxis { .. })));
}

#[test]
fn a_loop_a_second_root_and_a_second_parent_are_refused() {
    let [a, b, c] = ["a", "b", "c"].map(|name| link(name, MASS));
    let (ab, ba) = (joint("ab", "revolute", "a", "b", LIMIT), joint("ba", "revolute", "b", "a", LIMIT));
    let cb = joint("cb", "revolute", "c", "b", LIMIT);
    let case = |parts: &[&String]| load(&parts.iter().map(|&part| part.clone()).collect::<Vec<_>>());
    assert_eq!(case(&[&a, &b, &ab, &ba]), Err(LoadModelError::NoRoot));
    assert!(matches!(case(&[&a, &b, &c, &ab, &ba]), Err(LoadModelError::Loop { .. })));
    assert!(matches!(case(&[&a, &b]), Err(LoadModelError::SecondRoot { .. })));
    assert!(matches!(case(&[&a, &b, &c, &ab, &cb]), Err(LoadModelError::SecondParent { .. })));
    assert!(matches!(case(&[&a, &ab]), Err(LoadModelError::UnknownLink { .. })));
    assert!(matches!(case(&[&a, &a]), Err(LoadModelError::DuplicateName { .. })));
}

#[test]
fn a_mass_or_an_inertia_that_no_body_has_is_refused() {
    for (from, to) in [
        (r#"mass value="1""#, r#"mass value="-1""#),
        (r#"mass value="1""#, r#"mass value="NaN""#),
        (r#"mass value="1""#, r#"mass value="0""#),
        (r#"ixx="1""#, r#"ixx="-1""#),
        (r#"ixx="1""#, r#"ixx="0""#),
        (r#"ixx="1""#, r#"ixx="inf""#),
        (r#"ixx="1""#, r#"ixx="3""#),
        (r#"ixy="0""#, r#"ixy="2""#),
    ] {
        let message = refusal(&arm(LIMIT, &MASS.replace(from, to)));
        assert!(message.contains("'arm'"), "{to}: {message}");
    }
    assert!(refusal(&arm(LIMIT, "")).contains("without mass"));
    let negative = MASS.replace(r#"mass value="1""#, r#"mass value="-0.5""#);
    let fixed = joint("weld", "fixed", "base", "plate", "");
    let message = refusal(&[link("base", MASS), link("plate", &negative), fixed]);
    assert!(message.contains("'plate'") && message.contains("-0.5 kg"), "{message}");
    assert!(refusal(&arm(LIMIT, &MASS.replace(r#"ixx="1""#, r#"ixx="0""#))).contains("positive definite"));
}

#[test]
fn a_number_that_is_not_one_is_refused_with_its_place() {
    let message = refusal(&arm(&format!(r#"{LIMIT}<origin xyz="0 NaN 0"/>"#), MASS));
    assert!(message.contains("origin") && message.contains("'shoulder'"), "{message}");
}

#[test]
fn a_shape_without_size_is_refused() {
    let shape = r#"<collision><geometry><sphere radius="0"/></geometry></collision>"#;
    let message = refusal(&arm(LIMIT, &format!("{MASS}{shape}")));
    assert!(message.contains("'arm'") && message.contains("sphere"), "{message}");
}

#[test]
fn more_joints_than_a_mask_holds_are_refused() {
    let mut parts = vec![link("l0", MASS)];
    for i in 1..=65 {
        parts.push(link(&format!("l{i}"), MASS));
        parts.push(joint(&format!("j{i}"), "revolute", &format!("l{}", i - 1), &format!("l{i}"), LIMIT));
    }
    assert_eq!(load(&parts), Err(LoadModelError::TooManyJoints { count: 65, limit: 64 }));
}

#[test]
fn a_mesh_is_found_by_its_package_or_named_as_missing() {
    let mesh = |uri: &str| {
        let shape = format!(r#"<visual><geometry><mesh filename="{uri}"/></geometry></visual>"#);
        format!(r#"<robot name="test">{}</robot>"#, link("base", &format!("{MASS}{shape}")))
    };
    let packages = PackageTable(BTreeMap::from([("here".into(), PathBuf::from(env!("CARGO_MANIFEST_DIR")))]));
    let find = |uri: &str| packages.find(uri);
    assert!(Model::from_urdf(&mesh("package://here/Cargo.toml"), &find).is_ok());
    for uri in ["package://here/absent.stl", "package://elsewhere/arm.stl", "absent.stl", "package://"] {
        let error = Model::from_urdf(&mesh(uri), &find).unwrap_err();
        assert_eq!(error, LoadModelError::MissingMesh { link: "base".into(), uri: uri.into() });
    }
}

#[test]
fn a_name_that_the_robot_lacks_is_answered_with_the_names_it_has() {
    let model = load(&arm(LIMIT, MASS)).unwrap();
    let message = model.find_joint("elbow").unwrap_err().to_string();
    assert!(
        message.contains("elbow") && message.contains("shoulder") && message.contains("test"),
        "{message}"
    );
    assert!(model.find_frame("palm").unwrap_err().to_string().contains("base, arm"));
}

#[test]
fn a_mass_at_a_point_and_a_fixed_joint_that_mimics_are_taken_as_they_are() {
    let point = r#"<inertial><mass value="0.5"/><inertia ixx="0" iyy="0" izz="0" ixy="0" ixz="0" iyz="0"/></inertial>"#;
    let fixed = joint("weld", "fixed", "arm", "camera", r#"<mimic joint="shoulder"/>"#);
    let parts = [arm(LIMIT, MASS), vec![link("camera", point), fixed]].concat();
    let model = load(&parts).expect("it can move");
    assert_eq!((model.joint_count(), model.total_mass_kg()), (1, 2.5));
    // What moves by itself is no point.
    assert!(refusal(&arm(LIMIT, point)).contains("without an inertia about every axis"));
}
