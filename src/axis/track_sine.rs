//! The command that tracks a sine. All but where it swings and what the motor can do follows from the units of the axis: that is
//! computed ahead of the control tick by whoever takes orders, or in the tick where nobody has.

use super::answer::Refusal;
use super::{Axis, Mode, State, design};
use crate::config::Scale;
use crate::motion::sine::Shape;
use crate::units::{SPEED_BITS, Voltage, ticks_in};

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Asked {
    pub amplitude_rad: f32,
    pub frequency_hz: f32,
    pub duration_ms: u32,
}

/// What turns radians and seconds into the counts and ticks of an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Units {
    counts_per_rad: f32,
    tick_hz: u32,
}

/// A sine that was computed ahead for an axis with these units. With others it is computed anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ahead {
    units: Units,
    asked: Asked,
    shape: Shape,
}

impl Units {
    /// Of this axis.
    #[must_use]
    pub fn of(scale: &Scale) -> Self {
        Self { counts_per_rad: scale.counts_per_rad(), tick_hz: scale.config.tick_hz }
    }

    #[cold]
    #[inline(never)]
    fn shape(&self, asked: &Asked) -> Shape {
        let ticks = ticks_in(asked.duration_ms, self.tick_hz);
        let amplitude = asked.amplitude_rad * self.counts_per_rad;
        Shape::new(amplitude, asked.frequency_hz / self.tick_hz as f32, ticks)
    }
}

impl Ahead {
    pub(super) fn new(units: &Units, asked: Asked) -> Self {
        Self { units: *units, asked, shape: units.shape(&asked) }
    }
}

impl Axis {
    #[cold]
    #[inline(never)]
    pub(super) fn track_sine(&self, state: &mut State, asked: &Asked) -> Result<(), Refusal> {
        self.swing(state, &Units::of(&self.scale).shape(asked))
    }

    pub(super) fn sine(&self, state: &mut State, ahead: &Ahead) -> Result<(), Refusal> {
        if ahead.units == Units::of(&self.scale) {
            self.swing(state, &ahead.shape)
        } else {
            self.track_sine(state, &ahead.asked)
        }
    }

    /// Where it swings, and whether it may.
    #[inline(never)]
    fn swing(&self, state: &mut State, shape: &Shape) -> Result<(), Refusal> {
        self.ready(state)?;
        let start = state.resting_place().ok_or(Refusal::Busy)?;
        self.within_travel(state, start.position.count(), shape.swing)?;
        let kept = shape.keeps(&state.design.limits);
        let sine = shape.around(start.position).filter(|_| kept).ok_or(Refusal::OutOfRange)?;
        self.sustained(state, shape)?;
        state.begin(&start);
        state.mode = Mode::Sine(sine);
        Ok(())
    }

    /// Are there speed and voltage enough for it?
    fn sustained(&self, state: &State, shape: &Shape) -> Result<(), Refusal> {
        let design = &state.design;
        let fastest = design.speed_limit.0 as f32 / (1u32 << SPEED_BITS) as f32;
        if shape.speed > fastest {
            let rad_s = 1.0 / self.scale.counts_per_tick();
            return Err(Refusal::BeyondSpeed {
                needed_rad_s: shape.speed * rad_s,
                available_rad_s: fastest * rad_s,
            });
        }
        let motor = design.ablest_motor();
        let nominal = self.scale.config.supply_nominal_v;
        let needed_v = shape.takes(motor.tau_ticks) / motor.full_speed * nominal;
        let left = design.voltage_left(self.ceiling(state));
        let available_v = left.0 as f32 / Voltage::NOMINAL.0 as f32 * nominal;
        if needed_v > design::FEASIBLE * available_v {
            return Err(Refusal::BeyondVoltage { needed_v, available_v });
        }
        Ok(())
    }

    /// Highest voltage at the terminals: the limit or the measured supply, the nominal one before the first sample.
    fn ceiling(&self, state: &State) -> Voltage {
        let supply = Some(self.pwm.ceiling(&state.pwm)).filter(|supply| *supply != Voltage::ZERO);
        supply.unwrap_or(Voltage::NOMINAL).min(self.most_voltage)
    }
}
