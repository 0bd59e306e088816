//! What the log tells about a fault beyond its name: did the shaft follow before, does it go on, is the current sensor right?

use super::link::{fault_advice, named};
use super::run_log::{Row, RunLog};
use servo::axis::{Bridge, Sample};
use servo::protect::Fault;

/// Speeds are taken over so long, s.
const SPEED_S: f64 = 0.02;
/// Counts that a shaft has followed by, at least, if its wiring was right; share of a turn beside that.
const FOLLOWED_COUNTS: i64 = 64;
const FOLLOWED_SHARE: i64 = 64;
/// Converter counts that a sensor reads which reads nothing.
const NO_CURRENT: i16 = 2;

/// What the fault that ended the last motion means, and what to do.
pub fn fault_text(log: &RunLog) -> String {
    let Some((before, after)) = log.ended() else { return fault_advice(Fault::None) };
    let fault = log.fault();
    let text = cause(log, before, fault).map_or_else(|| fault_advice(fault), |text| named(text, fault));
    match speeds_up(log, before, after) {
        Some([from, to]) => format!(
            "{text}; the bridge is open and the shaft still speeds up, from {from:.0} to {to:.0} rad/s: switch the \
             motor's supply off, and look for a shorted transistor of the bridge or a load that drives the shaft"
        ),
        None => text,
    }
}

/// What the rows before the fault say more.
fn cause(log: &RunLog, before: &[Row], fault: Fault) -> Option<&'static str> {
    let follows =
        followed(before) > FOLLOWED_COUNTS.max(i64::from(log.config.counts_per_rev) / FOLLOWED_SHARE);
    let doubtful =
        [Fault::WrongDirection, Fault::SlippingCounts, Fault::EncoderUnplugged, Fault::MotorDisconnected];
    match fault {
        _ if doubtful.contains(&fault) && reads_backwards(before) => Some(
            "the current reads backwards, against the voltage: check wiring and sign of the current sensor",
        ),
        _ if doubtful.contains(&fault) && follows && reads_nothing(before) => {
            Some("no current is read although the shaft follows the voltage: check the current sensor")
        }
        Fault::WrongDirection if follows => Some(
            "the count runs against the voltage, which it followed before: look for a shorted transistor of the bridge, a load that drives the shaft, or an encoder that slips or lacks a channel",
        ),
        _ => None,
    }
}

/// Counts in the direction of the voltage, less those against it.
fn followed(rows: &[Row]) -> i64 {
    let moved = |pair: &[Row]| pair[1].record.count.wrapping_sub(pair[0].record.count);
    rows.windows(2).map(|pair| i64::from(moved(pair)) * i64::from(pair[0].record.duty.signum())).sum()
}

/// Currents that were read while the bridge drove, with the duty.
fn currents(rows: &[Row]) -> impl Iterator<Item = (i16, i16)> {
    let driven = rows.iter().map(|row| row.record).filter(|record| record.bridge == Bridge::Driven);
    driven.filter_map(|record| Some((record.duty, Sample::sensed(record.current_raw)?)))
}

/// A motor takes power on the whole.
fn reads_backwards(rows: &[Row]) -> bool {
    let powers = || currents(rows).map(|(duty, current)| i64::from(duty) * i64::from(current));
    let (sum, whole) = (powers().sum::<i64>(), powers().map(i64::abs).sum::<i64>());
    whole > 0 && sum < -whole / 2
}

fn reads_nothing(rows: &[Row]) -> bool {
    currents(rows).next().is_some() && currents(rows).all(|(_, current)| current.abs() <= NO_CURRENT)
}

/// Speed at the fault and at the end of the log, if it grew although the bridge is open.
fn speeds_up(log: &RunLog, before: &[Row], after: &[Row]) -> Option<[f64; 2]> {
    let at_end = |rows: &[Row]| {
        let last = rows.last()?;
        let ticks = |row: &Row| last.tick.wrapping_sub(row.tick);
        let tick_s = 1.0 / f64::from(log.config.tick_hz);
        let first = rows.iter().rev().find(|row| f64::from(ticks(row)) * tick_s >= SPEED_S)?;
        let counts = f64::from(last.record.count.wrapping_sub(first.record.count));
        Some(log.rad(counts).abs() / (f64::from(ticks(first)) * tick_s))
    };
    let [from, to] = [at_end(before)?, at_end(after)?];
    let open = after.last()?.record.bridge == Bridge::Open;
    (open && to > 1.1 * from + 0.02 * f64::from(log.config.rated_speed_rad_s)).then_some([from, to])
}
