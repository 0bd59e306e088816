//! The servo case for many seeds: how often chip and workbench are right, and by how much.

use super::{Comparison, HiddenServo, Listener, Options, ServoCase};
use crate::outcome::Outcome;
use crate::system::effects::{DEAD_ZONE_ASYMMETRIC, Effect, VOLTAGE_SATURATION};
use anyhow::{Context, Result};

/// The effects that are hidden.
static HIDDEN: [&Effect; 2] = [&DEAD_ZONE_ASYMMETRIC, &VOLTAGE_SATURATION];
/// Rows of [`Comparison::lines`] that are dead zones, and that are saturations.
const DEAD_ZONES: [usize; 2] = [0, 1];
const SATURATIONS: [usize; 2] = [2, 3];

/// One seed.
#[derive(Clone, Debug)]
pub struct Row {
    /// Draws the servo.
    pub seed: u64,
    /// Chip, workbench and truth.
    pub comparison: Comparison,
    /// What the workbench named.
    pub names: Vec<String>,
    /// True if these are the hidden effects, all of them and nothing else.
    pub right_names: bool,
    /// RMS tracking error without compensation over that with it.
    pub improvement: f64,
}

impl Row {
    /// Runs the servo case; everything is written to a folder that is removed again.
    pub fn run(seed: u64, options: &Options, say: &mut Listener) -> Result<Self> {
        let folder = tempfile::tempdir().context("no temporary folder can be made")?;
        let options = Options { seed, out: folder.path().to_path_buf(), image: options.image.clone() };
        let hidden = HiddenServo::draw(seed);
        let case = ServoCase::run(&hidden, &options, say)?;
        let (outcome, extended) = case.gap(&hidden, say)?;
        let names = names(&outcome);
        Ok(Row {
            seed,
            comparison: Comparison::new(&hidden, &case.commission, &extended)?,
            right_names: names.len() == HIDDEN.len()
                && HIDDEN.iter().all(|hidden| names.iter().any(|name| name == hidden.name)),
            names,
            improvement: case.improvement(),
        })
    }

    /// One line of the table.
    pub fn text(&self) -> String {
        let errors = self.comparison.lines.iter().map(|line| match line.chip_error_percent {
            Some(error) => format!("{error:>7.2}{}", if line.chip.trusted { ' ' } else { '?' }),
            None => "   none ".into(),
        });
        let worst = largest(self.comparison.lines.iter().filter_map(|line| line.workbench_error_percent));
        format!(
            "{:>4} {} {:>7.2} {:>6.1} {}",
            self.seed,
            errors.collect::<String>(),
            worst,
            self.improvement,
            self.names.join(" + ")
        )
    }
}

/// Head of the table whose lines are [`Row::text`].
pub const HEAD: &str = "seed  chip's error, % (? = not trusted)                 worst of  times  named\n     \
                        zone +  zone −   sat. +  sat. −    gain     tau workbench better";

/// Figures over all seeds.
pub fn closing(rows: &[Row]) -> String {
    let chip = |at: &[usize]| {
        sorted(rows, |row| at.iter().filter_map(|&i| row.comparison.lines[i].chip_error_percent).collect())
    };
    let trusted_worst = largest(rows.iter().flat_map(|row| {
        row.comparison
            .lines
            .iter()
            .filter(|line| line.chip.trusted)
            .filter_map(|line| line.chip_error_percent)
    }));
    let right = rows.iter().filter(|row| row.right_names).count();
    format!(
        "dead zone, chip: 95 % within {:.2} %; saturation, chip: 95 % within {:.2} %; worst trusted error {:.2} %\n\
         right names: {right} of {} seeds",
        percentile(&chip(&DEAD_ZONES), 0.95),
        percentile(&chip(&SATURATIONS), 0.95),
        trusted_worst,
        rows.len()
    )
}

fn names(outcome: &Outcome) -> Vec<String> {
    outcome.effects.iter().map(|effect| effect.name.clone()).collect()
}

fn sorted(rows: &[Row], of: impl Fn(&Row) -> Vec<f64>) -> Vec<f64> {
    let mut values: Vec<f64> = rows.iter().flat_map(of).map(f64::abs).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

/// The smallest value that at least `share` of the sorted values do not exceed.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}
