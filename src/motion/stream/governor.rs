//! What is streamed, held within the limits of speed, acceleration and voltage.
//!
//! ```text
//! |ω| ≤ ω_max        |ω + τ·ω̇| ≤ U        |ω̇| ≤ A        (U: the speed that the voltage left for set-points would sustain)
//! ```
//!
//! As long as the streamed set-point keeps them, it passes unchanged. When it does not, the governor moves on by itself,
//! as fast as the limits allow, and closes in along
//!
//! ```text
//! ω = ω_wanted + sign(e)·min(√(2·b·|e|), |e|/16 ticks)        b = min(U/τ, A)/4
//! ```
//!
//! the speed from which a quarter of the braking that is there ends at the target (L. Biagiotti, C. Melchiorri, *Trajectory
//! Planning for Automatic Machines and Robots*, Springer 2008, section 4.6: filters with constraints). When it
//! has caught up, the streamed set-point passes again. The acceleration may jump here; points that keep the limits do not
//! come here.

use crate::control::Reference;
use crate::motion::trajectory::Limits;
use crate::record::Limit;
use crate::units::{
    ACCELERATION_BITS, Acceleration, ERROR_BITS, Position, SPEED_BITS, Speed, limited, mul_shift, to_fixed,
};

/// Largest speed that a limit can say, counts per tick.
const FASTEST: f32 = 2000.0;
/// Time in which the last of a lag decays, ticks: 2 to this power.
const CLOSING_BITS: u32 = 4;
/// A lag that is none, counts Q12: 1/16.
const CAUGHT_UP: i32 = 1 << (ERROR_BITS - 4);
/// Two speeds, each rounded to Q20, may differ by so much more than their accelerations say, Q24.
const ROUNDED: i32 = 2 * SPEED_TO_ACCELERATION;
/// From Q20 to Q24.
const SPEED_TO_ACCELERATION: i32 = 1 << (ACCELERATION_BITS - SPEED_BITS);

/// The set-point that is given out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Governor {
    position: Position,
    /// Counts per tick, Q32.
    speed: i64,
    /// Does the streamed set-point pass?
    passes: bool,
    /// ω_max.
    top: Speed,
    /// U.
    sustained: Speed,
    /// A.
    hardest: Acceleration,
    /// 1/τ, Q30.
    rate: i32,
    /// b, Q24.
    braking: i32,
    stops: Option<[Position; 2]>,
}

impl Governor {
    pub fn new(start: &Reference, limits: &Limits, stops: Option<[Position; 2]>) -> Self {
        let rate = to_fixed(1.0 / limits.tau_ticks.max(1.0), 30);
        let speed = |limit: f32| Speed(to_fixed(limit.min(FASTEST), SPEED_BITS));
        let sustained = speed(limits.voltage);
        let hardest = to_fixed(limits.acceleration, ACCELERATION_BITS).max(1);
        Self {
            position: start.position,
            speed: start.speed.per_tick(),
            passes: true,
            top: speed(limits.speed.min(limits.voltage)),
            sustained,
            hardest: Acceleration(hardest),
            rate,
            braking: (mul_shift(sustained.0, rate, 26).min(hardest) >> 2).max(1),
            stops,
        }
    }

    /// The set-point of this tick, and what keeps it from the streamed one.
    #[inline]
    pub fn step(&mut self, wanted: &Reference) -> (Reference, Limit) {
        if self.passes && self.allows(wanted) && self.reaches(wanted) {
            self.position = wanted.position;
            self.speed = wanted.speed.per_tick();
            return (*wanted, Limit::None);
        }
        self.catch_up(wanted)
    }

    /// Accelerations that limit and voltage leave at this speed, Q24.
    fn room(&self, speed: Speed) -> [i32; 2] {
        let top = self.sustained.0;
        [top.wrapping_neg().saturating_sub(speed.0), top.saturating_sub(speed.0)]
            .map(|left| limited(mul_shift(left, self.rate, 26), self.hardest.0))
    }

    fn allows(&self, wanted: &Reference) -> bool {
        let [low, high] = self.room(wanted.speed);
        // Half a least significant bit is nobody's limit.
        limited(wanted.speed.0, self.top.0) == wanted.speed.0
            && wanted.acceleration.0 >= low.saturating_sub(1)
            && wanted.acceleration.0 <= high.saturating_add(1)
    }

    /// Whether the change of speed since the last tick keeps the limits too: between points a few ticks apart the acceleration
    /// swings within a tick, and that of its end says nothing of the rest.
    fn reaches(&self, wanted: &Reference) -> bool {
        let before = self.speed_q20();
        let [low, high] = self.room(before);
        let change = change(before, wanted.speed.0);
        change >= low.saturating_sub(ROUNDED) && change <= high.saturating_add(ROUNDED)
    }

    /// The speed that was given out last.
    fn speed_q20(&self) -> Speed {
        Speed((self.speed >> (32 - SPEED_BITS)) as i32)
    }

    #[inline(never)]
    fn catch_up(&mut self, wanted: &Reference) -> (Reference, Limit) {
        let before = self.speed_q20();
        let [low, high] = self.room(before);
        let coasted = self.position.plus(self.speed);
        let lag = wanted.position.minus(coasted);
        let asked = self.within_travel(coasted, wanted.speed.0.saturating_add(self.closing(lag)));
        let speed = limited(asked, self.top.0);
        let needed = change(before, speed);
        let acceleration = needed.max(low).min(high);
        let step = (acceleration as i64) << (32 - ACCELERATION_BITS);
        self.position = coasted.plus(step >> 1);
        self.speed = self.speed.wrapping_add(step);
        let left = wanted.position.minus(self.position);
        let meets = (low..=high).contains(&change(before, wanted.speed.0));
        self.passes = meets && left.saturating_abs() <= CAUGHT_UP && self.allows(wanted);
        if self.passes {
            self.position = wanted.position;
            self.speed = wanted.speed.per_tick();
            return (*wanted, Limit::None);
        }
        let limit = if acceleration != needed { Limit::Acceleration } else { Limit::Speed };
        let reference = Reference {
            position: self.position,
            speed: Speed((self.speed >> (32 - SPEED_BITS)) as i32),
            acceleration: Acceleration(acceleration),
        };
        (reference, limit)
    }

    /// Speed, counts per tick Q20, towards a place that is `lag` (counts Q12) away.
    fn closing(&self, lag: i32) -> i32 {
        let away = lag.unsigned_abs();
        // Q24 · Q12 = Q36, whose root is Q18.
        let root = root(u64::from(away).wrapping_mul(u64::from(self.braking.unsigned_abs())) << 1);
        let braked = root.min(u32::MAX >> 3) << 2;
        let decaying = away.min(u32::MAX >> 5) << (SPEED_BITS - ERROR_BITS - CLOSING_BITS);
        (braked.min(decaying) as i32).saturating_mul(lag.signum())
    }

    /// No faster towards an end stop than it can be stopped before it.
    fn within_travel(&self, place: Position, speed: i32) -> i32 {
        let Some([lower, upper]) = self.stops else {
            return speed;
        };
        let down = self.closing(lower.minus(place));
        let up = self.closing(upper.minus(place));
        speed.max(down).min(up)
    }
}

/// The acceleration, Q24, that changes one speed into another, Q20, within a tick.
fn change(before: Speed, speed: i32) -> i32 {
    speed.saturating_sub(before.0).saturating_mul(SPEED_TO_ACCELERATION)
}

/// Square root, 16 significant bits.
fn root(x: u64) -> u32 {
    let excess = 32u32.wrapping_sub(((x >> 32) as u32).leading_zeros());
    let half = excess.wrapping_add(1) >> 1;
    let mut rest = (x >> (half.wrapping_mul(2) & 63)) as u32;
    let (mut root, mut bit) = (0u32, 1u32 << 30);
    while bit != 0 {
        let trial = root | bit;
        root >>= 1;
        if rest >= trial {
            rest = rest.wrapping_sub(trial);
            root |= bit;
        }
        bit >>= 2;
    }
    root << (half & 31)
}
