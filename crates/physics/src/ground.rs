//! Ground that nobody has told control of: boards on the floor, level or inclined, and patches, drawn by the run's seed.

use crate::random::{Draws, Purpose};
use mikoshi_config::Scenario;
use mikoshi_config::scenario::Ground;
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// A box in the floor, of which the upper face is ground.
#[derive(Clone, Debug, PartialEq)]
pub struct Slab {
    /// Of the box.
    pub centre_m: Vector3<f64>,
    /// Of the box in the world.
    pub attitude: UnitQuaternion<f64>,
    /// Full edge lengths; the last one is its depth.
    pub size_m: Vector3<f64>,
    /// Sliding friction and time constant of the contact, where they are not the floor's.
    pub surface: Option<[f64; 2]>,
}

/// How far the ground reaches beyond where robots stand in the beginning.
const AROUND_M: f64 = 1.5;
/// Nothing lies nearer to where a robot stands in the beginning.
const CLEAR_M: f64 = 0.32;
/// Slabs lie about so far from each other, one at most to a place.
const PITCH_M: f64 = 0.45;
/// How many places have a slab.
const COVERED: f64 = 0.5;
/// Shortest and longest edge.
const EDGE_M: [f64; 2] = [0.25, 0.45];
/// How deep slabs reach.
const DEPTH_M: f64 = 0.05;
/// How high a patch lies over the floor: less than control can tell.
const PATCH_M: f64 = 0.002;

/// All slabs of a run.
pub fn slabs(scenario: &Scenario) -> Vec<Slab> {
    let Some(ground) = &scenario.world.ground else { return vec![] };
    let places: Vec<_> = scenario.robots.iter().map(|member| Vector2::new(member.x_m, member.y_m)).collect();
    let least = places.iter().fold(Vector2::repeat(f64::INFINITY), |least, place| least.inf(place));
    let most = places.iter().fold(Vector2::repeat(f64::NEG_INFINITY), |most, place| most.sup(place));
    let origin = least - Vector2::repeat(AROUND_M);
    let counts =
        ((most - least + Vector2::repeat(2.0 * AROUND_M)) / PITCH_M).map(|count| count.ceil() as usize);
    let mut draws = Draws::new(scenario.seed, Purpose::Ground, 0);
    let mut slabs = vec![];
    for place in 0..counts.x * counts.y {
        let cell = Vector2::new((place % counts.x) as f64, (place / counts.x) as f64);
        let slab = draw(ground, origin + cell * PITCH_M, &mut draws);
        let is_clear = |robot: &Vector2<f64>| {
            (slab.centre_m.xy() - robot).norm() > CLEAR_M + slab.size_m.xy().norm() / 2.0
        };
        if draws.uniform() < COVERED && places.iter().all(is_clear) {
            slabs.push(slab);
        }
    }
    slabs
}

/// One slab somewhere in the cell that begins at `corner`. Of those that are not flat, half lie level and half are inclined;
/// none is higher than a step anywhere.
fn draw(ground: &Ground, corner: Vector2<f64>, draws: &mut Draws) -> Slab {
    let mut between = |least: f64, most: f64| least + (most - least) * draws.uniform();
    let centre = corner + Vector2::new(between(0.0, PITCH_M), between(0.0, PITCH_M));
    let heading = between(0.0, core::f64::consts::TAU);
    let [mut length, width] = [between(EDGE_M[0], EDGE_M[1]), between(EDGE_M[0], EDGE_M[1])];
    let height = ground.step_m * between(0.3, 1.0);
    let slope = ground.slope_deg.to_radians() * between(0.5, 1.0);
    let kind = between(0.0, 1.0);
    let is_patch = ground.patch_friction.is_some() && kind < if ground.is_flat() { 1.0 } else { 0.33 };
    let is_inclined = !is_patch && slope > 0.0 && (height == 0.0 || kind > 0.67);
    // Highest point of the upper face, and its rise.
    let (top, rise) = if is_patch {
        (PATCH_M, 0.0)
    } else if is_inclined {
        let most = if height > 0.0 { ground.step_m } else { f64::INFINITY };
        length = length.min(most / slope.sin());
        (length * slope.sin(), slope)
    } else {
        (height, 0.0)
    };
    let attitude = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading)
        * UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -rise);
    let upper_centre = Vector3::new(centre.x, centre.y, top - length / 2.0 * rise.sin());
    Slab {
        centre_m: upper_centre - attitude * Vector3::new(0.0, 0.0, DEPTH_M / 2.0),
        attitude,
        size_m: Vector3::new(length, width, DEPTH_M),
        surface: ground
            .patch_friction
            .filter(|_| is_patch)
            .map(|friction| [friction, ground.patch_contact_s]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GROUND: Ground =
        Ground { step_m: 0.015, slope_deg: 3.0, patch_friction: Some(0.3), patch_contact_s: 0.03 };

    #[test]
    fn no_slab_is_higher_than_a_step_or_steeper_than_it_may_be_and_there_are_all_kinds() {
        let mut draws = Draws::new(3, Purpose::Ground, 0);
        let slabs: Vec<_> = (0..300).map(|_| draw(&GROUND, Vector2::zeros(), &mut draws)).collect();
        for slab in &slabs {
            let half = slab.size_m / 2.0;
            let top = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]].map(|[x, y]| {
                (slab.centre_m + slab.attitude * Vector3::new(x * half.x, y * half.y, half.z)).z
            });
            let highest = top.into_iter().fold(f64::MIN, f64::max);
            assert!((0.0..=0.015 + 1e-9).contains(&highest), "{highest}");
            let tilt = (slab.attitude * Vector3::z()).angle(&Vector3::z());
            assert!(tilt <= 3f64.to_radians() + 1e-9, "{tilt}");
        }
        let steep = slabs.iter().filter(|slab| (slab.attitude * Vector3::z()).z < 1.0 - 1e-4).count();
        let patches = slabs.iter().filter(|slab| slab.surface.is_some()).count();
        assert!(steep > 50 && patches > 50 && steep + patches < 250, "{steep} {patches}");
    }
}
