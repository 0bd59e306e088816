//! Sine set-points: `θ = A·e(r)·sin φ` with the envelope `e = r³(10 − 15r + 6r²)` rising over the first turn of φ and
//! falling over the last, so speed and acceleration start and end at zero. Derivatives are analytic:
//!
//! ```text
//! ω = W·(e·cos φ + e′·sin φ)                W = A·φ̇
//! α = G·(2e′·cos φ + (e″ − e)·sin φ)        G = A·φ̇²       e′, e″: derivatives by φ
//! ```
//!
//! A slow sine is computed once in up to [`MOST_BETWEEN`] ticks. In between the acceleration goes on as it changed between
//! the last two computed ones, and speed and position follow from it. The number of ticks is chosen so that an acceleration
//! that stayed would do as well.

use super::trajectory::{Limits, ONE, PI, envelope, ramp_turns, root};
use crate::control::Reference;
use crate::units::{
    ACCELERATION_BITS, Acceleration, Position, SPEED_BITS, Speed, mul_high, mul_shift, mul_shift_within, sin,
    to_fixed,
};

/// sin and cos of `phase` (2³² a turn), Q30.
#[must_use]
#[inline]
pub fn sin_cos(phase: u32) -> (i32, i32) {
    (sin(phase), sin(phase.wrapping_add(1 << 30)))
}

/// Ticks between two set-points that are computed, at most.
pub const MOST_BETWEEN: u32 = 8;
/// Position, counts, and share of the largest acceleration that may be left out in between.
const MOST_LEFT_OUT: (f32, f32) = (1.0 / 1024.0, 1.0 / 64.0);

/// Largest error of [`sin_cos`], LSB of Q30 (2⁻³⁰).
pub const SIN_ERROR: i32 = 4;

/// A sine with smooth ends, planned.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sine {
    centre: Position,
    /// A, counts, Q8.
    amplitude: i32,
    /// W, counts per tick, Q20.
    speed: i32,
    /// G, counts per tick², Q24.
    acceleration: i32,
    /// Phase per tick, 2³² a turn.
    increment: u32,
    /// r per tick, Q36.
    ramp: u32,
    /// dr/dφ, Q28.
    per_radian: i32,
    /// Length, ticks.
    length: u32,
    /// Ticks done.
    elapsed: u32,
    /// Ticks from one computed set-point to the next, and to the next one from now.
    between: u32,
    left: u32,
    /// The last set-point.
    last: Reference,
    /// The last computed acceleration, and what it had changed by.
    bend: [i32; 2],
}

impl Sine {
    /// Shortest sine, turns: half of it rises, half of it falls.
    pub const SHORTEST_TURNS: f32 = 0.5;
    /// Fewest ticks a turn.
    pub const FEWEST_TICKS: f32 = 50.0;
    /// Largest amplitude, counts.
    pub const LARGEST_COUNTS: f32 = 8e6;

    /// `amplitude` in counts, `frequency` in turns per tick, `length` in ticks. `None`: outside the limits above, or
    /// faster than a [`Speed`] or an [`Acceleration`] can say.
    #[must_use]
    pub fn plan(centre: Position, amplitude: f32, frequency: f32, length: u32) -> Option<Self> {
        let turns = frequency * length as f32;
        let radians = 2.0 * PI * frequency;
        let (speed, acceleration) = (amplitude * radians, amplitude * radians * radians);
        let fits =
            amplitude.abs() <= Self::LARGEST_COUNTS && speed.abs() < 900.0 && acceleration.abs() < 50.0;
        let ramp_turns = ramp_turns(turns);
        let ok = fits && frequency * Self::FEWEST_TICKS <= 1.0 && turns >= Self::SHORTEST_TURNS;
        ok.then(|| Self {
            centre,
            amplitude: to_fixed(amplitude, 8),
            speed: to_fixed(speed, SPEED_BITS),
            acceleration: to_fixed(acceleration, ACCELERATION_BITS),
            increment: (frequency * 4_294_967_296.0) as u32,
            ramp: (frequency / ramp_turns * 68_719_476_736.0) as u32,
            per_radian: to_fixed(1.0 / (2.0 * PI * ramp_turns), 28),
            length,
            elapsed: 0,
            between: between(amplitude.abs(), radians, ramp_turns),
            left: 0,
            last: Reference::rest(centre),
            bend: [0; 2],
        })
    }

    /// The set-point of this tick; at rest in the centre after the last.
    #[inline]
    pub fn step(&mut self) -> Reference {
        if self.left > 0 && self.elapsed < self.length {
            self.left = self.left.wrapping_sub(1);
            self.elapsed = self.elapsed.wrapping_add(1);
            self.last = self.last.drift();
            let [bend, change] = self.bend;
            let gone = self.between.wrapping_sub(self.left).wrapping_sub(1) as i32;
            let gained = change.wrapping_mul(gone) >> (self.between.trailing_zeros() & 31);
            self.last.acceleration = Acceleration(bend.saturating_add(gained));
        } else {
            self.left = self.between.wrapping_sub(1);
            self.last = self.computed();
            let [before, bend] = [self.bend[0], self.last.acceleration.0];
            self.bend = [bend, bend.saturating_sub(before)];
        }
        self.last
    }

    #[cold]
    #[inline]
    fn computed(&mut self) -> Reference {
        let left = self.length.saturating_sub(self.elapsed);
        let falling = left < self.elapsed;
        let ticks = left.min(self.elapsed);
        if ticks == 0 {
            // The envelope is zero, and so is all that is multiplied by it: the same bits as below.
            self.elapsed = self.elapsed.saturating_add(u32::from(left > 0));
            return Reference::rest(self.centre);
        }
        let r = (u64::from(ticks).wrapping_mul(u64::from(self.ramp)) >> 6).min(ONE as u64) as i32;
        let phase = self.elapsed.wrapping_mul(self.increment);
        self.elapsed = self.elapsed.saturating_add(u32::from(left > 0));
        self.at(phase, r, falling)
    }

    /// Is the next set-point computed, though not every one is?
    #[must_use]
    #[inline]
    pub(crate) fn is_computing(&self) -> bool {
        self.left == 0 && self.between > 1
    }

    /// True when the sine has ended.
    #[must_use]
    #[inline]
    pub fn done(&self) -> bool {
        self.elapsed >= self.length
    }

    /// Position around which it swings.
    #[must_use]
    #[inline]
    pub fn centre(&self) -> Position {
        self.centre
    }

    #[inline]
    fn at(&self, phase: u32, r: i32, falling: bool) -> Reference {
        let (sin, cos) = sin_cos(phase);
        let (offset, speed, acceleration) = if r >= ONE {
            // Between rise and fall e = 1, and its derivatives vanish: the same bits as below.
            (sin, mul_high(ONE, cos), mul_shift_within((ONE >> 4).wrapping_neg(), sin, 30))
        } else {
            self.shaped(r, falling, sin, cos)
        };
        let offset = (self.amplitude as i64).wrapping_mul(offset as i64) >> 6;
        Reference {
            position: self.centre.plus(offset),
            speed: Speed(mul_shift(self.speed, speed, 28)),
            acceleration: Acceleration(mul_shift(self.acceleration, acceleration, 26)),
        }
    }

    /// θ/A in Q30, ω/W in Q28, α/G in Q26 while the envelope rises or falls.
    #[inline]
    fn shaped(&self, r: i32, falling: bool, sin: i32, cos: i32) -> (i32, i32, i32) {
        let (value, slope, bend) = envelope(r);
        // dr/dφ is below 1, and so are sin, cos and the envelope.
        let per_radian = |x: i32| mul_shift_within(x, self.per_radian, 28);
        let slope = per_radian(slope);
        let slope = if falling { slope.wrapping_neg() } else { slope };
        let bend = per_radian(per_radian(bend));
        let speed = mul_high(value, cos).wrapping_add(mul_shift_within(slope, sin, 30));
        let acceleration = mul_shift_within(slope, cos, 31).wrapping_add(mul_shift_within(
            bend.wrapping_sub(value >> 4),
            sin,
            30,
        ));
        (mul_shift_within(value, sin, 30), speed, acceleration)
    }
}

/// Ticks between two computed set-points, a power of two. Magnitudes; the bound of the jerk is that of
/// [`Shape`].
fn between(amplitude: f32, radians: f32, ramp_turns: f32) -> u32 {
    let slope = 1.0 / (2.0 * PI * ramp_turns);
    let square = slope * slope;
    let bend = 1.0 + square * (17.0 + 47.0 * square);
    let jerk = amplitude * radians * radians * radians * bend;
    let (position, acceleration) = MOST_LEFT_OUT;
    let mut ticks = MOST_BETWEEN;
    loop {
        let gone = ticks.wrapping_sub(1) as f32;
        let near = jerk * gone * gone * gone <= 6.0 * position && radians * bend * gone <= acceleration;
        if near || ticks <= 1 {
            return ticks;
        }
        ticks /= 2;
    }
}

/// A sine but for its centre, and what it asks of a motor: all that follows from amplitude, frequency and length alone.
/// Whoever takes orders computes it, and the control tick adds where the shaft is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Around zero; `None`: outside the limits of a [`Sine`].
    sine: Option<Sine>,
    /// Farthest from the centre, counts.
    pub swing: f32,
    /// Peak speed, counts per tick.
    pub speed: f32,
    /// Peak acceleration, counts per tick².
    acceleration: f32,
    /// Peak jerk, counts per tick³.
    jerk: f32,
    /// Phase per tick, rad.
    radians: f32,
    /// What the rise of the envelope adds to the lag of the motor, as a factor.
    rise: f32,
}

impl Shape {
    /// `amplitude` in counts, `frequency` in turns per tick, `length` in ticks.
    ///
    /// While its envelope rises or falls over n turns, a sine asks for at most 1 + 6.2k² of its acceleration and
    /// 1 + 17k² + 47k⁴ of its jerk, with k = 1/2πn: bounds of the derivatives of `e·sin φ` for n = 1/4 … 1.
    #[must_use]
    #[cold]
    #[inline(never)]
    pub fn new(amplitude: f32, frequency: f32, length: u32) -> Self {
        let swing = amplitude.abs();
        let radians = 2.0 * PI * frequency;
        let slope = 1.0 / (2.0 * PI * ramp_turns(frequency * length as f32));
        let square = slope * slope;
        let acceleration = swing * radians * radians;
        Self {
            sine: Sine::plan(Position(0), amplitude, frequency, length),
            swing,
            speed: swing * radians,
            acceleration: acceleration * (1.0 + 6.2 * square),
            jerk: acceleration * radians * (1.0 + square * (17.0 + 47.0 * square)),
            radians,
            rise: (1.0 + 6.2 * slope * slope) / 1.157,
        }
    }

    /// Does it keep the limits of acceleration and jerk?
    #[must_use]
    pub fn keeps(&self, limits: &Limits) -> bool {
        self.acceleration <= limits.acceleration && self.jerk <= limits.jerk
    }

    /// Around this place.
    #[must_use]
    pub fn around(&self, centre: Position) -> Option<Sine> {
        Some(Sine { centre, last: Reference::rest(centre), ..self.sine? })
    }

    /// Peak of `|ω + τ·ω̇|`, counts per tick: the speed that the voltage it takes would sustain. `tau_ticks` of the motor.
    ///
    /// In the middle it is `A·Ω·√(1 + (Ωτ)²)`. The rise over a full turn takes up to 13 % more for a moment, which is not
    /// counted; what a shorter one takes beyond that is, as in acceleration and jerk.
    #[must_use]
    pub fn takes(&self, tau_ticks: f32) -> f32 {
        if tau_ticks <= 0.0 {
            // The root of one: the same bits as below.
            return self.speed;
        }
        let lag = self.radians * tau_ticks * self.rise;
        self.speed * root(1.0 + lag * lag)
    }
}

/// [`Shape::takes`] of a sine. `amplitude` in counts, `frequency` in turns per tick, `length` in ticks.
#[must_use]
pub fn sine_takes(tau_ticks: f32, amplitude: f32, frequency: f32, length: u32) -> f32 {
    Shape::new(amplitude, frequency, length).takes(tau_ticks)
}
