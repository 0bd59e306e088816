//! The loops: position → speed → voltage, with feed-forward from the identified motor.
//!
//! Behind a compensated dead zone the motor is `τω̇ = −ω + ω₀v` (`ω₀`: steady speed per nominal voltage). The loops are
//!
//! ```text
//! ω*  = ω_ref + k_p·(θ_ref − θ)                               position loop
//! v   = (ω_ref + late·ω̇_ref + τ·α)/ω₀ + k_v·(ω* − ω) + I     speed loop and feed-forward
//! α   = ω̇_ref + g·(ω̇_ref − low pass of ω̇_ref)                 what the lag keeps back, beforehand
//! İ   = k_i·(θ_ref − θ)                                       integrator; waits while that would clip v further
//! ```
//!
//! Both poles of the position loop lie at −ω_c (critically damped): `(1 + ω₀k_v)/τ = 2ω_c` and `ω₀k_v·k_p/τ = ω_c²`.
//! *Late* is the duty, half a tick behind the delay of the PWM. With T, late and the lag (the smaller time constant of the motor)
//! together, the low pass has the time constant T/g: the feed-forward is `1 + (τ + late)s + τ·T·s²/(1 + T/g·s)`, and α at most 1 + 2g
//! times the largest acceleration.
//!
//! The one knob is the bandwidth in units of 1/τ, ω_c = [`Tuning::bandwidth`]/τ. The integrator adds a slow pole at
//! about [`INTEGRAL_SHARE`]·ω_c. Conditional integration: K. J. Åström, T. Hägglund, *Advanced PID Control*, ISA 2006,
//! sec. 3.5.

use crate::encoder::Motor;
pub use crate::units::LAG_FRAC;
use crate::units::{
    ACCELERATION_BITS, Acceleration, ERROR_BITS, LowPass, ONE_TICK, Position, SPEED_BITS, Speed, Voltage,
    bounded, limited, low_pass_step, mul_shift, mul_shift_within, to_fixed,
};
use serde::{Deserialize, Serialize};

/// Pole of the integrator in units of the loops' bandwidth.
pub const INTEGRAL_SHARE: f32 = 0.15;
/// Smallest bandwidth times time constant: below it the critically damped loop would need a negative speed gain.
const SMALLEST_BANDWIDTH: f32 = 0.6;
/// Largest bandwidth, radians per tick: a twentieth of the control rate keeps the delay's phase loss below 30°.
const LARGEST_BANDWIDTH: f32 = 0.3;
/// Fraction bits of the integrator, nominal voltages.
const INTEGRATOR_BITS: u32 = 52;

const HALF_TICK: u16 = ONE_TICK as u16 / 2;
/// The feed-forward differentiates the acceleration up to this gain, Q4: a step of it asks for nine times as much for a moment. At 2 a
/// sine behind a winding of 5 % of the time constant was followed by a fifth worse, at 8 by a tenth better.
const MOST_GAIN: u32 = 4 * ONE_TICK;
/// Half of the last place of a speed, as an acceleration: for rounding.
const HALF_SPEED: i32 = 1 << (ACCELERATION_BITS - SPEED_BITS - 1);

/// Share of the time constant without a count after which an axis off its target is stuck.
const STUCK_SHARE: f32 = 0.25;
/// Voltage per time constant by which the integrator of a stuck axis grows at least, nominal voltages. With a fine
/// encoder and a slow motor a few counts would otherwise take minutes to overcome the uncompensated rest of a dead zone.
const STUCK_RATE: f32 = 1.0 / 128.0;

/// What the user may choose about the loops.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// Bandwidth of the position loop in units of 1/τ. 0.6 … 20.
    pub bandwidth: f32,
    /// Removes a steady position error.
    pub integral: bool,
}

impl Tuning {
    /// Range of [`Tuning::bandwidth`] that is worth choosing.
    pub const BANDWIDTHS: (f32, f32) = (SMALLEST_BANDWIDTH, 20.0);
}

impl Default for Tuning {
    fn default() -> Self {
        Self { bandwidth: 1.7, integral: true }
    }
}

/// Where the axis is to be now.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Reference {
    /// Position.
    pub position: Position,
    /// Its rate of change.
    pub speed: Speed,
    /// The rate of change of that.
    pub acceleration: Acceleration,
}

impl Reference {
    /// A position to stay at.
    #[must_use]
    #[inline]
    pub const fn rest(position: Position) -> Self {
        Self { position, speed: Speed(0), acceleration: Acceleration(0) }
    }

    /// A tick later, if the acceleration stays.
    #[must_use]
    #[inline]
    pub fn drift(&self) -> Self {
        let half = (self.acceleration.0 as i64) << (31 - ACCELERATION_BITS);
        let gained = self.acceleration.0.saturating_add(HALF_SPEED) >> (ACCELERATION_BITS - SPEED_BITS);
        Self {
            position: self.position.plus(self.speed.per_tick()).plus(half),
            speed: Speed(self.speed.0.saturating_add(gained)),
            acceleration: self.acceleration,
        }
    }

    /// True while it does not move.
    #[must_use]
    #[inline]
    pub fn rests(&self) -> bool {
        self.speed.0 == 0 && self.acceleration.0 == 0
    }
}

/// The gains as real numbers, per control tick, for people and for analysis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Gains {
    /// k_p, 1/tick.
    pub position: f32,
    /// k_v, nominal voltages per count per tick.
    pub speed: f32,
    /// k_i, nominal voltages per count and tick.
    pub integral: f32,
}

/// Fixed-point gains of the loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Params {
    /// k_p, counts per tick per count, Q28.
    position: i32,
    /// k_v, voltage per speed, Q20.
    speed: i32,
    /// k_i, voltage per count and tick, Q40.
    integral: i32,
    /// 1/ω₀, voltage per speed, Q20.
    feed_speed: i32,
    /// τ/ω₀, voltage per acceleration, Q12.
    feed_acceleration: i32,
    /// Error with which a stuck axis integrates at least, counts Q12.
    stuck_error: i32,
    /// Ticks without a count after which an axis is stuck.
    stuck_ticks: u32,
}

impl Params {
    /// Gains for a motor. Runs once after an identification, in single precision, whose `+ − × ÷` are the same bits
    /// on every machine.
    #[must_use]
    pub fn new(motor: &Motor, tuning: &Tuning) -> Self {
        let tau = motor.tau_ticks;
        let bandwidth = tuning.bandwidth.max(SMALLEST_BANDWIDTH).min(LARGEST_BANDWIDTH * tau) / tau;
        let damping = 2.0 * bandwidth * tau - 1.0;
        let position = bandwidth * bandwidth * tau / damping;
        let stiffness = bandwidth * bandwidth * tau / motor.full_speed;
        let integral = if tuning.integral { stiffness * INTEGRAL_SHARE * bandwidth } else { 0.0 };
        Self {
            position: to_fixed(position, 28),
            speed: to_fixed(damping / motor.full_speed, 20),
            integral: to_fixed(integral, 40),
            feed_speed: to_fixed(1.0 / motor.full_speed, 20),
            feed_acceleration: to_fixed(tau / motor.full_speed, 12),
            stuck_error: to_fixed(STUCK_RATE / (stiffness * INTEGRAL_SHARE * bandwidth * tau), 12),
            stuck_ticks: (STUCK_SHARE * tau) as u32,
        }
    }
}

/// How far the feed-forward looks ahead.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Ahead {
    /// Ticks from a sample to the middle of the tick in which its duty acts, Q4.
    late: u16,
    /// The lag, control ticks, Q4.
    lag: u16,
    /// What the high pass of both makes of the acceleration: its gain, Q4, and the way of its low pass in a tick, Q30.
    gain: i32,
    step: i32,
}

impl Ahead {
    fn new(late: u16, lag: u16) -> Self {
        let both = u32::from(late).wrapping_add(u32::from(lag));
        let gain = both.clamp(1, MOST_GAIN);
        let step = low_pass_step(both.wrapping_mul(ONE_TICK) / gain);
        Self { late, lag, gain: gain as i32, step }
    }
}

/// What the loops remember.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct State {
    /// Q52 of nominal voltage.
    integrator: i64,
    ahead: Ahead,
    /// Low pass of the reference's acceleration.
    lagging: LowPass,
    /// The integrator when the error changed its sign last, at rest.
    bracket: i64,
    /// Sign of the error at rest.
    side: i32,
    /// Ticks without a count.
    still: u32,
    count: i32,
}

impl State {
    /// Of an axis whose duty acts so many ticks behind its sample.
    pub fn new(delay_ticks: u8) -> Self {
        let late = (u16::from(delay_ticks) << LAG_FRAC).wrapping_add(HALF_TICK);
        Self { ahead: Ahead::new(late, 0), ..Self::default() }
    }

    /// The reference's speed when the duty acts.
    #[inline]
    fn then(&self, reference: &Reference) -> Speed {
        const SHIFT: u32 = ACCELERATION_BITS - SPEED_BITS + LAG_FRAC;
        let gained = mul_shift_within(reference.acceleration.0, i32::from(self.ahead.late), SHIFT);
        Speed(reference.speed.0.saturating_add(gained))
    }

    /// The integrator's voltage.
    #[must_use]
    #[inline]
    pub fn integral(&self) -> Voltage {
        // The upper word.
        Voltage((self.integrator >> (INTEGRATOR_BITS - Voltage::BITS)) as i32)
    }

    /// Notes whether the shaft moves.
    #[inline]
    pub fn watch(&mut self, count: i32) {
        self.still = if count == self.count { self.still.saturating_add(1) } else { 0 };
        self.count = count;
    }

    /// Forgets all but what the axis and its motor are.
    #[inline]
    pub fn begin(&mut self) {
        *self = Self { ahead: self.ahead, ..Self::default() };
    }

    /// This is the motor's lag from now on, control ticks, Q4.
    pub fn take(&mut self, lag: u16) {
        self.ahead = Ahead::new(self.ahead.late, lag);
        self.lagging = LowPass::default();
    }

    /// The reference rests: nothing is kept back any more.
    #[inline]
    pub fn rest(&mut self) {
        self.lagging = LowPass::default();
    }

    /// So much of what the integrator brings comes from somewhere else from now on, or no longer does.
    pub fn shift(&mut self, voltage: Voltage) {
        self.preset(self.integral().plus(voltage));
    }

    /// Takes over at `voltage` without a step.
    #[inline]
    pub fn preset(&mut self, voltage: Voltage) {
        self.integrator = (voltage.0 as i64) << (INTEGRATOR_BITS - Voltage::BITS);
    }
}

impl Params {
    /// As real numbers.
    #[must_use]
    #[inline]
    pub fn gains(&self) -> Gains {
        Gains {
            position: self.position as f32 / (1u64 << 28) as f32,
            speed: self.speed as f32 / (1u64 << 20) as f32,
            // Error in Q12 times Q40 is the integrator's Q52.
            integral: self.integral as f32 / (1u64 << 40) as f32,
        }
    }

    /// What the position loop answers to an error of one count, in nominal voltages.
    #[must_use]
    #[inline]
    pub fn per_count(&self) -> f32 {
        let gains = self.gains();
        gains.position * gains.speed
    }

    /// Voltage that this acceleration takes.
    #[must_use]
    #[inline]
    pub fn accelerating_voltage(&self, acceleration: Acceleration) -> Voltage {
        Voltage(mul_shift(acceleration.0, self.feed_acceleration, 16))
    }

    /// Position error, counts Q12, that asks for this speed, counts per tick.
    #[must_use]
    #[inline]
    pub fn error_for(&self, speed: f32) -> i32 {
        to_fixed(speed / (self.position as f32 / (1u32 << 28) as f32), ERROR_BITS)
    }

    /// Steady voltage behind the dead zone that keeps `speed`.
    #[must_use]
    #[inline]
    pub fn steady_voltage(&self, speed: Speed) -> Voltage {
        Voltage(mul_shift(speed.0, self.feed_speed, 20))
    }

    /// Position error → wanted speed, within ±`limit`; true if the limit acts.
    #[must_use]
    #[inline]
    pub fn position_loop(&self, error: i32, reference: Speed, limit: Speed) -> (Speed, bool) {
        let wanted = reference.0.saturating_add(mul_shift(error, self.position, 20));
        let allowed = limited(wanted, limit.0);
        (Speed(allowed), allowed != wanted)
    }

    /// Wanted speed → voltage behind the dead zone, before the clip.
    #[must_use]
    #[inline]
    pub fn speed_loop(
        &self,
        state: &mut State,
        reference: &Reference,
        wanted: Speed,
        speed: Speed,
    ) -> Voltage {
        let lack = wanted.0.saturating_sub(speed.0);
        let ahead = Self::ahead(state, reference.acceleration);
        self.steady_voltage(state.then(reference))
            .plus(self.accelerating_voltage(ahead))
            .plus(Voltage(mul_shift(lack, self.speed, 20)))
            .plus(state.integral())
    }

    /// The acceleration, and beforehand what the lag will keep back of it.
    #[inline]
    fn ahead(state: &mut State, acceleration: Acceleration) -> Acceleration {
        let kept_back = state.lagging.pass(acceleration.0, state.ahead.step);
        let gained = mul_shift(kept_back, state.ahead.gain, LAG_FRAC);
        Acceleration(acceleration.0.saturating_add(gained))
    }

    /// The error that the integrator takes in while the reference rests. Stuck off the target, it is at least the one
    /// that gives `STUCK_RATE`. Beyond the target, what is needed lies between the integrator now and at the last
    /// crossing: halving that interval each time ends the hunting that a dead zone and an integrator do together.
    #[inline]
    pub fn at_rest(&self, state: &mut State, error: i32, friction: bool) -> i32 {
        if error.signum() == state.side.wrapping_neg() {
            state.integrator = (state.integrator >> 1).saturating_add(state.bracket >> 1);
        }
        if error.signum() != state.side {
            state.bracket = state.integrator;
            state.side = error.signum();
        }
        let stuck = friction && state.still >= self.stuck_ticks && error.saturating_abs() < self.stuck_error;
        if stuck { self.stuck_error.saturating_mul(error.signum()) } else { error }
    }

    /// Forgets what was learned about the last resting place.
    #[inline]
    pub fn in_motion(&self, state: &mut State) {
        state.side = 0;
    }

    /// The integrator's tick. `beyond`: by how much the wanted voltage exceeds the clipped one, zero without clip. While
    /// it is clipped, the integrator takes in only what leads out of the clip (conditional integration): most of what is
    /// clipped off is feed-forward, and the integrator would need its own slow time to forget that again.
    #[inline]
    pub fn integrate(&self, state: &mut State, error: i32, beyond: Voltage) {
        // Clipped off, and of the same sign.
        let further = beyond.0 != 0 && error != 0 && (beyond.0 ^ error) >= 0;
        if self.integral != 0 && !further {
            let step = (error as i64).wrapping_mul(self.integral as i64);
            // At most 2⁶² on top of 2⁶³⁻⁸ (a preset voltage is far from the ends of its 32 bits).
            state.integrator = bounded(state.integrator.wrapping_add(step), Voltage::NOMINAL.0);
        }
    }
}
