//! Hands that lose the object, when the scenario says so. What they do from then on is a function of the tick: nothing of
//! it is remembered.

use crate::layout::{HandLayout, Layout};
use crate::pose::{site_pose, site_twist};
use mikoshi_config::RunSpec;
use mikoshi_config::scenario::{GraspFailure, GraspFailureKind};
use mikoshi_spatial::{Hand, World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel};
use nalgebra::Vector3;

/// All of a run.
#[derive(Clone, Debug, Default)]
pub struct GraspFailures(Vec<Failure>);

#[derive(Clone, Copy, Debug)]
struct Failure {
    robot: usize,
    hand: usize,
    from_tick: u64,
    lost: LostGrip,
    is_noticed: bool,
}

/// A hand that has lost its grip.
#[derive(Clone, Copy, Debug)]
pub struct LostGrip {
    /// What it still passes on; nothing where it is open.
    friction_n: f64,
}

impl GraspFailures {
    /// Those of the scenario. Its robots and hands were found to be there when it was read.
    pub fn of(run: &RunSpec) -> Self {
        let find = |failure: &GraspFailure| {
            let is_it = |robot: &mikoshi_config::RobotSpec| robot.member.name == failure.robot;
            let robot = run.robots.iter().position(is_it)?;
            let spec = &run.robots[robot];
            let is_hand = |hand: &usize| spec.config.hands[*hand].name == failure.hand;
            let friction_n = match failure.kind {
                GraspFailureKind::Open => 0.0,
                GraspFailureKind::Slip => failure.friction_n,
            };
            Some(Failure {
                robot,
                hand: spec.grasping_hands.iter().position(is_hand)?,
                from_tick: run.scenario.tick_at(failure.at_s),
                lost: LostGrip { friction_n },
                is_noticed: failure.is_noticed,
            })
        };
        Self(run.scenario.world.grasp_failures.iter().filter_map(find).collect())
    }

    /// Whether some hand has lost its grip by then.
    pub fn have_begun(&self, tick: u64) -> bool {
        self.active(tick).next().is_some()
    }

    /// What has become of a hand's grip, if it is lost by then.
    pub fn of_hand(&self, tick: u64, robot: usize, hand: usize) -> Option<LostGrip> {
        let mut active = self.active(tick);
        active.find(|failure| (failure.robot, failure.hand) == (robot, hand)).map(|failure| failure.lost)
    }

    /// Undoes the welds of hands that have lost their grip. They count as holding as long as they are told to hold,
    /// unless their grippers notice.
    pub fn undo(&self, tick: u64, data: &mut MjData<Box<MjModel>>, layout: &Layout, holding: &mut [u64]) {
        for failure in self.active(tick) {
            if let Some(equality) = layout.robots[failure.robot].hands[failure.hand].equality {
                data.eq_active_mut()[equality] = false;
            }
            if failure.is_noticed {
                holding[failure.robot] &= !(1 << failure.hand);
            }
        }
    }

    fn active(&self, tick: u64) -> impl Iterator<Item = &Failure> {
        self.0.iter().filter(move |failure| tick >= failure.from_tick)
    }
}

impl LostGrip {
    /// The wrench on the object at the palm's origin, in world axes: friction at a patch of radius r against sliding
    /// at v and turning at ω, `f = F v / max(|v|, v₀)`, `n = r F ω / max(|ω|, ω₀)`.
    pub fn wrench_on_object(&self, data: &MjData<Box<MjModel>>, hand: &HandLayout) -> Wrench<World> {
        let gap = site_pose::<Hand>(data, hand.object_site)
            .displacement_to(&site_pose::<Hand>(data, hand.palm_site));
        let sliding =
            site_twist(data, hand.palm_site) - site_twist(data, hand.object_site).shifted(&gap.linear);
        let along = |rate: Vector3<f64>, all_at: f64| rate / rate.norm().max(all_at);
        Wrench::new(
            along(sliding.linear, GraspFailure::SLIDING_M_S) * self.friction_n,
            along(sliding.angular, GraspFailure::TURNING_RAD_S) * (GraspFailure::PATCH_M * self.friction_n),
        )
    }
}
