//! The internal forces of a run, gathered tick by tick.

use crate::figures::{ObservedRun, WINDOW_S};
use crate::summary::InternalSummary;
use mikoshi_ipc_types::{TeamState, mode};
use mikoshi_spatial::{Object, Wrench};
use std::collections::VecDeque;

/// How long after its start the hybrid law is judged.
pub(crate) const JUDGED_AFTER_S: f64 = 3.0;
/// Length of the window in which measured and true internal forces are compared.
const COMPARED_S: f64 = 1.0;

/// What becomes of the internal forces, from when the hybrid law starts until it ends; over the whole run
/// where it never starts.
#[derive(Clone, Debug)]
pub(crate) struct InternalFigures {
    is_controlled: bool,
    control_period_s: f64,
    start_tick: Option<u64>,
    rows: Vec<InternalSummary>,
    /// Of the last ticks, over which the end is judged.
    end: VecDeque<Vec<Wrench<Object>>>,
    /// Distances from references in the same ticks.
    end_errors: VecDeque<Vec<Wrench<Object>>>,
    /// Largest differences between measured and true ones in each of the last ticks.
    errors: VecDeque<(f64, f64)>,
}

impl InternalFigures {
    pub(crate) fn new(run: &ObservedRun) -> Self {
        let named = |name: &String| InternalSummary { name: name.clone(), ..InternalSummary::default() };
        Self {
            is_controlled: run.is_controlled,
            control_period_s: run.control_period_s,
            start_tick: None,
            rows: run.internal_rows.iter().map(|(name, _)| named(name)).collect(),
            end: VecDeque::new(),
            end_errors: VecDeque::new(),
            errors: VecDeque::new(),
        }
    }

    pub(crate) fn observe(&mut self, tick: u64, forces: Vec<Wrench<Object>>, team_state: &TeamState) {
        let is_hybrid = mode::is_hybrid(team_state.team_mode);
        if self.is_controlled && !is_hybrid {
            return;
        }
        let ticks = |time_s: f64| (time_s / self.control_period_s).round() as u64;
        let start = *self.start_tick.get_or_insert(tick);
        let judged = start + ticks(JUDGED_AFTER_S)..=start + ticks(JUDGED_AFTER_S + WINDOW_S);
        let references = team_state.generalized_force_ref.iter().skip(1).map(Wrench::<Object>::from_array);
        let errors: Vec<_> =
            forces.iter().zip(references).map(|(force, reference)| *force - reference).collect();
        for ((summary, force_A), error_A) in self.rows.iter_mut().zip(&forces).zip(&errors) {
            let (force_n, moment_nm) = (force_A.force.norm(), force_A.moment.norm());
            if tick >= *judged.start() {
                raise(&mut summary.peak_n, force_n);
                raise(&mut summary.peak_nm, moment_nm);
                raise(&mut summary.error_peak_n, error_A.force.norm());
                raise(&mut summary.error_peak_nm, error_A.moment.norm());
            }
            if tick == start {
                (summary.start_n, summary.start_nm) = (force_n, moment_nm);
            }
            if judged.contains(&tick) {
                raise(&mut summary.after_3s_n, force_n);
                raise(&mut summary.after_3s_nm, moment_nm);
            }
        }
        if is_hybrid {
            let mut largest = (0.0, 0.0);
            for (measured, force_A) in team_state.generalized_force.iter().skip(1).zip(&forces) {
                let error = Wrench::<Object>::from_array(measured) - *force_A;
                raise(&mut largest.0, error.force.norm());
                raise(&mut largest.1, error.moment.norm());
            }
            keep(&mut self.errors, largest, ticks(COMPARED_S));
        }
        keep(&mut self.end, forces, ticks(WINDOW_S));
        keep(&mut self.end_errors, errors, ticks(WINDOW_S));
    }

    /// Largest differences between measured and true forces and moments.
    pub(crate) fn measurement_error(&self) -> (f64, f64) {
        self.errors.iter().fold((0.0, 0.0), |(n, nm), error| (error.0.max(n), error.1.max(nm)))
    }

    pub(crate) fn finish(mut self) -> Vec<InternalSummary> {
        let samples = self.end.len().max(1) as f64;
        for forces in &self.end {
            for (summary, force_A) in self.rows.iter_mut().zip(forces) {
                raise(&mut summary.end_n, force_A.force.norm());
                raise(&mut summary.end_nm, force_A.moment.norm());
                for (mean, value) in summary.end_mean.iter_mut().zip(force_A.to_array()) {
                    *mean += value / samples;
                }
            }
        }
        for errors in &self.end_errors {
            for (summary, error_A) in self.rows.iter_mut().zip(errors) {
                raise(&mut summary.error_end_n, error_A.force.norm());
                raise(&mut summary.error_end_nm, error_A.moment.norm());
            }
        }
        self.rows
    }
}

/// NaN leaves it as it is.
pub(crate) fn raise(largest: &mut f64, value: f64) {
    *largest = largest.max(value);
}

/// Appends a value, and forgets what is older than the last `most`.
fn keep<T>(last: &mut VecDeque<T>, value: T, most: u64) {
    last.push_back(value);
    while last.len() as u64 > most {
        last.pop_front();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;
    use nalgebra::Vector3;

    /// A second of hold, two of a law under which a force grows by 1 N a tick, a second of release.
    fn figures(is_controlled: bool) -> InternalSummary {
        let run = ObservedRun {
            control_period_s: 0.01,
            ticks: 400,
            is_controlled,
            X_WBody_goal: None,
            robots: vec![],
            internal_rows: vec![("L|R".to_owned(), vec![0.5, -0.5])],
        };
        let mut figures = InternalFigures::new(&run);
        for tick in 0..400 {
            let mode = [mode::HOLD, mode::LIFT, mode::CARRY, mode::RELEASE][tick as usize / 100];
            let team_state = TeamState { team_mode: mode, ..TeamState::zeroed() };
            let force = Vector3::new(tick as f64, 0.0, 0.0);
            figures.observe(tick, vec![Wrench::new(force, Vector3::zeros())], &team_state);
        }
        assert_eq!(figures.measurement_error(), (299.0, 0.0));
        figures.finish().remove(0)
    }

    #[test]
    fn a_law_is_judged_from_its_start_to_its_end() {
        let figures = figures(true);
        assert_eq!((figures.start_n, figures.end_n), (100.0, 299.0));
        assert_eq!(figures.end_mean[0], (280..300).sum::<i32>() as f64 / 20.0);
        // It ends before 3 s are over.
        assert_eq!((figures.peak_n, figures.after_3s_n), (0.0, 0.0));
    }

    #[test]
    fn without_a_law_the_whole_run_is_judged() {
        let figures = figures(false);
        assert_eq!((figures.start_n, figures.end_n, figures.peak_n), (0.0, 399.0, 399.0));
        assert_eq!(figures.after_3s_n, 320.0);
    }
}
