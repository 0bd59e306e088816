//! A motor model as a Functional Mock-up Unit for Co-Simulation, FMI 2.0 and 3.0.
//!
//! ```text
//! motor.fmu: modelDescription.xml + binaries/PLATFORM/truing_fmu.so + resources/model.toml
//! ```
//!
//! The library is the same for every model: an [`Instance`](instance::Instance) reads `resources/model.toml` and advances the plant that
//! `truing simulate` runs. [`variables`] decides what is set and read, for the library and for `modelDescription.xml` alike.
//! `fmi-export` builds a library a model, with its variables known to the compiler, and `fmi-sys` needs libclang: the border to C stands
//! in `border.rs`, written from the headers of the standard.

#![deny(unsafe_code, clippy::print_stdout, clippy::print_stderr)]

mod border;
pub mod description;
pub mod instance;
pub mod package;
pub mod run;
pub mod units;
pub mod variables;

pub use description::Version;

/// Name of the library inside an FMU, without its ending.
pub const LIBRARY: &str = "truing_fmu";
/// The model inside an FMU.
pub const MODEL: &str = "resources/model.toml";
