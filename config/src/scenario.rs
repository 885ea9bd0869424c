//! A scenario: what a team does, with what, for how long, and when that counts as success.

pub use crate::coordination::{Coordination, Policy};
pub use crate::grasp::Grasp;
pub use crate::hosts::{Host, Link};
pub use crate::job::Job;
pub use crate::membership::Membership;
pub use crate::motion::{Motion, RandomMotion, Segment};
pub use crate::operator::{DriveLimits, Operator, OperatorEvent, OperatorWord, Squeeze};
pub use crate::sharing::LoadSharing;
pub use crate::world::{FixedBox, GraspFailure, GraspFailureKind, Ground, LoadChange, PushEvent, World};
use serde::{Deserialize, Serialize};

/// One run, as `config/scenarios/*.toml` describe it. The team's file lies underneath: what the
/// scenario doesn't say, the team says.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Short name, for reports.
    pub name: String,
    /// What it shows, in a sentence.
    pub description: String,
    /// The team's file in `config/teams`, without `.toml`; none where the scenario says it all itself.
    #[serde(default)]
    pub team: Option<String>,
    /// Simulated time.
    pub duration_s: f64,
    /// Seed of everything random; `--seed` overrides it.
    #[serde(default)]
    pub seed: u64,
    /// Period of a tick.
    pub control_period_s: f64,
    /// What makes a tick begin.
    #[serde(default)]
    pub clock: Clock,
    /// In wall-clock time: how many seconds go by in one of the simulation's, where a machine is too slow for its
    /// world.
    #[serde(default = "real_time")]
    pub slow_motion: f64,
    /// Age in ticks of the team command that a servo uses; in wall-clock time at least 1.
    #[serde(default)]
    pub coordination_delay_ticks: u64,
    /// The carried object.
    pub object: Object,
    /// The robots, in the order of their indices.
    pub robots: Vec<Member>,
    /// How hands hold the object.
    pub grasp: Grasp,
    /// The hybrid law.
    pub hybrid: Hybrid,
    /// Who decides where the hands go.
    #[serde(default)]
    pub coordination: Coordination,
    /// Who bears how much of the object.
    #[serde(default)]
    pub load: LoadSharing,
    /// The whole job, from open hands to open hands; without, hands hold the object from tick 0 on.
    #[serde(default)]
    pub job: Option<Job>,
    /// Robots that leave while the team carries, or join.
    #[serde(default)]
    pub membership: Vec<Membership>,
    /// How the object is asked to move; it stays when absent.
    #[serde(default)]
    pub motion: Option<Motion>,
    /// How robots step.
    #[serde(default)]
    pub gait: Gait,
    /// How robots keep their balance.
    #[serde(default)]
    pub balance: Balance,
    /// How robots know where they are.
    #[serde(default)]
    pub odometry: Odometry,
    /// What stands around the team.
    #[serde(default)]
    pub world: World,
    /// The simulated physics.
    #[serde(default)]
    pub physics: Physics,
    /// What the simulated sensors add to the truth.
    #[serde(default)]
    pub sensors: Sensors,
    /// When the run counts as a success.
    #[serde(default)]
    pub thresholds: Thresholds,
    /// Where processes run.
    #[serde(default)]
    pub placement: Placement,
    /// What happens to processes that die.
    #[serde(default)]
    pub supervision: Supervision,
    /// What stops the team.
    #[serde(default)]
    pub safety: Safety,
    /// What an operator may ask for, and what is asked by script.
    #[serde(default)]
    pub operator: Operator,
    /// The computers of the team; none where one is enough.
    #[serde(default)]
    pub hosts: Vec<Host>,
    /// How frames travel between them.
    #[serde(default)]
    pub link: Link,
}

impl Scenario {
    /// Number of control ticks.
    pub fn ticks(&self) -> u64 {
        (self.duration_s / self.control_period_s).round() as u64
    }

    /// What a tick takes by the clock.
    pub fn wall_period_s(&self) -> f64 {
        self.control_period_s * self.slow_motion
    }

    /// The least age of a team command: by the clock, robots don't wait for the coordinator.
    pub(crate) fn least_delay_ticks(&self) -> u64 {
        u64::from(self.clock == Clock::Wall)
    }

    /// Tick at which the hybrid law starts; `None` if it never does.
    pub fn hybrid_start_tick(&self) -> Option<u64> {
        self.hybrid.start_s.map(|start_s| self.tick_at(start_s))
    }

    /// The tick nearest to this time.
    pub fn tick_at(&self, time_s: f64) -> u64 {
        (time_s / self.control_period_s).round() as u64
    }

    /// Whether the hybrid law is to start.
    pub fn is_controlled(&self) -> bool {
        self.hybrid.start_s.is_some() || self.job.is_some()
    }

    /// What a push on this body is called on the wire: the object, or a robot; `None` if there is no such body.
    pub fn push_target(&self, on: &str) -> Option<u64> {
        if on == PushEvent::OBJECT {
            return Some(0);
        }
        self.robots.iter().position(|member| member.name == on).map(|robot| robot as u64 + 1)
    }

    /// Whether the object moves as whoever drives wants it.
    pub fn is_driven(&self) -> bool {
        self.operator.drive.is_some()
    }

    /// How fast the object loses velocity and angular velocity when it is to rest \[m/s², rad/s²\]; `None` where
    /// nothing but a job moves it.
    pub fn object_braking(&self) -> Option<[f64; 2]> {
        let driven = self.operator.drive.as_ref();
        let moved = self.motion.as_ref();
        driven
            .map(|drive| [drive.braking_m_s2, drive.angular_braking_rad_s2])
            .or(moved.map(|motion| [motion.acceleration_m_s2, motion.angular_acceleration_rad_s2]))
    }

    /// Whether the hands of this robot hold the object at tick 0.
    pub fn begins_closed(&self, robot: &str) -> bool {
        self.job.is_none() && !self.begins_away(robot)
    }

    /// Whether this robot is to join the others later.
    pub fn begins_away(&self, robot: &str) -> bool {
        self.membership_of(robot).next().is_some_and(Membership::begins_away)
    }

    /// When this robot leaves and joins, in the order of time.
    pub fn membership_of<'a>(&'a self, robot: &'a str) -> impl Iterator<Item = &'a Membership> {
        self.membership.iter().filter(move |entry| entry.robot == robot)
    }

    /// Number of physics steps in a tick.
    pub fn substeps(&self) -> u64 {
        (self.control_period_s / self.physics.step_s).round() as u64
    }
}

fn real_time() -> f64 {
    1.0
}

/// What makes a tick begin.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Clock {
    /// Every service waits for its inputs, however long they take: as fast as the machine goes.
    #[default]
    Lockstep,
    /// Ticks begin a control period apart, and what does not come in time is done without.
    Wall,
}

/// The carried object: a box.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Object {
    /// Mass.
    pub mass_kg: f64,
    /// Full edge lengths.
    pub size_m: [f64; 3],
    /// Centre in the world at the start.
    pub position_m: [f64; 3],
    /// Heading at the start.
    #[serde(default)]
    pub yaw_deg: f64,
    /// Centre of mass, from the centre of the box.
    #[serde(default)]
    pub com_m: [f64; 3],
}

/// A robot of the team, and where it stands.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Member {
    /// Name, unique in the team.
    pub name: String,
    /// The robot's folder-less file in `config/robots`, without `.toml`.
    pub model: String,
    /// Midpoint between its soles, in the world.
    pub x_m: f64,
    /// Midpoint between its soles, in the world.
    pub y_m: f64,
    /// Heading.
    pub yaw_deg: f64,
    /// Hands that grasp, by name; all hands of the model when absent.
    #[serde(default)]
    pub hands: Option<Vec<String>>,
}

/// The hybrid law's parameters (the paper's section 3).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hybrid {
    /// When the law starts; never when absent. A job starts it when the hands hold.
    #[serde(default)]
    pub start_s: Option<f64>,
    /// Position gain kz (eq. 39).
    pub kz: f64,
    /// Loop gain g = kz·kh·k/2: the share of an internal force that one tick corrects. It determines kh
    /// (eq. 34), with the stiffness below and the geometry of the grasp.
    pub loop_gain: f64,
    /// Stiffness k of a hand against the object: of the grasp, the arm and the robot in series.
    pub hand_stiffness_n_m: f64,
    /// The same about an axis.
    pub hand_stiffness_nm_rad: f64,
    /// How stiff a grasp is by itself, as calibrated: what yields between palm and object is seen by no
    /// encoder, but by wrist sensors. Rigid when absent.
    #[serde(default)]
    pub grasp_stiffness_n_m: Option<f64>,
    /// The same about an axis.
    #[serde(default)]
    pub grasp_stiffness_nm_rad: Option<f64>,
    /// Corner frequency of the wrist wrench filter.
    pub filter_hz: f64,
    /// Which internal forces are controlled.
    #[serde(default)]
    pub internal_forces: InternalForces,
    /// Exceptions to "the object by position, internal forces by force to zero".
    #[serde(default)]
    pub axes: Vec<AxisControl>,
}

/// How robots step, all on common ticks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Gait {
    /// Weight shift between two steps.
    pub double_support_s: f64,
    /// Swing.
    pub single_support_s: f64,
    /// How high a swinging foot is lifted.
    pub lift_m: f64,
    /// Robots that face back swing the other foot, so that the team sways to one side together.
    pub mirror_opposed: bool,
}

impl Default for Gait {
    fn default() -> Self {
        Self { double_support_s: 0.2, single_support_s: 0.6, lift_m: 0.05, mirror_opposed: true }
    }
}

/// How robots keep their balance.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Balance {
    /// Whether feet give way to what the centre of mass and the ground do; without, the gait's
    /// references are followed as they are.
    pub stabiliser: bool,
    /// Whether a robot that is off balance moves its foothold, and has the team land sooner, while a foot is in the air.
    pub adjusts_steps: bool,
}

impl Default for Balance {
    fn default() -> Self {
        Self { stabiliser: true, adjusts_steps: true }
    }
}

/// How robots know where they are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Odometry {
    /// Whether the object that all hold keeps their worlds together; without, each walks in a world of its
    /// own.
    pub landmark: bool,
}

impl Default for Odometry {
    fn default() -> Self {
        Self { landmark: true }
    }
}

/// The rows of C.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum InternalForces {
    /// A balanced tree over robots, then over their arms: eq. 44 for four robots.
    #[default]
    BalancedTree,
    /// The chain of the paper's eq. 24 and Fig. 3: each robot's arms, then robot i against i + 1.
    Chain,
    /// (n − 1) × n coefficients, row by row.
    Matrix(Vec<Vec<f64>>),
}

/// One axis of one row that departs from the default.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct AxisControl {
    /// `object`, or the name of an internal force as `mikoshi plan` prints it.
    pub row: String,
    /// The axis: of the object's coordinate frame for internal rows, of the world for the object.
    pub axis: Axis,
    /// What is controlled along it.
    pub control: Control,
    /// Its reference: N, Nm, m or rad. Positions are relative to the grasp.
    #[serde(default)]
    pub reference: f64,
    /// What an axis that is controlled by position is to bear in the end, N or Nm: nothing controls it, and
    /// `thresholds.axis_reference_error_end_n` judges it.
    #[serde(default)]
    pub expected_force: Option<f64>,
}

/// An axis of a 6-vector.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Axis {
    X,
    Y,
    Z,
    Roll,
    Pitch,
    Yaw,
}

/// What a selection matrix selects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
#[allow(missing_docs)]
pub enum Control {
    Position,
    Force,
}

/// The simulated physics.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Physics {
    /// Physics step; it divides the control period.
    pub step_s: f64,
    /// Sliding friction of soles and floor.
    pub friction: f64,
}

impl Default for Physics {
    fn default() -> Self {
        Self { step_s: 0.001, friction: 1.0 }
    }
}

/// What the simulated sensors add to the truth, by seed.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Sensors {
    /// Standard deviation of each wrist and ankle force.
    pub force_noise_n: f64,
    /// Standard deviation of each wrist and ankle moment.
    pub moment_noise_nm: f64,
    /// Standard deviation of each encoder.
    pub encoder_noise_rad: f64,
    /// Standard deviation of each gyroscope axis.
    pub gyro_noise_rad_s: f64,
    /// Standard deviation of each accelerometer axis.
    pub accelerometer_noise_m_s2: f64,
    /// Age of every reading.
    pub delay_ticks: u64,
}

/// When a run counts as a success; a figure that is absent is not judged.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
#[allow(missing_docs)]
pub struct Thresholds {
    pub internal_start_min_n: Option<f64>,
    pub internal_after_3s_n: Option<f64>,
    pub internal_after_3s_nm: Option<f64>,
    pub internal_end_n: Option<f64>,
    pub internal_end_nm: Option<f64>,
    /// Of every axis in `hybrid.axes` whose force is known beforehand: how far its true mean over the last
    /// 0.2 s may be from its reference.
    pub axis_reference_error_end_n: Option<f64>,
    pub axis_reference_error_end_nm: Option<f64>,
    pub internal_peak_n: Option<f64>,
    /// How far internal forces may be from their references, from 3 s after the law's start on.
    pub internal_error_peak_n: Option<f64>,
    /// The same over the last 0.2 s.
    pub internal_error_end_n: Option<f64>,
    pub internal_error_end_nm: Option<f64>,
    pub object_position_rms_m: Option<f64>,
    pub object_position_peak_m: Option<f64>,
    pub object_attitude_rms_rad: Option<f64>,
    pub object_attitude_peak_rad: Option<f64>,
    pub object_travel_min_m: Option<f64>,
    pub object_travel_min_rad: Option<f64>,
    /// How far from where the job was to bring it the object may rest in the end.
    pub object_goal_error_max_m: Option<f64>,
    pub object_goal_error_max_rad: Option<f64>,
    pub object_speed_end_max_m_s: Option<f64>,
    pub foot_slip_max_m: Option<f64>,
    pub joint_margin_min_rad: Option<f64>,
    pub saturated_ticks_max: Option<u64>,
    pub saturated_share_max: Option<f64>,
    pub zmp_margin_min_m: Option<f64>,
}

/// Where processes run. Empty lists leave the choice to the operating system.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Placement {
    /// Core of the bridge.
    pub bridge_core: Option<usize>,
    /// Core of the coordinator.
    pub coordinator_core: Option<usize>,
    /// Cores of the servos, in turn.
    pub servo_cores: Vec<usize>,
    /// FIFO priority of all services; absent for the ordinary scheduler.
    pub fifo_priority: Option<u8>,
    /// For how long a process that waits gives way to others before it sleeps \[µs\]. With 0 it sleeps at once, and
    /// must be woken each time.
    pub yield_us: u32,
    /// How long before a tick is due whoever begins it gets up, and gives way to others from then on: a core that
    /// sleeps is woken up late. With 0 it is woken when the tick is due. By the clock only.
    pub early_us: u32,
    /// When cores of the services are kept from falling asleep, by threads that run only while nobody else wants to, and
    /// wake services that sleep there. Without pins, cores are those of the machine if it has no more than there are services.
    pub keep_awake: KeepAwake,
    /// What to do about a right that a service asks for and doesn't have.
    pub rt: MissingRights,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            bridge_core: None,
            coordinator_core: None,
            servo_cores: vec![],
            fifo_priority: None,
            yield_us: 20,
            early_us: 100,
            keep_awake: KeepAwake::default(),
            rt: MissingRights::default(),
        }
    }
}

/// When cores are kept awake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum KeepAwake {
    /// They may sleep.
    Never,
    /// In lockstep: it is over the sooner.
    #[default]
    Lockstep,
    /// By the clock, too.
    Always,
}

/// What to do about a core, a priority or locked memory that is not granted.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum MissingRights {
    /// Go on without, and say so.
    #[default]
    Warn,
    /// Refuse to run.
    Strict,
}

/// What happens to processes that die.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Supervision {
    /// How often a service may die, or freeze, in one phase of one tick before the run ends. Each time but
    /// the last it gets a successor that goes on where it was. 0: the first death ends the run.
    pub restart_limit: u32,
    /// Whether in wall-clock time every servo, and the coordinator, have a second process ready that takes over
    /// when the first is lost or falls behind.
    pub standby: bool,
}

impl Default for Supervision {
    fn default() -> Self {
        Self { restart_limit: 3, standby: false }
    }
}

/// What stops the team: limits that no run comes near in which all is well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Safety {
    /// Largest force that a hand may apply to the object.
    pub hand_force_max_n: f64,
    /// Largest moment.
    pub hand_moment_max_nm: f64,
    /// Smallest distance of a robot's zero moment point from the edge of its support, as it feels it.
    pub zmp_margin_min_m: f64,
    /// Largest angle between a robot's base and upright.
    pub tilt_max_rad: f64,
    /// For how long a drive may give all the torque it has.
    pub torque_limit_s: f64,
    /// For how many ticks in a row a robot may say nothing, or hear nothing.
    pub stale_limit_ticks: u64,
    /// How far a hand may be from its grip on the object, by where the others have the object and by what its wrench
    /// explains, before it counts as slipping. Where nothing but its robot's odometry tells where it is, that
    /// explains some millimetres more.
    pub slip_m: f64,
    /// The same about an axis.
    pub slip_rad: f64,
    /// For how many ticks in a row.
    pub slip_ticks: u64,
    /// What becomes of the team when a hand has lost the object.
    pub lost_grasp: LostGrasp,
}

/// What becomes of a team one of whose hands has lost the object. Internal forces are formed anew among the others
/// in either case.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum LostGrasp {
    /// It stops.
    #[default]
    Stop,
    /// The other hands carry on, as long as they are hands of two robots.
    CarryOn,
}

impl Default for Safety {
    fn default() -> Self {
        Self {
            hand_force_max_n: 300.0,
            hand_moment_max_nm: 100.0,
            zmp_margin_min_m: 0.0,
            tilt_max_rad: 0.2,
            torque_limit_s: 0.5,
            stale_limit_ticks: 15,
            slip_m: 0.003,
            slip_rad: 0.01,
            slip_ticks: 10,
            lost_grasp: LostGrasp::Stop,
        }
    }
}
