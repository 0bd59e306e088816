//! The piece of the equations that holds now. Where it ends, and what follows: module `switching`.

use super::drive::{Command, Piece};
use super::motor::{Motor, Train};
use servo::axis::Bridge;

/// Inputs that stay constant until the next break in time.
#[derive(Clone, Copy, Debug)]
pub struct Held {
    /// The command in effect.
    pub command: Command,
    /// Bridge state.
    pub bridge: Bridge,
    /// Fast decay: the on-time of a PWM period with this sign. `None`: off-time, or slow decay.
    pub full_on: Option<f64>,
    /// Constant load, N m.
    pub load_nm: f64,
    /// Random torque, N m.
    pub noise_nm: f64,
    /// Ripple of the supply, V.
    pub ripple_v: f64,
}

impl Held {
    /// The command if the bridge is driven, else 0 V.
    pub fn live_command(&self) -> Command {
        if self.bridge == Bridge::Driven { self.command } else { Command::Volts(0.0) }
    }
}

/// Current path of the winding.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Winding {
    /// No threshold near.
    Free,
    /// Current of this sign, losing the drop.
    Signed(f64),
    /// No current: the voltage does not overcome the drop.
    Blocked,
    /// Current held at the limit of this sign.
    Limited(f64),
    /// Current of this sign dies away through the diodes against the supply.
    Diode(f64),
    /// No current: bridge open, or diodes blocking.
    Off,
}

/// Motion of a body.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// No term depends on the direction.
    Free,
    /// ω ≥ 0.
    Forward,
    /// ω ≤ 0.
    Backward,
    /// Held at rest.
    Stuck,
}

impl Motion {
    /// Direction that friction opposes.
    pub fn is_forward(self, omega: f64) -> bool {
        match self {
            Self::Forward => true,
            Self::Backward => false,
            Self::Free | Self::Stuck => omega >= 0.0,
        }
    }
}

/// Teeth of a play.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// There is no play.
    Bonded,
    /// Inside the play.
    Free,
    /// The rotor pushes the load forward.
    Ahead,
    /// The rotor pushes the load backward.
    Behind,
}

/// Everything that switches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Modes {
    /// Piece of the dead zone.
    pub dead_zone: Piece,
    /// Piece of the limit.
    pub limit: Piece,
    /// Current path.
    pub winding: Winding,
    /// Rotor, load.
    pub motion: [Motion; 2],
    /// Teeth.
    pub contact: Contact,
}

/// Number of guards.
pub const GUARDS: usize = 6;

impl Modes {
    /// The modes of a motor at rest with zero current.
    pub fn at_rest(motor: &Motor) -> Self {
        Self {
            dead_zone: Piece::Inside,
            limit: Piece::Inside,
            winding: Winding::Off,
            motion: [Motion::Stuck; 2],
            contact: if matches!(motor.train, Train::Play { .. }) { Contact::Free } else { Contact::Bonded },
        }
    }
}
