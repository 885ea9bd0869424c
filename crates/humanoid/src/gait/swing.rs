//! The swing foot: from foothold to foothold, with contact that comes early or late.

use super::ground_pose::{GroundPose, wrap};
use mikoshi_spatial::{Foot, Pose, Twist, World};
use nalgebra::{Vector2, Vector3};
use serde::{Deserialize, Serialize};

/// Where a foot is commanded to stand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Foothold {
    /// On the ground plane.
    pub pose: GroundPose,
    /// Of the sole over the plane \[m\]: not zero where the ground came early or late.
    pub height: f64,
}

impl Foothold {
    /// On the plane.
    pub fn on_ground(pose: GroundPose) -> Self {
        Self { pose, height: 0.0 }
    }

    /// On the plane at `height` if it is within `tolerance` of it.
    pub fn on_plane_within(self, height: f64, tolerance: f64) -> Self {
        if (self.height - height).abs() <= tolerance { Self { height, ..self } } else { self }
    }

    /// As a pose in the world.
    pub fn in_world(&self) -> Pose<World, Foot> {
        self.pose.at_height(self.height)
    }
}

/// How the foot swings and how it meets the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SwingConfig {
    /// Height of the arc over the ground plane \[m\].
    pub lift_m: f64,
    /// Height over the plane at which a swing ends \[m\]: from there the foot is lowered slowly until it
    /// feels the ground, which the stance foot has pressed in.
    pub touchdown_m: f64,
    /// Vertical force from which on a foot counts as landed \[N\].
    pub contact_force_n: f64,
    /// Ticks in a row with that force: one noisy sample is no ground.
    pub contact_ticks: u64,
    /// Ground within this of the plane is the plane: what differs is how the legs yield \[m\].
    pub plane_tolerance_m: f64,
    /// Share of the swing before which force is no landing.
    pub contact_from: f64,
    /// Speed at which a foot that has found no ground is lowered further \[m/s\].
    pub lowering_m_s: f64,
    /// Speed at which a foot that has landed reaches down to ground that does not bear \[m/s\].
    pub reaching_m_s: f64,
    /// How far below the plane it is lowered at most \[m\].
    pub lowering_max_m: f64,
}

impl Default for SwingConfig {
    fn default() -> Self {
        Self {
            lift_m: 0.05,
            touchdown_m: 0.001,
            contact_force_n: 30.0,
            contact_ticks: 2,
            plane_tolerance_m: 0.003,
            contact_from: 0.7,
            lowering_m_s: 0.02,
            reaching_m_s: 0.04,
            lowering_max_m: 0.02,
        }
    }
}

/// The quintic that leads from 0 to 1 over s in [0, 1] with no velocity and no acceleration at either
/// end: `10 s³ − 15 s⁴ + 6 s⁵`, and its derivative by s.
pub fn quintic(s: f64) -> (f64, f64) {
    let s = s.clamp(0.0, 1.0);
    (s * s * s * (10.0 + s * (-15.0 + s * 6.0)), 30.0 * s * s * (1.0 - s) * (1.0 - s))
}

/// The foot at share `s` of a swing from `from` to `to` that lasts `duration` \[s\], and its velocity.
///
/// x, y and yaw follow [`quintic`]; z follows it up to `lift` over the higher foothold and, in the
/// second half, down: velocity and acceleration are zero at lift-off, apex and touchdown.
pub fn swing_foot(
    from: &Foothold,
    to: &Foothold,
    lift: f64,
    s: f64,
    duration: f64,
) -> (Pose<World, Foot>, Twist<World>) {
    let (share, rate) = quintic(s);
    let along = to.pose.position - from.pose.position;
    let turn = wrap(to.pose.yaw - from.pose.yaw);
    let apex = from.height.max(to.height) + lift;
    let (low, (rise, rise_rate)) =
        if s < 0.5 { (from.height, quintic(2.0 * s)) } else { (to.height, quintic(2.0 - 2.0 * s)) };
    let slope = if s < 0.5 { 2.0 } else { -2.0 };
    let pose =
        GroundPose { position: from.pose.position + along * share, yaw: wrap(from.pose.yaw + turn * share) };
    let linear = Vector3::new(along.x * rate, along.y * rate, (apex - low) * rise_rate * slope) / duration;
    let angular = Vector3::new(0.0, 0.0, turn * rate / duration);
    (pose.at_height(low + (apex - low) * rise), Twist::new(linear, angular))
}

/// How a swinging foot stands with the ground.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum SwingContact {
    /// It swings. `force_ticks`: how long it has felt the ground.
    Swinging {
        /// Ticks in a row with force.
        force_ticks: u64,
    },
    /// It found the ground before its time and stays where it is.
    Landed {
        /// Where.
        at: Foothold,
    },
    /// Its time is over, or its ground is gone again: it is lowered slowly from here.
    Lowering {
        /// Where it is now.
        at: Foothold,
    },
}

/// A foot on its way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Swing {
    /// Where it left.
    pub from: Foothold,
    /// Where it shall land.
    pub to: Foothold,
    /// Its contact.
    pub contact: SwingContact,
    /// How it moves where its way was changed while it swings; as [`swing_foot`] has it when absent.
    pub bent: Option<BentSwing>,
    /// What has been changed.
    pub change: SwingChange,
}

/// What a robot in trouble has changed of a swing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SwingChange {
    /// By how far the foothold was moved \[m, world\].
    pub moved: Vector2<f64>,
    /// b of [`StepAdjustment`](super::StepAdjustment).
    pub offset: Option<Vector2<f64>>,
    /// In how many ticks from the end of the last one the foot had better land; 0: as planned.
    pub land_in_ticks: u64,
}

impl Swing {
    /// At lift-off.
    pub fn new(from: Foothold, to: Foothold) -> Self {
        Self {
            from,
            to,
            contact: SwingContact::Swinging { force_ticks: 0 },
            bent: None,
            change: SwingChange::default(),
        }
    }

    /// Goes on from where the foot is at share `s` of its swing, on a way of its own.
    pub fn bend(&mut self, config: &SwingConfig, s: f64, duration: f64) {
        if self.bent.is_none() {
            self.bent = Some(BentSwing::of(&self.from, &self.end(config), config.lift_m, s, duration));
        }
    }

    /// A tick of a swing that was bent, at the end of which `seconds_left` of it are left.
    pub fn advance(&mut self, config: &SwingConfig, seconds_left: f64, dt: f64) {
        let end = self.end(config);
        if let (Some(bent), SwingContact::Swinging { .. }) = (&mut self.bent, self.contact) {
            bent.advance(&end, seconds_left, dt);
        }
    }

    /// Where the swing ends, over its foothold.
    fn end(&self, config: &SwingConfig) -> Foothold {
        Foothold { height: self.to.height + config.touchdown_m, ..self.to }
    }

    /// The contact after a tick that ends at share `s` of the swing (1 and more: its time is over), with
    /// vertical force `force` on the foot \[N\].
    pub fn contact_after(
        &self,
        config: &SwingConfig,
        force: f64,
        s: f64,
        duration: f64,
        dt: f64,
    ) -> SwingContact {
        let touches = force >= config.contact_force_n;
        let count = |force_ticks: u64| if touches { force_ticks + 1 } else { 0 };
        match self.contact {
            SwingContact::Swinging { force_ticks } => {
                let force_ticks = if s >= config.contact_from { count(force_ticks) } else { 0 };
                // Where the foot was while it felt the ground, not where this tick would take it.
                let at = |s: f64| {
                    let (pose, _) = self.in_the_air(config, s, duration);
                    Foothold { pose: GroundPose::of(&pose), height: pose.translation.z }
                };
                if force_ticks >= config.contact_ticks {
                    SwingContact::Landed { at: at(s - dt / duration) }
                } else if s > 1.0 {
                    SwingContact::Lowering { at: self.end(config) }
                } else {
                    SwingContact::Swinging { force_ticks }
                }
            }
            // On the plane a foot has come to stay, even if the other one still bears all.
            SwingContact::Landed { at }
                if force >= 0.5 * config.contact_force_n
                    || (at.height - self.to.height).abs() <= config.plane_tolerance_m =>
            {
                SwingContact::Landed { at }
            }
            SwingContact::Landed { at } => SwingContact::Lowering { at },
            // A foot that is waiting for the ground has found it: what is lowered slowly hardly bounces.
            SwingContact::Lowering { at } if touches => SwingContact::Landed { at },
            SwingContact::Lowering { at } => {
                let lowest = (self.to.height - config.lowering_max_m).min(at.height);
                let height = (at.height - config.lowering_m_s * dt).max(lowest);
                SwingContact::Lowering { at: Foothold { height, ..at } }
            }
        }
    }

    /// Pose and velocity at share `s` of the swing.
    pub fn foot(&self, config: &SwingConfig, s: f64, duration: f64) -> (Pose<World, Foot>, Twist<World>) {
        match self.contact {
            SwingContact::Swinging { .. } => self.in_the_air(config, s, duration),
            SwingContact::Landed { at } => (at.in_world(), Twist::zero()),
            SwingContact::Lowering { at } => {
                let is_lowest = at.height <= self.to.height - config.lowering_max_m;
                let speed = if is_lowest { 0.0 } else { -config.lowering_m_s };
                (at.in_world(), Twist::new(Vector3::new(0.0, 0.0, speed), Vector3::zeros()))
            }
        }
    }

    fn in_the_air(&self, config: &SwingConfig, s: f64, duration: f64) -> (Pose<World, Foot>, Twist<World>) {
        match &self.bent {
            Some(bent) => bent.foot(),
            None => swing_foot(&self.from, &self.end(config), config.lift_m, s, duration),
        }
    }
}

/// A foot in the air whose foothold or time was changed: from tick to tick it goes on from where it is, as it moves,
/// to where it shall be, in the time that is left. Where nothing changes any more, that is one quintic.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BentSwing {
    /// Position and yaw, their rates and accelerations.
    along: [Motion; 4],
    /// Until the foot is as high as it gets \[s\].
    rise_s: f64,
    /// How high that is \[m\].
    apex_m: f64,
}

/// A coordinate with its rate and acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Motion {
    at: f64,
    rate: f64,
    acceleration: f64,
}

/// How fast a foot rises that has less time than it was to have \[m/s\], on average.
const HURRIED_RISE_M_S: f64 = 0.3;

impl Motion {
    /// After `dt` of the quintic that comes to rest at `to` in `seconds`.
    fn towards(self, to: f64, seconds: f64, dt: f64) -> Self {
        if seconds <= dt * 1.000_001 {
            return Self { at: to, rate: 0.0, acceleration: 0.0 };
        }
        let (way, v, a) = (to - self.at, self.rate * seconds, self.acceleration * seconds * seconds);
        let third = way * 10.0 - v * 6.0 - a * 1.5;
        let fourth = way * -15.0 + v * 8.0 + a * 1.5;
        let fifth = way * 6.0 - v * 3.0 - a * 0.5;
        let s = dt / seconds;
        let at = self.at + (v + (a * 0.5 + (third + (fourth + fifth * s) * s) * s) * s) * s;
        let rate = v + (a + (third * 3.0 + (fourth * 4.0 + fifth * 5.0 * s) * s) * s) * s;
        let acceleration = a + (third * 6.0 + (fourth * 12.0 + fifth * 20.0 * s) * s) * s;
        Self { at, rate: rate / seconds, acceleration: acceleration / (seconds * seconds) }
    }
}

impl BentSwing {
    /// At share `s` of a swing as [`swing_foot`] has it.
    fn of(from: &Foothold, to: &Foothold, lift: f64, s: f64, duration: f64) -> Self {
        let s = s.clamp(0.0, 1.0);
        let (pose, twist) = swing_foot(from, to, lift, s, duration);
        // Second derivative of the quintic.
        let bow = |s: f64| 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s);
        let apex_m = from.height.max(to.height) + lift;
        let rise = if s < 0.5 {
            (apex_m - from.height) * bow(2.0 * s)
        } else {
            (apex_m - to.height) * bow(2.0 - 2.0 * s)
        } * 4.0;
        let per_s2 = 1.0 / (duration * duration);
        let way = to.pose.position - from.pose.position;
        let turn = wrap(to.pose.yaw - from.pose.yaw);
        let motion = |at, rate, bow: f64| Motion { at, rate, acceleration: bow * per_s2 };
        Self {
            along: [
                motion(pose.translation.x, twist.linear.x, way.x * bow(s)),
                motion(pose.translation.y, twist.linear.y, way.y * bow(s)),
                motion(pose.translation.z, twist.linear.z, rise),
                motion(GroundPose::of(&pose).yaw, twist.angular.z, turn * bow(s)),
            ],
            rise_s: (0.5 - s) * duration,
            apex_m,
        }
    }

    /// The swing is to end in `seconds_left`, sooner than it was to.
    pub fn hurry(&mut self, seconds_left: f64) {
        if self.rise_s > 0.4 * seconds_left {
            self.rise_s = 0.4 * seconds_left;
            let [_, _, z, _] = &self.along;
            self.apex_m = self.apex_m.min(z.at + HURRIED_RISE_M_S * self.rise_s);
        }
    }

    fn advance(&mut self, end: &Foothold, seconds_left: f64, dt: f64) {
        let seconds = seconds_left + dt;
        let [x, y, z, yaw] = &mut self.along;
        *x = x.towards(end.pose.position.x, seconds, dt);
        *y = y.towards(end.pose.position.y, seconds, dt);
        *yaw = yaw.towards(yaw.at + wrap(end.pose.yaw - yaw.at), seconds, dt);
        *z = if self.rise_s > dt {
            z.towards(self.apex_m, self.rise_s, dt)
        } else {
            z.towards(end.height, seconds, dt)
        };
        self.rise_s -= dt;
    }

    fn foot(&self) -> (Pose<World, Foot>, Twist<World>) {
        let [x, y, z, yaw] = &self.along;
        let pose = GroundPose::new(x.at, y.at, yaw.at).at_height(z.at);
        let linear = Vector3::new(x.rate, y.rate, z.rate);
        (pose, Twist::new(linear, Vector3::new(0.0, 0.0, yaw.rate)))
    }
}
