//! An axis that nobody drives and that stands: of a tick remain the supply, the count and the limits.
//!
//! Observer, models of motion, voltage balance and identifier all say the same in every such tick. They are set to rest once
//! and go on from there when the shaft moves or a command comes.

use super::command::STANDING_HZ;
use super::state::{Listener, Mode};
use super::{Axis, Sample, State};
use crate::encoder;
use crate::protect;
use crate::pwm::Drive;
use crate::record::Limit;
use crate::sample::Bridge;
use crate::units::Voltage;

impl Axis {
    /// Is there nothing to be done but to watch? `acting`: the drive from now to the next tick.
    #[inline]
    pub(super) fn is_idle(&self, state: &State, acting: Drive) -> bool {
        state.mode.is_idle()
            && acting.bridge == Bridge::Open
            && state.acted.is_none()
            && state.standstill.lasts(self.standing)
            && self.is_settled(state)
    }

    /// Has all that takes several ticks ended?
    #[inline]
    fn is_settled(&self, state: &State) -> bool {
        let heard = matches!(&state.listener, Listener::Passive(passive) if passive.is_done());
        heard && !state.ordered && state.search.is_none() && state.renewal == super::design::Stage::Done
    }

    /// One tick at rest. The bridge stays open, unless a fault wants the terminals tied together.
    #[inline]
    pub(super) fn rest(&self, state: &mut State, sample: &Sample, supply: Voltage) -> Bridge {
        if !state.idle || state.count != sample.count {
            self.come_to_rest(state, sample.count);
        }
        state.standstill.watch(sample.count);
        state.index = false;
        if self.protect.rest(&mut state.protect, sample.count) {
            self.look_at_rest(state, sample, supply);
        }
        if let Some(action) = state.protect.action() {
            self.answer(state, action);
        }
        if matches!(state.mode, Mode::Brake) { Bridge::Shorted } else { Bridge::Open }
    }

    /// The shaft stands here.
    #[cold]
    #[inline(never)]
    fn come_to_rest(&self, state: &mut State, count: i32) {
        state.idle = true;
        state.count = count;
        state.encoder = encoder::State::at_rest(count);
        state.protect.comes_to_rest(count);
        (state.limit, state.holding) = (Limit::None, false);
        if let Listener::Passive(passive) = &mut state.listener {
            passive.pause();
        }
    }

    /// It is driven again, or moved. The splines go on being sampled in ticks without a look.
    #[cold]
    #[inline(never)]
    pub(super) fn wake(&self, state: &mut State) {
        state.idle = false;
        if let Listener::Passive(passive) = &mut state.listener {
            passive.align(self.protect.ticks_behind_look(&state.protect));
        }
    }

    #[cold]
    #[inline]
    fn look_at_rest(&self, state: &mut State, sample: &Sample, supply: Voltage) {
        let input = protect::Input {
            count: sample.count,
            supply: (sample.vbus_raw != Sample::VBUS_NOT_MEASURED).then_some(supply),
            current: Sample::sensed(sample.current_raw),
            ..protect::Input::default()
        };
        self.protect.look_at_rest(&mut state.protect, &state.design.expectation, &input);
        if let Listener::Passive(passive) = &mut state.listener
            && self.passive.rest(passive, &mut state.known, self.protect.look_ticks())
        {
            state.learn();
        }
    }
}

/// Ticks without motion after which a shaft stands.
#[inline]
pub(super) fn standing(tick_hz: u32) -> u32 {
    tick_hz / STANDING_HZ
}
