//! Identification in ordinary motion: nothing is excited, nobody notices.
//!
//! Two tasks, one at a time:
//!
//! * **Learn**, when nothing was commissioned: the full regression from whatever the loops do. Motion at 15 % of full
//!   speed and more identifies as well as a commissioning, the saturation apart.
//! * **Track**, afterwards: gain and time constant are frozen, and only the dead zone follows,
//!   d̂ ← d̂ + μ·(ū − (a + αw)/β − d̂). A regression with forgetting would blow up at constant speed, where gain and
//!   dead zone cannot be told apart; a scalar cannot.
//!
//! A direction that is not driven keeps its value and ages; at standstill nothing moves at all.

use super::estimate::{Estimates, GAIN_FRAC, Mechanism, Reason, Standing, TIME_FRAC, VOLTAGE_FRAC};
use super::positive::Positive;
use super::saturation;
use super::slices::Spread;
use super::solve::{COEFFICIENT_FRAC, Coefficients, Progress, Solution, Solver, Structure};
use super::spline::{ROW_FRAC, Window};
use super::trust::{Check, Evidence};
use crate::commission::Input;
use crate::config::Scale;

/// Rows between two solutions.
const ROWS_PER_SOLUTION: u32 = 64;
/// Windows of verification that count; then the older half is forgotten.
const MOST_CHECKS: u32 = 512;
/// Weight of one window in the tracker: 1/64, a memory of 64 hops (0.2 s with blocks of 13 ms).
const TRACK_SHIFT: u32 = 6;
/// Without a usable window for this long a dead zone is not trusted any more, s.
const LIFE_S: f32 = 1_800.0;
/// Move of one direction that makes an older value of the other doubtful, in 1/1024: 8 %.
const MOVED_1024: i32 = 82;
/// Move since commissioning that is reported as wear, in 1/1024: 25 %.
const WORN_1024: i32 = 256;

/// Fixed numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Params {
    identify: super::Params,
    tick_hz: f32,
}

/// What the tracker knows of one direction.
#[derive(Clone, Copy, Debug, Default)]
struct Track {
    /// Dead zone now, Q20, with [`TRACK_SHIFT`] more fraction bits so that small steps are not lost.
    fine: i32,
    /// Dead zone as commissioned, Q20.
    base: i32,
    /// The other direction's dead zone when this one was last updated, Q20.
    other: i32,
    /// Hops since the last update.
    age: u32,
}

/// Everything that changes.
#[derive(Clone, Copy, Debug)]
pub struct State {
    identify: super::State,
    solver: Solver,
    solution: Option<Solution>,
    inverse_beta: [i32; 2],
    /// `Some`: gain and time constant are frozen.
    tracks: Option<[Track; 2]>,
    checks: [Check; 2],
    new_rows: u32,
    estimates: Estimates,
    generation: u16,
}

impl State {
    /// Knows nothing, learns.
    pub fn new(params: &Params, count: i32) -> Self {
        State {
            identify: super::State::new(&params.identify, count),
            solver: Solver::default(),
            solution: None,
            inverse_beta: [0; 2],
            tracks: None,
            checks: [Check::default(); 2],
            new_rows: 0,
            estimates: Estimates::default(),
            generation: 0,
        }
    }

    /// What is known.
    pub fn estimates(&self) -> &Estimates {
        &self.estimates
    }

    /// Counts the changes of [`State::estimates`], wraps.
    pub fn generation(&self) -> u16 {
        self.generation
    }

    /// The dead zone, `[positive, negative]`, moved by more than a quarter since it was commissioned.
    pub fn worn(&self) -> [bool; 2] {
        let worn = |track: Track| moved(track.value(), track.base, WORN_1024);
        self.tracks.map_or([false; 2], |tracks| tracks.map(worn))
    }

    fn publish(&mut self, estimates: Estimates) {
        if self.estimates != estimates {
            self.estimates = estimates;
            self.generation = self.generation.wrapping_add(1);
        }
    }
}

impl Track {
    fn value(&self) -> i32 {
        self.fine >> TRACK_SHIFT
    }
}

/// |a − b| above a share of b.
fn moved(a: i32, b: i32, of_1024: i32) -> bool {
    i64::from(a.abs_diff(b)) * 1024 > i64::from(b) * i64::from(of_1024)
}

impl Params {
    /// For an axis.
    pub fn new(scale: &Scale) -> Self {
        Params {
            identify: super::Params::new(scale),
            tick_hz: scale.config.tick_hz as f32,
        }
    }

    /// Freezes gain and time constant and tracks the dead zone from here. Not for the control tick. `false`: the
    /// estimates are not trusted; nothing changes.
    pub fn adopt(&self, state: &mut State, estimates: &Estimates) -> bool {
        let dead_zone = estimates.dead_zone.map(|estimate| estimate.trusted());
        let ([Some(positive), Some(negative)], Some(gain), Some(time_constant)) = (
            dead_zone,
            estimates.gain.trusted(),
            estimates.time_constant.trusted(),
        ) else {
            return false;
        };
        let lengths = self.identify.lengths_for((time_constant >> TIME_FRAC) as u32);
        state.identify.relength(lengths);
        state.identify.follows_input = estimates.mechanism == Mechanism::InputDeadZone;
        let block = Positive::new(u64::from(self.identify.block_ticks(&lengths)), 0);
        let alpha = block.over(Positive::of(time_constant, TIME_FRAC));
        let rated = Positive::of(self.identify.rated_speed(&lengths), ROW_FRAC);
        let beta = Positive::of(gain, GAIN_FRAC)
            .times(rated)
            .times(alpha)
            .to_q(COEFFICIENT_FRAC);
        let skew = ((i64::from(beta) * i64::from(estimates.gain_skew)) >> GAIN_FRAC) as i32;
        let coefficients = [beta.saturating_add(skew), beta.saturating_sub(skew)].map(|beta| Coefficients {
            gamma: 0,
            beta,
            alpha: alpha.to_q(COEFFICIENT_FRAC),
            delta: 0,
        });
        let solution = Solution {
            coefficients,
            ..Solution::default()
        };
        state.inverse_beta = [0, 1].map(|direction| solution.inverse_beta(direction));
        state.solution = Some(solution);
        let track = |own: i32, other: i32| Track {
            fine: own << TRACK_SHIFT,
            base: own,
            other,
            age: 0,
        };
        state.tracks = Some([track(positive, negative), track(negative, positive)]);
        state.publish(*estimates);
        true
    }

    /// One control tick: bounded integer work.
    #[inline]
    pub fn step(&self, state: &mut State, input: &Input) {
        match self
            .identify
            .observe(&mut state.identify, input.count, input.voltage)
        {
            Some(window) if state.tracks.is_some() => self.track(state, &window),
            Some(window) => self.learn(state, &window),
            None if state.solver.busy() => self.solve(state),
            None => {}
        }
    }

    fn learn(&self, state: &mut State, window: &Window) {
        if state.solver.busy() {
            return;
        }
        self.check(state, window);
        if self.identify.learn(&mut state.identify, window, None) {
            state.new_rows += 1;
        }
        if state.new_rows >= ROWS_PER_SOLUTION {
            state.new_rows = 0;
            state.solver.start(Structure::Shared);
        }
    }

    /// A window not yet learned is a test of what was learned.
    fn check(&self, state: &mut State, window: &Window) {
        let Some(solution) = state.solution else { return };
        for direction in [0, 1] {
            if let Some(sample) = self.sample(state, &solution, window, direction) {
                state.checks[direction].note(sample.saturating_sub(solution.dead_zone[direction]));
                state.checks[direction].keep(MOST_CHECKS);
            }
        }
    }

    /// The dead zone that a usable window shows, Q20.
    fn sample(&self, state: &State, solution: &Solution, window: &Window, direction: usize) -> Option<i32> {
        if !self.identify.usable(&state.identify, window, direction) {
            return None;
        }
        let applied = if direction == 0 {
            window.voltage
        } else {
            window.voltage.saturating_neg()
        };
        let needed = solution.effective_voltage(window, direction, state.inverse_beta[direction]);
        Some(applied.saturating_sub(needed))
    }

    fn solve(&self, state: &mut State) {
        let progress = state.solver.step(&[&state.identify.core, &state.identify.outer]);
        if progress != Progress::Solved {
            return;
        }
        let solution = *state.solver.solution();
        state.solution = Some(solution);
        state.inverse_beta = [0, 1].map(|direction| solution.inverse_beta(direction));
        let evidence = Evidence {
            spread: &[Spread::default(); 2],
            saturation: &[saturation::State::default(); 2],
            checks: &state.checks,
            mechanism: Mechanism::Unclear,
            short_of_travel: false,
            supply_measured: true,
        };
        let estimates = self.identify.estimates(&state.identify, &solution, &evidence);
        state.publish(estimates);
    }

    fn track(&self, state: &mut State, window: &Window) {
        let (Some(solution), Some(mut tracks)) = (state.solution, state.tracks) else {
            return;
        };
        for direction in [0, 1] {
            let other = tracks[direction ^ 1].value();
            let track = &mut tracks[direction];
            track.age = track.age.saturating_add(1);
            if let Some(sample) = self.sample(state, &solution, window, direction) {
                // One window may move it by half of what it was commissioned to, no more.
                let value = track.value();
                let error = sample
                    .saturating_sub(value)
                    .max(-track.base / 2)
                    .min(track.base / 2);
                track.fine = track.fine.saturating_add(error);
                track.other = other;
                track.age = 0;
            }
        }
        state.tracks = Some(tracks);
        self.publish_tracks(state, &tracks);
    }

    /// Publishes moves beyond 1 % and changes of trust.
    fn publish_tracks(&self, state: &mut State, tracks: &[Track; 2]) {
        let mut estimates = state.estimates;
        for direction in [0, 1] {
            let (track, estimate) = (&tracks[direction], &mut estimates.dead_zone[direction]);
            if moved(track.value(), estimate.value, 10) {
                estimate.u95 = estimate.u95.max(track.value() >> 4);
                estimate.value = track.value();
            }
            let alone = track.age > 0 && moved(tracks[direction ^ 1].value(), track.other, MOVED_1024);
            estimate.standing = match () {
                () if track.value() <= 0 => Standing::Doubtful(Reason::Implausible),
                () if alone || track.age > self.life(state) => Standing::Doubtful(Reason::Aged),
                () => Standing::Trusted,
            };
        }
        state.publish(estimates);
    }

    /// [`LIFE_S`] in hops.
    fn life(&self, state: &State) -> u32 {
        (LIFE_S * self.tick_hz) as u32 / (self.identify.block_ticks(&state.identify.lengths) / 4).max(1)
    }
}

const _: () = assert!(
    VOLTAGE_FRAC == ROW_FRAC,
    "tracked voltages and windows share their unit"
);
