//! What whoever drives wants by now.

use mikoshi_config::scenario::DriveLimits;
use mikoshi_ipc_types::{TwistWire, operator};

/// By how much a key changes the squeeze.
const SQUEEZE_STEP_N: f64 = 5.0;

/// What a key or a line of a script asks for.
#[derive(Clone, Debug, PartialEq)]
pub enum Order {
    /// One step along an axis of the twist, forwards or back: back, rest and forwards follow one another.
    Nudge(usize, i8),
    /// This twist.
    Move(TwistWire),
    /// So many tenths of the largest speed.
    Tenths(u8),
    /// So many steps more or less.
    SqueezeBy(i8),
    /// So much.
    Squeeze(f64),
    /// No motion any more.
    Halt,
    /// A word of [`operator`].
    Say(u64),
    /// Enough of this.
    End,
}

/// The wanted twist and squeeze. The coordinator bounds both; here they are kept at what it will make of them, so that
/// they can be shown.
#[derive(Clone, Debug)]
pub struct Wish {
    limits: DriveLimits,
    /// By axis of the twist, as shares of the largest speed.
    shares: [f64; 6],
    tenths: u8,
    squeeze_n: f64,
}

impl Wish {
    /// None, within these limits, and half as fast as may be.
    pub fn new(limits: DriveLimits) -> Self {
        Self { limits, shares: [0.0; 6], tenths: 5, squeeze_n: 0.0 }
    }

    /// Follows an order.
    pub fn obey(&mut self, order: &Order) {
        match *order {
            Order::Nudge(axis, way) => {
                if let Some(share) = self.shares.get_mut(axis) {
                    let step = f64::from(way.signum());
                    *share = if *share * step < 0.0 { 0.0 } else { step };
                }
            }
            Order::Move(twist) => {
                let most = self.most();
                for ((share, rate), most) in self.shares.iter_mut().zip(twist).zip(most) {
                    *share = (rate / most * 10.0 / f64::from(self.tenths)).clamp(-10.0, 10.0);
                }
            }
            Order::Tenths(tenths) => self.tenths = tenths.clamp(1, 10),
            Order::SqueezeBy(steps) => self.squeeze_to(self.squeeze_n + f64::from(steps) * SQUEEZE_STEP_N),
            Order::Squeeze(force_n) => self.squeeze_to(force_n),
            // After a stop nothing begins to move by itself.
            Order::Halt | Order::Say(operator::STOP) => self.shares = [0.0; 6],
            Order::Say(_) | Order::End => {}
        }
    }

    fn squeeze_to(&mut self, force_n: f64) {
        let most_n = self.limits.squeeze.as_ref().map_or(0.0, |squeeze| squeeze.max_n);
        self.squeeze_n = force_n.clamp(0.0, most_n);
    }

    fn most(&self) -> [f64; 6] {
        let DriveLimits {
            velocity_max_m_s: level,
            vertical_max_m_s: up,
            tilt_rate_max_rad_s: lean,
            yaw_rate_max_rad_s: yaw,
            ..
        } = self.limits;
        [level, level, up, lean, lean, yaw]
    }

    /// As it is said.
    pub fn twist(&self) -> TwistWire {
        let scale = f64::from(self.tenths) / 10.0;
        let [ax, ay, az, bx, by, bz] = self.shares;
        let [mx, my, mz, nx, ny, nz] = self.most();
        [ax * mx, ay * my, az * mz, bx * nx, by * ny, bz * nz].map(|rate| rate * scale)
    }

    /// As it is said.
    pub fn squeeze_n(&self) -> f64 {
        self.squeeze_n
    }

    /// How fast a key is.
    pub fn tenths(&self) -> u8 {
        self.tenths
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_config::scenario::{Axis, Squeeze};

    fn wish() -> Wish {
        let squeeze = Squeeze { row: "A|B".to_owned(), axis: Axis::X, max_n: 12.0, rate_n_s: 10.0 };
        Wish::new(DriveLimits { squeeze: Some(squeeze), ..DriveLimits::default() })
    }

    fn near(twist: TwistWire, expected: TwistWire) {
        let apart = twist.iter().zip(expected).map(|(is, should)| (is - should).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12, "{twist:?} {expected:?}");
    }

    #[test]
    fn a_key_against_the_way_brings_it_to_rest_first() {
        let mut wish = wish();
        let speeds = [1, 1, -1, -1].map(|way| {
            wish.obey(&Order::Nudge(0, way));
            (1e3 * wish.twist()[0]).round()
        });
        assert_eq!(speeds, [30.0, 30.0, 0.0, -30.0]);
        wish.obey(&Order::Tenths(10));
        near(wish.twist(), [-0.06, 0.0, 0.0, 0.0, 0.0, 0.0]);
        wish.obey(&Order::Say(operator::STOP));
        near(wish.twist(), [0.0; 6]);
    }

    #[test]
    fn a_script_moves_as_it_says_whatever_speed_keys_have() {
        let mut wish = wish();
        let twist = [0.02, -0.03, 0.001, 0.002, 0.0, 0.05];
        wish.obey(&Order::Move(twist));
        near(wish.twist(), twist);
        wish.obey(&Order::Halt);
        near(wish.twist(), [0.0; 6]);
    }

    #[test]
    fn hands_are_asked_to_press_within_what_they_may() {
        let mut wish = wish();
        let forces = [1, 1, 1, -1].map(|steps| {
            wish.obey(&Order::SqueezeBy(steps));
            wish.squeeze_n()
        });
        assert_eq!(forces, [5.0, 10.0, 12.0, 7.0]);
        wish.obey(&Order::Squeeze(-3.0));
        assert_eq!(wish.squeeze_n(), 0.0);
    }
}
