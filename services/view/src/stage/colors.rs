//! Who has which colour.

use re_sdk_types::components::Color;

/// By robot, in turn: far apart, and none like the object or a force.
const OF_ROBOTS: [[u8; 3]; 8] = [
    [70, 130, 255],
    [255, 120, 60],
    [60, 200, 90],
    [225, 80, 215],
    [60, 205, 205],
    [245, 95, 120],
    [150, 120, 255],
    [165, 200, 60],
];
const OBJECT: [u8; 3] = [205, 150, 75];
const SUPPORT: [u8; 3] = [235, 235, 235];
const ZMP: [u8; 3] = [255, 40, 40];
const FORCE: [u8; 3] = [255, 225, 60];
const FIXED: [u8; 3] = [130, 130, 130];

pub fn of_robot(index: usize) -> Color {
    rgb(OF_ROBOTS[index % OF_ROBOTS.len()])
}

/// A part of a robot: its colour, as bright as the part is in the URDF.
pub fn of_part(robot: usize, [r, g, b, a]: [f64; 4]) -> Color {
    let brightness = 0.25 + 0.75 * (0.30 * r + 0.59 * g + 0.11 * b).clamp(0.0, 1.0);
    let [r, g, b] = OF_ROBOTS[robot % OF_ROBOTS.len()].map(|part| (f64::from(part) * brightness) as u8);
    Color::from_unmultiplied_rgba(r, g, b, (a.clamp(0.0, 1.0) * 255.0) as u8)
}

/// The object.
pub fn object() -> Color {
    rgb(OBJECT)
}

/// Where it is asked to be.
pub fn ghost() -> Color {
    Color::from_unmultiplied_rgba(255, 255, 255, 60)
}

pub fn support() -> Color {
    rgb(SUPPORT)
}

pub fn zmp() -> Color {
    rgb(ZMP)
}

pub fn force() -> Color {
    rgb(FORCE)
}

pub fn fixed() -> Color {
    rgb(FIXED)
}

fn rgb([r, g, b]: [u8; 3]) -> Color {
    Color::from_rgb(r, g, b)
}
