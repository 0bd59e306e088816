//! Encoder count → position and speed: a tracking observer that knows the motor.
//!
//! Differencing counts is useless at a high control rate: at 10 kHz one count of a 48-count encoder is 12,500 rpm.
//! The observer instead runs the identified motor beside the real one and corrects it by what the counter says:
//!
//! ```text
//! ω̇ = i/τ + δ + l₂·e                 i: low pass of ω₀·v − ω, as the lag lets the current follow; ω₀: speed at nominal voltage
//! θ̇ = ω + l₁·e                       v: acting voltage behind the dead zone, e: innovation
//! δ̇ = l₃·e                           δ: unknown acceleration (load, model error)
//! ```
//!
//! with a triple pole at −ω_o = −[`BANDWIDTH`]/τ, so `l₁ = 3ω_o − 1/τ`, `l₂ = 3ω_o² − l₁/τ`, `l₃ = ω_o³`
//! (D. G. Luenberger, *An introduction to observers*, IEEE Trans. Autom. Control 16(6), 1971).
//!
//! A counter that reads n says that the shaft is *somewhere* in [n, n+1): as long as the model stays inside, the
//! innovation is zero, and only the distance to that interval corrects it. So the half count of quantisation is not
//! fed to the speed, and a shaft at rest has speed zero.

use crate::units::{
    ACCELERATION_BITS, Acceleration, LowPass, ONE_TICK, Position, SPEED_BITS, Speed, Voltage, bounded,
    low_pass_step, mul_shift, saturate, to_fixed,
};

/// Observer poles in units of 1/τ. Faster follows load changes sooner and passes more quantisation noise.
pub const BANDWIDTH: f32 = 12.0;
/// Fastest pole in units of the control rate: the forward-Euler update needs some seven ticks per time constant.
const FASTEST: f32 = 0.15;
/// Fraction bits of the speed state, counts per tick.
const STATE_BITS: u32 = 44;
/// Bound of the speed state in units of 2³²: ±2,048 counts per tick, the range of [`Speed`].
const FASTEST_STATE: i32 = 2048 << (STATE_BITS - 32);
/// Fraction bits of the unknown acceleration, counts per tick².
const LOAD_BITS: u32 = 58;
/// Fraction bits in which the speed correction is passed on to the load.
const CORRECTION_BITS: u32 = 34;

/// The linear motor: what the observer and the loops are designed from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motor {
    /// Steady speed per nominal voltage behind the dead zone, counts per tick.
    pub full_speed: f32,
    /// Time constant of speed, ticks.
    pub tau_ticks: f32,
}

/// Gains of the observer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Params {
    /// Speed per voltage, Q20.
    full_speed: i32,
    /// 1/τ per tick, Q24.
    inverse_tau: i32,
    /// l₁, Q20.
    to_position: i32,
    /// l₂ per tick, Q32.
    to_speed: i32,
    /// l₃/l₂, Q24.
    to_load: i32,
    /// Way of the current's low pass in a tick, Q30; 0: the current follows at once.
    lag_step: i32,
}

impl Params {
    /// Gains for a motor, with the lag of before.
    #[must_use]
    pub fn of(&self, motor: &Motor) -> Self {
        let decay = 1.0 / motor.tau_ticks;
        let pole = (BANDWIDTH * decay).min(FASTEST);
        let l1 = 3.0 * pole - decay;
        let l2 = 3.0 * pole * pole - l1 * decay;
        Self {
            full_speed: to_fixed(motor.full_speed, 20),
            inverse_tau: to_fixed(decay, 24),
            to_position: to_fixed(l1, 20),
            to_speed: to_fixed(l2, 32),
            to_load: to_fixed(pole * pole * pole / l2, 24),
            ..*self
        }
    }

    /// With the smaller time constant of the motor, control ticks Q4; 0: none is known. The low pass is half a tick longer, and the mean
    /// of what it says before and after a tick half a tick earlier.
    pub fn lag(&mut self, lag: u32) {
        self.lag_step = if lag == 0 { 0 } else { low_pass_step(lag.saturating_add(ONE_TICK / 2)) };
    }
}

/// What the observer remembers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    position: Position,
    /// Counts per tick, Q44.
    speed: i64,
    /// Counts per tick², Q58.
    load: i64,
    /// What the current stands for: the speed that the motor lacks as the lag lets it through, counts per tick.
    lagging: LowPass,
}

impl State {
    /// At rest where the counter says.
    #[must_use]
    #[inline]
    pub fn at_rest(count: i32) -> Self {
        Self { position: Position::of_count(count), speed: 0, load: 0, lagging: LowPass::default() }
    }

    /// Estimated position.
    #[must_use]
    #[inline]
    pub fn position(&self) -> Position {
        self.position
    }

    /// Estimated unknown acceleration: load and what the model lacks.
    #[must_use]
    #[inline]
    pub fn load(&self) -> Acceleration {
        // 64 − 34 bits: it always fits.
        Acceleration((self.load >> (LOAD_BITS - ACCELERATION_BITS)) as i32)
    }

    /// Estimated speed.
    #[must_use]
    #[inline]
    pub fn speed(&self) -> Speed {
        // Within `FASTEST_STATE` it always fits.
        Speed((self.speed >> (STATE_BITS - SPEED_BITS)) as i32)
    }
}

impl Params {
    /// One tick: `voltage` (behind the dead zone) acted since the last one, the counter now reads `count`. `None`: the
    /// bridge was open, no current brakes the motor, and the speed stays as it is but for the load.
    #[inline]
    pub fn step(&self, state: &mut State, count: i32, voltage: Option<Voltage>) {
        self.predict(state, voltage);
        if state.position.count() == count {
            // The model is inside the count, as in most ticks of a slow or resting shaft: nothing to correct.
            state.speed = bounded(state.speed, FASTEST_STATE);
        } else {
            self.correct(state, innovation(count, state.position));
        }
    }

    #[inline]
    fn predict(&self, state: &mut State, voltage: Option<Voltage>) {
        let speed = state.speed().0;
        let lack = voltage.map_or(0, |v| mul_shift(v.0, self.full_speed, 20).saturating_sub(speed));
        let lack = if self.lag_step == 0 {
            lack
        } else {
            let before = state.lagging;
            state.lagging.pass(lack, self.lag_step);
            state.lagging.since(before)
        };
        let before = state.speed;
        let acceleration = (lack as i64).wrapping_mul(self.inverse_tau as i64);
        // Bounded by the correction that follows: |speed| ≤ 2⁵⁵, |acceleration| ≤ 2⁵⁵, |load| ≤ 2⁴⁹.
        state.speed =
            state.speed.wrapping_add(acceleration).wrapping_add(state.load >> (LOAD_BITS - STATE_BITS));
        // By the mean speed of the tick: with that of its start, the speed would be the one of half a tick later.
        state.position = state.position.plus(before.wrapping_add(state.speed) >> (STATE_BITS + 1 - 32));
    }

    #[inline]
    fn correct(&self, state: &mut State, innovation: i32) {
        state.position = state.position.plus((innovation as i64).wrapping_mul(self.to_position as i64));
        let correction = (innovation as i64).wrapping_mul(self.to_speed as i64);
        // At most 2⁶² on top of 2⁵⁷.
        state.speed = bounded(state.speed.wrapping_add(correction), FASTEST_STATE);
        let coarse = saturate(correction >> (STATE_BITS - CORRECTION_BITS));
        state.load = state.load.saturating_add((coarse as i64).wrapping_mul(self.to_load as i64));
    }
}

/// Distance of the model from the interval [count, count + 1), counts Q12; zero inside.
#[inline]
fn innovation(count: i32, position: Position) -> i32 {
    const HALF_COUNT: i32 = 1 << 11;
    let distance = Position::of_count(count).minus(position);
    distance.saturating_sub(distance.clamp(-HALF_COUNT, HALF_COUNT))
}

/// Counts by which a shaft at an edge of the encoder flickers.
const FLICKER: u32 = 1;

/// Counts in one edge interval that are told apart; more of them are as fast.
const MOST_PASSED: u32 = 2000;

/// For how long the shaft has not moved. The observer's speed would not do: it is a fraction of a count for long.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Standstill {
    place: i32,
    ticks: u32,
    /// Counts by which it left its last place, and the ticks that this took.
    passed: i32,
    took: u32,
}

impl Standstill {
    /// One tick. A shaft at an edge of the encoder flickers by one count and stands.
    #[inline]
    pub fn watch(&mut self, count: i32) {
        self.ticks = self.ticks.saturating_add(1);
        let passed = count.wrapping_sub(self.place);
        if passed.unsigned_abs() > FLICKER {
            *self = Self { place: count, ticks: 0, passed, took: self.ticks };
        }
    }

    /// What of an estimated speed the counter allows: a shaft that turns passes the next count beyond the flicker in
    /// time, and does not turn against its last edge. The observer knows no break-away, nor a drive that ignores
    /// voltage; it sees a shaft turn that stands, or forwards one that still runs back.
    #[must_use]
    #[inline]
    pub fn allows(&self, speed: Speed) -> Speed {
        if speed.0.signum() == self.passed.signum().saturating_neg() {
            return self.edge_speed();
        }
        let most = self.most();
        Speed(speed.0.clamp(most.saturating_neg(), most))
    }

    /// Speed over the last edge interval, no more than the time since allows. It knows no voltage: a large winding goes on
    /// driving the shaft the old way when the voltage has turned, while the observer sees it turn round already.
    #[must_use]
    #[inline]
    pub fn edge_speed(&self) -> Speed {
        let passed = self.passed.unsigned_abs().min(MOST_PASSED) << 20;
        let rate = passed.checked_div(self.took).unwrap_or(0) as i32;
        Speed(rate.min(self.most()).saturating_mul(self.passed.signum()))
    }

    /// A shaft that turned faster would have passed the next count beyond the flicker.
    #[inline]
    fn most(&self) -> i32 {
        let most = ((FLICKER + 1) << 20).checked_div(self.ticks);
        most.map_or(i32::MAX, |most| most as i32)
    }

    /// Has it lasted for so many ticks?
    #[must_use]
    #[inline]
    pub fn lasts(&self, ticks: u32) -> bool {
        self.ticks >= ticks
    }
}
