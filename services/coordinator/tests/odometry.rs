//! Robots whose odometries part: the team finds out from the object that all hold, nobody's hand or foot moves
//! for it, and what is not drift is not taken for it.

#![allow(non_snake_case)]

mod common;

use assert_no_alloc::{AllocDisabler, assert_no_alloc};
use bytemuck::Zeroable;
use common::resolved;
use mikoshi_config::RunSpec;
use mikoshi_coordinator::{Coordinator, CoordinatorOutputs, CoordinatorScratch, CoordinatorState};
use mikoshi_ipc_types::{PoseWire, RobotState, all_hands, flag, mode};
use mikoshi_spatial::{Hand, Object, Odometry, Pose, Twist, World, Wrench, log};
use nalgebra::{UnitQuaternion, Vector3};

#[global_allocator]
static ALLOCATOR: AllocDisabler = AllocDisabler;

/// The hybrid law is at work by then.
const STARTED: u64 = 40;
/// By then what is apart has come together: ten time constants.
const SETTLED: u64 = STARTED + 8000;

/// Robots at rest around an object, each with a world of its own.
struct Team {
    run: RunSpec,
    coordinator: Coordinator,
    state: CoordinatorState,
    scratch: CoordinatorScratch,
    out: CoordinatorOutputs,
    tick: u64,
    /// Where each robot has the world of the team.
    X_OW: Vec<Pose<Odometry, World>>,
    /// What each hand applies, and how far that has brought it from its grip.
    wrench: Vec<Wrench<World>>,
    hand_off: Vec<Twist<World>>,
    walks: bool,
}

impl Team {
    fn holding(overrides: &[(&str, &str)]) -> Self {
        let run = resolved("hold", &[overrides, &[("hybrid.start_s", "0.1")]].concat());
        let coordinator = Coordinator::new(&run).expect("a coordinator");
        let hands = run.robots.iter().map(|robot| robot.grasping_hands.len()).sum();
        Self {
            state: coordinator.initial_state().expect("a state"),
            scratch: coordinator.scratch(),
            coordinator,
            out: CoordinatorOutputs::default(),
            tick: 0,
            X_OW: vec![Pose::identity(); run.robots.len()],
            wrench: vec![Wrench::zero(); hands],
            hand_off: vec![Twist::zero(); hands],
            walks: false,
            run,
        }
    }

    /// A team whose law has started, before anything drifts.
    fn started(overrides: &[(&str, &str)]) -> Self {
        Self { walks: true, ..Self::holding(overrides) }.start()
    }

    fn start(self) -> Self {
        let mut team = self;
        team.go_on_until(STARTED);
        assert_eq!(team.out.team_state.team_mode, mode::CARRY);
        team
    }

    /// Its second robot's world and its third's drift, against each other: the mean of all stays.
    fn with_drift(mut self) -> Self {
        let drift = Twist::new(Vector3::new(0.004, -0.002, 0.0), Vector3::new(0.0, 0.0, 0.003));
        self.X_OW[1] = Pose::identity().displaced(&drift);
        self.X_OW[2] = Pose::identity().displaced(&-drift);
        self
    }

    fn robots(&self) -> Vec<RobotState> {
        let X_WA = Pose::<World, Object>::new(
            self.run.scenario.object.position_m.into(),
            UnitQuaternion::identity(),
        );
        let mut hands = self.wrench.iter().zip(&self.hand_off);
        let state = |(robot, X_OW): (&mikoshi_config::RobotSpec, &Pose<Odometry, World>)| {
            let mut state = RobotState::zeroed();
            state.base_pose[3] = 1.0;
            (state.zmp_margin_m, state.speed_share) = (0.05, 1.0);
            state.holding_hands = all_hands(robot.hand_in_object.len());
            let wants_step = if self.walks { flag::WANTS_STEP } else { flag::CAN_STOP };
            state.flags = flag::READY_TO_STEP | wants_step;
            for (hand, X_AH) in robot.hand_in_object.iter().enumerate() {
                let (wrench, off) = hands.next().expect("all hands");
                let X_WH = (X_WA * Pose::<Object, Hand>::from_array(X_AH).expect("a pose")).displaced(off);
                state.hand_pose[hand] = (*X_OW * X_WH).to_array();
                state.hand_pose_commanded[hand] = state.hand_pose[hand];
                state.hand_wrench[hand] = wrench.expressed_in(X_OW).to_array();
            }
            state
        };
        self.run.robots.iter().zip(&self.X_OW).map(state).collect()
    }

    fn go_on_until(&mut self, tick: u64) {
        while self.tick < tick {
            let robots = self.robots();
            let Self { coordinator, state, scratch, out, .. } = self;
            assert_no_alloc(|| coordinator.tick(self.tick, state, scratch, robots.iter(), out))
                .expect("commands");
            self.tick += 1;
        }
    }

    /// Where a point is by each robot and the team's knowledge of its odometry, and how far that is turned.
    fn seen(&self, point: &Vector3<f64>) -> Vec<(Vector3<f64>, f64)> {
        let frames = self.out.team_state.odometry_pose.iter().zip(&self.X_OW);
        frames
            .map(|(X_WO, X_OW)| {
                let seen = Pose::<World, Odometry>::from_array(X_WO).expect("a pose") * *X_OW;
                (seen.transform_point(point), log(&seen.rotation).z)
            })
            .collect()
    }

    /// Largest distance and angle between what two robots see.
    fn apart(&self) -> (f64, f64) {
        let seen = self.seen(&self.run.scenario.object.position_m.into());
        let pairs = || seen.iter().flat_map(|one| seen.iter().map(move |other| (one, other)));
        let distance = pairs().map(|(one, other)| (one.0 - other.0).norm()).fold(0.0, f64::max);
        (distance, pairs().map(|(one, other)| (one.1 - other.1).abs()).fold(0.0, f64::max))
    }

    fn frames_rest(&self) -> bool {
        let moved = |pose: &PoseWire| {
            let at_start = Pose::<World, Odometry>::identity();
            let way = at_start.displacement_to(&Pose::from_array(pose).expect("a pose"));
            way.linear.norm().max(way.angular.norm())
        };
        self.out.team_state.odometry_pose.iter().all(|pose| moved(pose) < 1e-9)
    }

    /// What robots are told of their hands, in their own worlds.
    fn told(&self) -> Vec<f64> {
        let hands = self.out.commands.iter().flat_map(|command| command.hand_pose_ref.as_flattened());
        hands.copied().collect()
    }
}

#[test]
fn worlds_that_have_drifted_apart_are_brought_together_and_the_object_stays() {
    let mut team = Team::started(&[]).with_drift();
    let (distance, angle) = (team.apart(), team.out.team_state.object_pose);
    assert!(distance.0 > 0.008 && distance.1 > 0.0059, "{distance:?}");
    team.go_on_until(SETTLED);
    let (distance, turned) = team.apart();
    assert!(distance < 1e-5 && turned < 1e-5, "{distance} m and {turned} rad are left");
    let object = team.out.team_state.object_pose.iter().zip(&angle);
    assert!(object.into_iter().all(|(now, before)| (now - before).abs() < 1e-5));
}

#[test]
fn a_correction_moves_nobodys_hand() {
    let mut team = Team::started(&[]).with_drift();
    let told = team.told();
    let mut last = told.clone();
    while team.tick < SETTLED {
        team.go_on_until(team.tick + 1);
        let now = team.told();
        let step = now.iter().zip(&last).map(|(now, last)| (now - last).abs()).fold(0.0, f64::max);
        assert!(step < 1e-8, "tick {}: {step}", team.tick);
        last = now;
    }
    let way = last.iter().zip(&told).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
    // The frames have moved by 4 mm and 3 mrad.
    assert!(way < 2e-5, "{way}");
}

#[test]
fn worlds_whose_heights_have_parted_are_brought_together_before_a_hand_seems_to_slip() {
    let mut team = Team::started(&[]);
    let object = team.out.team_state.object_pose;
    // By .8 mm with each step of .8 s, further than any grip may seem to part.
    let (step_ticks, step_m, steps) = (160, 0.0008, 25);
    let mut slip = 0.0_f64;
    for _ in 0..steps {
        for (robot, sign) in [(1, 1.0), (2, -1.0)] {
            team.X_OW[robot].translation.z += sign * step_m;
        }
        team.go_on_until(team.tick + step_ticks);
        slip = team.out.team_state.hand_slip.iter().copied().fold(slip, f64::max);
    }
    assert_eq!(team.out.team_state.stop_cause, 0, "with a slip of {slip}");
    assert!(slip < 0.5, "{slip}");
    let (distance, _) = team.apart();
    assert!(distance < 0.006, "{distance} m of {} m are left", 2.0 * step_m * f64::from(steps));
    assert!((team.out.team_state.object_pose[2] - object[2]).abs() < 1e-5);
}

#[test]
fn what_a_robot_is_told_of_the_way_is_in_its_own_world() {
    let mut team = Team::started(&[]).with_drift();
    team.go_on_until(SETTLED);
    let robots = team.out.team_state.odometry_pose.iter().zip(&team.out.commands).zip(&team.X_OW);
    let x =
        |((X_WO, command), X_OW): ((&PoseWire, &mikoshi_ipc_types::TeamCommand), &Pose<Odometry, World>)| {
            let X_WO = Pose::<World, Odometry>::from_array(X_WO).expect("a pose");
            let X_OH = Pose::<Odometry, Hand>::from_array(&command.hand_pose_ref[0]).expect("a pose");
            // As the team has it, and as it truly is.
            ((X_WO * X_OH).translation - (X_OW.inverse() * X_OH).translation).norm()
        };
    let off: Vec<_> = robots.map(x).collect();
    assert!(off.iter().all(|off| *off < 1e-4), "{off:?}");
}

#[test]
fn hands_that_strain_their_grips_have_not_drifted() {
    let stiffness = [("hybrid.grasp_stiffness_n_m", "20000"), ("hybrid.grasp_stiffness_nm_rad", "500")];
    let mut team = Team::started(&stiffness);
    // The second robot pulls with both hands, and the third as much against it: 2 mm and 8 mrad.
    let pull = Wrench::new(Vector3::new(40.0, -10.0, 5.0), Vector3::new(0.0, 1.0, 4.0));
    for (hands, sign) in [(2..4, 1.0), (4..6, -1.0)] {
        for hand in hands {
            team.wrench[hand] = pull * sign;
            team.hand_off[hand] = Twist::new(pull.force * (sign / 20_000.0), pull.moment * (sign / 500.0));
        }
    }
    // Their references may give way; it is the frames that count.
    team.go_on_until(SETTLED);
    let frames = team.out.team_state.odometry_pose;
    let furthest = frames.iter().map(|[x, y, ..]| x.hypot(*y)).fold(0.0, f64::max);
    let turned = frames.iter().map(|pose| 2.0 * pose[6].abs()).fold(0.0, f64::max);
    // But for the first tenth of a second, in which wrenches are filtered.
    assert!(furthest < 1e-4 && turned < 1e-4, "{furthest} m, {turned} rad");

    let mut rigid =
        Team::started(&[("hybrid.grasp_stiffness_n_m", ""), ("hybrid.grasp_stiffness_nm_rad", "")]);
    (rigid.wrench, rigid.hand_off) = (team.wrench.clone(), team.hand_off.clone());
    rigid.go_on_until(SETTLED);
    assert!(!rigid.frames_rest(), "of grips that are taken for rigid it would be drift");
}

#[test]
fn worlds_rest_while_the_team_stands_or_hands_are_asked_to_part_or_nobody_wants_it() {
    let mut standing = Team::holding(&[]).start().with_drift();
    standing.go_on_until(SETTLED);
    assert!(standing.frames_rest());

    let axes = r#"[{row = "AB|CD", axis = "x", control = "position"}]"#;
    for overrides in [("hybrid.axes", axes), ("odometry.landmark", "false")] {
        let mut team = Team::started(&[overrides]).with_drift();
        team.go_on_until(SETTLED);
        assert!(team.frames_rest(), "{overrides:?}");
    }
}

#[test]
fn nothing_survives_in_scratch_and_what_was_done_is_done_again() {
    let (mut one, mut other) = (Team::started(&[]).with_drift(), Team::started(&[]).with_drift());
    while one.tick < STARTED + 400 {
        let tick = one.tick + 1;
        one.go_on_until(tick);
        other.scratch.poison();
        other.go_on_until(tick);
        assert_eq!(bytemuck::bytes_of(&one.state), bytemuck::bytes_of(&other.state), "tick {tick}");
        assert_eq!(one.out, other.out);
    }
    assert!(!one.frames_rest());
}
