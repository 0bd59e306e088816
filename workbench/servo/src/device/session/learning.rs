//! Tasks from which the servo knows more: commissioning, estimates of an earlier one, a reference; and storing it.

use super::kept::Kept;
use super::{DRIVEN, Done, Listener, PAUSE_S, Performed, Session};
use crate::device::link::{Client, found_text};
use servo::identify::estimate::Estimates;
use servo::link::protocol::Command;
use servo::motion::referencing::Referencing;
use servo::record::Referenced;
use servo::store::AxisParameters;
use truing_core::text::input_error::InputError;

/// No search for a reference takes longer, s.
const LONGEST_SEARCH_S: f64 = 600.0;
/// So long, s, friction is given to end a motion, then a brake, then the loops.
const LONGEST_COAST_S: f64 = 2.0;
/// A commissioning that takes longer than its budget by this factor and this time has hung.
const OVERTIME: (f64, f64) = (2.0, 10.0);

impl Session {
    pub(super) fn commission(&mut self, budget_s: f64, seed: u32, progress: &mut Listener) -> Performed {
        self.command(Command::Arm)?;
        let still = self.standstill().min(self.kept.borrow().log.rows.len());
        if self.config().travel_limit_rad.is_none() && !self.kept.borrow().stands(still) {
            // A shaft that turns on from before would go the same way under both voltages.
            self.catch(false, progress)?;
            self.command(Command::Arm)?;
        }
        let budget_ms = (budget_s * 1000.0).round() as u32;
        self.kept.get_mut().ended = None;
        let start = self.command(Command::Commission { budget_ms, seed })?;
        let limit = start + self.ticks(OVERTIME.0 * budget_s + OVERTIME.1);
        self.run_to(limit, |kept| kept.ended.is_some(), "commissioning", progress)?;
        let hangs = || InputError("the commissioning does not end; update the firmware".into());
        let outcome = self.kept.get_mut().ended.take().ok_or_else(hangs)?;
        self.pause(PAUSE_S)?;
        Ok(Done::Commissioned(Box::new(outcome)))
    }

    pub(super) fn adopt(&mut self, estimates: &Estimates) -> Performed {
        self.command(Command::Adopt(*estimates))?;
        self.kept.get_mut().known = *estimates;
        Ok(Done::Adopted)
    }

    pub(super) fn reference(&mut self, how: Referencing, progress: &mut Listener) -> Performed {
        self.command(Command::Arm)?;
        let start = self.command(Command::Reference(how))?;
        let state = |kept: &Kept| {
            let last = kept.log.rows.last().filter(|row| row.tick > start);
            last.map_or(Referenced::Searching, |row| row.record.referenced)
        };
        let end = start + self.ticks(LONGEST_SEARCH_S);
        let over = |kept: &Kept| state(kept) != Referenced::Searching;
        self.run_to(end, over, "referencing", progress)?;
        let (found, place) = {
            let kept = self.kept.borrow();
            // The axis holds the place that it has found: the middle of a count.
            let place = kept.log.rows.last().map_or(0.0, |row| kept.log.reference(&row.record));
            (state(&kept), place.floor() as i64)
        };
        self.command(Command::Stop)?;
        match found {
            Referenced::Yes => Ok(Done::Referenced(place)),
            _ => Err(InputError(
                "no reference was found: start away from the stop, give a longer way, and check encoder and index".into(),
            )),
        }
    }

    /// An open bridge lets the shaft coast; only when it stands may the flash be written. What has hardly any friction is
    /// caught.
    pub(super) fn store(&mut self, progress: &mut Listener) -> Performed {
        if !self.coast(self.standstill(), 1, progress)? {
            self.catch(true, progress)?;
        }
        let saved = self.client.save(&mut |message| self.kept.borrow_mut().take(message));
        let driven = !self.kept.borrow().stands_within(self.standstill(), 0);
        saved.map_err(|error| if driven { InputError(format!("{error}; {DRIVEN}")) } else { error })?;
        Ok(Done::Stored)
    }

    /// Brakes a shaft that turns, and opens the bridge. What a load drives on slowly may be held by loops that know their motor: it
    /// stands then, and not much later. How long that took, s.
    pub fn catch(&mut self, holds: bool, progress: &mut Listener) -> Result<f64, InputError> {
        let begun = self.command(Command::Arm)?;
        // No voltage at a driven bridge is a shorted winding and needs no loop. Between end stops only the loops may drive.
        self.command(match self.config().travel_limit_rad {
            None => Command::Voltage(0.0),
            Some(_) => Command::Position(self.here()),
        })?;
        self.coast(self.standstill(), 1, progress)?;
        // The servo stores only if no count at all has passed for a while.
        if holds && self.command(Command::Position(self.here())).is_ok() {
            self.coast(2 * self.standstill(), 0, progress)?;
        }
        Ok(f64::from(self.command(Command::Stop)? - begun) / f64::from(self.config().tick_hz))
    }

    /// Waits until the shaft has stood for so many records within so many counts; does it?
    fn coast(&mut self, still: usize, counts: i32, progress: &mut Listener) -> Result<bool, InputError> {
        let end = self.kept.borrow().now() + self.ticks(LONGEST_COAST_S);
        self.run_to(end, |kept| kept.stands_within(still, counts), "coming to rest", progress)?;
        Ok(self.kept.borrow().stands_within(still, counts))
    }
}

/// What the servo has stored.
pub(super) fn stored(client: &mut Client) -> Result<AxisParameters, InputError> {
    let parameters = client.parameters()?;
    let found = found_text(client.hello()?.stored);
    let what =
        format!("this axis has no parameters to go on with ({found}); run `truing commission --store` first");
    parameters.ok_or(InputError(what))
}
