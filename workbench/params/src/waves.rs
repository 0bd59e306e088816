//! What a model knows of gravity and cogging, as a table for the servo.
//!
//! The encoder's shaft stands at 2π·count/counts_per_rev, as in a log. What holds a torque T there is the voltage −T·R/Kt at the winding,
//! which the drive makes of a voltage smaller by its gain.

use servo::config::Config;
use std::f64::consts::TAU;
use truing_core::system::model::{Known, Model};
use truing_core::system::plant::laws::Law;
use truing_servo::device::place_load::{PlaceLoad, Sine};

/// A period has so many cycles of its slowest sine at most, until the others have whole ones in it.
const MOST_CYCLES: u32 = 64;
/// Relative half width (95 %) of a sine from which on it is not trusted: one that is wrong by half of itself still halves the load.
const TRUST_LIMIT: f64 = 0.5;

/// One sine of a model, as a voltage over the angle of the encoder's shaft.
pub struct Wave {
    /// The effect.
    pub name: &'static str,
    /// Cycles a turn.
    pub per_turn: f64,
    /// V.
    pub amplitude_v: f64,
    /// rad.
    pub phase_rad: f64,
    /// Half width (95 %) of the voltage, as a share of the amplitude.
    pub u95: f64,
}

impl Wave {
    /// Why not to trust it by itself.
    pub fn doubt(&self) -> Option<String> {
        let Self { amplitude_v, u95, .. } = self;
        let (wide, most) = (100.0 * u95, 100.0 * TRUST_LIMIT);
        (*u95 > TRUST_LIMIT).then(|| {
            format!("{amplitude_v:.4} V has a half width (95 %) of {wide:.0} % of it, more than {most:.0} %")
        })
    }
}

/// All of a model, the slowest one first.
pub fn waves(model: &Model) -> Vec<Wave> {
    let mut waves: Vec<Wave> = model.known.iter().filter_map(|known| wave(model, known)).collect();
    waves.sort_by(|a, b| a.per_turn.total_cmp(&b.per_turn));
    waves
}

fn wave(model: &Model, known: &Known) -> Option<Wave> {
    let (whole, mut alone) = (model.physics(), model.base());
    (known.effect.apply)(&known.values, &mut alone);
    let torque = alone.torques.first()?;
    let [a, b, c] = torque.parameters;
    let gear = alone.gear_ratio;
    let (torque_nm, per_turn, phase) = match torque.law {
        Law::Gravity => (a / gear, 1.0 / gear, b),
        Law::Cogging => (a, b, c),
        _ => return None,
    };
    let std = |place: usize| known.stds.get(place).copied().flatten().unwrap_or(0.0);
    let phase_std = std(known.stds.len().saturating_sub(1));
    // As many cycles a turn as there are poles, where the log agrees.
    let (cycles, cycles_std) = (per_turn.round(), if known.stds.len() > 2 { std(1) } else { 0.0 });
    let whole_number = (per_turn - cycles).abs() < 3.0 * cycles_std && cycles > 0.0;
    Some(Wave {
        name: known.effect.name,
        per_turn: if whole_number { cycles } else { per_turn } / whole.sensor_scale,
        amplitude_v: torque_nm * whole.resistance / whole.kt / whole.drive_gain,
        phase_rad: phase.rem_euclid(TAU),
        u95: 1.96 * (std(0) / a).hypot(phase_std),
    })
}

/// The table of these; `None`: there is none.
pub fn table(waves: &[Wave], config: &Config) -> Option<PlaceLoad> {
    let slowest = waves.first()?.per_turn;
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
    let sine = |wave: &Wave| Sine {
        cycles: cycles(wave, period).round() as u16,
        amplitude_v: wave.amplitude_v,
        phase_rad: wave.phase_rad,
    };
    Some(PlaceLoad {
        on: true,
        trusted: true,
        absolute: false,
        period_counts: period as u32,
        constant_v: 0.0,
        sines: waves.iter().map(sine).collect(),
    })
}
