//! One axis of a board: its drivers, and what enable contact, fault line and breaker permit.

use super::bridge::HBridge;
use super::hardware::AxisHardware;
use super::interlock::{Interlock, InterlockLines};
use super::parts::Parts;
use super::sense::CurrentSensor;
use crate::axis::{Bridge, Sample};
use embedded_hal::digital::InputPin;

/// The drivers of one axis of a board made of `P`.
pub type HardwareOf<P> = AxisHardware<
    <P as Parts>::Pwm,
    <P as Parts>::Pwm,
    <P as Parts>::Enable,
    <P as Parts>::Counter,
    <P as Parts>::Current,
    <P as Parts>::Supply,
>;

/// One axis with its permission lines, and what was read of it when the tick began.
pub struct GuardedAxis<P: Parts> {
    hardware: HardwareOf<P>,
    lines: InterlockLines<P::Input, P::Input>,
    index: Option<P::Input>,
    breaker: usize,
    sample: Sample,
    /// The count since which the shaft stands.
    standing: i32,
    indexed: bool,
    /// What the lines said when this tick began.
    permission: Interlock,
    /// Anything but granted lasts until the axis itself has opened the bridge.
    verdict: Interlock,
    /// The bridge was left open.
    open: bool,
}

impl<P: Parts> GuardedAxis<P> {
    /// Takes an axis whose bridge is open. `breaker`: the number of the breaker that switches it off.
    pub fn new(
        hardware: HardwareOf<P>,
        lines: InterlockLines<P::Input, P::Input>,
        index: Option<P::Input>,
        breaker: usize,
    ) -> Self {
        Self {
            hardware,
            lines,
            index,
            breaker,
            sample: Sample::NONE,
            standing: 0,
            indexed: false,
            permission: Interlock::Granted,
            verdict: Interlock::Disabled,
            open: true,
        }
    }

    pub(super) fn breaker(&self) -> usize {
        self.breaker
    }

    pub(super) fn is_open(&self) -> bool {
        self.open
    }

    pub(super) fn permission(&self) -> Interlock {
        self.permission
    }

    pub(super) fn sample(&self) -> Sample {
        self.sample
    }

    pub(super) fn index(&self) -> bool {
        self.indexed
    }

    pub(super) fn zeros(&self) -> [i16; 2] {
        self.hardware.current.zeros()
    }

    pub(super) fn goes_round(&self) -> bool {
        self.hardware.encoder.goes_round()
    }

    pub(super) fn latch_count(&mut self) {
        self.sample.count = self.hardware.encoder.read();
        // An edge that lies under a sensor of the encoder counts to and fro.
        if self.sample.count.wrapping_sub(self.standing).unsigned_abs() > 1 {
            self.standing = self.sample.count;
            self.hardware.current.moved();
        }
        self.indexed = self.index.as_mut().is_some_and(|line| line.is_high().unwrap_or(false));
    }

    /// `measured`: its current sensor is on.
    pub(super) fn latch_converters(&mut self, measured: bool) {
        self.sample.vbus_raw = self.hardware.supply.read();
        self.sample.current_raw =
            if measured { self.hardware.current.read() } else { Sample::CURRENT_NOT_SENSED };
    }

    /// Looks at the lines. A break that was too short for the line to be seen low is still a fault.
    pub(super) fn judge(&mut self, tripped: bool) {
        self.permission = match self.lines.read() {
            Interlock::Granted if tripped => Interlock::BridgeFault,
            verdict => verdict,
        };
        if self.permission != Interlock::Granted {
            self.verdict = self.permission;
        }
    }

    /// Without permission the bridge opens whatever the axis wants, and stays open until the axis wants it open too.
    pub(super) fn apply(&mut self, wanted: Bridge, duty: i16, permitted: bool) {
        if wanted == Bridge::Open {
            self.verdict = Interlock::Granted;
        }
        let allowed = permitted && self.verdict == Interlock::Granted;
        let bridge = if allowed { wanted } else { Bridge::Open };
        self.open = bridge == Bridge::Open;
        // A line that refuses leaves the bridge off as far as the others allow, and there is nobody to tell.
        let _ = self.hardware.apply(bridge, duty);
    }

    pub(super) fn put_bridge(&mut self, bridge: HBridge<P::Pwm, P::Pwm, P::Enable>) {
        self.hardware.bridge = bridge;
    }
}
