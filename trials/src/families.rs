//! Families of motors with known truth, for the accuracy suites: three sizes of gear motor and the paper's motor.
//!
//! ```text
//! τe x' = v − ρ ω/K − x,   (τm/K) ω' = x − (1 − ρ) ω/K − friction(ω, θ) − load        (x = R i, everything in volts)
//! ```
//!
//! A plant is drawn from a seed. [`Seeds::Design`] and [`Seeds::Evaluation`] name disjoint sets of plants, so a suite
//! that reports figures cannot meet a plant that somebody looked at while building.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::config::Config;
use std::f64::consts::TAU;
use truing::synthetic::reference_plant::{Decay, Friction, Load, Motor, Split, Thermal, Train};

/// Size and kind of motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Small and fast: τm 20–50 ms, 48 counts per turn on a shaft of 6–12 krpm.
    G1,
    /// Middle: τm 40–90 ms, 64–500 counts per turn, 3–6 krpm.
    G2,
    /// Geared output: τm 80–150 ms, 1024–4096 counts per turn, 80–300 rpm.
    G3,
    /// The robot joint of the paper: poles at −0.46 and −4.1 s⁻¹, dead zone and knee of the drive.
    Paper,
}

/// How far the plant is from the identifier's model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Severity {
    /// The paper's own constants (for the gear motors: as nominal).
    Exact,
    /// Coulomb and Stribeck friction, a ripple of it, a sagging supply. The paper's motor: every constant ± 20 %.
    Nominal,
    /// Adds random torque, drag, cogging, unequal gains, wider Stribeck, noisier supply.
    Harsh,
}

/// Which of two disjoint sets a number names a plant of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Seeds {
    /// To look at while building.
    Design(u32),
    /// For figures that are published.
    Evaluation(u32),
}

impl Seeds {
    /// Bit 63 tells the sets apart, so no number of one can meet a number of the other.
    fn number(self) -> u64 {
        match self {
            Self::Design(n) => u64::from(n),
            Self::Evaluation(n) => u64::from(n) | 1 << 63,
        }
    }
}

/// Where the dead zone comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// Dry friction.
    Friction,
    /// The drive swallows small voltages.
    Input,
}

/// What the plant does at high voltage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ceiling {
    /// As the family has it (8.5–11.2 V of 12 V; the paper's motor: its knee).
    Family,
    /// No saturation below the supply.
    Absent,
    /// A knee at this share of the nominal supply.
    At(f64),
}

/// What a suite may ask for beside family, severity and seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Control rate, Hz.
    pub tick_hz: u32,
    /// Whether the supply is measured.
    pub vbus_measured: bool,
    /// Cause of the dead zone; `None`: the family's (gear motors friction, the paper's motor input).
    pub cause: Option<Cause>,
    /// Saturation.
    pub ceiling: Ceiling,
}

impl Default for Options {
    fn default() -> Self {
        Self { tick_hz: 1000, vbus_measured: true, cause: None, ceiling: Ceiling::Family }
    }
}

/// What an identifier should find. Voltages are positive magnitudes at the terminals, positive direction first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// Kinetic level: input dead zone, friction · R/Kt, or their sum, V.
    pub dead_zone_v: [f64; 2],
    /// Voltage beyond which more brings no more speed, at nominal supply, V; `None`: there is none.
    pub saturation_v: [Option<f64>; 2],
    /// Slope of speed over voltage beyond the dead zone at low speed, rad/s per V (mean of the directions).
    pub gain: f64,
    /// Sum of the linear part's time constants, s.
    pub time_constant_s: f64,
    /// Cause of the dead zone.
    pub cause: Cause,
}

impl Truth {
    /// Reads the truth off the motor's parameters.
    pub fn of(motor: &Motor) -> Self {
        let drive = &motor.drive;
        let friction = motor.friction.kinetic_nm.map(|level| motor.volts_for(level));
        let at_terminal = |side: usize, volts: f64| volts / drive.gain[side];
        let dead_zone_v = [0, 1].map(|side| at_terminal(side, drive.dead_zone_v[side] + friction[side]));
        let saturation_v = [0, 1].map(|side| {
            let level = at_terminal(side, drive.limit_v[side] + drive.dead_zone_v[side]);
            (level < drive.supply_v).then_some(level)
        });
        let cause = if drive.dead_zone_v == [0.0; 2] { Cause::Friction } else { Cause::Input };
        Self {
            dead_zone_v,
            saturation_v,
            gain: motor.gain() * 0.5 * (drive.gain[0] + drive.gain[1]),
            time_constant_s: motor.time_constant(),
            cause,
        }
    }
}

/// A motor with its sensors, what the firmware is told of it, and the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Plant {
    /// Rules all noise.
    pub seed: u64,
    /// The motor.
    pub motor: Motor,
    /// What the firmware knows.
    pub config: Config,
    /// What it should find.
    pub truth: Truth,
    /// Sensors.
    pub sensing: Sensing,
}

/// Faults of the sensors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sensing {
    /// Error of the encoder's quadrature, counts.
    pub phase_error: f64,
    /// Probability to lose an edge.
    pub missing: f64,
    /// Whether the supply is measured.
    pub vbus: bool,
    /// Noise of the supply's measurement, share of nominal.
    pub vbus_noise: f64,
    /// Delay of the supply's measurement, ticks.
    pub vbus_delay: usize,
    /// Whether the current is measured.
    pub current: bool,
    /// Noise of the current's measurement, share of the stall current.
    pub current_noise: f64,
}

impl Plant {
    /// Draws a plant.
    pub fn draw(family: Family, severity: Severity, seeds: Seeds, options: &Options) -> Self {
        let salt = (family as u64) << 40 | (severity as u64) << 44;
        let seed = seeds.number() ^ salt;
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (motor, counts_per_rev) = match family {
            Family::Paper => paper(&mut rng, severity, options),
            _ => geared(&mut rng, family, severity, options),
        };
        let harsh = severity == Severity::Harsh;
        let vbus_noise = if harsh { 0.005 } else { 0.003 };
        let sensing = Sensing {
            phase_error: if family == Family::Paper { rng.random_range(0.0..0.3) } else { 0.0 },
            missing: 0.0,
            vbus: options.vbus_measured,
            vbus_noise: if severity == Severity::Exact { 0.0 } else { vbus_noise },
            vbus_delay: 0,
            current: rng.random_bool(0.5),
            current_noise: 0.003,
        };
        let config = configure(&mut rng, &motor, counts_per_rev, options);
        let truth = Truth::of(&motor);
        Self { seed, motor, config, truth, sensing }
    }

    /// The plant with one more imperfection.
    pub fn with(mut self, imperfection: Imperfection) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed ^ 0x1f3a_77c1);
        imperfection.put_into(&mut self, &mut rng);
        self
    }

    /// The load torque jumps to this share of the mean dead zone (in volts at the winding) at this time.
    pub fn with_load_step(mut self, at_s: f64, share_of_dead_zone: f64) -> Self {
        let mean = 0.5 * (self.truth.dead_zone_v[0] + self.truth.dead_zone_v[1]);
        let torque = share_of_dead_zone * mean * self.motor.torque_constant / self.motor.resistance_ohm;
        self.motor.load.steps = vec![(at_s, -torque)];
        self
    }

    /// End stops on both sides, so far apart as the motor gets in this time at the speed of the nominal supply.
    pub fn with_travel(mut self, seconds: f64) -> Self {
        let half = 0.5 * seconds * self.truth.gain * f64::from(self.config.supply_nominal_v);
        self.config.travel_limit_rad = Some([-half as f32, half as f32]);
        self
    }
}

/// What real drives add beyond the families: each to be found accurate, refused, or a defect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Imperfection {
    /// Play between rotor and half of the inertia.
    Backlash,
    /// One edge in ten thousand is lost.
    MissedCounts,
    /// Quadrature error of half a count.
    PhaseError,
    /// The supply is measured 5 ms late.
    DelayedSupply,
    /// The supply is measured in steps of 1/64 of nominal.
    QuantisedSupply,
    /// The winding's resistance rises by 20 % at half load, τ 3 s.
    Thermal,
    /// A joint under gravity, at most 30 % of the dead zone.
    Gravity,
    /// A drive with fast decay: discontinuous current.
    FastDecay,
    /// Friction that varies by up to 15 % over one turn of the encoder's shaft (a bent output shaft).
    OutputRipple,
}

impl Imperfection {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Backlash,
        Self::MissedCounts,
        Self::PhaseError,
        Self::DelayedSupply,
        Self::QuantisedSupply,
        Self::Thermal,
        Self::Gravity,
        Self::FastDecay,
        Self::OutputRipple,
    ];

    fn put_into(self, plant: &mut Plant, rng: &mut ChaCha8Rng) {
        let motor = &mut plant.motor;
        match self {
            Self::Backlash => motor.train = play(rng, motor),
            Self::MissedCounts => plant.sensing.missing = 1e-4,
            Self::PhaseError => plant.sensing.phase_error = 0.5,
            Self::DelayedSupply => plant.sensing.vbus_delay = (plant.config.tick_hz / 200) as usize,
            Self::QuantisedSupply => plant.config.vbus_v_per_lsb = plant.config.supply_nominal_v / 64.0,
            Self::Thermal => {
                let half_load = 0.25 * motor.drive.supply_v.powi(2) / motor.resistance_ohm;
                motor.thermal = Some(Thermal { rise_per_w: 0.2 / half_load, time_constant_s: 3.0 });
            }
            Self::Gravity => {
                let mean = 0.5 * (plant.truth.dead_zone_v[0] + plant.truth.dead_zone_v[1]);
                let torque = 0.3 * mean * motor.torque_constant / motor.resistance_ohm;
                motor.gear_ratio = rng.random_range(1.0..30.0);
                motor.load.mgl_nm = torque * motor.gear_ratio;
                motor.load.gravity_phase = rng.random_range(0.0..TAU);
            }
            Self::OutputRipple => {
                motor.friction.ripple = rng.random_range(0.0..0.15);
                motor.friction.ripple_periods = 1.0;
            }
            Self::FastDecay => motor.drive.decay = Decay::Fast { pwm_hz: 20e3 },
        }
    }
}

/// Play of 0.5 to 5 % of the way at full speed in one time constant; contact far stiffer than the motor and half
/// critically damped.
fn play(rng: &mut ChaCha8Rng, motor: &Motor) -> Train {
    let full_speed = motor.gain() * motor.drive.supply_v;
    let reduced = 0.25 * motor.inertia;
    let contact_rate = 200.0 / motor.time_constant();
    let stiffness = reduced * contact_rate.powi(2);
    Train::Play {
        split: Split { inertia: 0.5, viscous: 0.5 },
        gap_rad: log_range(rng, 0.005, 0.05) * full_speed * motor.time_constant(),
        stiffness,
        damping: reduced * contact_rate,
    }
}

fn log_range(rng: &mut ChaCha8Rng, low: f64, high: f64) -> f64 {
    rng.random_range(low.ln()..high.ln()).exp()
}

/// Constants of the volt form at the head of this file.
struct Volts {
    gain: f64,
    mechanical_s: f64,
    electrical_s: f64,
    emf_share: f64,
    resistance_ohm: f64,
    supply_v: f64,
}

impl Volts {
    fn motor(&self) -> Motor {
        let k = self.emf_share / self.gain;
        let per_ohm = k / self.resistance_ohm;
        let inertia = self.mechanical_s / self.gain * per_ohm;
        let viscous = (1.0 - self.emf_share) / self.gain * per_ohm;
        let inductance = self.electrical_s * self.resistance_ohm;
        Motor::linear(self.resistance_ohm, inductance, k, inertia, viscous, self.supply_v)
    }
}

fn geared(rng: &mut ChaCha8Rng, family: Family, severity: Severity, options: &Options) -> (Motor, u32) {
    let (mechanical_s, counts, rpm) = match family {
        Family::G1 => (rng.random_range(0.02..0.05), 48, rng.random_range(6e3..12e3)),
        Family::G2 => {
            (rng.random_range(0.04..0.09), 4 * rng.random_range(16..=125), rng.random_range(3e3..6e3))
        }
        _ => (rng.random_range(0.08..0.15), 4 * rng.random_range(256..=1024), rng.random_range(80.0..300.0)),
    };
    let supply_v = 12.0;
    let constants = Volts {
        gain: rpm * TAU / 60.0 / supply_v,
        mechanical_s,
        electrical_s: rng.random_range(0.2e-3..1.2e-3),
        emf_share: rng.random_range(0.75..0.98),
        resistance_ohm: log_range(rng, 1.0, 8.0),
        supply_v,
    };
    let mut motor = constants.motor();
    let width = rng.random_range(0.5..2.5);
    let widths = [width, width * rng.random_range(0.7..1.3)];
    let level = rng.random_range(8.5..11.2);
    let levels = [level, (level * rng.random_range(0.9..1.1_f64)).clamp(8.5, 11.2)];
    put_dead_zone(rng, &mut motor, severity, widths, options.cause.unwrap_or(Cause::Friction));
    put_ceiling(&mut motor, widths, levels, options);
    motor.drive.source_ohm = rng.random_range(0.01..0.05) * motor.resistance_ohm;
    if severity == Severity::Harsh {
        put_harshness(rng, &mut motor, width, 0.03);
    }
    if family == Family::G3 {
        // Ripple of friction and cogging belong to the rotor; the encoder sees them from the output of a gear.
        let gear = f64::from(rng.random_range(20..60));
        motor.friction.ripple_periods *= gear;
        motor.load.cogging_periods *= gear;
    }
    (motor, counts)
}

/// Friction with its Stribeck fall and ripple, or a dead zone of the drive.
fn put_dead_zone(
    rng: &mut ChaCha8Rng,
    motor: &mut Motor,
    severity: Severity,
    widths: [f64; 2],
    cause: Cause,
) {
    let harsh = severity == Severity::Harsh;
    let full_speed = motor.gain() * motor.drive.supply_v;
    let breakaway_ratio = rng.random_range(1.0..if harsh { 1.6 } else { 1.5 });
    let stribeck_rad_s = full_speed * log_range(rng, 0.003, if harsh { 0.06 } else { 0.03 });
    let friction = Friction {
        kinetic_nm: widths.map(|volts| volts * motor.torque_constant / motor.resistance_ohm),
        breakaway_ratio,
        stribeck_rad_s,
        ripple: rng.random_range(0.0..0.08),
        ripple_periods: f64::from(rng.random_range(1..4)),
        ripple_phase: rng.random_range(0.0..TAU),
        ..Friction::default()
    };
    match cause {
        Cause::Friction => motor.friction = friction,
        Cause::Input => motor.drive.dead_zone_v = widths,
    }
}

/// The limit stands behind the dead zone of the drive, the level that is asked for at the terminals.
fn put_ceiling(motor: &mut Motor, widths: [f64; 2], levels: [f64; 2], options: &Options) {
    let levels = match options.ceiling {
        Ceiling::Family => levels,
        Ceiling::Absent => return,
        Ceiling::At(share) => [share * motor.drive.supply_v; 2],
    };
    let swallowed = if motor.drive.dead_zone_v == [0.0; 2] { [0.0; 2] } else { widths };
    motor.drive.limit_v = [levels[0] - swallowed[0], levels[1] - swallowed[1]];
}

/// Random torque 1–5 % of the dead zone, drag up to 3 % of the supply at full speed, cogging up to 8 % of the dead zone,
/// gains that differ.
fn put_harshness(rng: &mut ChaCha8Rng, motor: &mut Motor, width: f64, gain_spread: f64) {
    let torque_per_volt = motor.torque_constant / motor.resistance_ohm;
    let full_speed = motor.gain() * motor.drive.supply_v;
    motor.drag = rng.random_range(0.0..0.03) * motor.drive.supply_v * torque_per_volt / full_speed.powi(2);
    motor.load = Load {
        noise_nm: rng.random_range(0.01..0.05) * width * torque_per_volt,
        noise_s: log_range(rng, 0.1, 1.0) * motor.time_constant(),
        cogging_nm: rng.random_range(0.0..0.08) * width * torque_per_volt,
        cogging_periods: f64::from(rng.random_range(4..24)),
        cogging_phase: rng.random_range(0.0..TAU),
        ..Load::default()
    };
    let spread = rng.random_range(-gain_spread..gain_spread);
    motor.drive.gain = [1.0 + spread, 1.0 - spread];
}

/// The paper's motor. Its supply is the paper's largest servo input, 9 V.
fn paper(rng: &mut ChaCha8Rng, severity: Severity, options: &Options) -> (Motor, u32) {
    let exact = severity == Severity::Exact;
    let mut vary = |value: f64| {
        if exact { value } else { value * rng.random_range(-0.2..0.2_f64).exp() }
    };
    let mut motor = Motor::linear(vary(2.2), vary(0.5), vary(0.06), vary(0.0062), vary(0.001), 9.0);
    motor.emf_constant = vary(0.06);
    let width = if exact { 1.2 } else { rng.random_range(0.8..1.6) };
    let skew = if exact { 1.0 } else { rng.random_range(0.7..1.3) };
    let widths = [width, width * skew];
    let knee = if exact { 6.8 } else { rng.random_range(5.2..6.8) };
    put_dead_zone(rng, &mut motor, severity, widths, options.cause.unwrap_or(Cause::Input));
    put_ceiling(&mut motor, widths, [knee + widths[0], knee + widths[1]], options);
    let counts = if exact { 2048 } else { 4 * rng.random_range(125..=1024) };
    if !exact {
        motor.drive.ripple = 0.008;
        motor.drive.ripple_s = 0.05;
    }
    match severity {
        Severity::Exact => {}
        Severity::Nominal => {
            let spread = rng.random_range(-0.015..0.015);
            motor.drive.gain = [1.0 + spread, 1.0 - spread];
        }
        Severity::Harsh => put_harshness(rng, &mut motor, width, 0.015),
    }
    (motor, counts)
}

/// What the firmware is told: the data-sheet speed K·V within 30 %, a hint of the time constant within a factor of 2 for
/// half of the plants.
fn configure(rng: &mut ChaCha8Rng, motor: &Motor, counts_per_rev: u32, options: &Options) -> Config {
    let supply_v = motor.drive.supply_v;
    let rated = motor.gain() * supply_v * rng.random_range(0.7..1.3);
    let hint = motor.time_constant() * log_range(rng, 0.5, 2.0);
    let hinted = rng.random_bool(0.5);
    let stall = supply_v / motor.resistance_ohm;
    Config {
        supply_nominal_v: supply_v as f32,
        counts_per_rev,
        rated_speed_rad_s: rated as f32,
        tick_hz: options.tick_hz,
        time_constant_hint_s: hinted.then_some(hint as f32).into(),
        gear_ratio: 1.0,
        pwm_delay_ticks: 1,
        // 168 MHz / (2 · 20 kHz), centre-aligned.
        pwm_full_scale: 4200,
        // 12-bit converters; full scale 1.5 times the supply, ± 1.5 times the stall current.
        vbus_v_per_lsb: (1.5 * supply_v / 4096.0) as f32,
        current_a_per_lsb: (1.5 * stall / 2048.0) as f32,
        ..Config::EXAMPLE
    }
}
