//! Who drives: one process at a time may say how the object shall move.

use crate::board::Board;
use crate::process::ProcessIdentity;
use mikoshi_ipc_types::{Drive, TwistWire};
use std::io;

/// Why somebody may not drive.
#[derive(Debug, thiserror::Error)]
pub enum TakeWheelError {
    /// Another process does.
    #[error("process {} drives", .0.pid)]
    Taken(ProcessIdentity),
    /// Who this process is can't be found out.
    #[error("{0}")]
    Io(#[from] io::Error),
}

/// The right to drive a run. It ends when this is dropped, when its process ends, or when another one takes it over.
pub struct Driver {
    board: Board,
    own: ProcessIdentity,
    number: u64,
}

impl Driver {
    /// Takes the wheel of the run with this board, `by_force` even if another living process has it.
    ///
    /// # Errors
    /// Another one drives.
    pub fn take_wheel(board: Board, by_force: bool) -> Result<Self, TakeWheelError> {
        let own = ProcessIdentity::own()?;
        board.take_wheel(own, by_force).map_err(TakeWheelError::Taken)?;
        let number = board.drive().number;
        Ok(Self { board, own, number })
    }

    /// Says how the object shall move; false if another process drives by now.
    pub fn say(&mut self, twist: TwistWire, squeeze_n: f64) -> bool {
        if self.board.driver() != Some(self.own) {
            return false;
        }
        self.number = self.number.max(self.board.drive().number) + 1;
        self.board.set_drive(&Drive { number: self.number, twist, squeeze_n });
        true
    }

    /// The board of the run.
    pub fn board(&self) -> &Board {
        &self.board
    }
}

impl Drop for Driver {
    fn drop(&mut self) {
        self.board.leave_wheel(self.own);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mikoshi_ipc_types::{OperatorInput, ServiceId};

    #[test]
    fn one_drives_at_a_time_and_another_only_by_force() {
        let directory = tempfile::tempdir().expect("a directory");
        let services: Vec<_> = ServiceId::of_team(2).collect();
        let board = Board::create(directory.path(), &services, false).expect("a board");
        let take = |by_force| Driver::take_wheel(Board::open(directory.path()).expect("a board"), by_force);
        let mut driver = take(false).expect("nobody drives");
        assert!(matches!(take(false), Err(TakeWheelError::Taken(_))));
        assert!(driver.say([0.1, 0.0, 0.0, 0.0, 0.0, 0.2], 3.0));
        let heard = board.operator_input(&OperatorInput::default());
        assert_eq!((heard.word, heard.drive.number), (0, 1));
        assert_eq!((heard.drive.twist[5], heard.drive.squeeze_n), (0.2, 3.0));

        // One that was killed leaves its name.
        let dead = ProcessIdentity { start_time: driver.own.start_time + 1, ..driver.own };
        driver.own = dead;
        assert!(!driver.say([0.0; 6], 0.0), "another one drives");
        drop(driver);
        let mut other = take(true).expect("it may be driven over");
        assert!(other.say([0.0; 6], 0.0));
        assert_eq!(board.drive().number, 2, "numbers go on");
        drop(other);
        board.take_wheel(dead, false).expect("nobody drives");
        assert!(take(false).is_ok(), "the dead don't drive");
    }

    #[test]
    fn what_is_not_made_of_numbers_is_not_heard() {
        let directory = tempfile::tempdir().expect("a directory");
        let services: Vec<_> = ServiceId::of_team(2).collect();
        let board = Board::create(directory.path(), &services, false).expect("a board");
        let last =
            OperatorInput { drive: Drive { number: 5, ..Drive::default() }, ..OperatorInput::default() };
        assert_eq!(board.operator_input(&last), last, "nobody has ever driven");
        for twist in [[f64::NAN; 6], [0.0, f64::INFINITY, 0.0, 0.0, 0.0, 0.0]] {
            board.set_drive(&Drive { number: 6, twist, squeeze_n: 0.0 });
            assert_eq!(board.operator_input(&last), last);
        }
        board.set_drive(&Drive { number: 6, twist: [0.0; 6], squeeze_n: f64::NAN });
        assert_eq!(board.operator_input(&last), last);
    }
}
