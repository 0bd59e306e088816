//! Set-points: position, speed and acceleration that belong together, without a jump in any of them.
//!
//! Sine: `θ = A·e(r)·sin φ` with the envelope `e = r³(10 − 15r + 6r²)` rising over the first turn of φ and falling over
//! the last, so speed and acceleration start and end at zero. Derivatives are analytic:
//!
//! ```text
//! ω = W·(e·cos φ + e′·sin φ)                W = A·φ̇
//! α = G·(2e′·cos φ + (e″ − e)·sin φ)        G = A·φ̇²       e′, e″: derivatives by φ
//! ```
//!
//! Point to point: the minimum-jerk polynomial `e(r)` between the two positions
//! (T. Flash, N. Hogan, *The coordination of arm movements*, J. Neurosci. 5(7), 1985); its peak speed is 15/8·D/T and
//! its peak acceleration 10/√3·D/T².

use crate::control::Reference;
use crate::units::{ACCELERATION_BITS, Acceleration, Position, SPEED_BITS, Speed, mul_shift, to_fixed};

/// 1 in Q30.
const ONE: i32 = 1 << 30;
const PI: f32 = core::f32::consts::PI;

/// The envelope and its two derivatives by r, Q30, Q28, Q26, for r in Q30.
fn envelope(r: i32) -> (i32, i32, i32) {
    let rest = ONE - r;
    let product = mul_shift(r, rest, 30);
    let square = mul_shift(r, r, 30);
    // e = r³·(10 − 15r + 6r²), in two halves so that every factor fits.
    let factor = (10 << 26) - mul_shift(15 << 26, r, 30) + mul_shift(6 << 26, square, 30);
    let value = mul_shift(mul_shift(square, r, 30), factor, 26);
    let slope = mul_shift(mul_shift(product, product, 30), 30 << 24, 26);
    let bend = mul_shift(mul_shift(product, rest - r, 30), 60 << 22, 26);
    (value, slope, bend)
}

/// sin and cos of `phase` (2³² a turn), Q30.
#[must_use]
pub fn sin_cos(phase: u32) -> (i32, i32) {
    (sin(phase), sin(phase.wrapping_add(1 << 30)))
}

/// sin of `phase` (2³² a turn), Q30, within [`SIN_ERROR`].
fn sin(phase: u32) -> i32 {
    let turned = phase as i32;
    // Beyond a quarter turn: sin(π − x) = sin x. Then ±1 in Q30 is ±90°.
    let x = if (turned ^ (turned << 1)) < 0 {
        i32::MIN.wrapping_sub(turned)
    } else {
        turned
    };
    let z = mul_shift(x, x, 30);
    let horner = |sum: i32, coefficient: i32| mul_shift(sum, z, 30).wrapping_add(coefficient);
    mul_shift(
        TAYLOR
            .iter()
            .fold(0, |sum, &coefficient| horner(sum, coefficient)),
        x,
        29,
    )
}

/// Largest error of [`sin_cos`], LSB of Q30 (2⁻³⁰).
pub const SIN_ERROR: i32 = 16;
/// Taylor coefficients of sin(πx/2) in x, from x¹³ down to x¹, Q29: (π/2)ⁿ/n!. The first one left out is 7·10⁻¹⁰.
const TAYLOR: [i32; 7] = [
    31,
    -1_932,
    86_136,
    -2_513_498,
    42_784_653,
    -346_799_334,
    843_314_857,
];

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
        let ramp_turns = if turns < 2.0 { 0.5 * turns } else { 1.0 };
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
        })
    }

    /// The set-point of this tick; at rest in the centre after the last.
    pub fn step(&mut self) -> Reference {
        let left = self.length.saturating_sub(self.elapsed);
        let falling = left < self.elapsed;
        let ticks = left.min(self.elapsed);
        let r = (u64::from(ticks).wrapping_mul(u64::from(self.ramp)) >> 6).min(ONE as u64) as i32;
        let phase = self.elapsed.wrapping_mul(self.increment);
        self.elapsed = self.elapsed.saturating_add(u32::from(left > 0));
        self.at(phase, r, falling)
    }

    /// True when the sine has ended.
    #[must_use]
    pub fn done(&self) -> bool {
        self.elapsed >= self.length
    }

    /// Position around which it swings.
    #[must_use]
    pub fn centre(&self) -> Position {
        self.centre
    }

    fn at(&self, phase: u32, r: i32, falling: bool) -> Reference {
        let (sin, cos) = sin_cos(phase);
        let (value, slope, bend) = envelope(r);
        let slope = mul_shift(slope, self.per_radian, 28);
        let slope = if falling { -slope } else { slope };
        let bend = mul_shift(mul_shift(bend, self.per_radian, 28), self.per_radian, 28);
        let speed = mul_shift(value, cos, 32).wrapping_add(mul_shift(slope, sin, 30));
        let acceleration =
            mul_shift(slope, cos, 31).wrapping_add(mul_shift(bend.wrapping_sub(value >> 4), sin, 30));
        let offset = (self.amplitude as i64).wrapping_mul(mul_shift(value, sin, 30) as i64) >> 6;
        Reference {
            position: self.centre.plus(offset),
            speed: Speed(mul_shift(self.speed, speed, 28)),
            acceleration: Acceleration(mul_shift(self.acceleration, acceleration, 26)),
        }
    }
}
