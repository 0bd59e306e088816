//! Gate drivers of a board: their pins become an SPI, and idle looks after them.

use super::board::{GATES, Gates as Described};
use super::delay::{self, Clocks};
use super::gpio::Wire;
use core::sync::atomic::{AtomicU32, Ordering};
use servo::drivers::bit_bang::BitBang;
use servo::drivers::drv8301::Drv8301;
use servo::drivers::gates::{Event, GateStatus, Gates};
use servo::link::board::{GateTrouble, Gates as Report};

/// Chips that a board can have: one an axis.
const MOST: usize = match GATES {
    Some(gates) => gates.selects.len(),
    None => 0,
};
/// Longer than the first start takes.
const FIRST_START_MS: u32 = 30;

/// What control and idle know of them.
pub static STATUS: GateStatus = GateStatus::new();

/// [`GateTrouble::code`] of their last trouble.
static TROUBLE: AtomicU32 = AtomicU32::new(0);

/// Keeps what is wrong for whoever asks over the link.
pub fn note(event: &Event) {
    if let Event::NotStarted(number, trouble) | Event::Fault(number, trouble) = *event {
        TROUBLE.store(GateTrouble { driver: number as u8, trouble }.code(), Ordering::Relaxed);
    }
}

/// How they are, if there are some.
pub fn report() -> Option<Report> {
    GATES.map(|_| Report { state: STATUS.state(), trouble: TROUBLE.load(Ordering::Relaxed) })
}

/// Those of this board, if it has some.
pub struct Supervised(Option<Gates<'static, Wire, Wire, BitBang<Wire, Wire, Clocks>, MOST>>);

/// Select lines are high before they become outputs.
pub fn rest_lines() {
    if let Some(gates) = GATES {
        gates.selects.iter().for_each(|select| Wire(*select).drive(true));
    }
}

impl Supervised {
    /// Starts them, once. The bridges are open, and whatever does not come up now is tried again by idle.
    pub fn start(told: impl FnMut(Event)) -> Self {
        let mut supervised = Self(GATES.map(|described| prepare(&described)));
        supervised.first_start(told);
        supervised
    }

    fn first_start(&mut self, mut told: impl FnMut(Event)) {
        let begin = delay::now();
        while GATES.is_some() && delay::now().wrapping_sub(begin) < FIRST_START_MS * delay::CLOCKS_PER_MS {
            if let Some(event) = self.turn() {
                return told(event);
            }
        }
    }

    /// One look.
    pub fn turn(&mut self) -> Option<Event> {
        // Known when the image is built: without gate drivers nothing of this is in it.
        match const { GATES.is_some() } {
            true => self.0.as_mut()?.turn(delay::now()),
            false => None,
        }
    }
}

fn prepare(described: &Described) -> Gates<'static, Wire, Wire, BitBang<Wire, Wire, Clocks>, MOST> {
    let [clock, out, input] = described.spi.map(Wire);
    let drivers = core::array::from_fn(|number| {
        let spi = BitBang::new(clock, out, input, Wire(described.selects[number]), Clocks);
        Drv8301::new(spi, described.settings)
    });
    let lines = (Wire(described.enable), Wire(described.fault));
    Gates::new(&STATUS, lines, drivers, delay::now(), delay::CLOCKS_PER_MS)
}
