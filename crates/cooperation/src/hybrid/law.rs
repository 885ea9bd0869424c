//! One tick of the hybrid law.

use super::{
    BuildHybridLawError, HandInput, HandReference, HybridError, HybridInputs, HybridOutput, HybridParameters,
    HybridReference, HybridScratch, HybridState,
};
use crate::{FormedForces, GeneralizedForce, GeneralizedPosition, InternalForces, WorkspaceScratch};
use core::f64::consts::PI;
use mikoshi_spatial::{CoordinateFrame, Hand, Object, Pose, Twist, World, Wrench};
use nalgebra::{Vector3, Vector6};

/// The hybrid law for one choice of internal forces and parameters. Immutable: what changes from tick to
/// tick lives in [`HybridState`].
#[derive(Clone, Debug)]
pub struct HybridLaw {
    internal_forces: InternalForces,
    parameters: HybridParameters,
    /// a = exp(−2π f T), the filter's pole.
    filter_pole: f64,
    rows: Vec<RowLaw>,
}

/// The diagonal of S and of I − S for one row (eqs. 35, 36).
#[derive(Clone, Copy, Debug)]
struct RowLaw {
    /// S.
    is_force: Vector6<f64>,
    /// I − S.
    is_position: Vector6<f64>,
}

impl HybridLaw {
    /// Checks the parameters.
    pub fn new(
        internal_forces: InternalForces,
        parameters: HybridParameters,
    ) -> Result<Self, BuildHybridLawError> {
        parameters.check(&internal_forces)?;
        let of_row =
            |is_force: Vector6<f64>| RowLaw { is_force, is_position: Vector6::repeat(1.0) - is_force };
        let rows = parameters.selection.diagonal().map(of_row).collect();
        let filter_pole = (-2.0 * PI * parameters.filter_hz * parameters.period_s).exp();
        Ok(Self { internal_forces, parameters, filter_pole, rows })
    }

    /// The internal forces that it controls.
    pub fn internal_forces(&self) -> &InternalForces {
        &self.internal_forces
    }

    /// Its parameters.
    pub fn parameters(&self) -> &HybridParameters {
        &self.parameters
    }

    /// Number n of arms.
    pub fn arms(&self) -> usize {
        self.internal_forces.arms()
    }

    /// Workspaces of its size.
    pub fn scratch(&self) -> HybridScratch {
        HybridScratch::new(&self.internal_forces)
    }

    /// An output of its size.
    pub fn output(&self) -> HybridOutput {
        HybridOutput::new(self.arms())
    }

    /// One tick: h_c and z_c from the hands, then, if there is a reference, eq. 37 and eq. 39 as fig. 4 has
    /// it, and new hand references. Without a reference the hand references hold; h_c is filtered all the
    /// same.
    ///
    /// O(n) with a tree of internal forces, O(n²) with any other. No allocation, no panic. On an error
    /// nothing is changed: the caller's last output stands.
    pub fn act<const CAPACITY: usize>(
        &self,
        state: &mut HybridState<CAPACITY>,
        scratch: &mut HybridScratch,
        inputs: &HybridInputs,
        out: &mut HybridOutput,
    ) -> Result<(), HybridError> {
        self.check(state, scratch, inputs, out)?;
        load(state, scratch, inputs.hands)?;
        self.form(state, &mut scratch.formation)?;
        let HybridScratch { workspace, sticks, hand_pose_ref, formation } = scratch;
        let forces = self.internal_forces.among(formation);
        let HybridOutput { force: h_c, position: z_c, hands: references, hands_held_back } = out;

        let hands = sticks.iter().zip(inputs.hands).map(|(stick, hand)| (*stick, hand.pose, hand.wrench));
        workspace.evaluate(&forces, hands, h_c, z_c);
        z_c.external = z_c.external.displaced(&inputs.grasp_yield);
        self.filter(state, h_c);
        state.ticks += 1;

        *hands_held_back = 0;
        let at_rest = Twist::zero();
        let Some(reference) = &inputs.reference else {
            for (out, pose) in references.iter_mut().zip(hand_pose_ref.iter()) {
                *out = HandReference { pose: *pose, twist: at_rest, wrench: Wrench::zero() };
            }
            store(state, references);
            return Ok(());
        };

        let giving_way = self.external_giving_way(h_c, reference, &forces, &workspace.levers);
        self.deal_out_errors(h_c, z_c, reference, &giving_way, &forces, workspace);
        let object_twist = self.feed_forward(reference);
        for ((((out, pose), hand), lever), (tip, lacking)) in references
            .iter_mut()
            .zip(hand_pose_ref.iter())
            .zip(inputs.hands)
            .zip(&workspace.levers)
            .zip(workspace.tip_twists.iter().zip(&workspace.tip_wrenches))
        {
            // The object and all hands move as one body.
            let twist = object_twist.shifted(&(hand.pose.translation - z_c.external.translation));
            let feedback = self.feedback(lever, tip, lacking);
            // Deviation from eq. 38, which adds to measured joint angles: that turns every servo's droop,
            // divided by kz, into a standing error. References integrate, and measurement closes the loop
            // through z_c alone.
            let wanted = pose.displaced(&(feedback + twist * self.parameters.period_s));
            let (pose, is_held_back) = self.within_lead(hand, wanted);
            *hands_held_back += usize::from(is_held_back);
            *out = HandReference { pose, twist, wrench: Wrench::zero() };
        }
        self.deal_out_forces(h_c, z_c, reference, &forces, workspace);
        let tips = workspace.levers.iter().zip(&workspace.tip_wrenches);
        for (out, (lever, tip)) in references.iter_mut().zip(tips) {
            out.wrench = tip.shifted(lever);
        }
        store(state, references);
        Ok(())
    }

    /// What each tip is to apply (eq. 7), in `workspace.tip_wrenches`: references on force axes; on position
    /// axes, where the force is whatever holds the position, what is measured.
    fn deal_out_forces(
        &self,
        h_c: &GeneralizedForce,
        z_c: &GeneralizedPosition,
        reference: &HybridReference,
        forces: &FormedForces<'_>,
        workspace: &mut WorkspaceScratch,
    ) {
        let WorkspaceScratch { tip_wrenches, row_wrenches, work_wrenches, .. } = workspace;
        let X_WA: &Pose<World, Object> = &z_c.external;
        let mut rows = self.rows.iter().zip(row_wrenches.iter_mut());
        if let Some((row, h)) = rows.next() {
            *h = row.expected_force(&reference.force.external, &h_c.external);
        }
        let internal = reference.force.internal.iter().zip(&h_c.internal);
        for ((row, h), (h_r, h_c)) in rows.zip(internal) {
            *h = row.expected_force(h_r, h_c).expressed_in(X_WA);
        }
        forces.tip_forces(row_wrenches, tip_wrenches, work_wrenches);
    }

    fn check<const CAPACITY: usize>(
        &self,
        state: &HybridState<CAPACITY>,
        scratch: &HybridScratch,
        inputs: &HybridInputs,
        out: &HybridOutput,
    ) -> Result<(), HybridError> {
        let n = self.arms();
        let has_rows = |h: &GeneralizedForce, z: &GeneralizedPosition| {
            h.internal.len() + 1 == n && z.internal.len() + 1 == n
        };
        let are_sizes_right = n <= CAPACITY
            && state.arms == n as u64
            && scratch.sticks.len() == n
            && scratch.workspace.work_twists.len() == self.internal_forces.work_len()
            && inputs.hands.len() == n
            && inputs.reference.is_none_or(|reference| has_rows(reference.force, reference.position))
            && has_rows(&out.force, &out.position)
            && out.hands.len() == n;
        if !are_sizes_right {
            return Err(HybridError::WrongSize);
        }
        let is_hand_finite = |hand: &HandInput| {
            hand.pose.is_finite() && hand.pose_commanded.is_finite() && hand.wrench.is_finite()
        };
        let is_reference_finite = |reference: &HybridReference| {
            reference.object_twist.is_finite()
                && reference.force.external.is_finite()
                && reference.force.internal.iter().all(Wrench::is_finite)
                && reference.position.external.is_finite()
                && reference.position.internal.iter().all(Twist::is_finite)
        };
        let is_finite = inputs.hands.iter().all(is_hand_finite)
            && inputs.grasp_yield.is_finite()
            && inputs.reference.as_ref().is_none_or(is_reference_finite);
        if is_finite { Ok(()) } else { Err(HybridError::NonFiniteInput) }
    }

    /// First-order low-pass on h, each row in its own axes; the first tick's h is where it starts.
    fn filter<const CAPACITY: usize>(&self, state: &mut HybridState<CAPACITY>, h: &mut GeneralizedForce) {
        let is_first = state.ticks == 0;
        let filter = |memory: &mut [f64; 6], new: [f64; 6]| {
            for (memory, new) in memory.iter_mut().zip(new) {
                *memory = if is_first { new } else { new + self.filter_pole * (*memory - new) };
            }
        };
        let mut rows = state.filtered_force.iter_mut();
        if let Some(memory) = rows.next() {
            filter(memory, h.external.to_array());
            h.external = Wrench::from_array(memory);
        }
        for (row, memory) in h.internal.iter_mut().zip(rows) {
            filter(memory, row.to_array());
            *row = Wrench::from_array(memory);
        }
    }

    /// kh S (h_r − h_c) of row 0 (eqs. 34, 37): how far the object is to give way to what it lacks of the
    /// external force, all hands with it as one body, so that no internal force comes of it.
    ///
    /// Against a rigid wall n hands of stiffness k, at the ends of sticks l, are as stiff as `n k` along an
    /// axis and `n kφ + k Σ |e × l|²` about an axis e. The object's kh makes the loop gain of that the same
    /// as a single hand's; a wall that yields lowers it. In free space there is no loop and the object moves
    /// at a speed in proportion to the force, which is bounded: it is the speed at which it will meet the
    /// wall.
    fn external_giving_way(
        &self,
        h_c: &GeneralizedForce,
        reference: &HybridReference,
        forces: &FormedForces<'_>,
        levers: &[Vector3<f64>],
    ) -> Twist<World> {
        let Some(row) = self.rows.first().filter(|row| row.is_force != Vector6::zeros()) else {
            return Twist::zero();
        };
        let HybridParameters { kz, kh, period_s, approach_limit_m_s, approach_limit_rad_s, .. } =
            &self.parameters;
        let mut squared = Vector3::zeros();
        let formation = forces.formation();
        for (_, l) in levers.iter().enumerate().filter(|(arm, _)| formation.takes_part(*arm)) {
            squared += Vector3::repeat(l.norm_squared()) - l.component_mul(l);
        }
        let n = formation.arms() as f64;
        let by_levers = |squared: f64| if squared > 0.0 { squared / kh.m_n } else { 0.0 };
        let turning = squared.map(|squared| 1.0 / (n / kh.rad_nm + by_levers(squared)));
        let lacking = row.force_error(&reference.force.external, &h_c.external);
        let (linear, angular) = (lacking.force * (kh.m_n / n), lacking.moment.component_mul(&turning));
        // k_z of it is what one tick brings.
        let longest = |speed: f64| speed * period_s / kz;
        Twist::new(
            shortened(linear, longest(*approach_limit_m_s)).0,
            shortened(angular, longest(*approach_limit_rad_s)).0,
        )
    }

    /// The errors of eq. 37, dealt out to the tips: displacements for the object and for the position axes in
    /// `workspace.tip_twists`, wrenches that are missing on internal force axes in `workspace.tip_wrenches`.
    fn deal_out_errors(
        &self,
        h_c: &GeneralizedForce,
        z_c: &GeneralizedPosition,
        reference: &HybridReference,
        external_giving_way: &Twist<World>,
        forces: &FormedForces<'_>,
        workspace: &mut WorkspaceScratch,
    ) {
        let WorkspaceScratch {
            tip_twists,
            row_twists,
            work_twists,
            tip_wrenches,
            row_wrenches,
            work_wrenches,
            ..
        } = workspace;
        let X_WA: &Pose<World, Object> = &z_c.external;
        let mut rows = self.rows.iter().zip(row_twists.iter_mut().zip(row_wrenches.iter_mut()));
        if let Some((row, (dz, dh))) = rows.next() {
            // Deviation from eqs. 37 and 39, which subtract Euler angles and map them by Ba: the rotation
            // vector from z_c to z_r is what Ba (z_r − z_c) stands for, without its singularity.
            *dz = row.position_error(&X_WA.displacement_to(&reference.position.external));
            *dz += *external_giving_way;
            *dh = Wrench::zero();
        }
        let h = reference.force.internal.iter().zip(&h_c.internal);
        let z = reference.position.internal.iter().zip(&z_c.internal);
        for ((row, (dz, dh)), ((h_r, h_c), (z_r, z_c))) in rows.zip(h.zip(z)) {
            *dz = row.position_error(&(*z_r - *z_c)).expressed_in(X_WA);
            *dh = row.force_error(h_r, h_c).expressed_in(X_WA);
        }
        // By duality with eq. 9; the paper leaves this step to J†.
        forces.tip_displacements(row_twists, tip_twists, work_twists);
        // Eq. 7.
        forces.tip_forces(row_wrenches, tip_wrenches, work_wrenches);
    }

    /// What feedback adds to a hand's reference: k_z of its tip's displacement, and k_z k_h of the wrench
    /// that it lacks. The sign holds for wrenches that hands apply TO the object.
    ///
    /// Deviation from eqs. 34 to 37, where k_h is a number that turns h_r − h_c into a displacement δz: here,
    /// for internal rows,
    /// U deals the force error out to the hands (eq. 7), and each gives way to its share at its own origin.
    /// Through a virtual stick of length l a rotation of the tip moves the hand by l, so that along δz a grasp
    /// is up to 1 + l² k/k_φ times as stiff one way as another, and one number is too small for moments in
    /// the hands or too large for long sticks. Hand by hand it is as stiff as a hand is, all errors shrink
    /// alike, and the object is not moved, whatever its size and that of the team.
    fn feedback(&self, lever: &Vector3<f64>, tip: &Twist<World>, lacking: &Wrench<World>) -> Twist<World> {
        let HybridParameters { kz, kh, .. } = &self.parameters;
        let lacking = lacking.shifted(lever);
        let giving_way = Twist::new(lacking.force * kh.m_n, lacking.moment * kh.rad_nm);
        (tip.shifted(&-lever) + giving_way) * *kz
    }

    /// The object's reference twist on its position axes. Beyond the paper, whose law lags a moving
    /// reference by its velocity times T / kz.
    fn feed_forward(&self, reference: &HybridReference) -> Twist<World> {
        let is_position = self.rows.first().map_or_else(Vector6::zeros, |row| row.is_position);
        Twist::from_vector(&is_position.component_mul(&reference.object_twist.to_vector()))
    }

    /// Anti-windup: a reference that leads its robot by no more than the limits, and whether it had to be
    /// held back.
    fn within_lead(&self, hand: &HandInput, wanted: Pose<World, Hand>) -> (Pose<World, Hand>, bool) {
        let lead = hand.pose_commanded.displacement_to(&wanted);
        let (linear, is_far) = shortened(lead.linear, self.parameters.lead_limit_m);
        let (angular, is_turned_far) = shortened(lead.angular, self.parameters.lead_limit_rad);
        if is_far || is_turned_far {
            (hand.pose_commanded.displaced(&Twist::new(linear, angular)), true)
        } else {
            (wanted, false)
        }
    }
}

impl RowLaw {
    /// S (h_r − h_c).
    fn force_error<F: CoordinateFrame>(&self, h_r: &Wrench<F>, h_c: &Wrench<F>) -> Wrench<F> {
        Wrench::from_vector(&self.is_force.component_mul(&(*h_r - *h_c).to_vector()))
    }

    /// S h_r + (I − S) h_c.
    fn expected_force<F: CoordinateFrame>(&self, h_r: &Wrench<F>, h_c: &Wrench<F>) -> Wrench<F> {
        let (h_r, h_c) = (h_r.to_vector(), h_c.to_vector());
        Wrench::from_vector(&(self.is_force.component_mul(&h_r) + self.is_position.component_mul(&h_c)))
    }

    /// (I − S) of z_r^input − z_c.
    ///
    /// Deviation from eq. 39, which subtracts all of z_c: fig. 4 has an (I − S) there. Without it force
    /// axes become springs and keep a standing force.
    fn position_error<F: CoordinateFrame>(&self, error: &Twist<F>) -> Twist<F> {
        Twist::from_vector(&self.is_position.component_mul(&error.to_vector()))
    }
}

/// Reads sticks and last references; at the first tick those are what the robots have commanded.
fn load<const CAPACITY: usize>(
    state: &HybridState<CAPACITY>,
    scratch: &mut HybridScratch,
    hands: &[HandInput],
) -> Result<(), HybridError> {
    for (stick, array) in scratch.sticks.iter_mut().zip(&state.sticks) {
        stick.X_HB = Pose::from_array(array).ok_or(HybridError::InvalidState)?;
    }
    for ((pose, array), hand) in scratch.hand_pose_ref.iter_mut().zip(&state.hand_pose_ref).zip(hands) {
        *pose = match state.ticks {
            0 => hand.pose_commanded,
            _ => Pose::from_array(array).ok_or(HybridError::InvalidState)?,
        };
    }
    Ok(())
}

fn store<const CAPACITY: usize>(state: &mut HybridState<CAPACITY>, references: &[HandReference]) {
    for (array, reference) in state.hand_pose_ref.iter_mut().zip(references) {
        *array = reference.pose.to_array();
    }
}

/// `v` shortened to `limit`, and whether it was longer.
fn shortened(v: Vector3<f64>, limit: f64) -> (Vector3<f64>, bool) {
    if v.norm_squared() <= limit * limit {
        return (v, false);
    }
    (v * (limit / v.norm()), true)
}
