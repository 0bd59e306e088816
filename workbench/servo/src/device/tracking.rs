//! `truing-track/1`: how well a motion followed its set-point.

use crate::device::commission_report::{Number, numbers};
use crate::device::feasible::Fitted;
use crate::device::run_log::{Row, RunLog};
use crate::device::session::Span;
use serde::Serialize;
use servo::identify::estimate::EstimatesReport;
use servo::record::{Limit, Source};

/// Where the numbers came from that the loops used.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct UsedParameters {
    /// Gain and time constant: `none`, `configured`, `last_trusted`, `trusted`, `stored`.
    pub gain: Source,
    /// Dead zone, positive.
    pub dead_zone_pos: Source,
    /// Dead zone, negative.
    pub dead_zone_neg: Source,
    /// Was the inverse dead zone in use?
    pub compensation: bool,
}

/// The figures of one motion.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TrackJson {
    /// `truing-track/1`.
    pub schema: &'static str,
    /// Set-point minus measured position, root mean square, rad.
    pub position_rms_rad: f64,
    /// Set-point minus measured position, largest magnitude, rad.
    pub position_peak_rad: f64,
    /// Set-point's speed minus the firmware's speed estimate, root mean square, rad/s.
    pub speed_rms_rad_s: f64,
    /// Set-point's speed minus the firmware's speed estimate, largest magnitude, rad/s.
    pub speed_peak_rad_s: f64,
    /// Share of the time in which a limit acted.
    pub saturated_share: f64,
    /// Changes of the duty's sign per second while holding.
    pub hold_chatter_per_s: f64,
    /// Which parameters the loops used.
    pub used_parameters: UsedParameters,
    /// A fault ended the motion early.
    pub faulted: bool,
    /// How the motion was scaled, if it was for `--fit`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fitted: Option<Fitted>,
    /// What the servo knew behind an excitation. It has no set-point, so that the errors above are `null`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub learned: Option<Learned>,
}

numbers! {
    /// What ordinary motion tells.
    Learned:
    /// V.
    dead_zone_pos_v, "dead zone, positive", "V";
    /// V, positive magnitude.
    dead_zone_neg_v, "dead zone, negative", "V";
    /// rad/s/V.
    gain_rad_s_per_v, "gain", "rad/s/V";
    /// s.
    time_constant_s, "time constant", "s";
}

impl TrackJson {
    /// Computes the figures from the log.
    pub fn new(log: &RunLog, span: &Span) -> Self {
        let moving = || log.rows.iter().filter(|row| (span.start..span.hold).contains(&row.tick));
        let (position_rms_rad, position_peak_rad) = norms(moving().map(|row| position_error(log, row)));
        let (speed_rms_rad_s, speed_peak_rad_s) = norms(
            moving()
                .map(|row| log.rad_s(row.record.reference_speed_q20.saturating_sub(row.record.speed_q20))),
        );
        let limited = moving().filter(|row| row.record.limit != Limit::None).count();
        TrackJson {
            schema: "truing-track/1",
            position_rms_rad,
            position_peak_rad,
            speed_rms_rad_s,
            speed_peak_rad_s,
            saturated_share: limited as f64 / moving().count().max(1) as f64,
            hold_chatter_per_s: chatter(log, span),
            used_parameters: used(moving().next_back()),
            faulted: span.faulted,
            fitted: None,
            learned: None,
        }
    }

    /// Of an excitation.
    pub fn excited(log: &RunLog, span: &Span, learned: &EstimatesReport) -> Self {
        TrackJson {
            // Not a number is `null` in JSON.
            position_rms_rad: f64::NAN,
            position_peak_rad: f64::NAN,
            speed_rms_rad_s: f64::NAN,
            speed_peak_rad_s: f64::NAN,
            learned: Some(learned.into()),
            ..TrackJson::new(log, span)
        }
    }
}

/// rad. A counter that reads n stands for n + ½ counts.
pub fn position_error(log: &RunLog, row: &Row) -> f64 {
    log.rad(f64::from(row.record.ahead_q8(log.zero())) / 256.0 - 0.5)
}

fn norms(errors: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut squares, mut peak, mut count) = (0.0, 0.0f64, 0);
    for error in errors {
        squares += error * error;
        peak = peak.max(error.abs());
        count += 1;
    }
    ((squares / f64::from(count.max(1))).sqrt(), peak)
}

fn chatter(log: &RunLog, span: &Span) -> f64 {
    let holding = log.rows.iter().filter(|row| (span.hold..span.end).contains(&row.tick));
    let signs = holding.map(|row| row.record.command_duty.signum()).filter(|sign| *sign != 0);
    let (mut changes, mut last) = (0u32, 0);
    for sign in signs {
        changes += u32::from(last != 0 && sign != last);
        last = sign;
    }
    let seconds = f64::from(span.end.saturating_sub(span.hold)) / f64::from(log.config.tick_hz);
    if seconds > 0.0 { f64::from(changes) / seconds } else { 0.0 }
}

fn used(row: Option<&Row>) -> UsedParameters {
    let record = row.map(|row| row.record).unwrap_or_default();
    UsedParameters {
        gain: record.gain_source,
        dead_zone_pos: record.dead_zone_source[0],
        dead_zone_neg: record.dead_zone_source[1],
        compensation: record.compensation,
    }
}
