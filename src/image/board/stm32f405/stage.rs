//! Power stages that the board knows. Choosing another one is changing [`ACTIVE`]; `docs/hardware.md` gives the wiring.

use servo::drivers::bridge::{Decay, Wiring};
use servo::drivers::sense::{CurrentKind, Divider, Scale};

/// What the timer drives.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outputs {
    /// Two lines to a driver that adds its own dead time.
    SingleEnded,
    /// Two complementary pairs to the gates of a discrete bridge; opened by the timer's main output enable.
    Complementary {
        /// Time between one side off and the other on, ns. At most 6,000.
        dead_time_ns: u32,
    },
}

/// One kind of power stage.
#[derive(Clone, Copy, Debug)]
pub struct PowerStage {
    /// For the log.
    pub name: &'static str,
    /// How it reads its two lines.
    pub wiring: Wiring,
    /// How it is switched.
    pub decay: Decay,
    /// What the timer drives.
    pub outputs: Outputs,
    /// Largest |duty|, thousandths of full scale: below 1,000 where a bootstrap capacitor needs the low side.
    pub duty_limit_permille: u16,
    /// What its current sensor tells.
    pub current: CurrentKind,
    /// Sensitivity of the current sensor, V/A.
    pub volt_per_ampere: f32,
    /// Lowest and highest reading of the current sensor at rest, counts.
    pub zero_window: (u16, u16),
}

impl PowerStage {
    /// True if the timer drives the low sides too.
    pub const fn has_low_sides(&self) -> bool {
        matches!(self.outputs, Outputs::Complementary { .. })
    }
}

/// Carrier of a DRV8874 with PMODE high (IN1/IN2). Its mirror delivers 450 µA/A (data sheet SLVSF66) into 2.49 kΩ.
pub const DRV8874: PowerStage = PowerStage {
    name: "DRV8874",
    wiring: Wiring::TwoInputs,
    decay: Decay::Slow,
    outputs: Outputs::SingleEnded,
    duty_limit_permille: 1000,
    current: CurrentKind::Magnitude,
    volt_per_ampere: 1.1205,
    zero_window: (0, 60),
};

/// Breakout of a DRV8871: two inputs and nothing else.
pub const DRV8871: PowerStage = PowerStage { name: "DRV8871", current: CurrentKind::Absent, ..DRV8874 };

/// "IBT-2" module of two BTS7960 half bridges, both enable inputs tied together. Its sense pins carry a fault current of
/// their own and a resistor that differs between makers, so the current is not used unless somebody has measured it.
pub const BTS7960: PowerStage =
    PowerStage { name: "BTS7960", wiring: Wiring::HalfBridges, current: CurrentKind::Absent, ..DRV8874 };

/// Four transistors with two bootstrapped gate drivers and a shunt amplifier around half the reference.
pub const DISCRETE: PowerStage = PowerStage {
    name: "discrete bridge",
    wiring: Wiring::HalfBridges,
    outputs: Outputs::Complementary { dead_time_ns: 500 },
    duty_limit_permille: 960,
    current: CurrentKind::Signed,
    volt_per_ampere: 0.1,
    zero_window: (1900, 2196),
    ..DRV8874
};

/// The one that this image drives.
pub const ACTIVE: PowerStage = DRV8874;

/// Supply divider of the pin table: 100 kΩ over 10 kΩ, full scale 36.3 V.
pub const SUPPLY_DIVIDER: Divider = Divider { upper_ohm: 100e3, lower_ohm: 10e3 };
/// The converter: 12 bits of its 3.3 V supply.
pub const SCALE: Scale = Scale { reference_v: 3.3, bits: 12 };
