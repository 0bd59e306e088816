//! Does the count follow the voltage, and no faster than the axis file lets it? Looked at 64 times a second, in every phase.
//!
//! After a reversal a healthy shaft coasts against the voltage, ever more slowly. One that runs against it *faster* than before
//! is driven the other way: by a wire of the motor or of its direction line that came off, by an encoder whose sign changed, or
//! it is counted by an encoder of which one channel is missing, whose count rises whichever way the shaft turns. Where the
//! decoder takes the other channel alone for flicker, the count goes to and fro between two numbers instead.

use super::{Input, Params, Phase, State};
use crate::identify::estimate::{Estimate, GAIN_FRAC, Reason, Standing};
use crate::identify::positive::Positive;

/// Looks in a row that are enough: 31 ms.
const LOOKS: u8 = 2;
/// Counts against the voltage, in a look, beyond those that the shaft coasts with: four, or this share of rated speed; and for a
/// shaft that random torque pushes about without voltage.
const LEAST_AGAINST: i32 = 4;
const AGAINST_SHARE: i32 = 20;
const AGAINST_SHARE_RESTLESS: i32 = 12;
/// Looks after a change of the voltage's sign in which the shaft may still gain speed: the winding's current lags.
const LAG_LOOKS: u8 = 2;
/// Edges that bring the count nowhere within so many looks, and how far a flicker moves it at most. A shaft that turns back may be found at the same
/// place once, and then is not.
const FLICKER_EDGES: u32 = 16;
const FLICKER_LOOKS: u8 = 3;
const FLICKER_COUNTS: u32 = 2;
/// Share of the time between two steps of the speed measurement that a look waits for a tick without other work, as a shift: 8 ms, in
/// which a solution ends.
const PATIENCE_SHIFT: u32 = 1;
/// Speed that no voltage gives, in sixteenths of rated speed: 2.1 times the highest voltage that has driven it, and a quarter.
/// Rated speed is right within 30 %, so a motor reaches 1.43 times.
const MOST_PER_VOLT_16: i32 = 34;
const MOST_AT_REST_16: i32 = 4;
/// Speed for the voltage, in sixteenths of rated speed for the nominal one, below which rated speed is not right within 30 %, whatever
/// dead zone and saturation are: a healthy motor reaches six.
const LEAST_PER_VOLT_16: i64 = 5;

/// What the last looks have shown.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Course {
    /// Ticks since a look is due; 0: it is not.
    due: u8,
    /// Ticks to the next step of the speed measurement.
    pub(super) until_step: u32,
    /// The supply was within its range.
    pub(super) supplied: bool,
    /// A load turns the shaft where nothing drives it.
    pub(super) loaded: bool,
    /// What the first direction has shown in place of a start.
    pub(super) doubt: Option<Reason>,
    /// The lowest voltages of starts of a shaft that stood before, by direction, Q14; 0: none.
    pub(super) least_started: [i32; 2],
    /// Steps of the speed measurement until then.
    steps: u8,
    /// Counts of a look at rated speed.
    rated: i32,
    /// Count and path when the look became due: looks are as far apart as they are long, whenever they are taken.
    seen: i32,
    seen_path: u32,
    /// Count of the last look.
    count: i32,
    /// Where the count last came to, the path until then, and the looks since.
    place: i32,
    path: u32,
    stays: u8,
    /// Sign of the voltage.
    sign: i32,
    /// Looks since it changed.
    since: u8,
    /// Highest voltage since, Q14.
    peak: i32,
    /// Counts a look that the shaft coasts against it with.
    coasting: i32,
    /// Looks in a row that showed a shaft that is driven against the voltage, and too high a speed.
    against: u8,
    rushes: u8,
    /// Highest speed, counts a look, and the voltage that has driven it, Q14.
    fastest: i32,
    fastest_at: i32,
}

impl Course {
    /// Starts here.
    #[inline(always)]
    pub(super) fn new(params: &Params, count: i32) -> Self {
        let (rated, until_step) = (params.look_counts(), params.limits.step_ticks);
        Course { count, seen: count, place: count, rated, until_step, steps: 1, ..Course::default() }
    }

    /// A step of the speed measurement has ended.
    #[inline]
    pub(super) fn step(&mut self, steps: u8, count: i32, path: u32) {
        self.steps = self.steps.saturating_sub(1);
        if self.steps == 0 {
            (self.steps, self.due) = (steps, 1);
            (self.seen, self.seen_path) = (count, path);
        }
    }

    /// Has this tick made a step of the speed measurement?
    #[inline]
    pub(super) fn has_stepped(&self, step_ticks: u32) -> bool {
        self.until_step.wrapping_add(1) == step_ticks
    }

    /// Does a look wait for its tick?
    #[inline]
    pub(super) fn waits(&self) -> bool {
        self.due > 0
    }

    /// Does the look that waits take this tick? `idle`: it has no other work.
    #[inline]
    pub(super) fn is_due(&mut self, idle: bool, step_ticks: u32) -> bool {
        self.due = self.due.saturating_add(1);
        idle || u32::from(self.due) > step_ticks >> PATIENCE_SHIFT
    }

    /// Notes how far it came against a voltage of this sign; is the shaft driven against it?
    fn runs_against(&mut self, sign: i32, back: i32, threshold: i32) -> bool {
        if sign != self.sign {
            (self.sign, self.since, self.peak) = (sign, 0, 0);
            (self.coasting, self.against) = (0, 0);
        }
        self.since = self.since.saturating_add(1);
        if sign == 0 {
            return false;
        }
        if self.since <= LAG_LOOKS {
            self.coasting = self.coasting.max(back);
            return false;
        }
        let faster = back.saturating_sub(self.coasting.saturating_add(self.coasting / 8)) > threshold;
        self.against = if faster { self.against.saturating_add(1) } else { 0 };
        self.coasting = self.coasting.min(back.max(0));
        self.against >= LOOKS
    }

    /// Does the count go to and fro?
    fn flickers(&mut self, count: i32, path: u32, shaken: bool) -> bool {
        if shaken || count.wrapping_sub(self.place).unsigned_abs() > FLICKER_COUNTS {
            (self.place, self.path, self.stays) = (count, path, 0);
        }
        self.stays = self.stays.saturating_add(1);
        self.stays > FLICKER_LOOKS && path.wrapping_sub(self.path) >= FLICKER_EDGES
    }

    /// Is the shaft faster than the voltage drives it?
    fn rushes(&mut self, forwards: i32, level: i32) -> bool {
        self.peak = self.peak.max(level);
        if forwards > self.fastest {
            (self.fastest, self.fastest_at) = (forwards, self.peak);
        }
        let share = (self.peak.saturating_mul(MOST_PER_VOLT_16) >> 14) + MOST_AT_REST_16;
        let most = (i64::from(self.rated) * i64::from(share)) >> 4;
        let rushes = self.sign != 0 && i64::from(forwards) > most.saturating_add(i64::from(LEAST_AGAINST));
        self.rushes = if rushes { self.rushes.saturating_add(1) } else { 0 };
        self.rushes >= LOOKS
    }
}

impl Params {
    /// Takes a look.
    #[cold]
    #[inline(never)]
    pub(super) fn look(&self, state: &mut State, input: &Input) {
        let drives = matches!(state.phase, Phase::BreakAway | Phase::Learn | Phase::Saturate | Phase::Verify);
        // What acts: a limit may have lowered what was asked for.
        let level = if drives { input.net().0.saturating_mul(state.sign()) } else { 0 };
        let sign = if level > 0 { state.sign() } else { 0 };
        let share = if state.restless { AGAINST_SHARE_RESTLESS } else { AGAINST_SHARE };
        let course = &mut state.course;
        let threshold = LEAST_AGAINST.max(course.rated / share);
        let moved = course.seen.wrapping_sub(course.count);
        (course.due, course.count) = (0, course.seen);
        let forwards = moved.saturating_mul(sign);
        let against = course.runs_against(sign, forwards.saturating_neg(), threshold);
        // Shaking the shaft brings it back to where it was.
        let fresh = state.elapsed < self.limits.step_ticks * u32::from(self.limits.steps);
        let shaken = fresh || state.phase == Phase::PulseTest || state.restless;
        let flickers = course.flickers(course.seen, course.seen_path, shaken);
        let rushes = course.rushes(forwards, level);
        if against {
            self.runs_against(state)
        } else if flickers {
            state.refuse(Reason::ChannelMissing)
        } else if rushes {
            state.refuse(Reason::SpeedContradicts)
        }
    }

    /// What a shaft has shown that runs against the voltage.
    fn runs_against(&self, state: &mut State) {
        let seen = |direction| state.break_away[direction] > 0;
        let (here, there) = (seen(state.direction), seen(state.direction.reversed()));
        match (here, there) {
            (true, _) => state.refuse(Reason::DirectionChanged),
            (false, true) => state.refuse(Reason::ChannelMissing),
            (false, false) => self.ran_backwards(state, state.last_count),
        }
    }

    /// Counts of a look at rated speed.
    fn look_counts(&self) -> i32 {
        self.rated_counts(self.limits.step_ticks * u32::from(self.limits.steps))
    }
}

impl Course {
    /// The gain that the fastest look has shown, rough as it is.
    #[cold]
    pub(super) fn gain(&self) -> Estimate {
        let [fastest, rated] = [self.fastest, self.rated].map(|counts| Positive::of(counts.max(1), 0));
        let level = Positive::of(self.fastest_at.max(1), 14);
        let value = fastest.over(rated).over(level).to_q(GAIN_FRAC);
        Estimate { value, u95: value / 4, standing: Standing::Doubtful(Reason::SpeedContradicts) }
    }

    /// Has it stayed slower than rated speed and voltage allow?
    pub(super) fn lags(&self) -> bool {
        let least = i64::from(self.rated) * i64::from(self.fastest_at) * LEAST_PER_VOLT_16;
        i64::from(self.fastest) << (14 + 4) < least
    }
}
