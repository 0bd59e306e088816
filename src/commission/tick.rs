//! One control tick of a commissioning.

use super::{Input, Params, Phase, Request, State};
use crate::sample::Bridge;
use crate::units::VoltageQ14;

impl Params {
    /// One control tick. Call it until [`State::ended`]; the bridge request then is open.
    #[inline]
    pub fn step(&self, state: &mut State, input: &Input) -> Request {
        self.step_beside(state, input, false)
    }

    /// One control tick. `busy`: something else takes long in it, so solver and decision wait for the next tick, as they do while
    /// the splines are sampled. Of four ticks in a row one must not be busy.
    #[inline]
    pub fn step_beside(&self, state: &mut State, input: &Input, busy: bool) -> Request {
        if state.ended() || state.phase == Phase::Idle {
            return Request::default();
        }
        self.bookkeeping(state, input);
        self.measure_speed(state, input);
        if let Some(reason) = self.guard(state, input) {
            state.refuse(reason);
            return Request::default();
        }
        // Asked, not taken: a copy of it in every tick costs more than its use in one of many.
        let waiting = state.window.is_some();
        let busy = busy || state.identify.is_sampling();
        let free = !waiting && !busy;
        let look = state.course.waits() && state.phase != Phase::Decide && self.looks(state, free);
        self.identify.sum(&mut state.identify, input.count, input.net());
        if waiting {
            self.use_window(state);
        } else if !busy {
            self.solve(state);
        }
        if look {
            self.look(state, input);
        }
        if !(busy && state.phase == Phase::Decide) {
            self.advance(state, input);
        }
        self.turn_before_the_stop(state, input);
        if state.identify.hopped() {
            // Here already: in the next tick it is used, which takes long, too.
            state.window = state.identify.hop();
        }
        self.request(state, input)
    }

    /// Does the look at the course that waits take this tick?
    #[cold]
    #[inline(never)]
    fn looks(&self, state: &mut State, free: bool) -> bool {
        let idle = free && !state.solver.busy() && state.solved.is_none();
        state.course.is_due(idle, self.limits.step_ticks)
    }

    #[inline]
    fn bookkeeping(&self, state: &mut State, input: &Input) {
        let moved = input.count.wrapping_sub(state.last_count);
        state.last_count = input.count;
        state.travel = state.travel.saturating_add(moved.unsigned_abs());
        state.still = if moved == 0 { state.still.saturating_add(1) } else { 0 };
        // It ends long before one of these is full: see `Params::most`.
        state.elapsed = state.elapsed.wrapping_add(1);
        if state.phase != Phase::PulseTest {
            state.total = state.total.wrapping_add(1);
        }
        state.voltage.unmeasured |= input.supply.is_none();
        if let Some(current) = input.current_raw {
            // Twice nominal times 2¹⁵ counts: 30 bits, and less than 2²⁵ ticks of that.
            let power = input.voltage.0.wrapping_mul(i32::from(current)).unsigned_abs();
            state.energy = state.energy.wrapping_add(u64::from(power));
        }
    }

    /// Which voltage, now.
    #[inline]
    fn request(&self, state: &State, input: &Input) -> Request {
        let magnitude = match state.phase {
            // With nothing at the terminals friction and input dead zone part; the load acts, and is taken off.
            Phase::Coast => return Request { bridge: Bridge::Driven, voltage: VoltageQ14(0) },
            Phase::Settle => 0,
            Phase::PulseTest | Phase::BreakAway | Phase::Learn | Phase::Saturate | Phase::Verify => {
                state.level
            }
            Phase::Idle | Phase::Decide | Phase::Done | Phase::Refused => return Request::default(),
        };
        Request { bridge: Bridge::Driven, voltage: VoltageQ14(magnitude * state.sign() + input.load.0) }
    }

    /// What happens next.
    #[inline]
    fn advance(&self, state: &mut State, input: &Input) {
        match state.phase {
            Phase::Settle | Phase::BreakAway if state.after_start.is_some() => self.start(state, input),
            Phase::Settle => self.settle(state, input),
            Phase::PulseTest => match &self.pulse_test {
                Some(pulse_test) => self.pulse_test(state, input, pulse_test),
                None => state.enter(Phase::BreakAway, input.count),
            },
            Phase::BreakAway => self.break_away(state, input),
            Phase::Learn => self.learn(state, input),
            Phase::Coast => self.coast(state, input),
            Phase::Saturate => self.saturate(state, input),
            Phase::Verify => self.verify(state, input),
            Phase::Decide => self.decide(state),
            Phase::Idle | Phase::Done | Phase::Refused => {}
        }
    }
}
