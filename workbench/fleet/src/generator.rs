//! A drawn fleet: motors of one kind that differ, of which one drifts, one steps and one gets a new effect. The truth is the reference
//! plant, which no line of the plant that fits has entered.

use crate::moment::Moment;
use anyhow::{Context, Result};
use proving::synthetic::cases::hidden::{KINDS, Kind};
use proving::synthetic::cases::{self, Case, Rig, Set, Spec};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use reference_plant::Friction;
use std::path::Path;
use truing_core::system::effects::{self, Effect};
use truing_report::report::write_atomically;

/// Noise of the speed, a part of full speed: a good encoder.
const NOISE: f64 = 0.003;
/// Coulomb friction of the mean unit, a part of the torque at standstill: as small gear motors have it.
const FRICTION: f64 = 0.04;
/// Relative standard deviation of the friction between units.
pub const FRICTION_SPREAD: f64 = 0.15;
/// Standard deviation of resistance, constant and inertia between units, in tolerances of the model file: makers keep them.
pub const BASE_SPREAD: f64 = 0.4;
/// An effect that is to be found changes the speed by so many times the noise, rms, at least: what a pair in a drawn case must do, thrice.
const VISIBLE: f64 = 1.0;
/// The first day.
const FIRST_DAY: &str = "2026-03-01";

/// What becomes of a unit.
#[derive(Clone, Debug, PartialEq)]
pub enum Fate {
    /// Nothing.
    Quiet,
    /// Its friction grows by this part from the first day to the last.
    Drifts(f64),
    /// Its friction grows by this part on a day.
    Steps(f64, u32),
    /// It gets an effect on a day, with these parameters.
    Gets(&'static Effect, Vec<f64>, u32),
}

/// A kind of motor, with the model file that all units have.
#[derive(Debug)]
pub struct Fleet {
    case: Case,
    seed: u32,
    /// Days, a log each.
    pub days: u32,
    /// Rows of a log.
    pub rows: usize,
}

impl Fleet {
    /// Draws the kind of motor.
    pub fn draw(seed: u32, days: u32, rows: usize) -> Self {
        let spec = Spec {
            rows,
            current: Some(true),
            dirty: Some(false),
            noise: Some(NOISE),
            ..Spec::new(Set::Nothing)
        };
        Self { case: cases::draw(&spec, seed), seed, days, rows }
    }

    /// What a unit measures on a day.
    pub fn log(&self, unit: u32, day: u32, fate: &Fate) -> String {
        let rig = self.rig(unit, day, fate);
        rig.excite(self.rows, self.number(unit, day)).to_csv()
    }

    /// A random number of unit and day.
    fn number(&self, unit: u32, day: u32) -> u64 {
        u64::from(self.seed) << 40 | u64::from(unit) << 16 | u64::from(day)
    }

    /// A unit's resistance, constant, inertia and friction over those of the mean unit.
    pub fn factors(&self, unit: u32) -> [f64; 4] {
        let mut rng = ChaCha8Rng::seed_from_u64(self.number(unit, u32::from(u16::MAX)));
        let base = BASE_SPREAD * self.case.rig.natural.tolerance;
        [base, base, base, FRICTION_SPREAD].map(|spread| {
            let z: f64 = StandardNormal.sample(&mut rng);
            1.0 + spread * z.clamp(-2.0, 2.0)
        })
    }

    /// A unit's Coulomb friction on its first day, N m.
    pub fn friction_nm(&self, unit: u32) -> f64 {
        FRICTION * self.case.rig.natural.torque * self.factors(unit)[3]
    }

    /// A unit on a day.
    fn rig(&self, unit: u32, day: u32, fate: &Fate) -> Rig {
        let mut rig = self.case.rig.clone();
        let motor = &mut rig.subject.motor;
        let [resistance, constant, inertia, _] = self.factors(unit);
        motor.resistance_ohm *= resistance;
        motor.torque_constant *= constant;
        motor.emf_constant *= constant;
        motor.inertia *= inertia;
        let grown = match *fate {
            Fate::Drifts(part) => part * f64::from(day) / f64::from(self.days - 1),
            Fate::Steps(part, from) if day >= from => part,
            _ => 0.0,
        };
        motor.friction = Friction::coulomb(self.friction_nm(unit) * (1.0 + grown));
        if let Fate::Gets(effect, values, from) = fate
            && day >= *from
            && let Some(kind) = KINDS.iter().find(|kind| kind.effect == *effect)
        {
            (kind.put)(values, None, &rig.natural, &mut rig.subject);
        }
        rig
    }

    /// An effect that a unit may get on a day, plainly visible there, which friction neither excludes nor hides.
    pub fn new_effect(&self, unit: u32, day: u32) -> Fate {
        let mut rng = ChaCha8Rng::seed_from_u64(self.number(unit, day) ^ 1 << 63);
        let friction = KINDS.iter().find(|kind| kind.effect == &effects::COULOMB_FRICTION);
        let may =
            |kind: &&&Kind| !kind.needs_tacho && friction.is_none_or(|friction| !friction.excludes(kind));
        let kinds: Vec<&&Kind> = KINDS.iter().filter(may).collect();
        loop {
            let kind = kinds[rng.random_range(0..kinds.len())];
            let fate = Fate::Gets(kind.effect, (kind.draw)(&mut rng, &self.case.rig.natural), day);
            if self.visible(unit, day, &fate) > VISIBLE {
                return fate;
            }
        }
    }

    /// Rms change of the speed by a fate on a day, over the noise.
    fn visible(&self, unit: u32, day: u32, fate: &Fate) -> f64 {
        let speed = |fate: &Fate| {
            let rig = self.rig(unit, day, fate);
            rig.excite(self.rows, self.number(unit, day)).column("omega_rad_s").to_vec()
        };
        let noise = NOISE * self.case.answer.full_speed;
        cases::rms_difference(&speed(&Fate::Quiet), &speed(fate)) / noise
    }

    /// Writes model file, logs and `manifest.csv` of some units into a folder.
    pub fn write(&self, folder: &Path, fates: &[Fate]) -> Result<()> {
        let first: Moment = FIRST_DAY.parse().map_err(anyhow::Error::msg)?;
        write_atomically(&folder.join("sheet.toml"), &self.case.model)?;
        let mut manifest = csv::Writer::from_writer(Vec::new());
        manifest.write_record(["unit", "time", "model", "log"])?;
        for (unit, fate) in (1..).zip(fates) {
            for day in 0..self.days {
                let name = format!("logs/{unit:03}-{:02}.csv", day + 1);
                write_atomically(&folder.join(&name), &self.log(unit, day, fate))?;
                let (unit, time) = (format!("{unit:03}"), (first + day).to_string());
                manifest.write_record([&unit, &time, "sheet.toml", &name])?;
            }
        }
        let text = String::from_utf8(manifest.into_inner()?).context("the manifest is text")?;
        write_atomically(&folder.join("manifest.csv"), &text)
    }
}
