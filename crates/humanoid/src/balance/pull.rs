//! How far a robot that stands can be pulled at its hands: the limit of leader-follower cooperation.

use super::Pendulum;

/// A robot that stands still and is pulled through a spring at its hands (Fig. 10a).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulledRobot {
    /// Its mass; the height of its centre of mass does not matter.
    pub pendulum: Pendulum,
    /// Pmax: how far the zero moment point can go from where it rests to the edge of the feet \[m\].
    pub zmp_way_m: f64,
    /// Za: height of the hands over the ground \[m\].
    pub hand_height_m: f64,
    /// k: stiffness between the hands and what pulls them \[N/m\]; where another robot pulls, of both
    /// robots' hands in series.
    pub stiffness_n_m: f64,
}

impl PulledRobot {
    /// The displacement at which the zero moment point reaches the edge (eq. 42):
    /// `x = M g Pmax / (k Za)` \[m\].
    pub fn displacement_to_edge_m(&self) -> f64 {
        self.pendulum.weight_n() * self.zmp_way_m / (self.stiffness_n_m * self.hand_height_m)
    }

    /// When that happens to what is pulled at `velocity_m_s`, reached from rest at `acceleration_m_s2`
    /// \[s\]: `x / v + v / (2 a)`, or `√(2 x / a)` if it happens before that velocity is reached.
    pub fn time_to_edge_s(&self, velocity_m_s: f64, acceleration_m_s2: f64) -> f64 {
        let x = self.displacement_to_edge_m();
        let ramp_m = velocity_m_s * velocity_m_s / (2.0 * acceleration_m_s2);
        if x < ramp_m {
            (2.0 * x / acceleration_m_s2).sqrt()
        } else {
            x / velocity_m_s + velocity_m_s / (2.0 * acceleration_m_s2)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The paper's numbers.
    const PAPER: PulledRobot = PulledRobot {
        pendulum: Pendulum { mass_kg: 54.0, com_height_m: 0.72 },
        zmp_way_m: 0.13,
        hand_height_m: 0.96,
        stiffness_n_m: 1000.0,
    };

    #[test]
    fn the_papers_robots_reach_the_edge_after_72_mm_and_0_72_s() {
        assert!((PAPER.displacement_to_edge_m() - 0.072).abs() < 5e-4);
        assert!((PAPER.time_to_edge_s(0.1, 1e9) - 0.72).abs() < 5e-3);
    }

    #[test]
    fn a_ramp_costs_half_its_time_and_may_not_end_before_the_edge() {
        let x = PAPER.displacement_to_edge_m();
        assert!((PAPER.time_to_edge_s(0.1, 0.5) - (x / 0.1 + 0.1)).abs() < 1e-12);
        assert!((PAPER.time_to_edge_s(1.0, 0.5) - (4.0 * x).sqrt()).abs() < 1e-12);
    }
}
