//! Watches every record that arrives for the limits of a recording.

use super::{Plan, Scale};
use servo::axis::{Bridge, Sample};
use servo::record::Activity;
use std::cell::{Cell, RefCell};
use truing_servo::device::run_log::RunLog;

/// A speed is the mean over so long, s, and over two records at least.
const SPEED_S: f64 = 0.003;
/// An answer to a command takes so many records, and so long, s: the ticks of a lock-step, the milliseconds of a line.
const LATE_RECORDS: f64 = 12.0;
const LATE_S: f64 = 0.001;
/// This share of the room stays free.
const MARGIN: f64 = 0.06;
/// Beyond this share of the speed limit nothing drives on: the fault lies at the limit.
const OF_SPEED_LIMIT: f64 = 0.95;

/// Why a part must not go on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Trip {
    /// It would leave the travel on the side of this sign.
    Travel(i8),
    /// The shaft is about as fast as it may be.
    Speed,
    /// The energy is spent.
    Energy,
    /// The servo has latched a fault.
    Fault,
    /// What the servo does by itself is done.
    Done,
}

/// Where the shaft may be, rad from power-up.
#[derive(Clone, Copy, Debug)]
pub(super) struct Window {
    pub(super) lower: f64,
    pub(super) upper: f64,
}

impl Window {
    pub(super) fn centre(&self) -> f64 {
        0.5 * (self.lower + self.upper)
    }

    pub(super) fn room(&self) -> f64 {
        0.5 * (self.upper - self.lower)
    }
}

/// The motion as the last records show it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Motion {
    /// rad from power-up.
    pub(super) position: f64,
    /// rad/s.
    pub(super) speed: f64,
    /// At the terminals, V; 0 while the bridge is open.
    pub(super) volts: f64,
}

/// What has been seen so far.
pub(super) struct Watch {
    scale: Scale,
    pub(super) window: Option<Window>,
    speed_limit: f64,
    energy_limit_j: f64,
    late_s: f64,
    rows_of_speed: usize,
    seen: Cell<usize>,
    spent_j: Cell<f64>,
    /// Largest electrical power so far, W.
    power_w: Cell<f64>,
    reach: RefCell<[f64; 2]>,
    pub(super) trip: Cell<Option<Trip>>,
}

impl Watch {
    /// `every`: one record in so many ticks.
    pub(super) fn new(plan: &Plan, window: Option<Window>, log: &RunLog, every: u32) -> Self {
        let record_s = f64::from(every.max(1)) / f64::from(log.config.tick_hz);
        let here = log.rows.last().map_or(0.0, |row| position(log, row.record.count));
        Self {
            scale: plan.scale,
            window,
            speed_limit: log.config.speed_limit_rad_s.get().map_or(f64::INFINITY, f64::from),
            energy_limit_j: plan.energy_j.unwrap_or(f64::INFINITY),
            late_s: LATE_RECORDS * record_s + LATE_S,
            rows_of_speed: ((SPEED_S / record_s) as usize).max(2),
            seen: Cell::new(log.rows.len()),
            spent_j: Cell::new(0.0),
            power_w: Cell::new(0.0),
            reach: RefCell::new([here; 2]),
            trip: Cell::new(None),
        }
    }

    /// Electrical energy so far, J; 0 without a current sensor.
    pub(super) fn spent_j(&self) -> f64 {
        self.spent_j.get()
    }

    /// Lowest and highest position, rad from power-up.
    pub(super) fn reach(&self) -> [f64; 2] {
        *self.reach.borrow()
    }

    /// Takes the new records in; true if one of them is a reason to stop.
    pub(super) fn look(&self, log: &RunLog, alone: bool) -> bool {
        self.count(log);
        let motion = self.motion(log);
        let activity = log.rows.last().map_or(Activity::Idle, |row| row.record.activity);
        let late_j = self.power_w.get() * self.late_s;
        let fast = motion.speed.abs() > OF_SPEED_LIMIT * self.speed_limit;
        let reasons = [
            (activity == Activity::Faulted, Trip::Fault),
            (self.spent_j.get() + 2.0 * late_j > self.energy_limit_j, Trip::Energy),
            (alone && activity != Activity::Driving, Trip::Done),
            (fast && motion.volts * motion.speed > 0.0, Trip::Speed),
        ];
        let first = reasons.into_iter().find_map(|(holds, trip)| holds.then_some(trip));
        let trip = first.or_else(|| self.leaves(&motion));
        self.trip.set(trip);
        trip.is_some()
    }

    /// The side on which the axis would leave its travel if it were not braked now.
    fn leaves(&self, motion: &Motion) -> Option<Trip> {
        let window = self.window?;
        let margin = MARGIN * window.room();
        // A push towards a stop counts from rest too; what pushes back does not.
        [(1.0, window.upper), (-1.0, window.lower)].into_iter().find_map(|(side, stop)| {
            let (speed, volts) = ((side * motion.speed).max(0.0), (side * motion.volts).max(0.0));
            if speed == 0.0 && volts == 0.0 {
                return None;
            }
            let left = side * (stop - motion.position) - margin;
            let way = self.scale.stopping_rad(speed, volts, self.late_s);
            (way > left).then_some(Trip::Travel(side as i8))
        })
    }

    /// Energy and reach of the new records.
    fn count(&self, log: &RunLog) {
        let rows = log.rows.get(self.seen.get()..).unwrap_or_default();
        let mut reach = self.reach.borrow_mut();
        for (row, before) in
            rows.iter().zip(self.seen.get().checked_sub(1).map_or(rows, |at| &log.rows[at..]))
        {
            let here = position(log, row.record.count);
            *reach = [reach[0].min(here), reach[1].max(here)];
            let Some(current) = Sample::sensed(row.record.current_raw) else { continue };
            let current_a = f64::from(current) * f64::from(log.config.current_a_per_lsb);
            // The current is the mean of the tick before, like the voltage that acted then.
            let power = terminal_v(log, &before.record) * current_a;
            let seconds = f64::from(row.tick.saturating_sub(before.tick)) / f64::from(log.config.tick_hz);
            self.power_w.set(self.power_w.get().max(power));
            self.spent_j.set(self.spent_j.get() + power.max(0.0) * seconds);
        }
        self.seen.set(log.rows.len());
    }

    /// The motion now.
    pub(super) fn motion(&self, log: &RunLog) -> Motion {
        let Some((last, earlier)) = log.rows.split_last() else { return Motion::default() };
        let first = earlier.get(earlier.len().saturating_sub(self.rows_of_speed)).unwrap_or(last);
        let counts = last.record.count.wrapping_sub(first.record.count);
        let seconds = f64::from(last.tick.saturating_sub(first.tick).max(1)) / f64::from(log.config.tick_hz);
        Motion {
            position: position(log, last.record.count),
            speed: log.rad(f64::from(counts)) / seconds,
            volts: terminal_v(log, &last.record),
        }
    }

    /// Does it stand, or turn away from the side of this sign?
    pub(super) fn turned(&self, log: &RunLog, side: f64) -> bool {
        side * self.motion(log).speed <= 0.0
    }
}

fn position(log: &RunLog, count: i32) -> f64 {
    log.rad(f64::from(count.wrapping_sub(log.zero())))
}

fn terminal_v(log: &RunLog, record: &servo::record::Record) -> f64 {
    match record.bridge {
        Bridge::Driven => {
            f64::from(record.duty) / f64::from(log.config.pwm_full_scale) * log.supply_v(record)
        }
        _ => 0.0,
    }
}
