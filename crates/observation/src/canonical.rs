//! The identity of a run: every payload of every service, in one canonical order.

use mikoshi_ipc_types::{
    Envelope, Field, Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand,
    TeamState,
};

/// All frames of one tick; in wall-clock time, of those that were lost the last that came.
#[derive(Clone, Debug)]
#[allow(missing_docs)]
pub struct Observation {
    pub sensors: Vec<Frame<Sensors>>,
    pub object_truth: Frame<ObjectTruth>,
    pub robot_truth: Vec<Frame<RobotTruth>>,
    pub robot_state: Vec<Frame<RobotState>>,
    pub team_command: Vec<Frame<TeamCommand>>,
    pub team_state: Frame<TeamState>,
    pub joint_command: Vec<Frame<JointCommand>>,
}

/// A payload that every tick has for each robot, or once for the team.
pub trait Observed: Payload {
    /// Its frames in a tick, by robot.
    fn of(observation: &Observation) -> &[Frame<Self>];
}

macro_rules! observed {
    ($($payload:ident: $observation:ident => $frames:expr),* $(,)?) => {
        $(impl Observed for $payload {
            fn of($observation: &Observation) -> &[Frame<Self>] {
                $frames
            }
        })*
    };
}

observed! {
    Sensors: observation => &observation.sensors,
    ObjectTruth: observation => core::slice::from_ref(&observation.object_truth),
    RobotTruth: observation => &observation.robot_truth,
    RobotState: observation => &observation.robot_state,
    TeamCommand: observation => &observation.team_command,
    TeamState: observation => core::slice::from_ref(&observation.team_state),
    JointCommand: observation => &observation.joint_command,
}

/// One payload of a tick, as bytes.
#[derive(Clone, Copy, Debug)]
pub struct PayloadRef<'a> {
    /// [`Payload::NAME`].
    pub name: &'static str,
    /// Index of the robot, or 0.
    pub robot: usize,
    /// The tick it belongs to.
    pub tick: u64,
    /// The payload itself.
    pub bytes: &'a [u8],
}

impl PayloadRef<'_> {
    /// The payload, if it is a `P`.
    pub fn read<P: Payload>(&self) -> Option<P> {
        (self.name == P::NAME).then(|| bytemuck::try_pod_read_unaligned(self.bytes).ok()).flatten()
    }

    /// The field that holds the byte at `offset_bytes`.
    pub fn field_at(&self, offset_bytes: usize) -> Option<&'static Field> {
        let kind = Kind::ALL.iter().find(|kind| kind.name == self.name)?;
        let mut fields = kind.fields.iter();
        fields
            .find(|field| (field.offset_bytes..field.offset_bytes + field.size_bytes).contains(&offset_bytes))
    }
}

/// A payload type as data.
pub(crate) struct Kind {
    pub name: &'static str,
    pub type_name: &'static str,
    pub fields: &'static [Field],
    pub size_bytes: usize,
    /// One for each robot, or one for the team.
    pub is_per_robot: bool,
}

impl Kind {
    /// Every payload, in the order in which a tick produces them.
    pub const ALL: &[Self] = &[
        Self::of::<Sensors>(true),
        Self::of::<ObjectTruth>(false),
        Self::of::<RobotTruth>(true),
        Self::of::<RobotState>(true),
        Self::of::<TeamCommand>(true),
        Self::of::<TeamState>(false),
        Self::of::<JointCommand>(true),
    ];

    const fn of<P: Payload>(is_per_robot: bool) -> Self {
        let (name, type_name, fields) = (P::NAME, P::TYPE_NAME, P::FIELDS);
        Self { name, type_name, fields, size_bytes: size_of::<P>(), is_per_robot }
    }

    /// How many of them a tick of a team has.
    pub fn count(&self, robots: usize) -> usize {
        if self.is_per_robot { robots } else { 1 }
    }
}

impl Observation {
    /// Zeroed frames for a team.
    pub fn for_team(robots: usize) -> Self {
        Self {
            sensors: vec![Frame::zeroed(); robots],
            object_truth: Frame::zeroed(),
            robot_truth: vec![Frame::zeroed(); robots],
            robot_state: vec![Frame::zeroed(); robots],
            team_command: vec![Frame::zeroed(); robots],
            team_state: Frame::zeroed(),
            joint_command: vec![Frame::zeroed(); robots],
        }
    }

    /// The tick that all frames belong to.
    pub fn tick(&self) -> u64 {
        self.object_truth.envelope.tick
    }

    /// Puts a payload in its place; `false` if it has none here.
    pub fn take(&mut self, payload: &PayloadRef<'_>) -> bool {
        fn put<P: Payload>(frames: &mut [Frame<P>], payload: &PayloadRef<'_>) -> Option<()> {
            let frame = frames.get_mut(payload.robot)?;
            frame.payload = payload.read()?;
            frame.envelope = Envelope {
                schema_hash: P::SCHEMA_HASH,
                tick: payload.tick,
                robot: payload.robot as u64,
                ..Envelope::default()
            };
            Some(())
        }
        let taken = match payload.name {
            Sensors::NAME => put(&mut self.sensors, payload),
            ObjectTruth::NAME => put(core::slice::from_mut(&mut self.object_truth), payload),
            RobotTruth::NAME => put(&mut self.robot_truth, payload),
            RobotState::NAME => put(&mut self.robot_state, payload),
            TeamCommand::NAME => put(&mut self.team_command, payload),
            TeamState::NAME => put(core::slice::from_mut(&mut self.team_state), payload),
            JointCommand::NAME => put(&mut self.joint_command, payload),
            _ => None,
        };
        taken.is_some()
    }

    /// Whether a frame of this observation is of its tick. In wall-clock time it may have been lost, and is what
    /// came last.
    pub fn is_of_tick<P: Payload>(&self, frame: &Frame<P>) -> bool {
        frame.envelope.tick == self.tick()
    }

    /// Every payload of the tick, in the order in which a tick produces them.
    pub fn for_each_payload(&self, mut visit: impl FnMut(PayloadRef<'_>)) {
        let this_tick = self.tick();
        let mut visit = |payload: PayloadRef<'_>| {
            if payload.tick == this_tick {
                visit(payload);
            }
        };
        fn each<P: Payload>(frames: &[Frame<P>], visit: &mut impl FnMut(PayloadRef<'_>)) {
            for (robot, frame) in frames.iter().enumerate() {
                let bytes = bytemuck::bytes_of(&frame.payload);
                visit(PayloadRef { name: P::NAME, robot, tick: frame.envelope.tick, bytes });
            }
        }
        each(&self.sensors, &mut visit);
        each(core::slice::from_ref(&self.object_truth), &mut visit);
        each(&self.robot_truth, &mut visit);
        each(&self.robot_state, &mut visit);
        each(&self.team_command, &mut visit);
        each(core::slice::from_ref(&self.team_state), &mut visit);
        each(&self.joint_command, &mut visit);
    }
}

/// One hash over the payload of every frame of every service, in canonical order.
#[derive(Clone, Debug, Default)]
pub struct LogHash {
    hasher: blake3::Hasher,
}

impl LogHash {
    /// Takes in all frames of a tick.
    pub fn observe(&mut self, observation: &Observation) {
        observation.for_each_payload(|payload| {
            self.hasher.update(payload.name.as_bytes());
            self.hasher.update(&(payload.robot as u64).to_le_bytes());
            self.hasher.update(&payload.tick.to_le_bytes());
            self.hasher.update(payload.bytes);
        });
    }

    /// The hash so far, in hexadecimal.
    pub fn to_hex(&self) -> String {
        self.hasher.finalize().to_hex().to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash_of(observation: &Observation) -> String {
        let mut hash = LogHash::default();
        hash.observe(observation);
        hash.to_hex()
    }

    #[test]
    fn flipping_one_bit_of_any_payload_changes_the_hash() {
        let undisturbed = hash_of(&Observation::for_team(2));
        let mut flips = 0;
        let mut check = |disturb: &dyn Fn(&mut Observation)| {
            let mut observation = Observation::for_team(2);
            disturb(&mut observation);
            assert_ne!(hash_of(&observation), undisturbed);
            flips += 1;
        };
        check(&|o| bytemuck::bytes_of_mut(&mut o.sensors[1].payload)[17] ^= 1);
        check(&|o| bytemuck::bytes_of_mut(&mut o.object_truth.payload)[0] ^= 1);
        check(&|o| bytemuck::bytes_of_mut(&mut o.robot_truth[0].payload)[99] ^= 128);
        check(&|o| bytemuck::bytes_of_mut(&mut o.robot_state[1].payload)[8] ^= 2);
        check(&|o| bytemuck::bytes_of_mut(&mut o.team_command[0].payload)[3] ^= 4);
        check(&|o| bytemuck::bytes_of_mut(&mut o.team_state.payload)[1000] ^= 8);
        check(&|o| bytemuck::bytes_of_mut(&mut o.joint_command[1].payload)[512] ^= 16);
        assert_eq!(flips, 7);
    }

    #[test]
    fn epoch_and_stamp_lie_outside_the_identity() {
        let undisturbed = hash_of(&Observation::for_team(1));
        let mut observation = Observation::for_team(1);
        observation.sensors[0].envelope.epoch = 7;
        observation.sensors[0].envelope.stamp_ns = 123;
        assert_eq!(hash_of(&observation), undisturbed);
    }
}
