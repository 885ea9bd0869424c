//! One tick of the law: against the paper's equations, and as a state machine.

#![allow(non_snake_case)]

mod common;

use assert_no_alloc::assert_no_alloc;
use common::{CAPACITY, ClosedLoop, PERIOD_S, parameters, pseudo_random, random_vector, team};
use mikoshi_cooperation::{
    Axis, BuildHybridLawError, Control, GeneralizedForce, GeneralizedPosition, HandInput, HybridError,
    HybridInputs, HybridLaw, HybridParameters, HybridReference, HybridState, InternalForces, Selection,
    StartHybridError, VirtualStick,
};
use mikoshi_spatial::{Object, Pose, Twist, World, Wrench, exp};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix6, Vector3, Vector6};

#[global_allocator]
static ALLOCATOR: assert_no_alloc::AllocDisabler = assert_no_alloc::AllocDisabler;

/// Random hands, sticks and references, for a law with every kind of axis.
struct Case {
    law: HybridLaw,
    sticks: Vec<VirtualStick>,
    hands: Vec<HandInput>,
    force_ref: GeneralizedForce,
    position_ref: GeneralizedPosition,
    twist_ref: Twist<World>,
}

impl Case {
    fn new(internal_forces: InternalForces) -> Self {
        let mut random = pseudo_random();
        let n = internal_forces.arms();
        let mut parameters = parameters(&internal_forces);
        for (row, axis, control) in [
            (0, Axis::X, Control::Force),
            (0, Axis::Yaw, Control::Force),
            (1, Axis::Y, Control::Position),
            (n - 1, Axis::Pitch, Control::Position),
        ] {
            parameters.selection.select(row, axis, control).unwrap();
        }
        let law = HybridLaw::new(internal_forces, parameters).unwrap();
        let X_WA =
            Pose::<World, Object>::new(Vector3::new(1.0, 2.0, 0.9), exp(&Vector3::new(0.1, -0.2, 2.0)));
        let mut sticks = Vec::new();
        let mut hands = Vec::new();
        for X_AH in common::nominal_grasp(n) {
            sticks.push(VirtualStick::from_hand_in_object(&X_AH));
            let mut twist =
                |size| Twist::new(random_vector(&mut random, size), random_vector(&mut random, size));
            let pose = (X_WA * X_AH).displaced(&twist(0.01));
            let pose_commanded = pose.displaced(&twist(0.01));
            let wrench = Wrench::from_vector(&twist(20.0).to_vector());
            hands.push(HandInput { pose, pose_commanded, wrench });
        }
        let mut force_ref = GeneralizedForce::zero(n);
        let mut position_ref = GeneralizedPosition::at_grasp(X_WA, n);
        force_ref.external.force = random_vector(&mut random, 5.0);
        for (h, z) in force_ref.internal.iter_mut().zip(&mut position_ref.internal) {
            *h = Wrench::new(random_vector(&mut random, 5.0), random_vector(&mut random, 2.0));
            *z = Twist::new(random_vector(&mut random, 0.01), random_vector(&mut random, 0.01));
        }
        let twist_ref = Twist::new(random_vector(&mut random, 0.1), random_vector(&mut random, 0.1));
        Self { law, sticks, hands, force_ref, position_ref, twist_ref }
    }

    fn four_robots() -> Self {
        Self::new(InternalForces::balanced_tree(&team(&[2; 4])))
    }

    fn state(&self) -> HybridState<CAPACITY> {
        HybridState::at_grasp(&self.sticks).unwrap()
    }

    fn inputs(&self) -> HybridInputs<'_> {
        HybridInputs { hands: &self.hands, grasp_yield: Twist::zero(), reference: Some(self.reference()) }
    }

    fn reference(&self) -> HybridReference<'_> {
        HybridReference { force: &self.force_ref, position: &self.position_ref, object_twist: self.twist_ref }
    }
}

/// diag(R, R).
fn rotation(pose: &Pose<World, Object>) -> Matrix6<f64> {
    let R: Matrix3<f64> = pose.rotation.to_rotation_matrix().into_inner();
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&R);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&R);
    both
}

/// The whole law once more, as typeset: 6n × 6n matrices, eqs. 11, 27 to 29, 37, 39 by fig. 4, [W; C]ᵀ.
fn hand_displacements_by_the_paper(case: &Case, z_c: &GeneralizedPosition) -> Vec<Twist<World>> {
    let n = case.law.arms();
    let parameters = case.law.parameters();
    let W_and_C = case.law.internal_forces().w_and_c().kronecker(&DMatrix::<f64>::identity(6, 6));
    let U = W_and_C.clone().try_inverse().unwrap();
    let X_WA = z_c.external;
    let stack = |vectors: Vec<Vector6<f64>>| {
        DVector::from_iterator(6 * n, vectors.into_iter().flat_map(|v| v.iter().copied().collect::<Vec<_>>()))
    };
    let hands = || case.sticks.iter().zip(&case.hands);
    let q_b =
        stack(hands().map(|(stick, hand)| stick.tip_wrench(&hand.pose, &hand.wrench).to_vector()).collect());
    let tip_from_mean = |(stick, hand): (&VirtualStick, &HandInput)| {
        X_WA.displacement_to(&stick.tip_pose(&hand.pose).relabel()).to_vector()
    };
    let y_b = stack(hands().map(tip_from_mean).collect());
    let mut to_object_axes = DMatrix::identity(6 * n, 6 * n);
    for row in 1..n {
        to_object_axes.fixed_view_mut::<6, 6>(6 * row, 6 * row).copy_from(&rotation(&X_WA).transpose());
    }
    let h_c = &to_object_axes * &W_and_C * q_b;
    let z_c = &to_object_axes * U.transpose() * y_b;
    let with_first = |first: Vector6<f64>, others: Vec<Vector6<f64>>| {
        stack(core::iter::once(first).chain(others).collect())
    };
    let h_r = with_first(
        case.force_ref.external.to_vector(),
        case.force_ref.internal.iter().map(Wrench::to_vector).collect(),
    );
    let z_r = with_first(
        X_WA.displacement_to(&case.position_ref.external).to_vector(),
        case.position_ref.internal.iter().map(Twist::to_vector).collect(),
    );
    let S = DMatrix::from_diagonal(&stack(parameters.selection.diagonal().collect()));
    let not_S = DMatrix::identity(6 * n, 6 * n) - &S;
    let mut dz = &not_S * z_r - &not_S * z_c;
    // Eq. 34 for the external row: kh by how stiff all hands are together.
    let mut external = DVector::zeros(6 * n);
    external.rows_mut(0, 6).copy_from(&(&S * (&h_r - &h_c)).rows(0, 6));
    let levers = hands().map(|(stick, hand)| hand.pose.rotation * stick.X_HB.translation);
    let together: Vector6<f64> = levers
        .map(|l| {
            let turning = Vector3::new(l.yz().norm_squared(), l.xz().norm_squared(), l.xy().norm_squared());
            let turning = turning / parameters.kh.m_n + Vector3::repeat(1.0 / parameters.kh.rad_nm);
            Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0) / parameters.kh.m_n
                + Vector6::new(0.0, 0.0, 0.0, turning.x, turning.y, turning.z)
        })
        .sum();
    dz.rows_mut(0, 6).zip_apply(&external.rows(0, 6).component_div(&together), |dz, more| *dz += more);
    let dz = dz * parameters.kz;
    let dy = W_and_C.transpose() * to_object_axes.transpose() * dz;
    let dq = &U * to_object_axes.transpose() * (&S * (h_r - h_c) - external);
    let object_twist = not_S.fixed_view::<6, 6>(0, 0) * case.twist_ref.to_vector();
    let (v, w): (Vector3<f64>, Vector3<f64>) =
        (object_twist.fixed_rows::<3>(0).into(), object_twist.fixed_rows::<3>(3).into());
    hands()
        .enumerate()
        .map(|(i, (_, hand))| {
            let l = hand.pose.rotation * case.sticks[i].X_HB.translation;
            let (dx, dphi): (Vector3<f64>, Vector3<f64>) =
                (dy.fixed_rows::<3>(6 * i).into(), dy.fixed_rows::<3>(6 * i + 3).into());
            let (f, n_B): (Vector3<f64>, Vector3<f64>) =
                (dq.fixed_rows::<3>(6 * i).into(), dq.fixed_rows::<3>(6 * i + 3).into());
            let n_H = n_B + l.cross(&f);
            let (give, turn) =
                (f * parameters.kh.m_n * parameters.kz, n_H * parameters.kh.rad_nm * parameters.kz);
            let feed_forward = v + w.cross(&(hand.pose.translation - X_WA.translation));
            Twist::new(dx - dphi.cross(&l) + give + feed_forward * PERIOD_S, dphi + turn + w * PERIOD_S)
        })
        .collect()
}

#[test]
fn hand_references_move_as_the_papers_equations_say() {
    for internal_forces in [
        InternalForces::balanced_tree(&team(&[2; 4])),
        InternalForces::balanced_tree(&team(&[1, 3, 2])),
        InternalForces::chain(&team(&[2; 3])),
    ] {
        let case = Case::new(internal_forces);
        let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
        case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
        assert_eq!(out.hands_held_back, 0);
        let expected = hand_displacements_by_the_paper(&case, &out.position);
        for ((hand, reference), expected) in case.hands.iter().zip(&out.hands).zip(expected) {
            let moved = hand.pose_commanded.displacement_to(&reference.pose);
            assert!(expected.to_vector().norm() > 1e-4);
            assert!((moved - expected).to_vector().norm() < 1e-12, "{moved:?} {expected:?}");
        }
    }
}

#[test]
fn references_integrate_from_where_they_were() {
    let mut case = Case::four_robots();
    let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    let first = out.clone();
    for hand in &mut case.hands {
        hand.pose_commanded =
            hand.pose_commanded.displaced(&Twist::new(Vector3::repeat(1e-3), Vector3::zeros()));
    }
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    // Hands and wrenches are as they were, so the second step equals the first.
    for ((hand, first), second) in Case::four_robots().hands.iter().zip(&first.hands).zip(&out.hands) {
        let step = hand.pose_commanded.displacement_to(&first.pose);
        assert!((first.pose.displacement_to(&second.pose) - step).to_vector().norm() < 1e-12);
    }
}

/// With the discretisation a = exp(−2π f T), a step shows as 1 − aᵏ after k ticks.
#[test]
fn the_filter_is_a_first_order_low_pass() {
    let mut case = Case::four_robots();
    let wrenches: Vec<_> = case.hands.iter().map(|hand| hand.wrench).collect();
    let set = |case: &mut Case, scale: f64| {
        for (hand, wrench) in case.hands.iter_mut().zip(&wrenches) {
            hand.wrench = *wrench * scale;
        }
    };
    let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
    let mut force = |case: &Case| {
        let inputs = HybridInputs { hands: &case.hands, grasp_yield: Twist::zero(), reference: None };
        case.law.act(&mut state, &mut scratch, &inputs, &mut out).unwrap();
        out.force.clone()
    };
    set(&mut case, 1.0);
    let full = force(&case);
    assert_eq!(force(&case), full, "the first sample is where the filter starts");
    set(&mut case, 0.0);
    let a = (-2.0 * core::f64::consts::PI * common::FILTER_HZ * PERIOD_S).exp();
    for k in 1..50 {
        let now = force(&case);
        let expected = a.powi(k);
        assert!((now.external - full.external * expected).to_vector().norm() < 1e-12);
        for (row, full) in now.internal.iter().zip(&full.internal) {
            assert!((*row - *full * expected).to_vector().norm() < 1e-12);
        }
    }
}

#[test]
fn without_a_filter_h_is_what_it_is() {
    let internal_forces = InternalForces::balanced_tree(&team(&[2]));
    let unfiltered = HybridParameters { filter_hz: f64::INFINITY, ..parameters(&internal_forces) };
    let mut case = Case::new(internal_forces.clone());
    case.law = HybridLaw::new(internal_forces, unfiltered).unwrap();
    let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    for hand in &mut case.hands {
        hand.wrench = Wrench::zero();
    }
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    assert_eq!(out.force, GeneralizedForce::zero(2));
}

#[test]
fn internal_force_errors_do_not_move_the_object() {
    let mut case = Case::four_robots();
    case.law =
        HybridLaw::new(case.law.internal_forces().clone(), parameters(case.law.internal_forces())).unwrap();
    let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
    // Object where it should be, forces anywhere.
    case.twist_ref = Twist::zero();
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    case.position_ref.external = out.position.external;
    let mut state = case.state();
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();
    // With hands as stiff as the gains take them to be, what they add to the object's load is nothing.
    let mut added = Wrench::<World>::zero();
    for ((hand, reference), stick) in case.hands.iter().zip(&out.hands).zip(&case.sticks) {
        let moved = hand.pose_commanded.displacement_to(&reference.pose);
        assert!(moved.to_vector().norm() > 1e-4);
        let kh = case.law.parameters().kh;
        let f_H = Wrench::new(moved.linear / kh.m_n, moved.angular / kh.rad_nm);
        added += stick.tip_wrench(&hand.pose, &f_H);
    }
    assert!(added.to_vector().norm() < 1e-9, "{added:?}");
}

#[test]
fn scratch_filled_with_nan_between_ticks_changes_nothing() {
    for internal_forces in
        [InternalForces::balanced_tree(&team(&[2; 2])), InternalForces::chain(&team(&[2; 2]))]
    {
        let law = HybridLaw::new(internal_forces.clone(), parameters(&internal_forces)).unwrap();
        let (mut clean, mut poisoned) =
            (ClosedLoop::new(law.clone(), 0.02, 1), ClosedLoop::new(law, 0.02, 1));
        for tick in 0..50 {
            poisoned.scratch.poison();
            clean.tick(tick > 5);
            poisoned.tick(tick > 5);
            assert_eq!(bytemuck::bytes_of(&clean.state), bytemuck::bytes_of(&poisoned.state));
            assert_eq!(clean.out, poisoned.out);
        }
    }
}

#[test]
fn a_run_continues_from_a_copied_state_as_if_nothing_had_happened() {
    let internal_forces = InternalForces::balanced_tree(&team(&[2; 2]));
    let law = HybridLaw::new(internal_forces.clone(), parameters(&internal_forces)).unwrap();
    let mut world = ClosedLoop::new(law, 0.02, 1);
    world.run(20);
    let checkpoint = bytemuck::bytes_of(&world.state).to_vec();
    let hands = world.hand_inputs();
    let successor = world.law.clone();
    let mut restored: HybridState<CAPACITY> = bytemuck::pod_read_unaligned(&checkpoint);
    let (mut scratch, mut out) = (successor.scratch(), successor.output());
    let reference = HybridReference {
        force: &world.force_ref,
        position: &world.position_ref,
        object_twist: world.twist_ref,
    };
    let inputs = HybridInputs { hands: &hands, grasp_yield: Twist::zero(), reference: Some(reference) };
    successor.act(&mut restored, &mut scratch, &inputs, &mut out).unwrap();
    world.law.act(&mut world.state, &mut world.scratch, &inputs, &mut world.out).unwrap();
    assert_eq!(bytemuck::bytes_of(&restored), bytemuck::bytes_of(&world.state));
    assert_eq!(out, world.out);
}

#[test]
fn a_tick_allocates_nothing() {
    for internal_forces in
        [InternalForces::balanced_tree(&team(&[2; 4])), InternalForces::chain(&team(&[2; 4]))]
    {
        let case = Case::new(internal_forces);
        let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
        let hold = HybridInputs { hands: &case.hands, grasp_yield: Twist::zero(), reference: None };
        assert_no_alloc(|| {
            for inputs in [hold, case.inputs(), case.inputs()] {
                case.law.act(&mut state, &mut scratch, &inputs, &mut out).unwrap();
            }
        });
    }
}

/// Each rejected tick leaves state and output as they were.
fn assert_rejected(case: &Case, inputs: &HybridInputs, state: &HybridState<CAPACITY>, expected: HybridError) {
    let (mut scratch, mut out) = (case.law.scratch(), case.law.output());
    let (mut after, before) = (*state, out.clone());
    assert_eq!(case.law.act(&mut after, &mut scratch, inputs, &mut out), Err(expected));
    assert_eq!(bytemuck::bytes_of(&after), bytemuck::bytes_of(state));
    assert_eq!(out, before);
}

#[test]
fn inputs_that_are_no_numbers_are_rejected_and_change_nothing() {
    let case = Case::four_robots();
    let (mut state, mut scratch, mut out) = (case.state(), case.law.scratch(), case.law.output());
    case.law.act(&mut state, &mut scratch, &case.inputs(), &mut out).unwrap();

    let spoil_hand: [fn(&mut HandInput); 3] = [
        |hand| hand.wrench.moment.z = f64::NAN,
        |hand| hand.pose.translation.x = f64::INFINITY,
        |hand| hand.pose_commanded.rotation.as_mut_unchecked().coords.w = f64::NAN,
    ];
    for spoil in spoil_hand {
        let mut bad = Case::four_robots();
        spoil(&mut bad.hands[7]);
        assert_rejected(&bad, &bad.inputs(), &state, HybridError::NonFiniteInput);
        let hold = HybridInputs { reference: None, ..bad.inputs() };
        assert_rejected(&bad, &hold, &state, HybridError::NonFiniteInput);
    }
    let spoil_reference: [fn(&mut Case); 5] = [
        |case| case.force_ref.external.force.x = f64::NAN,
        |case| case.force_ref.internal[6].moment.x = f64::NAN,
        |case| case.position_ref.external.translation.y = f64::NAN,
        |case| case.position_ref.internal[0].angular.y = f64::NEG_INFINITY,
        |case| case.twist_ref.linear.z = f64::NAN,
    ];
    for spoil in spoil_reference {
        let mut bad = Case::four_robots();
        spoil(&mut bad);
        assert_rejected(&bad, &bad.inputs(), &state, HybridError::NonFiniteInput);
    }
}

#[test]
fn inputs_for_another_number_of_arms_are_rejected() {
    let case = Case::four_robots();
    let state = case.state();
    let few_hands = HybridInputs { hands: &case.hands[..7], ..case.inputs() };
    assert_rejected(&case, &few_hands, &state, HybridError::WrongSize);
    let (force, position) = (GeneralizedForce::zero(7), GeneralizedPosition::at_grasp(Pose::identity(), 7));
    for reference in [
        HybridReference { force: &force, ..case.reference() },
        HybridReference { position: &position, ..case.reference() },
    ] {
        let inputs = HybridInputs { reference: Some(reference), ..case.inputs() };
        assert_rejected(&case, &inputs, &state, HybridError::WrongSize);
    }
    let other_grasp = HybridState::at_grasp(&case.sticks[..7]).unwrap();
    assert_rejected(&case, &case.inputs(), &other_grasp, HybridError::WrongSize);

    let other = Case::new(InternalForces::balanced_tree(&team(&[2; 3])));
    let chain = Case::new(InternalForces::chain(&team(&[2; 4])));
    let mut state = case.state();
    let mut act = |scratch: &mut _, out: &mut _| case.law.act(&mut state, scratch, &case.inputs(), out);
    assert_eq!(act(&mut other.law.scratch(), &mut case.law.output()), Err(HybridError::WrongSize));
    assert_eq!(act(&mut chain.law.scratch(), &mut case.law.output()), Err(HybridError::WrongSize));
    assert_eq!(act(&mut case.law.scratch(), &mut other.law.output()), Err(HybridError::WrongSize));
    let mut without_a_hand = case.law.output();
    without_a_hand.hands.pop();
    assert_eq!(act(&mut case.law.scratch(), &mut without_a_hand), Err(HybridError::WrongSize));
    let mut without_a_row = case.law.output();
    without_a_row.force.internal.pop();
    assert_eq!(act(&mut case.law.scratch(), &mut without_a_row), Err(HybridError::WrongSize));
    assert_eq!(act(&mut case.law.scratch(), &mut case.law.output()), Ok(()));

    let shorter_chain = Case::new(InternalForces::chain(&team(&[2; 3])));
    let mut state = chain.state();
    let mut act =
        |scratch: &mut _| chain.law.act(&mut state, scratch, &chain.inputs(), &mut chain.law.output());
    assert_eq!(act(&mut shorter_chain.law.scratch()), Err(HybridError::WrongSize));
    assert_eq!(act(&mut chain.law.scratch()), Ok(()));
}

#[test]
fn a_state_without_poses_is_rejected() {
    let case = Case::four_robots();
    let without_sticks = HybridState::<CAPACITY> { arms: 8, ..bytemuck::Zeroable::zeroed() };
    assert_rejected(&case, &case.inputs(), &without_sticks, HybridError::InvalidState);
    let without_references = HybridState { ticks: 1, ..case.state() };
    assert_rejected(&case, &case.inputs(), &without_references, HybridError::InvalidState);
}

#[test]
fn a_state_holds_as_many_arms_as_its_capacity() {
    let case = Case::four_robots();
    assert!(HybridState::<8>::at_grasp(&case.sticks).is_ok());
    let error = HybridState::<7>::at_grasp(&case.sticks).unwrap_err();
    assert_eq!(error, StartHybridError::TooManyArms { arms: 8, capacity: 7 });
    assert_eq!(case.state().stick(7), Some(case.sticks[7]));
    assert_eq!(case.state().stick(8), None);
}

#[test]
fn parameters_out_of_range_make_no_law() {
    let internal_forces = InternalForces::balanced_tree(&team(&[2; 2]));
    let name_of = |change: fn(&mut HybridParameters)| {
        let mut parameters = parameters(&internal_forces);
        change(&mut parameters);
        match HybridLaw::new(internal_forces.clone(), parameters).unwrap_err() {
            BuildHybridLawError::OutOfRange { name, .. } | BuildHybridLawError::RowCount { name, .. } => name,
        }
    };
    assert_eq!(name_of(|p| p.period_s = 0.0), "period_s");
    assert_eq!(name_of(|p| p.kz = 0.0), "kz");
    assert_eq!(name_of(|p| p.kz = 1.1), "kz");
    assert_eq!(name_of(|p| p.kz = f64::NAN), "kz");
    assert_eq!(name_of(|p| p.filter_hz = f64::NAN), "filter_hz");
    assert_eq!(name_of(|p| p.filter_hz = -1.0), "filter_hz");
    assert_eq!(name_of(|p| p.lead_limit_m = f64::INFINITY), "lead_limit_m");
    assert_eq!(name_of(|p| p.lead_limit_rad = 0.0), "lead_limit_rad");
    assert_eq!(name_of(|p| p.approach_limit_m_s = 0.0), "approach_limit_m_s");
    assert_eq!(name_of(|p| p.approach_limit_rad_s = f64::INFINITY), "approach_limit_rad_s");
    assert_eq!(name_of(|p| p.kh.m_n = -1.0), "kh.m_n");
    assert_eq!(name_of(|p| p.kh.rad_nm = f64::NAN), "kh.rad_nm");
    assert_eq!(name_of(|p| p.selection = Selection::object_position_internal_force(5)), "selections");
}

#[test]
fn a_selection_without_such_a_row_is_refused() {
    let mut selection = Selection::object_position_internal_force(4);
    let before = selection.clone();
    assert_eq!(selection.select(4, Axis::X, Control::Position), None);
    assert_eq!(selection, before);
    assert_eq!(selection.select(3, Axis::Yaw, Control::Position), Some(()));
    let diagonal: Vec<_> = selection.diagonal().collect();
    assert_eq!(diagonal[0], Vector6::zeros());
    assert_eq!(diagonal[3], Vector6::new(1.0, 1.0, 1.0, 1.0, 1.0, 0.0));
}
