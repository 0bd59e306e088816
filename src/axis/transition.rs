//! From one mode into another without a jump of the set-point or the voltage.

use super::{Mode, State};
use crate::control::Reference;
use crate::record::Source;
use crate::units::{Acceleration, Position, SPEED_BITS, Voltage};

impl State {
    /// Slower than this the shaft counts as resting, counts per tick, Q20: a count in 256 ticks.
    const RESTING: i32 = 1 << (SPEED_BITS - 8);

    /// Where the set-point is now; where the shaft is, when no loop is closed.
    pub(crate) fn present(&self) -> Reference {
        match self.mode {
            Mode::Hold(position) => Reference::rest(position),
            Mode::Sine(_) | Mode::Move(_) | Mode::Cruise(_) | Mode::Stream(_) | Mode::Halt(_) => {
                self.reference
            }
            Mode::Idle | Mode::Commission(_) | Mode::Drive(_) | Mode::Excite(_) | Mode::Brake => self.shaft(),
        }
    }

    /// Where a motion that begins at rest begins: the set-point, or the shaft when no loop is closed. `None`: the
    /// set-point moves.
    pub(super) fn resting_place(&self) -> Option<Reference> {
        match self.mode {
            Mode::Idle | Mode::Commission(_) | Mode::Drive(_) | Mode::Excite(_) | Mode::Brake => {
                Some(Reference::rest(Position::of_count(self.count)))
            }
            _ => Some(self.present()).filter(Reference::rests),
        }
    }

    /// Can the loops hold a position: are they closed, or could they be?
    pub(crate) fn closed(&self) -> bool {
        let driven = !matches!(self.mode, Mode::Idle | Mode::Commission(_) | Mode::Brake);
        driven && self.design.gain_source != Source::None
    }

    fn shaft(&self) -> Reference {
        let speed = self.encoder.speed();
        if speed.0.saturating_abs() < Self::RESTING {
            return Reference::rest(Position::of_count(self.count));
        }
        Reference { position: self.encoder.position(), speed, acceleration: Acceleration(0) }
    }

    /// Another mode can begin here without a jump of the voltage. The caller sets it: a mode is hundreds of bytes, and one that
    /// is made in its place is not copied.
    pub(crate) fn begin(&mut self, start: &Reference) {
        // Another motion ends a search without a result.
        self.missed |= self.search.take().is_some();
        self.dry = false;
        match self.mode {
            Mode::Idle | Mode::Excite(_) => {
                self.control.begin();
                self.voltage = Voltage::ZERO;
            }
            Mode::Drive(_) => {
                self.control.preset(self.voltage.minus(self.design.loops.steady_voltage(start.speed)))
            }
            _ => {}
        }
    }
}
