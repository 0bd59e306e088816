//! Set-points: position, speed and acceleration that belong together, without a jump in any of them.
//!
//! Point to point, also from motion: the polynomial of fifth degree that meets position, speed and acceleration at both
//! ends. From rest it is the minimum-jerk polynomial `e(r)` (T. Flash, N. Hogan, *The coordination of arm movements*,
//! J. Neurosci. 5(7), 1985), whose peak speed is 15/8·D/T and whose peak acceleration is 10/√3·D/T². With it:
//!
//! ```text
//! θ = θ₀ + D·e(r) + ω₀T·p(r) + α₀T²·q(r)    p = r − 6r³ + 8r⁴ − 3r⁵    q = (r² − 3r³ + 3r⁴ − r⁵)/2
//! ```
//!
//! Speed set-points change along `e(r)` too, so that the acceleration is continuous and the jerk finite.

use crate::control::Reference;
use crate::units::{
    ACCELERATION_BITS, Acceleration, ERROR_BITS, Position, SPEED_BITS, Speed, Voltage, counts_in, mul_high,
    mul_shift, mul_shift_within, to_fixed,
};

/// 1 in Q30.
pub(super) const ONE: i32 = 1 << 30;
pub(super) const PI: f32 = core::f32::consts::PI;

/// The envelope and its two derivatives by r, Q30, Q28, Q26, for r in Q30, 0 … 1. Twice a Q30 number is Q31, and the
/// upper word of a product of two Q31 numbers is Q30 again.
pub(super) fn envelope(r: i32) -> (i32, i32, i32) {
    if r >= ONE {
        return (ONE, 0, 0);
    }
    let rest = ONE.wrapping_sub(r);
    let product = mul_high(r << 1, rest << 1);
    let square = mul_high(r << 1, r << 1);
    let cube = mul_high(square << 1, r << 1);
    // e = r³·(10 − 15r + 6r²), the factor in Q26.
    let factor =
        (10i32 << 26).wrapping_sub(mul_high(15 << 27, r << 1)).wrapping_add(mul_high(6 << 27, square << 1));
    let value = mul_shift_within(cube, factor, 26);
    // e′ = 30·(r·(1 − r))² and e″ = 60·r·(1 − r)·(1 − 2r); the products are at most 2⁻⁴ and 0.1.
    let slope = mul_shift_within(mul_high(product << 1, product << 1), 30 << 24, 26);
    let bend = mul_shift_within(mul_high(product << 1, rest.wrapping_sub(r) << 1), 60 << 22, 26);
    (value, slope, bend)
}

/// What a set-point may ask of the motor.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Limits {
    /// Speed, counts per tick.
    pub speed: f32,
    /// Speed that the available voltage would sustain, counts per tick: `ω + τ·ω̇` stays below it.
    pub voltage: f32,
    /// Time constant, ticks.
    pub tau_ticks: f32,
    /// Acceleration, counts per tick²; the maximum when nobody asked for a limit.
    pub acceleration: f32,
    /// Jerk, counts per tick³; likewise.
    pub jerk: f32,
}

/// Peak speed of the minimum-jerk polynomial, D/T.
const PEAK_SPEED: f32 = 1.875;
/// Its peak acceleration, D/T².
const PEAK_ACCELERATION: f32 = 5.773_503;
/// Largest magnitude of p″.
const PEAK_BRAKING: f32 = 3.8;
/// Its peak jerk, at both ends, D/T³.
const PEAK_JERK: f32 = 60.0;
/// Largest magnitudes of p‴ and q‴: at the start.
const FIRST_JERKS: (f32, f32) = (36.0, 9.0);
/// Share of the acceleration at the start that the rest of a course leaves room for: |q″| falls to it at once.
const BENT_SHARE: f32 = 0.25;
/// Shortest course, ticks.
const SHORTEST: f32 = 16.0;
/// Longest course, ticks.
const LONGEST: f32 = 1e8;

impl Limits {
    /// With no more voltage than the present supply gives.
    #[must_use]
    pub fn with_supply(&self, supply: Voltage) -> Self {
        let share = (supply.0 as f32 / Voltage::NOMINAL.0 as f32).clamp(0.1, 1.0);
        Self { voltage: self.voltage * share, ..*self }
    }

    /// Ticks that `distance` counts take from rest.
    fn ticks_over(&self, distance: f32) -> f32 {
        // voltage ≥ 15/8·D/T + τ·10/√3·D/T², solved for T.
        let linear = PEAK_SPEED * distance / self.voltage;
        let square = 4.0 * PEAK_ACCELERATION * self.tau_ticks * distance / self.voltage;
        let by_voltage = 0.5 * (linear + root(linear * linear + square));
        by_voltage.max(PEAK_SPEED * distance / self.speed)
    }

    /// Ticks that a change of speed takes.
    fn ticks_for_change(&self, speed: f32) -> f32 {
        PEAK_BRAKING * self.tau_ticks * speed / self.voltage
    }

    /// Ticks that a change of speed along `e(r)` takes to keep the limits of acceleration and jerk.
    fn gentle_change(&self, speed: f32) -> f32 {
        let by_acceleration = PEAK_SPEED * speed / self.acceleration;
        by_acceleration.max(root(PEAK_ACCELERATION * speed / self.jerk))
    }

    /// Ticks, at least so many, in which a course over `distance` keeps the limits of acceleration and jerk, from this
    /// speed and acceleration. All are magnitudes.
    ///
    /// From rest it is exact. In motion the bounds of the terms are added; each of them falls at least as 1/T.
    fn gentle_course(&self, ticks: f32, distance: f32, speed: f32, acceleration: f32) -> f32 {
        if self.acceleration == f32::MAX && self.jerk == f32::MAX {
            return ticks;
        }
        let ticks = ticks
            .max(root(PEAK_ACCELERATION * distance / self.acceleration))
            .max(cube_root(PEAK_JERK * distance / self.jerk));
        let left = self.acceleration - BENT_SHARE * acceleration.min(self.acceleration);
        let bending = (PEAK_ACCELERATION * distance / ticks + PEAK_BRAKING * speed) / ticks;
        let (carried, bent) = FIRST_JERKS;
        let jerk = ((PEAK_JERK * distance / ticks + carried * speed) / ticks + bent * acceleration) / ticks;
        ticks * (bending / left).max(jerk / self.jerk).max(1.0)
    }
}

/// Turns over which the envelope of a sine rises, and falls.
pub(super) fn ramp_turns(turns: f32) -> f32 {
    if turns < 2.0 { 0.5 * turns } else { 1.0 }
}

/// Cube root to single precision: three Newton steps from a third of the exponent, which is right to 5 % (the start of
/// fdlibm's `cbrtf`).
fn cube_root(x: f32) -> f32 {
    if x <= 0.0 {
        return 0.0;
    }
    let start = f32::from_bits((x.to_bits() / 3).wrapping_add(709_958_130));
    (0..3).fold(start, |y, _| (2.0 * y + x / (y * y)) / 3.0)
}

/// Square root to single precision: three Newton steps from micromath's start, which is right to 6 %.
pub(super) fn root(x: f32) -> f32 {
    if x <= 0.0 {
        return 0.0;
    }
    (0..3).fold(micromath::F32Ext::sqrt(x), |y, _| 0.5 * (y + x / y))
}

/// r of a course, Q30.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Clock {
    /// r per tick, Q36.
    increment: u32,
    length: u32,
    elapsed: u32,
}

impl Clock {
    fn new(ticks: f32) -> Self {
        let ticks = ticks.clamp(SHORTEST, LONGEST);
        Self {
            increment: (68_719_476_736.0 / ticks) as u32,
            length: (ticks as u32).saturating_add(1),
            elapsed: 0,
        }
    }

    /// A set-point that moves was at the start in the tick before: there a second time, it would stand still for a tick.
    fn begun(self, moving: bool) -> Self {
        Self { elapsed: u32::from(moving), ..self }
    }

    fn step(&mut self) -> i32 {
        let r = (u64::from(self.elapsed).wrapping_mul(u64::from(self.increment)) >> 6).min(ONE as u64) as i32;
        self.elapsed = self.elapsed.saturating_add(1);
        if self.done() { ONE } else { r }
    }

    fn done(&self) -> bool {
        self.elapsed > self.length
    }
}

/// Counts that the speed and the acceleration at the start of a course may carry over its time: more no Q8 can say.
const MOST_CARRIED: f32 = 8e6;

/// `c₀ + c₁r + c₂r² + …`, highest first, Q24; r in Q30.
fn polynomial(coefficients: &[i32], r: i32) -> i32 {
    coefficients.iter().fold(0, |sum, &c| mul_shift(sum, r, 30).wrapping_add(c << 24))
}

/// A course to a position, from any state of motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Move {
    clock: Clock,
    start: Reference,
    target: Position,
    /// D, Q32.
    distance: i64,
    /// D/T, Q20.
    mean_speed: i32,
    /// D/T², Q24.
    mean_acceleration: i32,
    /// ω₀T, Q8.
    carried: i32,
    /// ω₀/T, Q24.
    braking: i32,
    /// α₀T², Q8; α₀T, Q20.
    bent: [i32; 2],
    /// Counts that it goes back once it is there.
    pub(crate) back: i32,
}

impl Move {
    /// Largest distance, counts.
    pub const LARGEST_COUNTS: f32 = 5e8;

    /// Plans the course. `None`: too far.
    #[must_use]
    pub fn plan(start: &Reference, target: Position, limits: &Limits) -> Option<Self> {
        let distance = target.0.wrapping_sub(start.position.0);
        let counts = counts_in(distance);
        let speed = start.speed.0 as f32 / (1u32 << SPEED_BITS) as f32;
        let acceleration = start.acceleration.0 as f32 / (1u32 << ACCELERATION_BITS) as f32;
        let stopping = limits.ticks_for_change(speed.abs() + limits.tau_ticks * acceleration.abs());
        let ticks = (limits.ticks_over(counts.abs() + 0.5 * speed.abs() * stopping) + stopping).max(SHORTEST);
        let ticks = limits.gentle_course(ticks, counts.abs(), speed.abs(), acceleration.abs());
        let carried = speed.abs() * ticks + acceleration.abs() * ticks * ticks;
        let fits = counts.abs() <= Self::LARGEST_COUNTS && carried <= MOST_CARRIED && ticks <= LONGEST;
        fits.then(|| Self {
            clock: Clock::new(ticks).begun(!start.rests()),
            start: *start,
            target,
            distance,
            mean_speed: to_fixed(counts / ticks, SPEED_BITS),
            mean_acceleration: to_fixed(counts / ticks / ticks, ACCELERATION_BITS),
            carried: to_fixed(speed * ticks, 8),
            braking: to_fixed(speed / ticks, ACCELERATION_BITS),
            bent: [to_fixed(acceleration * ticks * ticks, 8), to_fixed(acceleration * ticks, SPEED_BITS)],
            back: 0,
        })
    }

    /// Does it turn in the next tick?
    pub(crate) fn turns(&self) -> bool {
        self.back != 0 && self.clock.elapsed >= self.clock.length
    }

    /// The set-point of this tick; at rest at the target after the last.
    #[inline]
    pub fn step(&mut self) -> Reference {
        let r = self.clock.step();
        if self.done() { Reference::rest(self.target) } else { self.at(r) }
    }

    /// True once it has arrived.
    #[must_use]
    #[inline]
    pub fn done(&self) -> bool {
        self.clock.done()
    }

    /// Where it ends.
    #[must_use]
    pub fn target(&self) -> Position {
        self.target
    }

    #[cold]
    #[inline(never)]
    fn at(&self, r: i32) -> Reference {
        if r == 0 && self.start.rests() {
            // The first set-point, in the tick that also plans: the same bits as below.
            return self.start;
        }
        let (value, slope, bend) = envelope(r);
        let whole = (self.distance >> 32).wrapping_mul(value as i64) << 2;
        let part = (self.distance & 0xffff_ffff).wrapping_mul(value as i64) >> 30;
        let offset = whole.wrapping_add(part);
        let speed = mul_shift(self.mean_speed, slope, 28);
        let acceleration = mul_shift(self.mean_acceleration, bend, 26);
        let straight = Reference {
            position: self.start.position.plus(offset),
            speed: Speed(speed),
            acceleration: Acceleration(acceleration),
        };
        // From rest nothing is carried on: all that follows is zero.
        if self.start.rests() { straight } else { self.carried_on(&straight, r) }
    }

    /// With what is left of the motion in which it began.
    #[cold]
    #[inline(never)]
    fn carried_on(&self, straight: &Reference, r: i32) -> Reference {
        let carried = (self.carried as i64).wrapping_mul(polynomial(&[-3, 8, -6, 0, 1, 0], r) as i64);
        let twice_bent = (self.bent[0] as i64).wrapping_mul(polynomial(&[-1, 3, -3, 1, 0, 0], r) as i64);
        let speed = (straight.speed.0)
            .saturating_add(mul_shift(self.start.speed.0, polynomial(&[-15, 32, -18, 0, 1], r), 24))
            .saturating_add(mul_shift(self.bent[1], polynomial(&[-5, 12, -9, 2, 0], r), 25));
        let acceleration = (straight.acceleration.0)
            .saturating_add(mul_shift(self.braking, polynomial(&[-60, 96, -36, 0], r), 24))
            .saturating_add(mul_shift(self.start.acceleration.0, polynomial(&[-10, 18, -9, 1], r), 24));
        Reference {
            position: straight.position.plus(carried).plus(twice_bent >> 1),
            speed: Speed(speed),
            acceleration: Acceleration(acceleration),
        }
    }
}

/// A speed to be kept, reached without a jump of acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cruise {
    clock: Clock,
    position: Position,
    from: i32,
    change: i32,
    /// Change of speed over its duration, Q24.
    acceleration: i32,
}

impl Cruise {
    /// Farthest that the set-point runs ahead of a shaft that cannot follow, counts Q12.
    pub const LEASH: i32 = 64 << ERROR_BITS;

    /// From the present set-point to `speed`.
    #[must_use]
    pub fn plan(start: &Reference, speed: Speed, limits: &Limits) -> Self {
        let change = speed.0.saturating_sub(start.speed.0);
        let counts = change as f32 / (1u32 << SPEED_BITS) as f32;
        let ticks = limits.ticks_for_change(counts.abs()).max(limits.gentle_change(counts.abs()));
        let clock = Clock::new(ticks.max(0.1 * limits.tau_ticks));
        let acceleration = to_fixed(counts / clock.length as f32, ACCELERATION_BITS);
        let mut cruise = Self { clock, position: start.position, from: start.speed.0, change, acceleration };
        if !start.rests() {
            // That place was the last tick's.
            cruise.step(start.position, 0);
        }
        cruise
    }

    /// True once the speed is reached.
    #[must_use]
    #[inline]
    pub fn done(&self) -> bool {
        self.clock.done()
    }

    /// The set-point of this tick. `actual` position and the longest allowed lead (counts Q12, at least
    /// [`Cruise::LEASH`]) keep it from running away from a shaft that is held.
    #[inline]
    pub fn step(&mut self, actual: Position, lead: i32) -> Reference {
        let (value, slope, _) = envelope(self.clock.step());
        let speed = Speed(self.from.saturating_add(mul_shift(self.change, value, 30)));
        let lead = lead.max(Self::LEASH);
        let ahead = self.position.minus(actual);
        let excess = ahead.saturating_sub(ahead.clamp(-lead, lead));
        let back = -((excess as i64) << (32 - ERROR_BITS));
        let reference = Reference {
            position: self.position.plus(back),
            speed,
            acceleration: Acceleration(mul_shift(self.acceleration, slope, 28)),
        };
        let half = (reference.acceleration.0 as i64) << (31 - ACCELERATION_BITS);
        self.position = reference.position.plus(speed.per_tick()).plus(half);
        reference
    }
}
