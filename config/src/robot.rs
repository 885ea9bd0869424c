//! A robot model: its URDF, which of its links are hands, feet and sensors, and how it stands.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// `config/robots/*.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// Name of the model.
    pub name: String,
    /// URDF beside this file, or wherever a path leads; `${NAME}/` at its beginning is an environment variable.
    pub urdf: String,
    /// Where `package://NAME/` leads: relative to this file where it is written, or from a variable as above; absolute
    /// once it is loaded.
    #[serde(default)]
    pub packages: BTreeMap<String, String>,
    /// What becomes of shapes that are meshes.
    #[serde(default)]
    pub meshes: Meshes,
    /// Grasping hands, in order (right, left).
    pub hands: Vec<HandConfig>,
    /// Feet, in order (right, left).
    pub feet: Vec<FootConfig>,
    /// URDF link of the waist: the body whose attitude eq. 41 controls.
    pub waist_link: String,
    /// URDF link of the IMU.
    pub imu_link: String,
    /// Drive gains by the first pattern that matches a joint's name.
    pub drives: Vec<DriveConfig>,
    /// The posture from which a carry starts, and to which the null space returns, by joint name.
    pub carry_posture_deg: BTreeMap<String, f64>,
    /// Height of the centre of mass above the soles while carrying.
    pub com_height_m: f64,
    /// Lateral distance between the ankles' centres while standing.
    pub foot_spacing_m: f64,
}

/// What becomes of shapes that are meshes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Meshes {
    /// Their files are needed.
    #[default]
    Needed,
    /// They are left out: what has no other shape touches nothing.
    LeftOut,
}

/// A hand that can grasp.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandConfig {
    /// Name, unique in the robot: `right`, `left`.
    pub name: String,
    /// URDF link at the palm's centre: the paper's Σh.
    pub palm_link: String,
    /// URDF link of the wrist force/torque sensor.
    pub sensor_link: String,
    /// Palm in the robot's ground frame (midpoint between the soles, x ahead) while carrying.
    pub carry_position_m: [f64; 3],
    /// Its rotation, row by row.
    pub carry_rotation: [[f64; 3]; 3],
}

/// A foot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FootConfig {
    /// Name, unique in the robot: `right`, `left`.
    pub name: String,
    /// URDF link at the sole, on the ground below the ankle.
    pub sole_link: String,
    /// URDF link of the ankle force/torque sensor.
    pub sensor_link: String,
    /// Sole rectangle in the sole's frame: `[x_min, x_max, y_min, y_max]`.
    pub sole_m: [f64; 4],
}

/// Position drive of the joints whose names match.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DriveConfig {
    /// Joint name with at most one `*`.
    pub joints: String,
    /// Position gain.
    pub kp_nm_rad: f64,
    /// Velocity gain.
    pub kv_nms_rad: f64,
    /// Reflected rotor inertia.
    pub armature_kg_m2: f64,
}

impl RobotConfig {
    /// The drive of this joint, if it has one.
    pub fn drive_of(&self, joint: &str) -> Option<&DriveConfig> {
        self.drives.iter().find(|drive| drive.is_for(joint))
    }
}

impl DriveConfig {
    /// Whether it drives this joint, if no drive before it does.
    fn is_for(&self, joint: &str) -> bool {
        match self.joints.split_once('*') {
            None => self.joints == joint,
            Some((head, tail)) => {
                joint.len() >= head.len() + tail.len() && joint.starts_with(head) && joint.ends_with(tail)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_star_stands_for_any_text_but_overlaps_nothing() {
        let is_for = |joints: &str, joint| {
            let (joints, [kp_nm_rad, kv_nms_rad, armature_kg_m2]) = (joints.to_owned(), [1.0; 3]);
            DriveConfig { joints, kp_nm_rad, kv_nms_rad, armature_kg_m2 }.is_for(joint)
        };
        assert!(is_for("RLEG_*", "RLEG_JOINT0") && is_for("*_JOINT0", "RLEG_JOINT0"));
        assert!(is_for("R*0", "RLEG_JOINT0") && is_for("*", "x") && is_for("a", "a"));
        assert!(!is_for("RLEG_*", "LLEG_JOINT0") && !is_for("aba*ba", "aba") && !is_for("a", "ab"));
    }
}
