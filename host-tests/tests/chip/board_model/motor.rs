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

const COUNTS_PER_RAD: f64 = 4000.0 / std::f64::consts::TAU;
/// Longest step of integration, s.
const STEP_S: f64 = 2e-6;

/// A motor at rest.
#[derive(Clone, Debug)]
pub struct Motor {
    pub ohm: f64,
    pub henry: f64,
    /// V·s and N·m/A.
    pub constant: f64,
    /// Rotor and load, kg·m².
    pub inertia: f64,
    /// Coulomb friction, and what holds a shaft that stands, N·m.
    pub friction: [f64; 2],
    pub ampere: f64,
    pub rad_s: f64,
    pub rad: f64,
    /// Somebody turns the shaft, whatever the motor does, rad/s.
    pub turned: Option<f64>,
}

impl Default for Motor {
    fn default() -> Self {
        Self {
            ohm: 2.0,
            henry: 1e-3,
            constant: 0.05,
            inertia: 2e-5,
            friction: [0.0; 2],
            ampere: 0.0,
            rad_s: 0.0,
            rad: 0.0,
            turned: None,
        }
    }
}

impl Motor {
    pub const SUPPLY_V: f64 = 12.0;

    /// A resistor of 10 Ω in series with a winding that does not turn: without its inductance the current would follow the PWM, and
    /// its sample would be that of full voltage at any duty.
    pub fn resistor() -> Self {
        Self { ohm: 12.0, henry: 2e-3, constant: 0.0, ..Self::default() }
    }

    pub fn count(&self) -> u32 {
        (self.rad * COUNTS_PER_RAD).floor() as i64 as u32
    }

    pub fn back_emf(&self) -> f64 {
        self.constant * self.rad_s
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
        self.ampere += (volt - self.ohm * self.ampere - self.back_emf()) / self.henry * seconds;
        let blocked = legs.contains(&Leg::Open);
        if blocked && (before * self.ampere <= 0.0) {
            // Diodes carry a current until it ends, and begin none.
            self.ampere = 0.0;
        }
        self.rad_s = self.turned.unwrap_or(self.turns(seconds));
        self.rad += self.rad_s * seconds;
    }

    /// Speed at the end of a step.
    fn turns(&self, seconds: f64) -> f64 {
        let torque = self.constant * self.ampere;
        let [sliding, holding] = self.friction;
        if self.rad_s == 0.0 && torque.abs() <= holding {
            return 0.0;
        }
        let way = if self.rad_s == 0.0 { torque } else { self.rad_s };
        let next = self.rad_s + (torque - sliding.copysign(way)) / self.inertia * seconds;
        // Friction brings a shaft to rest, and no further.
        if self.rad_s * next < 0.0 && sliding > 0.0 { 0.0 } else { next }
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
