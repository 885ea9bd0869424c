//! A robot model: its URDF, which of its links are hands, feet and sensors, and how it stands.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// `config/robots/*.toml`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotConfig {
    /// Name of the model.
    pub name: String,
    /// URDF beside this file.
    pub urdf: String,
    /// Where `package://NAME/` leads: relative to this file where it is written, absolute once it is loaded.
    #[serde(default)]
    pub packages: BTreeMap<String, String>,
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
