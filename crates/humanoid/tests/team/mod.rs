//! A team whose robots are ideal: hands follow the object, feet and centre of mass their references,
//! and the ground is flat.

#![allow(dead_code)] // each test file uses its own share

use mikoshi_humanoid::balance::{ExternalLoad, PerFoot, Side};
use mikoshi_humanoid::estimate::SoleRectangle;
use mikoshi_humanoid::gait::{
    FootError, FootPlacement, Gait, GaitConfig, GaitInputs, GaitReference, GaitState, GroundPose, HandCentre,
    StepClock, StepWish, SwingConfig, TeamClock,
};
use mikoshi_spatial::{Hand, Pose, Twist, World};
use nalgebra::{UnitQuaternion, Vector2, Vector3};

/// HRP-2's soles.
pub fn soles() -> PerFoot<SoleRectangle> {
    PerFoot {
        right: SoleRectangle { x_min: -0.1056, x_max: 0.1356, y_min: -0.079, y_max: 0.059 },
        left: SoleRectangle { x_min: -0.1056, x_max: 0.1356, y_min: -0.059, y_max: 0.079 },
    }
}

/// The gait of robots whose legs don't yield, on ground that isn't pressed in: feet come down to the plane.
pub fn on_rigid_ground() -> GaitConfig {
    let standard = GaitConfig::standard(soles());
    let swing =
        SwingConfig { touchdown_m: 0.0, plane_tolerance_m: 0.0, lowering_m_s: 0.05, ..standard.swing };
    GaitConfig { swing, ..standard }
}

#[derive(Clone)]
pub struct Robot {
    pub gait: Gait,
    pub state: GaitState,
    pub hands_at_start: [Pose<World, Hand>; 2],
    pub centre: HandCentre,
    /// Where the ground lies \[m\]: early contact above zero, late below.
    pub ground_height: f64,
}

impl Robot {
    pub fn standing_at(place: GroundPose, config: GaitConfig) -> Self {
        let gait = Gait::new(config).expect("the standard configuration is solvable");
        let feet = PerFoot::from_fn(|side| place.then(&GroundPose::new(0.0, 0.085 * side.sign(), 0.0)));
        let com = place.point(&((config.zmp_in_foot.right + config.zmp_in_foot.left) / 2.0));
        let mut state = gait.standing(feet, com);
        let hands_at_start = [-0.25, 0.25].map(|y| {
            place.at_height::<World>(0.96)
                * Pose::<World, Hand>::new(Vector3::new(0.35, y, 0.0), UnitQuaternion::identity())
        });
        state.placement = FootPlacement::record(&hands_at_start, &feet);
        let centre = state
            .placement
            .and_then(|placement| placement.centre(&hands_at_start.map(|hand| (hand, Twist::zero()))));
        Self { gait, state, hands_at_start, centre: centre.expect("two hands"), ground_height: 0.0 }
    }

    /// Zero moment point of the reference motion \[m\].
    pub fn zmp(&self) -> Vector2<f64> {
        let preview = &self.state.preview;
        preview.com - preview.com_acceleration * (self.gait.config().preview.com_height_m / 9.81)
    }

    /// Error of a foot (eq. 40) against its reference now.
    pub fn foot_error(&self, side: Side) -> FootError {
        let placement = self.state.placement.expect("there is a grasp");
        FootError::between(&placement.reference_feet(&self.centre.pose)[side], &self.state.feet[side].pose)
    }

    pub fn wish(&self) -> StepWish {
        self.gait.wish(&self.state, Some(&self.centre))
    }

    /// The hands follow the object's motion since the start.
    pub fn move_hands(&mut self, by: &Pose<World, World>, velocity: impl Fn(&Vector3<f64>) -> Twist<World>) {
        let hands = self.hands_at_start.map(|hand| {
            let pose = *by * hand;
            (pose, velocity(&pose.translation))
        });
        let placement = self.state.placement.expect("there is a grasp");
        self.centre = placement.centre(&hands).expect("two hands");
    }

    pub fn act(&mut self, clock: StepClock) -> GaitReference {
        self.act_under(clock, ExternalLoad::NONE)
    }

    pub fn act_under(&mut self, clock: StepClock, load: ExternalLoad) -> GaitReference {
        self.act_where(clock, load, None)
    }

    /// With soles felt this far from where they are meant to be.
    pub fn act_where(
        &mut self,
        clock: StepClock,
        load: ExternalLoad,
        off: Option<Vector2<f64>>,
    ) -> GaitReference {
        let reference = self.gait.reference(&self.state);
        let foot_force = PerFoot::from_fn(|side| {
            if reference.feet[side].pose.translation.z <= self.ground_height + 1e-6 { 275.0 } else { 0.0 }
        });
        let soles = off.map(|off| {
            PerFoot::from_fn(|side| {
                let meant = GroundPose::of(&reference.feet[side].pose);
                GroundPose { position: meant.position + off, ..meant }
            })
        });
        let inputs = GaitInputs {
            clock,
            hand_centre: Some(self.centre),
            foot_force,
            soles,
            sole_heights: None,
            load,
            divergent_component: None,
            soles_turn: PerFoot { right: false, left: false },
        };
        self.gait.act(&mut self.state, &inputs)
    }
}

/// Distance of a point from the edge of one sole \[m\], negative outside (by the worst edge).
pub fn sole_margin(side: Side, foot: &GroundPose, point: Vector2<f64>) -> f64 {
    let p = foot.inverse().point(&point);
    let y = -p.y * side.sign();
    (p.x + 0.1056).min(0.1356 - p.x).min(y + 0.079).min(0.059 - y)
}

pub struct Team {
    pub robots: Vec<Robot>,
    pub clock: TeamClock,
    pub object: GroundPose,
    pub steps: u64,
    pub walks: u64,
    /// Ticks that a lift-off has waited for, in all.
    pub waited: u64,
}

impl Team {
    /// Four robots, two on either side of an object, facing it; those that face back are mirrored.
    pub fn around_an_object(config: GaitConfig) -> Self {
        let places = [(-0.7, -0.45), (-0.7, 0.45), (0.7, -0.45), (0.7, 0.45)];
        let robots = places
            .map(|(x, y)| {
                let faces_back = x > 0.0;
                let yaw = if faces_back { core::f64::consts::PI } else { 0.0 };
                Robot::standing_at(GroundPose::new(x, y, yaw), GaitConfig { mirrored: faces_back, ..config })
            })
            .into();
        Self {
            robots,
            clock: TeamClock::default(),
            object: GroundPose::default(),
            steps: 0,
            walks: 0,
            waited: 0,
        }
    }

    /// The object moves at `velocity` (x, y, yaw); then all robots act on the team's common clock.
    pub fn tick(&mut self, velocity: Vector3<f64>) {
        const DT: f64 = 0.005;
        self.object = GroundPose::new(
            self.object.position.x + velocity.x * DT,
            self.object.position.y + velocity.y * DT,
            self.object.yaw + velocity.z * DT,
        );
        let by = self.object.at_height(0.0);
        let origin = self.object.position;
        for robot in &mut self.robots {
            robot.move_hands(&by, |point| {
                let arm = point.xy() - origin;
                let linear =
                    Vector3::new(velocity.x - velocity.z * arm.y, velocity.y + velocity.z * arm.x, 0.0);
                Twist::new(linear, Vector3::new(0.0, 0.0, velocity.z))
            });
        }
        let wishes: Vec<StepWish> = self.robots.iter().map(Robot::wish).collect();
        let timing = self.robots[0].gait.config().timing;
        self.clock = self.clock.advance(&timing, &wishes, true);
        if let StepClock::Stepping { tick_in_step: 0, step_index, .. } = self.clock.clock {
            self.steps += 1;
            self.walks += u64::from(step_index == 0);
        }
        self.waited += u64::from(self.clock.waited > 0);
        for robot in &mut self.robots {
            robot.act(self.clock.clock);
        }
    }
}
