//! XML as text: the few things that MJCF needs.

use nalgebra::{Isometry3, Matrix3, Vector3};

/// A name as it may stand in an attribute.
pub fn escape(name: &str) -> String {
    let mut escaped = String::with_capacity(name.len());
    for character in name.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '"' => escaped.push_str("&quot;"),
            other => escaped.push(other),
        }
    }
    escaped
}

/// Numbers as MuJoCo reads them back, to the last bit.
pub fn numbers(values: &[f64]) -> String {
    values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}

/// `x y z`.
pub fn vector(v: &Vector3<f64>) -> String {
    numbers(v.as_slice())
}

/// `pos="…" quat="…"`.
pub fn pose(pose: &Isometry3<f64>) -> String {
    let q = pose.rotation.quaternion();
    format!(r#"pos="{}" quat="{}""#, vector(&pose.translation.vector), numbers(&[q.w, q.i, q.j, q.k]))
}

/// MuJoCo's order of an inertia matrix: `xx yy zz xy xz yz`.
pub fn inertia(i: &Matrix3<f64>) -> String {
    numbers(&[i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_break_out_of_their_attribute() {
        assert_eq!(escape("a\"<&b"), "a&quot;&lt;&amp;b");
    }

    #[test]
    fn numbers_come_back_to_the_last_bit() {
        let values = [0.1 + 0.2, -1e-300, 56.037_16, f64::MIN_POSITIVE];
        let read: Vec<f64> =
            numbers(&values).split(' ').map(|text| text.parse().expect("a number")).collect();
        assert_eq!(read, values);
    }
}
