//! Does the encoder follow? Motion is judged against what the identified motor must do *at least*.
//!
//! A model without load is driven by what the acting voltage leaves behind a margin: [`REST_MARGIN`] dead zones for a
//! shaft that stands, [`MOVING_MARGIN`] for one that turns (friction at rest is higher, and what turns goes on turning).
//! Friction, its ripple and load changes within the margin are no faults. The load that was observed while the encoder
//! still followed is taken off: a joint that carries a weight stands still with voltage applied. The observer's present
//! load would not do, it soon explains away any motion that is missing.
//!
//! ```text
//! ṁ = (ω₀·u − m)/τ      u: voltage beyond margin and load, rising behind the winding's lag, falling at once
//! ```
//!
//! Two counts prove that the encoder follows; the model then starts anew with the speed that they show. Once it has
//! travelled [`EXPECTED_COUNTS`] without a proof, something is wrong.

use super::Input;
use crate::encoder::Motor;
use crate::units::{Voltage, mul_shift, to_fixed};

/// Dead zones that the voltage must exceed before a shaft at rest must start: break-away friction reaches 1.6 times the
/// kinetic level, ripple and cogging add a tenth each, and an asymmetric load adds to one side.
pub const REST_MARGIN: f32 = 2.0;
/// Dead zones that friction and load can take, at most, from a shaft that turns: ripple, cogging and random torque of
/// up to 0.3, a load step of 0.2.
pub const MOVING_MARGIN: f32 = 1.5;
/// … and at least an eighth of the nominal supply, so that somebody who pushes against a joint without friction is no
/// fault; half of it in motion.
const LEAST_MARGIN: Voltage = Voltage(Voltage::NOMINAL.0 / 8);
/// Observed speed from which on a shaft counts as moving, share of full speed as a shift: 1/16. The Stribeck rise of
/// friction has died away there.
const MOVING_SHIFT: u32 = 4;
/// The same for the model: once the voltage has exceeded the margin at rest for so long that even the model has some
/// speed, 1/256, the shaft has broken away.
const STARTED_SHIFT: u32 = 8;
/// Largest load that is believed, nominal supplies: a motor that needs more than that to stand still is stalled.
const MOST_LOAD: Voltage = Voltage(Voltage::NOMINAL.0 / 4);
/// Counts that the model must have travelled alone before a missing motion is a fault.
pub const EXPECTED_COUNTS: i32 = 12;
/// The winding's share of the time constant, at most: torque follows voltage with this lag (0.1 for a large motor
/// without gear, far less for small ones).
const LAG_SHARE: f32 = 0.12;
/// Counts in the demanded direction that prove that the encoder follows.
const PROOF_COUNTS: i32 = 2;
/// Counts against the demanded direction that prove a reversed motor or encoder.
const REVERSED_COUNTS: i32 = 4;

/// What the motor must do at least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Expectation {
    /// Speed per voltage, Q20.
    full_speed: i32,
    /// 1/τ per tick, Q24.
    inverse_tau: i32,
    /// 1/lag per tick, Q24.
    inverse_lag: i32,
    /// Voltage to exceed at rest, by direction; the maximum: nothing is demanded.
    rest: [Voltage; 2],
    /// … in motion.
    moving: [Voltage; 2],
}

impl Expectation {
    /// From the motor and its dead zone. `None` for the dead zone: nothing is demanded.
    #[must_use]
    pub fn new(motor: &Motor, dead_zone: [Option<Voltage>; 2]) -> Self {
        let margin = |width: Option<Voltage>, factor: f32, least: Voltage| {
            width.map_or(Voltage(i32::MAX), |width| {
                Voltage(mul_shift(width.0, to_fixed(factor, 16), 16)).max(least)
            })
        };
        let half = Voltage(LEAST_MARGIN.0 / 2);
        Self {
            full_speed: to_fixed(motor.full_speed, 20),
            inverse_tau: to_fixed(1.0 / motor.tau_ticks, 24),
            inverse_lag: to_fixed((1.0 / (LAG_SHARE * motor.tau_ticks)).min(1.0), 24),
            rest: dead_zone.map(|width| margin(width, REST_MARGIN, LEAST_MARGIN)),
            moving: dead_zone.map(|width| margin(width, MOVING_MARGIN, half)),
        }
    }

    /// Speed at nominal voltage, counts per tick, Q20.
    pub(super) fn full_speed(&self) -> i32 {
        self.full_speed
    }

    /// What the magnitude of a voltage leaves behind the margin and a load, which is taken to hinder whatever its sign:
    /// most loads do, and what is demanded is the least.
    fn drive(&self, voltage: Voltage, moving: bool, load: Voltage) -> i32 {
        let side = usize::from(voltage.0 < 0);
        let margins = if moving { &self.moving } else { &self.rest };
        let margin = margins[side]
            .0
            .saturating_add(load.0.saturating_abs().min(MOST_LOAD.0));
        voltage.0.saturating_abs().saturating_sub(margin).max(0)
    }
}

/// The encoder has not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Missing {
    /// Counts that there should have been.
    pub expected: i32,
    /// It ran back instead.
    pub reversed: bool,
    /// +1 or −1.
    pub direction: i32,
}

/// What is known about the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Sign of the voltage.
    direction: i32,
    /// Voltage beyond the margin, ≥ 0.
    drive: i32,
    /// Speed in this direction that the motor must have at least, Q20; below zero: it still turns against the voltage.
    speed: i32,
    /// It has broken away.
    moving: bool,
    /// Travel that it must have made since the last proof, counts Q20.
    travel: i32,
    /// Counter at the last proof.
    proof: i32,
    /// Ticks since.
    since: u32,
    /// Voltage that the load takes, as last observed while the encoder followed.
    load: Voltage,
}

impl State {
    /// Nothing has moved yet.
    pub fn at(count: i32) -> Self {
        Self {
            proof: count,
            ..Self::default()
        }
    }

    /// Has the encoder just proved that it follows, or was nothing demanded of it?
    pub fn fresh(&self) -> bool {
        self.since == 0
    }

    /// Compares the motion with the least that must be. Without drive, and when the drive changes its sign, the model
    /// starts anew from the speed that is observed: a motor that is being braked may well turn against the voltage.
    pub fn step(&mut self, expectation: &Expectation, input: &Input) -> Option<Missing> {
        let voltage = input.voltage.unwrap_or(Voltage::ZERO);
        let direction = voltage.0.signum();
        let wanted = expectation.drive(voltage, self.moving, self.load);
        if wanted == 0 || direction != self.direction || input.holding {
            self.restart(expectation, direction, input);
            return None;
        }
        let followed = input.count.wrapping_sub(self.proof).saturating_mul(direction);
        self.since = self.since.saturating_add(1);
        self.drive = wanted.min(approach(self.drive, wanted, expectation.inverse_lag));
        if followed >= PROOF_COUNTS {
            self.prove(followed, input);
            return None;
        }
        let steady = mul_shift(self.drive, expectation.full_speed, 20);
        self.speed = approach(self.speed, steady, expectation.inverse_tau);
        self.moving |= self.speed > expectation.full_speed >> STARTED_SHIFT;
        if self.speed <= 0 {
            self.proof = input.count;
            self.since = 0;
            return None;
        }
        self.travel = self.travel.saturating_add(self.speed);
        let expected = self.travel >> 20;
        (expected >= EXPECTED_COUNTS).then_some(Missing {
            expected,
            reversed: followed <= -REVERSED_COUNTS,
            direction,
        })
    }

    /// Nothing is demanded. While nothing drives, or all is silent, the observed load is the load.
    fn restart(&mut self, expectation: &Expectation, direction: i32, input: &Input) {
        let speed = input.speed.0.saturating_mul(direction);
        *self = Self {
            direction,
            drive: 0,
            speed,
            moving: speed > expectation.full_speed >> MOVING_SHIFT,
            travel: 0,
            proof: input.count,
            since: 0,
            load: if input.voltage.is_none() || input.holding {
                input.load
            } else {
                self.load
            },
        };
    }

    /// The encoder follows, with the mean speed over the counts of the proof: the observer's estimate runs ahead of a
    /// motor that starts slowly.
    fn prove(&mut self, followed: i32, input: &Input) {
        let counts = (followed.clamp(0, 2000) as u32) << 20;
        self.speed = counts.checked_div(self.since).unwrap_or(0) as i32;
        self.travel = 0;
        self.proof = input.count;
        self.since = 0;
        self.load = input.load;
    }
}

/// One tick of a first-order lag; `rate` per tick, Q24.
fn approach(from: i32, to: i32, rate: i32) -> i32 {
    from.saturating_add(mul_shift(to.saturating_sub(from), rate, 24))
}
