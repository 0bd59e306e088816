//! Commissioning: the state machine that excites the motor, lets the identifier learn, verifies, and decides on trust.
//!
//! ```text
//! settle → break away (both directions) → [learn high, low, middle → coast] × directions × repeats
//!        → [saturate → verify] × directions → decide → done
//! ```
//!
//! The voltage rises from zero until the motor moves, so the first motion is gentle and tells which voltages are safe.
//! A long segment per direction beats many short ones: each reversal costs four blocks of valid windows. What the ramps
//! leave of the budget goes to the segments. The bridge opens when the commissioning ends, for whatever reason.

use crate::axis::Bridge;
use crate::config::Scale;
use crate::identify;
use crate::identify::estimate::{Estimates, EstimatesReport, Mechanism, Reason};
use crate::identify::positive::Positive;
use crate::identify::slices::{SLICES, Slice, Spread};
use crate::identify::solve::{Progress, Solution, Solver, Structure};
use crate::identify::spline::{Lengths, Window};
use crate::identify::timescale;
use crate::identify::trust::{Check, Evidence, Excitation};
use crate::identify::{coast, saturation};
use serde::{Deserialize, Serialize};

/// What the axis hands over in every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Encoder counter at the start of this tick, wraps.
    pub count: i32,
    /// Mean terminal voltage that acts from now to the next sample, Q14 of nominal supply: the duty in force
    /// (after delay, clip and quantisation) times the measured supply. 0 unless the bridge is driven.
    pub voltage: i32,
    /// State of the bridge from now to the next sample.
    pub bridge: Bridge,
    /// Measured supply, Q14 of nominal supply; `None` when it is not measured.
    pub supply: Option<i32>,
    /// Winding current in converter counts; `None` when it is not sensed.
    pub current_raw: Option<i16>,
}

/// What the commissioning wants the bridge to do. The axis divides by the measured supply and clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// State of the bridge.
    pub bridge: Bridge,
    /// Terminal voltage, Q14 of nominal supply.
    pub voltage: i32,
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
    /// Raises the voltage until the motor moves, once a direction.
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

/// Highest voltage of the linear segments, Q14 of nominal: 0.62, just below the gate's limit.
const HIGH: i32 = 10_158;
/// Break-away voltage above which there is no room for a linear segment, Q14: 0.45.
const MOST_BREAK_AWAY: i32 = 7_373;
/// Voltage below which no motor with a dead zone moves, Q14: 3 %.
const LEAST_BREAK_AWAY: i32 = 492;
/// Low voltage above break-away, Q14: 6 %.
const LOW_ABOVE_BREAK_AWAY: i32 = 450;
/// Break-away voltage of a slow motor, at most, Q14: 24 %. Its ramp overshoots any level.
const SLOW_BREAK_AWAY: i32 = 3_932;
/// Ends of the high and of the low part of a segment, in 1/256. Half of the time at low voltage: the dead zone is an
/// extrapolation from there, and random torque averages out.
const PARTS: (u32, u32) = (72, 220);
/// The same for a motor so slow that it has not shown its time constant: dynamics need their share.
const PARTS_SLOW: (u32, u32) = (110, 190);
/// Its first segment: before its blocks are chosen nothing counts.
const PARTS_SLOW_FIRST: (u32, u32) = (150, 210);
/// Voltage of the verification, Q14: 0.5.
const VERIFY: i32 = 8_192;
/// Full voltage, Q14.
const FULL: i32 = Scale::VOLTAGE_ONE;
/// Supply outside of which the commissioning means nothing, Q14: 70 % and 140 % of nominal.
const LEAST_SUPPLY: i32 = 11_469;
const MOST_SUPPLY: i32 = 22_938;
/// Gain of all rows over gain of the core rows below which the range is not linear, in 1/1024: 0.915. Knees
/// between 0.46 and 0.66 of nominal give 0.55 … 0.89.
const LOW_KNEE_1024: i32 = 937;
/// Counts that are motion, not a jittering edge.
const MOTION: i32 = 4;
/// Time constants that a budget must hold, in quarters: 3.5.
const LEAST_TIME_CONSTANTS_QUARTERS: u64 = 14;

/// Fixed numbers of one commissioning.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    scale: Scale,
    identify: identify::Params,
    budget: u32,
    first: usize,
    limits: Limits,
}

/// Where the commissioning must stop.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Limits {
    /// Ticks without a count while driven hard.
    still_ticks: u32,
    /// Σ |voltage · current| in Q14 of nominal times converter counts.
    energy: u64,
    /// Time constant to brake with before it is known, ticks.
    time_constant: u32,
    /// Ticks of one speed measurement.
    step_ticks: u32,
    /// Counts in it at the speed limit.
    step_counts: u32,
}

impl Limits {
    fn new(scale: &Scale) -> Self {
        let config = &scale.config;
        let joule_ticks = scale.volts(1) * config.current_a_per_lsb / config.tick_hz as f32;
        let step_ticks = (config.tick_hz / 64).max(1);
        let counts_per_tick_per_rad_s =
            scale.rated_counts_per_tick_q16 as f32 / 65_536.0 / config.rated_speed_rad_s;
        let step = |limit: f32| (limit * counts_per_tick_per_rad_s * step_ticks as f32) as u32;
        Limits {
            // Eight counts at 2 % of rated speed, at least 0.2 s: a slow motor lingers while it turns.
            still_ticks: (400 * 65_536 / scale.rated_counts_per_tick_q16.max(1)).max(config.tick_hz / 5),
            energy: config
                .energy_limit_j
                .map_or(u64::MAX, |limit| (limit / joule_ticks) as u64),
            time_constant: (config.time_constant_hint_s.unwrap_or(0.1) * 2.0 * config.tick_hz as f32) as u32,
            step_ticks,
            step_counts: config.speed_limit_rad_s.map_or(u32::MAX, step),
        }
    }
}

impl Params {
    /// `budget_ms`: length of the whole, `seed`: orders the directions.
    pub fn new(scale: &Scale, budget_ms: u32, seed: u32) -> Self {
        let budget = (u64::from(budget_ms) * u64::from(scale.config.tick_hz) / 1000).min(1 << 24) as u32;
        Params {
            scale: *scale,
            identify: identify::Params::new(scale),
            budget,
            first: (seed & 1) as usize,
            limits: Limits::new(scale),
        }
    }

    fn share(&self, of_256: u32) -> u32 {
        (self.budget >> 8) * of_256
    }
}

/// What the commissioning carries from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct State {
    phase: Phase,
    /// 0 positive, 1 negative.
    direction: usize,
    stroke: u8,
    elapsed: u32,
    total: u32,
    remaining: u32,
    start_count: i32,
    last_count: i32,
    travel: u32,
    still: u32,
    level: i32,
    /// The axis moves without voltage.
    restless: bool,
    /// Count at the reference from which the end stops are measured.
    zero: i32,
    /// The travel was too short for a segment in one go.
    turned: bool,
    energy: u64,
    last_step: u32,
    step_count: i32,
    supply_measured: bool,
    /// Lowest displacement of a ramp, counts, and ticks since then.
    lowest: i32,
    since_lowest: u32,
    break_away: [i32; 2],
    timescale: timescale::State,
    identify: identify::State,
    solver: Solver,
    /// The core rows are being solved alone.
    comparing: bool,
    solution: Option<Solution>,
    inverse_beta: [i32; 2],
    coast: [coast::Sums; 2],
    slices: [Slice; SLICES],
    spread: [Spread; 2],
    learn_lengths: Lengths,
    after_coast: Phase,
    saturation: [saturation::State; 2],
    checks: [Check; 2],
    mechanism: Mechanism,
    outcome: Outcome,
}

impl State {
    /// Ready to start at this count.
    pub fn new(params: &Params, count: i32) -> Self {
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
            restless: false,
            zero: count,
            turned: false,
            energy: 0,
            last_step: 0,
            step_count: count,
            supply_measured: true,
            lowest: 0,
            since_lowest: 0,
            break_away: [0; 2],
            timescale: timescale::State::default(),
            identify: identify::State::new(&params.identify, count),
            solver: Solver::default(),
            comparing: false,
            solution: None,
            inverse_beta: [0; 2],
            coast: [coast::Sums::default(); 2],
            slices: [Slice::default(); SLICES],
            spread: [Spread::default(); 2],
            learn_lengths: params.identify.lengths_for(0),
            after_coast: Phase::Learn,
            saturation: [saturation::State::default(); 2],
            checks: [Check::default(); 2],
            mechanism: Mechanism::Unclear,
            outcome: Outcome::default(),
        }
    }

    /// The end stops count from here, not from where it starts.
    pub fn referenced(mut self, zero: i32) -> Self {
        self.zero = zero;
        self
    }

    /// Where it stands.
    pub fn phase(&self) -> Phase {
        self.phase
    }

    /// The result, once it ended.
    pub fn outcome(&self) -> Option<&Outcome> {
        self.ended().then_some(&self.outcome)
    }

    /// Ended, with or without estimates.
    pub fn ended(&self) -> bool {
        matches!(self.phase, Phase::Done | Phase::Refused)
    }

    /// Ends it now; the bridge opens with the next request.
    pub fn refuse(&mut self, reason: Reason) {
        if !self.ended() {
            self.phase = Phase::Refused;
            self.outcome.refused = Some(reason);
            self.outcome.duration_ticks = self.total;
            self.outcome.travel_counts = self.travel;
        }
    }

    /// Ends it on the user's wish.
    pub fn abort(&mut self) {
        self.refuse(Reason::Aborted);
    }

    /// Progress for people, 0 … 255.
    pub fn progress(&self, params: &Params) -> u8 {
        (self.total / (params.budget / 256).max(1)).min(255) as u8
    }

    fn enter(&mut self, phase: Phase, count: i32) {
        self.phase = phase;
        self.elapsed = 0;
        self.still = 0;
        self.lowest = 0;
        self.since_lowest = 0;
        self.start_count = count;
    }

    fn sign(&self) -> i32 {
        if self.direction == 0 { 1 } else { -1 }
    }

    /// Counts since the phase began, in its direction.
    fn displacement(&self, count: i32) -> i32 {
        count.wrapping_sub(self.start_count).wrapping_mul(self.sign())
    }
}

impl Params {
    /// One control tick. Call it until [`State::ended`]; the bridge request then is open.
    pub fn step(&self, state: &mut State, input: &Input) -> Request {
        if state.ended() || state.phase == Phase::Idle {
            return Request::default();
        }
        self.bookkeeping(state, input);
        self.measure_speed(state, input);
        if let Some(reason) = self.guard(state, input) {
            state.refuse(reason);
            return Request::default();
        }
        match self
            .identify
            .observe(&mut state.identify, input.count, input.voltage)
        {
            Some(window) => self.use_window(state, &window),
            None => self.solve(state),
        }
        self.advance(state, input);
        self.turn_before_the_stop(state, input);
        self.request(state)
    }

    fn bookkeeping(&self, state: &mut State, input: &Input) {
        let moved = input.count.wrapping_sub(state.last_count);
        state.last_count = input.count;
        state.travel = state.travel.saturating_add(moved.unsigned_abs());
        state.still = if moved == 0 {
            state.still.saturating_add(1)
        } else {
            0
        };
        state.elapsed = state.elapsed.saturating_add(1);
        state.total = state.total.saturating_add(1);
        state.supply_measured &= input.supply.is_some();
        let power = i64::from(input.voltage) * i64::from(input.current_raw.unwrap_or(0));
        state.energy = state.energy.saturating_add(power.unsigned_abs());
    }

    fn beyond_travel(&self, state: &State, input: &Input) -> bool {
        let [lower, upper] = self.scale.travel_counts;
        let position = input.count.wrapping_sub(state.zero);
        lower != i32::MIN && (position < lower || position > upper)
    }

    /// What must not go on.
    fn guard(&self, state: &State, input: &Input) -> Option<Reason> {
        let driven_hard =
            state.level >= VERIFY && matches!(state.phase, Phase::Learn | Phase::Saturate | Phase::Verify);
        let supply = input.supply.unwrap_or(Scale::VOLTAGE_ONE);
        match () {
            () if driven_hard
                && state.still > self.limits.still_ticks
                && state.elapsed > self.limits.still_ticks =>
            {
                Some(Reason::MotionLost)
            }
            () if !(LEAST_SUPPLY..=MOST_SUPPLY).contains(&supply) => Some(Reason::SupplyMoved),
            () if self.beyond_travel(state, input) => Some(Reason::TravelExceeded),
            () if state.energy > self.limits.energy => Some(Reason::EnergySpent),
            () if state.last_step > self.limits.step_counts => Some(Reason::Overspeed),
            () => None,
        }
    }

    /// Within a limited travel the motor shuttles: direction changes where it would otherwise run into the end.
    fn turn_before_the_stop(&self, state: &mut State, input: &Input) {
        let [lower, upper] = self.scale.travel_counts;
        let free =
            lower == i32::MIN || !matches!(state.phase, Phase::Learn | Phase::Saturate | Phase::Verify);
        if free {
            return;
        }
        let position = input.count.wrapping_sub(state.zero);
        let room = if state.direction == 0 {
            upper.saturating_sub(position)
        } else {
            position.saturating_sub(lower)
        };
        if room < self.stopping_distance(state) {
            state.direction ^= 1;
            state.turned = true;
        }
    }

    /// Counts until rest with shorted terminals, speed · time constant, plus what the speed measurement lags behind and
    /// 1/32 of the travel.
    fn stopping_distance(&self, state: &State) -> i32 {
        let [lower, upper] = self.scale.travel_counts;
        let known = state
            .timescale
            .found
            .unwrap_or(state.timescale.at_least.saturating_mul(2));
        let time_constant = if known > 0 {
            known
        } else {
            self.limits.time_constant
        };
        let steps = time_constant / self.limits.step_ticks + 2;
        let braking = state.last_step.saturating_mul(steps).min(1 << 30) as i32;
        braking.saturating_add(upper.saturating_sub(lower) / 32)
    }

    /// Counts travelled in the last 1/64 s.
    fn measure_speed(&self, state: &mut State, input: &Input) {
        if state.total.is_multiple_of(self.limits.step_ticks) {
            state.last_step = input.count.wrapping_sub(state.step_count).unsigned_abs();
            state.step_count = input.count;
        }
    }

    /// Which voltage, now.
    fn request(&self, state: &State) -> Request {
        let magnitude = match state.phase {
            Phase::Settle | Phase::Coast => 0,
            Phase::BreakAway | Phase::Learn | Phase::Saturate | Phase::Verify => state.level,
            Phase::Idle | Phase::Decide | Phase::Done | Phase::Refused => return Request::default(),
        };
        Request {
            bridge: Bridge::Driven,
            voltage: magnitude * state.sign(),
        }
    }

    /// What happens next.
    fn advance(&self, state: &mut State, input: &Input) {
        match state.phase {
            Phase::Settle => self.settle(state, input),
            Phase::BreakAway => self.break_away(state, input),
            Phase::Learn => self.learn(state, input),
            Phase::Coast => self.coast(state, input),
            Phase::Saturate => self.saturate(state, input),
            Phase::Verify => self.verify(state, input),
            Phase::Decide => self.decide(state),
            Phase::Idle | Phase::Done | Phase::Refused => {}
        }
    }

    fn settle(&self, state: &mut State, input: &Input) {
        if state.stroke == 0 {
            state.restless |= input.count.wrapping_sub(state.start_count).saturating_abs() >= 2;
        }
        let at_rest = state.still >= self.share(2) || state.elapsed >= self.share(3);
        if !at_rest {
            return;
        }
        if state.break_away[state.direction] == 0 {
            state.enter(Phase::BreakAway, input.count);
        } else {
            state.direction = self.first;
            state.stroke = 0;
            state.remaining = self.budget.saturating_sub(state.total);
            // An overshooting ramp overestimates; the lower of both directions still drives.
            state.identify.break_away = self
                .break_away_level(state, 0)
                .min(self.break_away_level(state, 1));
            state.enter(Phase::Learn, input.count);
        }
    }

    fn break_away(&self, state: &mut State, input: &Input) {
        let ramp = self.share(20).max(16);
        let displacement = state.displacement(input.count);
        state.level = (MOST_BREAK_AWAY as u32 * (state.elapsed >> 4).min(ramp >> 4) / (ramp >> 4)) as i32;
        if displacement < state.lowest {
            // It still moves backwards: a slow motor coasts, or a reversed one obeys.
            state.lowest = displacement;
            state.since_lowest = 0;
        }
        state.since_lowest = state.since_lowest.saturating_add(1);
        if state.stroke == 0 && state.level < LEAST_BREAK_AWAY && displacement.saturating_abs() >= 2 {
            state.restless = true;
        }
        let (forwards, backwards) = (displacement.wrapping_sub(state.lowest), -displacement);
        let motion = MOTION + self.drift(state);
        if forwards >= motion {
            state.break_away[state.direction] = self.plausible_break_away(state);
            self.moved(state, input);
        } else if state.stroke == 0 && backwards >= 2 * motion + self.rated_counts(state.elapsed) / 200 {
            state.refuse(Reason::Reversed);
        } else if state.since_lowest > ramp + ramp / 2 {
            state.refuse(Reason::NoMotion);
        }
    }

    /// What moves without voltage is not broken away by voltage: 1.5 % of rated speed since the ramp began.
    fn drift(&self, state: &State) -> i32 {
        if state.restless {
            self.rated_counts(state.elapsed) / 64
        } else {
            0
        }
    }

    /// Travel at rated speed, counts, saturating.
    fn rated_counts(&self, ticks: u32) -> i32 {
        let counts = (u64::from(self.scale.rated_counts_per_tick_q16) * u64::from(ticks)) >> 16;
        counts.min(1 << 30) as i32
    }

    /// A slow motor that coasted backwards had to be stopped first: its ramp overshot, the other direction tells more.
    fn plausible_break_away(&self, state: &State) -> i32 {
        let other = state.break_away[state.direction ^ 1];
        let level = if other > 0 {
            state.level.min(other + other / 2)
        } else {
            state.level
        };
        level.max(1)
    }

    fn moved(&self, state: &mut State, input: &Input) {
        state.stroke = state.stroke.saturating_add(1);
        if state.stroke < 2 {
            state.direction ^= 1;
        }
        state.enter(Phase::Settle, input.count);
    }

    fn learn(&self, state: &mut State, input: &Input) {
        let length = self.learn_ticks(state);
        let low = (self.break_away_level(state, state.direction) + LOW_ABOVE_BREAK_AWAY).min(MOST_BREAK_AWAY);
        let part = (state.elapsed << 8) / length.max(256);
        let (high_until, low_until) = match state.timescale.found {
            Some(_) => PARTS,
            None if state.stroke == 0 => PARTS_SLOW_FIRST,
            None => PARTS_SLOW,
        };
        state.level = match part {
            _ if part < high_until => HIGH,
            _ if part < low_until => low,
            _ => (low + HIGH) / 2,
        };
        if state.stroke == 0
            && !state.turned
            && state.level == HIGH
            && state
                .timescale
                .note(state.elapsed, state.displacement(input.count))
        {
            self.choose_block(state);
        }
        if state.elapsed >= length {
            self.begin_coast(state, input);
        }
    }

    /// The ramp overshoots on a motor whose time constant it does not know to be short.
    fn break_away_level(&self, state: &State, direction: usize) -> i32 {
        let level = state.break_away[direction];
        if state.timescale.found.is_some() {
            level
        } else {
            level.min(SLOW_BREAK_AWAY)
        }
    }

    /// What saturation and coasting leave, shared by the strokes.
    fn learn_ticks(&self, state: &State) -> u32 {
        let strokes = u32::from(self.strokes(state));
        let others =
            2 * (self.saturate_ticks(state) + self.verify_ticks(state)) + strokes * self.coast_ticks(state);
        state.remaining.saturating_sub(others) / strokes
    }

    /// One stroke a direction; two when the budget holds many time constants.
    fn strokes(&self, state: &State) -> u8 {
        if self.budget / 32 > state.timescale.at_least.max(self.scale.config.tick_hz / 4) {
            4
        } else {
            2
        }
    }

    fn saturate_ticks(&self, state: &State) -> u32 {
        let block = self.identify.block_ticks(&state.learn_lengths);
        ((state.remaining >> 8) * 21).max(6 * block)
    }

    fn verify_ticks(&self, state: &State) -> u32 {
        let block = self.identify.block_ticks(&state.learn_lengths);
        ((state.remaining >> 8) * 9).max(5 * block + block / 2)
    }

    fn coast_ticks(&self, state: &State) -> u32 {
        6 * self.identify.block_ticks(&self.coast_lengths(state))
    }

    /// A slower motor wants longer blocks; what was learned with the shorter ones does not fit and goes.
    fn choose_block(&self, state: &mut State) {
        let lengths = self.identify.lengths_for(state.timescale.at_least);
        if lengths.block > state.learn_lengths.block {
            state.learn_lengths = lengths;
            state.identify.relength(lengths);
            state.identify.forget();
            state.slices = [Slice::default(); SLICES];
        }
    }

    /// Blocks for coasting: four of them within 0.7 time constants.
    fn coast_lengths(&self, state: &State) -> Lengths {
        let mut lengths = state.learn_lengths;
        let time_constant = state.timescale.found.unwrap_or(state.timescale.at_least);
        while lengths.block > 2 && self.identify.block_ticks(&lengths) > time_constant / 6 {
            lengths.block -= 1;
            lengths.counts -= 1;
        }
        lengths
    }

    fn begin_coast(&self, state: &mut State, input: &Input) {
        state.identify.relength(self.coast_lengths(state));
        state.after_coast = match state.phase {
            Phase::Saturate => Phase::Verify,
            _ => Phase::Learn,
        };
        state.enter(Phase::Coast, input.count);
    }

    fn coast(&self, state: &mut State, input: &Input) {
        let stopped = state.still > self.identify.block_ticks(&state.identify.lengths);
        if state.elapsed < self.coast_ticks(state) && !stopped {
            return;
        }
        state.identify.relength(state.learn_lengths);
        if state.after_coast == Phase::Verify {
            state.solver.start(Structure::Shared);
            return state.enter(Phase::Verify, input.count);
        }
        state.direction ^= 1;
        state.stroke = state.stroke.saturating_add(1);
        if state.stroke == 1 {
            state.solver.start(Structure::Single(self.first));
        }
        if state.stroke < self.strokes(state) {
            state.enter(Phase::Learn, input.count);
        } else {
            state.solver.start(Structure::Shared);
            state.stroke = 0;
            state.enter(Phase::Saturate, input.count);
        }
    }

    fn saturate(&self, state: &mut State, input: &Input) {
        state.level = FULL;
        if state.elapsed < self.saturate_ticks(state) {
            return;
        }
        // A fast motor stopped before the coast test had its windows; from full speed it coasts longer.
        if state.mechanism == Mechanism::Unclear {
            self.begin_coast(state, input);
        } else {
            state.enter(Phase::Verify, input.count);
        }
    }

    fn verify(&self, state: &mut State, input: &Input) {
        state.level = VERIFY;
        if state.elapsed < self.verify_ticks(state) {
            return;
        }
        state.direction ^= 1;
        state.stroke = state.stroke.saturating_add(1);
        let next = if state.stroke < 2 {
            Phase::Saturate
        } else {
            Phase::Decide
        };
        state.enter(next, input.count);
    }

    fn use_window(&self, state: &mut State, window: &Window) {
        match state.phase {
            Phase::Learn => {
                let slice = self.slice(state);
                self.identify
                    .learn(&mut state.identify, window, state.slices.get_mut(slice));
            }
            Phase::Coast => self.note_coast(state, window),
            Phase::Saturate | Phase::Verify => self.compare(state, window),
            _ => {}
        }
    }

    /// All strokes together fill all slices.
    fn slice(&self, state: &State) -> usize {
        let each = SLICES as u32 / u32::from(self.strokes(state));
        let within = (state.elapsed * each / self.learn_ticks(state).max(1)).min(each - 1);
        (u32::from(state.stroke) * each + within) as usize % SLICES
    }

    fn note_coast(&self, state: &mut State, window: &Window) {
        let direction = state.direction;
        if !(state.identify.gate.still() && state.identify.gate.moving(direction)) {
            return;
        }
        // Shorter blocks by 2^k, see the coast test.
        let shift = state.learn_lengths.block - state.identify.lengths.block;
        let sign = state.sign();
        state.coast[direction].note(window, sign, shift);
    }

    /// Applied against needed voltage: above the linear range a sample of the saturation, within it the verification.
    fn compare(&self, state: &mut State, window: &Window) {
        let Some(solution) = state.solution else { return };
        let direction = state.direction;
        let applied = window.voltage * state.sign();
        let effective = solution.effective_voltage(window, direction, state.inverse_beta[direction]);
        let needed = effective.saturating_add(solution.dead_zone[direction]);
        let sigma = solution.dead_zone_sigma[direction];
        let gate = &state.identify.gate;
        if !(gate.moving(direction) || state.identify.follows_input) {
            return;
        }
        if gate.high(direction) {
            state.saturation[direction].note(applied, needed, sigma);
        } else if gate.linear(direction) && state.phase == Phase::Verify {
            state.checks[direction].note(applied.saturating_sub(needed));
        }
    }

    fn solve(&self, state: &mut State) {
        if !state.solver.busy() {
            return;
        }
        let (core, outer) = (&state.identify.core, &state.identify.outer);
        let progress = match state.comparing {
            true => state.solver.step(&[core]),
            false => state.solver.step(&[core, outer]),
        };
        match progress {
            Progress::Idle | Progress::Busy => {}
            Progress::Singular | Progress::Solved if state.comparing => self.compared(state, progress),
            // The first direction alone only serves the coast test: later data may still do.
            Progress::Singular if state.solver.structure() != Structure::Shared => {}
            Progress::Singular => state.refuse(self.unsolved(state)),
            Progress::Solved => self.solved(state),
        }
    }

    /// A motor that never showed its time constant was not given the time.
    fn unsolved(&self, state: &State) -> Reason {
        match state.timescale.found {
            _ if state.turned => Reason::TravelTooShort,
            None => Reason::TooShort,
            Some(_) => Reason::NotExcited,
        }
    }

    fn solved(&self, state: &mut State) {
        self.accept(state);
        if state.solver.structure() == Structure::Shared && state.timescale.found.is_some() {
            // Once more, with the rows below the core limit alone; a slow motor has too few of them.
            state.comparing = true;
            state.solver.start(Structure::Shared);
        }
    }

    fn accept(&self, state: &mut State) {
        let solution = *state.solver.solution();
        state.solution = Some(solution);
        state.inverse_beta = [0, 1].map(|direction| solution.inverse_beta(direction));
        state.mechanism = coast::mechanism(&state.coast, &solution);
        state.identify.follows_input = state.mechanism == Mechanism::InputDeadZone;
    }

    /// A gain that falls towards the upper end of the linear range means that the range is not linear: the saturation
    /// begins within it, and only the core rows count.
    fn compared(&self, state: &mut State, progress: Progress) {
        state.comparing = false;
        let Some(whole) = state.solution else { return };
        let core_gain = state
            .solver
            .solution()
            .gain
            .times(Positive::of(LOW_KNEE_1024, 10));
        if progress == Progress::Solved && whole.gain.below(core_gain) {
            self.accept(state);
        }
    }

    fn decide(&self, state: &mut State) {
        if state.solver.busy() {
            return;
        }
        let Some(solution) = state.solution else {
            return state.refuse(Reason::NotExcited);
        };
        if let Some(slice) = state.slices.get(usize::from(state.stroke)) {
            // One slice a tick.
            state.stroke += 1;
            if let Some(residual) = slice.residual(&solution, state.inverse_beta) {
                state.spread[slice.direction()].note(residual, slice.rows());
            }
            return;
        }
        let evidence = Evidence {
            spread: &state.spread,
            saturation: &state.saturation,
            checks: &state.checks,
            mechanism: state.mechanism,
            short_of_travel: state.turned,
            supply_measured: state.supply_measured,
            excitation: Excitation::Chosen,
        };
        let estimates = self.identify.estimates(&state.identify, &solution, &evidence);
        let time_constant = (estimates.time_constant.value >> identify::estimate::TIME_FRAC) as u64;
        if time_constant * LEAST_TIME_CONSTANTS_QUARTERS > u64::from(self.budget) * 4 {
            return state.refuse(Reason::TooShort);
        }
        state.outcome = Outcome {
            estimates,
            refused: None,
            duration_ticks: state.total,
            travel_counts: state.travel,
        };
        state.phase = Phase::Done;
    }
}
