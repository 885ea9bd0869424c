//! What touches what, and how hard.

use crate::articulation::{Articulation, tag};
use crate::convert::from_vector;
use mikoshi_ipc_types::MAX_FEET;
use mikoshi_spatial::{World, Wrench};
use nalgebra::Vector3;
use rapier3d_f64::prelude::*;
use std::collections::HashSet;

/// What colliders that are no robot's say of themselves.
pub const FLOOR: u128 = 0;
pub const OBJECT: u128 = 1;
pub const FIXED_BOX: u128 = 2;

/// Pairs that don't touch: neighbours in a robot (no colliding link lies between them), a grasping hand with the object.
pub struct Exclusions(HashSet<[u128; 2]>);

impl Exclusions {
    pub fn of(robots: &[&Articulation]) -> Self {
        let mut pairs = HashSet::new();
        for (index, robot) in robots.iter().enumerate() {
            let bodies = robot.body.model.bodies();
            let collides = |link: &usize| !bodies[*link].collisions.is_empty();
            for link in (0..bodies.len()).filter(collides) {
                let ancestors = std::iter::successors(bodies[link].parent, |&up| bodies[up].parent);
                if let Some(neighbour) = ancestors.into_iter().find(collides) {
                    pairs.insert(sorted(tag(index, link), tag(index, neighbour)));
                }
            }
            for palm in &robot.body.palms {
                pairs.insert(sorted(OBJECT, tag(index, robot.body.model.frame(*palm).body)));
            }
        }
        Self(pairs)
    }
}

fn sorted(a: u128, b: u128) -> [u128; 2] {
    [a.min(b), a.max(b)]
}

impl PhysicsHooks for Exclusions {
    fn filter_contact_pair(&self, context: &PairFilterContext) -> Option<SolverFlags> {
        let of =
            |handle| context.colliders.get(handle).map_or(FLOOR, |collider: &Collider| collider.user_data);
        let pair = sorted(of(context.collider1), of(context.collider2));
        (!self.0.contains(&pair)).then(SolverFlags::default)
    }
}

/// Sums over the physics steps of one tick, of what touches a robot.
#[derive(Clone, Default)]
pub struct Touched {
    /// Wrench of the ground on each foot about the world's origin, in the last step and in all.
    pub ground: [Wrench<World>; MAX_FEET],
    pub ground_sum: [Wrench<World>; MAX_FEET],
    pub is_on_the_floor: bool,
}

/// What touches the object, and what nobody meant to touch.
#[derive(Clone, Default)]
pub struct Touching {
    pub support_sum: Wrench<World>,
    pub unintended: u64,
    pub pair: [u64; 2],
}

/// After a step: sorts all contacts. `feet` are the links that carry each robot's soles.
pub fn sort(
    world: &PhysicsWorld,
    feet: &[[usize; MAX_FEET]],
    object_m: Vector3<f64>,
    robots: &mut [Touched],
    touching: &mut Touching,
) {
    robots.iter_mut().for_each(|robot| robot.ground = Default::default());
    let mut unintended = 0;
    for pair in world.contact_pairs() {
        let colliders = [pair.collider1, pair.collider2].map(|handle| world.colliders.get(handle));
        let [Some(first), Some(second)] = colliders else { continue };
        let Some(on_second) = wrench_on_second(pair, second, world.integration_parameters.dt) else {
            continue;
        };
        let tags = [first.user_data, second.user_data];
        let (other, wrench) = if tags[0] <= FIXED_BOX { (tags[1], on_second) } else { (tags[0], -on_second) };
        match sorted(tags[0], tags[1])[0] {
            FLOOR if other > FIXED_BOX => {
                let (robot, link) = ((other >> 32) as usize - 1, other as u32 as usize);
                match feet[robot].iter().position(|foot| *foot == link) {
                    Some(foot) => {
                        robots[robot].ground[foot] += wrench;
                        continue;
                    }
                    None => robots[robot].is_on_the_floor = true,
                }
            }
            OBJECT if other == FIXED_BOX || tags == [OBJECT, FIXED_BOX] || tags == [FIXED_BOX, OBJECT] => {
                let on_object = if tags[1] == OBJECT { on_second } else { -on_second };
                touching.support_sum += on_object.shifted(&-object_m);
                continue;
            }
            _ => {}
        }
        unintended += 1;
        if touching.pair == [0; 2] {
            touching.pair =
                [pair.collider1, pair.collider2].map(|handle| handle.into_raw_parts().0 as u64 + 1);
        }
    }
    touching.unintended = touching.unintended.max(unintended);
    for robot in robots {
        for (sum, now) in robot.ground_sum.iter_mut().zip(&robot.ground) {
            *sum += *now;
        }
    }
}

/// What the first collider does to the second, about the world's origin; none if they don't push.
fn wrench_on_second(pair: &ContactPair, second: &Collider, step_s: f64) -> Option<Wrench<World>> {
    let PairContacts::Rigid(contacts) = &pair.contacts else { return None };
    let mut sum = Wrench::zero();
    let mut pushes = false;
    for manifold in &contacts.manifolds {
        let normal = from_vector(manifold.data.normal);
        for point in manifold.points.iter().filter(|point| point.data.impulse != 0.0) {
            pushes = true;
            // The normal points from the first to the second; friction is given as it acts on the first.
            let impulse = normal * point.data.impulse - from_vector(point.data.warmstart_tangent_world);
            let at = from_vector(second.position().transform_point(point.local_p2));
            sum += Wrench::new(impulse / step_s, Vector3::zeros()).shifted(&at);
        }
    }
    pushes.then_some(sum)
}
