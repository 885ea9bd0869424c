//! The linear inverted pendulum, and what a load in the hands does to it.

use mikoshi_spatial::{World, Wrench};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Standard gravity \[m/s²\].
pub const GRAVITY_M_S2: f64 = 9.81;

/// A point mass at constant height over the ground: `c̈ = ω² (c − e)`, with e the extended zero
/// moment point ([`ExternalLoad`]), the zero moment point itself where nothing else touches the robot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pendulum {
    /// Robot's mass \[kg\].
    pub mass_kg: f64,
    /// Height of the centre of mass over the ground \[m\].
    pub com_height_m: f64,
}

impl Pendulum {
    /// ω = √(g / h) \[1/s\].
    pub fn frequency(&self) -> f64 {
        (GRAVITY_M_S2 / self.com_height_m).sqrt()
    }

    /// Divergent component of motion ξ = c + ċ / ω \[m\], which without an external load is the capture
    /// point: ξ̇ = ω (ξ − e).
    pub fn divergent_component(&self, com: &Vector2<f64>, com_velocity: &Vector2<f64>) -> Vector2<f64> {
        com + com_velocity / self.frequency()
    }

    /// Extended zero moment point e = c − c̈ / ω² \[m\].
    pub fn extended_zmp(&self, com: &Vector2<f64>, com_acceleration: &Vector2<f64>) -> Vector2<f64> {
        com - com_acceleration * (self.com_height_m / GRAVITY_M_S2)
    }

    /// Weight \[N\].
    pub fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY_M_S2
    }
}

/// What the hands' wrenches do to the balance: `e = κ z + γ`, here about a point o that moves with
/// the hands: `e = o + κ (z − o) + shift`, so that κ and shift stay constant while a constant load is
/// carried about and may be filtered.
///
/// Moments about the zero moment point z, with forces f and moments n that act ON the robot at points
/// p, the centre of mass at constant height, and no change of angular momentum:
/// - κ = 1 − Σ fz / (m g)
/// - shift_x = −Σ ( pz fx − (px − ox) fz + ny ) / (m g)
/// - shift_y = −Σ ( pz fy − (py − oy) fz − nx ) / (m g)
///
/// with pz over the ground. Source: Murooka et al., "Humanoid Loco-Manipulations Pattern Generation
/// and Stabilization Control", RA-L 2021, eqs. 3 to 6; Audren et al., IROS 2014.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ExternalLoad {
    /// κ: share of the weight that the feet bear, above one when the robot carries.
    pub kappa: f64,
    /// Shift of e against z at o \[m, world\].
    pub shift: Vector2<f64>,
    /// o \[m, world\].
    pub about: Vector2<f64>,
}

impl ExternalLoad {
    /// Nothing but the ground touches the robot.
    pub const NONE: Self = Self { kappa: 1.0, shift: Vector2::new(0.0, 0.0), about: Vector2::new(0.0, 0.0) };

    /// The load of hands that apply `wrench` TO the object at `point` (world), the sign of eq. 39. The
    /// ground lies at `ground_height` \[m\].
    ///
    /// Where the hands would lift or press more than `KAPPA_RANGE` allows, κ is limited, so that
    /// [`ExternalLoad::ground_zmp`] stays defined.
    pub fn of_hands(
        pendulum: &Pendulum,
        ground_height: f64,
        hands: impl Iterator<Item = (Vector3<f64>, Wrench<World>)> + Clone,
    ) -> Self {
        let mut about = Vector2::zeros();
        let mut count = 0.0;
        for (point, _) in hands.clone() {
            about += point.xy();
            count += 1.0;
        }
        if count == 0.0 {
            return Self::NONE;
        }
        about /= count;
        let (mut lift, mut shift) = (0.0, Vector2::zeros());
        for (point, wrench) in hands {
            // The object answers with the opposite of what the hand applies to it.
            let (f, n) = (-wrench.force, -wrench.moment);
            let height = point.z - ground_height;
            let arm = point.xy() - about;
            lift += f.z;
            shift -= Vector2::new(height * f.x - arm.x * f.z + n.y, height * f.y - arm.y * f.z - n.x);
        }
        let weight = pendulum.weight_n();
        let kappa = (1.0 - lift / weight).clamp(Self::KAPPA_RANGE.0, Self::KAPPA_RANGE.1);
        Self { kappa, shift: shift / weight, about }
    }

    /// From hands that bear the whole robot but a fifth, to a robot that bears its own weight again.
    pub const KAPPA_RANGE: (f64, f64) = (0.2, 2.0);

    /// e of a zero moment point z \[m, world\].
    pub fn extended_zmp(&self, zmp: &Vector2<f64>) -> Vector2<f64> {
        self.about + (zmp - self.about) * self.kappa + self.shift
    }

    /// How far e moves of a zero moment point that stays, while the hands go by `way` \[m, world\].
    pub fn drift(&self, way: &Vector2<f64>) -> Vector2<f64> {
        way * (1.0 - self.kappa)
    }

    /// z of an extended zero moment point e \[m, world\].
    pub fn ground_zmp(&self, extended_zmp: &Vector2<f64>) -> Vector2<f64> {
        self.about + (extended_zmp - self.about - self.shift) / self.kappa
    }

    /// One step of a first-order low-pass towards `measured`: κ and shift follow by the share
    /// `blend` in [0, 1]; o, a position and not a load, is `measured`'s.
    pub fn filtered_towards(&self, measured: &Self, blend: f64) -> Self {
        Self {
            kappa: self.kappa + (measured.kappa - self.kappa) * blend,
            shift: self.shift + (measured.shift - self.shift) * blend,
            about: measured.about,
        }
    }
}
