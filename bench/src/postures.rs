//! A walking robot tick by tick: what kinematics is asked for, and what inverse kinematics.

use crate::recording::Recording;
use mikoshi_humanoid::balance::{PerFoot, Side};
use mikoshi_humanoid::{FrameId, IkScratch, IkState, IkTargets, Kinematics, WholeBodyIk};
use mikoshi_robot::Robot;
use mikoshi_spatial::{Base, Foot, Hand, Pose, World};
use nalgebra::Vector3;

/// A robot's way through the recorded walk.
pub struct Walk {
    /// Its body.
    pub robot: Robot,
    /// Eq. 41 for it.
    pub ik: WholeBodyIk,
    /// All of its links.
    pub links: Vec<FrameId>,
    /// Base and joints in each tick.
    pub postures: Vec<Posture>,
    /// What leads from one tick's joints to the next one's, where no limit bounds it.
    pub steps: Vec<Step>,
}

/// Where it is in a tick.
pub struct Posture {
    /// Of the root link.
    pub base: Pose<World, Base>,
    /// Encoder angles \[rad\], in the order of the model.
    pub joints: Vec<f64>,
    /// Their rates \[rad/s\].
    pub rates: Vec<f64>,
    /// What the gyroscope reads \[rad/s\].
    pub angular_velocity: Vector3<f64>,
    /// What the accelerometer reads \[m/s²\].
    pub specific_force: Vector3<f64>,
}

/// A tick of the inverse kinematics.
pub struct Step {
    /// Where it starts.
    pub state: IkState,
    /// Where soles, hands, waist and centre of mass are in the tick after it, the right foot as the base.
    pub targets: IkTargets,
}

impl Walk {
    /// Of this robot.
    pub fn of(recording: &Recording, robot: usize) -> Self {
        let spec = &recording.run.robots[robot];
        let body =
            Robot::new(&spec.config, &spec.urdf).and_then(|body| body.with_hands(&spec.grasping_hands));
        let body = body.expect("it was run");
        let ik = body.whole_body_ik(recording.run.scenario.control_period_s).expect("it was run");
        let n = body.model.joint_count();
        let posture = |tick: &mikoshi_observation::Observation| {
            let sensors = &tick.sensors[robot].payload;
            Posture {
                base: Pose::from_array(&tick.robot_state[robot].payload.base_pose).expect("a pose"),
                joints: sensors.joint_position_rad[..n].to_vec(),
                rates: sensors.joint_velocity_rad_s[..n].to_vec(),
                angular_velocity: sensors.imu_angular_velocity_rad_s.into(),
                specific_force: sensors.imu_specific_force_m_s2.into(),
            }
        };
        let postures: Vec<_> = recording.walking().map(posture).collect();
        let commands: Vec<_> = recording
            .walking()
            .map(|tick| tick.joint_command[robot].payload.joint_position_ref_rad)
            .collect();
        let (mut kinematics, mut scratch) = (Kinematics::new(&body.model), IkScratch::new(&body.model));
        let steps = commands.windows(2).zip(&postures).filter_map(|(commands, posture)| {
            let state = IkState::at_rest(&commands[0][..n]);
            kinematics.update(&body.model, &posture.base, &commands[1][..n]);
            let targets = targets(&body, &kinematics);
            let report =
                ik.solve(&body.model, &mut state.clone(), &mut scratch, &targets).expect("it is finite");
            let is_free = report.at_position_limit | report.at_velocity_limit == 0;
            is_free.then_some(Step { state, targets })
        });
        let steps: Vec<_> = steps.collect();
        assert!(steps.len() > 100, "limits bound too many ticks");
        let links = body.model.frames().iter().map(|frame| body.model.find_frame(&frame.name));
        let links = links.collect::<Result<_, _>>().expect("names of its own");
        Self { ik, links, postures, steps, robot: body }
    }
}

fn targets(body: &Robot, kinematics: &Kinematics) -> IkTargets {
    let mut hands = [None; mikoshi_humanoid::model::MAX_HANDS];
    for (hand, &palm) in hands.iter_mut().zip(&body.palms) {
        *hand = Some(kinematics.frame_pose::<Hand>(&body.model, palm));
    }
    IkTargets {
        stance: Side::Right,
        feet: PerFoot::from_fn(|side| kinematics.frame_pose::<Foot>(&body.model, body.soles[side])),
        com: kinematics.com(),
        waist_attitude: kinematics.frame_pose::<Base>(&body.model, body.waist).rotation,
        hands,
    }
}
