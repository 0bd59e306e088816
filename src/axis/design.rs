//! From what was identified to the gains of every stage: the one place where the loops learn about the motor.
//!
//! Only trusted numbers are taken. A number that has lost its trust keeps its last trusted value, and the record says
//! so ([`Source`]). Gain and time constant that were never trusted come from the configuration (rated speed and hint).

use super::last_trusted::LastTrusted;
pub use super::last_trusted::Stage;
use crate::compensate::{Compensator, DeadZone, SignSource, Smoothing};
use crate::config::Scale;
use crate::control::{self, Tuning};
use crate::encoder::{self, Motor};
use crate::identify::estimate::{GAIN_FRAC, TIME_FRAC};
use crate::motion::trajectory::Limits;
use crate::protect::Expectation;
use crate::record::Source;
use crate::units::{Speed, Voltage, mul_shift_within, to_fixed};

/// Time constant when neither hint nor estimate is there, s: the middle of small geared motors. The loops then stay
/// closed to motion commands; only the observer runs with it.
const USUAL_TAU_S: f32 = 0.05;
/// Friction is spread over this many bits more of speed in the observer than in the compensator, so that its
/// slope stays stable in a forward-Euler step of a fifth of τ.
const FRICTION_SPREAD: u32 = 2;

/// A motion may take so many times the voltage that is left. Gain and time constant are right within 4 % each and the dead
/// zone within 12 %, friction and load go up and down; and of a sine that takes a tenth too much the clip acts a quarter
/// of the time and costs 3 % of the amplitude (describing function of a saturation).
pub const FEASIBLE: f32 = 1.1;
/// A configured gain is right within this factor, and a configured time constant within that one.
const RATED_WITHIN: f32 = 1.3;
const HINT_WITHIN: f32 = 2.0;

/// Everything that follows from what the identifier last found and trusts.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Design {
    /// The linear motor.
    pub motor: Motor,
    /// Observer.
    pub observer: encoder::Params,
    /// Loops.
    pub loops: control::Params,
    /// Compensator with κ below 1.
    pub compensator: Compensator,
    /// The whole dead zone, for the observer.
    dead_zone: DeadZone,
    sign: SignSource,
    /// Terminal voltage beyond which more brings nothing, `[positive, negative]`; the maximum when not known.
    pub saturation: [Voltage; 2],
    /// The least that the motor must do.
    pub expectation: Expectation,
    /// Speed that the position loop may ask for.
    pub speed_limit: Speed,
    /// What set-points may ask for.
    pub limits: Limits,
    /// Position error, counts Q12, that asks for a quarter of full speed: a cruising set-point waits there.
    pub lead: i32,
    /// Where gain and time constant come from; `None`: there is no time constant, no loop may close.
    pub gain_source: Source,
    /// Where the dead zones come from.
    pub dead_zone_source: [Source; 2],
}

impl Design {
    /// One stage, and on to the next. The old values of the other stages stay in force meanwhile.
    pub fn renew(&mut self, stage: &mut Stage, scale: &Scale, tuning: &Tuning, last_trusted: &LastTrusted) {
        *stage = match *stage {
            Stage::Done => Stage::Done,
            Stage::Motor => {
                (self.motor, self.gain_source) = motor(scale, last_trusted);
                self.observer = self.observer.of(&self.motor);
                Stage::Loops
            }
            Stage::Loops => {
                self.loops = control::Params::new(&self.motor, tuning);
                self.lead = self.loops.error_for(0.25 * self.motor.full_speed);
                Stage::DeadZone
            }
            Stage::DeadZone => {
                self.renew_dead_zone(last_trusted);
                Stage::Expectation
            }
            Stage::Expectation => {
                let widths = last_trusted.unloaded();
                let sticks = self.sign == SignSource::Reference;
                let told_lag = self.expectation.told_lag();
                self.expectation = Expectation::new(&self.motor, widths, sticks, scale);
                self.expectation.waits(told_lag);
                Stage::Limits
            }
            Stage::Limits => {
                self.saturation =
                    last_trusted.saturation.map(|held| Voltage(held.value().unwrap_or(i32::MAX)));
                self.speed_limit = speed_limit(scale);
                self.limits = limits(scale, last_trusted, &self.motor);
                Stage::Done
            }
        };
    }

    /// The most able motor that agrees with what is known: a motion that it cannot do is none for the true one.
    #[must_use]
    pub fn ablest_motor(&self) -> Motor {
        let Motor { full_speed, tau_ticks } = self.motor;
        match self.gain_source {
            Source::None => Motor { full_speed: RATED_WITHIN * full_speed, tau_ticks: 0.0 },
            Source::Configured => {
                Motor { full_speed: RATED_WITHIN * full_speed, tau_ticks: tau_ticks / HINT_WITHIN }
            }
            _ => self.motor,
        }
    }

    /// Voltage beyond the dead zone that is left for both directions when the terminals get no more than `ceiling`.
    #[must_use]
    pub fn voltage_left(&self, ceiling: Voltage) -> Voltage {
        let [positive, negative] = self.saturation.map(|level| level.min(ceiling));
        let forward = self.dead_zone.forward(positive);
        let backward = self.dead_zone.forward(Voltage::ZERO.minus(negative));
        forward.min(Voltage::ZERO.minus(backward))
    }

    fn renew_dead_zone(&mut self, last_trusted: &LastTrusted) {
        let [positive, negative] = last_trusted.widths();
        let smoothing = Smoothing::within(self.loops.per_count());
        self.sign = last_trusted.sign_source();
        self.compensator = Compensator::new(positive, negative, self.sign, smoothing);
        self.dead_zone = DeadZone::new(positive, negative, Smoothing::WIDEST);
        self.dead_zone_source = last_trusted.dead_zone.map(|held| held.source);
    }

    /// Does the shaft stick? An input dead zone alone lets it coast, and what pushed it out of friction would throw it.
    #[must_use]
    pub fn sticks(&self) -> bool {
        self.sign == SignSource::Reference && self.dead_zone != DeadZone::NONE
    }

    /// Does the drive swallow small voltages?
    #[must_use]
    pub fn input_dead_zone(&self) -> bool {
        self.sign == SignSource::Command
    }

    /// Does the drive drop a voltage in the direction of the current?
    #[must_use]
    #[inline]
    pub fn drops(&self) -> bool {
        self.sign == SignSource::Current
    }

    /// What the drive leaves of a terminal voltage; friction, this share of the widths beside an input dead zone, Q16, takes its part behind
    /// the winding.
    #[must_use]
    pub fn at_winding(&self, terminal: Voltage, friction: u16) -> Voltage {
        if !self.input_dead_zone() {
            return terminal;
        }
        let left = self.dead_zone.forward(terminal);
        left.plus(Voltage(mul_shift_within(terminal.minus(left).0, friction.into(), 16)))
    }

    /// What the dead zone leaves of a terminal voltage while the shaft turns at `speed`.
    #[must_use]
    pub fn behind_dead_zone(&self, terminal: Voltage, speed: Speed) -> Voltage {
        match self.sign {
            SignSource::Command => self.dead_zone.forward(terminal),
            SignSource::Current => {
                let steady = self.loops.steady_voltage(speed);
                steady.plus(self.dead_zone.forward(terminal.minus(steady)))
            }
            SignSource::Reference => {
                let steady = self.loops.steady_voltage(speed);
                terminal.minus(self.dead_zone.push(Voltage(steady.0 >> FRICTION_SPREAD)))
            }
        }
    }
}

/// The identified motor, or the configured one.
fn motor(scale: &Scale, last_trusted: &LastTrusted) -> (Motor, Source) {
    let config = &scale.config;
    let rated = config.rated_speed_rad_s * scale.counts_per_tick();
    let hint = config.time_constant_hint_s.get();
    match (last_trusted.gain.value(), last_trusted.time_constant.value()) {
        (Some(gain), Some(tau)) => {
            let motor = Motor {
                full_speed: gain as f32 / (1u32 << GAIN_FRAC) as f32 * rated,
                tau_ticks: tau as f32 / (1u32 << TIME_FRAC) as f32,
            };
            (motor, last_trusted.gain.source.weaker(last_trusted.time_constant.source))
        }
        _ => {
            let tau_ticks = hint.unwrap_or(USUAL_TAU_S) * config.tick_hz as f32;
            let source = if hint.is_some() { Source::Configured } else { Source::None };
            (Motor { full_speed: rated, tau_ticks }, source)
        }
    }
}

/// Set-points keep 20 % of what the motor can do beyond its dead zone for the loops.
fn limits(scale: &Scale, last_trusted: &LastTrusted, motor: &Motor) -> Limits {
    let one = Voltage::NOMINAL.0;
    let most = voltage_limit(scale).0.min(one);
    let top = last_trusted.saturation.map(|held| held.value().unwrap_or(most).min(most));
    let swallowed = last_trusted.widths();
    let room = (top[0] - swallowed[0].0).min(top[1] - swallowed[1].0).max(one / 16);
    let speed =
        scale.config.speed_limit_rad_s.get().map_or(f32::MAX, |limit| 0.8 * limit * scale.counts_per_tick());
    Limits {
        speed,
        voltage: 0.8 * motor.full_speed * room as f32 / one as f32,
        tau_ticks: motor.tau_ticks,
        acceleration: per_tick(scale, scale.config.acceleration_limit_rad_s2.get(), 2),
        jerk: per_tick(scale, scale.config.jerk_limit_rad_s3.get(), 3),
    }
}

/// A limit in counts and ticks, `order` derivatives above the position.
fn per_tick(scale: &Scale, limit: Option<f32>, order: usize) -> f32 {
    let tick_hz = scale.config.tick_hz as f32;
    limit
        .map_or(f32::MAX, |limit| (0..order).fold(limit * scale.counts_per_rad(), |value, _| value / tick_hz))
}

/// The voltage limit; the maximum when there is none.
#[must_use]
pub fn voltage_limit(scale: &Scale) -> Voltage {
    let config = &scale.config;
    Voltage(
        config
            .voltage_limit_v
            .get()
            .map_or(i32::MAX, |limit| to_fixed(limit / config.supply_nominal_v, Voltage::BITS)),
    )
}

/// 90 % of the configured limit, so that ordinary overshoot is no fault.
fn speed_limit(scale: &Scale) -> Speed {
    let limit = scale.config.speed_limit_rad_s.get();
    Speed(limit.map_or(i32::MAX, |limit| to_fixed(0.9 * limit * scale.counts_per_tick(), 20)))
}
