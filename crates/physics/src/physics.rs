//! What a bridge asks of a world.

use crate::{BuildWorldError, LoadWorldError, StepWorldError};
use mikoshi_config::RunSpec;
use mikoshi_ipc_types::{JointCommand, ObjectTruth, Push, RobotTruth, Sensors};

/// One physical world: the robots of a run, their object, the floor, and what stands on it.
///
/// # What is of which time
/// After tick k's [`step`](Self::step) the world is at tick k + 1. Positions and velocities are of that
/// instant. Forces and accelerations belong to the way there: they are those of the last physics step,
/// unfiltered; where a frame says so, they are averaged over all physics steps of the tick.
pub trait Physics: Sized {
    /// Who computes it, for people.
    const ENGINE: &'static str;

    /// The world at tick 0, with the hands on the object if the run begins so.
    ///
    /// # Errors
    /// A run that no world can be built from.
    fn new(run: &RunSpec) -> Result<Self, BuildWorldError>;

    /// Number of robots.
    fn robot_count(&self) -> usize;

    /// Names the model and the engine: worlds that have the same can load one another's checkpoints.
    fn fingerprint(&self) -> u64;

    /// Lower and upper limit of every joint, by robot.
    fn joint_limits(&self) -> impl Iterator<Item = Vec<[f64; 2]>>;

    /// The commands of the last tick.
    fn commands(&self) -> &[JointCommand];

    /// Pushes a body from the next step on, whatever pushed it before.
    fn push(&mut self, push: &Push);

    /// Says in the next readings whose joint command could not be used: bit r for robot r.
    fn note_rejected(&mut self, robots: u64);

    /// The tick that the world is at.
    fn tick(&self) -> u64;

    /// What robot `robot`'s sensors say at this tick.
    fn sense(&self, robot: usize, sensors: &mut Sensors);

    /// Robot `robot` as it truly is.
    fn robot_truth(&self, robot: usize, truth: &mut RobotTruth);

    /// The object as it truly is.
    fn object_truth(&self, truth: &mut ObjectTruth);

    /// Advances by one tick. References run linearly from the last commands to these, and reach them
    /// in the last physics step; the rates feed the drives' damping forward.
    ///
    /// # Errors
    /// Commands that cannot be followed leave the world as it is. After a result that is not physics the
    /// world must not be used any more, except to be loaded.
    fn step(&mut self, commands: &[JointCommand]) -> Result<(), StepWorldError>;

    /// Bytes of a checkpoint; 0 of a world that keeps none, so that no successor can go on in it.
    fn checkpoint_size(&self) -> usize;

    /// Writes all that matters into the first [`checkpoint_size`](Self::checkpoint_size) bytes.
    ///
    /// # Errors
    /// There are not as many bytes.
    fn save(&mut self, checkpoint: &mut [u8]) -> Result<(), LoadWorldError>;

    /// Returns to a checkpoint of a world of the same run. What follows is the same to the last bit.
    ///
    /// # Errors
    /// There are not as many bytes as a checkpoint of this world has, or it keeps none.
    fn load(&mut self, checkpoint: &[u8]) -> Result<(), LoadWorldError>;
}
