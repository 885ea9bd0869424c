//! What was measured, in lines that a person reads.

use crate::rounds::{Comparison, Spread};

/// Parts and their times.
pub fn print_times(title: &str, rows: &[(&str, Spread)]) {
    println!("\n{title:<52} {:>9} {:>9} {:>9}", "median", "95 %", "99 %");
    for (name, Spread { median, p95, p99, .. }) in rows {
        println!("{name:<52} {median:6.2} µs {p95:6.2} µs {p99:6.2} µs");
    }
}

/// What two sides take for the same.
pub fn print_comparisons(title: &str, theirs: &str, rows: &[(&str, Comparison)]) {
    println!("\n{title:<52} {:>9} {theirs:>10} {:>7} {:>13}", "ours", "ratio", "5 to 95 %");
    for (name, Comparison { ours_us, theirs_us, ratio }) in rows {
        println!(
            "{name:<52} {:6.2} µs {:7.2} µs {:7.2} {:>13}",
            ours_us.median,
            theirs_us.median,
            ratio.median,
            format!("{:.2} to {:.2}", ratio.p5, ratio.p95)
        );
    }
}
