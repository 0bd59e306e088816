//! Can the motor do what a profile asks for, by all that is known of it? Asked before anything moves, and again with
//! what a commissioning has found. The servo asks the same of a sine; points it would follow as fast as its limits allow,
//! far behind.

use crate::device::motion_profile::Profile;
use crate::device::place_load::designed;
use crate::device::waypoints::{self, Knot};
use serde::Serialize;
use servo::axis::design::FEASIBLE;
use servo::config::Config;
use servo::identify::estimate::Estimates;
use servo::motion::sine::sine_takes;
use servo::record::Source;
use servo::store::AxisParameters;
use servo::units::Voltage;
use std::f64::consts::PI;

/// Share of the time in motion for which points may take more voltage than there is: a jump at the beginning is caught up.
const CLIPPED_SHARE: f64 = 0.1;
/// Ticks in which the times of points are taken here: rounded to those of the control, dense points would seem to shake.
const FINE_HZ: u32 = 100_000;
/// Where the speed and the acceleration between two points are looked at, shares of their time.
const LOOKS: [f64; 4] = [0.125, 0.375, 0.625, 0.875];

/// What is known of a motor and its drive, for motions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ability {
    /// rad/s per V.
    pub gain: f64,
    /// s.
    pub time_constant_s: f64,
    /// Voltage beyond the dead zone for both directions, V.
    pub available_v: f64,
    /// What streamed points may use of it, V.
    pub streamed_v: f64,
    /// Fastest that the loops go by a limit, rad/s.
    pub fastest_rad_s: f64,
    tick_hz: u32,
}

/// A profile takes more than there is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shortfall {
    /// What it takes, V or rad/s.
    pub needed: f64,
    /// What there is.
    pub available: f64,
    /// `V` or `rad/s`.
    pub unit: &'static str,
    /// The profile, scaled so that it fits.
    pub fitted: Fitted,
}

/// How a profile is scaled; in JSON the number that takes the place of what was asked for.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Fitted {
    /// A sine: another amplitude. The frequency would do as well.
    Sine {
        /// rad, at the frequency that was asked for.
        amplitude_rad: f64,
        /// Hz, at the amplitude that was asked for.
        #[serde(skip)]
        frequency_hz: f64,
    },
    /// Points.
    Slower {
        /// All times are multiplied by this.
        time_factor: f64,
    },
}

impl Ability {
    /// Of the axis that the firmware designs with this configuration once it knows this. What is only configured is
    /// taken at its most able.
    pub fn of(config: &Config, known: &Estimates) -> Option<Self> {
        let design = designed(&AxisParameters { estimates: *known, ..AxisParameters::new(*config) })?;
        let scale = config.build().ok()?;
        let motor = design.ablest_motor();
        let nominal = f64::from(config.supply_nominal_v);
        let per_rad_s = f64::from(scale.counts_per_tick());
        let volts = |voltage: Voltage| f64::from(voltage.0) / f64::from(Voltage::NOMINAL.0) * nominal;
        let ceiling = servo::axis::design::voltage_limit(&scale).min(Voltage::NOMINAL);
        let available_v = volts(design.voltage_left(ceiling));
        let streamed_v = match design.gain_source {
            Source::None | Source::Configured => available_v,
            _ => f64::from(design.limits.voltage / motor.full_speed) * nominal,
        };
        Some(Self {
            gain: f64::from(motor.full_speed) / per_rad_s / nominal,
            time_constant_s: f64::from(motor.tau_ticks) / f64::from(config.tick_hz),
            available_v,
            streamed_v,
            fastest_rad_s: f64::from(design.speed_limit.0) / 2f64.powi(20) / per_rad_s,
            tick_hz: config.tick_hz,
        })
    }

    /// What a profile lacks, if anything. A jump is planned within the limits by the servo itself.
    pub fn shortfall(&self, profile: &Profile) -> Option<Shortfall> {
        match profile {
            Profile::Sine { amplitude_rad, frequency_hz, seconds } => {
                self.sine(*amplitude_rad, *frequency_hz, *seconds)
            }
            Profile::Points(points) => self.points(&waypoints::knots(points, FINE_HZ, 1)),
            Profile::Step { .. } => None,
        }
    }

    fn sine(&self, amplitude_rad: f32, frequency_hz: f32, seconds: f32) -> Option<Shortfall> {
        let tick_hz = self.tick_hz as f32;
        let ticks = (seconds * tick_hz) as u32;
        let tau_ticks = self.time_constant_s as f32 * tick_hz;
        let takes = |tau: f32| {
            f64::from(sine_takes(tau, amplitude_rad, frequency_hz / tick_hz, ticks)) * f64::from(tick_hz)
        };
        let amplitude = f64::from(amplitude_rad).abs();
        let (speed, needed_v) = (takes(0.0), takes(tau_ticks) / self.gain);
        if speed > self.fastest_rad_s {
            let share = self.fastest_rad_s / speed;
            let fitted = Fitted::Sine {
                amplitude_rad: amplitude * share,
                frequency_hz: f64::from(frequency_hz) * share,
            };
            return Some(Shortfall { needed: speed, available: self.fastest_rad_s, unit: "rad/s", fitted });
        }
        let amplitude_rad = amplitude * self.available_v / needed_v;
        let fitted = Fitted::Sine { amplitude_rad, frequency_hz: self.frequency(amplitude) };
        let short = needed_v > f64::from(FEASIBLE) * self.available_v;
        short.then_some(Shortfall { needed: needed_v, available: self.available_v, unit: "V", fitted })
    }

    /// Frequency, Hz, at which a sine of this amplitude takes what there is: `A·Ω·√(1 + (Ωτ)²) = K·V`, solved for Ω.
    fn frequency(&self, amplitude_rad: f64) -> f64 {
        let speed = self.gain * self.available_v / amplitude_rad;
        let twice = 2.0 * self.time_constant_s * speed;
        // Ω² = 2·(K·V/A)²/(1 + √(1 + (2τ·K·V/A)²))
        speed * (2.0 / (1.0 + twice.hypot(1.0))).sqrt() / (2.0 * PI)
    }

    fn points(&self, knots: &[Knot]) -> Option<Shortfall> {
        let takes = |slower: f64| self.level(knots, slower);
        let needed = takes(1.0);
        let most = f64::from(FEASIBLE) * self.streamed_v;
        if needed <= most {
            return None;
        }
        // Below what there is, so that a point which is rounded to a tick does not meet the limit. What it takes falls at
        // least in proportion.
        let aim = self.streamed_v / f64::from(FEASIBLE);
        let (mut quick, mut slow) = (1.0, needed / aim);
        for _ in 0..30 {
            let middle = 0.5 * (quick + slow);
            *(if takes(middle) > aim { &mut quick } else { &mut slow }) = middle;
        }
        let fitted = Fitted::Slower { time_factor: slow };
        Some(Shortfall { needed, available: self.streamed_v, unit: "V", fitted })
    }

    /// Voltage behind the dead zone that is exceeded for [`CLIPPED_SHARE`] of the time in motion, V, if all times are
    /// multiplied by `slower`.
    fn level(&self, knots: &[Knot], slower: f64) -> f64 {
        let mut levels: Vec<(f64, f64)> = knots
            .windows(2)
            .flat_map(|pair| self.segment(&pair[0], &pair[1], slower))
            .filter(|(volts, _)| *volts > 0.0)
            .collect();
        levels.sort_by(|a, b| b.0.total_cmp(&a.0));
        let total: f64 = levels.iter().map(|(_, seconds)| seconds).sum();
        let mut above = 0.0;
        let first = levels.iter().find(|(_, seconds)| {
            above += seconds;
            above > CLIPPED_SHARE * total
        });
        first.map_or(0.0, |(volts, _)| *volts)
    }

    /// Voltages at the looks between two points, each with its share of the time: the cubic that joins them (Hermite).
    fn segment(&self, from: &Knot, to: &Knot, slower: f64) -> [(f64, f64); LOOKS.len()] {
        let seconds = f64::from(to.tick - from.tick) / f64::from(FINE_HZ) * slower;
        let way = to.theta_rad - from.theta_rad;
        let [start, end] = [from, to].map(|knot| knot.omega_rad_s / slower * seconds);
        let (square, cube) = (3.0 * way - 2.0 * start - end, start + end - 2.0 * way);
        LOOKS.map(|r| {
            let omega = (start + (2.0 * square + 3.0 * cube * r) * r) / seconds;
            let alpha = (2.0 * square + 6.0 * cube * r) / (seconds * seconds);
            let volts = (omega + self.time_constant_s * alpha).abs() / self.gain;
            (volts, seconds / LOOKS.len() as f64)
        })
    }
}

impl Shortfall {
    /// The profile, scaled so that it fits.
    pub fn fit(&self, profile: &Profile) -> Profile {
        match (profile, self.fitted) {
            (
                Profile::Sine { amplitude_rad: asked, frequency_hz, seconds },
                Fitted::Sine { amplitude_rad, .. },
            ) => Profile::Sine {
                amplitude_rad: (amplitude_rad as f32).copysign(*asked),
                frequency_hz: *frequency_hz,
                seconds: *seconds,
            },
            (Profile::Points(points), Fitted::Slower { time_factor: factor }) => {
                Profile::Points(waypoints::slower(points, factor))
            }
            _ => profile.clone(),
        }
    }

    /// What was scaled, one line.
    pub fn fitted_text(&self) -> String {
        let Self { needed, available, unit, fitted } = self;
        let scaled = match fitted {
            Fitted::Sine { amplitude_rad, .. } => format!("amplitude {amplitude_rad:.6} rad"),
            Fitted::Slower { time_factor } => format!("all times × {time_factor:.3}"),
        };
        format!("{scaled} (it takes {needed:.2} {unit} where {available:.2} {unit} are left)")
    }
}

impl std::fmt::Display for Shortfall {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { needed, available, unit, .. } = self;
        let beyond = if *unit == "V" { " beyond the dead zone" } else { "" };
        write!(f, "--profile takes {needed:.2} {unit}{beyond} and {available:.2} {unit} are left: ")?;
        match self.fitted {
            Fitted::Sine { amplitude_rad, frequency_hz } => write!(
                f,
                "choose at most {amplitude_rad:.4} rad or {frequency_hz:.4} Hz, or give --fit to scale the amplitude"
            ),
            Fitted::Slower { time_factor: factor } => {
                write!(f, "make it {factor:.3} times slower, or give --fit to stretch its times")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{Ability, Fitted};
    use crate::device::motion_profile::Profile;
    use crate::device::waypoints::Waypoint;
    use servo::identify::estimate::Estimates;
    use std::f64::consts::TAU;

    /// 10 rad/s per V, 0.1 s, 6 V, of which points may use 5 V.
    const MOTOR: Ability = Ability {
        gain: 10.0,
        time_constant_s: 0.1,
        available_v: 6.0,
        streamed_v: 5.0,
        fastest_rad_s: f64::INFINITY,
        tick_hz: 1000,
    };

    fn sine(amplitude_rad: f32, frequency_hz: f32) -> Profile {
        Profile::Sine { amplitude_rad, frequency_hz, seconds: 10.0 }
    }

    /// By hand: 10 rad at 1 Hz are 62.8 rad/s · √(1 + 0.628²) = 74.2 rad/s, 7.42 V of 6 V.
    #[test]
    fn a_sine_that_takes_too_much_names_what_would_fit_and_that_fits() {
        let short = MOTOR.shortfall(&sine(10.0, 1.0)).expect("7.4 V of 6 V");
        assert!((short.needed - 7.42).abs() < 0.01, "{short}");
        let Fitted::Sine { amplitude_rad, frequency_hz } = short.fitted else {
            panic!("{short}");
        };
        assert!((amplitude_rad - 8.09).abs() < 0.01, "{amplitude_rad}");
        for (amplitude, frequency) in [(amplitude_rad, 1.0), (10.0, frequency_hz)] {
            let takes = amplitude * TAU * frequency * (TAU * frequency * 0.1).hypot(1.0) / 10.0;
            assert!((takes - 6.0).abs() < 1e-2, "{amplitude} rad, {frequency} Hz: {takes} V");
        }
        assert_eq!(MOTOR.shortfall(&short.fit(&sine(10.0, 1.0))), None);
        // A tenth more than there is may be clipped.
        assert_eq!(MOTOR.shortfall(&sine(8.7, 1.0)), None);
    }

    fn table(amplitude_rad: f64, rest_s: f64) -> Profile {
        let moving = (0..=500).map(|row| {
            let time_s = f64::from(row) * 0.01;
            (rest_s + time_s, amplitude_rad * (TAU * time_s).sin())
        });
        let rows = [(0.0, 0.0)].into_iter().chain(moving);
        Profile::Points(
            rows.map(|(time_s, theta_rad)| Waypoint { time_s, theta_rad, ..Waypoint::default() }).collect(),
        )
    }

    /// The same sine as points. It begins with a jump of the speed and rests for a while before: neither counts.
    #[test]
    fn points_that_take_too_much_fit_when_they_are_slower() {
        assert_eq!(MOTOR.shortfall(&table(6.7, 20.0)), None);
        let profile = table(10.0, 20.0);
        let short = MOTOR.shortfall(&profile).expect("7.4 V of 5 V");
        assert!((7.2..7.5).contains(&short.needed), "{short}");
        let fitted = short.fit(&profile);
        assert_eq!(MOTOR.shortfall(&fitted), None);
        assert!(
            matches!(short.fitted, Fitted::Slower { time_factor: factor } if (1.3..1.6).contains(&factor)),
            "{short}"
        );
    }

    #[test]
    fn what_is_not_identified_is_refused_only_the_impossible() {
        let text = "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 2048\n[axis]\nrated_speed_rad_s = 220.0\n";
        let setup = crate::device::axis_file::parse("axis.toml", text).expect("an axis");
        let ability = Ability::of(&setup.config, &Estimates::default()).expect("an axis");
        // 314 rad/s: beyond 1.3 times the rated speed, and FEASIBLE times that.
        let short = ability.shortfall(&sine(1.05, 50.0)).expect("too fast");
        assert!(short.to_string().contains("are left: choose at most"), "{short}");
        assert_eq!(ability.shortfall(&sine(1.0, 40.0)), None);
    }
}
