//! The command that finds zero: here, at an end stop, or at the index pulse.

use super::command::STANDING_HZ;
use super::{Axis, Mode, Refusal, State};
use crate::motion::referencing::{Mark, Referencing, Search};
use crate::motion::trajectory::Cruise;
use crate::record::Source;
use crate::units::{SPEED_BITS, Speed, Voltage, to_fixed};

/// Counts per tick at which an index pulse of one count is still seen by looking once a tick.
const FASTEST_INDEX: f32 = 0.9;

impl Axis {
    pub(super) fn reference(&self, state: &mut State, how: &Referencing) -> Result<(), Refusal> {
        match *how {
            Referencing::Here { position_rad } => self.reference_here(state, position_rad),
            Referencing::EndStop { speed_rad_s, position_rad, reach_rad, current_a } => {
                let raw = |limit: f32| (limit / self.scale.config.current_a_per_lsb) as u16;
                let mark = Mark::EndStop { current: current_a.map(raw) };
                self.seek(state, mark, speed_rad_s, position_rad, reach_rad)
            }
            Referencing::Index { speed_rad_s, position_rad, reach_rad } => {
                self.seek(state, Mark::Index, speed_rad_s, position_rad, reach_rad)
            }
        }
    }

    /// The set-point of a motion under way would jump: refused then.
    fn reference_here(&self, state: &mut State, rad: f32) -> Result<(), Refusal> {
        let rests = matches!(state.mode, Mode::Idle | Mode::Hold(_));
        let counts = self.counts(rad)?;
        if !rests {
            return Err(Refusal::Busy);
        }
        state.search_ends(Some(state.count.wrapping_sub(counts)));
        Ok(())
    }

    /// Cruises until the mark is found. Travel limits are not known yet; `reach` stands for them.
    fn seek(
        &self,
        state: &mut State,
        mark: Mark,
        speed_rad_s: f32,
        position_rad: f32,
        reach_rad: f32,
    ) -> Result<(), Refusal> {
        self.ready(state)?;
        let speed = speed_rad_s * self.scale.counts_per_tick();
        let limits = &state.design.limits.with_supply(self.pwm.ceiling(&state.pwm));
        let slow = match mark {
            Mark::Index => FASTEST_INDEX,
            Mark::EndStop { .. } => f32::MAX,
        };
        let fits =
            speed.abs() <= limits.speed.min(limits.voltage).min(slow) && speed != 0.0 && reach_rad > 0.0;
        let speed = fits
            .then(|| Speed(to_fixed(speed, SPEED_BITS)))
            .filter(|speed| speed.0 != 0)
            .ok_or(Refusal::OutOfRange)?;
        let search = Search {
            mark,
            direction: speed.0.signum(),
            start: state.count,
            reach: self.counts(reach_rad)?,
            position: self.counts(position_rad)?,
            push: self.push(state, speed),
            patience: self.patience(state, speed),
            farthest: state.count,
            still: 0,
        };
        let start = state.present();
        state.begin(&start);
        state.mode = Mode::Cruise(Cruise::plan(&start, speed, limits));
        state.search = Some(search);
        state.missed = false;
        Ok(())
    }

    /// Twice what the speed takes and a sixteenth of the nominal supply; a fifth where nothing compensates the dead zone.
    fn push(&self, state: &State, speed: Speed) -> Voltage {
        let steady = Voltage(state.design.loops.steady_voltage(speed).0.saturating_abs());
        let compensated = state.compensation && state.design.dead_zone_source != [Source::None; 2];
        let margin = if compensated { 16 } else { 5 };
        steady.plus(steady).plus(Voltage(Voltage::NOMINAL.0 / margin))
    }

    /// A time constant, 50 ms, and the time of eight counts, whichever is longest.
    fn patience(&self, state: &State, speed: Speed) -> u32 {
        let counts = 8.0 * (1u32 << SPEED_BITS) as f32 / speed.0.unsigned_abs() as f32;
        let tau = state.design.motor.tau_ticks;
        let least = (self.scale.config.tick_hz / STANDING_HZ) as f32;
        tau.max(least).max(counts) as u32
    }
}
