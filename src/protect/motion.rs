//! Does the encoder follow? Motion is judged against what the identified motor must do *at least*.
//!
//! Two models without load run beside the motor, driven by what the acting voltage leaves behind a margin:
//!
//! ```text
//! ṁ = (ω₀·u − m)/τ      u: voltage beyond margin and load, rising behind the winding's lag, falling at once
//! ```
//!
//! - The *sure* one demands nothing of a shaft that stands until more has acted than holds it: what its starts have taught
//!   ([`super::break_away`]), or [`super::REST_MARGIN`] dead zones. Then the shaft has broken away, and what has held it is
//!   taken off, at most [`super::MOVING_MARGIN`]; that margin alone of a shaft that turns (friction at rest is higher). Once it has
//!   travelled [`SILENT_START_COUNTS`] of which the counter shows none, or [`super::EXPECTED_COUNTS`] of a shaft that had
//!   turned, without a proof that the encoder follows, something is wrong.
//! - The *likely* one takes off [`super::KINETIC_MARGIN`] at any time. A healthy shaft may stand where it travels, held by
//!   break-away friction; it cannot run backwards, and its current cannot show a back-EMF. So its travel counts where
//!   there is evidence of that kind.
//!
//! Friction, its ripple and load changes within the margin are no faults. The load that was observed while the encoder
//! still followed is taken off: a joint that carries a weight stands still with voltage applied. The observer's present
//! load would not do, it soon explains away any motion that is missing.
//!
//! A large winding's current flows on the old way for a while after the voltage has turned, and drives the shaft on. Nothing is
//! demanded as long as it does, and the models then begin with the speed that the counter shows.
//!
//! Two counts prove that the encoder follows; the models then start anew with the speed that they show.

use super::expectation::Expectation;
use super::{Input, break_away};
use crate::units::Voltage;

/// Counts of the sure model that are waited for while the counter runs back: until that shows by half of them.
const BACKWARDS_COUNTS: i32 = 2 * REVERSED_COUNTS;
/// Counts that the likely model must have travelled before evidence is weighed: with a current, and with the counter alone.
const SUSPECT_COUNTS: i32 = 3;
const LONE_SUSPECT_COUNTS: i32 = 8;
/// Counts of the likely model after which evidence is looked for anew.
const VAIN_COUNTS: i32 = 64;
/// Counts of the sure model that are enough while the shaft gets under way and the counter has shown none: it started below the
/// voltage at which the model does, and is ahead of it.
const SILENT_START_COUNTS: i32 = 2;
/// The same after the counter has shown one, which a stalled shaft or a silent encoder does not: friction falls slowly with speed.
const START_COUNTS: i32 = 8;
/// Counts from which on a case is given up that the current does not decide; and of a shaft that gets under way, which has to be
/// found in time. With two, half as many stalls would be told from an unplugged encoder.
const GIVE_UP_COUNTS: i32 = 10;
const GIVE_UP_START_COUNTS: i32 = 5;
/// Counts in the demanded direction that prove that the encoder follows.
const PROOF_COUNTS: i32 = 2;
/// Counts against the demanded direction that a reversed motor or encoder makes at least.
const REVERSED_COUNTS: i32 = 4;

/// Torque, as the voltage that gives it.
#[derive(Clone, Copy, Debug)]
struct Torque {
    /// What accelerates the motor at least.
    least: i32,
    /// All of it.
    whole: i32,
}

/// One of the models, in the direction of the voltage.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Model {
    /// Speed that the motor must have, counts per look, Q20; below zero: it still turns against the voltage.
    speed: i32,
    /// Speed that the whole inertia can have, if all of the voltage accelerates it: counts per look, Q20.
    most: i32,
    /// Travel since the last proof, counts Q20.
    travel: i32,
    /// Counter at the last proof, or when there was nothing to prove.
    proof: i32,
    /// Looks since.
    since: u32,
}

impl Model {
    #[inline]
    fn begin(speed: i32, count: i32) -> Self {
        Self { speed, most: speed, proof: count, ..Self::default() }
    }

    /// One look; true if the encoder has proved that it follows.
    #[inline]
    fn run(&mut self, expectation: &Expectation, torque: Torque, direction: i32, count: i32) -> bool {
        self.since = self.since.saturating_add(1);
        self.most = expectation.towards(self.most, torque.whole);
        let followed = self.followed(direction, count);
        if followed >= PROOF_COUNTS {
            self.prove(followed, count);
            return true;
        }
        self.speed = expectation.towards(self.speed, torque.least);
        if self.speed > 0 {
            self.travel = self.travel.saturating_add(self.speed);
        } else {
            self.wait(count);
        }
        false
    }

    /// The encoder follows, with the mean speed over the counts of the proof: the observer's estimate runs ahead of a
    /// motor that starts slowly. A rotor that runs free within the play of its gear is faster than the whole can be, and
    /// loses that speed when the teeth meet: then they have the momentum that the voltage has given, shared out.
    #[inline]
    fn prove(&mut self, followed: i32, count: i32) {
        let counts = (followed.clamp(0, 2000) as u32) << 20;
        let shown = counts.checked_div(self.since).unwrap_or(0) as i32;
        self.speed = shown.min(self.most.max(0));
        self.most = self.speed;
        self.wait(count);
    }

    /// Nothing is demanded up to now.
    #[inline]
    fn wait(&mut self, count: i32) {
        (self.travel, self.proof, self.since) = (0, count, 0);
    }

    #[inline]
    fn counts(&self) -> i32 {
        self.travel >> 20
    }

    /// Counts in this direction since the last proof.
    #[inline]
    fn followed(&self, direction: i32, count: i32) -> i32 {
        count.wrapping_sub(self.proof).saturating_mul(direction)
    }
}

/// The encoder has not followed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Missing {
    /// Counts that there must have been; 0 while even break-away friction may explain that there are none.
    pub sure: i32,
    /// Counts from which on it is a fault, whatever the current says or does not say.
    pub enough: i32,
    /// Counts that a shaft that is free makes.
    pub likely: i32,
    /// Counts that there are.
    pub followed: i32,
    /// The shaft stood for a while before this voltage.
    pub stood: bool,
    /// It ran back instead, half as far as it should have come forwards.
    pub reversed: bool,
    /// +1 or −1.
    pub direction: i32,
}

/// What a look has shown of the encoder.
#[derive(Clone, Copy, Debug)]
pub(super) struct Fresh {
    /// It has just proved to the likely model that it follows, or nothing was demanded of it.
    pub likely: bool,
    /// The same of the sure model.
    pub sure: bool,
    /// The shaft stood for a while before this voltage, and no proof has come since.
    pub stood: bool,
}

/// What is known about the motion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct State {
    /// Sign of the voltage.
    direction: i32,
    /// Voltage that has become current, with its sign: behind the winding's lag.
    flow: i32,
    /// Looks until the lag that a model tells is over.
    quiet: u16,
    sure: Model,
    likely: Model,
    /// It turns.
    moving: bool,
    /// It has broken away, and no proof has come since.
    starting: bool,
    starts: break_away::State,
    /// Voltage that the load takes, as last observed while the encoder followed.
    load: Voltage,
}

impl State {
    /// Begins anew here; what was learned about the starts stays.
    pub fn begin(&mut self, count: i32) {
        // Without `..`, so that no new field is forgotten; and without a copy of what stays.
        let Self { direction, flow, quiet, sure, likely, moving, starting, starts, load } = self;
        (*direction, *flow, *quiet, *moving, *starting, *load) = (0, 0, 0, false, false, Voltage::ZERO);
        *sure = Model::begin(0, count);
        *likely = *sure;
        starts.begin(count);
    }

    /// A look at a shaft that stands with the bridge open.
    #[inline]
    pub fn stand(&mut self) {
        self.starts.stand();
    }

    /// A commissioning has seen it start.
    pub fn broke_away(&mut self, starts: [(Voltage, Voltage); 2]) {
        self.starts.commissioned(starts);
    }

    /// What the last look has shown of the encoder.
    #[inline]
    pub fn fresh(&self, input: &Input) -> Fresh {
        Fresh {
            likely: self.likely.since == 0,
            sure: self.sure.since == 0,
            stood: self.starts.stood() && !input.commissioning,
        }
    }

    /// Compares the motion with the least that must be. Without drive, and when the drive changes its sign, the models
    /// start anew from the speed that is observed: a motor that is being braked may well turn against the voltage. So
    /// they do while the current still flows the old way.
    #[inline]
    pub fn step(&mut self, expectation: &Expectation, input: &Input) -> Option<Missing> {
        let voltage = input.averages.voltage.map_or(Voltage::ZERO, |acts| acts.minus(input.position_load));
        let direction = voltage.0.signum();
        self.flow = expectation.flows(self.flow, voltage);
        let left = |torque, margins| expectation.drive(torque, direction, margins, self.load);
        let soon = voltage.0.saturating_abs();
        // Torque falls with the voltage at once.
        let now = self.flow.saturating_mul(direction).min(soon);
        let turned = direction != self.direction || now <= 0;
        let idle = left(soon, &expectation.kinetic) == 0 || turned || input.holding;
        if idle || self.quiet > 0 {
            self.quiet = if idle { expectation.quiet } else { self.quiet.saturating_sub(1) };
            self.restart(expectation, direction, input);
            return None;
        }
        self.starts.rise(now);
        let likely = left(now, &expectation.kinetic);
        let torque = |least: i32| Torque { least, whole: soon };
        let vain = [self.likely.counts(), if self.starting { self.sure.counts() } else { 0 }];
        let mut proved = self.likely.run(expectation, torque(likely), direction, input.count);
        // An end stop may be met with so much: whatever was learned, nothing is demanded below.
        if left(soon, &expectation.moving) > 0 {
            let sure = self.demanded(expectation, input, now);
            if self.sure.run(expectation, torque(sure), direction, input.count) {
                proved = true;
                self.moving |= core::mem::take(&mut self.starting);
            }
        } else {
            // Friction may brake it as well as hold it.
            self.sure = self.observe(expectation, direction, input);
            self.starts.follow(expectation, self.side());
        }
        if proved {
            self.starts.learn(expectation, self.side(), vain);
            self.load = input.load;
        }
        self.missing(expectation, input)
    }

    /// Torque that the sure model demands: none of a shaft that friction may hold.
    #[inline]
    fn demanded(&mut self, expectation: &Expectation, input: &Input, now: i32) -> i32 {
        let side = self.side();
        let left = |margin| expectation.beyond(now, margin, self.load);
        if !self.moving {
            self.moving = expectation.turns(expectation.observed(input, self.direction));
            self.starting =
                !self.moving && (self.starting || left(self.starts.enough(expectation, side)) > 0);
        }
        match (self.moving, self.starting) {
            (true, _) => left(expectation.moving[side]),
            (false, true) => left(self.starts.held(expectation, side)),
            (false, false) => 0,
        }
    }

    /// Index of the direction.
    fn side(&self) -> usize {
        usize::from(self.direction < 0)
    }

    /// A model that begins with the observed speed. The observer knows no break-away and may take a shaft that stands,
    /// or one that still runs back, for one that goes forwards slowly: from such a speed nothing is demanded.
    #[inline]
    fn observe(&mut self, expectation: &Expectation, direction: i32, input: &Input) -> Model {
        let speed = expectation.observed(input, direction);
        self.moving = expectation.turns(speed);
        self.starting = false;
        Model::begin(if self.moving { speed } else { speed.min(0) }, input.count)
    }

    /// What there is to be weighed. Behind an input dead zone there may be no friction at all: a load turns the shaft as
    /// it likes, and only what is sure counts.
    #[inline]
    fn missing(&mut self, expectation: &Expectation, input: &Input) -> Option<Missing> {
        let (sure, likely) = (self.sure.counts(), self.likely.counts());
        let starts = self.starting && self.starts.stood() && expectation.sticks;
        let least = match self.sure.followed(self.direction, input.count) {
            ..0 => BACKWARDS_COUNTS,
            0 if starts => SILENT_START_COUNTS,
            _ if starts => START_COUNTS,
            _ => expectation.counts,
        };
        let overdue = sure >= least;
        let soon = if input.current.is_some() { SUSPECT_COUNTS } else { LONE_SUSPECT_COUNTS };
        let suspect = likely >= soon && !input.input_dead_zone;
        let (model, least) = if overdue { (&self.sure, sure) } else { (&self.likely, likely) };
        let followed = model.followed(self.direction, input.count);
        if sure == 0 && likely >= VAIN_COUNTS && followed > -REVERSED_COUNTS {
            // Evidence was waited for in vain: held by friction. What was summed up is of no more use.
            self.likely.wait(input.count);
            return None;
        }
        (overdue || suspect).then_some(Missing {
            sure: if overdue { sure } else { 0 },
            enough: if starts { GIVE_UP_START_COUNTS } else { GIVE_UP_COUNTS },
            likely,
            followed,
            stood: self.starts.stood(),
            reversed: followed.saturating_neg() >= (least / 2).max(REVERSED_COUNTS),
            direction: self.direction,
        })
    }

    /// Nothing is demanded. While nothing drives, or all is silent, the observed load is the load.
    #[inline]
    fn restart(&mut self, expectation: &Expectation, direction: i32, input: &Input) {
        let model = self.observe(expectation, direction, input);
        (self.direction, self.sure, self.likely) = (direction, model, model);
        self.starts.wait(expectation, self.side(), input.count);
        if input.averages.voltage.is_none() || input.holding {
            self.load = input.load;
        }
    }
}
