//! What the figures show of a run: its true course, tick by tick.

use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{MAX_FEET, RobotTruth, mode};
use mikoshi_observation::{FootTracker, ObjectTracker, Observation, ObservedRun, is_loaded};
use mikoshi_spatial::{Foot, Object, Pose, World, Wrench};
use nalgebra::{Rotation2, Vector2, Vector3};

/// A run's course, to be gathered from its observations.
#[derive(Clone, Debug)]
pub struct RunData {
    /// Name and seed of the scenario.
    pub(crate) scenario: String,
    pub(crate) seed: u64,
    pub(crate) period_s: f64,
    is_controlled: bool,
    /// When the hybrid law started, once it has.
    pub(crate) hybrid_start_s: Option<f64>,
    /// When each tick began.
    pub(crate) time_s: Vec<f64>,
    pub(crate) object: ObjectCourse,
    /// Each internal force.
    pub(crate) internal: Vec<InternalCourse>,
    pub(crate) robots: Vec<RobotCourse>,
    tracker: ObjectTracker,
}

/// The object. Σa is the frame on it that control follows.
#[derive(Clone, Debug, Default)]
pub struct ObjectCourse {
    pub X_WBody: Vec<Pose<World, Object>>,
    pub X_WA_ref: Vec<Option<Pose<World, Object>>>,
    /// Σa in the object's body, once it is known.
    pub X_BodyA: Option<Pose<Object, Object>>,
    pub size_m: [f64; 3],
}

/// One internal force, in the object's axes.
#[derive(Clone, Debug)]
pub struct InternalCourse {
    pub name: String,
    pub actual: Vec<Wrench<Object>>,
    /// What it is asked to be, while it is.
    pub reference: Vec<Option<Wrench<Object>>>,
}

/// One robot.
#[derive(Clone, Debug)]
pub struct RobotCourse {
    pub name: String,
    /// Zero moment point ahead of and to the left of where the robot started.
    pub zmp_m: Vec<[f64; 2]>,
    /// How far the soles that bear reach in the same directions; not finite while none bears.
    pub support_m: Vec<[(f64, f64); 2]>,
    pub com_m: Vec<[f64; 2]>,
    pub stances: Vec<Stance>,
    start: Vector2<f64>,
    heading: Rotation2<f64>,
    weight_n: f64,
    /// Corners of each sole in its own frame.
    soles: Vec<[Vector3<f64>; 4]>,
    feet: [FootTracker; MAX_FEET],
}

/// A foot on the ground.
#[derive(Clone, Debug)]
pub struct Stance {
    /// Tick in which it was set down.
    pub tick: usize,
    pub foot: usize,
    /// Whether the run began with it, or nearly so: no step led there.
    pub is_first: bool,
    /// Its corners in the world as it was set down.
    pub corners_m: Vec<(f64, f64)>,
}

impl RunData {
    /// Nothing observed yet.
    pub fn new(run: &RunSpec, observed: &ObservedRun) -> Self {
        let scenario = &run.scenario;
        let internal = observed.internal_rows.iter().map(|(name, _)| InternalCourse {
            name: name.clone(),
            actual: vec![],
            reference: vec![],
        });
        let robots = run.robots.iter().zip(&observed.robots).map(|(robot, observed)| {
            let member = &robot.member;
            let corners = |&[x_min, x_max, y_min, y_max]: &[f64; 4]| {
                [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
                    .map(|(x, y)| Vector3::new(x, y, 0.0))
            };
            RobotCourse {
                name: member.name.clone(),
                zmp_m: vec![],
                support_m: vec![],
                com_m: vec![],
                stances: vec![],
                start: Vector2::new(member.x_m, member.y_m),
                heading: Rotation2::new(member.yaw_deg.to_radians()),
                weight_n: observed.weight_n(),
                soles: robot.config.feet.iter().map(|foot| corners(&foot.sole_m)).collect(),
                feet: [FootTracker::default(); MAX_FEET],
            }
        });
        Self {
            scenario: scenario.name.clone(),
            seed: scenario.seed,
            period_s: scenario.control_period_s,
            is_controlled: observed.is_controlled,
            hybrid_start_s: None,
            time_s: vec![],
            object: ObjectCourse { size_m: scenario.object.size_m, ..ObjectCourse::default() },
            internal: internal.collect(),
            robots: robots.collect(),
            tracker: ObjectTracker::new(observed),
        }
    }

    /// Its scenario and seed.
    pub(crate) fn title(&self) -> String {
        format!("{}, seed {}", self.scenario, self.seed)
    }

    /// Whether hybrid control is to start.
    pub(crate) fn is_controlled(&self) -> bool {
        self.is_controlled
    }

    /// When the last tick ended.
    pub(crate) fn end_s(&self) -> f64 {
        self.time_s.len() as f64 * self.period_s
    }

    /// Takes in one tick. Ticks come in order.
    pub fn observe(&mut self, observation: &Observation) {
        let Some(object) = self.tracker.observe(observation) else {
            return;
        };
        let tick = self.time_s.len();
        let time_s = observation.tick() as f64 * self.period_s;
        self.time_s.push(time_s);
        if mode::is_hybrid(observation.team_state.payload.team_mode) {
            self.hybrid_start_s.get_or_insert(time_s);
        }
        self.object.X_WBody.push(object.X_WBody);
        // Where nothing is controlled there is nothing to follow.
        let X_WA_ref = object.X_WA_ref.filter(|_| self.is_controlled());
        self.object.X_WA_ref.push(X_WA_ref);
        self.object.X_BodyA = self.tracker.X_BodyA().copied();
        let team_state = &observation.team_state.payload;
        for (row, (course, actual)) in self.internal.iter_mut().zip(object.internal).enumerate() {
            course.actual.push(actual);
            let reference = team_state.generalized_force_ref.get(row + 1).filter(|_| X_WA_ref.is_some());
            course.reference.push(reference.map(Wrench::from_array));
        }
        for (robot, truth) in self.robots.iter_mut().zip(&observation.robot_truth) {
            robot.observe(tick, &truth.payload);
        }
    }
}

impl RobotCourse {
    fn observe(&mut self, tick: usize, truth: &RobotTruth) {
        self.zmp_m.push(self.seen_from_start(Vector2::from(truth.zmp_position_m)).into());
        self.com_m.push([truth.com_position_m[0], truth.com_position_m[1]]);
        let mut support = [(f64::INFINITY, f64::NEG_INFINITY); 2];
        for foot in 0..self.soles.len().min(MAX_FEET) {
            let was_down = self.feet[foot].is_down();
            self.feet[foot].observe(truth, foot, self.weight_n);
            if !is_loaded(truth, foot, self.weight_n) {
                continue;
            }
            let Some(X_WF) = Pose::<World, Foot>::from_array(&truth.sole_pose[foot]) else { continue };
            let corners = self.soles[foot].map(|corner| X_WF.transform_point(&corner).xy());
            for corner in corners.map(|corner| self.seen_from_start(corner)) {
                for (reach, value) in support.iter_mut().zip(corner.iter()) {
                    *reach = (reach.0.min(*value), reach.1.max(*value));
                }
            }
            if !was_down {
                let corners_m = corners.map(|corner| (corner.x, corner.y)).to_vec();
                let is_first = self.stances.iter().all(|stance| stance.foot != foot);
                self.stances.push(Stance { tick, foot, is_first, corners_m });
            }
        }
        self.support_m.push(support);
    }

    /// Between its soles, where it started.
    pub fn start_m(&self) -> (f64, f64) {
        (self.start.x, self.start.y)
    }

    /// A point of the ground, ahead of and to the left of where the robot started.
    fn seen_from_start(&self, point: Vector2<f64>) -> Vector2<f64> {
        self.heading.inverse() * (point - self.start)
    }
}

impl ObjectCourse {
    /// Σa at a tick, by where it lies in the body.
    pub fn X_WA(&self, tick: usize) -> Pose<World, Object> {
        self.X_WBody[tick] * self.X_BodyA.unwrap_or_else(Pose::identity)
    }

    /// The outline of the body from above.
    pub fn outline(&self, tick: usize) -> Vec<(f64, f64)> {
        let [x, y, _] = self.size_m.map(|edge| 0.5 * edge);
        let corner = |(x, y): (f64, f64)| {
            let p_W = self.X_WBody[tick].transform_point(&Vector3::new(x, y, 0.0));
            (p_W.x, p_W.y)
        };
        [(x, y), (-x, y), (-x, -y), (x, -y)].map(corner).to_vec()
    }
}
