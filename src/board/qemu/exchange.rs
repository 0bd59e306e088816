//! What waits between two exchanges with the host. Control and link write it, idle carries it over.

use core::cell::RefCell;
use critical_section::Mutex;
use heapless::{Deque, Vec};
use servo::axis::{Bridge, Sample};

/// Bytes of the fixed part of a message, either way.
pub const HEAD: usize = 12;
/// Longest message, bytes.
pub const FRAME: usize = HEAD + LINK;
/// Link bytes that one exchange can carry: several telemetry frames and answers.
const LINK: usize = 2048;

/// Longest delay of the PWM that `Config` allows, and the tick itself.
const DELAY_LINE: usize = 4;

pub struct Exchange {
    pub sample: Sample,
    pub delay_ticks: u8,
    /// What the axis has decided, newest first.
    decided: [(Bridge, i16); DELAY_LINE],
    pub incoming: Deque<u8, LINK>,
    pub outgoing: Vec<u8, LINK>,
}

static EXCHANGE: Mutex<RefCell<Exchange>> = Mutex::new(RefCell::new(Exchange {
    sample: Sample {
        count: 0,
        vbus_raw: Sample::VBUS_NOT_MEASURED,
        current_raw: Sample::CURRENT_NOT_SENSED,
    },
    delay_ticks: 1,
    decided: [(Bridge::Open, 0); DELAY_LINE],
    incoming: Deque::new(),
    outgoing: Vec::new(),
}));

pub fn with<R>(access: impl FnOnce(&mut Exchange) -> R) -> R {
    critical_section::with(|cs| access(&mut EXCHANGE.borrow(cs).borrow_mut()))
}

impl Exchange {
    pub fn drive(&mut self, bridge: Bridge, duty: i16) {
        self.decided.rotate_right(1);
        self.decided[0] = (bridge, duty);
    }

    /// What does not fit is lost, as on any line.
    pub fn hear(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            let _ = self.incoming.push_back(byte);
        }
    }

    /// Fills `frame`, empties the outgoing bytes, returns the length.
    pub fn take_frame(&mut self, tick: u32, off: bool, frame: &mut [u8; FRAME]) -> usize {
        let (bridge, duty) = match off {
            true => (Bridge::Open, 0),
            false => self.decided[usize::from(self.delay_ticks) % DELAY_LINE],
        };
        let length = self.outgoing.len();
        frame[0..4].copy_from_slice(&tick.to_le_bytes());
        frame[4..6].copy_from_slice(&duty.to_le_bytes());
        frame[6..8].copy_from_slice(&[bridge as u8, 0]);
        frame[8..HEAD].copy_from_slice(&(length as u32).to_le_bytes());
        frame[HEAD..HEAD + length].copy_from_slice(&self.outgoing);
        self.outgoing.clear();
        HEAD + length
    }

    /// Takes the fixed part of an answer; returns the number of link bytes that follow and whether to stop.
    pub fn take_answer(&mut self, head: &[u8; HEAD]) -> (usize, bool) {
        let half = |at: usize| [head[at], head[at + 1]];
        self.sample = Sample {
            count: i32::from_le_bytes([head[0], head[1], head[2], head[3]]),
            vbus_raw: u16::from_le_bytes(half(4)),
            current_raw: i16::from_le_bytes(half(6)),
        };
        let length = usize::from(u16::from_le_bytes(half(8))).min(LINK);
        (length, u16::from_le_bytes(half(10)) != 0)
    }
}
