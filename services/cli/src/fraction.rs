//! Numbers as people write them.

use core::fmt;

/// Fractions of denominators up to this are recognised.
const LARGEST_DENOMINATOR: u32 = 64;

/// A number, shown as a fraction where it is one: `1/8`, `-1/2`, `3`, else `0.3142`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fraction(pub f64);

impl fmt::Display for Fraction {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let value = self.0;
        let as_fraction = (1..=LARGEST_DENOMINATOR).map(f64::from).find_map(|denominator| {
            let numerator = (value * denominator).round();
            let is_equal = (value - numerator / denominator).abs() <= 1e-12 * value.abs().max(1.0);
            is_equal.then_some((numerator, denominator))
        });
        f.pad(&match as_fraction {
            // Adding zero makes a negative zero positive.
            Some((numerator, 1.0)) => format!("{}", numerator + 0.0),
            Some((numerator, denominator)) => format!("{numerator}/{denominator}"),
            None => format!("{value:.4}"),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fractions_are_shown_as_fractions_in_lowest_terms() {
        let text = |value| Fraction(value).to_string();
        assert_eq!(text(0.125), "1/8");
        assert_eq!(text(-0.5), "-1/2");
        assert_eq!(text(2.0 / 6.0), "1/3");
        assert_eq!(text(3.0), "3");
        assert_eq!(text(-0.0), "0");
        assert_eq!(text(1e-17), "0");
        assert_eq!(text(core::f64::consts::PI), "3.1416");
    }
}
