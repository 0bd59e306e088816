//! What a model tells of the motor and no commissioning finds: its lag, friction that grows with the torque, what speed takes beyond
//! the linear motor, how the dead zone is made up, and the play of a gear. The lag is fed forward by [`crate::control`].

use crate::config::Config;
use crate::units::{ONE_TICK, Voltage, limited, mul_shift_within, to_fixed};
use core::fmt;
use serde::de::{SeqAccess, Visitor};
use serde::ser::SerializeTuple;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Fraction bits of a share.
const ONE_BITS: u32 = 16;
const ONE: f32 = (1u32 << ONE_BITS) as f32;
/// Numbers of [`Modelled`].
pub const NUMBERS: usize = 8;
/// Place of the skew among [`Modelled::values`].
pub const SKEW: usize = 2;
/// Place of the breakaway among [`Modelled::values`], and of its voltage.
pub const BREAKAWAY: [usize; 2] = [5, 6];
/// Place of the play.
pub const PLAY: usize = 7;
/// Key, name and unit (none for a share) of each, in the order of [`Modelled::values`].
pub const NAMES: [[&str; 3]; NUMBERS] = [
    ["lag_s", "lag", "s"],
    ["load_friction", "friction per torque", ""],
    ["viscous_skew", "viscous skew", ""],
    ["drag_per_v", "drag", "1/V"],
    ["friction_share", "friction in the dead zone", ""],
    ["breakaway", "breakaway", ""],
    ["stribeck_v", "Stribeck voltage", "V"],
    ["backlash_rad", "play of a gear", "rad"],
];

/// What a model tells of the motor and no commissioning finds. Stored and sent as a number of 16 bits a part, the first part in the lowest
/// ones; where something is known of dry friction or play, which a free bit of the first number then tells, a second one; and where
/// something is doubted, which a share of the torque beyond the largest tells, a last one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Modelled {
    /// The smaller time constant of the motor: what winding, drive and delay keep back of the acceleration. Control ticks, Q4, up to
    /// 4095 ticks; 0: none is known.
    pub lag: u16,
    /// Share of the motor's torque that friction takes, Q16, at most [`LoadFriction::MOST`].
    pub load_friction: u16,
    /// What speed takes beyond the linear motor.
    pub over_speed: OverSpeed,
    /// How the dead zone is made up.
    pub dry: DryFriction,
    /// Free play between motor and load, counts; 0: none is known. A move that goes down goes so far beyond its target and comes back, so
    /// that all targets are reached on the same flank of the teeth.
    ///
    /// Nordin, Gutman: *Controlling mechanical systems with backlash, a survey*, Automatica 38(10), 2002.
    pub play: u16,
    /// What is kept and does not act, for it is not trusted: a bit a number, that of the first of [`NAMES`] the lowest one.
    pub doubted: u8,
}

/// What of it the compensator takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Told {
    /// Friction that grows with the torque.
    pub load_friction: LoadFriction,
    /// What speed takes beyond the linear motor.
    pub over_speed: OverSpeed,
    /// How the dead zone is made up.
    pub dry: DryFriction,
}

impl Modelled {
    /// What the compensator takes of it.
    #[must_use]
    pub fn told(&self) -> Told {
        let Self { load_friction, over_speed, dry, .. } = *self;
        Told { load_friction: LoadFriction::new(load_friction), over_speed, dry }
    }

    /// Does this number, as [`Modelled::values`] has them, act?
    #[must_use]
    pub fn trusts(&self, at: usize) -> bool {
        self.doubted & 1 << at == 0
    }

    /// Of the numbers those that act, without the others.
    #[must_use]
    pub fn acting(self) -> Self {
        let [mut first, mut second, _] = <[u64; 3]>::from(Self { doubted: 0, ..self });
        let mut mask = u64::from(u16::MAX);
        for at in 0..WORD {
            first &= if self.doubted & 1 << at == 0 { u64::MAX } else { !mask };
            second &= if self.doubted & 1 << (WORD + at) == 0 { u64::MAX } else { !mask };
            mask <<= 16;
        }
        [first, second, 0].into()
    }

    /// With another value of one of the numbers, as [`Modelled::values`] has them; `None`: it is beyond [`Modelled::most`], or negative and
    /// no skew.
    #[must_use]
    pub fn with(self, at: usize, value: f32, trusted: bool, config: &Config) -> Option<Self> {
        let (mut all, most) = (self.numbers(), *Self::MOST.get(at)?);
        let low = if at == SKEW { -most } else { 0.0 };
        let number = value * Self::ones(config)[at];
        all[at] = (low..most + 0.5).contains(&number).then(|| to_fixed(number, 0))?;
        let part = |at: usize| all[at] as u16;
        Some(Self {
            lag: part(0),
            load_friction: part(1),
            over_speed: OverSpeed { skew: all[SKEW] as i16, drag: part(3) },
            dry: DryFriction { share: part(4), breakaway: part(BREAKAWAY[0]), stribeck: part(BREAKAWAY[1]) },
            play: part(PLAY),
            doubted: self.doubted & !(1 << at) | u8::from(!trusted) << at,
        })
    }

    /// The largest of each.
    const MOST: [f32; NUMBERS] = {
        let most = u16::MAX as f32;
        [most, LoadFriction::MOST as f32, i16::MAX as f32, most, most, most, most, most]
    };

    /// The largest magnitudes of [`Modelled::values`]: 4095 ticks, a quarter, a half, twice the inverse of the supply, one, sixteen, the
    /// supply, 65,535 counts.
    #[must_use]
    pub fn most(config: &Config) -> [f32; NUMBERS] {
        let ones = Self::ones(config);
        core::array::from_fn(|at| Self::MOST[at] / ones[at])
    }

    /// Is a number that acts apart by more than a tenth?
    #[must_use]
    pub fn differs(&self, other: &Self) -> bool {
        let apart = |(a, b): (i32, i32)| a.abs_diff(b) > a.unsigned_abs().max(b.unsigned_abs()) / 10;
        self.acting().numbers().into_iter().zip(other.acting().numbers()).any(apart)
    }

    /// Lag in s, share of the torque, skew, drag in 1/V, share of the friction, breakaway, its voltage in V, and backlash in rad.
    #[must_use]
    pub fn values(&self, config: &Config) -> [f32; NUMBERS] {
        let (numbers, ones) = (self.numbers(), Self::ones(config));
        core::array::from_fn(|at| numbers[at] as f32 / ones[at])
    }

    fn numbers(&self) -> [i32; NUMBERS] {
        let Self { lag, load_friction, over_speed: OverSpeed { skew, drag }, dry, play, .. } = *self;
        let DryFriction { share, breakaway, stribeck } = dry;
        let [lag, load_friction, drag, share] = [lag, load_friction, drag, share].map(i32::from);
        [lag, load_friction, skew.into(), drag, share, breakaway.into(), stribeck.into(), play.into()]
    }

    /// What one of each unit is in the numbers.
    fn ones(config: &Config) -> [f32; NUMBERS] {
        let supply = config.supply_nominal_v;
        let drag = (1u32 << OverSpeed::DRAG_BITS) as f32 * supply;
        let breakaway = (1u32 << DryFriction::BREAKAWAY_BITS) as f32;
        let counts_per_rad = config.counts_per_rev as f32 / core::f32::consts::TAU;
        let ticks = config.tick_hz as f32 * ONE_TICK as f32;
        [ticks, ONE, ONE, drag, ONE, breakaway, ONE / supply, counts_per_rad]
    }
}

/// Bit of the first number: a second one follows. Of the share beside it a quarter is the most.
const MORE: u64 = 1 << 31;
/// A share from here on: that of the torque is what goes beyond it, and a number follows that tells what is doubted.
const DOUBTS: u16 = LoadFriction::MOST + 1;
/// Numbers of 16 bits in one of those that are stored.
const WORD: usize = NUMBERS / 2;

fn share(first: u64) -> u16 {
    ((first & !MORE) >> 16) as u16
}

impl From<[u64; 3]> for Modelled {
    fn from([first, second, doubted]: [u64; 3]) -> Self {
        let share = share(first);
        let beyond = share.checked_sub(DOUBTS);
        Self {
            lag: first as u16,
            load_friction: beyond.unwrap_or(share),
            over_speed: OverSpeed { skew: (first >> 32) as i16, drag: (first >> 48) as u16 },
            dry: DryFriction {
                share: second as u16,
                breakaway: (second >> 16) as u16,
                stribeck: (second >> 32) as u16,
            },
            play: (second >> 48) as u16,
            doubted: beyond.map_or(0, |_| doubted as u8),
        }
    }
}

impl From<Modelled> for [u64; 3] {
    fn from(it: Modelled) -> Self {
        let Modelled { lag, load_friction, over_speed: OverSpeed { skew, drag }, dry, play, doubted } = it;
        let DryFriction { share, breakaway, stribeck } = dry;
        let load_friction = match doubted {
            0 => load_friction.min(LoadFriction::MOST),
            _ => load_friction.min(LoadFriction::MOST - 2) + DOUBTS,
        };
        let upper = u64::from(drag) << 48 | u64::from(skew as u16) << 32;
        let first = upper | u64::from(load_friction) << 16 | u64::from(lag);
        let lower = u64::from(breakaway) << 16 | u64::from(share);
        let second = u64::from(play) << 48 | u64::from(stribeck) << 32 | lower;
        [if second == 0 { first } else { first | MORE }, second, doubted.into()]
    }
}

impl Serialize for Modelled {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [first, second, doubted] = (*self).into();
        let length = match (second, doubted) {
            (0, 0) => 1,
            (0, _) | (_, 0) => 2,
            _ => 3,
        };
        let mut numbers = serializer.serialize_tuple(length)?;
        numbers.serialize_element(&first)?;
        for number in [second, doubted].iter().filter(|number| **number != 0) {
            numbers.serialize_element(number)?;
        }
        numbers.end()
    }
}

impl<'de> Deserialize<'de> for Modelled {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_tuple(3, Numbers)
    }
}

/// Takes the other numbers where the first one tells that there are such.
struct Numbers;

impl<'de> Visitor<'de> for Numbers {
    type Value = Modelled;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("one to three numbers")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut numbers: A) -> Result<Modelled, A::Error> {
        let first = numbers.next_element()?.unwrap_or(0);
        let mut next = |is: bool| Ok(if is { numbers.next_element()?.unwrap_or(0) } else { 0 });
        Ok([first, next(first & MORE != 0)?, next(share(first) >= DOUBTS)?].into())
    }
}

/// What speed takes beyond the linear motor: viscous friction that differs between the directions, and drag that grows with the square.
/// With the steady voltage e of the reference's speed it is the voltage
///
/// ```text
/// v = |e|·(skew + drag·e)         skew = (b₊ − b₋)/(b₊ + b₋), b±: damping with back-EMF in a direction
/// ```
///
/// beyond e. It follows the reference alone, so a wrong one is a bounded disturbance, at most half of e, and cannot make the loops unstable.
///
/// Viscous friction of each direction: A. Janot, M. Gautier, M. Brunot, *Data Set and Reference Models of EMPS*, 2019; drag: R. W. Fox,
/// A. T. McDonald, *Introduction to Fluid Mechanics*, Wiley 2011.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OverSpeed {
    /// By which share the forward direction takes more than the mean of both, and the other one less. Q16.
    pub skew: i16,
    /// Share of e by which drag grows, for an e of the nominal supply. Q15, up to 2.
    pub drag: u16,
}

impl OverSpeed {
    /// Fraction bits of the drag.
    const DRAG_BITS: u32 = 15;
    /// The largest share of e, a half, Q16. Chosen by judgement; not studied.
    const MOST: i32 = 1 << (ONE_BITS - 1);

    /// What the reference's speed takes beyond its steady voltage in the linear motor.
    #[must_use]
    #[inline]
    pub fn beyond(self, steady: Voltage) -> Voltage {
        const TO_SHARE: u32 = Voltage::BITS + OverSpeed::DRAG_BITS - ONE_BITS;
        if self == Self::default() {
            return Voltage::ZERO;
        }
        let drag = mul_shift_within(steady.0, self.drag.into(), TO_SHARE);
        let share = limited(drag.saturating_add(self.skew.into()), Self::MOST);
        Voltage(mul_shift_within(steady.0.saturating_abs(), share, ONE_BITS))
    }
}

/// How the dead zone is made up where a model tells more than the one mechanism of [`crate::identify::estimate::Estimates`]: which share of
/// its widths is friction, with the sign of the motion, beside what the drive swallows, with that of command or current; and by how much
/// friction grows near standstill. With the steady voltage e of the reference's speed, friction takes
///
/// ```text
/// width·(share + breakaway·g)        g = (1 − (e/(4·stribeck))²)¹⁶ ≈ exp(−(e/stribeck)²), off by at most 0.02
/// ```
///
/// B. Armstrong-Hélouvry, P. Dupont, C. Canudas de Wit, *Automatica* 30(7), 1994.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DryFriction {
    /// Friction's share of the widths, Q16, where the mechanism is an input dead zone or a voltage drop; 0: none. Where it is friction, all
    /// of them are.
    pub share: u16,
    /// By how much friction at breakaway exceeds that in motion, in widths, Q12, up to 16.
    pub breakaway: u16,
    /// e at which the rest of that is 1/e, nominal supplies, Q16; 0: friction is the same at every speed.
    pub stribeck: u16,
}

impl DryFriction {
    const BREAKAWAY_BITS: u32 = 12;
    /// The most that friction near standstill adds, one and a half widths. Chosen by judgement; not studied.
    const MOST: i32 = 3 << (ONE_BITS - 1);

    /// By how many widths friction exceeds its share at this steady voltage, Q16.
    #[must_use]
    #[inline]
    pub fn excess(self, steady: Voltage) -> i32 {
        const ONE: i32 = 1 << 15;
        // Four times it has two more bits. Below it 2⁹ e stays below 2³²: an image that divides 64 bits is 900 bytes larger.
        let (e, reach) =
            (steady.0.unsigned_abs(), u32::from(self.stribeck) << (Voltage::BITS - ONE_BITS + 2));
        if self.breakaway == 0 || e >= reach {
            return 0;
        }
        let way = (e << 9).checked_div(self.stribeck.into()).unwrap_or(0) as i32;
        let mut left = ONE.saturating_sub(mul_shift_within(way, way, 15));
        for _ in 0..4 {
            left = mul_shift_within(left, left, 15);
        }
        let widths = mul_shift_within(left, self.breakaway.into(), 15 + Self::BREAKAWAY_BITS - ONE_BITS);
        widths.min(Self::MOST)
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
