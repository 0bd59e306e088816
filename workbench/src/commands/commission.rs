//! `truing commission`: the firmware excites its motor and says what it is.

use super::firmware::Firmware;
use super::profile;
use crate::commission_report::{CommissionJson, Number, Params};
use crate::motor::write_whole;
use crate::session::{Done, SessionResult, Task};
use anyhow::Context;
use clap::Args;
use servo::config::Config;
use servo::referencing::Referencing;
use std::path::PathBuf;

/// Length of a commissioning when nothing else is asked for, s.
pub const BUDGET_S: f64 = 5.0;

/// Arguments of `truing commission`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Which servo.
    #[command(flatten)]
    pub firmware: Firmware,
    /// Length of the commissioning, s.
    #[arg(long, default_value_t = BUDGET_S)]
    pub budget_s: f64,
    /// Keep the result for `truing track --params`.
    #[arg(long)]
    pub save: Option<PathBuf>,
    /// Have the servo store the result, so that it survives a power cut.
    #[arg(long)]
    pub store: bool,
    /// Write the result as JSON, schema truing-commission/1.
    #[arg(long)]
    pub json: Option<PathBuf>,
    /// Write every control tick as a log in format 1.
    #[arg(long)]
    pub log: Option<PathBuf>,
}

/// Runs and reports.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let setup = arguments.firmware.axis()?;
    let config = setup.config;
    let task = Task::Commission {
        budget_s: budget(arguments.budget_s)?,
        seed: arguments.firmware.seed as u32,
    };
    let tasks = [Some(task), arguments.store.then_some(Task::Store)];
    let tasks: Vec<Task> = tasks.into_iter().flatten().collect();
    let result = arguments.firmware.run(&setup, &tasks)?;
    let report = outcome(&result, &config)?;
    print(&report);
    if result.done.contains(&Done::Stored) {
        println!("{:21} by the servo", "stored");
    }
    if let Some(path) = &arguments.json {
        write_whole(path, &(serde_json::to_string_pretty(&report)? + "\n"))?;
    }
    if let Some(path) = &arguments.log {
        result.log.save(path)?;
    }
    if let Some(path) = &arguments.save {
        Params::new(&report).save(path)?;
    }
    Ok(())
}

/// Where the numbers of a motion come from.
#[derive(Args, Debug)]
pub struct Knowledge {
    /// Use the result of an earlier commissioning instead of commissioning first.
    #[arg(long)]
    pub params: Option<PathBuf>,
    /// Use what the servo has stored (`truing commission --store`) instead of commissioning first.
    #[arg(long, conflicts_with = "params")]
    pub stored: bool,
    /// Find zero before the motion: `here:RAD`, or `stop:RAD_S,RAD,REACH_RAD[,AMPERE]`, or `index:RAD_S,RAD,REACH_RAD`,
    /// where the sign of the speed is the direction and RAD is what the place is to be called.
    #[arg(long, value_parser = referencing, allow_hyphen_values = true)]
    pub reference: Option<Referencing>,
}

/// The argument of `--reference`.
fn referencing(text: &str) -> Result<Referencing, String> {
    let shape = "expected here:RAD, stop:RAD_S,RAD,REACH_RAD[,AMPERE] or index:RAD_S,RAD,REACH_RAD";
    let (kind, rest) = text.split_once(':').ok_or(shape)?;
    let numbers: Result<Vec<f32>, _> = rest.split(',').map(|part| part.trim().parse()).collect();
    let numbers = numbers.map_err(|_| shape)?;
    match (kind, numbers.as_slice()) {
        ("here", &[position_rad]) => Ok(Referencing::Here { position_rad }),
        ("stop", &[speed_rad_s, position_rad, reach_rad, ref current @ ..]) if current.len() < 2 => {
            Ok(Referencing::EndStop {
                speed_rad_s,
                position_rad,
                reach_rad,
                current_a: current.first().copied(),
            })
        }
        ("index", &[speed_rad_s, position_rad, reach_rad]) => Ok(Referencing::Index {
            speed_rad_s,
            position_rad,
            reach_rad,
        }),
        _ => Err(shape.into()),
    }
}

impl Knowledge {
    /// The tasks before the motion; none if the servo goes on with what it has stored. An excitation asks for no
    /// commissioning.
    pub fn tasks(
        &self,
        motion: &Task,
        budget_s: f64,
        seed: u64,
        config: &Config,
    ) -> anyhow::Result<Vec<Task>> {
        let excites = matches!(motion, Task::Excite(_));
        anyhow::ensure!(
            !(excites && self.stored),
            "an excitation begins from --config; leave out --stored"
        );
        let first = match &self.params {
            _ if self.stored => None,
            Some(path) => Some(Task::Adopt(Box::new(Params::read(path)?.estimates(config)))),
            None if excites => None,
            None => Some(Task::Commission {
                budget_s: budget(budget_s)?,
                seed: seed as u32,
            }),
        };
        let reference = self.reference.map(Task::Reference);
        Ok(first.into_iter().chain(reference).collect())
    }

    /// An error if the motion cannot be, by the axis file alone. A servo that goes on with what it has stored knows better.
    pub fn allows(&self, motion: &Task, config: &Config) -> anyhow::Result<()> {
        if self.stored {
            Ok(())
        } else {
            profile::possible(motion, config)
        }
    }

    /// Is there a commissioning first?
    pub fn is_learned(&self) -> bool {
        !self.stored && self.params.is_none()
    }
}

/// Between 1 s and 10 minutes.
pub fn budget(seconds: f64) -> anyhow::Result<f64> {
    anyhow::ensure!(
        (1.0..=600.0).contains(&seconds),
        "--budget-s is {seconds}; it must lie between 1 and 600 s"
    );
    Ok(seconds)
}

/// The first commissioning of a session.
pub fn outcome(result: &SessionResult, config: &Config) -> anyhow::Result<CommissionJson> {
    let outcome = result.done.iter().find_map(|done| match done {
        Done::Commissioned(outcome) => Some(outcome),
        _ => None,
    });
    Ok(CommissionJson::new(
        outcome.context("the session had no commissioning")?,
        config,
    )?)
}

/// One number, for people.
pub fn print_number(name: &str, unit: &str, number: &Number) {
    let trust = if number.trusted {
        "trusted"
    } else {
        number.reason.unwrap_or("not trusted")
    };
    match (number.value, number.u95) {
        (Some(value), Some(u95)) => println!("{name:21} {value:10.4} ± {u95:.4} {unit:8} {trust}"),
        _ => println!("{name:21} {:>10}   {:15} {trust}", "-", ""),
    }
}

/// For people.
pub fn print(report: &CommissionJson) {
    for (name, unit, number) in report.numbers() {
        print_number(name, unit, &number);
    }
    println!(
        "{:21} {}",
        "mechanism",
        format!("{:?}", report.mechanism).to_lowercase()
    );
    println!(
        "{:21} {:.2} s, {:.2} turns",
        "took", report.duration_s, report.travel_rev
    );
    if let Some(refused) = &report.refused {
        println!("refused ({}): {}", refused.code, refused.text);
    }
}
