//! A torque that depends on the place, as the voltage that holds it: gravity at a joint, the cogging of a rotor.
//!
//! ```text
//! v(count) = c + Σ aₖ·sin(2π·mₖ·(count − zero)/period + φₖ)        at most 4 harmonics
//! ```
//!
//! [`Load`] says so in SI units, and [`Load::build`] makes the [`PositionLoad`] of it that travels, is stored, and is evaluated in
//! integers. The phase is the upper half of a 64-bit product, which wraps with the turns: a place millions of counts away has the
//! same voltage as the one at the start.
//!
//! The axis adds the voltage before the inverse of the dead zone, so that what is pushed through an input dead zone has the
//! sign of the sum; observer, identification and protection get it taken off. The sum is bounded by [`MOST_SHARE`]. A wrong table takes
//! its slope from the stiffness of the loops, so of one that is steeper than they bear only a share is that of the place where the shaft
//! is, and the rest that of the place where it should be ([`PositionLoad::rest`]): this cannot swing, whatever the table.
//!
//! ```
//! use servo::config::Config;
//! use servo::compensate::position_load::{Harmonic, Load};
//! use servo::units::Voltage;
//!
//! let scale = Config::EXAMPLE.build().expect("every value within its range");
//! let gravity = Harmonic { cycles: 1, amplitude_v: 1.5, phase_rad: 0.0 };
//! let table = Load { period_counts: 2048, constant_v: 0.0, harmonics: &[gravity] };
//! let table = table.build(&scale).expect("an eighth of 12 V");
//! assert_eq!(table.voltage(0), Voltage::ZERO);
//! assert_eq!(table.voltage(2048 / 4), Voltage(Voltage::NOMINAL.0 / 8));
//! ```

use crate::config::{ConfigError, Field, Scale, within};
use crate::units::{Voltage, limited, mul_shift_within, sin, to_fixed};
use serde::{Deserialize, Serialize};

/// Harmonics of one table.
pub const MOST_HARMONICS: usize = 4;
/// Share of the nominal supply that constant and amplitudes take together, at most: the rest is for motion.
pub const MOST_SHARE: f32 = 0.5;
/// Counts of the longest period: three bytes, and exact in single precision.
const MOST_PERIOD: u32 = (1 << 24) - 1;
/// Counts of a cycle, at least: below, the counter does not resolve its sine.
const LEAST_COUNTS: u32 = 8;
/// Slope of what follows the shaft over the voltage that the position loop answers to a count, at most. A table with the wrong sign takes
/// its slope from the loop. The loops are stable up to a slope of `1 − INTEGRAL_SHARE/2` = 0.92 (see [`crate::control`]).
pub const MOST_SLOPE: f32 = 0.9;
/// Fraction bits of amplitudes and constant.
const BITS: u32 = 15;
/// Fraction bits of [`PositionLoad::rest`].
pub const SHARE_BITS: u32 = 15;
/// [`MOST_SHARE`] in it.
const BOUND: i32 = (MOST_SHARE * (1 << BITS) as f32) as i32;
const TWO_PI: f32 = core::f32::consts::TAU;

/// One sine over the place, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Harmonic {
    /// Cycles a period. 1 … period/8.
    pub cycles: u16,
    /// V. 0 … half the nominal supply, all of them together with the constant.
    pub amplitude_v: f32,
    /// Angle of the sine at zero, rad. −2π … 2π.
    pub phase_rad: f32,
}

/// The voltage that holds the load of a place, in SI units.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Load<'a> {
    /// Counts after which it repeats itself. 8 … 16,777,215.
    pub period_counts: u32,
    /// The part that is the same everywhere, V.
    pub constant_v: f32,
    /// The other parts, at most [`MOST_HARMONICS`].
    pub harmonics: &'a [Harmonic],
}

impl Load<'_> {
    /// Checks every number and turns it into machine units: a table that is on, trusted, and over the counter as it is.
    ///
    /// # Errors
    /// A number is outside of its range, or there are too many; the error names it.
    pub fn build(&self, scale: &Scale) -> Result<PositionLoad, ConfigError> {
        let nominal = scale.config.supply_nominal_v;
        let most = MOST_SHARE * nominal;
        let count = self.harmonics.len();
        within(Field::LoadHarmonics, count as f32, 0.0, MOST_HARMONICS as f32)?;
        within(Field::LoadAmplitude, self.constant_v, -most, most)?;
        let fixed = |volts: f32| to_fixed(volts / nominal, BITS);
        within(Field::LoadPeriod, self.period_counts as f32, LEAST_COUNTS as f32, MOST_PERIOD as f32)?;
        let mut table = PositionLoad {
            head: u64::from(self.period_counts) | u64::from(fixed(self.constant_v) as u16) << CONSTANT,
            terms: [0; MOST_HARMONICS],
        };
        for (term, &Harmonic { cycles, amplitude_v, phase_rad }) in table.terms.iter_mut().zip(self.harmonics)
        {
            let most_cycles = (self.period_counts / LEAST_COUNTS) as f32;
            within(Field::LoadCycles, f32::from(cycles), 1.0, most_cycles)?;
            within(Field::LoadAmplitude, amplitude_v, 0.0, most)?;
            within(Field::LoadPhase, phase_rad, -TWO_PI, TWO_PI)?;
            let phase = to_fixed(phase_rad / TWO_PI, 16) as u16;
            *term = Term { cycles, amplitude: fixed(amplitude_v) as u16, phase }.packed();
        }
        let table = table.switched(true).trusted(true);
        table.check()?;
        Ok(table)
    }
}

/// One sine of a table, in machine units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Term {
    /// Cycles a period. 1 … period/8; whatever without an amplitude.
    pub cycles: u16,
    /// Nominal supplies, Q15; 0: there is no such sine. Together with the constant at most [`MOST_SHARE`].
    pub amplitude: u16,
    /// Angle of the sine at zero, 2¹⁶ a turn.
    pub phase: u16,
}

impl Term {
    /// A word of 48 bits, which is 0 without an amplitude.
    fn packed(self) -> u64 {
        let Self { cycles, amplitude, phase } = self;
        if amplitude == 0 {
            return 0;
        }
        u64::from(cycles) | u64::from(amplitude) << 16 | u64::from(phase) << 32
    }

    fn of(word: u64) -> Self {
        Self { cycles: word as u16, amplitude: (word >> 16) as u16, phase: (word >> 32) as u16 }
    }
}

/// Bits of the head: period, switches, constant.
const ON: u64 = 1 << 24;
const TRUSTED: u64 = 1 << 25;
const ABSOLUTE: u64 = 1 << 26;
const CONSTANT: u32 = 32;

/// The voltage that holds the load of a place, in machine units: as it travels, is stored and acts. By default there is none.
///
/// It is made of words: field by field the image would take a thousand bytes more.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct PositionLoad {
    head: u64,
    terms: [u64; MOST_HARMONICS],
}

impl PositionLoad {
    /// Is it to act?
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.head & ON != 0
    }

    /// Was it found with certainty? One that is not trusted is kept, and does not act.
    #[must_use]
    pub fn is_trusted(&self) -> bool {
        self.head & TRUSTED != 0
    }

    /// Does the angle count from the reference's zero? Then it acts once that is found. Otherwise it counts as the counter
    /// does (the logged count), and means nothing after the next power-up.
    #[must_use]
    pub fn is_absolute(&self) -> bool {
        self.head & ABSOLUTE != 0
    }

    /// The same, on or off.
    #[must_use]
    pub fn switched(self, on: bool) -> Self {
        self.with(ON, on)
    }

    /// The same, trusted or not.
    #[must_use]
    pub fn trusted(self, trusted: bool) -> Self {
        self.with(TRUSTED, trusted)
    }

    /// The same, over an angle that counts from the reference's zero, or as the counter does.
    #[must_use]
    pub fn absolute(self, absolute: bool) -> Self {
        self.with(ABSOLUTE, absolute)
    }

    fn with(self, bit: u64, set: bool) -> Self {
        Self { head: if set { self.head | bit } else { self.head & !bit }, ..self }
    }

    /// Counts after which it repeats itself; 0: there is no table.
    #[must_use]
    pub fn period_counts(&self) -> u32 {
        self.head as u32 & MOST_PERIOD
    }

    /// The part that is the same everywhere, nominal supplies, Q15.
    #[must_use]
    pub fn constant(&self) -> i16 {
        (self.head >> CONSTANT) as u16 as i16
    }

    /// Is it the same everywhere?
    #[must_use]
    pub fn is_constant(&self) -> bool {
        self.terms == [0; MOST_HARMONICS]
    }

    /// The other parts.
    pub fn terms(&self) -> impl Iterator<Item = Term> {
        self.terms.into_iter().map(Term::of).filter(|term| term.amplitude != 0)
    }

    /// Can it be?
    ///
    /// # Errors
    /// A number is outside of its range; the error names it.
    #[inline(never)]
    pub fn check(&self) -> Result<(), ConfigError> {
        let (most, mut sum) =
            (self.period_counts() / LEAST_COUNTS, i32::from(self.constant()).saturating_abs());
        for &word in &self.terms {
            let term = Term::of(word);
            sum = sum.saturating_add(i32::from(term.amplitude));
            if u32::from(term.cycles) > most {
                // No cycle is that short.
                sum = i32::MAX;
            }
        }
        within(Field::LoadAmplitude, sum as f32, 0.0, BOUND as f32)
    }

    /// Which share of it may not follow the shaft beside a position loop that answers so many nominal supplies to a count, Q15.
    #[must_use]
    pub fn rest(&self, per_count: f32) -> u16 {
        const ALL: f32 = (1 << SHARE_BITS) as f32;
        // Nothing of one without a slope: what is negative or no number becomes 0.
        (ALL - ALL * MOST_SLOPE * per_count / self.slope()) as u16
    }

    /// The steepest that it can be, nominal supplies per count.
    #[must_use]
    pub fn slope(&self) -> f32 {
        let mut sum = 0u32;
        for &word in &self.terms {
            let term = Term::of(word);
            sum = sum.saturating_add(u32::from(term.amplitude).wrapping_mul(term.cycles.into()));
        }
        sum as f32 / self.period_counts().max(1) as f32 * (TWO_PI / (1 << BITS) as f32)
    }

    /// Periods per count.
    #[must_use]
    pub fn step(&self) -> Step {
        Step(turns_per_count(self.period_counts()))
    }

    /// The voltage that holds the load so many counts from zero. Whoever asks in every tick keeps the [`PositionLoad::step`].
    #[must_use]
    pub fn voltage(&self, counts: i32) -> Voltage {
        self.step().voltage(self, counts)
    }

    /// The same table over an angle that counts from so many counts further on.
    #[must_use]
    pub(crate) fn moved(mut self, step: Step, counts: i32) -> Self {
        let turned = step.turned(counts);
        for word in &mut self.terms {
            let phase = angle(turned, *word) >> 16;
            *word = *word & 0xFFFF_FFFF | u64::from(phase) << 32;
        }
        self
    }
}

/// Angle of a sine where the period has turned so far (Q64), 2³² a turn.
#[inline]
fn angle(turned: u64, word: u64) -> u32 {
    let term = Term::of(word);
    ((turned.wrapping_mul(u64::from(term.cycles)) >> 32) as u32).wrapping_add(u32::from(term.phase) << 16)
}

/// 1/period, Q64: eight places of the result by every division that the core has an instruction for. One by its library would take 900
/// bytes of the image.
fn turns_per_count(period: u32) -> u64 {
    let period = period.max(LEAST_COUNTS);
    let (mut rest, mut quotient) = (1u32, 0u64);
    for _ in 0..8 {
        // Below 2²⁴, as the period is.
        rest <<= 8;
        quotient = quotient << 8 | u64::from(rest / period);
        rest %= period;
    }
    quotient
}

/// Periods per count, Q64: what of a table is divided once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Step(u64);

impl Step {
    /// So many counts in periods, Q64, modulo one. The step is short by 2⁻⁶⁴ at most, and so 2³¹ counts by 2⁻³³ of a period.
    fn turned(self, counts: i32) -> u64 {
        self.0.wrapping_mul(i64::from(counts) as u64)
    }

    /// The voltage that holds the load so many counts from zero; within ±[`MOST_SHARE`] of nominal, whatever the table.
    #[must_use]
    #[inline(never)]
    pub fn voltage(self, table: &PositionLoad, counts: i32) -> Voltage {
        let turned = self.turned(counts);
        let mut sum = i32::from(table.constant()) << (Voltage::BITS - BITS);
        for &word in &table.terms {
            if word != 0 {
                let amplitude = i32::from(Term::of(word).amplitude);
                let sine = sin(angle(turned, word));
                sum = sum.wrapping_add(mul_shift_within(amplitude, sine, 30 + BITS - Voltage::BITS));
            }
        }
        Voltage(limited(sum, BOUND << (Voltage::BITS - BITS)))
    }
}
