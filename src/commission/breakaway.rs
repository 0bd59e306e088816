//! Break-away: the voltage rises until the motor is under way, once a direction.
//!
//! Where the current is sensed, it shows a motion that the counter does not, and the ramp ends.
//!
//! A motor that random torque pushes about without voltage (a dead zone at the input, hardly any friction) makes counts
//! too. Its motion counts as broken away once it has lasted: the level is that of the last pause before it, a pause being a
//! thirty-second of the ramp below 1 % of rated speed.

use super::ramp::{MOTION, NONE_SHOWN, QUIET};
use super::{Input, Params, Phase, State, pulse_test};
use crate::config::Scale;
use crate::identify::estimate::Reason;

/// Break-away voltage above which there is no room for a linear segment, Q14: 0.45.
pub(super) const MOST_BREAK_AWAY: i32 = 7_373;
/// Voltage below which no motor with a dead zone moves, Q14: 3 %.
const LEAST_BREAK_AWAY: i32 = 492;
/// The motion of an axis that moves without voltage has lasted when it has made this part of the travel at rated speed during one ramp: 0.4 %.
const LASTING: i32 = 256;
/// A pause is slower than rated speed by this factor.
const PAUSE: i32 = 100;

/// Counts of a motion that the current shows, at least, before the counter must have shown it.
const LEAST_UNSEEN: f32 = 4.0;
/// Edges of an encoder whose count goes nowhere.
const LONE_EDGES: u32 = 4;
/// Times as long an encoder is waited for that has shown an edge.
const PATIENCE: i64 = 8;

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
        crate::units::whole(counts * (1u32 << 30) as f32 / scale.rated_counts_per_tick_q16.max(1) as f32)
    }

    /// Travel at rated speed, counts, saturating.
    pub(super) fn rated_counts(&self, ticks: u32) -> i32 {
        let counts = (u64::from(self.scale.rated_counts_per_tick_q16) * u64::from(ticks)) >> 16;
        counts.min(1 << 30) as i32
    }

    /// A slow motor that coasted backwards had to be stopped first: its ramp overshot, the other direction tells more. Of a load
    /// that drove it backwards it tells nothing.
    fn plausible_break_away(&self, state: &State) -> i32 {
        let (level, other) = (state.ramp.pause_level, state.break_away[state.direction.reversed()]);
        let level = if other > 0 && !state.course.loaded { level.min(other + other / 2) } else { level };
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
