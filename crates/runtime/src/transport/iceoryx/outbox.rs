//! Where frames are sent from, with room for the next one before that is asked for.
//!
//! To lend room takes more time than to send: it takes back what receivers have returned, whose lines of memory they
//! wrote last, and fills the frame with zeros where one of them has read the frame before. None of it has to be done
//! between an input and what is said to it.

use core::cell::RefCell;
use core::mem::MaybeUninit;
use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::Publisher as IceoryxPort;
use iceoryx2::prelude::ipc;
use iceoryx2::sample_mut::SampleMut;
use mikoshi_ipc_types::{Frame, Payload};
use std::rc::Rc;

/// Room for one frame of a topic in shared memory.
pub(super) type Blank<P> = SampleMut<ipc::Service, Frame<P>, ()>;

/// What sends the frames of one topic.
pub(super) struct Outbox<P: Payload> {
    port: Rc<IceoryxPort<ipc::Service, Frame<P>, ()>>,
    next: RefCell<Option<Blank<P>>>,
}

/// Of any topic.
pub(super) trait Restock {
    /// Has room for the next frame, if there is any.
    fn restock(&self);
}

impl<P: Payload> Outbox<P> {
    pub(super) fn new(port: Rc<IceoryxPort<ipc::Service, Frame<P>, ()>>) -> Self {
        Self { port, next: RefCell::new(None) }
    }

    /// A frame of zeros.
    pub(super) fn take(&self) -> Result<Blank<P>, LoanError> {
        self.next.take().map_or_else(|| self.lend(), Ok)
    }

    fn lend(&self) -> Result<Blank<P>, LoanError> {
        let mut sample = self.port.loan_uninit()?;
        *sample.payload_mut() = MaybeUninit::zeroed();
        // SAFETY: a frame consists of `Pod` values, for which all zeros are valid, and it was zeroed in
        // the line above.
        Ok(unsafe { sample.assume_init() })
    }
}

impl<P: Payload> Restock for Outbox<P> {
    fn restock(&self) {
        let mut next = self.next.borrow_mut();
        if next.is_none() {
            // That there is no room is told to whoever asks for it.
            *next = self.lend().ok();
        }
    }
}
