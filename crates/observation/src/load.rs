//! What the team found out about what it carries.

use crate::summary::LoadSummary;
use mikoshi_ipc_types::TeamState;

/// A mass that changes by no more than this part of itself stays.
const STAYS: f64 = 0.03;

/// The load as the team knew it last, and since when it has.
#[derive(Clone, Debug, Default)]
pub(crate) struct LoadFigures {
    known: LoadSummary,
    /// The mass that has stayed, and since which tick.
    stays: Option<(f64, u64)>,
}

impl LoadFigures {
    pub(crate) fn observe(&mut self, tick: u64, team_state: &TeamState) {
        let mass_kg = team_state.load_mass_kg;
        if mass_kg <= 0.0 {
            return;
        }
        if self.stays.is_none_or(|(stayed, _)| (mass_kg - stayed).abs() > STAYS * stayed) {
            self.stays = Some((mass_kg, tick));
        }
        self.known = LoadSummary {
            mass_kg,
            mass_std_kg: team_state.load_mass_std_kg,
            mass_stays_since_s: 0.0,
            com_m: team_state.load_com_m,
            com_std_m: team_state.load_com_std_m,
            inertia_kg_m2: team_state.load_inertia_kg_m2,
            inertia_std_kg_m2: team_state.load_inertia_std_kg_m2,
        };
    }

    pub(crate) fn finish(self, control_period_s: f64) -> LoadSummary {
        let since = self.stays.map_or(0, |(_, since)| since);
        LoadSummary { mass_stays_since_s: since as f64 * control_period_s, ..self.known }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bytemuck::Zeroable;

    #[test]
    fn a_mass_stays_from_when_it_has_last_changed_and_what_is_put_down_is_remembered() {
        let mut figures = LoadFigures::default();
        for tick in 0..400 {
            let load_mass_kg = match tick {
                0..100 => 0.1 * tick as f64,
                100..200 => 10.0 + 0.002 * (tick - 100) as f64,
                200..300 => 15.0,
                _ => 0.0,
            };
            figures.observe(tick, &TeamState { load_mass_kg, ..TeamState::zeroed() });
        }
        let known = figures.finish(0.005);
        assert_eq!((known.mass_kg, known.mass_stays_since_s), (15.0, 1.0));
    }
}
