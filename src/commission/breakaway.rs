//! Break-away: the voltage rises until the motor is under way, once a direction.
//!
//! Where the current is sensed, it shows a motion that the counter does not, and the ramp ends.
//!
//! A motor that random torque pushes about without voltage (a dead zone at the input, hardly any friction) makes counts
//! too. Its motion counts as broken away once it has lasted: the level is that of the last pause before it, a pause being a
//! thirty-second of the ramp below 1 % of rated speed.

use super::{Input, NO_CURRENT, Params, Phase, State, pulse_test};
use crate::config::Scale;
use crate::identify::estimate::Reason;

/// Break-away voltage above which there is no room for a linear segment, Q14: 0.45.
pub(super) const MOST_BREAK_AWAY: i32 = 7_373;
/// Voltage below which no motor with a dead zone moves, Q14: 3 %.
const LEAST_BREAK_AWAY: i32 = 492;
/// Counts that are motion, not a jittering edge.
const MOTION: i32 = 4;
/// The motion of an axis that moves without voltage has lasted when it has made this part of the travel at rated speed during one ramp: 0.4 %.
const LASTING: i32 = 256;
/// A pause is slower than rated speed by this factor.
const PAUSE: i32 = 100;

/// Voltages between which the winding's conductance is taken before anything moves, Q14: 4 … 8 %; and above which it is
/// taken again: 40 %.
const QUIET: core::ops::Range<i32> = 655..1_311;
const LOUD: i32 = 6_554;
/// The middle of the first: a current that does not grow with the voltage from half to half has an offset.
const QUIET_MIDDLE: i32 = 983;
/// Share of the early conductance that is left at the top of the ramp, in quarters: at least three, and the motor stands;
/// back-EMF leaves the break-away voltage over the ramp's, at most 0.6.
const STALLED_QUARTERS: i64 = 3;

/// Share of the voltage that does not count as back-EMF, as a shift: 1/16; the early conductance is right within 3 %.
const DOUBT_SHIFT: u32 = 5;
/// The part of the quiet part's current that may be an offset, of 256: a quarter. A current that is sampled behind the middle of a pulse is
/// `U/L · (1 − d) · Δt` too high: 18 % at a duty `d` of 6 %, a `Δt` of 1.3 µs and an `L/R` of 0.12 ms.
const MOST_OFFSET: f32 = 64.0;
/// Counts of a motion that the current shows, at least, before the counter must have shown it.
const LEAST_UNSEEN: f32 = 4.0;
/// Counts, between two of which the counter shows no motion.
const NONE_SHOWN: i32 = 2;

/// Edges of an encoder whose count goes nowhere.
const LONE_EDGES: u32 = 4;
/// Times as long an encoder is waited for that has shown an edge.
const PATIENCE: i64 = 8;

/// Time from the break-away to the first count, as a share of the time from there to the last of [`MOTION`], in quarters. At
/// constant acceleration 0.6 on average and 1 at most, by where the shaft stands between two edges; friction that falls to its
/// kinetic level makes it more.
const SINCE_START_QUARTERS: i32 = 3;
/// The most: the torque grows with the ramp from nothing, so four counts take 4^⅓ = 1.6 times as long as one.
const SINCE_START_MOST_QUARTERS: i32 = 7;

/// Ticks of one measurement of the conductance: 2¹² of 2¹⁵ counts fit into 32 bits, their products into 64.
const MOST_TICKS: i32 = 1 << 12;

/// Current and voltage, summed: the winding's conductance.
#[derive(Clone, Copy, Debug, Default)]
struct Conductance {
    current: i32,
    voltage: i32,
    ticks: i32,
}

impl Conductance {
    /// Notes the first [`MOST_TICKS`].
    fn note(&mut self, current: i32, voltage: i32) {
        if self.ticks < MOST_TICKS {
            self.current += current;
            self.voltage += voltage;
            self.ticks += 1;
        }
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            current: self.current + other.current,
            voltage: self.voltage + other.voltage,
            ticks: self.ticks + other.ticks,
        }
    }

    /// Mean current and voltage.
    fn means(&self) -> (f32, f32) {
        let ticks = self.ticks.max(1) as f32;
        (self.current as f32 / ticks, self.voltage as f32 / ticks)
    }
}

/// One ramp.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Ramp {
    /// Voltage of the last tick, Q14.
    pub(super) level: i32,
    /// Before anything moves, at its lower and its higher voltages.
    quiet: [Conductance; 2],
    /// The part of the quiet current that does not grow with the voltage, of 256; `None`: not known yet.
    offset: Option<u8>,
    /// At the top of the ramp.
    loud: Conductance,
    /// The shaft did not stand in the quiet part: it tells nothing about the winding.
    unquiet: bool,
    /// Back-EMF since the motion began, beyond the doubt: Q14 · ticks · early current.
    emf: i64,
    /// Displacement when it was 0 last.
    emf_from: i32,
    /// Lowest displacement, counts: until there the motor still moved backwards.
    lowest: i32,
    /// Ticks since then.
    since_lowest: u32,
    /// Displacement at the last pause.
    pause: i32,
    /// Voltage then, Q14.
    pause_level: i32,
    /// Voltage in the last tick that showed no count beyond it, Q14.
    last_still: i32,
    /// Displacement at the last look.
    looked: i32,
    /// Ticks to the next look.
    next_look: u32,
    /// Path until it began.
    path: u32,
}

impl Ramp {
    pub(super) fn begin(path: u32) -> Self {
        Self { path, ..Self::default() }
    }

    /// Notes the winding's current, converter counts, `None`: not sensed.
    fn note_current(&mut self, raw: Option<i16>, sign: i32, level: i32) {
        let Some(raw) = raw else { return };
        let current = i32::from(raw) * sign;
        if QUIET.contains(&level) {
            self.quiet[usize::from(level >= QUIET_MIDDLE)].note(current, level);
        } else if level >= LOUD {
            self.loud.note(current, level);
        } else if level >= QUIET.end && self.offset.is_none() {
            self.offset = Some(self.offset());
        }
    }

    /// Does the current show a motion of so many Q14 · ticks of back-EMF? Winding and voltage: `v = R·i + emf`, with the R of
    /// the quiet part. A winding whose current lags looks more conductive later on, which hides a motion and invents none.
    fn turns(&mut self, raw: Option<i16>, sign: i32, level: i32, most: i64) -> bool {
        let quiet = self.quiet[0].and(&self.quiet[1]);
        let Some(raw) = raw else { return false };
        if self.unquiet || level < QUIET.end || quiet.current <= NO_CURRENT.saturating_mul(quiet.ticks) {
            return false;
        }
        let current = i32::from(raw).wrapping_mul(sign);
        // A motor that turns draws what its friction takes; behind an input dead zone nothing flows yet, and what flowed in
        // the quiet part was the shaft's own drift.
        if current <= NO_CURRENT {
            return false;
        }
        let product = |a: i32, b: i32| i64::from(a).wrapping_mul(i64::from(b));
        let driven = product(level, quiet.current);
        let resistive = product(current, quiet.voltage);
        // The current that a rising voltage adds does not hold the offset.
        let risen = driven.wrapping_sub(product(quiet.voltage, quiet.current / quiet.ticks.max(1)));
        let offset = i64::from(self.offset.unwrap_or(MOST_OFFSET as u8));
        let doubt = (driven >> DOUBT_SHIFT).wrapping_add((risen >> 8).wrapping_mul(offset));
        let beyond = driven.wrapping_sub(doubt).wrapping_sub(resistive);
        self.emf = self.emf.saturating_add(beyond).max(0);
        self.emf > 0 && self.emf >= most.saturating_mul(i64::from(quiet.current))
    }

    /// The part of the quiet current that does not grow with the voltage, of 256.
    fn offset(&self) -> u8 {
        let [(low, low_v), (high, high_v)] = [self.quiet[0].means(), self.quiet[1].means()];
        let grown = (high - low) * (high_v + low_v) / ((high_v - low_v) * (high + low));
        // Not a number where a half is empty: then nothing is known of it.
        if grown.is_nan() { MOST_OFFSET as u8 } else { (256.0 * (1.0 - grown)).clamp(0.0, MOST_OFFSET) as u8 }
    }

    /// Voltage at which a shaft broke away that has now made its [`MOTION`] counts, Q14. It rose on while the shaft made its first
    /// count, and for less than the time that the others took.
    pub(super) fn started(&self, level: i32) -> i32 {
        let risen = level.saturating_sub(self.last_still).max(0);
        self.last_still.saturating_sub(risen * SINCE_START_QUARTERS / 4).max(1)
    }

    /// … at least: it then made its first count while the voltage rose so that the speed grew with the square of time.
    fn started_least(&self, level: i32) -> i32 {
        let risen = level.saturating_sub(self.last_still).max(0);
        self.last_still.saturating_sub(risen.saturating_mul(SINCE_START_MOST_QUARTERS) / 4).max(1)
    }

    /// Has the shaft made [`MOTION`] counts since the last pause?
    pub(super) fn moved(&self, displacement: i32) -> bool {
        displacement.wrapping_sub(self.pause) >= MOTION
    }

    /// Why nothing was counted. Without a current sensor a stall and an unplugged encoder are the same data.
    fn silence(&self, no_current: i32) -> Reason {
        let (quiet, loud) = (self.quiet[0].and(&self.quiet[1]), &self.loud);
        if loud.ticks == 0 {
            return Reason::NoMotion;
        }
        if loud.current < no_current.saturating_mul(loud.ticks) {
            return Reason::MotorDisconnected;
        }
        let late = i64::from(loud.current) * i64::from(quiet.voltage) * 4;
        let early = i64::from(quiet.current) * i64::from(loud.voltage) * STALLED_QUARTERS;
        if late >= early { Reason::Stalled } else { Reason::EncoderUnplugged }
    }

    /// Notes the displacement at a voltage. Is a look due?
    fn note(&mut self, displacement: i32, level: i32) -> bool {
        self.since_lowest = self.since_lowest.saturating_add(1);
        if displacement <= self.pause {
            self.last_still = level;
        }
        if displacement < self.lowest {
            // It still moves backwards: a slow motor coasts, or a reversed one obeys.
            self.lowest = displacement;
            self.since_lowest = 0;
            (self.pause, self.pause_level) = (displacement, level);
        }
        let due = self.next_look == 0;
        self.next_look = self.next_look.saturating_sub(1);
        due
    }

    /// Has it hardly moved since the last look? `interval`: ticks between two looks; `slow`: counts in it at the speed of a pause.
    fn look(&mut self, displacement: i32, level: i32, interval: u32, slow: i32) {
        self.next_look = interval;
        if displacement.wrapping_sub(self.looked) < slow.max(1) {
            (self.pause, self.pause_level) = (displacement, level);
        }
        self.looked = displacement;
    }
}

impl Params {
    /// Ticks of the whole ramp.
    pub(super) fn ramp_ticks(&self) -> u32 {
        self.share(20).max(16)
    }

    /// … of it until this level.
    pub(super) fn ramp_ticks_to(&self, level: i32) -> u32 {
        (self.ramp_ticks() >> 4) * level.clamp(0, MOST_BREAK_AWAY) as u32 / MOST_BREAK_AWAY as u32 * 16
    }

    /// One tick of the ramp that looks for the break-away.
    #[cold]
    #[inline(never)]
    pub(super) fn break_away(&self, state: &mut State, input: &Input) {
        let (length, displacement) = (self.ramp_ticks(), state.displacement(input.count));
        self.raise(state, input, length, displacement);
        match self.unseen_motion(state, input, displacement) {
            Some(Reason::Reversed) => return self.ran_backwards(state, input.count),
            Some(reason) => return state.refuse(reason),
            None => {}
        }
        if state.ramp.emf == 0 {
            state.ramp.emf_from = displacement;
        }
        if state.stroke == 0 && state.level < LEAST_BREAK_AWAY && displacement.saturating_abs() >= 2 {
            state.restless = true;
        }
        self.judge_ramp(state, input, length, displacement);
    }

    /// The next level of the ramp, and what the tick shows.
    pub(super) fn raise(&self, state: &mut State, input: &Input, length: u32, displacement: i32) {
        state.level = (MOST_BREAK_AWAY as u32 * (state.elapsed >> 4).min(length >> 4) / (length >> 4)) as i32;
        let (interval, sign, level) = (length >> 5, state.sign(), state.ramp_level(input));
        state.ramp.level = level;
        if state.ramp.note(displacement, level) {
            let slow = self.rated_counts(interval) / PAUSE;
            state.ramp.look(displacement, level, interval, slow);
        }
        state.ramp.note_current(input.current_raw, sign, at_winding(level, input, sign));
        state.ramp.unquiet |= level < QUIET.end && displacement.saturating_abs() >= NONE_SHOWN;
    }

    /// Why a shaft whose current says that it turns is not believed.
    fn unseen_motion(&self, state: &mut State, input: &Input, displacement: i32) -> Option<Reason> {
        let sign = state.sign();
        let level = at_winding(state.ramp.level, input, sign);
        let unproved = (state.stroke == 0 || state.course.doubt.is_some()) && !state.pulses.proved;
        // An encoder that shows an edge is there: it is waited for longer, because rated speed may be far too high.
        let edges = state.travel.wrapping_sub(state.ramp.path);
        let most = if edges == 0 { self.unseen } else { self.unseen.saturating_mul(PATIENCE) };
        if !(unproved && state.ramp.turns(input.current_raw, sign, level, most)) {
            return None;
        }
        // What random torque has done before the motion is no sign of its direction.
        match displacement.wrapping_sub(state.ramp.emf_from) {
            shown if shown <= -NONE_SHOWN => Some(Reason::Reversed),
            shown if shown < NONE_SHOWN => Some(state.unplugged()),
            _ => {
                state.ramp.emf = 0;
                None
            }
        }
    }

    /// Has the shaft broken away, run backwards, or given no sign of life?
    fn judge_ramp(&self, state: &mut State, input: &Input, length: u32, displacement: i32) {
        let lasting = match state.restless {
            true => (self.rated_counts(length) / LASTING).max(MOTION),
            false => MOTION,
        };
        let given_up = state.ramp.since_lowest > length + length / 2;
        let forwards = displacement.wrapping_sub(if given_up { state.ramp.lowest } else { state.ramp.pause });
        if forwards >= if given_up { MOTION } else { lasting } {
            state.break_away[state.direction] = self.plausible_break_away(state);
            state.started[state.direction] = state.ramp.started(state.ramp.level);
            state.note_least_start();
            self.moved(state, input);
        } else if -displacement >= 2 * lasting && self.reversed(state, -displacement - 2 * lasting) {
            self.ran_backwards(state, input.count);
        } else if given_up {
            self.stayed(state, input.count, displacement);
        }
    }

    /// Has the shaft come so many counts further back than it may without being driven?
    fn reversed(&self, state: &State, beyond: i32) -> bool {
        // 2 % of rated speed since the ramp began is what random torque may do to a shaft that nothing holds.
        let share = if state.restless { 50 } else { 128 };
        let first = state.stroke == 0 || state.course.doubt.is_some();
        first && beyond >= self.rated_counts(state.elapsed) / share
    }

    /// It has started the wrong way. Whether motor or encoder is reversed, or the count rises whichever way it turns, the other
    /// direction tells.
    pub(super) fn ran_backwards(&self, state: &mut State, count: i32) {
        match state.course.doubt {
            None if state.stroke == 0 => state.try_other(Reason::Reversed, count),
            None | Some(Reason::Reversed) => state.refuse(Reason::Reversed),
            Some(_) => state.refuse(Reason::OneDirection),
        }
    }

    /// It has not started; does it in the other direction?
    fn stayed(&self, state: &mut State, count: i32, displacement: i32) {
        let reason = self.silence(state, displacement);
        let still = matches!(reason, Reason::NoMotion | Reason::Stalled | Reason::MotorDisconnected);
        match state.course.doubt {
            None if still && state.stroke == 0 => state.try_other(reason, count),
            None if still => state.refuse(Reason::OneDirection),
            None => state.refuse(reason),
            Some(Reason::Reversed) => state.refuse(Reason::OneDirection),
            Some(first) => state.refuse(first),
        }
    }

    fn silence(&self, state: &State, displacement: i32) -> Reason {
        match state.ramp.silence(self.no_current()) {
            Reason::NoMotion | Reason::EncoderUnplugged if self.identify.coarse() && displacement != 0 => {
                Reason::EncoderTooSlow
            }
            _ if state.voltage.now => Reason::CurrentLimited,
            Reason::EncoderUnplugged => state.unplugged(),
            reason => reason,
        }
    }

    /// Back-EMF of a travel that an encoder must have shown, Q14 · ticks: [`LEAST_UNSEEN`] counts, or an eighth of the travel
    /// that a joint is allowed.
    pub(super) fn unseen(scale: &Scale) -> i64 {
        let counts = LEAST_UNSEEN.max(pulse_test::travel_counts(scale) / 8.0);
        (counts * (1u32 << 30) as f32 / scale.rated_counts_per_tick_q16.max(1) as f32) as i64
    }

    /// Travel at rated speed, counts, saturating.
    pub(super) fn rated_counts(&self, ticks: u32) -> i32 {
        let counts = (u64::from(self.scale.rated_counts_per_tick_q16) * u64::from(ticks)) >> 16;
        counts.min(1 << 30) as i32
    }

    /// A slow motor that coasted backwards had to be stopped first: its ramp overshot, the other direction tells more.
    fn plausible_break_away(&self, state: &State) -> i32 {
        let (level, other) = (state.ramp.pause_level, state.break_away[state.direction.reversed()]);
        let level = if other > 0 { level.min(other + other / 2) } else { level };
        level.max(1)
    }

    fn moved(&self, state: &mut State, input: &Input) {
        match state.course.doubt {
            None => {}
            Some(Reason::Reversed) => return state.refuse(Reason::ChannelMissing),
            Some(_) => return state.refuse(Reason::OneDirection),
        }
        // Counts in the right direction: what the pulses may not have shown is shown.
        state.pulses.proved = true;
        state.stroke = state.stroke.saturating_add(1);
        if state.stroke < 2 {
            state.direction = state.direction.reversed();
        }
        state.enter(Phase::Settle, input.count);
    }
}

/// A winding knows nothing of the load that a part of its voltage holds.
fn at_winding(level: i32, input: &Input, sign: i32) -> i32 {
    level + input.load.0 * sign
}

impl State {
    /// The lowest start of a direction, of those that began at rest: a shaft that still coasts back had to be stopped first.
    pub(super) fn note_least_start(&mut self) {
        if self.ramp.lowest < 0 {
            return;
        }
        let (seen, least) =
            (self.ramp.started_least(self.level), &mut self.course.least_started[self.direction]);
        *least = if *least == 0 { seen } else { seen.min(*least) };
    }

    /// The current shows a motion that the count does not: is there no encoder, or one channel of it?
    fn unplugged(&self) -> Reason {
        let edges = self.travel.wrapping_sub(self.ramp.path);
        if edges >= LONE_EDGES { Reason::ChannelMissing } else { Reason::EncoderUnplugged }
    }

    /// The first direction has shown no start, for this reason: the other one is tried before it is believed.
    fn try_other(&mut self, reason: Reason, count: i32) {
        self.course.doubt = Some(reason);
        self.stroke = 1;
        self.direction = self.direction.reversed();
        self.enter(Phase::Settle, count);
    }
}
