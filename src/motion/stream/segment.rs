//! From one point of a stream to the next: a polynomial in the share r of the time that has passed.
//!
//! ```text
//! θ = θ₀ + c₁r + c₂r² + c₃r³ + c₄r⁴ + c₅r⁵        r = t/T
//! cubic    c₁ = ω₀T   c₂ = 3D − 2ω₀T − ω₁T   c₃ = −2D + ω₀T + ω₁T                       D = θ₁ − θ₀
//! quintic  c₁ = ω₀T   c₂ = α₀T²/2            c₃ = 10D − 6ω₀T − 4ω₁T − 3/2·α₀T² + 1/2·α₁T²
//!          c₄ = −15D + 8ω₀T + 7ω₁T + 3/2·α₀T² − α₁T²   c₅ = 6D − 3ω₀T − 3ω₁T − 1/2·α₀T² + 1/2·α₁T²
//! ```
//!
//! (Hermite interpolation: position and speed, or position, speed and acceleration at both ends.) Planned once in single
//! precision, whose `+ − × ÷` are the same bits on every machine; evaluated in integers, each polynomial with as many
//! fraction bits as the sum of its coefficients leaves.

use super::Point;
use crate::control::Reference;
use crate::units::{
    ACCELERATION_BITS, Acceleration, Position, SPEED_BITS, Speed, counts_in, mul_shift_within, saturate,
    to_fixed, whole,
};

/// Fastest point, counts per tick, and largest acceleration, counts per tick², as of a sine.
const FASTEST: f32 = 900.0;
const HARDEST: f32 = 50.0;
/// Farthest between two points: the sum of the coefficients, counts.
const FARTHEST: f32 = 1.3e8;
/// 1 in Q60, the unit of the clock.
const ONE_Q60: f32 = 1_152_921_504_606_846_976.0;

/// A point in machine units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Knot {
    pub position: Position,
    pub speed: Speed,
    /// At a point that has none: what its cubic ends with.
    pub acceleration: Acceleration,
    /// Was the acceleration given?
    bends: bool,
    ticks: u32,
}

impl Knot {
    /// Where a set-point is.
    pub fn at(reference: &Reference) -> Self {
        Self {
            position: reference.position,
            speed: reference.speed,
            acceleration: reference.acceleration,
            bends: true,
            ticks: 0,
        }
    }

    /// A streamed point; `None`: out of range. `zero`: the count that positions refer to; a rad is so many counts.
    pub fn of(point: &Point, zero: i32, counts_per_rad: f32, tick_hz: f32) -> Option<Self> {
        let counts = point.position_rad * counts_per_rad;
        let speed = point.speed_rad_s * counts_per_rad / tick_hz;
        let acceleration = point.acceleration_rad_s2.unwrap_or(0.0) * counts_per_rad / tick_hz / tick_hz;
        let ticks = Point::FEWEST_TICKS..=Point::MOST_TICKS;
        // No number that is none passes a comparison.
        let fits = counts.abs() < crate::motion::trajectory::Move::LARGEST_COUNTS
            && speed.abs() < FASTEST
            && acceleration.abs() < HARDEST
            && ticks.contains(&point.ticks);
        fits.then(|| Self {
            position: Position::of_count(zero).plus(whole(counts * 4_294_967_296.0)),
            speed: Speed(to_fixed(speed, SPEED_BITS)),
            acceleration: Acceleration(to_fixed(acceleration, ACCELERATION_BITS)),
            bends: point.acceleration_rad_s2.is_some(),
            ticks: point.ticks,
        })
    }
}

/// A segment in single precision.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Plan {
    start: Position,
    /// As it will be reached: with an acceleration in any case.
    pub end: Knot,
    ticks: f32,
    /// c₁ … c₅, counts.
    coefficients: [f32; 5],
}

impl Plan {
    /// `None`: too far.
    pub fn new(start: &Knot, end: &Knot) -> Option<Self> {
        let ticks = end.ticks as f32;
        let real = |value: i32, bits: u32| value as f32 / (1u32 << bits) as f32;
        let offset = end.position.0.wrapping_sub(start.position.0);
        let distance = counts_in(offset);
        let [w0, w1] = [start.speed, end.speed].map(|speed| real(speed.0, SPEED_BITS) * ticks);
        let [a0, a1] = [start.acceleration, end.acceleration]
            .map(|acceleration| real(acceleration.0, ACCELERATION_BITS) * ticks * ticks);
        let coefficients = if end.bends {
            [
                w0,
                0.5 * a0,
                10.0 * distance - 6.0 * w0 - 4.0 * w1 - 1.5 * a0 + 0.5 * a1,
                -15.0 * distance + 8.0 * w0 + 7.0 * w1 + 1.5 * a0 - a1,
                6.0 * distance - 3.0 * w0 - 3.0 * w1 - 0.5 * a0 + 0.5 * a1,
            ]
        } else {
            let square = 3.0 * distance - 2.0 * w0 - w1;
            [w0, square, -2.0 * distance + w0 + w1, 0.0, 0.0]
        };
        let [_, c2, c3, c4, c5] = coefficients;
        let bend = (2.0 * c2 + 6.0 * c3 + 12.0 * c4 + 20.0 * c5) / ticks / ticks;
        // At a point to rest at, the acceleration ends.
        let acceleration = match end.bends || end.speed.0 == 0 {
            true => end.acceleration,
            false => Acceleration(to_fixed(bend, ACCELERATION_BITS)),
        };
        let end = Knot { acceleration, ..*end };
        (total(&coefficients) < FARTHEST).then_some(Self { start: start.position, end, ticks, coefficients })
    }

    /// Smallest and largest position on the way, whole counts outwards: the polynomial lies within the hull of its
    /// Bézier points.
    pub fn hull(&self) -> [i32; 2] {
        let [c1, c2, c3, c4, c5] = self.coefficients;
        let points = [
            0.2 * c1,
            0.4 * c1 + 0.1 * c2,
            0.6 * c1 + 0.3 * c2 + 0.1 * c3,
            0.8 * c1 + 0.6 * c2 + 0.4 * c3 + 0.2 * c4,
            c1 + c2 + c3 + c4 + c5,
        ];
        let low = points.iter().fold(0.0f32, |low, point| low.min(*point));
        let high = points.iter().fold(0.0f32, |high, point| high.max(*point));
        let start = self.start.count();
        // The end point itself, not its rounded sum, is the last.
        let inner = |counts: f32| start.saturating_add(counts as i32);
        [inner(low), inner(high)]
    }
}

fn total(coefficients: &[f32]) -> f32 {
    coefficients.iter().fold(0.0, |sum, c| sum + c.abs())
}

/// A segment under way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Segment {
    start: Position,
    end: Knot,
    position: Polynomial<5>,
    speed: Polynomial<5>,
    acceleration: Polynomial<4>,
    /// r per tick, Q60.
    increment: u64,
    elapsed: u32,
}

impl Segment {
    pub fn of(plan: &Plan) -> Self {
        let [c1, c2, c3, c4, c5] = plan.coefficients;
        let per_tick = |c: f32| c / plan.ticks;
        let per_tick2 = |c: f32| c / plan.ticks / plan.ticks;
        Self {
            start: plan.start,
            end: plan.end,
            position: Polynomial::new([c5, c4, c3, c2, c1]),
            speed: Polynomial::new([5.0 * c5, 4.0 * c4, 3.0 * c3, 2.0 * c2, c1].map(per_tick)),
            acceleration: Polynomial::new([20.0 * c5, 12.0 * c4, 6.0 * c3, 2.0 * c2].map(per_tick2)),
            increment: whole(ONE_Q60 / plan.ticks) as u64,
            elapsed: 0,
        }
    }

    pub fn end(&self) -> &Knot {
        &self.end
    }

    /// Has the next tick come to the end point?
    pub fn done(&self) -> bool {
        self.elapsed >= self.end.ticks
    }

    /// The set-point of this tick: the start point in the first, the end point once it is done.
    pub fn step(&mut self) -> Reference {
        if self.done() {
            return Reference {
                position: self.end.position,
                speed: self.end.speed,
                acceleration: self.end.acceleration,
            };
        }
        let r = (u64::from(self.elapsed).wrapping_mul(self.increment) >> 30) as i32;
        self.elapsed = self.elapsed.wrapping_add(1);
        // The last step of Horner's scheme is the factor r of every term.
        let position = self.position.at(r);
        let position = mul_shift_within(position, r, 30);
        Reference {
            position: self.start.plus(self.position.scaled::<32>(position)),
            speed: Speed(saturate(self.speed.scaled::<SPEED_BITS>(self.speed.at(r)))),
            acceleration: Acceleration(saturate(
                self.acceleration.scaled::<ACCELERATION_BITS>(self.acceleration.at(r)),
            )),
        }
    }
}

/// Largest sum of magnitudes of a polynomial's coefficients, so that nothing on the way overflows.
const LARGEST: f32 = 536_870_912.0;
/// Most fraction bits.
const MOST_BITS: u32 = 28;

/// Coefficients of r, the highest power first, with a common number of fraction bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Polynomial<const N: usize> {
    coefficients: [i32; N],
    /// 2^(30 − fraction bits): the factor to Q30.
    unit: i32,
}

impl<const N: usize> Polynomial<N> {
    fn new(coefficients: [f32; N]) -> Self {
        let sum = total(&coefficients);
        let scale = |bits: u32| (1u32 << (bits & 31)) as f32;
        let mut bits = MOST_BITS;
        while bits > 2 && sum * scale(bits) >= LARGEST {
            bits = bits.wrapping_sub(1);
        }
        Self {
            coefficients: coefficients.map(|c| to_fixed(c * scale(bits), 0)),
            unit: 1 << (30u32.wrapping_sub(bits) & 31),
        }
    }

    /// `…(c₀·r + c₁)·r + …`, r in Q30.
    fn at(&self, r: i32) -> i32 {
        self.coefficients.iter().fold(0, |sum, &c| mul_shift_within(sum, r, 30).wrapping_add(c))
    }

    /// A value of this polynomial in Q`BITS`.
    fn scaled<const BITS: u32>(&self, value: i32) -> i64 {
        let q30 = (value as i64).wrapping_mul(self.unit as i64);
        if BITS >= 30 { q30 << (BITS.wrapping_sub(30) & 31) } else { q30 >> (30u32.wrapping_sub(BITS) & 31) }
    }
}
