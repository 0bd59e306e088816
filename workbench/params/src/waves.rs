//! What a model knows of gravity, cogging, a spring, a constant load and an offset of the drive, as a table for the servo.
//!
//! The encoder's shaft stands at 2π·count/counts_per_rev, as in a log. What holds a torque T there is the voltage −T·R/Kt at the winding,
//! which the drive makes of a voltage smaller by its gain. What pushes the same way everywhere is the table's constant: as a wider dead
//! zone on one side it would come and go with the sign of the motion.

use servo::config::Config;
use std::f64::consts::TAU;
use truing_core::system::model::{Known, Model};
use truing_core::system::plant::laws::Law;
use truing_servo::device::place_load::{PlaceLoad, Sine};

/// A period has so many cycles of its slowest sine at most, until the others have whole ones in it.
const MOST_CYCLES: u32 = 64;
/// Relative half width (95 %) of a term from which on it is not trusted: one that is wrong by half of itself still halves the error.
pub const TRUST_LIMIT: f64 = 0.5;
/// Share of the nominal supply at which the sine of a spring turns back: at half of it the sine is 5 % short. The rest is for other loads.
const SPRING_SHARE: f64 = 0.35;

/// One sine of a model, as a voltage over the angle of the encoder's shaft, or what is the same everywhere.
pub struct Wave {
    /// The effect.
    pub name: &'static str,
    /// Cycles a turn; 0: the same everywhere.
    pub per_turn: f64,
    /// V. Signed where it is the same everywhere.
    pub amplitude_v: f64,
    /// rad.
    pub phase_rad: f64,
    /// Half width (95 %), V.
    pub u95: f64,
}

/// All of a model, the slowest one first. `supply_v`: nominal.
pub fn waves(model: &Model, supply_v: f64) -> Vec<Wave> {
    let mut waves: Vec<Wave> = model.known.iter().filter_map(|known| wave(model, known, supply_v)).collect();
    waves.sort_by(|a, b| a.per_turn.total_cmp(&b.per_turn));
    waves
}

fn wave(model: &Model, known: &Known, supply_v: f64) -> Option<Wave> {
    let (whole, mut alone) = (model.physics(), model.base());
    (known.effect.apply)(&known.values, &mut alone);
    let (gear, offset_v) = (alone.gear_ratio, alone.drive_offset - model.base().drive_offset);
    let volts = |torque_nm: f64| torque_nm * whole.resistance / whole.kt;
    let std = |place: usize| known.stds.get(place).copied().flatten().unwrap_or(0.0);
    let law = alone.torques.first().map(|it| (it.law, it.parameters));
    let (a, at_winding, [per_turn, per_turn_std], [phase, phase_std]) = match law {
        Some((Law::Gravity, [a, b, _])) => (a, volts(a / gear), [1.0 / gear, 0.0], [b, std(1)]),
        Some((Law::Cogging, [a, b, c])) => (a, volts(a), [b, std(1)], [c, std(2)]),
        Some((Law::Constant, [a, ..])) => (a, -volts(a), [0.0; 2], [0.0; 2]),
        // One that is cubic alone is no sine.
        Some((Law::Spring, [a, rest, _])) if a > 0.0 => {
            let steep = volts(a) / (SPRING_SHARE * supply_v);
            let per_turn = if steep < 1.0 { (1.0 / steep).floor().recip() } else { steep.ceil() };
            (a, volts(a) / per_turn, [per_turn, 0.0], [-rest * per_turn, 0.0])
        }
        None if offset_v != 0.0 => (offset_v, -offset_v, [0.0; 2], [0.0; 2]),
        _ => return None,
    };
    // As many cycles a turn as there are poles, where the log agrees.
    let cycles = per_turn.round();
    let whole_number = (per_turn - cycles).abs() < 3.0 * per_turn_std && cycles > 0.0;
    let amplitude_v = at_winding / whole.drive_gain;
    Some(Wave {
        name: known.effect.name,
        per_turn: if whole_number { cycles } else { per_turn } / whole.sensor_scale,
        amplitude_v,
        phase_rad: phase.rem_euclid(TAU),
        u95: 1.96 * (std(0) / a).hypot(phase_std) * amplitude_v.abs(),
    })
}

/// The table of these; `None`: there is none.
pub fn table(waves: &[Wave], config: &Config) -> Option<PlaceLoad> {
    let (constant, waves): (Vec<&Wave>, Vec<&Wave>) = waves.iter().partition(|wave| wave.per_turn == 0.0);
    // A constant alone repeats itself after any way.
    let slowest = Some(waves.first().or(constant.first())?.per_turn).filter(|it| *it > 0.0).unwrap_or(1.0);
    let counts = f64::from(config.counts_per_rev);
    let period = |cycles: u32| (f64::from(cycles) * counts / slowest).round();
    let cycles = |wave: &Wave, period: f64| wave.per_turn * period / counts;
    // By how much of a cycle, in millionths, the worst one is off after a turn.
    let off = |period: f64| {
        let off = waves.iter().map(|wave| (cycles(wave, period) - cycles(wave, period).round()).abs());
        (off.fold(0.0, f64::max) * counts / period * 1e6).round()
    };
    let periods = (1..=MOST_CYCLES).map(period).filter(|period| *period < f64::from(1 << 24));
    let period = periods.min_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    let sine = |wave: &&Wave| Sine {
        cycles: cycles(wave, period).round() as u16,
        amplitude_v: wave.amplitude_v,
        phase_rad: wave.phase_rad,
    };
    Some(PlaceLoad {
        on: true,
        trusted: true,
        absolute: false,
        period_counts: period as u32,
        constant_v: constant.iter().fold(0.0, |sum, wave| sum + wave.amplitude_v),
        sines: waves.iter().map(sine).collect(),
    })
}
