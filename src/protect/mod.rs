//! Faults: found from duty, count, current and supply alone, latched, and answered by opening the bridge.
//!
//! Motion is judged against what the identified motor must do *at least*: a model without load, driven by what the
//! acting voltage leaves behind [`STATIC_MARGIN`] dead zones (static friction and load changes are not faults).
//! The load that was observed while the encoder still followed is taken off: a joint that carries a weight stands still
//! with voltage applied. The observer's present load would not do, it soon explains away any motion that is missing.
//! Once it has travelled [`EXPECTED_COUNTS`] while the encoder has not followed, something is wrong.

pub mod action;
mod fault;

use crate::encoder::Motor;
use crate::units::{Speed, Voltage, mul_shift, to_fixed};
pub use action::{Action, Actions, Forbidden};
pub use fault::{Fault, Notice, Permit};

/// Dead zones that the voltage must exceed before motion is demanded: break-away friction reaches 1.6 times the
/// kinetic level, and an asymmetric load adds to one side.
pub const STATIC_MARGIN: f32 = 2.0;
/// … and at least an eighth of the nominal supply, so that somebody who pushes against a joint without friction is no
/// fault.
const LEAST_MARGIN: Voltage = Voltage(Voltage::NOMINAL.0 / 8);
/// Counts that the model must have travelled alone before a missing motion is a fault.
pub const EXPECTED_COUNTS: i32 = 12;
/// The winding's share of the time constant, at most: torque follows voltage with this lag (0.1 for a large motor
/// without gear, far less for small ones).
const LAG_SHARE: f32 = 0.12;
/// Counts in the demanded direction that prove that the encoder follows.
const PROOF_COUNTS: i32 = 2;
/// Counts against the demanded direction that prove a reversed motor or encoder.
const REVERSED_COUNTS: i32 = 4;

/// Thresholds of one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    /// Supply below it is a fault, when it lasts.
    lowest_supply: Voltage,
    /// Supply above it is a fault, when it lasts.
    highest_supply: Voltage,
    /// Speed above it is a fault, when it lasts.
    highest_speed: Speed,
    /// Current above it is a fault, converter counts; `None`: not limited.
    highest_current: Option<u16>,
    /// Ticks that a condition of supply, speed or current must last: 5 ms.
    persistence: u32,
    /// What is done.
    actions: Actions,
}

/// What the motor must do at least.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Expectation {
    /// Speed per voltage, Q20.
    full_speed: i32,
    /// 1/τ per tick, Q24.
    inverse_tau: i32,
    /// 1/lag per tick, Q24.
    inverse_lag: i32,
    /// Voltage to exceed, by direction.
    margin: [Voltage; 2],
}

impl Expectation {
    /// From the motor and its dead zone. `None` for the dead zone: nothing is demanded.
    #[must_use]
    pub fn new(motor: &Motor, dead_zone: [Option<Voltage>; 2]) -> Self {
        let margin = |width: Option<Voltage>| {
            width.map_or(Voltage(i32::MAX), |width| {
                Voltage(mul_shift(width.0, to_fixed(STATIC_MARGIN, 16), 16)).max(LEAST_MARGIN)
            })
        };
        Self {
            full_speed: to_fixed(motor.full_speed, 20),
            inverse_tau: to_fixed(1.0 / motor.tau_ticks, 24),
            inverse_lag: to_fixed((1.0 / (LAG_SHARE * motor.tau_ticks)).min(1.0), 24),
            margin: dead_zone.map(margin),
        }
    }

    /// What the voltage leaves behind the margin and a load, which is taken to hinder whatever its sign: most loads do,
    /// and what is demanded is the least.
    fn drive(&self, voltage: Voltage, load: Voltage) -> i32 {
        let [positive, negative] = self.margin;
        let load = load.0.saturating_abs();
        if voltage.0 >= 0 {
            voltage.0.saturating_sub(positive.0).saturating_sub(load).max(0)
        } else {
            voltage.0.saturating_add(negative.0).saturating_add(load).min(0)
        }
    }
}

/// What protection remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    latched: Fault,
    /// What is done about it; the most severe of all that was found since.
    action: Action,
    supply_low: u32,
    supply_high: u32,
    fast: u32,
    over_current: u32,
    /// Voltage beyond the margin, behind the winding's lag.
    drive: i32,
    /// Speed that the motor must have at least, Q20.
    expected_speed: i32,
    /// Travel in the drive's direction that it must have made since then, counts Q20.
    expected_travel: i32,
    /// Counter at that start.
    proof: i32,
    /// Ticks since.
    since: u32,
    /// Voltage that the load takes, as last observed while the encoder followed.
    load: Voltage,
}

/// What protection looks at.
#[derive(Clone, Copy, Debug)]
pub struct Input {
    /// Raw counter.
    pub count: i32,
    /// Measured supply; `None`: not measured.
    pub supply: Option<Voltage>,
    /// Raw current; `None`: not sensed.
    pub current: Option<i16>,
    /// Speed estimate.
    pub speed: Speed,
    /// Terminal voltage that acted since the last tick; `None`: bridge open.
    pub voltage: Option<Voltage>,
    /// Terminal voltage that the observed load takes.
    pub load: Voltage,
    /// At rest within the hold band: nothing is to move.
    pub holding: bool,
}

impl State {
    /// The latched fault.
    #[must_use]
    pub fn fault(&self) -> Fault {
        self.latched
    }

    /// Latches a fault that the samples do not show, unless one is latched already.
    pub(crate) fn latch(&mut self, fault: Fault, actions: &Actions) {
        if fault == Fault::None {
            return;
        }
        if self.latched == Fault::None {
            self.latched = fault;
            self.action = Action::Hold;
        }
        self.action = self.action.max(actions.of(fault));
    }

    /// The counter's first reading: nothing has moved.
    pub(crate) fn found_at(&mut self, count: i32) {
        self.proof = count;
    }

    /// Forgets the fault and all half-grown suspicions.
    pub fn clear(&mut self, count: i32) {
        *self = Self {
            proof: count,
            ..Self::default()
        };
    }
}

impl Params {
    /// Thresholds from the configuration.
    #[must_use]
    pub fn new(scale: &crate::config::Scale) -> Self {
        let config = &scale.config;
        let counts = config.counts_per_rev as f32 / (2.0 * core::f32::consts::PI * config.tick_hz as f32);
        let fastest = config.speed_limit_rad_s.unwrap_or(2.5 * config.rated_speed_rad_s);
        Self {
            lowest_supply: Voltage(Voltage::NOMINAL.0 / 2),
            highest_supply: Voltage(Voltage::NOMINAL.0 / 2 * 3),
            highest_speed: Speed(to_fixed(fastest * counts, 20)),
            highest_current: config
                .current_limit_a
                .map(|limit| (limit / config.current_a_per_lsb) as u16),
            persistence: config.tick_hz / 200,
            actions: Actions::default(),
        }
    }

    /// The table of actions.
    #[must_use]
    pub fn actions(&self) -> &Actions {
        &self.actions
    }

    /// One tick: what is to be done about the latched fault, or about the first that is found now.
    pub fn step(&self, state: &mut State, expectation: &Expectation, input: &Input) -> Option<Action> {
        let found = self.limits(state, input);
        let motion = motion(state, expectation, input);
        state.latch(if found == Fault::None { motion } else { found }, &self.actions);
        (state.latched != Fault::None).then_some(state.action)
    }

    fn limits(&self, state: &mut State, input: &Input) -> Fault {
        let supply = input.supply.unwrap_or(Voltage::NOMINAL);
        let current = input.current.map_or(0, i16::unsigned_abs);
        let lasting = |count: &mut u32, holds: bool| {
            *count = if holds { count.saturating_add(1) } else { 0 };
            *count >= self.persistence
        };
        let over_current = self.highest_current.is_some_and(|limit| current > limit);
        let fast = input.speed.0.unsigned_abs() > self.highest_speed.0.unsigned_abs();
        let found = [
            (lasting(&mut state.over_current, over_current), Fault::OverCurrent),
            (
                lasting(&mut state.supply_low, supply < self.lowest_supply),
                Fault::SupplyLow,
            ),
            (
                lasting(&mut state.supply_high, supply > self.highest_supply),
                Fault::SupplyHigh,
            ),
            (lasting(&mut state.fast, fast), Fault::Overspeed),
        ];
        found
            .iter()
            .find(|(holds, _)| *holds)
            .map_or(Fault::None, |(_, fault)| *fault)
    }
}

/// Compares the motion with the least that must be. While the drive is within the margin, or has just changed its
/// sign, or counts have proved that the encoder follows, the model starts anew from the speed that is observed: a motor
/// that is being braked may well turn against the voltage.
fn motion(state: &mut State, expectation: &Expectation, input: &Input) -> Fault {
    let wanted = input
        .voltage
        .map_or(0, |voltage| expectation.drive(voltage, state.load));
    let before = state.drive;
    state.drive = approach(before, wanted, expectation.inverse_lag);
    let direction = state.drive.signum();
    let followed = input.count.wrapping_sub(state.proof).saturating_mul(direction);
    let proved = followed >= PROOF_COUNTS;
    state.since = state.since.saturating_add(1);
    if proved || input.holding || input.voltage.is_none() {
        state.load = input.load;
    }
    if proved || input.holding || wanted == 0 || direction != before.signum() {
        let proven = proven_speed(followed, state.since).saturating_mul(direction);
        state.expected_speed = if proved { proven } else { input.speed.0 };
        state.expected_travel = 0;
        state.proof = input.count;
        state.since = 0;
        return Fault::None;
    }
    let steady = mul_shift(state.drive, expectation.full_speed, 20);
    state.expected_speed = approach(state.expected_speed, steady, expectation.inverse_tau);
    let onward = state.expected_speed.saturating_mul(direction);
    if onward <= 0 {
        state.proof = input.count;
        return Fault::None;
    }
    state.expected_travel = state.expected_travel.saturating_add(onward);
    if state.expected_travel >> 20 < EXPECTED_COUNTS {
        return Fault::None;
    }
    if followed <= -REVERSED_COUNTS {
        Fault::WrongDirection
    } else {
        Fault::NoMotion
    }
}

/// Mean speed over the counts of a proof, Q20: the observer's estimate runs ahead of a motor that starts slowly.
fn proven_speed(counts: i32, ticks: u32) -> i32 {
    ((counts.clamp(0, 2000) as u32) << 20)
        .checked_div(ticks)
        .unwrap_or(0) as i32
}

/// One tick of a first-order lag; `rate` per tick, Q24.
fn approach(from: i32, to: i32, rate: i32) -> i32 {
    from.saturating_add(mul_shift(to.saturating_sub(from), rate, 24))
}
