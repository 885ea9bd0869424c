//! The other side: `bench/pinocchio/side.cpp` as a library, which `scripts/setup-pinocchio` makes.

use crate::postures::Walk;
use core::ffi::{c_char, c_void};
use libloading::{Library, Symbol};
use mikoshi_humanoid::FrameId;
use mikoshi_humanoid::balance::Side;
use std::ffi::CString;
use std::path::Path;

/// Names the folder that `scripts/setup-pinocchio` has filled.
pub const FOLDER: &str = "MIKOSHI_PINOCCHIO";

/// A pose as it comes back: translation, and rotation by columns.
pub type PoseColumns = [f64; 12];

/// Pinocchio's robot.
pub struct Pinocchio {
    handle: *mut c_void,
    library: Library,
}

/// What it makes of a step.
#[derive(Debug, Default)]
pub struct Solution {
    /// Of every joint \[rad\].
    pub increment: Vec<f64>,
    /// Base, then hands.
    pub poses: [PoseColumns; 3],
    /// Of centre of mass, waist, foot and hands.
    pub missed: [f64; 8],
}

/// A part that is timed: so many calls, from the given one on.
#[derive(Clone, Copy, Debug)]
pub struct Part(&'static str);

/// Poses of all bodies, centres of mass of all that hangs on them.
pub const POSES: Part = Part("side_poses");
/// Poses of all bodies and links.
pub const POSES_OF_LINKS: Part = Part("side_poses_of_links");
/// Poses and Jacobians of feet and hands, centre of mass and its Jacobian.
pub const JACOBIANS: Part = Part("side_jacobians");
/// A tick of the inverse kinematics.
pub const SOLVE: Part = Part("side_solve");

#[repr(C)]
struct Frames {
    feet: [*const c_char; 2],
    hands: [*const c_char; 2],
    waist: *const c_char,
}

#[repr(C)]
struct Gains {
    balance_weight: f64,
    foot_weight: f64,
    hand_weight: f64,
    damping: f64,
    posture_gain: f64,
    step_m: f64,
    step_rad: f64,
    limit_margin: f64,
    repulsion_zone: f64,
    repulsion_step: f64,
}

type Open = unsafe extern "C" fn(
    *const c_char,
    *const *const c_char,
    usize,
    *const *const c_char,
    usize,
    *const Frames,
    *const Gains,
    *const f64,
) -> *mut c_void;

impl Pinocchio {
    /// The robot of this walk, with all its postures and steps, from what is in `folder`.
    pub fn open(folder: &Path, walk: &Walk) -> Self {
        // SAFETY: it is the library of this module's other half, and its initialisers are the C++ runtime's.
        let library = unsafe { Library::new(folder.join("libside.so")) };
        let library = library.unwrap_or_else(|error| panic!("{FOLDER}={}: {error}", folder.display()));
        let (model, config) = (&walk.robot.model, walk.ik.config());
        let name = |frame: FrameId| c_string(&model.frame(frame).name);
        let joints: Vec<_> = model.joints().iter().map(|joint| c_string(&joint.name)).collect();
        let links: Vec<_> = model.frames().iter().map(|frame| c_string(&frame.name)).collect();
        let pointers = |names: &[CString]| names.iter().map(|name| name.as_ptr()).collect::<Vec<_>>();
        let (joint_names, link_names) = (pointers(&joints), pointers(&links));
        let feet = [Side::Right, Side::Left].map(|side| name(config.feet[side]));
        let hands = [0, 1].map(|hand: usize| name(config.hands[hand]));
        let waist = name(config.waist);
        let frames = Frames {
            feet: [feet[0].as_ptr(), feet[1].as_ptr()],
            hands: [hands[0].as_ptr(), hands[1].as_ptr()],
            waist: waist.as_ptr(),
        };
        let gains = Gains {
            balance_weight: config.gains.balance_weight,
            foot_weight: config.gains.foot_weight,
            hand_weight: config.gains.hand_weight,
            damping: config.gains.damping,
            posture_gain: config.gains.posture_gain,
            step_m: config.gains.step_m,
            step_rad: config.gains.step_rad,
            limit_margin: config.gains.limit_margin,
            repulsion_zone: config.gains.repulsion_zone,
            repulsion_step: config.gains.repulsion_step,
        };
        let archive = c_string(folder.join("hrp2.txt").to_str().expect("a path in UTF-8"));
        // SAFETY: the signature is that of `side_open`; all pointers outlive the call, with as many elements as it is
        // told, and `preferred` has one for each joint.
        let handle = unsafe {
            let open: Symbol<Open> = library.get(b"side_open").expect("it has one");
            open(
                archive.as_ptr(),
                joint_names.as_ptr(),
                joints.len(),
                link_names.as_ptr(),
                links.len(),
                &frames,
                &gains,
                config.posture.as_ptr(),
            )
        };
        assert!(!handle.is_null(), "{}: not this robot's model (see above)", folder.display());
        let side = Self { handle, library };
        side.add(walk);
        side
    }

    fn add(&self, walk: &Walk) {
        for posture in &walk.postures {
            self.tell("side_add_posture", &posture.base.to_array(), &posture.joints);
        }
        for step in &walk.steps {
            let targets = &step.targets;
            let poses = [targets.feet.right.to_array(), targets.feet.left.to_array()].into_iter();
            let hands = targets.hands.iter().flatten().map(|hand| hand.to_array());
            let waist = targets.waist_attitude.quaternion();
            let values: Vec<f64> = poses
                .chain(hands)
                .flatten()
                .chain(targets.com.iter().copied())
                .chain([waist.w, waist.i, waist.j, waist.k])
                .collect();
            assert_eq!(values.len(), 4 * 7 + 3 + 4, "it has two hands");
            self.tell("side_add_case", &step.state.joint_position, &values);
        }
    }

    fn tell(&self, function: &str, first: &[f64], second: &[f64]) {
        // SAFETY: both functions take the handle and two arrays, which they copy: 7 numbers and one a joint, or one a
        // joint and those of the targets.
        unsafe {
            let function: Symbol<unsafe extern "C" fn(*mut c_void, *const f64, *const f64)> =
                self.library.get(function.as_bytes()).expect("it has one");
            function(self.handle, first.as_ptr(), second.as_ptr());
        }
    }

    /// Does it, `count` times from posture or step `first` on.
    pub fn execute(&self, part: Part, first: usize, count: usize) {
        // SAFETY: all parts take these arguments; postures and steps were told.
        unsafe {
            let function: Symbol<unsafe extern "C" fn(*mut c_void, usize, usize)> =
                self.library.get(part.0.as_bytes()).expect("it has one");
            function(self.handle, first, count);
        }
    }

    /// Centre of mass, of what was executed last.
    pub fn com(&self) -> [f64; 3] {
        let mut com = [0.0; 3];
        self.read("side_com", &mut com);
        com
    }

    /// Pose of a link, by its place in the model's frames.
    pub fn link(&self, link: usize) -> PoseColumns {
        let mut pose = [0.0; 12];
        self.read_at("side_link", link, &mut pose);
        pose
    }

    /// Jacobian by columns of feet and hands, in this order.
    pub fn jacobian(&self, extremity: usize, out: &mut [f64]) {
        self.read_at("side_jacobian", extremity, out);
    }

    /// Jacobian by columns of the centre of mass.
    pub fn com_jacobian(&self, out: &mut [f64]) {
        self.read("side_com_jacobian", out);
    }

    /// Of the last step.
    pub fn solution(&self, joints: usize) -> Solution {
        let mut solution = Solution { increment: vec![0.0; joints], ..Solution::default() };
        // SAFETY: it writes one number a joint, three poses and eight numbers.
        unsafe {
            let read: Symbol<unsafe extern "C" fn(*const c_void, *mut f64, *mut f64, *mut f64)> =
                self.library.get(b"side_solution").expect("it has one");
            let Solution { increment, poses, missed } = &mut solution;
            read(self.handle, increment.as_mut_ptr(), poses.as_mut_ptr().cast(), missed.as_mut_ptr());
        }
        solution
    }

    fn read(&self, function: &str, out: &mut [f64]) {
        // SAFETY: callers give as much room as the function fills.
        unsafe {
            let read: Symbol<unsafe extern "C" fn(*const c_void, *mut f64)> =
                self.library.get(function.as_bytes()).expect("it has one");
            read(self.handle, out.as_mut_ptr());
        }
    }

    fn read_at(&self, function: &str, index: usize, out: &mut [f64]) {
        // SAFETY: callers give an index that there is, and as much room as the function fills.
        unsafe {
            let read: Symbol<unsafe extern "C" fn(*const c_void, usize, *mut f64)> =
                self.library.get(function.as_bytes()).expect("it has one");
            read(self.handle, index, out.as_mut_ptr());
        }
    }
}

impl Drop for Pinocchio {
    fn drop(&mut self) {
        // SAFETY: the handle is `side_open`'s, and nobody uses it any more.
        unsafe {
            let close: Symbol<unsafe extern "C" fn(*mut c_void)> =
                self.library.get(b"side_close").expect("it has one");
            close(self.handle);
        }
    }
}

fn c_string(text: &str) -> CString {
    CString::new(text).expect("names have no zero bytes")
}
