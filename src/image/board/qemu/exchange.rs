//! What waits between two exchanges with the host. Control and link write it, idle carries it over.

use super::AXES;
use core::cell::RefCell;
use critical_section::Mutex;
use heapless::{Deque, Vec};
use servo::axis::{Bridge, Sample};
use servo::protect::Interlock;

/// Bytes of a message to the host in front of the link bytes.
const HEAD_OUT: usize = 8 + 4 * AXES;
/// Bytes of a message from the host in front of the link bytes.
pub const HEAD: usize = 4 + 8 * AXES;
/// Longest message, bytes.
pub const FRAME: usize = HEAD_OUT + HEAD + LINK;
/// Link bytes that one exchange can carry: several telemetry frames and answers.
const LINK: usize = 2048;

/// Flags of an answer: end the program; the tick took too long; the enable contact is open; the bridge reports a fault.
const STOP: u8 = 1;
const OVERRUN: u8 = 2;
const DISABLED: u8 = 4;
const BRIDGE_FAULT: u8 = 8;
/// The encoder's index pulse is there.
const INDEX: u8 = 16;

/// Longest delay of the PWM that `Config` allows, and the tick itself.
const DELAY_LINE: usize = 4;

/// One motor.
pub struct Axis {
    pub sample: Sample,
    pub delay_ticks: u8,
    /// What the axis has decided, newest first.
    decided: [(Bridge, i16); DELAY_LINE],
}

impl Axis {
    const NEW: Self = Self { sample: Sample::NONE, delay_ticks: 1, decided: [(Bridge::Open, 0); DELAY_LINE] };

    pub fn drive(&mut self, bridge: Bridge, duty: i16) {
        self.decided.rotate_right(1);
        self.decided[0] = (bridge, duty);
    }

    fn acting(&self, off: bool) -> (Bridge, i16) {
        match off {
            true => (Bridge::Open, 0),
            false => self.decided[usize::from(self.delay_ticks) % DELAY_LINE],
        }
    }
}

pub struct Exchange {
    pub axes: [Axis; AXES],
    flags: u8,
    pub incoming: Deque<u8, LINK>,
    pub outgoing: Vec<u8, LINK>,
}

static EXCHANGE: Mutex<RefCell<Exchange>> = Mutex::new(RefCell::new(Exchange {
    axes: [Axis::NEW; AXES],
    flags: 0,
    incoming: Deque::new(),
    outgoing: Vec::new(),
}));

pub fn with<R>(access: impl FnOnce(&mut Exchange) -> R) -> R {
    critical_section::with(|cs| access(&mut EXCHANGE.borrow(cs).borrow_mut()))
}

impl Exchange {
    pub fn overrun(&self) -> bool {
        self.flags & OVERRUN != 0
    }

    pub fn index(&self) -> bool {
        self.flags & INDEX != 0
    }

    pub fn interlock(&self) -> Interlock {
        match self.flags {
            flags if flags & DISABLED != 0 => Interlock::Disabled,
            flags if flags & BRIDGE_FAULT != 0 => Interlock::BridgeFault,
            _ => Interlock::Granted,
        }
    }

    /// What does not fit is lost, as on any line.
    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let _ = self.incoming.push_back(byte);
        }
    }

    /// Fills `frame`, empties the outgoing bytes, returns the length.
    pub fn take_frame(&mut self, tick: u32, off: bool, frame: &mut [u8; FRAME]) -> usize {
        let length = self.outgoing.len();
        frame[0..4].copy_from_slice(&tick.to_le_bytes());
        frame[4..6].copy_from_slice(&(length as u16).to_le_bytes());
        frame[6..8].copy_from_slice(&(AXES as u16).to_le_bytes());
        for (axis, place) in self.axes.iter().zip(frame[8..HEAD_OUT].chunks_exact_mut(4)) {
            let (bridge, duty) = axis.acting(off);
            place[0..2].copy_from_slice(&duty.to_le_bytes());
            place[2..4].copy_from_slice(&[bridge as u8, 0]);
        }
        frame[HEAD_OUT..HEAD_OUT + length].copy_from_slice(&self.outgoing);
        self.outgoing.clear();
        HEAD_OUT + length
    }

    /// Takes the fixed part of an answer; returns the number of link bytes that follow and whether to stop.
    pub fn take_answer(&mut self, head: &[u8; HEAD]) -> (usize, bool) {
        for (axis, bytes) in self.axes.iter_mut().zip(head[4..].chunks_exact(8)) {
            let half = |at: usize| [bytes[at], bytes[at + 1]];
            axis.sample = Sample {
                count: i32::from_le_bytes([bytes[0], bytes[1], bytes[2], bytes[3]]),
                vbus_raw: u16::from_le_bytes(half(4)),
                current_raw: i16::from_le_bytes(half(6)),
            };
        }
        self.flags = head[2];
        let length = usize::from(u16::from_le_bytes([head[0], head[1]])).min(LINK);
        (length, self.flags & STOP != 0)
    }
}
