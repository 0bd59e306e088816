//! What an axis file says about an axis: a whole description of the machine, and any choices about limits, loops and
//! protection.
//!
//! | tables of `axis.toml` | when a session sets the axis up |
//! |---|---|
//! | `[supply]`, `[encoder]`, `[axis]`, `current_a_per_lsb` | describe the machine: replaced as a whole, keys left out take their defaults, scales those of the board |
//! | `[limits]`, `[loops]`, `[protection]` | are choices: a key that is left out keeps what is in force on the servo |
//!
//! The same rule as on the chip (see [`servo::link::protocol::Command::Configure`]).

use crate::device::link::scale_text;
use serde::Deserialize;
use servo::config::Config;
use servo::control::Tuning;
use servo::drivers::scales::Scales;
use servo::link::board::{Board, Clock};
use servo::optional::Optional;
use servo::protect::{Action, Fault, Settings, Thermal};
use servo::store::AxisParameters;
use truing_core::text::input_error::InputError;

/// An axis file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setup {
    /// The machine, and the limits that belong to it.
    pub config: Config,
    /// Everything else; nothing by default.
    pub choices: Choices,
    /// Where the scales of its converters come from.
    pub wiring: Wiring,
}

/// What an axis file says about the board. Nothing: the scales of the configuration stand there on purpose.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wiring {
    /// The board that the file names.
    pub board: Option<&'static str>,
    /// The file leaves `vbus_v_per_lsb` out: it is the board's.
    pub supply: bool,
    /// The file leaves `current_a_per_lsb` out.
    pub current: bool,
}

/// What the user may choose about loops and protection; `None`: as it is on the servo.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Choices {
    /// `limits.continuous_current_a` and `limits.thermal_time_constant_s`.
    pub thermal: Option<Thermal>,
    /// `limits.command_timeout_ms`.
    pub command_timeout_ms: Option<u16>,
    /// `[loops]`.
    pub loops: Loops,
    /// `protection.FAULT`, in the order of [`Fault::ALL`].
    pub actions: [Option<Action>; Fault::ALL.len()],
}

/// `[loops]`; `None`: as it is on the servo.
#[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Loops {
    /// `loops.bandwidth`.
    pub bandwidth: Option<f32>,
    /// `loops.integral`.
    pub integral: Option<bool>,
    /// `loops.compensation`.
    pub compensation: Option<bool>,
}

impl From<Config> for Setup {
    fn from(config: Config) -> Self {
        Self { config, choices: Choices::default(), wiring: Wiring::default() }
    }
}

impl Setup {
    /// What is to be in force. `before`: what is in force on the servo; `None`: it knows nothing. What was identified
    /// is forgotten.
    pub fn parameters(&self, before: Option<&AxisParameters>) -> AxisParameters {
        let fresh = AxisParameters::new(self.config);
        let kept = before.map_or(fresh, |before| AxisParameters {
            config: self.config.keeping_limits(&before.config),
            estimates: fresh.estimates,
            position_load: fresh.position_load,
            modelled: fresh.modelled,
            ..*before
        });
        self.choices.over(kept)
    }

    /// With the scales of the board where the file leaves them out. A program that plays a board has none, and plays any.
    ///
    /// # Errors
    /// The file is for another board, or its scales are none of this one.
    pub fn on(self, board: &Board) -> Result<Self, InputError> {
        if let Some(named) = self.wiring.board
            && board.clock != Clock::Simulated
            && board.name.as_str() != named
        {
            return Err(InputError(format!(
                "the axis file is for the board {named}, and the servo runs on {}: correct `board`, or flash the image of {named}",
                board.name.as_str()
            )));
        }
        let config = self.scaled(board.scales);
        board.scales.allow(&config).map_err(|error| InputError(scale_text(&error)))?;
        Ok(Self { config, ..self })
    }

    /// The configuration, with these scales where the file leaves them out.
    pub fn scaled(&self, Scales { supply, current }: Scales) -> Config {
        let (wiring, own) = (self.wiring, self.config);
        Config {
            vbus_v_per_lsb: supply.get().filter(|_| wiring.supply).unwrap_or(own.vbus_v_per_lsb),
            current_a_per_lsb: current.get().filter(|_| wiring.current).unwrap_or(own.current_a_per_lsb),
            ..own
        }
    }

    /// Can this file have set up an axis that has this configuration?
    pub fn agrees(&self, config: &Config) -> bool {
        let (supply, current) = (config.vbus_v_per_lsb, config.current_a_per_lsb);
        let scales = Scales { supply: Optional::new(supply), current: Optional::new(current) };
        self.scaled(scales).keeping_limits(config) == *config
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
                bandwidth: self.loops.bandwidth.unwrap_or(tuning.bandwidth),
                integral: self.loops.integral.unwrap_or(tuning.integral),
            },
            compensation: self.loops.compensation.unwrap_or(parameters.compensation),
            protection: Settings {
                actions,
                thermal: self.thermal.or(protection.thermal),
                command_timeout_ms: self.command_timeout_ms.unwrap_or(protection.command_timeout_ms),
            },
            ..parameters
        }
    }
}
