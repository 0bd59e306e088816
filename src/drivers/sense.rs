//! Current and supply sensing: converter counts, their zero, and what one count is worth in SI units.
//!
//! Model: raw = offset + gain · i for the current, raw = gain · V for the supply. The chip works in counts; the gains
//! are computed once, in SI units, for [`crate::config::Config`]. The offset is measured at rest with the bridge open,
//! where the current is zero by construction.

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
    offset: u16,
    reverse: bool,
}

impl<C: Converter> CurrentSense<C> {
    /// The offset is zero until [`CurrentSense::set_offset`].
    pub fn new(kind: CurrentKind, converter: C) -> Self {
        Self {
            kind,
            converter,
            offset: 0,
            reverse: false,
        }
    }

    /// The converter's present reading without its offset, for the calibration.
    pub fn raw(&self) -> u16 {
        self.converter.sample()
    }

    /// Takes a calibrated offset over.
    pub fn set_offset(&mut self, offset: u16) {
        self.offset = offset;
    }

    /// Remembers the direction in which the bridge is being driven.
    pub fn follow(&mut self, bridge: Bridge, duty: i16) {
        if bridge == Bridge::Driven && duty != 0 {
            self.reverse = duty < 0;
        }
    }

    /// Current in counts, positive with positive torque, or [`Sample::CURRENT_NOT_SENSED`].
    pub fn read(&self) -> i16 {
        let raw = i32::from(self.converter.sample());
        let counts = raw - i32::from(self.offset);
        match (self.kind, self.reverse) {
            (CurrentKind::Absent, _) => Sample::CURRENT_NOT_SENSED,
            (CurrentKind::Signed, _) => clamp(counts),
            (CurrentKind::Magnitude, false) => clamp(counts.max(0)),
            (CurrentKind::Magnitude, true) => clamp(-counts.max(0)),
        }
    }
}

/// Never reaches the mark of a current that is not sensed.
fn clamp(counts: i32) -> i16 {
    counts.clamp(-i32::from(i16::MAX), i32::from(i16::MAX)) as i16
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
        self.converter
            .as_ref()
            .map_or(Sample::VBUS_NOT_MEASURED, Converter::sample)
    }
}

/// Mean of 2ᵏ readings with the bridge open. It refuses what cannot be a sensor at rest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OffsetLimits {
    /// Number of readings as a power of two, k. 0 … 15.
    pub readings_log2: u8,
    /// Lowest and highest offset that the sensor may have, counts.
    pub window: (u16, u16),
    /// Largest spread (highest − lowest reading) of a sensor at rest, counts.
    pub spread: u16,
}

/// Why no offset was taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OffsetError {
    /// The mean lies outside the window: sensor missing, miswired or broken.
    OutsideWindow(u16),
    /// The readings spread too far: current flows (the motor turns) or the input floats.
    Unsteady(u16),
}

/// A calibration under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OffsetState {
    sum: u32,
    taken: u32,
    lowest: u16,
    highest: u16,
}

impl Default for OffsetState {
    fn default() -> Self {
        Self {
            sum: 0,
            taken: 0,
            lowest: u16::MAX,
            highest: 0,
        }
    }
}

impl OffsetLimits {
    /// Takes one reading in; the last one returns the offset, rounded, or why there is none.
    pub fn step(&self, state: &mut OffsetState, raw: u16) -> Option<Result<u16, OffsetError>> {
        // 2¹⁵ readings of 16 bits stay below 2³¹.
        state.sum = state.sum.saturating_add(u32::from(raw));
        state.taken = state.taken.saturating_add(1);
        state.lowest = state.lowest.min(raw);
        state.highest = state.highest.max(raw);
        (state.taken >= 1 << self.readings_log2.min(15)).then(|| self.judge(state))
    }

    fn judge(&self, state: &OffsetState) -> Result<u16, OffsetError> {
        let count = 1u32 << self.readings_log2.min(15);
        // A mean of 16-bit readings fits 16 bits.
        let mean = (state.sum.saturating_add(count / 2) / count) as u16;
        let spread = state.highest.saturating_sub(state.lowest);
        if spread > self.spread {
            return Err(OffsetError::Unsteady(spread));
        }
        if mean < self.window.0 || mean > self.window.1 {
            return Err(OffsetError::OutsideWindow(mean));
        }
        Ok(mean)
    }
}
