//! Does the encoder follow? Motion is judged against what the identified motor must do *at least*.
//!
//! Two models without load run beside the motor, driven by what the acting voltage leaves behind a margin:
//!
//! ```text
//! ṁ = (ω₀·u − m)/τ      u: voltage beyond margin and load, rising behind the winding's lag, falling at once
//! ```
//!
//! - The *sure* one takes off [`REST_MARGIN`] dead zones from a shaft that stands and [`MOVING_MARGIN`] from one that turns
//!   (friction at rest is higher, and what turns goes on turning). Once it has travelled [`EXPECTED_COUNTS`] without a proof
//!   that the encoder follows, something is wrong.
//! - The *likely* one takes off [`KINETIC_MARGIN`] at any time. A healthy shaft may stand where it travels, held by
//!   break-away friction; it cannot run backwards, and its current cannot show a back-EMF. So its travel counts where
//!   there is evidence of that kind.
//!
//! Friction, its ripple and load changes within the margin are no faults. The load that was observed while the encoder
//! still followed is taken off: a joint that carries a weight stands still with voltage applied. The observer's present
//! load would not do, it soon explains away any motion that is missing.
//!
//! Two counts prove that the encoder follows; the models then start anew with the speed that they show.

use super::Input;
use crate::config::Scale;
use crate::encoder::Motor;
use crate::units::{Speed, Voltage, mul_shift, to_fixed};

/// Dead zones that the voltage must exceed before a shaft at rest must start: break-away friction reaches 1.6 times the
/// kinetic level, ripple and cogging add a tenth each, and an asymmetric load adds to one side.
pub const REST_MARGIN: f32 = 2.0;
/// Dead zones that friction and load can take, at most, from a shaft that turns: ripple, cogging and random torque of
/// up to 0.3, a load step of 0.2.
pub const MOVING_MARGIN: f32 = 1.5;
/// The same, at rest too, where the drive swallows small voltages and no friction holds the shaft: random torque and
/// cogging, a load step of 0.2.
pub const FREE_MARGIN: f32 = 1.5;
/// Dead zones that friction takes from a shaft that is known to turn, whatever the encoder says: ripple, cogging.
pub const KINETIC_MARGIN: f32 = 1.2;
/// … and at least an eighth of the nominal supply, so that somebody who pushes against a joint without friction is no
/// fault; half of it in motion.
const LEAST_MARGIN: Voltage = Voltage(Voltage::NOMINAL.0 / 8);
/// Observed speed from which on a shaft counts as moving, share of full speed as a shift: 1/16. The Stribeck rise of
/// friction has died away there.
const MOVING_SHIFT: u32 = 4;
/// The same for the model: once the voltage has exceeded the margin at rest for so long that even the model has some
/// speed, 1/256, the shaft has broken away.
const STARTED_SHIFT: u32 = 8;
/// Largest load that is believed, nominal supplies: a motor that needs more than that to stand still is stalled.
const MOST_LOAD: Voltage = Voltage(Voltage::NOMINAL.0 / 4);
/// Counts that the sure model must have travelled alone before a missing motion is a fault.
pub const EXPECTED_COUNTS: i32 = 8;
/// Counts that the likely model must have travelled before evidence is weighed.
const SUSPECT_COUNTS: i32 = 8;
/// Counts of the likely model after which evidence is looked for anew.
const VAIN_COUNTS: i32 = 64;
/// The winding's share of the time constant, at most: torque follows voltage with this lag (0.1 for a large motor
/// without gear, far less for small ones).
const LAG_SHARE: f32 = 0.12;
/// Counts in the demanded direction that prove that the encoder follows.
const PROOF_COUNTS: i32 = 2;
/// Counts against the demanded direction that a reversed motor or encoder makes at least.
const REVERSED_COUNTS: i32 = 4;
/// Faster than this many times the identified no-load speed at nominal voltage no voltage drives the motor: rated speed
/// is right within 30 % before commissioning, and the supply may be a tenth higher.
const RUNAWAY: f32 = 2.0;
/// Counts that one tick may bring beyond twice the runaway speed: jitter of the edges.
const JITTER: i32 = 4;

/// What the motor must do at least. Times in looks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Expectation {
    /// Speed per voltage, counts per look, Q20.
    full_speed: i32,
    /// 1/τ per look, Q24.
    inverse_tau: i32,
    /// 1/lag per look, Q24.
    inverse_lag: i32,
    /// Voltage to exceed at rest, by direction; the maximum: nothing is demanded.
    rest: [Voltage; 2],
    /// … in motion.
    moving: [Voltage; 2],
    /// … of the likely model.
    kinetic: [Voltage; 2],
    /// Ticks of a look, as a shift.
    look_bits: u32,
    /// Speed that no voltage gives.
    runaway: Speed,
    /// Counts that no shaft makes in one tick.
    jump: i32,
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
        let (_, look_bits) = super::gather::looks(scale);
        let ticks = (1u32 << look_bits) as f32;
        let tau = motor.tau_ticks / ticks;
        let least = LEAST_MARGIN.0;
        let runaway = to_fixed(RUNAWAY * motor.full_speed, 20);
        Self {
            full_speed: to_fixed(motor.full_speed * ticks, 20),
            inverse_tau: to_fixed((1.0 / tau).min(1.0), 24),
            inverse_lag: to_fixed((1.0 / (LAG_SHARE * tau)).min(1.0), 24),
            rest: dead_zone.map(|width| margin(width, if sticks { REST_MARGIN } else { FREE_MARGIN }, least)),
            moving: dead_zone
                .map(|width| margin(width, if sticks { MOVING_MARGIN } else { FREE_MARGIN }, least / 2)),
            kinetic: dead_zone.map(|width| margin(width, KINETIC_MARGIN, least)),
            look_bits,
            runaway: Speed(runaway),
            jump: (runaway >> (20 - 1)).saturating_add(JITTER),
        }
    }

    /// Speed that no voltage gives.
    pub(super) fn runaway(&self) -> Speed {
        self.runaway
    }

    /// More counts than that in one tick no shaft makes, not even one that runs away.
    pub(super) fn jump(&self) -> i32 {
        self.jump
    }

    /// Observed speed in this direction, counts per look, Q20.
    fn observed(&self, input: &Input, direction: i32) -> i32 {
        let look = 1i32 << (self.look_bits & 15);
        input.speed.0.saturating_mul(direction).saturating_mul(look)
    }

    /// What the magnitude of a voltage leaves behind a margin and a load, which is taken to hinder whatever its sign:
    /// most loads do, and what is demanded is the least.
    fn drive(&self, voltage: Voltage, margins: &[Voltage; 2], load: Voltage) -> i32 {
        let margin = margins[usize::from(voltage.0 < 0)]
            .0
            .saturating_add(load.0.saturating_abs().min(MOST_LOAD.0));
        voltage.0.saturating_abs().saturating_sub(margin).max(0)
    }
}

/// One of the models, in the direction of the voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Model {
    /// Voltage beyond the margin, ≥ 0.
    drive: i32,
    /// Speed that the motor must have, counts per look, Q20; below zero: it still turns against the voltage.
    speed: i32,
    /// Travel since the last proof, counts Q20.
    travel: i32,
    /// Counter at the last proof, or when there was nothing to prove.
    proof: i32,
    /// Looks since.
    since: u32,
}

impl Model {
    fn begin(speed: i32, count: i32) -> Self {
        Self {
            speed,
            proof: count,
            ..Self::default()
        }
    }

    /// One look; true if the encoder has proved that it follows.
    fn run(&mut self, expectation: &Expectation, wanted: i32, direction: i32, count: i32) -> bool {
        self.since = self.since.saturating_add(1);
        self.drive = wanted.min(approach(self.drive, wanted, expectation.inverse_lag));
        let followed = self.followed(direction, count);
        if followed >= PROOF_COUNTS {
            self.prove(followed, count);
            return true;
        }
        let steady = mul_shift(self.drive, expectation.full_speed, 20);
        self.speed = approach(self.speed, steady, expectation.inverse_tau);
        if self.speed > 0 {
            self.travel = self.travel.saturating_add(self.speed);
        } else {
            self.wait(count);
        }
        false
    }

    /// The encoder follows, with the mean speed over the counts of the proof: the observer's estimate runs ahead of a
    /// motor that starts slowly.
    fn prove(&mut self, followed: i32, count: i32) {
        let counts = (followed.clamp(0, 2000) as u32) << 20;
        self.speed = counts.checked_div(self.since).unwrap_or(0) as i32;
        self.wait(count);
    }

    /// Nothing is demanded up to now.
    fn wait(&mut self, count: i32) {
        (self.travel, self.proof, self.since) = (0, count, 0);
    }

    fn counts(&self) -> i32 {
        self.travel >> 20
    }

    /// Counts in this direction since the last proof.
    fn followed(&self, direction: i32, count: i32) -> i32 {
        count.wrapping_sub(self.proof).saturating_mul(direction)
    }
}

/// The encoder has not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Missing {
    /// Counts that there must have been; 0 while even break-away friction may explain that there are none.
    pub sure: i32,
    /// Counts that a shaft that is free makes.
    pub likely: i32,
    /// Counts that there are.
    pub followed: i32,
    /// It ran back instead, half as far as it should have come forwards.
    pub reversed: bool,
    /// +1 or −1.
    pub direction: i32,
}

/// What is known about the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Sign of the voltage.
    direction: i32,
    sure: Model,
    likely: Model,
    /// It has broken away.
    moving: bool,
    /// Voltage that the load takes, as last observed while the encoder followed.
    load: Voltage,
}

impl State {
    /// Nothing has moved yet.
    pub fn at(count: i32) -> Self {
        Self {
            sure: Model::begin(0, count),
            likely: Model::begin(0, count),
            ..Self::default()
        }
    }

    /// Has the encoder just proved that it follows, or was nothing demanded of it?
    pub fn fresh(&self) -> bool {
        self.likely.since == 0
    }

    /// Compares the motion with the least that must be. Without drive, and when the drive changes its sign, the models
    /// start anew from the speed that is observed: a motor that is being braked may well turn against the voltage.
    pub fn step(&mut self, expectation: &Expectation, input: &Input) -> Option<Missing> {
        let voltage = input.means.voltage.unwrap_or(Voltage::ZERO);
        let direction = voltage.0.signum();
        let likely = expectation.drive(voltage, &expectation.kinetic, self.load);
        if likely == 0 || direction != self.direction || input.holding {
            self.restart(expectation, direction, input);
            return None;
        }
        let margins = if self.moving {
            &expectation.moving
        } else {
            &expectation.rest
        };
        let sure = expectation.drive(voltage, margins, self.load);
        let mut proved = self.likely.run(expectation, likely, direction, input.count);
        if sure > 0 {
            proved |= self.sure.run(expectation, sure, direction, input.count);
            self.moving |= self.sure.speed > expectation.full_speed >> STARTED_SHIFT;
        } else {
            // Friction may brake it as well as hold it.
            let speed = expectation.observed(input, direction);
            self.sure = Model::begin(speed, input.count);
            self.moving = speed > expectation.full_speed >> MOVING_SHIFT;
        }
        if proved {
            self.load = input.load;
        }
        self.missing(input)
    }

    /// What there is to be weighed. Behind an input dead zone there may be no friction at all: a load turns the shaft as
    /// it likes, and only what is sure counts.
    fn missing(&mut self, input: &Input) -> Option<Missing> {
        let (sure, likely) = (self.sure.counts(), self.likely.counts());
        let overdue = sure >= EXPECTED_COUNTS;
        let suspect = likely >= SUSPECT_COUNTS && !input.swallows;
        let (model, least) = if overdue {
            (&self.sure, sure)
        } else {
            (&self.likely, likely)
        };
        let followed = model.followed(self.direction, input.count);
        if sure == 0 && likely >= VAIN_COUNTS && followed > -REVERSED_COUNTS {
            // Evidence was waited for in vain: held by friction. What was summed up is of no more use.
            self.likely.wait(input.count);
            return None;
        }
        (overdue || suspect).then_some(Missing {
            sure: if overdue { sure } else { 0 },
            likely,
            followed,
            reversed: followed.saturating_neg() >= (least / 2).max(REVERSED_COUNTS),
            direction: self.direction,
        })
    }

    /// Nothing is demanded. While nothing drives, or all is silent, the observed load is the load.
    fn restart(&mut self, expectation: &Expectation, direction: i32, input: &Input) {
        let speed = expectation.observed(input, direction);
        let model = Model::begin(speed, input.count);
        *self = Self {
            direction,
            sure: model,
            likely: model,
            moving: speed > expectation.full_speed >> MOVING_SHIFT,
            load: if input.means.voltage.is_none() || input.holding {
                input.load
            } else {
                self.load
            },
        };
    }
}

/// One look of a first-order lag; `rate` per look, Q24.
fn approach(from: i32, to: i32, rate: i32) -> i32 {
    from.saturating_add(mul_shift(to.saturating_sub(from), rate, 24))
}
