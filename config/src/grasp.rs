//! How hands hold the object, as a type and as it is written.

use serde::{Deserialize, Serialize};

/// How hands hold the object. In TOML a table whose `kind` is `weld` or `spring`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "GraspTable", into = "GraspTable")]
pub enum Grasp {
    /// A rigid grasp: a weld equality of the simulator.
    Weld {
        /// Largest grasp offset along each axis, drawn by seed.
        offset_m: f64,
    },
    /// A 6-DoF spring and damper at each hand.
    Spring {
        /// Largest grasp offset along each axis, drawn by seed.
        offset_m: f64,
        /// Translational stiffness.
        stiffness_n_m: f64,
        /// Translational damping.
        damping_ns_m: f64,
        /// Rotational stiffness.
        stiffness_nm_rad: f64,
        /// Rotational damping.
        damping_nms_rad: f64,
    },
}

/// [`Grasp`] as it is written: one flat table, which both TOML and bincode can hold.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct GraspTable {
    kind: GraspKind,
    offset_m: f64,
    #[serde(default)]
    stiffness_n_m: Option<f64>,
    #[serde(default)]
    damping_ns_m: Option<f64>,
    #[serde(default)]
    stiffness_nm_rad: Option<f64>,
    #[serde(default)]
    damping_nms_rad: Option<f64>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum GraspKind {
    Weld,
    Spring,
}

impl TryFrom<GraspTable> for Grasp {
    type Error = String;

    fn try_from(table: GraspTable) -> Result<Self, String> {
        let spring = [
            ("stiffness_n_m", table.stiffness_n_m),
            ("damping_ns_m", table.damping_ns_m),
            ("stiffness_nm_rad", table.stiffness_nm_rad),
            ("damping_nms_rad", table.damping_nms_rad),
        ];
        match (table.kind, spring.map(|(_, value)| value)) {
            (GraspKind::Weld, [None, None, None, None]) => Ok(Self::Weld { offset_m: table.offset_m }),
            (
                GraspKind::Spring,
                [Some(stiffness_n_m), Some(damping_ns_m), Some(stiffness_nm_rad), Some(damping_nms_rad)],
            ) => Ok(Self::Spring {
                offset_m: table.offset_m,
                stiffness_n_m,
                damping_ns_m,
                stiffness_nm_rad,
                damping_nms_rad,
            }),
            (kind, _) => {
                let is_weld = matches!(kind, GraspKind::Weld);
                let wrong = spring.iter().filter(|(_, value)| value.is_some() == is_weld);
                let names = wrong.map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
                Err(if is_weld {
                    format!("found {names}, expected them with kind = \"spring\" only")
                } else {
                    format!("found no {names}, expected them with kind = \"spring\"")
                })
            }
        }
    }
}

impl From<Grasp> for GraspTable {
    fn from(grasp: Grasp) -> Self {
        match grasp {
            Grasp::Weld { offset_m } => Self {
                kind: GraspKind::Weld,
                offset_m,
                stiffness_n_m: None,
                damping_ns_m: None,
                stiffness_nm_rad: None,
                damping_nms_rad: None,
            },
            Grasp::Spring { offset_m, stiffness_n_m, damping_ns_m, stiffness_nm_rad, damping_nms_rad } => {
                Self {
                    kind: GraspKind::Spring,
                    offset_m,
                    stiffness_n_m: Some(stiffness_n_m),
                    damping_ns_m: Some(damping_ns_m),
                    stiffness_nm_rad: Some(stiffness_nm_rad),
                    damping_nms_rad: Some(damping_nms_rad),
                }
            }
        }
    }
}
