//! Mikoshi's observer: a team that carries for somebody is recorded, so this one is, too.

use crate::driver::DriverError;
use mikoshi_ipc_types::{
    Frame, JointCommand, ObjectTruth, Payload, RobotState, RobotTruth, Sensors, TeamCommand, TeamState,
};
use mikoshi_runtime::{IceoryxTap, InOrder, Member, Role, State, Tap, TickError, TickSchedule};
use std::path::Path;

type Take = Box<dyn FnMut() -> Result<bool, TickError>>;

/// Copies every frame of every service out of shared memory.
pub struct EveryFrame {
    tap: IceoryxTap,
    board: mikoshi_runtime::Board,
    is_started: bool,
    /// One for each topic, and the ticks that it has taken.
    topics: Vec<(Take, u64)>,
}

impl EveryFrame {
    /// Of the run in this directory, in this place on its board.
    pub fn open(place: &Path, member: Member, schedule: &TickSchedule) -> Result<Self, DriverError> {
        let board = mikoshi_runtime::Board::open(place).map_err(DriverError::of)?;
        let tap = IceoryxTap::open(place, member, schedule).map_err(DriverError::of)?;
        let robots = schedule.services().iter().filter_map(|service| service.robot()).count();
        let mut topics = Vec::new();
        for robot in 0..robots {
            topics.push((taking::<Sensors>(&tap, robot)?, 0));
            topics.push((taking::<RobotTruth>(&tap, robot)?, 0));
            topics.push((taking::<RobotState>(&tap, robot)?, 0));
            topics.push((taking::<TeamCommand>(&tap, robot)?, 0));
            topics.push((taking::<JointCommand>(&tap, robot)?, 0));
        }
        topics.push((taking::<ObjectTruth>(&tap, 0)?, 0));
        topics.push((taking::<TeamState>(&tap, 0)?, 0));
        Ok(Self { tap, board, is_started: false, topics })
    }

    /// Takes all that is there.
    pub fn take(&mut self) -> Result<(), DriverError> {
        if !self.is_started {
            let is_wired = |(role, state)| !matches!(role, Role::Service(_)) || state >= State::Wired;
            if self.board.states().all(is_wired) {
                self.tap.start().map_err(DriverError::of)?;
                self.is_started = true;
            }
            return Ok(());
        }
        for (take, ticks) in &mut self.topics {
            while take().map_err(DriverError::of)? {
                *ticks += 1;
            }
        }
        self.tap.set_consumed(self.topics.iter().map(|(_, ticks)| *ticks).min().unwrap_or(0));
        Ok(())
    }
}

fn taking<P: Payload>(tap: &IceoryxTap, robot: usize) -> Result<Take, DriverError> {
    let mut observer = InOrder::new(tap.observer::<P>(robot).map_err(DriverError::of)?);
    let mut frame = Box::new(Frame::zeroed());
    Ok(Box::new(move || observer.try_receive(&mut frame)))
}
