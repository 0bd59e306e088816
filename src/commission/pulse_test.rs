//! The first motion of all: is there an encoder, and which way does it count?
//!
//! A voltage that rises until something is counted turns a joint without encoder by as much as it likes, because the
//! voltage of a healthy motor's break-away is not known. So the shaft is shaken first, by pulses that take back what they
//! give, each stronger and shorter than the one before, and each mirrored:
//!
//! ```text
//! +V for T, −V for 2T, +V for T, rest T
//! x ≤ k·V·T²/τ       k: speed per voltage, τ: time constant; equality: no friction, T ≪ τ
//! ```
//!
//! `T` makes that [`SHARE`] of the travel that is allowed, for the fastest motor that the configuration may mean. Friction
//! cannot add to the travel, but it keeps the shaft from coming back to where it was: what is left of the travel is for
//! that. In the second half of the long part a healthy shaft runs backwards by half of `x` or more, as long as its dead zone
//! is below 0.6·V. What the pulses show together settles the matter; a shaft that drifts with random torque disagrees with itself.
//!
//! This takes a joint whose travel holds enough counts, and a motor whose time constant is known roughly
//! ([`PulseTest::new`]); others are not shaken, and their first travel is not bounded.

use super::{Input, Params, Phase, State};
use crate::config::Scale;
use crate::identify::estimate::Reason;
use crate::units::VoltageQ14;

/// Travel of the joint that is allowed before an encoder has proved itself, rad: 5°.
const TRAVEL_RAD: f32 = 5.0 / 180.0 * core::f32::consts::PI;
/// Share of it that a pulse gives a motor without friction. What friction keeps from coming back adds as much again and
/// more: of 290 simulated motors two went beyond 5°, to 6.7°, with 1/3.
const SHARE: f32 = 0.27;
/// Rated speed, and with it `k`, is right within 30 %.
const LEAST_RATED: f32 = 0.7;
/// A hint of the time constant is right within a factor of 2.
const LEAST_HINTED: f32 = 0.5;
/// Without a hint: the shortest time constant of small geared motors, s.
const LEAST_TAU_S: f32 = 0.02;
/// Longest hint, s. Larger motors have windings whose current does not follow such pulses.
const MOST_HINT_S: f32 = 0.3;
/// Counts that the allowed travel must hold, with a hint and without: only then does a pulse show. Of 500 healthy motors
/// that were shaken with less (down to 14, with a share of 1/3 and 0.27), the last that did not show its encoder had 24 with a
/// hint, 35 without.
const LEAST_COUNTS: f32 = 28.0;
const LEAST_COUNTS_UNHINTED: f32 = 40.0;
/// Ticks of the shortest pulse.
const LEAST_TICKS: f32 = 4.0;
/// Voltage of the last pulse, Q14 of nominal: 0.62, the highest of the segments that follow; break-away reaches 0.45.
const TOP: u32 = 10_158;
/// Pulses. The voltage of pulse n is `n/12` of the top.
const PULSES: u32 = 12;
/// Its length over that of the last: √(12/n), Q8.
const LENGTHS: [u32; PULSES as usize] = [887, 627, 512, 443, 397, 362, 335, 314, 296, 280, 267, 256];
/// Counts that prove the encoder: four, or this share of the allowed travel where it holds many; and times so many that
/// prove, before the last pulse, that it runs the other way: for that a motor is refused.
const PROOF_SHARE: f32 = 1.0 / 32.0;
const LEAST_PROOF: i32 = 4;
const REVERSED_TIMES: i32 = 2;
/// Counts that a dead encoder does not make, more than the flicker at an edge.
const SHOWN: i32 = 2;

/// How an axis is shaken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct PulseTest {
    /// Ticks of a quarter of the last pulse.
    length: u32,
    /// Counts that prove it.
    proof: i32,
    /// Ticks after which the counter shows what was commanded.
    delay: u32,
}

/// Where the pulses stands.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pulses {
    /// Pulse under way.
    pulse: u32,
    /// Counter in the middle of its long part.
    middle: i32,
    /// Counts that followed, in the pulses of either sign, and in the quarter behind, where a shaft that coasts goes on.
    followed: [i32; 2],
    coasted: i32,
    /// The counter left its place in a pulse: whatever else, there is an encoder.
    shown: bool,
    /// The encoder has proved itself.
    pub(super) proved: bool,
    /// Current in the second half of the last long part, and its ticks; 0: not sensed.
    current: i32,
    sensed: i32,
    /// Ticks that it took; they come on top of the budget.
    pub(super) ticks: u32,
}

/// Counts of the travel that is allowed.
pub(super) fn travel_counts(scale: &Scale) -> f32 {
    TRAVEL_RAD * scale.config.gear_ratio * scale.counts_per_rad()
}

impl PulseTest {
    /// For this axis; `None`: its first travel cannot be bounded so. Without a hint it takes a gear: what turns a joint
    /// without one may be a large motor.
    pub(super) fn new(scale: &Scale) -> Option<Self> {
        let config = &scale.config;
        let (tau_s, least) = match config.time_constant_hint_s.get() {
            Some(hint) if hint <= MOST_HINT_S => (LEAST_HINTED * hint, LEAST_COUNTS),
            None if config.gear_ratio != 1.0 => (LEAST_TAU_S, LEAST_COUNTS_UNHINTED),
            _ => return None,
        };
        let travel = travel_counts(scale);
        let tau = tau_s * config.tick_hz as f32;
        let fastest = scale.rated_counts_per_tick_q16 as f32 / 65_536.0 / LEAST_RATED * TOP as f32
            / VoltageQ14::NOMINAL.0 as f32;
        // The root is right to 6 %, the travel then to 12 %. Pulses longer than a time constant show no more.
        let length = micromath::F32Ext::sqrt(SHARE * travel * tau / fastest).min(tau);
        (travel >= least && length >= LEAST_TICKS).then_some(Self {
            length: length as u32,
            proof: ((travel * PROOF_SHARE) as i32).max(LEAST_PROOF),
            delay: u32::from(config.pwm_delay_ticks),
        })
    }

    /// Ticks of a quarter of a pulse.
    fn quarter(&self, pulse: u32) -> u32 {
        let ratio = LENGTHS.get(pulse as usize).copied().unwrap_or(0);
        self.length.saturating_mul(ratio) >> 8
    }
}

impl Params {
    /// One tick of a pulse.
    #[cold]
    #[inline(never)]
    pub(super) fn pulse_test(&self, state: &mut State, input: &Input, pulse_test: &PulseTest) {
        let pulse = state.pulses.pulse;
        let quarter = pulse_test.quarter(pulse);
        let [half, last, rest, end] = [2, 3, 4, 5].map(|n| quarter.saturating_mul(n));
        let level = (TOP.saturating_mul(pulse.saturating_add(1)) / PULSES) as i32;
        let level = if pulse & 1 == 0 { level } else { -level };
        let now = state.elapsed;
        state.level = if now < quarter {
            level
        } else if now < last {
            -level
        } else if now < rest {
            level
        } else {
            0
        };
        // The long part drives there.
        let towards = -state.sign() * level.signum();
        let away = input.count.wrapping_sub(state.start_count).saturating_abs();
        let pulses = &mut state.pulses;
        pulses.ticks = pulses.ticks.saturating_add(1);
        pulses.shown |= away >= SHOWN;
        if now == half.saturating_add(pulse_test.delay) {
            pulses.begin(input);
        }
        if (half..last).contains(&now) {
            pulses.feel(input, towards);
        }
        if now == last.saturating_add(pulse_test.delay) {
            pulses.note(input.count, towards, pulse);
        }
        if now == rest.saturating_add(pulse_test.delay) {
            pulses.coasted = pulses.coasted.saturating_add(pulses.way(input.count, towards));
        }
        if now >= end {
            self.next_pulse(state, input, pulse_test.proof);
        }
    }

    /// After every second pulse what they show together decides: a drift shows in both, with opposite signs.
    fn next_pulse(&self, state: &mut State, input: &Input, proof: i32) {
        let none = self.no_current();
        let pulses = &mut state.pulses;
        pulses.pulse = pulses.pulse.saturating_add(1);
        if pulses.pulse & 1 == 1 {
            state.enter(Phase::PulseTest, input.count)
        } else if pulses.total() >= proof {
            pulses.proved = true;
            state.enter(Phase::Settle, input.count);
        } else if pulses.runs_back(proof.saturating_mul(REVERSED_TIMES)) {
            state.refuse(Reason::Reversed)
        } else if pulses.pulse < PULSES {
            state.enter(Phase::PulseTest, input.count)
        } else if pulses.runs_back(proof) {
            state.refuse(Reason::Reversed)
        } else if pulses.shown {
            // It is there, and hardly seen to move: the ramp will tell.
            pulses.proved = true;
            state.enter(Phase::Settle, input.count);
        } else if pulses.silent(none) {
            state.refuse(Reason::MotorDisconnected)
        } else if state.limited() {
            // The ramp ends by what the current shows.
            state.enter(Phase::BreakAway, input.count)
        } else {
            state.refuse(Reason::NoMotion)
        }
    }
}

impl Pulses {
    /// The second half of the long part begins.
    fn begin(&mut self, input: &Input) {
        self.middle = input.count;
        (self.current, self.sensed) = (0, 0);
    }

    fn feel(&mut self, input: &Input, towards: i32) {
        if let Some(raw) = input.current_raw {
            self.current = self.current.saturating_add(i32::from(raw).saturating_mul(towards));
            self.sensed = self.sensed.saturating_add(1);
        }
    }

    fn note(&mut self, count: i32, towards: i32, pulse: u32) {
        let followed = self.way(count, towards);
        let [even, odd] = &mut self.followed;
        let sum = if pulse & 1 == 0 { even } else { odd };
        *sum = sum.saturating_add(followed);
        self.middle = count;
    }

    /// Counts since the last look.
    fn way(&self, count: i32, towards: i32) -> i32 {
        count.wrapping_sub(self.middle).saturating_mul(towards)
    }

    fn total(&self) -> i32 {
        let [even, odd] = self.followed;
        even.saturating_add(odd)
    }

    /// By so many counts, and in the pulses of either sign: a shaft whose drive acts in one direction alone, below the dead
    /// zone of the other, coasts against every second pulse. Nor does it turn round behind: a slow winding or a delay makes the
    /// shaft answer the part before.
    fn runs_back(&self, counts: i32) -> bool {
        let share = counts.saturating_neg() / 4;
        let [even, odd] = self.followed;
        self.total() <= counts.saturating_neg() && [even, odd, self.coasted].iter().all(|sum| *sum <= share)
    }

    /// The current is sensed, and there is none.
    fn silent(&self, none: i32) -> bool {
        self.sensed > 0 && self.current < none.saturating_mul(self.sensed)
    }
}
