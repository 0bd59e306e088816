//! Gate drivers behind one enable line and one fault line: started, watched, and started anew after a fault.
//!
//! ```text
//! control                                  idle
//! Ready ──fault line low──> Tripped
//!           all bridges open ──> Wanted ── reason read, enable low ──> Starting ──20 ms, set up, read back──> Ready
//!                                                                        └─────────── Failed <── anything else
//! Ready <──────────────────────────────────────────────── again after a rest ─┘
//! ```
//!
//! A latched fault of a DRV8301 ends with a low enable line: less than 10 µs for the gates alone, more than 20 µs for the
//! whole chip, and nothing between (SLOS719, EN_GATE). Here it is always the whole chip, because a gate supply that was too high
//! ends in no other way, and because the registers are then written and read back anew. It rests first, for the shaft to
//! come to rest: the drivers may not start when a terminal of the motor stands above 8.5 V (SLOS719, section 8.1.1).

use super::drv8301::{Drv8301, Faults, Trouble};
use core::sync::atomic::{AtomicU8, Ordering};
use embedded_hal::digital::{InputPin, OutputPin};
use embedded_hal::spi::SpiDevice;

/// Until the first start: the enable line was low since reset.
const FIRST_REST_MS: u32 = 1;
/// With the enable line low after a fault or a failed start, so that the shaft stands still.
const REST_MS: u32 = 500;
/// From enable to the first frame: 10 ms at most until a DRV8301 answers (SLOS719, SPI ready after power-up), doubled.
const WAKING_MS: u32 = 20;
/// Between two looks at the registers.
const WATCHING_MS: u32 = 100;

/// What control and idle know of the gate drivers. Each state is left by one of the two alone; only [`State::Ready`] is left by
/// either, to the same state.
pub struct GateStatus(AtomicU8);

/// Its states.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum State {
    /// On their way up. Left by idle.
    Starting = 0,
    /// Set up and checked.
    Ready = 1,
    /// A fault; bridges may still be driven. Left by control.
    Tripped = 2,
    /// All bridges are open. Left by idle.
    Wanted = 3,
    /// They did not come up. Left by idle, after a rest.
    Failed = 4,
}

impl State {
    /// The state of this number.
    pub const fn of(number: u8) -> Self {
        match number {
            1 => State::Ready,
            2 => State::Tripped,
            3 => State::Wanted,
            4 => State::Failed,
            _ => State::Starting,
        }
    }
}

impl GateStatus {
    /// Nothing started.
    pub const fn new() -> Self {
        Self(AtomicU8::new(State::Starting as u8))
    }

    /// The state.
    pub fn state(&self) -> State {
        State::of(self.0.load(Ordering::Relaxed))
    }

    fn set(&self, state: State) {
        self.0.store(state as u8, Ordering::Relaxed);
    }

    /// Control's look: may bridges *not* be driven? `low`: the fault line is low.
    pub fn is_off(&self, low: bool) -> bool {
        if low {
            self.trip();
        }
        self.state() != State::Ready
    }

    /// Are the drivers' amplifiers on, with their gain set? `low`: the fault line is low, as it is without a supply.
    pub fn measures(&self, low: bool) -> bool {
        !low && self.state() == State::Ready
    }

    /// Control's word that every bridge is open.
    pub fn all_open(&self) {
        if self.state() == State::Tripped {
            self.set(State::Wanted);
        }
    }

    fn trip(&self) {
        if self.state() == State::Ready {
            self.set(State::Tripped);
        }
    }
}

impl Default for GateStatus {
    fn default() -> Self {
        Self::new()
    }
}

/// What is worth telling: always while every bridge is open.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// All drivers are set up, and what was written was read back.
    Started,
    /// The driver of this number did not come up.
    NotStarted(usize, Trouble),
    /// A fault that a driver has reported, by its number.
    Fault(usize, Trouble),
}

/// Idle's side: `N` drivers behind an enable line and a fault line.
pub struct Gates<'a, E, F, S, const N: usize> {
    status: &'a GateStatus,
    enable: E,
    fault_n: F,
    drivers: [Drv8301<S>; N],
    clocks_per_ms: u32,
    phase: Phase,
    /// When the phase began.
    since: u32,
}

#[derive(Clone, Copy)]
enum Phase {
    /// Enable low for so many milliseconds.
    Resting(u32),
    Waking,
    /// Up, and told so: ready from the next look on.
    Up,
    Watching,
}

impl<'a, E: OutputPin, F: InputPin, S: SpiDevice<u16>, const N: usize> Gates<'a, E, F, S, N> {
    /// Drivers that are not enabled yet. `now` and `clocks_per_ms` belong to the clock of [`Gates::turn`].
    pub fn new(
        status: &'a GateStatus,
        lines: (E, F),
        drivers: [Drv8301<S>; N],
        now: u32,
        clocks_per_ms: u32,
    ) -> Self {
        status.set(State::Starting);
        let (enable, fault_n) = lines;
        let phase = Phase::Resting(FIRST_REST_MS);
        let mut gates = Self { status, enable, fault_n, drivers, clocks_per_ms, phase, since: now };
        gates.enable(false);
        gates
    }

    /// One look. The clock may wrap; it must not do so twice between two looks.
    pub fn turn(&mut self, now: u32) -> Option<Event> {
        let milliseconds = now.wrapping_sub(self.since) / self.clocks_per_ms.max(1);
        match self.phase {
            Phase::Resting(rest) if milliseconds >= rest => {
                self.status.set(State::Starting);
                self.enable(true);
                self.begin(Phase::Waking, now);
                None
            }
            Phase::Waking if milliseconds >= WAKING_MS => Some(self.set_up(now)),
            Phase::Up => {
                self.status.set(State::Ready);
                self.begin(Phase::Watching, now);
                None
            }
            Phase::Watching if self.status.state() == State::Wanted => Some(self.give_up(now)),
            Phase::Watching if milliseconds >= WATCHING_MS => {
                self.watch(now);
                None
            }
            _ => None,
        }
    }

    fn begin(&mut self, phase: Phase, now: u32) {
        (self.phase, self.since) = (phase, now);
    }

    fn enable(&mut self, high: bool) {
        // A pin that refuses leaves the drivers without answer, which is told.
        let _ = self.enable.set_state(high.into());
    }

    fn is_low(&mut self) -> bool {
        self.fault_n.is_low().unwrap_or(true)
    }

    fn set_up(&mut self, now: u32) -> Event {
        let mut left_over = Faults::default();
        let failed = self.first(|driver| match driver.configure() {
            Ok(faults) => {
                left_over.0 |= faults.0;
                None
            }
            Err(trouble) => Some(trouble),
        });
        let failed = failed.or_else(|| self.is_low().then_some((0, line_low(left_over))));
        match failed {
            None => {
                self.begin(Phase::Up, now);
                Event::Started
            }
            Some((number, trouble)) => {
                self.rest(State::Failed, now);
                Event::NotStarted(number, trouble)
            }
        }
    }

    /// Off after a fault, with what the drivers say about it.
    fn give_up(&mut self, now: u32) -> Event {
        let kept = self.first(|driver| driver.check().err());
        let fault = self.first(|driver| match driver.faults() {
            Ok(Faults(0)) => None,
            Ok(faults) => Some(Trouble::Faulty(faults)),
            Err(trouble) => Some(trouble),
        });
        let (number, trouble) = kept.or(fault).unwrap_or((0, Trouble::LineLow));
        self.rest(State::Starting, now);
        Event::Fault(number, trouble)
    }

    /// The state first: with the enable line low the amplifiers are off, and control must know before it reads them.
    fn rest(&mut self, state: State, now: u32) {
        self.status.set(state);
        self.enable(false);
        self.begin(Phase::Resting(REST_MS), now);
    }

    /// Status registers are left alone: reading clears them, and a fault shows in the fault line. What is found is told when
    /// the bridges are open, since a line of log masks interrupts.
    fn watch(&mut self, now: u32) {
        self.begin(Phase::Watching, now);
        if self.first(|driver| driver.check().err()).is_some() {
            self.status.trip();
        }
    }

    fn first(&mut self, mut ask: impl FnMut(&mut Drv8301<S>) -> Option<Trouble>) -> Option<(usize, Trouble)> {
        self.drivers.iter_mut().enumerate().find_map(|(number, driver)| Some((number, ask(driver)?)))
    }
}

/// What the line means: the flags that were read and thrown away, if there were some.
fn line_low(left_over: Faults) -> Trouble {
    if left_over.is_none() { Trouble::LineLow } else { Trouble::Faulty(left_over) }
}
