//! The motor behind the firmware image: our own plant, any program, or a real board.

pub mod builtin;
pub mod exec;
mod firmware_log;
mod pipe;
mod program;
pub mod qemu;

pub use builtin::Builtin;
pub use exec::Exec;

use servo::axis::Bridge;
use std::path::PathBuf;
use std::str::FromStr;
use truing_core::text::input_error::InputError;

/// What the bridge does for one tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive {
    /// Number of the tick.
    pub tick: u32,
    /// −1 … 1 of the motor's own supply.
    pub duty: f32,
    /// State of the bridge.
    pub bridge: Bridge,
    /// Length of the tick, s.
    pub tick_s: f32,
}

/// The motor at the end of the tick.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Encoder count, ×4, wraps.
    pub count: i32,
    /// Winding current, mean over the tick, A; NaN: not sensed.
    pub current_a: f32,
    /// Supply voltage, V; NaN: not measured.
    pub supply_v: f32,
    /// For the log alone.
    pub flags: u32,
}

/// A motor in lock-step with the control tick.
pub trait Motor {
    /// Applies `drive` for one tick.
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError>;
}

/// The argument of `--motor`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Door {
    /// `builtin:FILE.toml`: our plant.
    Builtin(PathBuf),
    /// `exec:COMMAND`: a program in lock-step.
    Exec(String),
    /// `serial:PORT`: a real board.
    Serial(String),
}

impl FromStr for Door {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once(':') {
            Some(("builtin", file)) if !file.is_empty() => Ok(Door::Builtin(file.into())),
            Some(("exec", command)) if !command.is_empty() => Ok(Door::Exec(command.into())),
            Some(("serial", port)) if !port.is_empty() => Ok(Door::Serial(port.into())),
            _ => Err("expected builtin:FILE.toml, exec:COMMAND or serial:PORT".into()),
        }
    }
}
