//! The gait's state as integers without padding, for those who keep it in files: a checkpoint holds
//! words, not enums, since any bit pattern must be readable before it is checked.

use super::controller::GaitState;
use super::foot_placement::{FootPlacement, MAX_HANDS};
use super::ground_pose::GroundPose;
use super::machine::{GaitPhase, PlannedStep, SwingingFoot};
use super::preview::PreviewState;
use super::step_clock::StepClock;
use super::swing::{Foothold, Swing, SwingContact};
use crate::balance::{ExternalLoad, PerFoot, Side};
use nalgebra::{Quaternion, Unit, UnitQuaternion, Vector2};

/// Words of a [`GaitState`].
pub const GAIT_STATE_WORDS: usize = 77;

impl GaitState {
    /// As words; floats by their bits, so that the way back is exact. Unused words are zero.
    pub fn to_words(&self) -> [u64; GAIT_STATE_WORDS] {
        let mut writer = Writer { words: [0; GAIT_STATE_WORDS], next: 0 };
        writer.phase(&self.phase);
        writer.side(self.stance);
        writer.foothold(&self.feet.right);
        writer.foothold(&self.feet.left);
        writer.placement(self.placement.as_ref());
        let PreviewState { com, com_velocity, com_acceleration, error_sum } = &self.preview;
        [com, com_velocity, com_acceleration, error_sum].into_iter().for_each(|vector| writer.vector(vector));
        writer.float(self.load.kappa);
        writer.vector(&self.load.shift);
        writer.vector(&self.load.about);
        self.clock.to_words().into_iter().for_each(|word| writer.word(word));
        writer.vector(&self.zmp_ref);
        writer.words
    }

    /// From words; `None` unless [`GaitState::to_words`] could have made them from finite numbers.
    pub fn from_words(words: &[u64; GAIT_STATE_WORDS]) -> Option<Self> {
        let mut reader = Reader { words, next: 0 };
        let state = Self {
            phase: reader.phase()?,
            stance: reader.side()?,
            feet: PerFoot { right: reader.foothold()?, left: reader.foothold()? },
            placement: reader.placement()?,
            preview: PreviewState {
                com: reader.vector()?,
                com_velocity: reader.vector()?,
                com_acceleration: reader.vector()?,
                error_sum: reader.vector()?,
            },
            load: ExternalLoad { kappa: reader.float()?, shift: reader.vector()?, about: reader.vector()? },
            clock: StepClock::from_words([reader.word()?, reader.word()?, reader.word()?, reader.word()?])?,
            zmp_ref: reader.vector()?,
        };
        (state.to_words() == *words).then_some(state)
    }
}

struct Writer {
    words: [u64; GAIT_STATE_WORDS],
    next: usize,
}

impl Writer {
    fn word(&mut self, word: u64) {
        if let Some(slot) = self.words.get_mut(self.next) {
            *slot = word;
        }
        self.next += 1;
    }

    fn float(&mut self, value: f64) {
        self.word(value.to_bits());
    }

    fn vector(&mut self, vector: &Vector2<f64>) {
        self.float(vector.x);
        self.float(vector.y);
    }

    fn side(&mut self, side: Side) {
        self.word(u64::from(side == Side::Left));
    }

    fn ground_pose(&mut self, pose: &GroundPose) {
        self.vector(&pose.position);
        self.float(pose.yaw);
    }

    fn foothold(&mut self, foothold: &Foothold) {
        self.ground_pose(&foothold.pose);
        self.float(foothold.height);
    }

    fn zeros(&mut self, count: usize) {
        (0..count).for_each(|_| self.word(0));
    }

    fn phase(&mut self, phase: &GaitPhase) {
        let (kind, zmp) = match phase {
            GaitPhase::Standing { zmp } => (0, Some(zmp)),
            GaitPhase::ShiftingWeight { zmp_from, .. } => (1, Some(zmp_from)),
            GaitPhase::SingleSupport { .. } => (2, None),
            GaitPhase::DoubleSupport { zmp_from, .. } => (3, Some(zmp_from)),
            GaitPhase::Finishing { zmp_from, .. } => (4, Some(zmp_from)),
        };
        self.word(kind);
        self.vector(&zmp.copied().unwrap_or_default());
        match (phase.planned_step(), phase) {
            (Some(PlannedStep { index, side, to }), _) => {
                self.word(index);
                self.side(side);
                self.ground_pose(&to);
            }
            (None, GaitPhase::SingleSupport { index, .. }) => {
                self.word(*index);
                self.zeros(4);
            }
            (None, _) => self.zeros(5),
        }
        let Some(SwingingFoot { side, swing }) = phase.swinging_foot() else { return self.zeros(16) };
        self.word(1);
        self.side(side);
        self.foothold(&swing.from);
        self.foothold(&swing.to);
        let (kind, at, ticks) = match swing.contact {
            SwingContact::Swinging { force_ticks } => (0, None, force_ticks),
            SwingContact::Landed { at } => (1, Some(at), 0),
            SwingContact::Lowering { at } => (2, Some(at), 0),
        };
        self.word(kind);
        self.foothold(&at.unwrap_or_default());
        self.word(ticks);
    }

    fn placement(&mut self, placement: Option<&FootPlacement>) {
        let Some(placement) = placement else { return self.zeros(9 + 4 * MAX_HANDS) };
        self.word(1);
        self.word(placement.hand_count as u64);
        self.float(placement.heading_at_grasp);
        for rotation in &placement.hand_rotation_at_grasp {
            let q = rotation.quaternion();
            [q.w, q.i, q.j, q.k].into_iter().for_each(|value| self.float(value));
        }
        self.ground_pose(&placement.foot_in_centre.right);
        self.ground_pose(&placement.foot_in_centre.left);
    }
}

struct Reader<'a> {
    words: &'a [u64; GAIT_STATE_WORDS],
    next: usize,
}

impl Reader<'_> {
    fn word(&mut self) -> Option<u64> {
        let word = self.words.get(self.next).copied();
        self.next += 1;
        word
    }

    fn float(&mut self) -> Option<f64> {
        self.word().map(f64::from_bits).filter(|value| value.is_finite())
    }

    fn vector(&mut self) -> Option<Vector2<f64>> {
        Some(Vector2::new(self.float()?, self.float()?))
    }

    fn side(&mut self) -> Option<Side> {
        match self.word()? {
            0 => Some(Side::Right),
            1 => Some(Side::Left),
            _ => None,
        }
    }

    fn ground_pose(&mut self) -> Option<GroundPose> {
        Some(GroundPose { position: self.vector()?, yaw: self.float()? })
    }

    fn foothold(&mut self) -> Option<Foothold> {
        Some(Foothold { pose: self.ground_pose()?, height: self.float()? })
    }

    fn phase(&mut self) -> Option<GaitPhase> {
        let (kind, zmp) = (self.word()?, self.vector()?);
        let step = PlannedStep { index: self.word()?, side: self.side()?, to: self.ground_pose()? };
        let is_swinging = self.word()? == 1;
        let side = self.side()?;
        let (from, to) = (self.foothold()?, self.foothold()?);
        let contact = match (self.word()?, self.foothold()?, self.word()?) {
            (0, _, force_ticks) => SwingContact::Swinging { force_ticks },
            (1, at, _) => SwingContact::Landed { at },
            (2, at, _) => SwingContact::Lowering { at },
            _ => return None,
        };
        let foot = SwingingFoot { side, swing: Swing { from, to, contact } };
        let landing = is_swinging.then_some(foot);
        match kind {
            0 => Some(GaitPhase::Standing { zmp }),
            1 => Some(GaitPhase::ShiftingWeight { zmp_from: zmp, step }),
            2 => Some(GaitPhase::SingleSupport { index: step.index, foot }),
            3 => Some(GaitPhase::DoubleSupport { zmp_from: zmp, step, landing }),
            4 => Some(GaitPhase::Finishing { zmp_from: zmp, landing }),
            _ => None,
        }
    }

    fn placement(&mut self) -> Option<Option<FootPlacement>> {
        let (has, count, heading_at_grasp) = (self.word()?, self.word()?, self.float()?);
        let mut hand_rotation_at_grasp = [UnitQuaternion::identity(); MAX_HANDS];
        for rotation in &mut hand_rotation_at_grasp {
            let q = Quaternion::new(self.float()?, self.float()?, self.float()?, self.float()?);
            // Not normalised: the bits must come back as they went.
            *rotation = Unit::new_unchecked(q);
        }
        let foot_in_centre = PerFoot { right: self.ground_pose()?, left: self.ground_pose()? };
        let placement = FootPlacement {
            hand_rotation_at_grasp,
            hand_count: usize::try_from(count).ok().filter(|count| *count <= MAX_HANDS)?,
            heading_at_grasp,
            foot_in_centre,
        };
        Some((has == 1).then_some(placement))
    }
}
