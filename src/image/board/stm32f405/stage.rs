//! Power stages of the boards. The board of `docs/hardware.md` drives [`ACTIVE`]; choosing another one is changing it, and that
//! page gives the wiring.

use servo::drivers::bridge::{Decay, Wiring};
use servo::drivers::sense::CurrentKind;

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
    /// Largest spread of its readings at rest, counts: several times the converter's noise (DS8626: ±2 counts), and less than
    /// one ampere.
    pub zero_spread: u16,
    /// Lowest and highest reading that the sensor's output can make, counts.
    pub readings: (u16, u16),
}

impl PowerStage {
    /// The largest current that the sensor can tell, counts, wherever the zero lies.
    pub const fn current_reach(&self) -> u16 {
        let ((lowest, highest), (zero_low, zero_high)) = (self.readings, self.zero_window);
        match self.current {
            CurrentKind::Absent => 0,
            CurrentKind::Magnitude => highest - zero_high,
            CurrentKind::Signed if zero_low - lowest < highest - zero_high => zero_low - lowest,
            CurrentKind::Signed => highest - zero_high,
        }
    }

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
    zero_spread: 40,
    readings: (0, 4095),
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

/// Transistors behind a DRV8301, with shunts of 500 µΩ below the legs and its amplifiers at 80 V/V: 20 mA a count.
/// Dead time: 20 clocks as the firmware of ODrive sets it (`TIM_1_8_DEADTIME_CLOCKS`); the driver keeps one of its own
/// beside it, 50 ns or more by a resistor on the board (SLOS719, DTC). Its bootstrap is recharged by a trickle charge pump,
/// so a high side may stay on (SLOS719, "supports 100 % duty cycle"). The amplifiers are good for 1.35 V on either side of
/// 1.65 V, as ODrive has it; their offset of 4 mV at most is 320 mV behind the gain.
pub const ODRIVE: PowerStage = PowerStage {
    name: "DRV8301 and shunts below the legs",
    wiring: Wiring::HalfBridges,
    outputs: Outputs::Complementary { dead_time_ns: 119 },
    duty_limit_permille: 1000,
    current: CurrentKind::Signed,
    volt_per_ampere: 0.04,
    zero_window: (1648, 2448),
    readings: (372, 3723),
    ..DRV8874
};

/// Transistors behind a DRV8301, with a shunt of 500 µΩ in the line of leg 1 and an amplifier of 20 V/V beside it: 81 mA a
/// count. Dead time: the firmware of VESC sets 360 ns (`HW_DEAD_TIME_NSEC`). The window is wider than the amplifier's offset.
pub const VESC_6: PowerStage = PowerStage {
    name: "DRV8301 and a shunt in the line of leg 1",
    outputs: Outputs::Complementary { dead_time_ns: 360 },
    volt_per_ampere: 0.01,
    zero_window: (1900, 2196),
    zero_spread: 12,
    readings: (40, 4055),
    ..ODRIVE
};

/// The one that an image for the board of `docs/hardware.md` drives.
pub const ACTIVE: PowerStage = DRV8874;
