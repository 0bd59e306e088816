//! The dead zone follows, gain and time constant are frozen:
//!
//! ```text
//! d̂ ← d̂ + μ·(ū − (a + αw)/β − d̂)        in each window in which the motor turns in this direction
//! ```

use super::{Params, State, Task, Work, follows_input, moved};
use crate::identify;
use crate::identify::estimate::{Estimate, Estimates, GAIN_FRAC, Reason, Standing, TIME_FRAC, VOLTAGE_FRAC};
use crate::identify::positive::Positive;
use crate::identify::solve::{COEFFICIENT_FRAC, Coefficients, Solution};
use crate::identify::spline::{ROW_FRAC, Window};
use crate::units::Direction;

/// Weight of one window: 1/64, a memory of 64 hops (0.2 s with blocks of 13 ms).
const TRACK_SHIFT: u32 = 6;
/// Move that is published, in 1/1024: 1 %.
const NEWS_1024: i32 = 10;
/// Move of one direction that makes an older value of the other doubtful, in 1/1024: 8 %.
const MOVED_1024: i32 = 82;
/// Move since commissioning that is reported as wear, in 1/1024: 25 %. The report ends below 20 %.
const WORN_1024: i32 = 256;
const HEALED_1024: i32 = 205;
/// An input dead zone shows only while the voltage is beyond it; 1/4 above what is known leaves room for it to grow.
const BEYOND_INPUT: i32 = 4;

/// What is known of one direction.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Track {
    /// Dead zone now, Q20, with [`TRACK_SHIFT`] more fraction bits so that small steps are not lost.
    fine: i32,
    /// Dead zone as commissioned, Q20.
    base: i32,
    /// The other direction's dead zone when this one was last updated, Q20.
    other: i32,
    /// Hops since the last update.
    age: u32,
    /// It is far from where it was commissioned.
    pub(super) worn: bool,
}

impl Track {
    fn new(own: &Estimate, other: &Estimate) -> Self {
        Track {
            fine: own.value.saturating_mul(1 << TRACK_SHIFT),
            base: own.value,
            other: other.value,
            age: if own.trusted().is_some() { 0 } else { u32::MAX },
            worn: false,
        }
    }

    #[inline]
    fn value(&self) -> i32 {
        self.fine >> TRACK_SHIFT
    }

    /// One window may move it by half of what it was commissioned to, no more.
    #[inline]
    fn note(&mut self, sample: i32, other: i32) {
        let most = self.base / 2;
        let error = sample.saturating_sub(self.value()).max(-most).min(most);
        self.fine = self.fine.saturating_add(error);
        self.other = other;
        self.age = 0;
        let limit = if self.worn { HEALED_1024 } else { WORN_1024 };
        self.worn = moved(self.value(), self.base, limit);
    }
}

impl Track {
    /// The estimate as it stands now: moves beyond 1 %, and changes of trust. `life` in hops. `true`: it has changed.
    #[inline]
    fn tell(&self, other: &Track, estimate: &mut Estimate, life: u32) -> bool {
        let before = (estimate.value, estimate.u95, estimate.standing);
        if moved(self.value(), estimate.value, NEWS_1024) {
            estimate.u95 = estimate.u95.max(self.value() >> 4);
            estimate.value = self.value();
        }
        let alone = self.age > 0 && moved(other.value(), self.other, MOVED_1024);
        estimate.standing = if self.value() <= 0 {
            Standing::Doubtful(Reason::Implausible)
        } else if alone || self.age > life {
            Standing::Doubtful(Reason::Aged)
        } else {
            Standing::Trusted
        };
        before != (estimate.value, estimate.u95, estimate.standing)
    }
}

/// May it be tracked: is it trusted, or was it until it aged?
fn trackable(estimate: &Estimate) -> bool {
    matches!(estimate.standing, Standing::Trusted | Standing::Doubtful(Reason::Aged))
}

impl Params {
    /// Freezes gain and time constant and tracks the dead zone from here. `false`: there is nothing to track; nothing
    /// changes.
    pub fn adopt(&self, state: &mut State, known: &Estimates) -> bool {
        let tracks = self.freeze(state, known);
        if tracks {
            self.begin_to_track(state, known);
        }
        tracks
    }

    /// The first half of that: gain and time constant, as the solution that windows are compared with. A few divisions in
    /// software: not in a tick that does much else.
    #[cold]
    #[inline(never)]
    pub(super) fn freeze(&self, state: &mut State, known: &Estimates) -> bool {
        let (Some(gain), Some(time_constant)) = (known.gain.trusted(), known.time_constant.trusted()) else {
            return false;
        };
        if !known.dead_zone.iter().all(trackable) {
            return false;
        }
        let lengths = self.identify.lengths_for((time_constant >> TIME_FRAC) as u32);
        state.identify.relength(lengths);
        state.identify.follows_input = follows_input(known);
        let block = Positive::new(u64::from(self.identify.block_ticks(&lengths)), 0);
        let alpha = block.over(Positive::of(time_constant, TIME_FRAC));
        let rated = Positive::of(self.identify.rated_speed(&lengths), ROW_FRAC);
        let beta = Positive::of(gain, GAIN_FRAC).times(rated).times(alpha).to_q(COEFFICIENT_FRAC);
        let skew = ((i64::from(beta) * i64::from(known.gain_skew)) >> GAIN_FRAC) as i32;
        let coefficients = [beta.saturating_add(skew), beta.saturating_sub(skew)].map(|beta| Coefficients {
            gamma: 0,
            beta,
            alpha: alpha.to_q(COEFFICIENT_FRAC),
            delta: 0,
        });
        state.solver.hold(&Solution { coefficients, ..Solution::default() });
        true
    }

    /// The second half: gains the other way round, and the dead zones.
    #[cold]
    #[inline(never)]
    pub(super) fn begin_to_track(&self, state: &mut State, known: &Estimates) {
        state.solver.invert();
        state.work = Work::None;
        let [positive, negative] = &known.dead_zone;
        let tracks = [Track::new(positive, negative), Track::new(negative, positive)];
        heed_input(&mut state.identify, &tracks);
        state.task = Task::Track(tracks);
    }

    /// One hop, with a usable window or without. `true`: `known` has changed.
    #[cold]
    #[inline]
    pub(super) fn track(
        &self,
        state: &mut State,
        known: &mut Estimates,
        usable: Option<(Direction, Window)>,
    ) -> bool {
        let hop_bits = self.hop_bits(state);
        let Task::Track(tracks) = &mut state.task else {
            return false;
        };
        for track in tracks.iter_mut() {
            track.age = track.age.saturating_add(1);
        }
        if let Some((direction, window)) = usable {
            let sample = self.sample(state.solver.solution(), &window, direction);
            let other = tracks[direction.reversed()].value();
            tracks[direction].note(sample, other);
            heed_input(&mut state.identify, tracks);
        }
        let life = self.life >> hop_bits;
        let mut differs = false;
        for direction in Direction::BOTH {
            let [own, other] = [&tracks[direction], &tracks[direction.reversed()]];
            differs |= own.tell(other, &mut known.dead_zone[direction], life);
        }
        differs
    }
}

/// With an input dead zone a window counts while the voltage is beyond it; friction asks the speed instead.
fn heed_input(identify: &mut identify::State, tracks: &[Track; 2]) {
    if identify.follows_input {
        let widest = tracks[Direction::Positive].value().max(tracks[Direction::Negative].value());
        identify.break_away = widest.saturating_add(widest / BEYOND_INPUT) >> (VOLTAGE_FRAC - 14);
    }
}
