//! What is summed up over the physics steps of one tick, for one robot.

use crate::layout::{GeomOwner, Layout, RobotLayout};
use crate::pose::body_pose;
use mikoshi_ipc_types::{MAX_FEET, MAX_JOINTS};
use mikoshi_spatial::{Object, World, Wrench};
use mujoco_rs::prelude::{MjData, MjModel};
use mujoco_rs::wrappers::mj_auxiliary::MjContact;
use nalgebra::{Matrix3, Vector3};

/// Sums over the physics steps of one tick.
#[derive(Clone, Debug)]
pub struct Tally {
    steps: u32,
    torque_sum_nm: [f64; MAX_JOINTS],
    ground_sum: [Wrench<World>; MAX_FEET],
    /// Largest torque that each drive asked for, before its limit.
    pub torque_peak_nm: [f64; MAX_JOINTS],
    /// Bit j: drive j stood at its limit.
    pub saturated_joints: u64,
    /// Something else than a foot touched the floor.
    pub is_on_the_floor: bool,
}

impl Tally {
    /// Of no step.
    pub fn empty() -> Self {
        Self {
            steps: 0,
            torque_sum_nm: [0.0; MAX_JOINTS],
            ground_sum: [Wrench::zero(); MAX_FEET],
            torque_peak_nm: [0.0; MAX_JOINTS],
            saturated_joints: 0,
            is_on_the_floor: false,
        }
    }

    /// Torque that a drive applied, averaged over the steps.
    pub fn mean_torque_nm(&self, joint: usize) -> f64 {
        self.torque_sum_nm[joint] / f64::from(self.steps.max(1))
    }

    /// Wrench of the ground on a foot about the world's origin, averaged over the steps.
    pub fn mean_ground_wrench(&self, foot: usize) -> Wrench<World> {
        self.ground_sum[foot] * (1.0 / f64::from(self.steps.max(1)))
    }

    /// Before a step: what the drives ask for, kp (ctrl − q) − kv q̇.
    pub fn count_demands(&mut self, data: &MjData<Box<MjModel>>, layout: &RobotLayout) {
        let (ctrl, qpos, qvel) = (data.ctrl(), data.qpos(), data.qvel());
        for (index, joint) in layout.joints.iter().enumerate() {
            let demand_nm =
                (joint.kp * (ctrl[joint.actuator] - qpos[joint.qpos]) - joint.kv * qvel[joint.dof]).abs();
            self.torque_peak_nm[index] = self.torque_peak_nm[index].max(demand_nm);
            self.saturated_joints |= u64::from(demand_nm >= joint.effort) << index;
        }
    }

    /// After a step: what the drives applied.
    pub fn count_torques(&mut self, data: &MjData<Box<MjModel>>, layout: &RobotLayout) {
        self.steps += 1;
        let applied = data.actuator_force();
        for (sum_nm, joint) in self.torque_sum_nm.iter_mut().zip(&layout.joints) {
            *sum_nm += applied[joint.actuator];
        }
    }
}

/// What touched the object, and what nobody meant to touch, over the physics steps of one tick.
#[derive(Clone, Copy, Debug, Default)]
pub struct Contacts {
    steps: u32,
    support_sum: Wrench<World>,
    /// Unintended contacts: all but those of a foot with the floor and of the object with a fixed box. The
    /// largest number at once.
    pub unintended: u64,
    /// Geoms of the first unintended one, plus one.
    pub unintended_pair: [u64; 2],
}

impl Contacts {
    /// Wrench of the fixed boxes on the object at its origin, averaged over the steps.
    pub fn mean_support_wrench(&self) -> Wrench<World> {
        self.support_sum * (1.0 / f64::from(self.steps.max(1)))
    }
}

/// After a step, while its forces and contacts still stand: sorts all contacts.
pub fn count_contacts(
    data: &MjData<Box<MjModel>>,
    layout: &Layout,
    tallies: &mut [Tally],
    contacts: &mut Contacts,
) {
    contacts.steps += 1;
    let mut unintended = 0;
    for (index, contact) in data.contact().iter().enumerate() {
        // Contacts within reach that don't push.
        if contact.efc_address < 0 {
            continue;
        }
        let geoms = [contact.geom1, contact.geom2].map(|geom| geom as usize);
        let owners = geoms.map(|geom| layout.geoms[geom]);
        // Of two geoms MuJoCo names a plane first.
        match owners {
            [GeomOwner::Floor, GeomOwner::Foot { robot, foot }] => {
                tallies[robot].ground_sum[foot] +=
                    contact_wrench(data, index, contact).shifted(&Vector3::from(contact.pos));
                continue;
            }
            // Slabs of the ground are boxes like soles, of which either may come first.
            [GeomOwner::Foot { robot, foot }, GeomOwner::Floor] => {
                tallies[robot].ground_sum[foot] +=
                    -contact_wrench(data, index, contact).shifted(&Vector3::from(contact.pos));
                continue;
            }
            [GeomOwner::FixedBox, GeomOwner::Object] | [GeomOwner::Object, GeomOwner::FixedBox] => {
                let on_second = contact_wrench(data, index, contact);
                let on_object = if owners[1] == GeomOwner::Object { on_second } else { -on_second };
                let origin = body_pose::<Object>(data, &layout.object).translation;
                contacts.support_sum += on_object.shifted(&(Vector3::from(contact.pos) - origin));
                continue;
            }
            [GeomOwner::Floor, GeomOwner::Part { robot }] | [GeomOwner::Part { robot }, GeomOwner::Floor] => {
                tallies[robot].is_on_the_floor = true
            }
            _ => {}
        }
        unintended += 1;
        if contacts.unintended_pair == [0; 2] {
            contacts.unintended_pair = geoms.map(|geom| geom as u64 + 1);
        }
    }
    contacts.unintended = contacts.unintended.max(unintended);
}

/// What a contact's first geom does to the second, at the contact's point in world axes.
fn contact_wrench(data: &MjData<Box<MjModel>>, index: usize, contact: &MjContact) -> Wrench<World> {
    // Along the contact's axes, the normal first.
    let [normal, first, second, spin, first_roll, second_roll] = data.contact_force(index);
    let axes = Matrix3::from_row_slice(&contact.frame).transpose();
    let force = axes * Vector3::new(normal, first, second);
    let moment = axes * Vector3::new(spin, first_roll, second_roll);
    Wrench::new(force, moment)
}
