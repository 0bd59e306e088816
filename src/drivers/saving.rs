//! A save on its way from the command to the flash and back.
//!
//! ```text
//! control interrupt   Save → one Job::Axis a tick … Job::Write ─┐        ┌→ Saved, Failed: told, over
//! idle                                                          └→ flash ┤
//! control interrupt   Job::Erase ← 25 ms ← Erasing is told ←─────────────┘ EraseNeeded
//! ```
//!
//! The control interrupt owns the parameters, idle owns the flash, and two queues lie between them. A single-bank flash
//! stalls the processor while it programs or erases, the control tick included, so all this happens with the bridges
//! open, and the announcement of an erase has left the line before the erase begins.

use crate::drivers::flash::ParameterFlash;
use crate::store::{AtRest, AxisParameters, Found, SaveError, StoreEvent, StoredParameters};
use embedded_storage::nor_flash::NorFlash;

/// Time between the announcement of an erase and the erase: a full transmit queue of 1,024 bytes takes 11 ms at
/// 921,600 baud.
const NOTICE_HZ: u32 = 40;
/// What an erase is announced to take at most: 128 KiB by words at 2.7 to 3.6 V (DS8626, flash memory characteristics:
/// 2 s), and the save behind it.
const LONGEST_ERASE_MS: u32 = 2_200;

/// From the control interrupt to idle.
#[derive(Clone, Copy, Debug)]
#[allow(clippy::large_enum_variant, reason = "there is no heap to box it on")]
pub enum Job {
    /// The next axis of the set, in their order.
    Axis(Option<AxisParameters>),
    /// The set is complete: store it.
    Write(AtRest),
    /// The erase is announced: do it, then store the set.
    Erase(AtRest),
}

/// From idle to the control interrupt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Report {
    /// Done.
    Saved,
    /// Nothing was touched: a sector must be erased first.
    EraseNeeded,
    /// Not done.
    Failed(SaveError),
}

/// The control interrupt's side.
#[derive(Clone, Copy, Debug, Default)]
pub struct Saving {
    stage: Stage,
}

#[derive(Clone, Copy, Debug, Default)]
enum Stage {
    #[default]
    Over,
    /// The next axis to hand over.
    Collecting(u8, AtRest),
    /// Idle is at work.
    Waiting(AtRest),
    /// Ticks until the erase.
    Announced(u32, AtRest),
}

/// What the control interrupt does in this tick.
#[derive(Clone, Copy, Debug)]
pub enum Step {
    /// Nothing.
    Rest,
    /// Hand over the parameters of this axis.
    HandOver(u8),
    /// Hand over [`Job::Write`].
    Write(AtRest),
    /// Hand over [`Job::Erase`].
    Erase(AtRest),
    /// Tell the host.
    Tell(StoreEvent),
}

impl Saving {
    /// Starts. The bridges must stay open until it is over.
    pub fn begin(&mut self, rest: AtRest) {
        self.stage = Stage::Collecting(0, rest);
    }

    /// Is one under way?
    #[must_use]
    pub fn is_active(&self) -> bool {
        !matches!(self.stage, Stage::Over)
    }

    /// One tick. `axes`: how many there are.
    pub fn step(&mut self, axes: u8, tick_hz: u32, report: Option<Report>) -> Step {
        let (stage, step) = match (self.stage, report) {
            (Stage::Collecting(axis, rest), _) if axis < axes => {
                (Stage::Collecting(axis + 1, rest), Step::HandOver(axis))
            }
            (Stage::Collecting(_, rest), _) => (Stage::Waiting(rest), Step::Write(rest)),
            (Stage::Waiting(rest), Some(Report::EraseNeeded)) => (
                Stage::Announced(tick_hz / NOTICE_HZ, rest),
                Step::Tell(StoreEvent::Erasing { longest_ms: LONGEST_ERASE_MS }),
            ),
            (Stage::Waiting(_), Some(Report::Saved)) => (Stage::Over, Step::Tell(StoreEvent::Saved)),
            (Stage::Waiting(_), Some(Report::Failed(error))) => {
                (Stage::Over, Step::Tell(StoreEvent::Failed(error)))
            }
            (Stage::Announced(0, rest), _) => (Stage::Waiting(rest), Step::Erase(rest)),
            (Stage::Announced(left, rest), _) => (Stage::Announced(left - 1, rest), Step::Rest),
            (stage @ (Stage::Waiting(_) | Stage::Over), _) => (stage, Step::Rest),
        };
        self.stage = stage;
        step
    }
}

/// Idle's side: the flash, and the set of `AXES` axes that is being collected for it.
pub struct Archive<F, const AXES: usize> {
    flash: ParameterFlash<F>,
    set: StoredParameters<AXES>,
}

impl<F: NorFlash, const AXES: usize> Archive<F, AXES> {
    /// Nothing loaded yet.
    pub fn new(flash: ParameterFlash<F>) -> Self {
        Archive { flash, set: StoredParameters::default() }
    }

    /// Reads the store, at power-up. The set lies where the next one is collected: [`Archive::forget`] it after use.
    pub fn load(&mut self) -> Found {
        self.flash.load_into(&mut self.set)
    }

    /// What was loaded; empty if there was no set.
    pub fn set(&self) -> &StoredParameters<AXES> {
        &self.set
    }

    /// Makes room for the next save.
    pub fn forget(&mut self) {
        self.set.axes.clear();
    }

    /// Does a job; [`Job::Write`] and [`Job::Erase`] stall a single-bank flash and end with a report.
    #[inline(never)]
    pub fn handle(&mut self, job: &Job) -> Option<Report> {
        match job {
            Job::Axis(parameters) => {
                self.collect(parameters);
                None
            }
            Job::Write(rest) => Some(self.write(*rest)),
            Job::Erase(rest) => Some(match self.flash.erase(*rest) {
                Ok(()) => self.write(*rest),
                Err(error) => self.end(Report::Failed(error)),
            }),
        }
    }

    #[inline(never)]
    fn collect(&mut self, parameters: &Option<AxisParameters>) {
        // No more axes than places: an image cannot have more than a set holds.
        let _ = self
            .set
            .axes
            .push(parameters.map(|axis| AxisParameters { estimates: axis.estimates.to_store(), ..axis }));
    }

    #[inline(never)]
    fn write(&mut self, rest: AtRest) -> Report {
        match self.flash.save(&self.set, rest) {
            Ok(()) => self.end(Report::Saved),
            // The set is kept for the save behind the erase.
            Err(SaveError::EraseNeeded) => Report::EraseNeeded,
            Err(error) => self.end(Report::Failed(error)),
        }
    }

    fn end(&mut self, report: Report) -> Report {
        self.forget();
        report
    }
}
