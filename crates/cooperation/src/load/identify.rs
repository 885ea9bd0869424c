//! The mass, centre of mass and inertia of what hands carry, from what they apply to it and how it moves.
//!
//! Source: Atkeson, An, Hollerbach, "Estimation of inertial parameters of manipulator loads and links", IJRR 5(3), 1986,
//! with all hands' wrenches in the place of one sensor's; recursive least squares with a random walk of what is sought
//! (Ljung, "System identification", 1999, section 11.2), so that what changes is found again.

use bytemuck::{Pod, Zeroable};
use core::f64::consts::TAU;
use mikoshi_spatial::{Object, Pose, Twist, World, Wrench, skew};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};

/// What is sought: m, then m c, then the inertia (xx, yy, zz, xy, xz, yz) about the object's origin, in its axes.
const SOUGHT: usize = 10;
type Sought = SVector<f64, SOUGHT>;
type Covariance = SMatrix<f64, SOUGHT, SOUGHT>;
type Regressor = SMatrix<f64, 6, SOUGHT>;

/// Standard gravity in the world \[m/s²\].
const GRAVITY: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
/// Corner frequency of both poles through which wrenches and motion go alike, in the object's axes: Newton's law holds for
/// what comes out as for what went in, and of accelerations, which are differences, nothing is left that is faster.
const FILTER_HZ: f64 = 2.0;
/// What the filters have seen for so long may be used.
const WARM_UP_S: f64 = 0.4;
/// Between two looks: what the filters let through does not change sooner.
const LOOK_S: f64 = 0.025;
/// Standard deviations of what is looked at, by what the model leaves out: sensors, arms that give way, footfalls
/// \[N, Nm\].
const SIGMA: [f64; 2] = [2.0, 1.0];
/// Standard deviations of what nobody has looked at yet: m \[kg\], m c \[kg m\], inertia \[kg m²\].
const UNKNOWN: [f64; 3] = [100.0, 50.0, 20.0];
/// Random walk of the same between two looks.
const WALK: [f64; 3] = [0.01, 0.01, 0.02];
/// A look that is off by more standard deviations than this is a surprise: what is sought has changed.
const SURPRISE: f64 = 5.0;
/// How much further the walk goes then, at most.
const SURPRISE_MOST: f64 = 10.0;

/// The kind of an entry of what is sought: of [`UNKNOWN`] and [`WALK`].
const KIND: [usize; SOUGHT] = [0, 1, 1, 1, 2, 2, 2, 2, 2, 2];

/// Finds what is carried. Immutable: what it has found is [`LoadIdentifierState`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadIdentifier {
    period_s: f64,
    /// 1 − a, with a the filters' pole.
    blend: f64,
    warm_up_ticks: u64,
    look_ticks: u64,
}

/// What is known of the load, all that matters from tick to tick. Zeros are a load of which nothing is known.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoadIdentifierState {
    /// Ticks since it began.
    ticks: u64,
    /// The last pose of the object.
    pose: [f64; 7],
    /// Its twist on the way there, in the world.
    twist: [f64; 6],
    /// What both poles hold of b, α and ω.
    motion: [[f64; 9]; 2],
    /// What they hold of the hands' wrench.
    wrench: [[f64; 6]; 2],
    sought: [f64; SOUGHT],
    /// By columns.
    covariance: [[f64; SOUGHT]; SOUGHT],
}

// SAFETY: zeros are a valid value of integers and floats.
unsafe impl Zeroable for LoadIdentifierState {}
// SAFETY: `repr(C)` over integers and floats of one size only: no padding, any bit pattern valid.
unsafe impl Pod for LoadIdentifierState {}

/// A body that is carried, in the object's axes, as it is known: each value with its standard deviation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CarriedBody {
    /// m \[kg\].
    pub mass_kg: f64,
    /// Its standard deviation.
    pub mass_std_kg: f64,
    /// Centre of mass from the object's origin \[m\].
    pub com_m: Vector3<f64>,
    /// Its standard deviation, axis by axis.
    pub com_std_m: Vector3<f64>,
    /// Inertia about the centre of mass: xx, yy, zz, xy, xz, yz.
    pub inertia_kg_m2: [f64; 6],
    /// Its standard deviation.
    pub inertia_std_kg_m2: [f64; 6],
}

impl LoadIdentifier {
    /// For ticks of this length.
    pub fn new(period_s: f64) -> Self {
        let ticks = |seconds: f64| (seconds / period_s).round().max(1.0) as u64;
        Self {
            period_s,
            blend: 1.0 - (-TAU * FILTER_HZ * period_s).exp(),
            warm_up_ticks: ticks(WARM_UP_S),
            look_ticks: ticks(LOOK_S),
        }
    }

    /// One tick: the object is at `X_WA`, and its hands together apply `wrench` to it, at its origin. Nothing else but
    /// gravity may act on it.
    ///
    /// Newton's and Euler's laws in the object's axes, with b = a − g, α and ω:
    /// `f = m b + α × m c + ω × (ω × m c)`, `n = m c × b + I α + ω × I ω`.
    pub fn observe(
        &self,
        state: &mut LoadIdentifierState,
        X_WA: &Pose<World, Object>,
        wrench: &Wrench<World>,
    ) {
        let R_AW = X_WA.rotation.inverse();
        let in_object = |v: &Vector3<f64>| -> [f64; 3] { (R_AW * v).into() };
        let [f, n] = [&wrench.force, &wrench.moment].map(in_object);
        let felt = [f[0], f[1], f[2], n[0], n[1], n[2]];
        if state.ticks == 0 {
            let [x, y, z] = in_object(&-GRAVITY);
            let (pose, motion) = (X_WA.to_array(), [[x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]; 2]);
            *state =
                LoadIdentifierState { pose, motion, wrench: [felt; 2], ..LoadIdentifierState::unknown() };
        }
        let Some(last) = Pose::<World, Object>::from_array(&state.pose) else { return };
        let twist = last.displacement_to(X_WA) * self.period_s.recip();
        let gained = (twist - Twist::from_array(&state.twist)) * self.period_s.recip();
        (state.pose, state.twist) = (X_WA.to_array(), twist.to_array());
        state.ticks += 1;
        let [b, alpha, omega] = [&(gained.linear - GRAVITY), &gained.angular, &twist.angular].map(in_object);
        let moved = [b[0], b[1], b[2], alpha[0], alpha[1], alpha[2], omega[0], omega[1], omega[2]];
        self.filter(&mut state.motion, &moved);
        self.filter(&mut state.wrench, &felt);
        if state.ticks >= self.warm_up_ticks && state.ticks.is_multiple_of(self.look_ticks) {
            let [_, [bx, by, bz, ax, ay, az, ox, oy, oz]] = state.motion;
            let rows =
                regressor(&Vector3::new(bx, by, bz), &Vector3::new(ax, ay, az), &Vector3::new(ox, oy, oz));
            let [_, seen] = state.wrench;
            look(state, &rows, &Wrench::from_array(&seen));
        }
    }

    /// Two poles in a row.
    fn filter<const N: usize>(&self, poles: &mut [[f64; N]; 2], input: &[f64; N]) {
        let [first, second] = poles;
        for ((first, second), input) in first.iter_mut().zip(second).zip(input) {
            *first += self.blend * (input - *first);
            *second += self.blend * (*first - *second);
        }
    }
}

impl LoadIdentifierState {
    fn unknown() -> Self {
        let mut state = Self::zeroed();
        for (entry, (column, kind)) in state.covariance.iter_mut().zip(KIND).enumerate() {
            if let (Some(variance), Some(sigma)) = (column.get_mut(entry), UNKNOWN.get(kind)) {
                *variance = sigma * sigma;
            }
        }
        state
    }

    /// What is carried, as far as it is known; `None` before anybody has looked.
    pub fn body(&self) -> Option<CarriedBody> {
        let sought = Sought::from(self.sought);
        let covariance = Covariance::from(self.covariance);
        let mass_kg = sought[0];
        if mass_kg <= 0.0 {
            return None;
        }
        let deviation = |entry: usize| covariance[(entry, entry)].max(0.0).sqrt();
        let com = Vector3::new(sought[1], sought[2], sought[3]) / mass_kg;
        // Steiner's share, which only moves the axes to the centre of mass.
        let about_com = inertia_of(&sought)
            - (Matrix3::identity() * com.norm_squared() - com * com.transpose()) * mass_kg;
        let inertia_kg_m2 = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|entry| about_com[entry]);
        Some(CarriedBody {
            mass_kg,
            mass_std_kg: deviation(0),
            com_m: com,
            com_std_m: Vector3::from_fn(|axis, _| deviation(1 + axis) / mass_kg),
            inertia_kg_m2,
            inertia_std_kg_m2: [4, 5, 6, 7, 8, 9].map(deviation),
        })
    }
}

impl CarriedBody {
    /// What hands have to apply together, at the object's origin, so that it moves like this: the object is turned by
    /// `X_WA` and its origin gains velocity by `acceleration`.
    pub fn wrench(&self, X_WA: &Pose<World, Object>, acceleration: &Vector3<f64>) -> Wrench<World> {
        let force = (acceleration - GRAVITY) * self.mass_kg;
        Wrench::new(force, (X_WA.rotation * self.com_m).cross(&force))
    }
}

/// The six rows that what is sought is multiplied with.
fn regressor(b: &Vector3<f64>, alpha: &Vector3<f64>, omega: &Vector3<f64>) -> Regressor {
    let mut rows = Regressor::zeros();
    rows.fixed_view_mut::<3, 1>(0, 0).copy_from(b);
    rows.fixed_view_mut::<3, 3>(0, 1).copy_from(&(skew(alpha) + skew(omega) * skew(omega)));
    rows.fixed_view_mut::<3, 3>(3, 1).copy_from(&-skew(b));
    rows.fixed_view_mut::<3, 6>(3, 4).copy_from(&(inertia_times(alpha) + skew(omega) * inertia_times(omega)));
    rows
}

/// I v, as a matrix that the six numbers of I are multiplied with.
fn inertia_times(v: &Vector3<f64>) -> SMatrix<f64, 3, 6> {
    SMatrix::<f64, 3, 6>::new(
        v.x, 0.0, 0.0, v.y, v.z, 0.0, //
        0.0, v.y, 0.0, v.x, 0.0, v.z, //
        0.0, 0.0, v.z, 0.0, v.x, v.y,
    )
}

fn inertia_of(sought: &Sought) -> Matrix3<f64> {
    let [xx, yy, zz, xy, xz, yz] = [4, 5, 6, 7, 8, 9].map(|entry| sought[entry]);
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// One look: what is sought walks, further where the look is a surprise, and each row in turn corrects it.
fn look(state: &mut LoadIdentifierState, rows: &Regressor, seen: &Wrench<Object>) {
    let mut sought = Sought::from(state.sought);
    let mut covariance = Covariance::from(state.covariance);
    let seen = seen.to_vector();
    let variances = [0, 0, 0, 1, 1, 1].map(|kind: usize| SIGMA.get(kind).map_or(1.0, |sigma| sigma * sigma));
    let missed = seen - rows * sought;
    let surprise =
        missed.iter().zip(rows.row_iter()).zip(variances).fold(0.0_f64, |most, ((missed, row), variance)| {
            let spread = (row * covariance * row.transpose()).x + variance;
            most.max(missed * missed / spread)
        });
    let further = (surprise.sqrt() / SURPRISE).clamp(1.0, SURPRISE_MOST);
    for (entry, kind) in KIND.into_iter().enumerate() {
        let of = |sigmas: &[f64; 3]| sigmas.get(kind).copied().unwrap_or(0.0);
        let walked = covariance[(entry, entry)] + (of(&WALK) * further).powi(2);
        // What nobody looks at is never less known than what nobody has looked at.
        let most = of(&UNKNOWN).powi(2);
        covariance[(entry, entry)] = walked;
        if walked > most {
            let shrink = (most / walked).sqrt();
            covariance.row_mut(entry).scale_mut(shrink);
            covariance.column_mut(entry).scale_mut(shrink);
        }
    }
    for ((row, value), variance) in rows.row_iter().zip(seen.iter()).zip(variances) {
        let spread = covariance * row.transpose();
        let gain = spread / ((row * spread).x + variance);
        sought += gain * (value - (row * sought).x);
        covariance -= gain * spread.transpose();
    }
    // Rounding must not make it lopsided.
    covariance = (covariance + covariance.transpose()) * 0.5;
    if sought.iter().chain(covariance.iter()).all(|value| value.is_finite()) {
        (state.sought, state.covariance) = (sought.into(), covariance.into());
    }
}
