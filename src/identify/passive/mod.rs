//! Identification in ordinary motion: nothing is excited, nobody notices.
//!
//! Two tasks, one at a time:
//!
//! * **Learn**, when nothing was commissioned: the full regression from whatever the loops do. Motion at
//!   15 % of full speed and more identifies as well as a commissioning, the saturation apart.
//! * **Track**, afterwards: gain and time constant are frozen, and only the dead zone follows. A regression
//!   with forgetting would blow up at constant speed, where gain and dead zone cannot be told apart; a scalar cannot.
//!
//! A direction that is not driven keeps its value and ages; at standstill nothing moves at all.

mod learn;
mod track;

use super::estimate::{Estimates, Mechanism, VOLTAGE_FRAC};
use super::solve::{Solution, Solver};
use super::spline::{HOPS_PER_BLOCK, ROW_FRAC, Window};
use crate::config::Scale;
use crate::identify::Input;
use crate::units::Direction;
use learn::Learning;
use track::Track;

/// Without a usable window for this long a dead zone is not trusted any more, s.
const LIFE_S: f32 = 1_800.0;

/// Fixed numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    identify: super::Params,
    /// Time constant to begin with, control ticks; 0: unknown.
    hint: u32,
    /// [`LIFE_S`] in control ticks.
    life: u32,
}

/// Which of the two tasks.
#[derive(Clone, Copy, Debug)]
enum Task {
    Learn(Learning),
    /// Gain and time constant are frozen.
    Track([Track; 2]),
}

/// Everything that changes, but for what is known.
#[derive(Clone, Copy, Debug)]
pub struct State {
    identify: super::State,
    /// Learning: with the last solution; tracking: with gain and time constant.
    solver: Solver,
    /// There is a solution.
    solved: bool,
    work: Work,
    /// Ticks at rest that no hop has counted.
    rested: u32,
    task: Task,
}

/// What goes on over several ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Work {
    #[default]
    None,
    /// The blocks' lengths: a tick later than the memory is set up, because both take long.
    Begin,
    /// Taking over what is known: gain and time constant, and a tick later the dead zones.
    TakeOver,
    Track,
    /// The solver.
    Solve,
    /// From a solution to estimates, step by step.
    Decide(u8),
}

impl State {
    /// Its memory, built where it is to stay. One of the next ticks takes over what is known.
    #[inline(always)]
    pub fn new(params: &Params, count: i32) -> Self {
        State {
            identify: super::State::new(&params.identify, count),
            solver: Solver::default(),
            solved: false,
            work: Work::Begin,
            rested: 0,
            task: Task::Learn(Learning::default()),
        }
    }

    /// Is there nothing left to be done with what was heard?
    #[inline]
    pub fn is_done(&self) -> bool {
        self.work == Work::None
    }

    /// The bridge is open and the shaft stands: nothing is to be heard until it is driven.
    #[inline]
    pub fn pause(&mut self) {
        self.identify.pause();
    }

    /// Does the next tick sample the splines, or look at a hop?
    #[inline]
    pub(crate) fn is_crowded(&self) -> bool {
        self.identify.hopped() || self.identify.is_sampling()
    }

    /// Has a hop ended that was not looked at yet?
    #[inline]
    pub(crate) fn hopped(&self) -> bool {
        self.identify.hopped()
    }

    /// It is driven again: the next sample of the splines is complete in so many ticks. Windows refill anyway.
    pub(crate) fn align(&mut self, ticks: u32) {
        self.identify.align(ticks);
    }

    /// Gain and time constant are frozen, the dead zone follows.
    #[inline]
    pub fn tracks(&self) -> bool {
        matches!(self.task, Task::Track(_))
    }

    /// The dead zone, `[positive, negative]`, moved by more than a quarter since it was commissioned.
    #[inline]
    pub fn worn(&self) -> [bool; 2] {
        match &self.task {
            Task::Track([positive, negative]) => [positive.worn, negative.worn],
            Task::Learn(_) => [false; 2],
        }
    }
}

impl Params {
    /// For an axis.
    pub fn new(scale: &Scale) -> Self {
        let config = &scale.config;
        Params {
            identify: super::Params::new(scale),
            hint: (config.time_constant_hint_s.get().unwrap_or(0.0) * config.tick_hz as f32) as u32,
            life: (LIFE_S * config.tick_hz as f32) as u32,
        }
    }

    /// Listens from now on: tracks what is trusted, or has merely aged; learns if there is nothing to track.
    #[inline]
    pub fn listen(&self, count: i32, known: &Estimates) -> State {
        let mut state = State::new(self, count);
        self.begin(&mut state);
        state.work = Work::None;
        self.adopt(&mut state, known);
        state
    }

    /// With blocks for the time constant that was hinted at.
    #[cold]
    #[inline(never)]
    fn begin(&self, state: &mut State) {
        state.work = Work::TakeOver;
        state.identify.relength(self.identify.lengths_for(self.hint));
    }

    /// Takes over what is known, if it is trusted.
    #[cold]
    #[inline(never)]
    fn take_over(&self, state: &mut State, known: &Estimates) {
        state.work = if self.freeze(state, known) { Work::Track } else { Work::None };
    }

    /// One control tick: bounded integer work. `true`: `known` has changed.
    #[inline]
    pub fn step(&self, state: &mut State, known: &mut Estimates, input: &Input) -> bool {
        self.step_beside(state, known, input, false)
    }

    /// One control tick. `busy`: something else takes long in it, so there are the sums alone, and what a hop has brought
    /// waits for the next tick. Of four ticks in a row one must not be busy.
    #[inline]
    pub fn step_beside(&self, state: &mut State, known: &mut Estimates, input: &Input, busy: bool) -> bool {
        // What goes with the current does not lie between the windows of two directions of motion.
        let busy = busy || known.mechanism == Mechanism::VoltageDrop;
        let hopped = state.identify.hopped();
        let news = hopped && !busy && self.hop(state, known, input.supply.is_some());
        self.identify.sum(&mut state.identify, input.count, input.net());
        if busy {
            state.identify.still_hopped(hopped);
            return false;
        }
        if hopped || state.work == Work::None {
            return news;
        }
        self.go_on(state, known)
    }

    /// So many ticks at rest have passed: what is known has become older. `true`: `known` has changed.
    #[inline]
    pub fn rest(&self, state: &mut State, known: &mut Estimates, ticks: u32) -> bool {
        state.rested = state.rested.saturating_add(ticks);
        let hop = 1u32.wrapping_shl(self.hop_bits(state));
        if state.rested < hop || !state.tracks() {
            return false;
        }
        state.rested = state.rested.wrapping_sub(hop);
        self.track(state, known, None)
    }

    /// A hop has ended. `true`: `known` has changed.
    #[cold]
    #[inline]
    fn hop(&self, state: &mut State, known: &mut Estimates, supply_measured: bool) -> bool {
        let usable = self.identify.usable_window(&mut state.identify);
        if state.tracks() {
            return self.track(state, known, usable);
        }
        if let Some((direction, window)) = usable {
            self.learn(state, &window, direction, supply_measured);
        }
        false
    }

    /// The next step of what goes on. `true`: `known` has changed.
    #[cold]
    #[inline]
    fn go_on(&self, state: &mut State, known: &mut Estimates) -> bool {
        match state.work {
            Work::None => false,
            Work::Begin => {
                self.begin(state);
                false
            }
            Work::TakeOver => {
                self.take_over(state, known);
                false
            }
            Work::Track => {
                self.begin_to_track(state, known);
                false
            }
            Work::Solve => {
                self.solve(state);
                false
            }
            Work::Decide(step) => self.decide(state, known, step),
        }
    }

    /// The dead zone that a window of motion in this direction shows, Q20.
    #[inline]
    fn sample(&self, solution: &Solution, window: &Window, direction: Direction) -> i32 {
        let applied =
            if direction == Direction::Positive { window.voltage } else { window.voltage.saturating_neg() };
        applied.saturating_sub(solution.effective_voltage(window, direction))
    }

    /// log₂ of control ticks per hop.
    #[inline]
    fn hop_bits(&self, state: &State) -> u32 {
        let lengths = &state.identify.lengths;
        (lengths.decimation + lengths.block).saturating_sub(HOPS_PER_BLOCK.ilog2())
    }
}

/// |a − b| above a share of b.
#[inline]
fn moved(a: i32, b: i32, of_1024: i32) -> bool {
    i64::from(a.abs_diff(b)) * 1024 > i64::from(b) * i64::from(of_1024)
}

/// Takes `new` over; `true` if it differs.
#[inline]
fn publish(known: &mut Estimates, new: &Estimates) -> bool {
    let differs = known != new;
    *known = *new;
    differs
}

#[inline]
fn follows_input(known: &Estimates) -> bool {
    known.mechanism == Mechanism::InputDeadZone
}

const _: () = assert!(VOLTAGE_FRAC == ROW_FRAC, "tracked voltages and windows share their unit");
