//! The chip's estimates, the workbench's and the hidden truth side by side.

use super::HiddenServo;
use crate::commands::paper::denominator;
use anyhow::Result;
use serde::Serialize;
use truing_core::system::effects::{DEAD_ZONE, DEAD_ZONE_ASYMMETRIC, Effect, VOLTAGE_SATURATION};
use truing_core::system::model::{self, Model};
use truing_report::report::section::{Section, Table};
use truing_servo::device::commission_report::{CommissionJson, Number};

/// One quantity.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Line {
    /// What it is.
    pub quantity: &'static str,
    /// Its unit.
    pub unit: &'static str,
    /// What was hidden.
    pub truth: f64,
    /// What the chip found.
    pub chip: Number,
    /// Its error, %.
    pub chip_error_percent: Option<f64>,
    /// What the workbench found; `None`: it named nothing that holds this quantity.
    pub workbench: Option<f64>,
    /// Its error, %.
    pub workbench_error_percent: Option<f64>,
}

/// All quantities.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Comparison {
    /// In the order of the commissioning's report.
    pub lines: Vec<Line>,
}

impl Comparison {
    /// `extended` is the text of the model with the effects that the workbench has named.
    pub fn new(hidden: &HiddenServo, chip: &CommissionJson, extended: &str) -> Result<Self> {
        let numbers = |name: &str, text: &str| {
            Ok::<_, anyhow::Error>(Found::from(&model::parse(name, text)?).numbers())
        };
        let workbench = numbers("model-after.toml", extended)?;
        let truth = numbers("hidden-motor.toml", &hidden.motor_toml())?.map(|it| it.unwrap_or(f64::NAN));
        let lines = chip.found.numbers().into_iter().zip(truth.into_iter().zip(workbench)).map(
            |((quantity, unit, chip), (truth, workbench))| {
                let error = |value: f64| 100.0 * (value / truth - 1.0);
                Line {
                    quantity,
                    unit,
                    truth,
                    chip,
                    chip_error_percent: chip.value.map(error),
                    workbench,
                    workbench_error_percent: workbench.map(error),
                }
            },
        );
        Ok(Comparison { lines: lines.collect() })
    }

    /// The table for a terminal of 80 columns.
    pub fn text(&self) -> String {
        let mut text =
            String::from("                          truth      chip   error  trusted  workbench   error\n");
        for [quantity, truth, chip, chip_error, trusted, workbench, workbench_error] in self.cells() {
            text += &format!(
                "{quantity:<21} {truth:>9} {chip:>9} {chip_error:>7} {trusted:>8} {workbench:>10} {workbench_error:>7}\n"
            );
        }
        text.trim_end().to_string()
    }

    /// The table for the report.
    pub fn section(&self) -> Section {
        let header = ["quantity", "hidden truth", "chip", "error, %", "trusted", "workbench", "error, %"];
        Section {
            title: "Chip, workbench and hidden truth".into(),
            text: vec![
                "A servo with a hidden nonlinearity was drawn from the seed before anything ran. The chip identified it by \
                 itself, and the workbench found it in the log; neither had seen this truth. A dead zone \
                 and a saturation are terminal voltages; the saturation of a limit behind a dead zone is their sum."
                    .into(),
            ],
            tables: vec![Table {
                caption: "Three answers to the same question".into(),
                header: header.map(String::from).to_vec(),
                rows: self.cells().into_iter().map(|cells| cells.to_vec()).collect(),
            }],
            ..Section::default()
        }
    }

    fn cells(&self) -> Vec<[String; 7]> {
        let number = |value: Option<f64>| value.map_or("not seen".into(), |value| format!("{value:.4}"));
        let error = |value: Option<f64>| value.map_or("–".into(), |value| format!("{value:+.2}"));
        let row = |line: &Line| {
            [
                format!("{}, {}", line.quantity, line.unit),
                number(Some(line.truth)),
                number(line.chip.value),
                error(line.chip_error_percent),
                if line.chip.trusted { "yes".into() } else { "no".into() },
                number(line.workbench),
                error(line.workbench_error_percent),
            ]
        };
        self.lines.iter().map(row).collect()
    }
}

/// The same quantities in an extended model.
struct Found {
    dead_zone: Option<[f64; 2]>,
    limit: Option<f64>,
    gain: f64,
    time_constant: f64,
}

impl Found {
    fn from(model: &Model) -> Self {
        let named = |effect: &Effect| model.known.iter().find(|known| known.effect == effect);
        let asymmetric = named(&DEAD_ZONE_ASYMMETRIC).map(|known| [known.values[0], known.values[1]]);
        let symmetric = named(&DEAD_ZONE).map(|known| [known.values[0]; 2]);
        let plant = model.physics();
        // The sum of the time constants of speed: what the chip finds.
        let [_, sum, damping] = denominator(&plant);
        Found {
            dead_zone: asymmetric.or(symmetric),
            limit: named(&VOLTAGE_SATURATION).map(|known| known.values[0]),
            gain: plant.dc_gain(),
            time_constant: sum / damping,
        }
    }

    /// In the order of the commissioning's report.
    fn numbers(&self) -> [Option<f64>; 6] {
        let zone = |side: usize| self.dead_zone.map(|zone| zone[side]);
        // Terminal voltage of the limit: behind a dead zone it is reached later.
        let limit = |side: usize| self.limit.map(|limit| limit + zone(side).unwrap_or(0.0));
        [zone(0), zone(1), limit(0), limit(1), Some(self.gain), Some(self.time_constant)]
    }
}
