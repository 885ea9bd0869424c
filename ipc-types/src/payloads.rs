//! Every payload that travels.
//!
//! Conventions: poses are `[x, y, z, qw, qx, qy, qz]`, wrenches force before moment (the paper's
//! eq. 1), twists linear before angular. World is the common frame of the team (the paper's Σo).
//! Entries past a count are zero.

use crate::layout::payload;
use crate::{MAX_FEET, MAX_HANDS, MAX_HANDS_OF_TEAM, MAX_JOINTS, MAX_ROBOTS};

/// `[x, y, z, qw, qx, qy, qz]`, metres and a unit quaternion.
pub type PoseWire = [f64; 7];
/// `[fx, fy, fz, nx, ny, nz]`, N and Nm.
pub type WrenchWire = [f64; 6];
/// `[vx, vy, vz, wx, wy, wz]`, m/s and rad/s.
pub type TwistWire = [f64; 6];

/// Team modes, as `TeamCommand::team_mode` and `TeamState::team_mode` carry them.
pub mod mode {
    /// Commands are constant; nothing is controlled but each robot's own balance.
    pub const HOLD: u64 = 1;
    /// The hybrid law controls object and internal forces; the team may walk.
    pub const CARRY: u64 = 2;
    /// Something is wrong, or the operator has stopped the team: the object comes to rest, the feet finish their
    /// step, and hands that hold go on to hold.
    pub const SAFE_STOP: u64 = 3;
    /// Open hands move to where they will grasp.
    pub const APPROACH: u64 = 4;
    /// Hands close on the resting object.
    pub const GRASP: u64 = 5;
    /// As [`CARRY`], on the way up from where the object rested; nobody walks.
    pub const LIFT: u64 = 6;
    /// As [`CARRY`], on the way down to where the object shall rest; nobody walks.
    pub const LOWER: u64 = 7;
    /// Hands open and draw back.
    pub const RELEASE: u64 = 8;

    /// What people call a mode.
    pub const fn name(mode: u64) -> &'static str {
        match mode {
            HOLD => "hold",
            CARRY => "carry",
            SAFE_STOP => "safe stop",
            APPROACH => "approach",
            GRASP => "grasp",
            LIFT => "lift",
            LOWER => "lower",
            RELEASE => "release",
            _ => "unknown",
        }
    }

    /// Whether the hybrid law is at work.
    pub const fn is_hybrid(mode: u64) -> bool {
        matches!(mode, CARRY | LIFT | LOWER)
    }
}

/// Why a team is in a safe stop, as `TeamState::stop_cause` carries it.
pub mod stop_cause {
    /// The operator wanted it.
    pub const OPERATOR: u64 = 1;
    /// What a robot's sensors or its servo said was not finite, or out of range.
    pub const INPUT: u64 = 2;
    /// A hand pushes or pulls harder than it may.
    pub const HAND_WRENCH: u64 = 3;
    /// A robot's zero moment point is at the edge of its support.
    pub const BALANCE: u64 = 4;
    /// A robot leans.
    pub const TILT: u64 = 5;
    /// A drive stands at its torque limit.
    pub const TORQUE: u64 = 6;
    /// A hand that should hold the object does not.
    pub const GRASP: u64 = 7;
    /// A robot has not been heard of for too long, or does not hear the others.
    pub const STALE: u64 = 8;
    /// A hand that says it holds the object has parted from it.
    pub const SLIP: u64 = 9;
    /// Too few hands hold the object, or hands of one robot alone.
    pub const TOO_FEW_HANDS: u64 = 10;

    /// All of them.
    pub const ALL: [u64; 10] =
        [OPERATOR, INPUT, HAND_WRENCH, BALANCE, TILT, TORQUE, GRASP, STALE, SLIP, TOO_FEW_HANDS];

    /// Its code in summaries.
    pub const fn name(cause: u64) -> &'static str {
        match cause {
            OPERATOR => "operator-stop",
            INPUT => "input-rejected",
            HAND_WRENCH => "hand-wrench",
            BALANCE => "balance-margin",
            TILT => "tilt",
            TORQUE => "torque-limit",
            GRASP => "grasp-lost",
            STALE => "input-stale",
            SLIP => "grasp-slip",
            TOO_FEW_HANDS => "too-few-hands",
            _ => "unknown",
        }
    }
}

/// How far a robot is on its way out of the team or into it, as `TeamState::member_stage` carries it.
pub mod member_stage {
    /// It carries with the others.
    pub const MEMBER: u64 = 0;
    /// It is to leave: the object comes to rest, and feet stand.
    pub const HALTING: u64 = 1;
    /// Its hands hold, and leave what they bear to the others.
    pub const UNBURDENING: u64 = 2;
    /// Its hands open; it takes no part from now on.
    pub const OPENING: u64 = 3;
    /// Its open hands draw back.
    pub const WITHDRAWING: u64 = 4;
    /// It walks off.
    pub const LEAVING: u64 = 5;
    /// It stands aside.
    pub const AWAY: u64 = 6;
    /// It walks to where it can come straight to its place.
    pub const RETURNING: u64 = 7;
    /// It walks up to its place; the object rests.
    pub const APPROACHING: u64 = 8;
    /// Its open hands come to the object.
    pub const REACHING: u64 = 9;
    /// Its hands close.
    pub const CLOSING: u64 = 10;
    /// Its hands hold, and take on what they are to bear.
    pub const JOINING: u64 = 11;

    /// What people call a stage.
    pub const fn name(stage: u64) -> &'static str {
        match stage {
            MEMBER => "member",
            HALTING => "halting",
            UNBURDENING => "unburdening",
            OPENING => "opening",
            WITHDRAWING => "withdrawing",
            LEAVING => "leaving",
            AWAY => "away",
            RETURNING => "returning",
            APPROACHING => "approaching",
            REACHING => "reaching",
            CLOSING => "closing",
            JOINING => "joining",
            _ => "unknown",
        }
    }
}

/// Why a robot could not leave or join, as `TeamState::member_fault` carries it.
pub mod member_fault {
    /// Object or feet did not come to rest.
    pub const RESTLESS: u64 = 1;
    /// Without it too few hands would hold the object.
    pub const NEEDED: u64 = 2;
    /// Its hands still bore something when they should not.
    pub const BURDENED: u64 = 3;
    /// Its hands did not open.
    pub const HOLDING: u64 = 4;
    /// It did not get away as far as it should.
    pub const STRANDED: u64 = 5;
    /// It did not come to its place.
    pub const OUT_OF_REACH: u64 = 6;
    /// Its hands did not take hold.
    pub const NOT_HOLDING: u64 = 7;

    /// Its code in summaries.
    pub const fn name(fault: u64) -> &'static str {
        match fault {
            RESTLESS => "member-restless",
            NEEDED => "member-needed",
            BURDENED => "member-burdened",
            HOLDING => "member-holding",
            STRANDED => "member-stranded",
            OUT_OF_REACH => "member-out-of-reach",
            NOT_HOLDING => "member-not-holding",
            _ => "unknown",
        }
    }
}

/// The first `count` hands, as sets of hands travel: bit h for grasping hand h.
pub const fn all_hands(count: usize) -> u64 {
    let count = if count < MAX_HANDS { count } else { MAX_HANDS };
    (1 << count) - 1
}

/// Bits of `RobotState::flags`.
pub mod flag {
    /// A joint command stands at its position limit.
    pub const JOINT_LIMIT: u64 = 1 << 0;
    /// A joint command stands at its velocity limit.
    pub const VELOCITY_LIMIT: u64 = 1 << 1;
    /// The hands do not follow their references within tolerance.
    pub const HANDS_BEHIND: u64 = 1 << 2;
    /// An input of this tick was unusable; the command is the last good one.
    pub const INPUT_REJECTED: u64 = 1 << 3;
    /// The robot wants to take a step.
    pub const WANTS_STEP: u64 = 1 << 4;
    /// The robot could stand after the step that starts next.
    pub const CAN_STOP: u64 = 1 << 5;
    /// Its foot may leave the ground at the next lift-off.
    pub const READY_TO_STEP: u64 = 1 << 6;
    /// It would swing the team's left foot first.
    pub const LEFT_FIRST: u64 = 1 << 7;
    /// A drive gives all the torque it has.
    pub const TORQUE_LIMIT: u64 = 1 << 8;
    /// An input did not come in time; the last one serves.
    pub const INPUT_MISSING: u64 = 1 << 9;
}

payload! {
    /// bridge → servo: what robot r's sensors read at the start of a tick.
    Everyone "sensors"
    pub struct Sensors {
        /// Encoder angles in the order of the robot's description.
        pub joint_position_rad: [f64; MAX_JOINTS],
        /// Encoder rates.
        pub joint_velocity_rad_s: [f64; MAX_JOINTS],
        /// Torque that each drive applied, averaged over the last tick.
        pub joint_torque_nm: [f64; MAX_JOINTS],
        /// Wrist sensors: wrench that the arm applies to what is outboard, at the sensor, in its axes.
        pub wrist_wrench: [WrenchWire; MAX_HANDS],
        /// Ankle sensors: wrench that the leg applies to what is outboard, at the sensor, in its axes.
        pub ankle_wrench: [WrenchWire; MAX_FEET],
        /// Gyroscope, in the IMU's axes.
        pub imu_angular_velocity_rad_s: [f64; 3],
        /// Accelerometer (specific force: it reads +9.81 upwards at rest), in the IMU's axes.
        pub imu_specific_force_m_s2: [f64; 3],
        /// Bit h: grasping hand h holds the object.
        pub holding_hands: u64,
        /// 1 if the last joint command was unusable: the drives hold the one before.
        pub command_rejected: u64,
        /// One past the tick of the last joint command that has arrived; 0 before the first.
        pub next_joint_command_tick: u64,
    }
}

payload! {
    /// servo → coordinator: where robot r's hands are and what they apply to the object.
    Everyone "robot-state"
    pub struct RobotState {
        /// Measured pose of each hand in the world: encoders, stance-foot odometry, IMU.
        pub hand_pose: [PoseWire; MAX_HANDS],
        /// Pose of each hand by the commanded posture of the last tick: what the IK achieved.
        pub hand_pose_commanded: [PoseWire; MAX_HANDS],
        /// Wrench that each hand applies to the object, at the hand's origin, in world axes.
        pub hand_wrench: [WrenchWire; MAX_HANDS],
        /// Measured centre of mass in the world.
        pub com_position_m: [f64; 3],
        /// Measured base pose in the world.
        pub base_pose: PoseWire,
        /// Measured zero moment point in the world, on the ground.
        pub zmp_position_m: [f64; 2],
        /// Distance from the zero moment point to the edge of the support polygon; negative outside.
        pub zmp_margin_m: f64,
        /// Distance from the capture point to the edge of the support polygon; negative outside.
        pub capture_point_margin_m: f64,
        /// Smallest distance of a joint from its limit.
        pub joint_margin_min_rad: f64,
        /// Largest distance between a hand's reference and what the IK achieved.
        pub hand_error_max_m: f64,
        /// Largest foot error (eq. 40) at the next landing, as a multiple of its starting threshold.
        pub step_urgency: f64,
        /// Share of its speed that the object may keep without leaving this robot's feet behind, 0 to 1.
        pub speed_share: f64,
        /// Steps taken since tick 0.
        pub steps: u64,
        /// Bit h: grasping hand h holds the object.
        pub holding_hands: u64,
        /// Bits of [`flag`].
        pub flags: u64,
        /// One past the tick of the last sensor readings that have arrived; 0 before the first.
        pub next_sensors_tick: u64,
        /// Force with which its hands could lift, as it stands, before a joint had all that it can bear for long; 0 where
        /// nobody has said.
        pub bearable_n: f64,
        /// Largest torque that a joint needs to stand so and to bear what its hands are expected to, as a share of its limit.
        pub static_torque_share: f64,
        /// Moment that its hands together would best apply to the object beside that force, in world axes.
        pub bearing_moment_nm: [f64; 3],
        /// In how many ticks its swinging foot, or its first one, had better have landed; 0: as the step clock has it.
        pub land_in_ticks: u64,
    }
}

payload! {
    /// coordinator → servo: what robot r is to do.
    Everyone "team-command"
    pub struct TeamCommand {
        /// Reference pose of each hand in the world.
        pub hand_pose_ref: [PoseWire; MAX_HANDS],
        /// Reference twist of each hand in the world.
        pub hand_twist_ref: [TwistWire; MAX_HANDS],
        /// Wrench that each hand is expected to apply to the object, at the hand's origin, in world axes.
        pub hand_wrench_ref: [WrenchWire; MAX_HANDS],
        /// The team's step clock: kind, step index, tick, flags.
        pub step_clock: [u64; 4],
        /// Bit h: grasping hand h shall hold the object.
        pub closed_hands: u64,
        /// One of [`mode`].
        pub team_mode: u64,
        /// Tick of the robot states that this command is computed from.
        pub state_tick: u64,
    }
}

payload! {
    /// servo → bridge: position references for robot r's drives at the end of the tick.
    Everyone "joint-command"
    pub struct JointCommand {
        /// Reference angles in the order of the robot's description.
        pub joint_position_ref_rad: [f64; MAX_JOINTS],
        /// Reference rates, for the drives' velocity feed-forward.
        pub joint_velocity_ref_rad_s: [f64; MAX_JOINTS],
        /// Bit h: grasping hand h shall hold the object.
        pub closed_hands: u64,
        /// One past the tick of the last team command that has arrived; 0 before the first.
        pub next_team_command_tick: u64,
        /// Which part of the robot's plan for the loss of its servo rides with this command, from 1 on; 0 if it
        /// has none.
        pub fallback_part: u64,
        /// How many ticks after this command's the joints shall be there.
        pub fallback_ahead_ticks: u64,
        /// Where: angles in the order of the robot's description.
        pub fallback_position_rad: [f64; MAX_JOINTS],
    }
}

payload! {
    /// coordinator → observers: the team's view of the object and of the internal forces.
    Observers "team-state"
    pub struct TeamState {
        /// Measured generalized force h_c (eqs. 11, 28), filtered; row 0 external, then internal.
        pub generalized_force: [WrenchWire; MAX_HANDS_OF_TEAM],
        /// Reference generalized force h_r.
        pub generalized_force_ref: [WrenchWire; MAX_HANDS_OF_TEAM],
        /// Measured object pose by the mean of the virtual sticks' tips (eq. 27).
        pub object_pose: PoseWire,
        /// Reference object pose.
        pub object_pose_ref: PoseWire,
        /// Reference object twist, after the governor.
        pub object_twist_ref: TwistWire,
        /// Share of the operator's velocity that the slowest robot allows (Fig. 10b), 0 to 1.
        pub speed_share: f64,
        /// The team's step clock: kind, step index, tick, flags.
        pub step_clock: [u64; 4],
        /// One of [`mode`].
        pub team_mode: u64,
        /// What the operator has said last, by this tick; 0 before the first word.
        pub operator_word: u64,
        /// Why the team is in a safe stop: one of [`stop_cause`], 0 if it is not.
        pub stop_cause: u64,
        /// Which robot's fault that is, plus one; 0 if nobody's.
        pub stop_robot: u64,
        /// For each robot, one past the tick of its last state that has arrived; 0 before the first.
        pub next_state_tick: [u64; MAX_ROBOTS],
        /// Where each robot's own world lies in the team's, by the object that all hold.
        pub odometry_pose: [PoseWire; MAX_ROBOTS],
        /// How far each hand has parted from its grip, in hand order: it slips from 1 on.
        pub hand_slip: [f64; MAX_HANDS_OF_TEAM],
        /// Bit i: hand i of the team, in hand order, has lost the object and takes no part any more.
        pub absent_hands: u64,
        /// Why the last of them was lost: one of [`stop_cause`], 0 if none was.
        pub loss_cause: u64,
        /// Number of the message in which whoever drives has said the following; 0 if nobody ever drove.
        pub drive_number: u64,
        /// Twist of the object that it asks for, in the object's heading.
        pub drive_twist: TwistWire,
        /// How much harder the hands shall press than they would.
        pub drive_squeeze_n: f64,
        /// For how many ticks whoever drives has said nothing new.
        pub drive_silent_ticks: u64,
        /// How much harder they are asked to press by now.
        pub squeeze_n: f64,
        /// The word that the job waits for: one of [`operator`](crate::operator), 0 if none.
        pub awaited_word: u64,
        /// What is carried, as hands feel it: mass, 0 as long as nobody knows.
        pub load_mass_kg: f64,
        /// Standard deviation of the mass.
        pub load_mass_std_kg: f64,
        /// Its centre of mass from the object's origin, in the object's axes.
        pub load_com_m: [f64; 3],
        /// Standard deviation of the centre of mass.
        pub load_com_std_m: [f64; 3],
        /// Its inertia about the centre of mass, in the object's axes: xx, yy, zz, xy, xz, yz.
        pub load_inertia_kg_m2: [f64; 6],
        /// Standard deviation of the inertia.
        pub load_inertia_std_kg_m2: [f64; 6],
        /// Of the load, what each robot is asked to bear: 1 for all of it.
        pub load_share: [f64; MAX_ROBOTS],
        /// To which part hands are relieved of the moments that zero internal forces bring: 0 not at all, 1 wholly.
        pub load_relief: f64,
        /// How far each robot is on its way out of the team or into it: one of [`member_stage`].
        pub member_stage: [u64; MAX_ROBOTS],
        /// Why it could not leave or join when it was last to: one of [`member_fault`], 0 if it could.
        pub member_fault: [u64; MAX_ROBOTS],
        /// Of what is borne, the part of a whole member's that each robot is asked for, 0 to 1.
        pub member_weight: [f64; MAX_ROBOTS],
        /// Bit i: hand i of the team takes no part because its robot is away, and has not lost the object.
        pub away_hands: u64,
    }
}

payload! {
    /// bridge → observers: the object as it truly is.
    Observers "object-truth"
    pub struct ObjectTruth {
        /// True pose in the world.
        pub pose: PoseWire,
        /// True twist in the world.
        pub twist: TwistWire,
        /// True wrench of the world's fixed boxes on the object, averaged over the last tick, at the
        /// object's origin in world axes.
        pub support_wrench: WrenchWire,
        /// Contacts of this tick that nobody intended (robot-robot, self, robot-object, object-floor,
        /// robot-box).
        pub unintended_contacts: u64,
        /// Geom ids of the first of them, plus one; 0 where there is none.
        pub unintended_pair: [u64; 2],
        /// Robots in the team, for readers of the log.
        pub robot_count: u64,
        /// Force of pushes on it in the last tick, in the world.
        pub push_force_n: [f64; 3],
        /// Number of the last push that was heard of, in the tick before; 0 before the first.
        pub heard_push_number: u64,
        /// Whom it pushes: the object, or robot r for r + 1.
        pub heard_push_target: u64,
        /// How hard, in the world.
        pub heard_push_force_n: [f64; 3],
        /// For how long.
        pub heard_push_ticks: u64,
    }
}

payload! {
    /// bridge → observers: robot r as it truly is.
    Observers "robot-truth"
    pub struct RobotTruth {
        /// True base pose in the world.
        pub base_pose: PoseWire,
        /// True sole poses in the world.
        pub sole_pose: [PoseWire; MAX_FEET],
        /// True wrench of the ground on each foot, averaged over the last tick, about the world origin.
        pub ground_wrench: [WrenchWire; MAX_FEET],
        /// True wrench that each hand applies to the object, at the hand's origin, in world axes,
        /// unfiltered, from the constraint (weld) or the spring itself.
        pub hand_wrench: [WrenchWire; MAX_HANDS],
        /// True hand poses in the world.
        pub hand_pose: [PoseWire; MAX_HANDS],
        /// True joint angles.
        pub joint_position_rad: [f64; MAX_JOINTS],
        /// Largest torque that each drive asked for in this tick, before its limit.
        pub joint_torque_peak_nm: [f64; MAX_JOINTS],
        /// Bit j: drive j stood at its torque limit in this tick.
        pub saturated_joints: u64,
        /// True centre of mass in the world.
        pub com_position_m: [f64; 3],
        /// True centre of pressure of all ground contact, averaged over the last tick.
        pub zmp_position_m: [f64; 2],
        /// Distance from it to the edge of the hull of the feet that bear more than 5 % of the weight.
        pub zmp_margin_m: f64,
        /// Tilt of the base from upright.
        pub tilt_rad: f64,
        /// 1 once the robot has fallen.
        pub fallen: u64,
        /// Force of pushes on its base in the last tick, in the world.
        pub push_force_n: [f64; 3],
    }
}

const _: () = assert!(MAX_JOINTS <= 64, "joint sets travel as 64-bit masks");
const _: () = assert!(MAX_ROBOTS * MAX_HANDS == MAX_HANDS_OF_TEAM);
const _: () = assert!(MAX_HANDS_OF_TEAM <= 64, "sets of hands travel as 64-bit masks");
