//! The support polygon of a standing robot, as it truly is.

use mikoshi_ipc_types::MAX_FEET;
use nalgebra::Vector2;

/// Corners of all soles.
pub const MAX_CORNERS: usize = 4 * MAX_FEET;

/// Signed distance \[m\] of a point to the edge of the convex hull of `corners`: positive inside,
/// negative outside, `None` without a hull (fewer than three corners that are not in line).
///
/// Sorts `corners` in place (Andrew's monotone chain).
pub fn margin(corners: &mut [Vector2<f64>], point: &Vector2<f64>) -> Option<f64> {
    if corners.len() > MAX_CORNERS {
        return None;
    }
    corners.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let mut hull = [Vector2::zeros(); 2 * MAX_CORNERS];
    let mut count = 0;
    // The lower chain from left to right, then the upper one back; counter-clockwise.
    let upper = corners.iter().rev().skip(1);
    let mut chain_start = 1;
    for (index, corner) in corners.iter().chain(upper).enumerate() {
        if index == corners.len() {
            chain_start = count;
        }
        while count > chain_start && turn(&hull[count - 2], &hull[count - 1], corner) <= 0.0 {
            count -= 1;
        }
        hull[count] = *corner;
        count += 1;
    }
    // The last corner is the first again.
    let edges = || hull[..count].iter().zip(&hull[1..count]);
    if count < 4 {
        return None;
    }
    let depth = |(a, b): (&Vector2<f64>, &Vector2<f64>)| turn(a, b, point) / (b - a).norm();
    let inside = edges().map(depth).fold(f64::INFINITY, f64::min);
    if inside >= 0.0 {
        return Some(inside);
    }
    let distance = |(a, b): (&Vector2<f64>, &Vector2<f64>)| {
        let along = ((point - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        (point - (a + (b - a) * along)).norm()
    };
    Some(-edges().map(distance).fold(f64::INFINITY, f64::min))
}

/// Positive where a → b → c turns left: twice the triangle's area.
fn turn(a: &Vector2<f64>, b: &Vector2<f64>, c: &Vector2<f64>) -> f64 {
    (b - a).perp(&(c - a))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_soles() -> Vec<Vector2<f64>> {
        [(0.0, 0.0), (0.24, 0.0), (0.24, 0.1), (0.0, 0.1), (0.0, 0.2), (0.24, 0.2), (0.24, 0.3), (0.0, 0.3)]
            .map(|(x, y)| Vector2::new(x, y))
            .to_vec()
    }

    #[test]
    fn the_gap_between_two_soles_supports() {
        let at = |x, y| margin(&mut two_soles(), &Vector2::new(x, y)).expect("a hull");
        assert!((at(0.12, 0.15) - 0.12).abs() < 1e-12);
        assert!((at(0.01, 0.15) - 0.01).abs() < 1e-12);
        assert!((at(0.12, 0.29) - 0.01).abs() < 1e-12);
    }

    #[test]
    fn outside_the_distance_to_the_nearest_edge_or_corner_counts_negative() {
        let at = |x, y| margin(&mut two_soles(), &Vector2::new(x, y)).expect("a hull");
        assert!((at(0.30, 0.15) + 0.06).abs() < 1e-12);
        assert!((at(-0.03, -0.04) + 0.05).abs() < 1e-12);
    }

    #[test]
    fn points_in_line_and_no_points_support_nothing() {
        let mut line = [Vector2::new(0.0, 0.0), Vector2::new(1.0, 1.0), Vector2::new(2.0, 2.0)];
        assert_eq!(margin(&mut line, &Vector2::zeros()), None);
        assert_eq!(margin(&mut [], &Vector2::zeros()), None);
    }
}
