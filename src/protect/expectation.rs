//! What the identified motor must do at least: the constants of the models of [`super::motion`], and their margins.

use super::Input;
use super::looks::look_bits;
use crate::config::Scale;
use crate::encoder::Motor;
use crate::units::{Speed, Voltage, mul_shift, to_fixed};

/// Dead zones that the voltage must exceed before a shaft at rest must start: break-away friction reaches 1.6 times the
/// kinetic level and its ripple 8 % of that, cogging and random torque take a tenth each, a load step a fifth: 2.13.
/// The dead zone itself is known to 5 %.
pub const REST_MARGIN: f32 = 2.25;
/// Dead zones that friction and load can take, at most, from a shaft that turns: ripple, cogging and random torque of
/// up to 0.3, a load step of 0.2.
pub const MOVING_MARGIN: f32 = 1.5;
/// The same, at rest too, where the drive ignores small voltages and no friction holds the shaft: random torque and
/// cogging, a load step of 0.2.
pub const FREE_MARGIN: f32 = 1.5;
/// Dead zones that friction takes from a shaft that is known to turn, whatever the encoder says: ripple, cogging.
pub const KINETIC_MARGIN: f32 = 1.2;
/// The least margin: an eighth of the nominal supply, so that somebody who pushes against a joint without friction is no
/// fault; half of it in motion.
const LEAST_MARGIN: Voltage = Voltage(Voltage::NOMINAL.0 / 8);
/// Observed speed from which on a shaft counts as moving, share of full speed as a shift: 1/16. The Stribeck rise of
/// friction has died away there.
const MOVING_SHIFT: u32 = 4;
/// Largest load that is believed, nominal supplies: a motor that needs more than that to stand still is stalled.
const MOST_LOAD: Voltage = Voltage(Voltage::NOMINAL.0 / 4);
/// The winding's share of the time constant, at most: torque follows voltage with this lag. 0.1 for a large motor without
/// gear.
const FREE_LAG_SHARE: f32 = 0.12;
/// The same for small motors, whose gear's friction is the dead zone: at most 1.2 of 20 ms.
const LAG_SHARE: f32 = 0.06;
/// Faster than this many times the identified no-load speed at nominal voltage no voltage drives the motor: rated speed
/// is right within 30 % before commissioning, and the supply may be a tenth higher.
const RUNAWAY: f32 = 2.0;
/// Counts that one tick may bring beyond twice the runaway speed: jitter of the edges.
const JITTER: i32 = 4;
/// Change of speed from one tick to the next that a shaft may make, shares of full speed: an end stop at half of it; and so many times what
/// the voltage gives in a tick, for a rotor within the play of its gear. Two ticks may jitter.
const BEND: f32 = 0.5;
const BEND_TIMES: f32 = 4.0;
const BEND_JITTER: f32 = 2.0 * JITTER as f32;

/// Counts that the sure model must have travelled alone before a missing motion is a fault: of a shaft that turns.
pub const EXPECTED_COUNTS: i32 = 6;
/// The same of a shaft that no friction holds: a load turns it as it likes.
const FREE_COUNTS: i32 = 8;

/// What the motor must do at least. Times in looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Expectation {
    /// Speed per voltage, counts per look, Q20.
    pub(super) full_speed: i32,
    /// 1/τ per look, Q24.
    pub(super) inverse_tau: i32,
    /// 1/lag per look, Q24: of the winding, as far as the time constant tells, and the longer of that and what a model tells.
    inverse_winding: i32,
    inverse_lag: i32,
    /// The lag that a model tells, control ticks, Q4; 0: none.
    told_lag: u16,
    /// Looks behind a new voltage in which nothing is demanded: until the told lag is over.
    pub(super) quiet: u16,
    /// Voltage to exceed at rest by a shaft that nobody knows, by direction; the maximum: nothing is demanded.
    pub(super) rest: [Voltage; 2],
    /// The dead zone, by direction.
    dead_zone: [Voltage; 2],
    /// Voltage to exceed in motion, by direction.
    pub(super) moving: [Voltage; 2],
    /// Voltage to exceed in the likely model, by direction.
    pub(super) kinetic: [Voltage; 2],
    /// Counts of the sure model that are enough.
    pub(super) counts: i32,
    /// Friction holds the shaft at rest.
    pub(super) sticks: bool,
    /// Ticks of a look, as a shift.
    look_bits: u32,
    /// Speed that no voltage gives.
    runaway: Speed,
    /// Counts that no shaft makes in one tick.
    jump: i32,
    /// Change of the counts of a tick that no shaft makes.
    bend: u32,
}

impl Default for Expectation {
    /// Of a motor that nobody knows yet, with the bridge open: nothing is demanded, and any speed may be.
    fn default() -> Self {
        Self {
            full_speed: 0,
            inverse_tau: 0,
            inverse_winding: 0,
            inverse_lag: 0,
            told_lag: 0,
            quiet: 0,
            rest: [Voltage(i32::MAX); 2],
            dead_zone: [Voltage::ZERO; 2],
            moving: [Voltage(i32::MAX); 2],
            kinetic: [Voltage(i32::MAX); 2],
            counts: EXPECTED_COUNTS,
            sticks: false,
            look_bits: 0,
            runaway: Speed(i32::MAX),
            jump: i32::MAX,
            bend: u32::MAX,
        }
    }
}

impl Expectation {
    /// From the motor and its dead zone, for an axis of this control rate. `None` for the dead zone: nothing is demanded.
    #[must_use]
    pub fn new(motor: &Motor, dead_zone: [Option<Voltage>; 2], sticks: bool, scale: &Scale) -> Self {
        let margin = |width: Option<Voltage>, factor: f32, least: i32| {
            width.map_or(Voltage(i32::MAX), |width| {
                Voltage(mul_shift(width.0, to_fixed(factor, 16), 16)).max(Voltage(least))
            })
        };
        let look_bits = look_bits(scale);
        let ticks = (1u32 << look_bits) as f32;
        let tau = motor.tau_ticks / ticks;
        let lag = tau * if sticks { LAG_SHARE } else { FREE_LAG_SHARE };
        let inverse_lag = to_fixed((1.0 / lag).min(1.0), 24);
        let least = LEAST_MARGIN.0;
        let runaway = to_fixed(RUNAWAY * motor.full_speed, 20);
        Self {
            full_speed: to_fixed(motor.full_speed * ticks, 20),
            inverse_tau: to_fixed((1.0 / tau).min(1.0), 24),
            inverse_winding: inverse_lag,
            inverse_lag,
            told_lag: 0,
            quiet: 0,
            rest: dead_zone.map(|width| margin(width, if sticks { REST_MARGIN } else { FREE_MARGIN }, least)),
            dead_zone: dead_zone.map(Option::unwrap_or_default),
            moving: dead_zone
                .map(|width| margin(width, if sticks { MOVING_MARGIN } else { FREE_MARGIN }, least / 2)),
            kinetic: dead_zone.map(|width| margin(width, KINETIC_MARGIN, least)),
            counts: if sticks { EXPECTED_COUNTS } else { FREE_COUNTS },
            sticks,
            look_bits,
            runaway: Speed(runaway),
            jump: (runaway >> (20 - 1)).saturating_add(JITTER),
            bend: (motor.full_speed * (BEND + BEND_TIMES / motor.tau_ticks) + BEND_JITTER) as u32,
        }
    }

    /// The lag that a model tells, control ticks, Q4. Part of it may be a delay, in which no torque acts at all.
    #[cold]
    #[inline(never)]
    pub fn waits(&mut self, told_lag: u16) {
        self.told_lag = told_lag;
        self.quiet = told_lag.div_ceil(1 << (4 + (self.look_bits & 7)));
        self.inverse_lag = self.inverse_winding.min((1 << 24) / i32::from(self.quiet).max(1));
    }

    /// What [`Expectation::waits`] was told.
    #[must_use]
    pub fn told_lag(&self) -> u16 {
        self.told_lag
    }

    /// One look on of the voltage that has become torque.
    #[inline]
    pub(super) fn flows(&self, flow: i32, voltage: Voltage) -> i32 {
        approach(flow, voltage.0, self.inverse_lag)
    }

    /// The dead zone in this direction.
    pub(super) fn dead_zone(&self, side: usize) -> Voltage {
        self.dead_zone[side & 1]
    }

    /// Voltage to exceed at rest where so much is enough to start: no less than an end stop may be met with, and no more than
    /// a shaft needs that nobody knows.
    pub(super) fn at_rest(&self, enough: Voltage, side: usize) -> Voltage {
        let side = side & 1;
        enough.max(self.moving[side]).max(LEAST_MARGIN).min(self.rest[side])
    }

    /// Voltage that friction takes from a shaft that has just started and that so much held: no less than from one that is known to
    /// turn, and no more than from one that may.
    pub(super) fn starting(&self, held: Voltage, side: usize) -> Voltage {
        let side = side & 1;
        held.max(self.kinetic[side]).min(self.moving[side])
    }

    /// Have so many looks lasted for a quarter of the time constant?
    pub(super) fn lasts(&self, looks: u32) -> bool {
        (looks.min(1 << 24) as i32).saturating_mul(self.inverse_tau) >= 1 << 22
    }

    /// Speed that no voltage gives.
    #[inline]
    pub(super) fn runaway(&self) -> Speed {
        self.runaway
    }

    /// More counts than that in one tick no shaft makes, not even one that runs away.
    #[inline]
    pub(super) fn jump(&self) -> i32 {
        self.jump
    }

    /// From one tick to the next the counts do not change by more than that.
    #[inline]
    pub(super) fn bend(&self) -> u32 {
        self.bend
    }

    /// Observed speed in this direction, counts per look, Q20; of a shaft that runs back the faster of estimate and counter.
    #[inline]
    pub(super) fn observed(&self, input: &Input, direction: i32) -> i32 {
        let look = 1i32 << (self.look_bits & 15);
        let [speed, edge_speed] = [input.speed, input.edge_speed]
            .map(|speed| speed.0.saturating_mul(direction).saturating_mul(look));
        if edge_speed < 0 { speed.min(edge_speed) } else { speed }
    }

    /// One look on from a speed with this torque, counts per look, Q20.
    #[inline]
    pub(super) fn towards(&self, speed: i32, torque: i32) -> i32 {
        approach(speed, mul_shift(torque, self.full_speed, 20), self.inverse_tau)
    }

    /// Is that the speed of a shaft that turns for certain?
    #[inline]
    pub(super) fn turns(&self, speed: i32) -> bool {
        speed > self.full_speed >> MOVING_SHIFT
    }

    /// What is left of a torque, as the voltage that gives it, behind a margin and a load, which is taken to hinder
    /// whatever its sign: most loads do, and what is demanded is the least.
    #[inline]
    pub(super) fn drive(&self, torque: i32, direction: i32, margins: &[Voltage; 2], load: Voltage) -> i32 {
        self.beyond(torque, margins[usize::from(direction < 0)], load)
    }

    /// The same behind one margin.
    pub(super) fn beyond(&self, torque: i32, margin: Voltage, load: Voltage) -> i32 {
        let margin = margin.0.saturating_add(load.0.saturating_abs().min(MOST_LOAD.0));
        torque.saturating_sub(margin).max(0)
    }
}

/// One look of a first-order lag; `rate` per look, Q24.
#[inline]
fn approach(from: i32, to: i32, rate: i32) -> i32 {
    from.saturating_add(mul_shift(to.saturating_sub(from), rate, 24))
}
