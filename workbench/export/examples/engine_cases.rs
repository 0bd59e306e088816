//! Writes the models that `cargo xtask engines` runs: every effect of the library alone, then random triples.
//!
//! `engine_cases FOLDER [TRIPLES]`. Sizes are those from which fits start, in the natural magnitudes of the motor at 10 V.

use std::path::Path;
use truing_core::gap::dataset::Scales;
use truing_core::system::effects::{Effect, LIBRARY, Meaning};

/// The motor of the cases: a gear motor of 12 V. R, K, J, b and L.
const MOTOR: [f64; 5] = [2.2, 0.06, 6.2e-5, 1e-5, 0.0];
/// The largest input, V.
const VOLTS: f64 = 10.0;

/// xorshift64*: the same cases on every machine.
struct Draw(u64);

impl Draw {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_F491_4F6C_DD1D) >> 33) % end as u64) as usize
    }
}

fn scales([r, k, j, b, _]: [f64; 5]) -> Scales {
    let (torque, damping) = (k / r * VOLTS, b + k * k / r);
    let (speed, time) = (torque / damping, j / damping);
    Scales {
        input: VOLTS,
        torque,
        speed,
        motion: speed,
        time,
        current: VOLTS / r,
        resistance: r,
        inertia: j,
        reachable: speed,
        duration: 5.0,
    }
}

/// One row of starts; where a fit looks for them in the log, values within the bounds.
fn values(effect: &Effect, scales: &Scales, draw: &mut Draw) -> Vec<f64> {
    let rows = effect.starts.rows();
    let row = (!rows.is_empty()).then(|| rows[draw.below(rows.len())]);
    let value = |(which, parameter): (usize, &truing_core::system::effects::Parameter)| {
        let natural = match parameter.meaning {
            Meaning::PeriodsPerTurn => [3.0, 7.0, 12.5][draw.below(3)],
            Meaning::Phase => [0.4, -1.1, 2.0][draw.below(3)],
            Meaning::Frequency => return [0.7, 2.0, 5.0][draw.below(3)],
            _ => parameter.lower.max(0.0) + 0.1 + 0.05 * draw.below(5) as f64,
        };
        let start = row.map_or(parameter.default.unwrap_or(natural.min(parameter.upper)), |row| row[which]);
        start * scales.of(parameter.scale)
    };
    effect.parameters.iter().enumerate().map(value).collect()
}

fn written(motor: [f64; 5], effects: &[(&Effect, Vec<f64>)]) -> String {
    let [r, k, j, b, l] = motor;
    let mut text = format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = {r:?}\nL_h = {l:?}\nKt_nm_per_a = {k:?}\n\
         J_kgm2 = {j:?}\nb_nms_per_rad = {b:?}\n[supply]\nnominal_v = 12.0\n"
    );
    for (effect, values) in effects {
        text += &format!("[known.{}]\n", effect.name);
        for (parameter, value) in effect.parameters.iter().zip(values) {
            text += &format!("{} = {value:?}\n", parameter.name);
        }
    }
    text
}

fn main() -> std::io::Result<()> {
    let arguments: Vec<String> = std::env::args().collect();
    let folder = Path::new(arguments.get(1).map_or("target/engines", String::as_str));
    let triples = arguments.get(2).and_then(|count| count.parse().ok()).unwrap_or(60);
    std::fs::create_dir_all(folder)?;
    let mut draw = Draw(0x5EED_0038);
    std::fs::write(folder.join("nominal.toml"), written(MOTOR, &[]))?;
    for effect in LIBRARY {
        let drawn = values(effect, &scales(MOTOR), &mut draw);
        std::fs::write(folder.join(format!("one_{}.toml", effect.name)), written(MOTOR, &[(effect, drawn)]))?;
    }
    for number in 0..triples {
        let [r, k, j, b, _] = MOTOR;
        let factor = |draw: &mut Draw| [0.5, 0.8, 1.0, 1.5, 2.5][draw.below(5)];
        let mut motor = [r * factor(&mut draw), k * factor(&mut draw), j * factor(&mut draw), b, 0.0];
        motor[4] = if draw.below(2) == 0 { 0.0 } else { 5e-4 * motor[0] };
        let mut chosen: Vec<&Effect> = Vec::new();
        while chosen.len() < 3 {
            let next = LIBRARY[draw.below(LIBRARY.len())];
            // Effects of one family replace each other, but for those that have a place of their own.
            let clash = |other: &&Effect| {
                *other == next
                    || (other.family == next.family
                        && next.family != truing_core::system::effects::Family::Own)
            };
            if !chosen.iter().any(clash) {
                chosen.push(next);
            }
        }
        let drawn: Vec<_> =
            chosen.into_iter().map(|effect| (effect, values(effect, &scales(motor), &mut draw))).collect();
        std::fs::write(folder.join(format!("three_{number:02}.toml")), written(motor, &drawn))?;
    }
    Ok(())
}
