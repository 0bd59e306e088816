//! Dead zone: the model and its exact inverse, and the compensator that the loops use.
//!
//! Model, smooth near zero over the width ε so that neither it nor its inverse jumps:
//!
//! ```text
//! inverse   u = v + d·sat(v/ε)                          v: wanted behind the dead zone, u: at the terminals
//! forward   v = u·ε/(ε + d)      for |u| ≤ ε + d        exactly the inverse function of the line above
//!               u − d·sign(u)    beyond
//! ```
//!
//! with `d` = `d₊` for positive and `d₋` for negative signs. ε is a power of two of the nominal supply, at most 1/128
//! (0.09 V of 12 V, a tenth of ordinary dead zones), and not more than what the position loop answers to one count:
//! a wider ε would itself be a dead zone of several counts around a target at rest.
//!
//! An *input* dead zone (driver, dead time) acts on the sign of the command, so its compensation does too. *Friction*
//! acts on the sign of the motion; fed with the command's sign it would fight the motion during every deceleration.
//! Its compensation follows the reference speed and, while the reference rests, the way to the target by the counter:
//! both are free of noise. A *voltage drop* (brushes, switches, dead time) acts on the sign of the current, which is that of
//! the voltage beyond the back-EMF: `u = e + inverse(v − e)`. Nearly all that a motor takes for its speed is back-EMF, so e is the
//! steady voltage of the reference speed. Where a model tells that friction is a part of what a commissioning has found as one number, each
//! part is compensated with its own sign ([`modelled::DryFriction`]).
//!
//! ```
//! use servo::compensate::{DeadZone, Smoothing};
//! use servo::units::Voltage;
//!
//! let tenth = Voltage(Voltage::NOMINAL.0 / 10);
//! let dead_zone = DeadZone::new(tenth, tenth, Smoothing::WIDEST);
//! let wanted = Voltage(Voltage::NOMINAL.0 / 4);
//! let terminal = dead_zone.inverse(wanted);
//! assert_eq!(terminal, wanted.plus(tenth));
//! assert_eq!(dead_zone.forward(terminal), wanted);
//! ```
//!
//! Adaptive dead-zone inverses: G. Tao, P. V. Kokotović, *Adaptive Control of Systems with Actuator and Sensor
//! Nonlinearities*, Wiley 1996, ch. 3.

pub mod modelled;
pub mod position_load;

use crate::units::{Voltage, mul_shift_within, to_fixed};
use modelled::Told;

/// The width ε of the smooth part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Smoothing {
    /// ε = nominal supply / 2^bits.
    bits: u32,
}

impl Smoothing {
    /// The widest: 1/128 of the nominal supply.
    pub const WIDEST: Self = Self { bits: 7 };
    /// The narrowest: 1/4096 of the nominal supply, about one PWM count.
    pub const NARROWEST: Self = Self { bits: 12 };

    /// The widest that does not exceed this share of the nominal supply, between the bounds.
    #[must_use]
    #[inline]
    pub fn within(share: f32) -> Self {
        let fits = |bits: &u32| share * 1u32.wrapping_shl(*bits) as f32 >= 1.0;
        let bits = (Self::WIDEST.bits..Self::NARROWEST.bits).find(fits);
        Self { bits: bits.unwrap_or(Self::NARROWEST.bits) }
    }

    /// ε.
    #[must_use]
    #[inline]
    pub const fn width(self) -> Voltage {
        Voltage(Voltage::NOMINAL.0.wrapping_shr(self.bits))
    }
}

/// Share of a friction level that is compensated while the reference rests. Below 1: over-compensated friction pushes the axis on by
/// itself. In motion nothing is held back: what is missing and what is too much are followed alike.
pub const KAPPA_FRICTION: f32 = 0.98;
/// Share of an input dead zone that is compensated while the reference rests: with an integrator too much of it hunts.
pub const KAPPA_INPUT: f32 = 0.95;
/// Both in fixed point.
const FRICTION_AT_REST: i32 = share(KAPPA_FRICTION);
const INPUT_AT_REST: i32 = share(KAPPA_INPUT);
const SHARE_BITS: u32 = 16;

const fn share(kappa: f32) -> i32 {
    (kappa * (1u32 << SHARE_BITS) as f32) as i32
}

/// One direction of the dead zone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Side {
    /// `d`, 0 … nominal.
    width: i32,
    /// ε.
    epsilon: i32,
    /// `d/ε`, Q[`OUTER_BITS`].
    outer_slope: i32,
    /// `ε/(ε + d)`, Q30.
    inner_slope: i32,
}

/// Fraction bits of the slope d/ε, which reaches 2¹² for a dead zone of the nominal supply and the narrowest ε. With
/// them `d·v/ε` is rounded as if it were divided by ε.
const OUTER_BITS: u32 = Voltage::BITS - Smoothing::WIDEST.bits;

impl Side {
    fn new(width: Voltage, smoothing: Smoothing) -> Self {
        let (width, epsilon) = (width.0.clamp(0, Voltage::NOMINAL.0), smoothing.width().0 as f32);
        Self {
            width,
            epsilon: smoothing.width().0,
            outer_slope: width.wrapping_shl(smoothing.bits.wrapping_sub(Smoothing::WIDEST.bits)),
            inner_slope: to_fixed(epsilon / (epsilon + width as f32), 30),
        }
    }

    /// `d·sat(v/ε)` for v ≥ 0.
    #[inline]
    fn push(&self, v: i32) -> i32 {
        if v >= self.epsilon { self.width } else { mul_shift_within(self.outer_slope, v, OUTER_BITS) }
    }

    #[inline]
    fn forward(&self, u: i32) -> i32 {
        let knee = self.width.saturating_add(self.epsilon);
        if u > knee { u.saturating_sub(self.width) } else { mul_shift_within(u, self.inner_slope, 30) }
    }
}

/// An asymmetric dead zone, smooth near zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeadZone {
    positive: Side,
    negative: Side,
}

impl Default for DeadZone {
    #[inline]
    fn default() -> Self {
        Self::NONE
    }
}

impl Side {
    /// No dead zone: [`Side::new`] of no width, without its division, for it is put in place in a control tick.
    const NONE: Self =
        Self { width: 0, epsilon: Smoothing::WIDEST.width().0, outer_slope: 0, inner_slope: 1 << 30 };
}

impl DeadZone {
    /// None.
    pub const NONE: Self = Self { positive: Side::NONE, negative: Side::NONE };

    /// From both widths as positive magnitudes.
    #[must_use]
    pub fn new(positive: Voltage, negative: Voltage, smoothing: Smoothing) -> Self {
        Self { positive: Side::new(positive, smoothing), negative: Side::new(negative, smoothing) }
    }

    #[inline]
    fn side(&self, sign_of: Voltage) -> &Side {
        if sign_of.0 < 0 { &self.negative } else { &self.positive }
    }

    /// What is left of the terminal voltage `u` behind the dead zone.
    #[must_use]
    #[inline]
    pub fn forward(&self, u: Voltage) -> Voltage {
        let magnitude = self.side(u).forward(u.0.saturating_abs());
        Voltage(if u.0 < 0 { magnitude.wrapping_neg() } else { magnitude })
    }

    /// The terminal voltage that leaves `v` behind the dead zone: `forward(inverse(v)) = v` within
    /// one LSB, `inverse(forward(u)) = u` within `2 + d/ε`, the slope inside ε.
    #[must_use]
    #[inline]
    pub fn inverse(&self, v: Voltage) -> Voltage {
        v.plus(self.push(v))
    }

    /// The signed part of the dead zone that acts for the sign of `z`: `d·sat(z/ε)`.
    #[must_use]
    #[inline]
    pub fn push(&self, z: Voltage) -> Voltage {
        let magnitude = self.side(z).push(z.0.saturating_abs());
        Voltage(if z.0 < 0 { magnitude.wrapping_neg() } else { magnitude })
    }
}

/// Where the compensation takes its sign from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum SignSource {
    /// The reference speed; the way to the target while the reference rests. For friction.
    #[default]
    Reference,
    /// The command. For an input dead zone.
    Command,
    /// What the command is beyond the back-EMF. For a voltage drop.
    Current,
}

/// The inverse that stands between the loops and the clip, both in volts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Compensator {
    dead_zone: DeadZone,
    sign: SignSource,
}

impl Compensator {
    /// Compensates the identified widths, at rest the share κ of them that suits the mechanism.
    #[must_use]
    pub fn new(positive: Voltage, negative: Voltage, sign: SignSource, smoothing: Smoothing) -> Self {
        Self { dead_zone: DeadZone::new(positive, negative, smoothing), sign }
    }

    /// Terminal voltage for the wanted `linear` one. `towards` is the steady voltage of the reference speed behind the
    /// dead zone or, while the reference rests, any voltage towards the target (none beside a voltage drop); `None`: wherever
    /// `linear` points. `rests`: the reference does.
    #[must_use]
    #[inline]
    pub fn apply(&self, linear: Voltage, towards: Option<Voltage>, rests: bool) -> Voltage {
        let sign_of = match (self.sign, towards) {
            (SignSource::Reference, Some(towards)) => towards,
            (SignSource::Current, Some(steady)) => linear.minus(steady),
            _ => linear,
        };
        let push = self.dead_zone.push(sign_of);
        // Not a field: every byte of it would be cleared in the tick of a new configuration.
        let at_rest = if self.sign == SignSource::Reference { FRICTION_AT_REST } else { INPUT_AT_REST };
        linear.plus(if rests { part(push, at_rest) } else { push })
    }

    /// The same beside all that a model tells: what speed takes beyond the linear motor; then friction's share of the widths, which follows the
    /// motion and grows near standstill; before it, for it is the first that the command meets, what the drive swallows; and around all
    /// of it friction that grows with the torque.
    #[must_use]
    #[cold]
    #[inline(never)]
    pub fn apply_told(&self, told: &Told, linear: Voltage, towards: Voltage, rests: bool) -> Voltage {
        let Told { load_friction, over_speed, dry } = *told;
        let friction = if self.sign == SignSource::Reference { ONE } else { dry.share.into() };
        let swallowed = ONE.saturating_sub(friction);
        let [friction, swallowed] = if rests {
            [(friction, FRICTION_AT_REST), (swallowed, INPUT_AT_REST)].map(|(of, kappa)| share_of(of, kappa))
        } else {
            [friction.saturating_add(dry.excess(towards)), swallowed]
        };
        let beyond = if rests { Voltage::ZERO } else { over_speed.beyond(towards) };
        let moved = linear.plus(beyond).plus(part(self.dead_zone.push(towards), friction));
        let sign_of = if self.sign == SignSource::Current { moved.minus(towards) } else { moved };
        let wanted = moved.plus(part(self.dead_zone.push(sign_of), swallowed));
        if rests { wanted } else { wanted.plus(load_friction.push(wanted.minus(towards), towards.0 >= 0)) }
    }
}

/// All of it.
const ONE: i32 = 1 << SHARE_BITS;

/// This share of it, Q16.
#[inline]
fn part(of: Voltage, share: i32) -> Voltage {
    Voltage(share_of(of.0, share))
}

#[inline]
fn share_of(of: i32, share: i32) -> i32 {
    mul_shift_within(of, share, SHARE_BITS)
}
