//! A brushed motor behind two legs, with the ripple of its current.

/// What a leg does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Leg {
    /// Its upper switch is on.
    High,
    /// Its lower switch is on.
    Low,
    /// Neither; the diodes carry what the winding drives.
    Open,
    /// Both: the supply is shorted.
    Shoot,
}

const OHM: f64 = 2.0;
const HENRY: f64 = 1e-3;
/// V·s and N·m/A.
const CONSTANT: f64 = 0.05;
/// Rotor and load, kg·m².
const INERTIA: f64 = 2e-5;
const COUNTS_PER_RAD: f64 = 4000.0 / std::f64::consts::TAU;
/// Longest step of integration, s.
const STEP_S: f64 = 2e-6;

/// A motor at rest.
#[derive(Clone, Debug, Default)]
pub struct Motor {
    pub ampere: f64,
    pub rad_s: f64,
    pub rad: f64,
    /// Somebody turns the shaft, whatever the motor does, rad/s.
    pub turned: Option<f64>,
}

impl Motor {
    pub const SUPPLY_V: f64 = 12.0;

    pub fn count(&self) -> u32 {
        (self.rad * COUNTS_PER_RAD).floor() as i64 as u32
    }

    pub fn back_emf(&self) -> f64 {
        CONSTANT * self.rad_s
    }

    /// The current that comes up from ground through the low side of a leg: its switch, or the diode beside it.
    pub fn up_through(&self, number: usize, leg: Leg) -> f64 {
        let into = if number == 0 { self.ampere } else { -self.ampere };
        match leg {
            Leg::Low => into,
            Leg::Open if into > 0.0 => into,
            _ => 0.0,
        }
    }

    pub fn pass(&mut self, legs: [Leg; 2], seconds: f64) {
        assert!(!legs.contains(&Leg::Shoot), "both switches of a leg are on");
        let steps = (seconds / STEP_S).ceil().max(1.0);
        for _ in 0..steps as u32 {
            self.step(legs, seconds / steps);
        }
    }

    fn step(&mut self, legs: [Leg; 2], seconds: f64) {
        let before = self.ampere;
        let volt = self.terminal(legs);
        self.ampere += (volt - OHM * self.ampere - CONSTANT * self.rad_s) / HENRY * seconds;
        let blocked = legs.contains(&Leg::Open);
        if blocked && (before * self.ampere <= 0.0) {
            // Diodes carry a current until it ends, and begin none.
            self.ampere = 0.0;
        }
        self.rad_s = self.turned.unwrap_or(self.rad_s + CONSTANT * self.ampere / INERTIA * seconds);
        self.rad += self.rad_s * seconds;
    }

    /// Voltage from a to b. An open leg lies where the current drives it: a current into the motor comes up from ground.
    fn terminal(&self, legs: [Leg; 2]) -> f64 {
        let volt = |leg, into: f64| match leg {
            Leg::High => Self::SUPPLY_V,
            Leg::Low => 0.0,
            _ if into > 0.0 => 0.0,
            _ => Self::SUPPLY_V,
        };
        volt(legs[0], self.ampere) - volt(legs[1], -self.ampere)
    }
}
