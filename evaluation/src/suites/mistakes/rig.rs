//! Three families of motors, simulated with a fine fixed step that shares no code with the workbench, and their files.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::fmt::Write;
use truing::system::effects::{COULOMB_FRICTION, DEAD_ZONE};

/// Nothing missing, a dead zone, dry friction behind a gear.
pub const FAMILIES: usize = 3;
/// Rows of a record.
const ROWS: usize = 2000;
/// Rows a time constant.
const ROWS_PER_TAU: f64 = 20.0;
/// Steps of the simulator a row.
const STEPS: usize = 50;

/// A record by columns.
pub type Columns = Vec<(&'static str, Vec<f64>)>;

/// The files of a user.
#[derive(Clone, Debug)]
pub struct Files {
    pub family: usize,
    pub volts: f64,
    /// Section, key and number of the model file.
    pub model: Vec<(&'static str, &'static str, f64)>,
    pub log: Columns,
    pub holdout: Columns,
    /// Another motor's record, for the kind that mixes them up.
    pub stranger: Columns,
}

struct Motor {
    family: usize,
    volts: f64,
    resistance: f64,
    constant: f64,
    inertia: f64,
    viscous: f64,
    friction: f64,
    zone: f64,
    gear: f64,
}

impl Motor {
    fn draw(random: &mut ChaCha8Rng, family: usize) -> Self {
        let volts = [12.0, 24.0][random.random_range(0..2)];
        let resistance = random.random_range(0.8..6.0);
        let constant: f64 = random.random_range(0.02..0.09);
        let tau = random.random_range(0.06..0.3);
        let viscous = 0.05 * constant * constant / resistance;
        let inertia = tau * (constant * constant / resistance + viscous);
        let stall = volts * constant / resistance;
        Self {
            family,
            volts,
            resistance,
            constant,
            inertia,
            viscous,
            friction: if family == 2 { 0.1 * stall } else { 0.0 },
            zone: if family == 1 { 0.12 * volts } else { 0.0 },
            gear: if family == 2 { 20.0 } else { 1.0 },
        }
    }

    fn tau(&self) -> f64 {
        self.inertia / (self.constant * self.constant / self.resistance + self.viscous)
    }

    /// Simulates a profile; speed noise of 0.3 % of full speed.
    fn record(&self, profile: &[f64], random: &mut ChaCha8Rng) -> Columns {
        let row_s = self.tau() / ROWS_PER_TAU;
        let fastest = self.volts / self.constant;
        let (mut omega, mut theta) = (0.0_f64, 0.0_f64);
        let mut noise = |size: f64| -> f64 {
            let drawn: f64 = StandardNormal.sample(&mut *random);
            size * drawn
        };
        let names = ["t_s", "u_v", "omega_rad_s", "theta_rad", "i_a"];
        let mut columns: Columns = names.iter().map(|name| (*name, Vec::new())).collect();
        for (row, u) in profile.iter().enumerate() {
            let beyond = u.signum() * (u.abs() - self.zone).max(0.0);
            let current = |omega: f64| (beyond - self.constant * omega) / self.resistance;
            let values = [
                row as f64 * row_s,
                *u,
                omega + noise(0.003 * fastest),
                (theta / 0.003).round() * 0.003,
                current(omega) + noise(0.003 * self.volts / self.resistance),
            ];
            for (column, value) in columns.iter_mut().zip(values) {
                column.1.push(value);
            }
            let step = row_s / STEPS as f64;
            for _ in 0..STEPS {
                let drive = self.constant * current(omega) - self.viscous * omega;
                let free = omega + step * drive / self.inertia;
                let brake = step * self.friction / self.inertia;
                omega = free.signum() * (free.abs() - brake).max(0.0);
                theta += step * omega;
            }
        }
        columns
    }
}

/// Steps, ramps and reversals in both directions.
fn profile(volts: f64, random: &mut ChaCha8Rng) -> Vec<f64> {
    let mut all = Vec::new();
    while all.len() < ROWS {
        let length = random.random_range(20..120);
        let (from, to) = (random.random_range(-1.0..1.0), random.random_range(-1.0..1.0));
        let ramp = random.random_bool(0.3);
        let value = |k: usize| if ramp { from + (to - from) * k as f64 / length as f64 } else { from };
        all.extend((0..length).map(|k| 0.95 * volts * value(k)));
    }
    all.truncate(ROWS);
    all
}

/// The right files of a motor.
pub fn draw(seed: u64, family: usize) -> Files {
    let mut random =
        ChaCha8Rng::seed_from_u64(seed.wrapping_mul(31).wrapping_add(family as u64) ^ 0x6d69_7374);
    let motor = Motor::draw(&mut random, family);
    let record = |motor: &Motor, random: &mut ChaCha8Rng| {
        let voltages = profile(motor.volts, random);
        motor.record(&voltages, random)
    };
    let log = record(&motor, &mut random);
    let holdout = record(&motor, &mut random);
    let other = Motor {
        constant: 2.2 * motor.constant,
        inertia: 2.5 * motor.inertia,
        ..Motor { ..Motor::draw(&mut random, motor.family) }
    };
    let other = Motor { volts: motor.volts, resistance: 1.4 * motor.resistance, ..other };
    let stranger = record(&other, &mut random);
    let model = vec![
        ("motor", "R_ohm", motor.resistance),
        ("motor", "Kt_nm_per_a", motor.constant),
        ("motor", "Ke_vs_per_rad", motor.constant),
        ("motor", "J_kgm2", motor.inertia),
        ("motor", "b_nms_per_rad", motor.viscous),
        ("motor", "gear_ratio", motor.gear),
        ("supply", "nominal_v", motor.volts),
    ];
    Files { family, volts: motor.volts, model, log, holdout, stranger }
}

impl Files {
    /// What is missing in the model.
    pub fn truth(&self) -> Vec<&'static str> {
        match self.family {
            0 => vec![],
            1 => vec![DEAD_ZONE.name],
            _ => vec![COULOMB_FRICTION.name],
        }
    }

    /// Multiplies a column of both records.
    pub fn scale(&mut self, column: &str, factor: f64) {
        self.change(column, |value| factor * value);
    }

    /// Changes a column of both records.
    pub fn change(&mut self, column: &str, change: impl Fn(f64) -> f64) {
        for record in [&mut self.log, &mut self.holdout] {
            if let Some(found) = record.iter_mut().find(|own| own.0 == column) {
                found.1.iter_mut().for_each(|value| *value = change(*value));
            }
        }
    }

    /// Changes all columns of both records.
    pub fn records(&mut self, change: impl Fn(&mut Columns)) {
        change(&mut self.log);
        change(&mut self.holdout);
    }

    /// Leaves columns out.
    pub fn without(&mut self, names: &[&str]) {
        self.records(|record| record.retain(|column| !names.contains(&column.0)));
    }

    /// Multiplies a number of the model file.
    pub fn key(&mut self, key: &str, factor: f64) {
        let found = self.model.iter_mut().find(|own| own.1 == key).expect("a key of the file");
        found.2 *= factor;
    }

    /// Leaves keys out.
    pub fn without_key(&mut self, key: &str) {
        self.model.retain(|own| own.1 != key);
    }

    pub fn model_text(&self) -> String {
        let mut text = String::from("schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n");
        for section in ["motor", "supply", "encoder", "sensors", "tolerance"] {
            let keys: Vec<_> = self.model.iter().filter(|own| own.0 == section).collect();
            if !keys.is_empty() {
                writeln!(text, "[{section}]").expect("a text");
            }
            for (_, key, value) in keys {
                writeln!(text, "{key} = {value:?}").expect("a text");
            }
        }
        text
    }

    pub fn log_text(&self) -> String {
        csv(&self.log)
    }

    pub fn holdout_text(&self) -> String {
        csv(&self.holdout)
    }
}

fn csv(columns: &Columns) -> String {
    let names: Vec<&str> = columns.iter().map(|column| column.0).collect();
    let mut text = names.join(",") + "\n";
    for row in 0..columns.iter().map(|column| column.1.len()).max().unwrap_or(0) {
        let cells: Vec<String> = columns.iter().map(|column| format!("{:.8}", column.1[row])).collect();
        writeln!(text, "{}", cells.join(",")).expect("a text");
    }
    text
}
