//! The H-bridge: a bridge state and a duty become the levels of two PWM lines and an enable line.
//!
//! A *level* is the share of the PWM period for which a line is high, in PWM counts from 0 to full scale F. With the
//! duty d in −F … F the mean terminal voltage is V · d / F in both ways of switching:
//!
//! | wiring, decay | line a | line b | in the rest of the period |
//! |---|---|---|---|
//! | two inputs, slow, d ≥ 0 | F | F − d | 1 1: both terminals on one rail, the current circulates |
//! | two inputs, slow, d < 0 | F − \|d\| | F | as above |
//! | half bridges, slow, d ≥ 0 | d | 0 | 0 0: both low sides on, the current circulates |
//! | half bridges, slow, d < 0 | 0 | \|d\| | as above |
//! | either, locked anti-phase | (F + d) / 2 | F − a | the bridge is reversed |
//!
//! Slow decay keeps the current continuous, so that speed over duty stays straight; locked anti-phase does the same at
//! the price of full ripple at standstill. Fast decay is left out on purpose: it bends the speed curve at small duty,
//! which looks like a dead zone. The truth table of the two-input driver is that of the DRV8871 and DRV8874 data sheets
//! (PWM mode); that of the half bridge is the BTS7960 data sheet's.

use crate::axis::Bridge;
use embedded_hal::digital::{self, Error as _, OutputPin};
use embedded_hal::pwm::{self, SetDutyCycle};

/// How the bridge reads its two lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wiring {
    /// A driver IC with inputs IN1 and IN2 and a dead time of its own: 00 opens the bridge, 11 shorts the motor.
    /// The enable line, if there is one, is its sleep pin and stays high while the driver is in use.
    TwoInputs,
    /// Two half bridges: high switches the upper side on, low the lower one. Only a low enable line opens them.
    HalfBridges,
}

/// What the bridge does in the part of the PWM period in which it does not drive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decay {
    /// The terminals are shorted.
    Slow,
    /// The bridge drives the other way: 50 % is zero.
    LockedAntiPhase,
}

/// Immutable choice of one bridge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// How the bridge reads its lines.
    pub wiring: Wiring,
    /// How it switches.
    pub decay: Decay,
    /// Largest |duty| in PWM counts. Full scale where the upper side may stay on; less where a bootstrap capacitor
    /// must be recharged in every period.
    pub duty_limit: u16,
}

/// A line that refused to be set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// A PWM line.
    Pwm(pwm::ErrorKind),
    /// The enable line.
    Enable(digital::ErrorKind),
}

/// Levels of both lines in PWM counts, and whether the enable line is high.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// Line a (IN1, upper side of the leg at the motor's positive terminal).
    pub a: u16,
    /// Line b (IN2, the other leg).
    pub b: u16,
    /// Enable, or "not asleep".
    pub enable: bool,
}

impl Config {
    /// Lines for one command at full scale `full`; the duty counts while driven only. A duty beyond the limit is clipped to it.
    pub fn levels(&self, full: u16, bridge: Bridge, duty: i16) -> Levels {
        match bridge {
            Bridge::Open => self.open(),
            Bridge::Shorted => self.shorted(full),
            Bridge::Driven => self.driven(full, duty),
        }
    }

    fn open(&self) -> Levels {
        Levels { a: 0, b: 0, enable: self.wiring == Wiring::TwoInputs }
    }

    fn shorted(&self, full: u16) -> Levels {
        let level = match self.wiring {
            Wiring::TwoInputs => full,
            Wiring::HalfBridges => 0,
        };
        Levels { a: level, b: level, enable: true }
    }

    fn driven(&self, full: u16, duty: i16) -> Levels {
        let size = duty.unsigned_abs().min(self.duty_limit).min(full);
        let (a, b) = match (self.decay, self.wiring) {
            (Decay::LockedAntiPhase, _) => anti_phase(full, size, duty < 0),
            (Decay::Slow, Wiring::TwoInputs) => by_sign(full, full.saturating_sub(size), duty < 0),
            (Decay::Slow, Wiring::HalfBridges) => by_sign(size, 0, duty < 0),
        };
        Levels { a, b, enable: true }
    }
}

fn by_sign(forward_a: u16, forward_b: u16, reverse: bool) -> (u16, u16) {
    if reverse { (forward_b, forward_a) } else { (forward_a, forward_b) }
}

/// Halving the full scale and the duty together keeps zero at exactly one half for an even full scale.
fn anti_phase(full: u16, size: u16, reverse: bool) -> (u16, u16) {
    let signed = if reverse { -i32::from(size) } else { i32::from(size) };
    // 0 ≤ (full + signed) / 2 ≤ full because size ≤ full.
    let a = ((i32::from(full) + signed) / 2) as u16;
    (a, full.saturating_sub(a))
}

/// One bridge: two PWM lines with the same full scale, and an enable or sleep line ([`NotConnected`] where it has none).
pub struct HBridge<A, B, E> {
    config: Config,
    full: u16,
    a: A,
    b: B,
    enable: E,
}

impl<A: SetDutyCycle, B: SetDutyCycle, E: OutputPin> HBridge<A, B, E> {
    /// Takes the lines and switches the bridge off. Full scale is line a's.
    ///
    /// # Errors
    /// A line that could not be set; the others are set all the same.
    pub fn new(config: Config, a: A, b: B, enable: E) -> Result<Self, Error> {
        let full = a.max_duty_cycle();
        let mut bridge = Self { config, full, a, b, enable };
        bridge.off()?;
        Ok(bridge)
    }

    /// PWM counts of full duty.
    pub fn full_scale(&self) -> u16 {
        self.full
    }

    /// Sets the lines. The PWM levels take effect when the timer next loads its compare registers, the
    /// enable line at once: a bridge of [`Wiring::HalfBridges`] opens up to one period earlier than it closes.
    ///
    /// # Errors
    /// The first line that refused; the bridge is then switched off as far as the other lines allow.
    pub fn apply(&mut self, bridge: Bridge, duty: i16) -> Result<(), Error> {
        let wanted = self.config.levels(self.full, bridge, duty);
        self.set(wanted).inspect_err(|_| {
            // The first error is the one to report: a second refusal adds nothing.
            let _ = self.off();
        })
    }

    /// Both lines low and the enable line low: open for every wiring, and asleep where the driver can sleep.
    ///
    /// # Errors
    /// The first line that refused; all three have been tried.
    pub fn off(&mut self) -> Result<(), Error> {
        let enable = self.set_enable(false);
        let a = self.a.set_duty_cycle(0).map_err(pwm_error);
        let b = self.b.set_duty_cycle(0).map_err(pwm_error);
        enable.and(a).and(b)
    }

    /// Opening pulls the enable line first, driving raises it last: the bridge never closes on stale levels.
    fn set(&mut self, levels: Levels) -> Result<(), Error> {
        if !levels.enable {
            self.set_enable(false)?;
        }
        self.a.set_duty_cycle(levels.a).map_err(pwm_error)?;
        self.b.set_duty_cycle(levels.b).map_err(pwm_error)?;
        if levels.enable {
            self.set_enable(true)?;
        }
        Ok(())
    }

    fn set_enable(&mut self, high: bool) -> Result<(), Error> {
        let result = self.enable.set_state(high.into());
        result.map_err(|error| Error::Enable(error.kind()))
    }

    /// Gives the lines back.
    pub fn release(self) -> (A, B, E) {
        (self.a, self.b, self.enable)
    }
}

fn pwm_error<E: pwm::Error>(error: E) -> Error {
    Error::Pwm(error.kind())
}

/// Stands for a line that the bridge does not have.
#[derive(Clone, Copy, Debug, Default)]
pub struct NotConnected;

impl digital::ErrorType for NotConnected {
    type Error = core::convert::Infallible;
}

impl OutputPin for NotConnected {
    fn set_low(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Self::Error> {
        Ok(())
    }
}
