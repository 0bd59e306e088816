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
    /// Highest reading, counts.
    pub const fn most(self) -> u16 {
        u16::MAX >> (16 - if self.bits < 16 { self.bits } else { 16 })
    }

    /// Volts at the pin per count.
    pub const fn volt_per_lsb(self) -> f32 {
        self.reference_v / (self.most() as u32 + 1) as f32
    }

    /// Volts of supply per count behind `divider`.
    pub const fn supply_volt_per_lsb(self, divider: Divider) -> f32 {
        self.volt_per_lsb() * (divider.upper_ohm + divider.lower_ohm) / divider.lower_ohm
    }

    /// Amperes per count of a sensor that delivers `volt_per_ampere`.
    pub const fn ampere_per_lsb(self, volt_per_ampere: f32) -> f32 {
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

/// Whatever tells the winding current of an axis.
pub trait CurrentSensor {
    /// Current in counts, positive with positive torque, or a mark of [`Sample`]. To be called once a tick.
    fn read(&mut self) -> i16;
    /// Remembers what the bridge does from now on, and the direction in which it is driven.
    fn follow(&mut self, bridge: Bridge, duty: i16);
    /// Zeros of its converters, counts, or marks of [`Sample`] where there is none; one that does not exist is not sensed.
    fn zeros(&self) -> [i16; 2];
    /// The shaft has moved: what is read until it stands again says nothing about a zero that is known.
    fn moved(&mut self);
}

/// Winding current of one axis in counts, from one converter.
pub struct CurrentSense<C> {
    kind: CurrentKind,
    converter: C,
    zero: ZeroSearch,
    bridge: Bridge,
    reverse: bool,
}

impl<C: Converter> CurrentSense<C> {
    /// A sensor whose zero is looked for from the first reading on.
    pub fn new(kind: CurrentKind, limits: ZeroLimits, converter: C) -> Self {
        Self { kind, converter, zero: ZeroSearch::new(limits), bridge: Bridge::Open, reverse: false }
    }

    fn signed(&self, counts: i32) -> i16 {
        match (self.kind, self.reverse) {
            (CurrentKind::Magnitude, false) => clamp(counts.max(0)),
            (CurrentKind::Magnitude, true) => clamp(-counts.max(0)),
            (CurrentKind::Signed | CurrentKind::Absent, _) => clamp(counts),
        }
    }
}

impl<C: Converter> CurrentSensor for CurrentSense<C> {
    fn moved(&mut self) {
        self.zero.moved();
    }

    fn follow(&mut self, bridge: Bridge, duty: i16) {
        self.bridge = bridge;
        if bridge == Bridge::Driven && duty != 0 {
            self.reverse = duty < 0;
        }
    }

    fn read(&mut self) -> i16 {
        if self.kind == CurrentKind::Absent {
            return Sample::CURRENT_NOT_SENSED;
        }
        let raw = self.converter.sample();
        match self.zero.step(raw, self.bridge) {
            Zero::Known(zero) => self.signed(i32::from(raw) - i32::from(zero)),
            other => mark(other),
        }
    }

    fn zeros(&self) -> [i16; 2] {
        let zero = match self.kind {
            CurrentKind::Absent => Sample::CURRENT_NOT_SENSED,
            CurrentKind::Signed | CurrentKind::Magnitude => told(self.zero.zero()),
        };
        [zero, Sample::CURRENT_NOT_SENSED]
    }
}

/// When the reading of a shunt below a leg is above its zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rises {
    /// The current flows down to ground.
    WithCurrentDown,
    /// The current flows up into the motor.
    WithCurrentUp,
}

/// Winding current from a shunt below each leg, around the same offset: with slow decay one leg stays low, and its shunt
/// carries the winding current all the time. Driven forward that is leg b, in reverse leg a; the current of leg b flows down to
/// ground when it is positive, that of leg a up from it.
pub struct LowLegSense<C> {
    legs: [C; 2],
    rises: Rises,
    zeros: [ZeroSearch; 2],
    bridge: Bridge,
    reverse: bool,
}

impl<C: Converter> LowLegSense<C> {
    /// Shunts below leg a and leg b. Both zeros are looked for from the first reading on.
    pub fn new(limits: ZeroLimits, legs: [C; 2], rises: Rises) -> Self {
        Self { legs, rises, zeros: [ZeroSearch::new(limits); 2], bridge: Bridge::Open, reverse: false }
    }

    /// The current that flows down through the shunt of a leg.
    fn down(&self, raw: u16, zero: u16) -> i32 {
        let above = i32::from(raw) - i32::from(zero);
        match self.rises {
            Rises::WithCurrentDown => above,
            Rises::WithCurrentUp => -above,
        }
    }
}

impl<C: Converter> CurrentSensor for LowLegSense<C> {
    fn moved(&mut self) {
        self.zeros.iter_mut().for_each(ZeroSearch::moved);
    }

    fn read(&mut self) -> i16 {
        let [a, b] = &self.legs;
        let [zero_a, zero_b] = &mut self.zeros;
        let (raw_a, raw_b) = (a.sample(), b.sample());
        match (zero_a.step(raw_a, self.bridge), zero_b.step(raw_b, self.bridge)) {
            (Zero::Known(zero), Zero::Known(_)) if self.reverse => clamp(-self.down(raw_a, zero)),
            (Zero::Known(_), Zero::Known(zero)) => clamp(self.down(raw_b, zero)),
            (Zero::Known(_), other) | (other, _) => mark(other),
        }
    }

    fn follow(&mut self, bridge: Bridge, duty: i16) {
        self.bridge = bridge;
        if bridge == Bridge::Driven && duty != 0 {
            self.reverse = duty < 0;
        }
    }

    fn zeros(&self) -> [i16; 2] {
        self.zeros.map(|zero| told(zero.zero()))
    }
}

/// Rare, and out of the tick: a zero as a number, or the mark of one that is not known.
#[cold]
#[inline(never)]
fn told(zero: Zero) -> i16 {
    match zero {
        Zero::Known(zero) => clamp(i32::from(zero)),
        other => mark(other),
    }
}

/// What stands in for a current while its zero is not known.
fn mark(zero: Zero) -> i16 {
    match zero {
        Zero::Known(_) | Zero::Sought => Sample::CURRENT_ZERO_SOUGHT,
        Zero::Missing(Reason::Unsteady) => Sample::CURRENT_ZERO_UNSTEADY,
        Zero::Missing(Reason::OutsideWindow) => Sample::CURRENT_ZERO_OUTSIDE,
        Zero::Missing(Reason::BridgeNotOpen) => Sample::CURRENT_ZERO_UNSEEN,
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
