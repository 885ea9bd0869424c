//! What the runs of a sweep came to: `sweep.json`, which others script against. Keys stay; more may follow.
//! SI units.

use mikoshi_config::Sweep;
use mikoshi_report::ComparedRuns;
use serde::Serialize;
use serde_json::Value;
use std::collections::BTreeMap;

/// A sweep's result.
#[derive(Clone, Debug, Serialize)]
pub struct SweepResult {
    pub sweep: String,
    pub scenario: String,
    pub passed: bool,
    pub succeeded: u64,
    /// Of as many runs as there are: a sweep that is cut short needs its share.
    pub succeed_min: u64,
    /// Keys by which runs differ: those of the grid, then those that were drawn.
    pub parameters: Vec<String>,
    pub median: Figures,
    pub worst: Figures,
    /// The runs beside what the paper predicts of them, where the sweep asks for it.
    pub comparison: Option<ComparedRuns>,
    /// Where they agree, and where not.
    pub findings: Vec<String>,
    pub runs: Vec<Row>,
}

/// One run.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    pub run: u64,
    pub seed: u64,
    pub parameters: BTreeMap<String, f64>,
    pub passed: bool,
    /// Every threshold that was not met, and every fault, in words.
    pub failures: Vec<String>,
    pub figures: Figures,
}

/// Figures by which runs are compared. NaN where a run has none.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Figures {
    /// Of all axes.
    pub position_peak_m: f64,
    pub position_rms_m: f64,
    pub attitude_rms_rad: f64,
    /// Of all robots.
    pub zmp_margin_min_m: f64,
    pub foot_slip_max_m: f64,
    /// Of all internal forces.
    pub internal_peak_n: f64,
    pub internal_end_n: f64,
    pub internal_end_nm: f64,
}

impl SweepResult {
    /// Of these runs.
    pub fn of(sweep: &Sweep, runs: Vec<Row>, comparison: Option<ComparedRuns>) -> Self {
        let succeeded = runs.iter().filter(|row| row.passed).count() as u64;
        let succeed_min = share(sweep.succeed_min, runs.len() as u64, sweep.all_runs());
        Self {
            sweep: sweep.name.clone(),
            scenario: sweep.scenario.clone(),
            passed: succeeded >= succeed_min && comparison.as_ref().is_none_or(ComparedRuns::is_met),
            succeeded,
            succeed_min,
            parameters: sweep.parameters().map(str::to_owned).collect(),
            median: Figures::over(&runs, median, median),
            worst: Figures::over(&runs, largest, smallest),
            findings: comparison.as_ref().map_or_else(Vec::new, ComparedRuns::findings),
            comparison,
            runs,
        }
    }
}

/// `of_all` of `all`, for `count` of them, rounded up.
pub fn share(of_all: u64, count: u64, all: u64) -> u64 {
    let product = u128::from(of_all) * u128::from(count);
    u64::try_from(product.div_ceil(u128::from(all.max(1)))).unwrap_or(u64::MAX)
}

impl Figures {
    /// From a run's summary.
    pub fn of(summary: &Value) -> Self {
        let object =
            |figure: &str| largest(&mut numbers(summary["object"][figure].as_array(), |value| value));
        let robots = |figure: &str| numbers(summary["robots"].as_array(), |robot| &robot[figure]);
        let internal =
            |figure: &str| largest(&mut numbers(summary["internal"].as_array(), |row| &row[figure]));
        Self {
            position_peak_m: object("position_peak_m"),
            position_rms_m: object("position_rms_m"),
            attitude_rms_rad: object("attitude_rms_rad"),
            zmp_margin_min_m: smallest(&mut robots("zmp_margin_min_m")),
            foot_slip_max_m: largest(&mut robots("foot_slip_max_m")),
            internal_peak_n: internal("peak_n"),
            internal_end_n: internal("end_n"),
            internal_end_nm: internal("end_nm"),
        }
    }

    /// Each figure over all runs: by `of_errors`, or by `of_margins` where more is better.
    fn over(runs: &[Row], of_errors: fn(&mut [f64]) -> f64, of_margins: fn(&mut [f64]) -> f64) -> Self {
        let over = |figure: fn(&Self) -> f64, fold: fn(&mut [f64]) -> f64| {
            fold(&mut runs.iter().map(|row| figure(&row.figures)).collect::<Vec<_>>())
        };
        Self {
            position_peak_m: over(|figures| figures.position_peak_m, of_errors),
            position_rms_m: over(|figures| figures.position_rms_m, of_errors),
            attitude_rms_rad: over(|figures| figures.attitude_rms_rad, of_errors),
            zmp_margin_min_m: over(|figures| figures.zmp_margin_min_m, of_margins),
            foot_slip_max_m: over(|figures| figures.foot_slip_max_m, of_errors),
            internal_peak_n: over(|figures| figures.internal_peak_n, of_errors),
            internal_end_n: over(|figures| figures.internal_end_n, of_errors),
            internal_end_nm: over(|figures| figures.internal_end_nm, of_errors),
        }
    }
}

/// JSON has no word for NaN, which is written as null.
fn numbers(array: Option<&Vec<Value>>, figure: impl Fn(&Value) -> &Value) -> Vec<f64> {
    array.into_iter().flatten().map(|value| figure(value).as_f64().unwrap_or(f64::NAN)).collect()
}

/// NaN if any is, or if there are none.
fn largest(values: &mut [f64]) -> f64 {
    // NaN counts as larger than all.
    values.iter().copied().map(f64::abs).max_by(f64::total_cmp).unwrap_or(f64::NAN)
}

/// NaN if any is, or if there are none.
fn smallest(values: &mut [f64]) -> f64 {
    match values.iter().any(|value| value.is_nan()) {
        true => f64::NAN,
        false => values.iter().copied().min_by(f64::total_cmp).unwrap_or(f64::NAN),
    }
}

/// Of those that are numbers.
fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    let count = values.iter().take_while(|value| !value.is_nan()).count();
    match (count, count / 2) {
        (0, _) => f64::NAN,
        (count, middle) if count % 2 == 1 => values[middle],
        (_, middle) => 0.5 * (values[middle - 1] + values[middle]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn summary(position_m: [f64; 3], margins_m: [f64; 2]) -> Value {
        json!({
            "object": { "position_peak_m": position_m },
            "robots": margins_m.map(|zmp_margin_min_m| json!({ "zmp_margin_min_m": zmp_margin_min_m })),
            "internal": [{ "peak_n": 3.0 }, { "peak_n": 5.0 }, { "peak_n": 4.0 }],
        })
    }

    fn row(figures: Figures) -> Row {
        Row { run: 0, seed: 0, parameters: BTreeMap::new(), passed: true, failures: vec![], figures }
    }

    #[test]
    fn a_runs_figures_are_those_of_its_worst_axis_robot_and_internal_force() {
        let figures = Figures::of(&summary([0.001, 0.003, 0.002], [0.04, 0.03]));
        assert_eq!((figures.position_peak_m, figures.zmp_margin_min_m), (0.003, 0.03));
        assert_eq!(figures.internal_peak_n, 5.0);
    }

    #[test]
    fn a_figure_that_is_no_number_is_the_worst_and_does_not_move_the_median() {
        let of = |margin_m| row(Figures::of(&summary([1e-3; 3], [0.05, margin_m])));
        let rows = [of(0.04), of(0.03), of(f64::NAN), of(0.02)];
        let worst = Figures::over(&rows, largest, smallest);
        assert!(worst.zmp_margin_min_m.is_nan());
        assert_eq!(Figures::over(&rows, median, median).zmp_margin_min_m, 0.03);
        assert_eq!(Figures::over(&rows[..2], median, median).zmp_margin_min_m, 0.035);
        assert_eq!(
            Figures::over(&rows[..2], largest, smallest).zmp_margin_min_m,
            0.03,
            "the smallest is the worst"
        );
        assert!(
            largest(&mut [1.0, f64::NAN]).is_nan() && largest(&mut []).is_nan() && smallest(&mut []).is_nan()
        );
    }

    #[test]
    fn a_sweep_that_is_cut_short_needs_its_share() {
        assert_eq!([share(97, 100, 100), share(97, 6, 100), share(97, 50, 100)], [97, 6, 49]);
        assert_eq!(share(0, 6, 100), 0);
    }
}
