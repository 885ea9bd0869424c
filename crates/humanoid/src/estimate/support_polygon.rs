//! The convex hull of the soles on the ground.

use crate::balance::{PerFoot, Side};
use mikoshi_spatial::{Foot, Pose, World};
use nalgebra::{Vector2, Vector3};

/// Corners of two soles.
const MOST_VERTICES: usize = 8;

/// A sole in its own frame \[m\].
#[derive(Clone, Copy, Debug, PartialEq)]
#[allow(missing_docs)]
pub struct SoleRectangle {
    pub x_min: f64,
    pub x_max: f64,
    pub y_min: f64,
    pub y_max: f64,
}

/// Convex hull of the corners of the soles that stand, seen from above, counter-clockwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SupportPolygon {
    vertices: [Vector2<f64>; MOST_VERTICES],
    count: usize,
}

impl SupportPolygon {
    /// Of the soles that stand somewhere.
    pub fn of_feet(soles: &PerFoot<SoleRectangle>, standing: &PerFoot<Option<Pose<World, Foot>>>) -> Self {
        let mut corners = [Vector2::zeros(); MOST_VERTICES];
        let mut count = 0;
        for side in Side::BOTH {
            let Some(pose) = &standing[side] else { continue };
            let sole = &soles[side];
            for (x, y) in [
                (sole.x_min, sole.y_min),
                (sole.x_max, sole.y_min),
                (sole.x_max, sole.y_max),
                (sole.x_min, sole.y_max),
            ] {
                corners[count] = pose.transform_point(&Vector3::new(x, y, 0.0)).xy();
                count += 1;
            }
        }
        Self::hull(&mut corners[..count])
    }

    /// Andrew's monotone chain: lower hull from left to right, upper hull back.
    fn hull(points: &mut [Vector2<f64>]) -> Self {
        points.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
        // One more than vertices: the chain ends where it began.
        let mut chain = [Vector2::zeros(); MOST_VERTICES + 1];
        let mut count = 0;
        let mut extend = |point: Vector2<f64>, floor: usize| {
            while count >= floor + 2 && turn(&chain[count - 2], &chain[count - 1], &point) <= 0.0 {
                count -= 1;
            }
            if count < chain.len() {
                chain[count] = point;
                count += 1;
            }
            count
        };
        let mut reached = 0;
        for &point in points.iter() {
            reached = extend(point, 0);
        }
        let floor = reached.saturating_sub(1);
        for &point in points.iter().rev().skip(1) {
            reached = extend(point, floor);
        }
        let mut vertices = [Vector2::zeros(); MOST_VERTICES];
        let count = if points.len() > 1 { reached - 1 } else { reached };
        vertices[..count].copy_from_slice(&chain[..count]);
        Self { vertices, count }
    }

    /// Its corners.
    pub fn vertices(&self) -> &[Vector2<f64>] {
        &self.vertices[..self.count]
    }

    /// Distance of a point from the edge \[m\]: positive inside, negative outside, −∞ where nothing
    /// stands.
    pub fn signed_distance(&self, point: &Vector2<f64>) -> f64 {
        let vertices = self.vertices();
        let edges = vertices.iter().zip(vertices.iter().cycle().skip(1));
        let mut to_edge = f64::INFINITY;
        let mut is_inside = vertices.len() >= 3;
        for (a, b) in edges {
            is_inside &= turn(a, b, point) >= 0.0;
            to_edge = to_edge.min(distance_to_segment(a, b, point));
        }
        if is_inside { to_edge } else { -to_edge }
    }
}

/// Twice the area of the triangle a, b, c: positive where it turns left.
fn turn(a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

fn distance_to_segment(a: &Vector2<f64>, b: &Vector2<f64>, point: &Vector2<f64>) -> f64 {
    let along = b - a;
    let length_squared = along.norm_squared();
    let share = if length_squared > 0.0 { (point - a).dot(&along) / length_squared } else { 0.0 };
    (point - a - along * share.clamp(0.0, 1.0)).norm()
}
