//! What a way between hosts, as it was measured, asks of a scenario.

use crate::failure::Failure;
use crate::gain::GainReport;
use crate::prepare::Prepared;
use mikoshi_cooperation::critical_loop_gain;
use serde::{Deserialize, Serialize};
use std::fs;
use std::path::Path;

/// What the coordinator and a servo do within the age of a command, beside the way: a measurement of the way alone
/// does not know of it, a team that runs does.
const OWN_WORK_TICKS: u64 = 1;

/// What is asked for.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct WayReport {
    /// The least age of commands that 999 of 1000 reach.
    pub coordination_delay_ticks: u64,
    /// The highest loop gain that is recommended with it.
    pub loop_gain_max: f64,
}

/// What `mikoshi-link measure ask` prints, or a link reports of a run.
#[derive(Deserialize)]
struct Measured {
    /// Of messages alone.
    round_trip: Option<RoundTrip>,
    /// Of a team's frames, in its own ticks.
    fitting_delay_ticks: Option<u64>,
}

#[derive(Deserialize)]
struct RoundTrip {
    p999_s: f64,
}

impl WayReport {
    /// By what this file says was measured.
    ///
    /// # Errors
    /// It can't be read, or says nothing of a way: bad usage.
    pub fn of(file: &Path, prepared: &Prepared, gains: &GainReport) -> Result<Self, Failure> {
        let scenario = &prepared.run.scenario;
        let wrong = |why: String| Failure::usage(why).context(file.display());
        let text = fs::read_to_string(file).map_err(|error| wrong(error.to_string()))?;
        let ticks = ticks(&text, scenario.wall_period_s()).map_err(wrong)?;
        let others = gains.delay_ticks - scenario.coordination_delay_ticks;
        let critical = critical_loop_gain(ticks + others, gains.filter_hz, scenario.control_period_s);
        Ok(Self { coordination_delay_ticks: ticks, loop_gain_max: gains.recommended_share * critical })
    }

    /// As keys of a scenario.
    pub fn to_text(&self) -> String {
        format!(
            "coordination_delay_ticks = {}\nhybrid.loop_gain = {:.3} at most\n",
            self.coordination_delay_ticks, self.loop_gain_max
        )
    }
}

/// The age of commands that fits what was measured.
fn ticks(text: &str, period_s: f64) -> Result<u64, String> {
    let measured: Measured = serde_json::from_str(text).map_err(|error| error.to_string())?;
    match measured {
        Measured { round_trip: Some(RoundTrip { p999_s }), .. } if p999_s.is_finite() && p999_s >= 0.0 => {
            Ok((p999_s / period_s).ceil() as u64 + OWN_WORK_TICKS)
        }
        Measured { fitting_delay_ticks: Some(ticks), round_trip: None } => Ok(ticks),
        _ => Err(
            "found no way in it, expected what `mikoshi-link measure ask` prints, or link.json of a robot's \
                  host whose team runs"
                .to_owned(),
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_is_rounded_up_to_ticks_of_the_clock_and_work_is_added() {
        let asked =
            |p999_s: f64| format!("{{\"round_trip\": {{\"p999_s\": {p999_s}}}, \"fitting_delay_ticks\": 9}}");
        assert_eq!(ticks(&asked(0.0049), 0.005), Ok(2));
        assert_eq!(ticks(&asked(0.0051), 0.005), Ok(3));
        // In slow motion a tick is longer.
        assert_eq!(ticks(&asked(0.0051), 0.010), Ok(2));
    }

    #[test]
    fn what_a_team_that_runs_reports_is_taken_as_it_is() {
        assert_eq!(ticks("{\"host\": \"robot-a\", \"fitting_delay_ticks\": 4}", 0.005), Ok(4));
    }

    #[test]
    fn a_file_without_a_way_is_refused() {
        for text in [
            "{\"host\": \"head\", \"fitting_delay_ticks\": null}",
            "{}",
            "",
            "{\"round_trip\": {\"p999_s\": -1.0}}",
        ] {
            assert!(ticks(text, 0.005).is_err(), "{text}");
        }
    }
}
