//! # truing: a model that learns what it is missing
//!
//! The gap workflow, top to bottom:
//!
//! ```text
//! log → simulate → residual → localise → name → extend → report
//! ```
//!
//! A model and a table of steady speeds, both as text. Below 1 V the motor stands, which the model does not know:
//!
//! ```
//! use truing::gap::tables;
//! use truing::system::log::{self, Columns, Log};
//! use truing::system::model;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let sheet = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\n\
//!     gain_rad_s_per_v = 10.0\ntime_constant_s = 0.1\n[supply]\nnominal_v = 12.0\n";
//! let model = model::parse("motor.toml", sheet)?;
//! let mut rows = String::from("u_v,omega_rad_s\n");
//! for tenth in -100..=100 {
//!     let volts = f64::from(tenth) / 10.0;
//!     let speed = 10.0 * volts.signum() * (volts.abs() - 1.0).max(0.0) + 0.05 * f64::from(tenth % 3);
//!     rows += &format!("{volts},{speed}\n");
//! }
//! let Log::Table(table) = log::parse("speeds.csv", &rows, &Columns::default())? else {
//!     panic!("a log without time is a table");
//! };
//! let outcome = tables::run(&model, &table, &[], &[]);
//! assert_eq!(outcome.effects[0].name, "dead_zone");
//! # Ok(())
//! # }
//! ```

#![deny(clippy::print_stdout, clippy::print_stderr)]

#[macro_use]
extern crate truing_report;

pub mod cli;

pub use proving::{self, synthetic};
pub use truing_core::{gap, outcome, system, text};
pub use truing_export as export;
pub use truing_files as files;
pub use truing_fleet as fleet;
pub use truing_improve as improve;
pub use truing_params as params;
pub use truing_report::{console, report};
pub use truing_servo::{self as servo_host, device};
