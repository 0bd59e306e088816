//! Commissioning: the state machine that excites the motor, lets the identifier learn, verifies, and decides on trust.

use crate::axis::Bridge;
use crate::config::Scale;
use crate::identify::estimate::{Estimates, EstimatesReport, Reason};
use serde::{Deserialize, Serialize};

/// What the axis hands over in every tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Input {
    /// Encoder counter at the start of this tick, wraps.
    pub count: i32,
    /// Mean terminal voltage that acts from now to the next sample, Q14 of nominal supply: the duty in force
    /// (after delay, clip and quantisation) times the measured supply. 0 unless the bridge is driven.
    pub voltage: i32,
    /// State of the bridge from now to the next sample.
    pub bridge: Bridge,
    /// Measured supply, Q14 of nominal supply (nominal when it is not measured).
    pub supply: i32,
    /// Winding current in converter counts; `None` when it is not sensed.
    pub current_raw: Option<i16>,
}

/// What the commissioning wants the bridge to do. The axis divides by the measured supply and clips.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// State of the bridge.
    pub bridge: Bridge,
    /// Terminal voltage, Q14 of nominal supply.
    pub voltage: i32,
}

/// Where the commissioning stands.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[repr(u8)]
pub enum Phase {
    /// Not started.
    #[default]
    Idle,
    /// Waits for standstill.
    Settle,
    /// Raises the voltage until the motor moves, once a direction.
    BreakAway,
    /// Drives high, low, middle voltage and learns the linear part.
    Learn,
    /// Shorts the terminals while moving: friction or input dead zone.
    Coast,
    /// Drives full voltage and learns the saturation level.
    Saturate,
    /// Drives half voltage and compares with what was learned.
    Verify,
    /// Solves and decides.
    Decide,
    /// Finished with estimates.
    Done,
    /// Ended without estimates.
    Refused,
}

/// How a commissioning ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Outcome {
    /// What is known, with trust and reasons.
    pub estimates: Estimates,
    /// Why nothing was accepted.
    pub refused: Option<Reason>,
    /// Control ticks used.
    pub duration_ticks: u32,
    /// Counts travelled, up and down added.
    pub travel_counts: u32,
}

/// [`Outcome`] in SI units, as `truing-commission/1` prints it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct CommissionReport {
    /// What is known.
    pub estimates: EstimatesReport,
    /// Why nothing was accepted.
    pub refused: Option<Reason>,
    /// Length, s.
    pub duration_s: f32,
    /// Path, turns of the controlled shaft, up and down added.
    pub travel_rev: f32,
}

impl Outcome {
    /// In SI units; not for the control tick.
    pub fn report(&self, scale: &Scale) -> CommissionReport {
        CommissionReport {
            estimates: self.estimates.report(scale),
            refused: self.refused,
            duration_s: self.duration_ticks as f32 / scale.config.tick_hz as f32,
            travel_rev: self.travel_counts as f32 / scale.config.counts_per_rev as f32,
        }
    }
}
