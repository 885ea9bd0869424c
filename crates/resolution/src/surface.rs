//! How far a palm is from what it is to grasp.

use nalgebra::Vector3;

/// Distance of a point from the surface of a box about the origin \[m\]: positive outside, negative
/// inside. `size_m` holds the full edge lengths.
pub(crate) fn distance_to_box(point: &Vector3<f64>, size_m: &[f64; 3]) -> f64 {
    let beyond = point.abs() - Vector3::from(*size_m) * 0.5;
    match beyond.max() {
        inside if inside <= 0.0 => inside,
        _ => beyond.map(|b| b.max(0.0)).norm(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distance_to_a_box_is_signed_and_euclidean() {
        let size_m = [2.0, 4.0, 6.0];
        let distance = |x, y, z| distance_to_box(&Vector3::new(x, y, z), &size_m);
        assert_eq!(distance(1.0, 0.0, 0.0), 0.0);
        assert_eq!(distance(1.5, 0.0, 0.0), 0.5);
        assert_eq!(distance(0.0, -1.5, 0.0), -0.5);
        assert_eq!(distance(4.0, 6.0, 0.0), 5.0);
    }
}
