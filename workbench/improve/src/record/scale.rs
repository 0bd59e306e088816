//! Voltages and times of a recording, from what is known of the motor; and how far it goes before it stands.

use servo::config::Config;
use servo::identify::estimate::{EstimatesReport, Reported};
use truing_core::text::input_error::InputError;

/// The servo goes from zero to the nominal supply in so long, s (`servo::axis`, voltage mode).
const FULL_SWING_S: f64 = 0.1;
/// Nothing in a recording is shorter than this time constant would make it, s: the voltage itself takes a tenth of a second.
const SHORTEST_UNIT_S: f64 = 0.06;
/// A rated speed is right within this factor, and a hint within that one (`docs/axis-file.md`); identified numbers are right
/// within this one.
const RATED_WITHIN: f64 = 1.3;
const HINT_WITHIN: f64 = 2.0;
const FOUND_WITHIN: f64 = 1.15;
/// Share of the speed limit that the fastest motor may reach: the fault lies at the limit.
const OF_SPEED_LIMIT: f64 = 0.9;
/// A load may push with this share of the largest voltage while the axis brakes.
const LOAD: f64 = 0.15;
/// One stroke with its turn takes at most this share of the room; the rest is for loads and drift.
const STROKE: f64 = 0.7;
/// Less than this share of the supply moves hardly a motor.
const LEAST_SHARE: f64 = 0.06;
/// A chirp has this share of the supply at least, and a frequency this part of the control rate at most (`excitation`).
const FEWEST_TICKS: f64 = 20.0;

/// What a recording is scaled by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    /// Time constant of the motor, s.
    pub tau_s: f64,
    /// What segments count their time in, s: the time constant, if the voltage can follow that.
    pub unit_s: f64,
    /// Steady speed per volt, rad/s.
    pub gain: f64,
    /// Largest voltage of any segment, V.
    pub most_v: f64,
    /// Dead zone as far as it is known, V.
    pub dead_zone_v: f64,
    /// Nominal supply, V.
    pub supply_v: f64,
    /// Room to each side of the start at the controlled shaft, rad.
    pub room_rad: Option<f64>,
    /// Highest frequency of a chirp, Hz.
    pub highest_hz: f64,
    /// Gain and time constant are right within these factors.
    within: [f64; 2],
}

impl Scale {
    /// From the axis file and what was identified.
    ///
    /// # Errors
    /// The time constant is not known, or the travel is too short for any voltage that moves the motor.
    pub fn new(
        config: &Config,
        known: Option<&EstimatesReport>,
        room_rad: Option<f64>,
    ) -> Result<Self, InputError> {
        let value = |pick: fn(&EstimatesReport) -> Reported| {
            known.map(pick).filter(|found| found.trusted).and_then(|found| found.value).map(f64::from)
        };
        let supply_v = f64::from(config.supply_nominal_v);
        let rated = f64::from(config.rated_speed_rad_s) / supply_v;
        let found = value(|known| known.time_constant_s);
        let tau_s = found.or(config.time_constant_hint_s.get().map(f64::from)).ok_or_else(|| {
            let what = "a recording is scaled by the motor's time constant, which is not known: give --params with the result of \
                        `truing commission --save`, or axis.time_constant_hint_s in the axis file";
            InputError(what.into())
        })?;
        let gain = value(|known| known.gain_rad_s_per_v);
        let within =
            [gain.map_or(RATED_WITHIN, |_| FOUND_WITHIN), found.map_or(HINT_WITHIN, |_| FOUND_WITHIN)];
        let sides = [value(|known| known.dead_zone_pos_v), value(|known| known.dead_zone_neg_v)];
        let mut scale = Self {
            tau_s,
            unit_s: tau_s.max(SHORTEST_UNIT_S),
            gain: gain.unwrap_or(rated),
            most_v: config.voltage_limit_v.get().map_or(supply_v, f64::from).min(supply_v),
            dead_zone_v: sides.into_iter().flatten().fold(0.0, f64::max),
            supply_v,
            room_rad,
            highest_hz: f64::from(config.tick_hz) / FEWEST_TICKS,
            within,
        };
        if let Some(limit) = config.speed_limit_rad_s.get() {
            let fastest = scale.within[0] * scale.gain;
            scale.most_v = scale.most_v.min(OF_SPEED_LIMIT * f64::from(limit) / fastest + scale.dead_zone_v);
        }
        scale.fit_stroke()?;
        Ok(scale)
    }

    /// Lowers the largest voltage until a stroke and its turn fit the room.
    fn fit_stroke(&mut self) -> Result<(), InputError> {
        let Some(room) = self.room_rad else { return Ok(()) };
        let allowed = self.most_v;
        let fits = |scale: &Self| scale.stroke_rad() <= STROKE * room;
        if !fits(self) {
            let [mut low, mut high] = [0.0, allowed];
            for _ in 0..40 {
                self.most_v = 0.5 * (low + high);
                *(if fits(self) { &mut low } else { &mut high }) = self.most_v;
            }
            self.most_v = low;
        }
        let least = LEAST_SHARE * self.supply_v + self.dead_zone_v;
        if self.most_v < least {
            return Err(InputError(format!(
                "the travel of {room:.3} rad to each side is too short to record within: this motor needs {least:.2} V to move and \
                 may be given {:.2} V; widen axis.travel_limit_rad or --travel-rad",
                self.most_v
            )));
        }
        Ok(())
    }

    /// From rest up to the largest voltage and at once to a standstill, by the fastest motor that agrees with what is known, rad.
    fn stroke_rad(&self) -> f64 {
        let (mut speed, mut way, mut volts) = (0.0, 0.0, 0.0);
        let step = self.step_s();
        while volts < self.most_v {
            volts += self.supply_v / FULL_SWING_S * step;
            speed += step * self.push(speed, volts);
            way += speed * step;
        }
        way + self.stopping_rad(speed, volts, 0.0)
    }

    /// Way until the axis stands, rad ≥ 0, if it is braked `late_s` from now. `speed` > 0, and `volts` in the same direction, are
    /// those of now. The motor may be as strong, and as slow to brake, as what is known of it allows.
    pub fn stopping_rad(&self, speed: f64, volts: f64, late_s: f64) -> f64 {
        let (step, slew) = (self.step_s(), self.supply_v / FULL_SWING_S);
        let (mut speed, mut volts, mut way, mut time) = (speed, volts, 0.0, 0.0);
        // Ten swings and time constants are an eternity: whoever does not stand then does not brake.
        let end = late_s + 10.0 * (FULL_SWING_S + self.within[1] * self.tau_s);
        while (speed > 0.0 || volts > 0.0) && time < end {
            if time >= late_s {
                volts = (volts - slew * step).max(-self.most_v);
            }
            speed += step * if volts > 0.0 { self.push(speed, volts) } else { self.brake(speed, volts) };
            way += speed.max(0.0) * step;
            time += step;
        }
        way
    }

    /// Largest acceleration, rad/s².
    fn push(&self, speed: f64, volts: f64) -> f64 {
        let load = LOAD * self.most_v;
        ((self.within[0] * self.gain * (volts + load) - speed) / (self.tau_s / self.within[1])).max(0.0)
    }

    /// Smallest deceleration, rad/s², negative.
    fn brake(&self, speed: f64, volts: f64) -> f64 {
        let load = LOAD * self.most_v;
        (self.gain / self.within[0] * (volts + load) - speed) / (self.tau_s * self.within[1])
    }

    fn step_s(&self) -> f64 {
        (self.tau_s / self.within[1] / 10.0).clamp(2e-4, 2e-3)
    }

    /// The lowest frequency at which a sine of this amplitude swings within a third of the room, from a start at rest, Hz.
    pub fn lowest_hz(&self, amplitude_v: f64) -> f64 {
        let Some(room) = self.room_rad else { return 0.0 };
        let swing = |hz: f64| {
            let turn = std::f64::consts::TAU * hz;
            2.0 * self.within[0] * self.gain * amplitude_v
                / (turn * (1.0 + (turn * self.tau_s).powi(2)).sqrt())
        };
        let mut hz = 0.1 / self.unit_s;
        while swing(hz) > room / 3.0 && hz < self.highest_hz {
            hz *= 1.1;
        }
        hz
    }

    /// A share of what is left above the dead zone, with its sign, V.
    pub fn volts(&self, share: f64) -> f64 {
        let dead = self.dead_zone_v.min(0.5 * self.most_v);
        share.signum() * (dead + share.abs().min(1.0) * (self.most_v - dead))
    }

    /// A voltage from zero takes so long, s.
    pub fn swing_s(&self, volts: f64) -> f64 {
        FULL_SWING_S * volts.abs() / self.supply_v
    }
}
