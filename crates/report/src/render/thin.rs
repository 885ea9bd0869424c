//! Lines with as many points as can be seen.

/// The parts of a line of finite points.
pub fn finite_parts(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|(x, y)| !x.is_finite() || !y.is_finite()).filter(|part| !part.is_empty())
}

/// A series over ascending x with at most two points in each `bin` of x: the lowest and the highest, in
/// their order. No extreme is lost, whatever the bin.
pub fn thin_series(points: &[(f64, f64)], bin: f64) -> Vec<(f64, f64)> {
    let mut thinned = Vec::new();
    for same_bin in points.chunk_by(|a, b| (a.0 / bin).floor() == (b.0 / bin).floor()) {
        let extreme = |better: fn(f64, f64) -> bool| {
            let mut best = 0;
            for (index, point) in same_bin.iter().enumerate() {
                if better(point.1, same_bin[best].1) {
                    best = index;
                }
            }
            best
        };
        let (lowest, highest) = (extreme(|a, b| a < b), extreme(|a, b| a > b));
        thinned.push(same_bin[lowest.min(highest)]);
        if lowest != highest {
            thinned.push(same_bin[lowest.max(highest)]);
        }
    }
    thinned
}

/// A curve without points that are nearer than `distance` to the one before; its last point stays.
pub fn thin_path(points: &[(f64, f64)], distance: f64) -> Vec<(f64, f64)> {
    let mut thinned: Vec<(f64, f64)> = Vec::new();
    for point in points {
        let is_far = |last: &(f64, f64)| (point.0 - last.0).hypot(point.1 - last.1) >= distance;
        if thinned.last().is_none_or(is_far) {
            thinned.push(*point);
        }
    }
    if let (Some(last), Some(kept)) = (points.last(), thinned.last_mut())
        && last != kept
    {
        thinned.push(*last);
    }
    thinned
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_thinned_series_keeps_its_extremes_and_its_order() {
        let points: Vec<_> = (0..1000).map(|i| (0.01 * f64::from(i), f64::from((i * 37) % 101))).collect();
        let thinned = thin_series(&points, 0.5);
        assert!(thinned.len() <= 2 * 21, "{} points", thinned.len());
        assert!(thinned.is_sorted_by(|a, b| a.0 < b.0));
        let highest = |points: &[(f64, f64)]| points.iter().map(|point| point.1).fold(f64::MIN, f64::max);
        let lowest = |points: &[(f64, f64)]| points.iter().map(|point| point.1).fold(f64::MAX, f64::min);
        assert_eq!((lowest(&thinned), highest(&thinned)), (0.0, 100.0));
    }

    #[test]
    fn a_series_without_surplus_stays_as_it_is() {
        let points = [(0.0, 1.0), (1.0, -1.0), (2.0, 4.0)];
        assert_eq!(thin_series(&points, 0.5), points);
    }

    #[test]
    fn a_thinned_path_ends_where_the_path_ends() {
        let points: Vec<_> = (0..=100).map(|i| (0.01 * f64::from(i), 0.0)).collect();
        let thinned = thin_path(&points, 0.3);
        assert_eq!(thinned.len(), 5);
        assert_eq!(thinned.last(), points.last());
    }

    #[test]
    fn lines_break_where_they_are_no_numbers() {
        let points = [(0.0, 1.0), (1.0, f64::NAN), (2.0, 4.0), (3.0, 4.0)];
        let parts: Vec<_> = finite_parts(&points).map(<[_]>::len).collect();
        assert_eq!(parts, [1, 2]);
    }
}
