//! `mikoshi check-robot`: whether a robot's files can be used, and what it comes to.

use crate::arguments::CheckRobotArguments;
use crate::failure::Failure;
use crate::print::print_out;
use crate::table;
use core::cell::RefCell;
use core::fmt::Write as _;
use mikoshi_config::load_robot;
use mikoshi_humanoid::Model;
use mikoshi_resolution::{CheckedRobot, check_robot as check};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Checks a robot's configuration, or a URDF alone.
///
/// # Errors
/// What is wrong with it: bad usage.
pub fn check_robot(arguments: &CheckRobotArguments) -> Result<(), Failure> {
    let file = arguments.file.as_path();
    let text = match file.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => of_configuration(file)?,
        _ => of_urdf(file)?,
    };
    print_out(&text);
    Ok(())
}

fn of_configuration(file: &Path) -> Result<String, Failure> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = file.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
    let loaded = load_robot(folder, name).map_err(Failure::usage)?;
    let checked = check(&loaded).map_err(Failure::usage)?;
    let CheckedRobot { robot, posture_rad, reach_m } = &checked;
    let mut text = table_of(&robot.model, Some(posture_rad));
    let hands: Vec<_> = loaded.config.hands.iter().map(|hand| hand.name.as_str()).collect();
    // Writing to a string can't fail.
    let _ = writeln!(
        text,
        "\n{name}: {:.1} kg, {} joints, hands {}; stands and holds as it is to carry",
        robot.model.total_mass_kg(),
        robot.model.joint_count(),
        hands.join(" and "),
    );
    text += "\nReach of the hands together, from where they carry\n";
    let row = |(axis, [minus, plus]): (&str, &[f64; 2])| {
        let cell = |metres: &f64| format!("{:.0}", 1e3 * metres);
        vec![axis.to_owned(), cell(minus), cell(plus)]
    };
    let axes = ["x, ahead", "y, to the left", "z, up"].into_iter().zip(reach_m);
    text += &table::of_numbers(&["along", "back mm", "on mm"], axes.map(row));
    Ok(text)
}

fn of_urdf(file: &Path) -> Result<String, Failure> {
    let urdf = fs::read_to_string(file).map_err(|error| Failure::usage(error).context(file.display()))?;
    let meshes = RefCell::new(BTreeSet::new());
    let note = |mesh: &str| {
        meshes.borrow_mut().insert(mesh.to_owned());
        Some(mesh.into())
    };
    let model =
        Model::from_urdf(&urdf, &note).map_err(|error| Failure::usage(error).context(file.display()))?;
    let mut text = table_of(&model, None);
    let is_leaf = |name: &str| {
        let of = |parent| model.frame(parent).name == name;
        !model.frames().iter().any(|frame| frame.parent.is_some_and(of))
    };
    let leaves = model.frames().iter().map(|frame| frame.name.as_str()).filter(|name| is_leaf(name));
    let leaves: Vec<_> = leaves.collect();
    // Writing to a string can't fail.
    let _ = writeln!(
        text,
        "\n{}: {:.1} kg, {} joints; links at its ends: {}",
        model.name(),
        model.total_mass_kg(),
        model.joint_count(),
        leaves.join(", ")
    );
    let _ = match meshes.into_inner().len() {
        0 => writeln!(text, "It needs no mesh."),
        count => writeln!(
            text,
            "It names {count} meshes: a robot.toml says by [packages] where they are, or meshes = \"left-out\"."
        ),
    };
    text +=
        "To carry, it needs a robot.toml that says which links are palms, soles, sensors, waist and IMU.\n";
    Ok(text)
}

/// Every joint, and where it stands if that is known.
fn table_of(model: &Model, posture_rad: Option<&[f64]>) -> String {
    let titles = ["joint", "lower deg", "upper deg", "rad/s", "Nm", "moves kg", "stands deg"];
    let row = |(index, joint): (usize, &mikoshi_humanoid::model::Joint)| {
        let degrees = |value: f64| format!("{:.1}", value.to_degrees());
        let stands = posture_rad
            .and_then(|posture| posture.get(index))
            .map_or("-".to_owned(), |angle| degrees(*angle));
        vec![
            joint.name.clone(),
            degrees(joint.lower),
            degrees(joint.upper),
            format!("{:.2}", joint.velocity),
            format!("{:.1}", joint.effort),
            format!("{:.2}", model.subtree_mass_kg(index + 1)),
            stands,
        ]
    };
    table::of_numbers(&titles, model.joints().iter().enumerate().map(row))
}
