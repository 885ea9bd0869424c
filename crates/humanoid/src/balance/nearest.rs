//! The nearest point of a convex region.

use crate::estimate::{SoleRectangle, SupportPolygon};
use nalgebra::Vector2;

/// The point of a support polygon that is nearest to `point`: itself inside. `None` where nothing
/// stands.
pub fn nearest_in_polygon(polygon: &SupportPolygon, point: &Vector2<f64>) -> Option<Vector2<f64>> {
    if polygon.signed_distance(point) >= 0.0 {
        return Some(*point);
    }
    let vertices = polygon.vertices();
    let on_edge = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
        let along = b - a;
        let length_squared = along.norm_squared();
        let share = if length_squared > 0.0 { (point - a).dot(&along) / length_squared } else { 0.0 };
        a + along * share.clamp(0.0, 1.0)
    };
    vertices
        .iter()
        .zip(vertices.iter().cycle().skip(1))
        .map(on_edge)
        .min_by(|a, b| (a - point).norm_squared().total_cmp(&(b - point).norm_squared()))
}

/// The point of a sole that is nearest to `point`, both in the foot's frame.
pub fn nearest_in_sole(sole: &SoleRectangle, point: &Vector2<f64>) -> Vector2<f64> {
    // A sole narrower than its margins is a line or a point, not a panic in clamp.
    let limit = |value: f64, min: f64, max: f64| value.min(max).max(min);
    Vector2::new(limit(point.x, sole.x_min, sole.x_max), limit(point.y, sole.y_min, sole.y_max))
}
