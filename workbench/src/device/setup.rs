//! What an axis file says about an axis: a whole description of the machine, and any choices about limits, loops and
//! protection.
//!
//! | tables of `axis.toml` | when a session sets the axis up |
//! |---|---|
//! | `[supply]`, `[encoder]`, `[axis]`, `current_a_per_lsb` | describe the machine: replaced as a whole, keys left out take their defaults |
//! | `[limits]`, `[loops]`, `[protection]` | are choices: a key that is left out keeps what is in force on the servo |
//!
//! The same rule as on the chip (see [`servo::link::protocol::Command::Configure`]).

use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::Estimates;
use servo::protect::{Action, Fault, Settings, Thermal};
use servo::store::AxisParameters;

/// An axis file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// The machine, and the limits that belong to it.
    pub config: Config,
    /// Everything else; nothing by default.
    pub choices: Choices,
}

/// What the user may choose about loops and protection; `None`: as it is on the servo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choices {
    /// `limits.continuous_current_a` and `limits.thermal_time_constant_s`.
    pub thermal: Option<Thermal>,
    /// `limits.command_timeout_ms`.
    pub command_timeout_ms: Option<u16>,
    /// `loops.bandwidth`.
    pub bandwidth: Option<f32>,
    /// `loops.integral`.
    pub integral: Option<bool>,
    /// `loops.compensation`.
    pub compensation: Option<bool>,
    /// `protection.FAULT`, in the order of [`Fault::ALL`].
    pub actions: [Option<Action>; Fault::ALL.len()],
}

impl From<Config> for Setup {
    fn from(config: Config) -> Self {
        Self { config, choices: Choices::default() }
    }
}

impl Setup {
    /// What is to be in force. `before`: what is in force on the servo; `None`: it knows nothing. What was identified
    /// is forgotten.
    pub fn parameters(&self, before: Option<&AxisParameters>) -> AxisParameters {
        let fresh = AxisParameters {
            config: self.config,
            estimates: Estimates::default(),
            tuning: Tuning::default(),
            compensation: true,
            protection: Settings::default(),
        };
        let kept = before.map_or(fresh, |before| AxisParameters {
            config: self.config.keeping_limits(&before.config),
            estimates: fresh.estimates,
            ..*before
        });
        self.choices.over(kept)
    }

    /// Can this file have set up an axis that has this configuration?
    pub fn agrees(&self, config: &Config) -> bool {
        self.config.keeping_limits(config) == *config
    }
}

impl Choices {
    /// These choices, and for the rest what is there already.
    pub fn over(&self, parameters: AxisParameters) -> AxisParameters {
        let (tuning, protection) = (parameters.tuning, parameters.protection);
        let chosen = Fault::ALL.into_iter().zip(self.actions);
        let actions = chosen
            .filter_map(|(fault, action)| Some((fault, action?)))
            // A pair that cannot be was refused when the file was read.
            .fold(protection.actions, |table, (fault, action)| table.with(fault, action).unwrap_or(table));
        AxisParameters {
            tuning: Tuning {
                bandwidth: self.bandwidth.unwrap_or(tuning.bandwidth),
                integral: self.integral.unwrap_or(tuning.integral),
            },
            compensation: self.compensation.unwrap_or(parameters.compensation),
            protection: Settings {
                actions,
                thermal: self.thermal.or(protection.thermal),
                command_timeout_ms: self.command_timeout_ms.unwrap_or(protection.command_timeout_ms),
            },
            ..parameters
        }
    }
}
