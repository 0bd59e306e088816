//! Current and supply sensing: converter counts, their zero, and what one count is worth in SI units.
//!
//! Model: raw = offset + gain · i for the current, raw = gain · V for the supply. The chip works in counts; the gains
//! are computed once, in SI units, for [`crate::config::Config`]. The offset is measured with the bridge open, where the
//! current is zero by construction: [`super::zero`].

use super::zero::{Reason, Zero, ZeroLimits, ZeroSearch};
use crate::axis::{Bridge, Sample};

/// The last completed conversion of one analogue channel.
pub trait Converter {
    /// Counts, 0 … 2ᴺ − 1.
    fn sample(&self) -> u16;
}

/// A resistive divider in front of the converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Divider {
    /// From the supply to the converter's pin, Ω.
    pub upper_ohm: f32,
    /// From the pin to ground, Ω.
    pub lower_ohm: f32,
}

/// Full scale of the converter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Reference voltage, V.
    pub reference_v: f32,
    /// Resolution N in bits, at most 16.
    pub bits: u8,
}

impl Scale {
    /// Volts at the pin per count.
    pub fn volt_per_lsb(self) -> f32 {
        self.reference_v / (1u32 << self.bits.min(16)) as f32
    }

    /// Volts of supply per count behind `divider`.
    pub fn supply_volt_per_lsb(self, divider: Divider) -> f32 {
        self.volt_per_lsb() * (divider.upper_ohm + divider.lower_ohm) / divider.lower_ohm
    }

    /// Amperes per count of a sensor that delivers `volt_per_ampere`.
    pub fn ampere_per_lsb(self, volt_per_ampere: f32) -> f32 {
        self.volt_per_lsb() / volt_per_ampere
    }
}

/// What the current sensor can tell.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CurrentKind {
    /// Both signs, zero somewhere inside the range (shunt amplifier with reference).
    Signed,
    /// The magnitude alone (current mirror of a driver IC). It is given the sign of the last driven duty: right while
    /// driving, a guess while braking.
    Magnitude,
    /// No sensor.
    Absent,
}

/// Winding current of one axis in counts.
pub struct CurrentSense<C> {
    kind: CurrentKind,
    converter: C,
    zero: ZeroSearch,
    bridge: Bridge,
    reverse: bool,
}

impl<C: Converter> CurrentSense<C> {
    /// A sensor whose zero is looked for from the first reading on, and kept once it is known.
    pub fn new(kind: CurrentKind, limits: ZeroLimits, converter: C) -> Self {
        Self { kind, converter, zero: ZeroSearch::new(limits), bridge: Bridge::Open, reverse: false }
    }

    /// Remembers what the bridge does from now on, and the direction in which it is driven.
    pub fn follow(&mut self, bridge: Bridge, duty: i16) {
        self.bridge = bridge;
        if bridge == Bridge::Driven && duty != 0 {
            self.reverse = duty < 0;
        }
    }

    /// Current in counts, positive with positive torque, or a mark of [`Sample`]. To be called once a tick.
    pub fn read(&mut self) -> i16 {
        if self.kind == CurrentKind::Absent {
            return Sample::CURRENT_NOT_SENSED;
        }
        let raw = self.converter.sample();
        match self.zero.step(raw, self.bridge) {
            Zero::Known(zero) => self.signed(i32::from(raw) - i32::from(zero)),
            Zero::Sought => Sample::CURRENT_ZERO_SOUGHT,
            Zero::Missing(Reason::Unsteady) => Sample::CURRENT_ZERO_UNSTEADY,
            Zero::Missing(Reason::OutsideWindow) => Sample::CURRENT_ZERO_OUTSIDE,
            Zero::Missing(Reason::BridgeNotOpen) => Sample::CURRENT_ZERO_UNSEEN,
        }
    }

    fn signed(&self, counts: i32) -> i16 {
        match (self.kind, self.reverse) {
            (CurrentKind::Magnitude, false) => clamp(counts.max(0)),
            (CurrentKind::Magnitude, true) => clamp(-counts.max(0)),
            (CurrentKind::Signed | CurrentKind::Absent, _) => clamp(counts),
        }
    }
}

/// Never reaches a mark of a current that is not sensed.
fn clamp(counts: i32) -> i16 {
    counts.clamp(i32::from(Sample::LOWEST_CURRENT), i32::from(i16::MAX)) as i16
}

/// Supply voltage in counts.
pub struct SupplySense<C> {
    converter: Option<C>,
}

impl<C: Converter> SupplySense<C> {
    /// `None`: the board has no divider.
    pub fn new(converter: Option<C>) -> Self {
        Self { converter }
    }

    /// Counts, or [`Sample::VBUS_NOT_MEASURED`].
    pub fn read(&self) -> u16 {
        self.converter.as_ref().map_or(Sample::VBUS_NOT_MEASURED, Converter::sample)
    }
}
