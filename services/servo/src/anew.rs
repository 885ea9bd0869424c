//! A servo whose drives went on without it for longer than their plan for its loss says what it would have done: it
//! does not know where its robot's feet are. What it believed is forgotten. Where the robot is its joints, gravity and
//! what its hands hold tell: they are where the team wants them, since all others stand and hold on.

use crate::tick::{Servo, ServoError, ServoScratch, ServoState};
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::{IkState, Kinematics};
use mikoshi_ipc_types::{FALLBACK_PARTS, MAX_HANDS, MAX_JOINTS, Sensors, TeamCommand};
use mikoshi_spatial::{Base, Foot, Hand, Pose, World};
use nalgebra::{UnitQuaternion, Vector3};

/// Ticks without it after which drives are no more where they would be with it: until then a plan follows the team's
/// clock.
const ADRIFT_TICKS: u64 = 2 * FALLBACK_PARTS as u64;
/// Share of its weight that each of its feet bears at least.
const LEAST_FOOT_SHARE: f64 = 0.1;

/// How a pose is turned and moved over level ground for it to be another one: summed over several.
#[derive(Default)]
struct Fit {
    count: f64,
    cosine: f64,
    sine: f64,
    found: Vector3<f64>,
    meant: Vector3<f64>,
}

impl Fit {
    fn add(
        &mut self,
        found: (UnitQuaternion<f64>, Vector3<f64>),
        meant: (UnitQuaternion<f64>, Vector3<f64>),
    ) {
        let ahead = meant.0 * found.0.inverse() * Vector3::x();
        let length = ahead.xy().norm().max(f64::MIN_POSITIVE);
        self.count += 1.0;
        self.cosine += ahead.x / length;
        self.sine += ahead.y / length;
        self.found += found.1;
        self.meant += meant.1;
    }

    fn turn(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.sine.atan2(self.cosine))
    }

    fn shift(&self) -> Vector3<f64> {
        (self.meant - self.turn() * self.found) / self.count.max(1.0)
    }
}

fn parts<B: mikoshi_spatial::CoordinateFrame>(pose: &Pose<World, B>) -> (UnitQuaternion<f64>, Vector3<f64>) {
    (pose.rotation, pose.translation)
}

impl Servo {
    /// Whether drives that say this in a tick have long gone on without it.
    pub(crate) fn is_adrift(tick: u64, sensors: &Sensors) -> bool {
        let next_tick = sensors.next_joint_command_tick;
        next_tick > 0 && tick.saturating_sub(next_tick) > ADRIFT_TICKS
    }

    /// Whether the robot stands on both feet, after whatever plan it had.
    pub(crate) fn stands_still(&self, tick: u64, sensors: &Sensors) -> bool {
        let has_rested =
            tick.saturating_sub(sensors.next_joint_command_tick) > self.fallback.longest_plan_ticks();
        let least_n = LEAST_FOOT_SHARE * self.legs.pendulum.weight_n();
        let bears = |wrench: &[f64; 6]| Vector3::new(wrench[0], wrench[1], wrench[2]).norm() > least_n;
        has_rested && sensors.ankle_wrench.iter().all(bears)
    }

    /// Begins anew where the robot stands: up is where gravity says, ahead and where in the world what the hands hold,
    /// and where they hold nothing the feet where they were believed to be; the ground is where they stand.
    ///
    /// # Errors
    /// A hand reference is not a pose; the robot does not stand upright. Nothing has changed then.
    pub(crate) fn begin_anew(
        &self,
        state: &mut ServoState,
        scratch: &mut ServoScratch,
        sensors: &Sensors,
        command: &TeamCommand,
    ) -> Result<(), ServoError> {
        let (robot, model) = (&self.robot, &self.robot.model);
        let (posture, _) = sensors.joint_position_rad.split_at(model.joint_count().min(MAX_JOINTS));
        let kinematics = &mut scratch.measured;
        let X_BI: Pose<Base, mikoshi_spatial::Sensor> = model.pose_in_base(robot.base_estimator.imu, posture);
        let up = X_BI.rotation * Vector3::from(sensors.imu_specific_force_m_s2);
        let level = UnitQuaternion::rotation_between(&up, &Vector3::z()).ok_or(ServoError::Upside)?;
        kinematics.update(model, &Pose::new(Vector3::zeros(), level), posture);

        let feet = self.soles(kinematics);
        let (mut hands_fit, mut feet_fit) = (Fit::default(), Fit::default());
        for side in Side::BOTH {
            feet_fit.add(parts(&feet[side]), parts(&state.legs.gait.feet[side].in_world()));
        }
        if command.closed_hands != 0 {
            for (&palm, pose) in robot.palms.iter().zip(&command.hand_pose_ref) {
                let meant = Pose::<World, Hand>::from_array(pose).ok_or(ServoError::HandReference)?;
                hands_fit.add(parts(&kinematics.frame_pose::<Hand>(model, palm)), parts(&meant));
            }
        }
        let fit = if hands_fit.count > 0.0 { &hands_fit } else { &feet_fit };
        let translation = Vector3::new(fit.shift().x, fit.shift().y, feet_fit.shift().z);
        let X_WB: Pose<World, Base> = Pose::new(translation, fit.turn() * level);
        kinematics.update(model, &X_WB, posture);

        let mut hand_pose_commanded = [Pose::<World, Hand>::identity().to_array(); MAX_HANDS];
        for (array, &palm) in hand_pose_commanded.iter_mut().zip(&robot.palms) {
            *array = kinematics.frame_pose::<Hand>(model, palm).to_array();
        }
        let legs = self.legs.stand_anew(&state.legs, &self.soles(kinematics), kinematics.com().xy(), &X_WB);
        let ik = IkState::at_rest(posture);
        *state = ServoState {
            fallback: self.fallback.none(&self.legs, &legs, &ik),
            base: robot.base_estimator.start(model, &X_WB, posture),
            felt: None,
            hand_pose_commanded,
            hand_error_max_m: 0.0,
            joint_margin_rad: mikoshi_humanoid::ik::joint_margin(model, posture),
            flags: 0,
            legs,
            ik,
            ..*state
        };
        Ok(())
    }

    fn soles(&self, kinematics: &Kinematics) -> PerFoot<Pose<World, Foot>> {
        PerFoot::from_fn(|side| kinematics.frame_pose(&self.robot.model, self.robot.soles[side]))
    }
}
