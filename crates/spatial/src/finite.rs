//! Whether numbers are.

/// Whether all are finite, without a branch for each: times zero they are zero, or else NaN.
pub(crate) fn are_finite<'a>(values: impl IntoIterator<Item = &'a f64>) -> bool {
    values.into_iter().fold(0.0, |sum, value| sum + value * 0.0) == 0.0
}

#[cfg(test)]
mod tests {
    use super::are_finite;

    #[test]
    fn one_that_is_not_is_found_wherever_it_stands() {
        let largest = [f64::MAX, -f64::MAX, f64::MAX, f64::MIN_POSITIVE, -0.0];
        assert!(are_finite(&largest));
        for place in 0..largest.len() {
            for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
                let mut values = largest;
                values[place] = bad;
                assert!(!are_finite(&values), "{bad} at {place}");
            }
        }
    }
}
