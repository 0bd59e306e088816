//! What a session is to do, and what came of it.

use crate::device::motion_profile::Profile;
use servo::commission::Outcome;
use servo::compensate::modelled::Modelled;
use servo::compensate::position_load::PositionLoad;
use servo::identify::estimate::{Estimates, EstimatesReport};
use servo::link::capture::{Extent, Shot, Stage, Trigger};
use servo::motion::excitation::Waveform;
use servo::motion::referencing::Referencing;

/// One thing to do.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Excite and identify.
    Commission {
        /// Length, s.
        budget_s: f64,
        /// Orders the excitation.
        seed: u32,
    },
    /// Use what an earlier commissioning has found.
    Adopt(Box<Estimates>),
    /// Hold the load over the place with this table.
    PositionLoad(PositionLoad),
    /// Feed forward what a model tells.
    Modelled(Modelled),
    /// Arm a capture when the next motion begins; what it holds is read out behind it.
    Capture {
        /// What to wait for.
        trigger: Trigger,
        /// Ticks to keep from before it.
        before: u16,
    },
    /// Find out where zero is.
    Reference(Referencing),
    /// Store what is in force, so that it survives a power cut.
    Store,
    /// Go there, and hold.
    Move(Target),
    /// If the next profile takes more voltage than is left, scale it so that it fits.
    Fit,
    /// Follow a profile, then hold.
    Track {
        /// What to follow.
        profile: Profile,
        /// With the inverse dead zone or without.
        compensation: bool,
    },
    /// Apply a sine or a chirp of voltage; no loop is closed, nothing need be known.
    Excite(Waveform),
}

/// Where to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Absolute, rad from the reference's zero.
    To(f32),
    /// rad from where the axis is.
    By(f32),
}

/// How a move ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arrival {
    /// From the command to the first standstill at the target, s.
    pub seconds: f64,
    /// Position minus target at the end, rad.
    pub error_rad: f32,
    /// The axis held its target to the end, without a fault.
    pub held: bool,
}

/// What a [`Task`] gave.
#[derive(Clone, Debug, PartialEq)]
pub enum Done {
    /// End of a commissioning.
    Commissioned(Box<Outcome>),
    /// Estimates or a table are in use.
    Adopted,
    /// Positions are absolute; where zero's mark was found, counts from power-up.
    Referenced(i64),
    /// Parameters are stored.
    Stored,
    /// A capture is armed.
    Armed,
    /// The next profile will be scaled if need be.
    Fits,
    /// The axis is there, or is not.
    Moved(Arrival),
    /// Ticks of a motion.
    Tracked(Span),
    /// Ticks of an excitation, and what the servo knows behind it.
    Excited(Span, Box<EstimatesReport>),
}

/// What a capture holds.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Captured {
    /// Where the capture stood when it was read.
    pub stage: Stage,
    /// How long it is and where the trigger fired.
    pub extent: Extent,
    /// Oldest first; the trigger's tick among them.
    pub shots: Vec<Shot>,
}

/// Ticks of a motion, since power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Span {
    /// The profile begins.
    pub start: u32,
    /// The profile ends and the hold begins.
    pub hold: u32,
    /// The hold ends.
    pub end: u32,
    /// A fault has ended it early.
    pub faulted: bool,
}
