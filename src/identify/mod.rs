//! Dead zone, saturation, gain and time constant from count and voltage alone, learned incrementally in integers.
//!
//! ```text
//! count, voltage → spline (averages) → gate (usable?) → regression (sums) → solve (LDLᵀ) → trust → estimates
//! ```
//!
//! [`Params::observe`] does the per-tick part; what a window is used for is decided by the caller: the
//! [`crate::commission`] state machine, or the passive identification in ordinary motion.
//!
//! An axis does all of this by itself. What it has found is a number with its uncertainty, and whether it may be used:
//!
//! ```
//! # mod motor { include!(concat!(env!("CARGO_MANIFEST_DIR"), "/examples/motor/mod.rs")); }
//! # use motor::{CONFIG, Motor};
//! # use servo::axis::{Axis, Command};
//! # let axis = Axis::new(&CONFIG).expect("every value within its range");
//! # let (mut state, mut motor) = (axis.start(), Motor::default());
//! # axis.command(&mut state, &Command::Arm).expect("nothing moves");
//! axis.command(&mut state, &Command::Commission { budget_ms: 5_000, seed: 1 }).expect("it is armed");
//! # for _tick in 0..60_000 {
//! #     let output = axis.step(&mut state, motor.sample());
//! #     motor.pass(output);
//! # }
//! // Six seconds later, on a motor with 1.2 V of friction:
//! let report = axis.report(&state).commissioning.expect("it has ended");
//! let dead_zone_v = report.estimates.dead_zone_pos_v;
//! assert!(dead_zone_v.trusted);
//! assert!((dead_zone_v.value.expect("a number") - 1.2).abs() < 0.02);
//! ```

pub mod coast;
pub mod estimate;
pub mod gate;
pub mod ldl;
pub mod passive;
mod plausible;
pub mod positive;
pub mod regression;
pub mod saturation;
pub mod slices;
pub mod solve;
pub mod spline;
pub mod timescale;
pub mod trust;

use crate::config::Scale;
use crate::sample::Bridge;
use crate::units::{Direction, VoltageQ14};
use regression::Sums;
use spline::{Lengths, Window};

/// Samples enter the splines at this rate or up to twice this rate, Hz.
const SAMPLE_HZ: u32 = 1000;
/// Block length that suits time constants from 20 to 150 ms, in samples at 1 kHz.
const BASE_BLOCK_S: f32 = 0.0113;
/// Longest block, s: four of them still fit into a segment of a slow motor's commissioning.
const LONGEST_BLOCK_S: f32 = 0.14;
/// Fewest counts per block at rated speed.
const LEAST_COUNTS_PER_BLOCK: u64 = 10;
/// Least speed of a row in 1/1024 of rated speed, 8 %: below, Stribeck friction would bend the line.
const SLOWEST_SPEED_1024: i64 = 82;

/// What the axis hands over in every tick to whoever learns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Encoder counter at the start of this tick, wraps.
    pub count: i32,
    /// Mean terminal voltage that acts from now to the next sample, the duty in force (after
    /// delay, clip and quantisation) times the measured supply. 0 unless the bridge is driven.
    pub voltage: VoltageQ14,
    /// What of it holds a load that depends on the place and is known ([`crate::compensate::position_load`]); 0 where there is none.
    pub load: VoltageQ14,
    /// State of the bridge from now to the next sample.
    pub bridge: Bridge,
    /// Measured supply; `None` when it is not measured.
    pub supply: Option<VoltageQ14>,
    /// Winding current in converter counts; `None` when it is not sensed.
    pub current_raw: Option<i16>,
}

impl Input {
    /// What the motor is driven with beyond the load that is known. With an open bridge no voltage tells what drives it.
    #[inline]
    pub(crate) fn net(&self) -> VoltageQ14 {
        match self.bridge {
            Bridge::Open => self.voltage,
            Bridge::Driven | Bridge::Shorted => VoltageQ14(self.voltage.0.wrapping_sub(self.load.0)),
        }
    }
}

/// Fixed numbers of one axis' identifier.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Params {
    decimation: u32,
    /// Counts per sample at rated speed, Q16; the lower word first. Words need no gap in front of them, and an axis is kept several times.
    rated_per_sample_q16: [u32; 2],
    shortest_block: u8,
    longest_block: u8,
    coarse: bool,
}

impl Params {
    fn rated_per_sample_q16(&self) -> u64 {
        let [low, high] = self.rated_per_sample_q16;
        u64::from(high) << 32 | u64::from(low)
    }

    /// Derives decimation and block lengths.
    pub fn new(scale: &Scale) -> Self {
        let mut decimation = 0;
        while scale.config.tick_hz >> (decimation + 1) >= SAMPLE_HZ {
            decimation += 1;
        }
        let rated_per_sample_q16 = u64::from(scale.rated_counts_per_tick_q16) << decimation;
        let sample_s = (1u32 << decimation) as f32 / scale.config.tick_hz as f32;
        let samples =
            |seconds: f32| (3..9).find(|&block| (1u32 << block) as f32 * sample_s >= seconds).unwrap_or(9);
        let longest_block = samples(LONGEST_BLOCK_S * 0.7);
        let base_block = samples(BASE_BLOCK_S).max(4);
        let mut shortest_block = base_block;
        while shortest_block < longest_block
            && (rated_per_sample_q16 << shortest_block) >> 16 < LEAST_COUNTS_PER_BLOCK
        {
            shortest_block += 1;
        }
        Params {
            decimation,
            rated_per_sample_q16: [rated_per_sample_q16 as u32, (rated_per_sample_q16 >> 32) as u32],
            shortest_block: shortest_block as u8,
            longest_block: longest_block as u8,
            coarse: shortest_block >= base_block + 2,
        }
    }

    /// The encoder is so coarse that blocks are four times as long as fast motors want.
    #[inline]
    pub fn coarse(&self) -> bool {
        self.coarse
    }

    /// Block lengths for a time constant of `ticks` control ticks (0: unknown): about a quarter of it.
    #[inline]
    pub fn lengths_for(&self, ticks: u32) -> Lengths {
        let quarter = (ticks >> self.decimation) / 4;
        let block = (32 - quarter.leading_zeros()).saturating_sub(1);
        self.lengths(block.clamp(self.shortest_block.into(), self.longest_block.into()))
    }

    /// Lengths with blocks of 2^`block` samples; W₀ is the next power of two above 1.25 times rated speed.
    #[inline]
    pub fn lengths(&self, block: u32) -> Lengths {
        let per_block_q16 = (self.rated_per_sample_q16() << block) * 5 / 4;
        let counts = (64 - (per_block_q16 >> 16).leading_zeros()).max(3);
        Lengths { decimation: self.decimation, block, counts }
    }

    /// The next longer blocks, if there are any.
    #[inline]
    pub fn longer(&self, lengths: &Lengths) -> Lengths {
        self.lengths((lengths.block + 1).min(self.longest_block.into()))
    }

    /// Rated speed in a window's unit, Q20 of W₀.
    #[inline]
    pub fn rated_speed(&self, lengths: &Lengths) -> i32 {
        ((self.rated_per_sample_q16() << (lengths.block + 4)) >> lengths.counts) as i32
    }

    /// Control ticks per block.
    #[inline]
    pub fn block_ticks(&self, lengths: &Lengths) -> u32 {
        1 << (lengths.decimation + lengths.block)
    }

    /// The per-tick part: sums count and voltage (acting from now on); a window one tick after its last
    /// hop. Spreading hop and comb over two ticks keeps both short.
    #[inline(always)]
    pub fn observe(&self, state: &mut State, count: i32, voltage: VoltageQ14) -> Option<Window> {
        let window = if state.hopped { state.hop() } else { None };
        self.sum(state, count, voltage);
        window
    }

    /// The sums alone. [`State::hopped`] then tells whether the next tick, before its own sums, has a hop to look at.
    #[inline(always)]
    pub fn sum(&self, state: &mut State, count: i32, voltage: VoltageQ14) {
        state.hopped = state.spline.step(&state.lengths, count, voltage.0);
    }

    /// Looks at the hop that ended: a window and its direction, if it is usable. Nothing is computed for the others.
    #[cold]
    #[inline]
    pub fn usable_window(&self, state: &mut State) -> Option<(Direction, Window)> {
        state.gate.note(state.spline.hop(), state.break_away);
        if !(Direction::BOTH.into_iter().any(|direction| state.admits(direction))) {
            return None;
        }
        let window = state.spline.window(&state.lengths)?;
        let direction = self.direction(state, &window)?;
        Some((direction, window))
    }

    /// The direction in which the motor was driven and moving, in the linear range, all through the window; its sign is
    /// that of the voltage.
    #[inline]
    pub fn direction(&self, state: &State, window: &Window) -> Option<Direction> {
        let direction = Direction::of(window.voltage);
        self.usable(state, window, direction).then_some(direction)
    }

    #[inline]
    fn usable(&self, state: &State, window: &Window, direction: Direction) -> bool {
        if !state.admits(direction) {
            return false;
        }
        let slowest = (i64::from(self.rated_speed(&state.lengths)) * SLOWEST_SPEED_1024 / 1024) as i32;
        let speed =
            if direction == Direction::Positive { window.speed } else { window.speed.saturating_neg() };
        state.follows_input || speed > slowest
    }
}

/// What the identifier carries from tick to tick.
#[derive(Clone, Copy, Debug)]
pub struct State {
    /// Lengths in use.
    pub lengths: Lengths,
    /// Which conditions the last hops satisfied.
    pub gate: gate::State,
    /// Rows of each direction.
    pub sums: [Sums; 2],
    /// Least voltage that counts as driving, Q14.
    pub break_away: i32,
    /// The dead zone is at the input: its side follows the voltage, so rows of a motor that still turns the other way
    /// count too.
    pub follows_input: bool,
    spline: spline::State,
    /// The last tick ended a hop.
    hopped: bool,
}

impl State {
    /// Starts at rest. Inlined, like all that it consists of, so that it is built where it is to stay.
    #[inline(always)]
    pub fn new(params: &Params, count: i32) -> Self {
        let lengths = params.lengths_for(0);
        State {
            lengths,
            gate: gate::State::default(),
            sums: [Sums::default(), Sums::default()],
            break_away: 0,
            follows_input: false,
            spline: spline::State::new(count, &lengths),
            hopped: false,
        }
    }

    /// Has a hop ended with the last tick?
    #[inline]
    pub fn hopped(&self) -> bool {
        self.hopped
    }

    /// Does the next tick take a sample of the splines, though not every tick does?
    #[inline]
    pub fn is_sampling(&self) -> bool {
        self.spline.is_sampling()
    }

    /// The last hop was not looked at yet.
    #[inline]
    pub fn still_hopped(&mut self, waits: bool) {
        self.hopped |= waits;
    }

    /// Do the gates let a window of this direction pass, whatever its speed?
    #[inline]
    fn admits(&self, direction: Direction) -> bool {
        let gate = &self.gate;
        gate.linear(direction) && gate.driven(direction) && (self.follows_input || gate.moving(direction))
    }

    /// What follows a hop: its conditions, and the window that ends with it.
    #[cold]
    #[inline]
    pub fn hop(&mut self) -> Option<Window> {
        self.gate.note(self.spline.hop(), self.break_away);
        self.spline.window(&self.lengths)
    }

    /// Other block lengths from now on; sums stay, windows refill.
    #[inline]
    pub fn relength(&mut self, lengths: Lengths) {
        self.lengths = lengths;
        self.spline.restart(&lengths);
        self.gate.restart();
        self.hopped = false;
    }

    /// Nobody sums for a while: windows refill afterwards, what was learned stays.
    #[inline]
    pub fn pause(&mut self) {
        self.spline.restart(&self.lengths);
        self.hopped = false;
    }

    /// Behind a pause: the next sample is complete in so many ticks.
    pub(crate) fn align(&mut self, ticks: u32) {
        self.spline.align(ticks);
    }

    /// Forgets all rows.
    #[inline]
    pub fn forget(&mut self) {
        self.sums = [Sums::default(); 2];
    }
}
