//! Commissioning: the state machine that excites the motor, lets the identifier learn, verifies, and decides on trust.
//!
//! ```text
//! settle → (pulse_test) → break away (both directions) → [learn high, low, middle → coast → (start)] × directions × repeats
//!        → [saturate → verify] × directions → decide → done
//! ```
//!
//! The voltage rises from zero until the motor moves, so the first motion is gentle and tells which voltages are safe.
//! A long segment per direction beats many short ones: each reversal costs four blocks of valid windows. What the ramps
//! leave of the budget goes to the segments. The bridge opens when the commissioning ends, for whatever reason.

mod breakaway;
mod course;
mod decide;
mod excite;
mod guard;
mod limited;
mod pulse_test;
mod ramp;
mod reading;
mod schedule;
mod start;
mod tick;

use crate::config::Scale;
use crate::identify;
pub use crate::identify::Input;
use crate::identify::coast;
use crate::identify::estimate::{Estimates, EstimatesReport, Mechanism, Reason};
use crate::identify::regression::Sums;
use crate::identify::slices::{NO_SLICES, SLICES, Slice, Spread};
use crate::identify::solve::{Progress, Solver, Structure};
use crate::identify::spline::{Lengths, Window};
use crate::identify::timescale;
use crate::sample::Bridge;
use crate::units::{Direction, Voltage, VoltageQ14, ticks_in};
use course::Course;
use guard::{Limits, Shuttle};
use limited::Conditions;
use pulse_test::{PulseTest, Pulses};
use ramp::Ramp;
use reading::Reading;
use serde::{Deserialize, Serialize};

/// Mean current that counts as none, converter counts: the noise of a sensor without current.
const NO_CURRENT: i32 = 8;
/// What a commissioning may take beyond its budget, ms.
const OVERTIME_MS: u32 = 980;
/// Share of it that shaking the shaft may take beside the budget; what it takes more comes out of the budget, ms.
const SHAKEN_MS: u32 = 500;

/// What the commissioning wants the bridge to do. The axis divides by the measured supply and clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// State of the bridge.
    pub bridge: Bridge,
    /// Terminal voltage.
    pub voltage: VoltageQ14,
}

/// Where the commissioning stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Phase {
    /// Not started.
    #[default]
    Idle,
    /// Waits for standstill.
    Settle,
    /// Raises the voltage until the motor moves, once a direction and once behind every coasting.
    BreakAway,
    /// Drives high, low, middle voltage and learns the linear part.
    Learn,
    /// Shorts the terminals while moving: friction or input dead zone.
    Coast,
    /// Drives full voltage and learns the saturation level.
    Saturate,
    /// Drives half voltage and compares with what was learned.
    Verify,
    /// Solves and decides.
    Decide,
    /// Finished with estimates.
    Done,
    /// Ended without estimates.
    Refused,
    /// Shakes the shaft until the encoder has proved itself; on top of the budget.
    PulseTest,
}

/// How a commissioning ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// What is known, with trust and reasons.
    pub estimates: Estimates,
    /// Why nothing was accepted.
    pub refused: Option<Reason>,
    /// Control ticks used.
    pub duration_ticks: u32,
    /// Counts travelled, up and down added.
    pub travel_counts: u32,
}

/// [`Outcome`] in SI units, as `truing-commission/1` prints it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommissionReport {
    /// What is known.
    pub estimates: EstimatesReport,
    /// Why nothing was accepted.
    pub refused: Option<Reason>,
    /// Length, s.
    pub duration_s: f32,
    /// Path, turns of the controlled shaft, up and down added.
    pub travel_rev: f32,
}

impl Outcome {
    /// In SI units; not for the control tick.
    pub fn report(&self, scale: &Scale) -> CommissionReport {
        CommissionReport {
            estimates: self.estimates.report(scale),
            refused: self.refused,
            duration_s: self.duration_ticks as f32 / scale.config.tick_hz as f32,
            travel_rev: self.travel_counts as f32 / scale.config.counts_per_rev as f32,
        }
    }
}

/// Fixed numbers of one commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    scale: Scale,
    identify: identify::Params,
    budget: u32,
    /// Ticks of the whole, after which it ends whatever it has seen.
    most: u32,
    /// Ticks that shaking the shaft may take beside the budget.
    shaken: u32,
    first: Direction,
    limits: Limits,
    /// `None`: its first travel is not bounded.
    pulse_test: Option<PulseTest>,
    /// Back-EMF of a travel that an encoder must have shown, Q14 · ticks.
    unseen: i64,
}

impl Params {
    /// `budget_ms`: length of the whole, `seed`: orders the directions.
    #[cold]
    #[inline(never)]
    pub fn new(scale: &Scale, budget_ms: u32, seed: u32) -> Self {
        let budget = ticks_in(budget_ms, scale.config.tick_hz).min(1 << 24);
        Params {
            scale: *scale,
            identify: identify::Params::new(scale),
            budget,
            most: budget + ticks_in(OVERTIME_MS, scale.config.tick_hz),
            shaken: ticks_in(SHAKEN_MS, scale.config.tick_hz),
            first: if seed & 1 == 0 { Direction::Positive } else { Direction::Negative },
            limits: Limits::new(scale),
            pulse_test: PulseTest::new(scale),
            unseen: Self::unseen(scale),
        }
    }

    #[inline]
    fn share(&self, of_256: u32) -> u32 {
        (self.budget >> 8) * of_256
    }
}

/// What the commissioning carries from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct State {
    phase: Phase,
    /// 0 positive, 1 negative.
    direction: Direction,
    stroke: u8,
    elapsed: u32,
    total: u32,
    remaining: u32,
    start_count: i32,
    last_count: i32,
    travel: u32,
    still: u32,
    level: i32,
    /// Count at the reference from which the end stops are measured.
    zero: i32,
    /// How it keeps within a short travel.
    shuttle: Shuttle,
    energy: u64,
    last_step: u32,
    step_count: i32,
    course: Course,
    /// Under which conditions the voltage was applied.
    voltage: Conditions,
    /// The axis moves without voltage.
    restless: bool,
    pulses: Pulses,
    ramp: Ramp,
    break_away: [i32; 2],
    /// Voltage at which the shaft broke away, without what it rose by until that showed, Q14; 0: it did not.
    started: [i32; 2],
    /// Windows until the low voltage may be raised again.
    raise_pause: u8,
    timescale: timescale::State,
    identify: identify::State,
    /// The window of the hop that ended in the last tick.
    window: Option<Window>,
    /// Rows between [`identify::gate::CORE_LIMIT`] and [`identify::gate::LINEAR_LIMIT`]; those below are the identifier's.
    outer: [Sums; 2],
    solver: Solver,
    /// How the solver has ended: the next tick makes use of it.
    solved: Option<Progress>,
    /// The core rows are being solved alone.
    comparing: bool,
    /// What all rows say; once the decision has begun, what it rests on.
    whole: Option<Reading>,
    /// What the core rows alone say.
    core: Option<Reading>,
    coast: [coast::Sums; 2],
    slices: [Slice; SLICES],
    spread: [Spread; 2],
    learn_lengths: Lengths,
    /// Length of a stroke, once reckoned.
    stroke_ticks: Option<u32>,
    after_coast: Phase,
    /// What follows a later start; `None`: it is one of the first two.
    after_start: Option<Phase>,
    mechanism: Mechanism,
    /// The saturation begins within the learned range.
    low_knee: bool,
    outcome: Outcome,
}

impl State {
    /// Ready to start at this count. Inlined, so that it is built where it is to stay and not copied there.
    #[inline(always)]
    pub fn new(params: &Params, count: i32) -> Self {
        let learn_lengths = params.identify.lengths_for(0);
        State {
            phase: Phase::Settle,
            direction: params.first,
            stroke: 0,
            elapsed: 0,
            total: 0,
            remaining: 0,
            start_count: count,
            last_count: count,
            travel: 0,
            still: 0,
            level: 0,
            zero: count,
            shuttle: Shuttle::default(),
            energy: 0,
            last_step: 0,
            step_count: count,
            course: Course::new(params, count),
            voltage: Conditions::default(),
            restless: false,
            pulses: Pulses::default(),
            ramp: Ramp::default(),
            break_away: [0; 2],
            started: [0; 2],
            raise_pause: 0,
            timescale: timescale::State::default(),
            identify: identify::State::new(&params.identify, count),
            window: None,
            outer: [Sums::default(), Sums::default()],
            solver: Solver::default(),
            solved: None,
            comparing: false,
            whole: None,
            core: None,
            coast: [coast::Sums::default(); 2],
            slices: NO_SLICES,
            spread: [Spread::default(); 2],
            learn_lengths,
            stroke_ticks: None,
            after_coast: Phase::Learn,
            after_start: None,
            mechanism: Mechanism::Unclear,
            low_knee: false,
            outcome: Outcome::default(),
        }
    }

    /// The end stops count from here, not from where it starts.
    #[inline]
    pub fn measure_from(&mut self, zero: i32) {
        self.zero = zero;
    }

    /// Does the next tick sample the splines, or make use of a window?
    #[inline]
    pub(crate) fn is_crowded(&self) -> bool {
        self.window.is_some() || self.identify.is_sampling()
    }

    /// Where it stands.
    #[inline]
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The result, once it ended.
    #[inline]
    pub fn outcome(&self) -> Option<&Outcome> {
        self.ended().then_some(&self.outcome)
    }

    /// Voltage at which the shaft started and its dead zone, by direction, where both starts were seen and the dead zones are
    /// trusted.
    pub(crate) fn starts(&self) -> Option<[(Voltage, Voltage); 2]> {
        let [forwards, backwards] = &self.outcome.estimates.dead_zone;
        let start = |side: usize, dead_zone: i32| {
            let level = self.started[side & 1];
            (level > 0).then(|| (Voltage::from_q14(VoltageQ14(level)), Voltage(dead_zone)))
        };
        Some([start(0, forwards.trusted()?)?, start(1, backwards.trusted()?)?])
    }

    /// Ended, with or without estimates.
    #[inline]
    pub fn ended(&self) -> bool {
        matches!(self.phase, Phase::Done | Phase::Refused)
    }

    /// Ends it now; the bridge opens with the next request.
    #[cold]
    #[inline(never)]
    pub fn refuse(&mut self, reason: Reason) {
        if !self.ended() {
            let reason = self.plainly(reason);
            self.phase = Phase::Refused;
            self.outcome.refused = Some(reason);
            // A decision that was under way is void.
            self.outcome.estimates = Estimates::default();
            if reason == Reason::SpeedContradicts {
                self.outcome.estimates.gain = self.course.gain();
            }
            self.outcome.duration_ticks = self.spent();
            self.outcome.travel_counts = self.travel;
        }
    }

    /// The reason in the light of what else was seen. Where a shaft that has started before draws no current below the voltage of
    /// its starts, the drive gives nothing there.
    fn plainly(&self, reason: Reason) -> Reason {
        let starts = self.phase == Phase::BreakAway && self.after_start.is_some();
        let below = self.level < self.started[0].max(self.started[1]);
        match reason {
            Reason::MotorDisconnected if starts && below => Reason::StartsHigher,
            reason => reason,
        }
    }

    /// Ticks so far, those of the shaking too.
    #[inline]
    fn spent(&self) -> u32 {
        self.total.wrapping_add(self.pulses.ticks)
    }

    /// Ends it on the user's wish.
    pub fn abort(&mut self) {
        self.refuse(Reason::Aborted);
    }

    /// Progress for people, 0 … 255.
    pub fn progress(&self, params: &Params) -> u8 {
        (self.total / (params.budget / 256).max(1)).min(255) as u8
    }

    /// The solver begins anew.
    #[inline]
    fn solve_for(&mut self, structure: Structure) {
        self.solved = None;
        self.solver.start(structure);
    }

    #[cold]
    #[inline(never)]
    fn enter(&mut self, phase: Phase, count: i32) {
        self.phase = phase;
        self.elapsed = 0;
        self.still = 0;
        self.ramp = Ramp::begin(self.travel);
        self.start_count = count;
    }

    #[inline]
    fn sign(&self) -> i32 {
        self.direction.sign()
    }

    /// Counts since the phase began, in its direction.
    #[inline]
    fn displacement(&self, count: i32) -> i32 {
        count.wrapping_sub(self.start_count).wrapping_mul(self.sign())
    }
}
