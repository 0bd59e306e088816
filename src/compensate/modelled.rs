//! What a model tells of the motor and no commissioning finds: its lag, and friction that grows with the torque. The lag is fed forward
//! by [`crate::control`].

use crate::units::{ONE_TICK, Voltage, mul_shift_within};
use serde::{Deserialize, Serialize};

/// Fraction bits of a share.
const ONE_BITS: u32 = 16;
const ONE: f32 = (1u32 << ONE_BITS) as f32;

/// What a model tells of the motor and no commissioning finds. Stored and sent as one number, the lag in its lower half.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "u32", into = "u32")]
pub struct Modelled {
    /// The smaller time constant of the motor: what winding, drive and delay keep back of the acceleration. Control ticks, Q4, up to
    /// 4095 ticks; 0: none is known.
    pub lag: u16,
    /// Share of the motor's torque that friction takes, Q16, at most [`LoadFriction::MOST`].
    pub load_friction: u16,
}

impl Modelled {
    /// With this lag, s, and this share of the torque, 0 … 0.25, where one is given; `None`: it is beyond what can be.
    #[must_use]
    pub fn with(self, told: [Option<f32>; 2], tick_hz: u32) -> Option<Self> {
        let ones = [tick_hz as f32 * ONE_TICK as f32, ONE];
        let most = [u16::MAX, LoadFriction::MOST];
        let mut both = [self.lag, self.load_friction];
        for (at, value) in told.into_iter().enumerate().filter_map(|(at, of)| Some((at, of?))) {
            let rounded = value * ones[at] + 0.5;
            both[at] = (0.5..most[at] as f32 + 1.0).contains(&rounded).then_some(rounded as u16)?;
        }
        Some(Self { lag: both[0], load_friction: both[1] })
    }

    /// Is a number apart by more than a tenth?
    #[must_use]
    pub fn differs(&self, other: &Self) -> bool {
        let apart = |a: u16, b: u16| a.abs_diff(b) > a.max(b) / 10;
        apart(self.lag, other.lag) || apart(self.load_friction, other.load_friction)
    }

    /// Lag in s, and share of the torque.
    #[must_use]
    pub fn values(&self, tick_hz: u32) -> [f32; 2] {
        [self.lag as f32 / ONE_TICK as f32 / tick_hz as f32, self.load_friction as f32 / ONE]
    }
}

impl From<u32> for Modelled {
    fn from(both: u32) -> Self {
        Self { lag: both as u16, load_friction: (both >> u16::BITS) as u16 }
    }
}

impl From<Modelled> for u32 {
    fn from(it: Modelled) -> Self {
        u32::from(it.load_friction) << u16::BITS | u32::from(it.lag)
    }
}

/// Friction that grows with the torque through a gear: of the motor's torque T the share a·|T| acts against the motion. In voltages
/// behind the back-EMF:
///
/// ```text
/// forward   v = T·(1 − a) while T drives the motion, T·(1 + a) while it brakes
/// inverse   T = v/(1 − a), v/(1 + a)
/// ```
///
/// Duclusaud et al., *Extended Friction Models for the Physics Simulation of Servo Actuators*, arXiv:2410.08650, 2024.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LoadFriction(u16);

impl LoadFriction {
    /// The largest share, a quarter: a wrong one makes the loops stiffer by no more than a third. Chosen by judgement; not studied.
    pub const MOST: u16 = 1 << (ONE_BITS - 2);

    /// Of the share a, Q16, at most [`LoadFriction::MOST`].
    #[must_use]
    pub fn new(share: u16) -> Self {
        Self(share.min(Self::MOST))
    }

    /// The share, Q16.
    #[must_use]
    #[inline]
    pub fn share(self) -> u16 {
        self.0
    }

    /// What the motor's voltage behind the back-EMF must have on top so that `v` is left of it, in a motion of this sign.
    #[must_use]
    #[inline]
    pub fn push(self, v: Voltage, forward: bool) -> Voltage {
        let share = u32::from(self.0);
        let (rest, sign) =
            if (v.0 > 0) == forward { ((1 << ONE_BITS) - share, 1) } else { ((1 << ONE_BITS) + share, -1) };
        // Below 2³¹: an image that divides 64 bits is 900 bytes larger.
        let part = (share << ONE_BITS).checked_div(rest).unwrap_or(0) as i32;
        Voltage(mul_shift_within(v.0, part, ONE_BITS).wrapping_mul(sign))
    }
}
