//! The world of a run as MJCF, MuJoCo's own language.
//!
//! # What is modelled
//! Every robot floats; its joints have the drives' armature and position servos whose torque ends at
//! the URDF's effort. What a wrist or ankle sensor carries is a body of its own, so that the sensor
//! measures what passes through it. The grasp is a site on the object for each hand, displaced from
//! where the hand truly is by the grasp offset: a weld or a spring pulls the palm to it.
//!
//! # What touches what
//! Everything touches everything, except bodies that are neighbours in a robot (no colliding body lies
//! between them), a grasping hand with the object, and what stands fixed in the world with its like.
//!
//! # Names
//! Bodies, joints, actuators and sites are `ROBOT/LINK`, geoms `ROBOT/LINK#0`, `#1` …; the world's boxes
//! are `world/BOX`, what lies on the floor `floor#0` …; `floor` and `object` stand alone.

mod robot;
mod text;

pub use robot::{force_and_torque, gyro_and_accelerometer};

use crate::grasp::GraspSite;
use crate::robot::{Robot, isometry};
use core::fmt::Write;
use mikoshi_config::Scenario;
use mikoshi_config::scenario::{FixedBox, Grasp};
use mikoshi_physics::{GRAVITY_M_S2, ObjectBody};
use mikoshi_physics::{Slab, slabs};
use nalgebra::{Matrix3, Vector3};
use text::{escape, numbers, pose};

/// The floor's and the object's names.
pub const FLOOR: &str = "floor";
/// The object's body, geom and joint.
pub const OBJECT: &str = "object";

/// The largest picture that can be drawn of a world, in pixels.
pub const MAX_PICTURE_WIDTH: u32 = 1920;
/// The same in height.
pub const MAX_PICTURE_HEIGHT: u32 = 1080;

/// What worlds look like; physics knows nothing of it. The floor has squares of half a metre.
const LOOKS: &str = r#"  <visual>
    <global offwidth="1920" offheight="1080"/>
    <headlight ambient="0.35 0.35 0.35" diffuse="0.35 0.35 0.35" specular="0 0 0"/>
  </visual>
  <asset>
    <texture name="sky" type="skybox" builtin="gradient" rgb1="0.95 0.97 1" rgb2="0.7 0.78 0.88" width="64" height="384"/>
    <texture name="floor" type="2d" builtin="checker" rgb1="0.82 0.82 0.80" rgb2="0.74 0.74 0.72" width="256" height="256"/>
    <material name="floor" texture="floor" texrepeat="1 1" texuniform="true"/>
  </asset>"#;

/// The name of a fixed box. No geom of a robot is called so, even of a robot called `world`: theirs have
/// an index.
pub fn fixed_box(name: &str) -> String {
    qualified("world", name)
}

/// `ROBOT/ELEMENT`.
pub fn qualified(robot: &str, element: &str) -> String {
    format!("{robot}/{element}")
}

/// The whole world.
///
/// Contacts: an elliptic cone with impratio 100. With the pyramidal cone soles creep under a constant
/// tangential load, since its friction is regularised.
pub fn world(scenario: &Scenario, object: &ObjectBody, robots: &[Robot], grasps: &[GraspSite]) -> String {
    let mut xml = String::new();
    // Writing to a String cannot fail.
    write_world(&mut xml, scenario, object, robots, grasps).unwrap_or_default();
    xml
}

fn write_world(
    xml: &mut String,
    scenario: &Scenario,
    object: &ObjectBody,
    robots: &[Robot],
    grasps: &[GraspSite],
) -> core::fmt::Result {
    let friction = scenario.physics.friction;
    writeln!(
        xml,
        r#"<mujoco model="{}">
  <compiler angle="radian" autolimits="true" inertiafromgeom="false"/>
  <option timestep="{}" integrator="implicitfast" solver="Newton" jacobian="sparse" cone="elliptic" impratio="100" gravity="0 0 {}">
    <flag autoreset="disable"/>
  </option>
  <default>
    <geom condim="3" friction="{friction} 0.005 0.0001" solref="0.02 1" solimp="0.9 0.95 0.001"/>
  </default>
{LOOKS}"#,
        escape(&scenario.name),
        scenario.physics.step_s,
        -GRAVITY_M_S2,
    )?;
    robot::write_meshes(xml, robots)?;
    writeln!(xml, "  <worldbody>")?;
    writeln!(
        xml,
        r#"    <light directional="true" castshadow="false" diffuse="0.45 0.45 0.45" pos="0 0 5" dir="0.3 0.4 -1"/>"#
    )?;
    writeln!(xml, r#"    <geom name="{FLOOR}" type="plane" size="20 20 1" material="{FLOOR}"/>"#)?;
    for fixed in &scenario.world.boxes {
        write_fixed_box(xml, fixed)?;
    }
    for (index, slab) in slabs(scenario).iter().enumerate() {
        write_slab(xml, index, slab)?;
    }
    write_object(xml, scenario, object, grasps)?;
    for robot in robots {
        robot::write_bodies(xml, robot)?;
    }
    writeln!(xml, "  </worldbody>\n  <actuator>")?;
    for robot in robots {
        robot::write_actuators(xml, robot)?;
    }
    writeln!(xml, "  </actuator>\n  <sensor>")?;
    for robot in robots {
        robot::write_sensors(xml, robot)?;
    }
    writeln!(xml, "  </sensor>\n  <contact>")?;
    for robot in robots {
        robot::write_exclusions(xml, robot)?;
    }
    writeln!(xml, "  </contact>")?;
    if matches!(scenario.grasp, Grasp::Weld { .. }) {
        writeln!(xml, "  <equality>")?;
        for grasp in grasps {
            writeln!(
                xml,
                r#"    <weld name="{0}" site1="{0}" site2="{1}" solref="0.02 1" active="{2}"/>"#,
                escape(&grasp.palm),
                escape(&grasp.site),
                grasp.begins_closed,
            )?;
        }
        writeln!(xml, "  </equality>")?;
    }
    writeln!(xml, "</mujoco>")
}

fn write_fixed_box(xml: &mut String, fixed: &FixedBox) -> core::fmt::Result {
    // Of two geoms the one of higher priority says what the friction is; else the larger one counts.
    let friction = fixed
        .friction
        .map_or_else(String::new, |friction| format!(r#" priority="1" friction="{friction} 0.005 0.0001""#));
    writeln!(
        xml,
        r#"    <geom name="{}" type="box" pos="{}" quat="{}" size="{}"{friction}/>"#,
        escape(&fixed_box(&fixed.name)),
        numbers(&fixed.position_m),
        numbers(&about_z(fixed.yaw_deg)),
        numbers(&fixed.size_m.map(|edge| 0.5 * edge)),
    )
}

fn write_slab(xml: &mut String, index: usize, slab: &Slab) -> core::fmt::Result {
    let surface = slab.surface.map_or_else(String::new, |[friction, contact_s]| {
        format!(
            r#" priority="1" friction="{friction} 0.005 0.0001" solref="{contact_s} 1" rgba="0.6 0.7 0.8 1""#
        )
    });
    let attitude = slab.attitude.quaternion();
    writeln!(
        xml,
        r#"    <geom name="{}{index}" type="box" pos="{}" quat="{}" size="{}"{surface}/>"#,
        ground_prefix(),
        numbers(slab.centre_m.as_slice()),
        numbers(&[attitude.w, attitude.i, attitude.j, attitude.k]),
        numbers((slab.size_m * 0.5).as_slice()),
    )
}

/// What names of the ground's slabs begin with. No geom of a robot is called so: theirs have a slash before their index.
pub fn ground_prefix() -> String {
    format!("{FLOOR}#")
}

/// `qw qx qy qz` of a heading.
fn about_z(yaw_deg: f64) -> [f64; 4] {
    let half_yaw = 0.5 * yaw_deg.to_radians();
    [half_yaw.cos(), 0.0, 0.0, half_yaw.sin()]
}

/// The simulator has fewer numbers for a body whose centre of mass is its origin, and a model can only be changed for one
/// that has as many: a millionth of a metre tells bodies that change from those that don't.
fn com_of(scenario: &Scenario, body: &ObjectBody) -> [f64; 3] {
    let aside = if scenario.world.load_changes.is_empty() { 0.0 } else { 1e-6 };
    (body.com_m + Vector3::new(0.0, 0.0, aside)).into()
}

fn inertia_of(inertia: &Matrix3<f64>) -> String {
    let diagonal = [inertia.m11, inertia.m22, inertia.m33];
    match [inertia.m12, inertia.m13, inertia.m23] {
        [0.0, 0.0, 0.0] => format!(r#"diaginertia="{}""#, numbers(&diagonal)),
        products => format!(r#"fullinertia="{} {}""#, numbers(&diagonal), numbers(&products)),
    }
}

fn write_object(
    xml: &mut String,
    scenario: &Scenario,
    body: &ObjectBody,
    grasps: &[GraspSite],
) -> core::fmt::Result {
    let object = &scenario.object;
    let [x, y, z] = object.size_m;
    writeln!(
        xml,
        r#"    <body name="{OBJECT}" pos="{}" quat="{}">
      <freejoint/>
      <inertial pos="{}" mass="{}" {}/>
      <geom name="{OBJECT}" type="box" size="{}"/>"#,
        numbers(&object.position_m),
        numbers(&about_z(object.yaw_deg)),
        numbers(&com_of(scenario, body)),
        body.mass_kg,
        inertia_of(&body.inertia_kg_m2),
        numbers(&[0.5 * x, 0.5 * y, 0.5 * z]),
    )?;
    for grasp in grasps {
        writeln!(xml, r#"      <site name="{}" {}/>"#, escape(&grasp.site), pose(&grasp.pose_in_object))?;
    }
    writeln!(xml, "    </body>")
}
