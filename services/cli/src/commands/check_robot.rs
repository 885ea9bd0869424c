//! `mikoshi check-robot`: whether a robot's files can be used, and what it comes to.

use crate::arguments::CheckRobotArguments;
use crate::failure::Failure;
use crate::print::{print_json, print_out};
use crate::table;
use core::cell::RefCell;
use core::fmt::Write as _;
use mikoshi_config::load_robot;
use mikoshi_humanoid::Model;
use mikoshi_resolution::{CheckedRobot, check_robot as check};
use serde::Serialize;
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

/// Checks a robot's configuration, or a URDF alone.
///
/// # Errors
/// What is wrong with it: bad usage.
pub fn check_robot(arguments: &CheckRobotArguments) -> Result<(), Failure> {
    let file = arguments.file.as_path();
    let found = match file.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => of_configuration(file)?,
        _ => of_urdf(file)?,
    };
    if arguments.json {
        return print_json(&found);
    }
    print_out(&found.to_text());
    Ok(())
}

/// What `mikoshi check-robot --json` prints.
#[derive(Debug, Serialize)]
struct Found {
    name: String,
    mass_kg: f64,
    joints: Vec<JointRow>,
    /// Of a configuration: how the robot is to carry. Of a URDF alone: none.
    carrying: Option<Carrying>,
    /// Of a URDF alone: what there is for a configuration to name.
    description: Option<Description>,
}

/// One joint.
#[derive(Debug, Serialize)]
struct JointRow {
    name: String,
    lower_rad: f64,
    upper_rad: f64,
    velocity_rad_s: f64,
    effort_nm: f64,
    /// Mass that it moves.
    moves_kg: f64,
    /// Where it stands while the robot carries.
    stands_rad: Option<f64>,
}

/// A robot that can carry.
#[derive(Debug, Serialize)]
struct Carrying {
    hands: Vec<String>,
    /// How far all hands can be moved at once from where they carry.
    reach: [Reach; 3],
}

/// Along one axis of the ground.
#[derive(Debug, Serialize)]
struct Reach {
    axis: &'static str,
    back_m: f64,
    on_m: f64,
}

/// A body of which nobody has said what its parts are for.
#[derive(Debug, Serialize)]
struct Description {
    /// Links from which no other hangs.
    ends: Vec<String>,
    /// Files that it names.
    meshes: usize,
}

fn of_configuration(file: &Path) -> Result<Found, Failure> {
    let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = file.file_stem().and_then(|name| name.to_str()).unwrap_or_default();
    let loaded = load_robot(folder, name).map_err(Failure::usage)?;
    let CheckedRobot { robot, posture_rad, reach_m } = check(&loaded).map_err(Failure::usage)?;
    let reach = |index: usize, axis| {
        let [back_m, on_m] = reach_m[index];
        Reach { axis, back_m, on_m }
    };
    Ok(Found {
        name: name.to_owned(),
        mass_kg: robot.model.total_mass_kg(),
        joints: joints_of(&robot.model, Some(&posture_rad)),
        carrying: Some(Carrying {
            hands: loaded.config.hands.iter().map(|hand| hand.name.clone()).collect(),
            reach: [reach(0, "x"), reach(1, "y"), reach(2, "z")],
        }),
        description: None,
    })
}

fn of_urdf(file: &Path) -> Result<Found, Failure> {
    let urdf = fs::read_to_string(file).map_err(|error| Failure::usage(error).context(file.display()))?;
    let meshes = RefCell::new(BTreeSet::new());
    let note = |mesh: &str| {
        meshes.borrow_mut().insert(mesh.to_owned());
        Some(mesh.into())
    };
    let model =
        Model::from_urdf(&urdf, &note).map_err(|error| Failure::usage(error).context(file.display()))?;
    let is_leaf = |name: &str| {
        let of = |parent| model.frame(parent).name == name;
        !model.frames().iter().any(|frame| frame.parent.is_some_and(of))
    };
    let leaves = model.frames().iter().map(|frame| &frame.name).filter(|name| is_leaf(name));
    Ok(Found {
        name: model.name().to_owned(),
        mass_kg: model.total_mass_kg(),
        joints: joints_of(&model, None),
        carrying: None,
        description: Some(Description { ends: leaves.cloned().collect(), meshes: meshes.into_inner().len() }),
    })
}

/// Every joint, and where it stands if that is known.
fn joints_of(model: &Model, posture_rad: Option<&[f64]>) -> Vec<JointRow> {
    let row = |(index, joint): (usize, &mikoshi_humanoid::model::Joint)| JointRow {
        name: joint.name.clone(),
        lower_rad: joint.lower,
        upper_rad: joint.upper,
        velocity_rad_s: joint.velocity,
        effort_nm: joint.effort,
        moves_kg: model.subtree_mass_kg(index + 1),
        stands_rad: posture_rad.and_then(|posture| posture.get(index).copied()),
    };
    model.joints().iter().enumerate().map(row).collect()
}

impl Found {
    fn to_text(&self) -> String {
        let degrees = |angle_rad: f64| format!("{:.1}", angle_rad.to_degrees());
        let titles = ["joint", "lower deg", "upper deg", "rad/s", "Nm", "moves kg", "stands deg"];
        let rows = self.joints.iter().map(|joint| {
            vec![
                joint.name.clone(),
                degrees(joint.lower_rad),
                degrees(joint.upper_rad),
                format!("{:.2}", joint.velocity_rad_s),
                format!("{:.1}", joint.effort_nm),
                format!("{:.2}", joint.moves_kg),
                joint.stands_rad.map_or_else(|| "-".to_owned(), degrees),
            ]
        });
        let mut text = table::of_numbers(&titles, rows);
        // Writing to a string can't fail.
        let _ = write!(text, "\n{}: {:.1} kg, {} joints", self.name, self.mass_kg, self.joints.len());
        if let Some(carrying) = &self.carrying {
            text += &carrying.to_text();
        }
        if let Some(description) = &self.description {
            text += &description.to_text();
        }
        text
    }
}

impl Carrying {
    fn to_text(&self) -> String {
        let mut text = format!(", hands {}; stands and holds as it is to carry\n", self.hands.join(" and "));
        text += "\nReach of the hands together, from where they carry\n";
        let row = |(reach, axis): (&Reach, &str)| {
            let millimetres = |metres: f64| format!("{:.0}", 1e3 * metres);
            vec![axis.to_owned(), millimetres(reach.back_m), millimetres(reach.on_m)]
        };
        let axes = ["x, ahead", "y, to the left", "z, up"];
        text + &table::of_numbers(&["along", "back mm", "on mm"], self.reach.iter().zip(axes).map(row))
    }
}

impl Description {
    fn to_text(&self) -> String {
        let meshes = match self.meshes {
            0 => "It needs no mesh.".to_owned(),
            count => format!(
                "It names {count} meshes: a robot.toml says by [packages] where they are, or meshes = \"left-out\"."
            ),
        };
        format!(
            "; links at its ends: {}\n{meshes}\n\
             To carry, it needs a robot.toml that says which links are palms, soles, sensors, waist and IMU.\n",
            self.ends.join(", ")
        )
    }
}
