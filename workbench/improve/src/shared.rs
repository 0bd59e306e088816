//! One way to the servo for several sessions, one after the other: a recording, the runs of a trial, a look at what is in
//! force. What is in force and where the shaft stands outlives each of them.

use std::cell::{Cell, RefCell};
use std::rc::Rc;
use truing_core::text::input_error::InputError;
use truing_servo::device::link::Wire;

/// Clients of one line begin so far apart that no answer to one is taken for an answer to another.
const APART: u16 = 0x1111;

/// A wire that stays open when a session closes it.
#[derive(Clone)]
pub struct Shared {
    wire: Rc<RefCell<Box<dyn Wire>>>,
    clients: Rc<Cell<u16>>,
}

impl Shared {
    /// The wire is closed when the last copy is dropped.
    pub fn new(wire: Box<dyn Wire>) -> Self {
        Self { wire: Rc::new(RefCell::new(wire)), clients: Rc::default() }
    }

    /// For one session.
    pub fn line(&self) -> Box<dyn Wire> {
        self.clients.set(self.clients.get().wrapping_add(1));
        Box::new(self.clone())
    }
}

impl Wire for Shared {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        self.wire.borrow_mut().turn(outgoing, incoming)
    }

    fn first_number(&self) -> u16 {
        self.wire.borrow().first_number().wrapping_add(self.clients.get().wrapping_mul(APART))
    }
}
