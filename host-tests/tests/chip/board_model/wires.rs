//! How a board is wired to the chip: which pin is which gate, shunt and encoder line. For boards that one buys this is the map
//! that their maker has published, written down by hand; the firmware's own table of pins is not looked at.

use super::machine::{A, B, C, D};

/// Port and number.
pub type Pin = (usize, u8);

/// A board around the chip.
#[derive(Clone)]
pub struct Wires {
    pub bridges: Vec<Bridge>,
    pub supply: Supply,
    pub enable: Pin,
    pub drivers: Option<Drivers>,
    /// What the maker's firmware drives high and low from its start.
    pub high: &'static [Pin],
    pub low: &'static [Pin],
}

/// A motor's bridge, with sensors and encoder.
#[derive(Clone)]
pub struct Bridge {
    pub lines: Lines,
    pub current: Sensor,
    pub encoder: [Pin; 2],
    pub fault: Pin,
}

/// What makes a bridge switch.
#[derive(Clone, Copy)]
pub enum Lines {
    /// Two inputs of a driver with a dead time of its own, and its sleep line.
    Inputs([Pin; 2], Pin),
    /// Gates of two legs, each high side and low side.
    Gates([[Pin; 2]; 2]),
}

/// What measures the current of a motor.
#[derive(Clone, Copy)]
pub enum Sensor {
    /// Magnitude, counts per ampere.
    Mirror(Pin, f64),
    /// In line with terminal a, around the middle: counts per ampere into the motor.
    InLine(Pin, f64),
    /// A shunt below each leg, around the middle: counts per ampere up from ground into the motor.
    BelowLegs([Pin; 2], f64),
}

/// Pin of the supply's divider, and counts per volt.
#[derive(Clone, Copy)]
pub struct Supply(pub Pin, pub f64);

/// DRV8301 behind one enable line.
#[derive(Clone)]
pub struct Drivers {
    pub enable: Pin,
    pub fault: Pin,
    pub clock: Pin,
    pub to_driver: Pin,
    pub from_driver: Pin,
    pub selects: Vec<Pin>,
}

/// Outputs of TIM1 (0) and TIM8 (1): pin, alternate function, timer, channel, complementary. DS8626, table 9.
const OUTPUTS: [(Pin, u32, usize, usize, bool); 18] = [
    ((A, 8), 1, 0, 0, false),
    ((A, 9), 1, 0, 1, false),
    ((A, 10), 1, 0, 2, false),
    ((A, 11), 1, 0, 3, false),
    ((B, 13), 1, 0, 0, true),
    ((B, 14), 1, 0, 1, true),
    ((B, 15), 1, 0, 2, true),
    ((A, 7), 1, 0, 0, true),
    ((B, 0), 1, 0, 1, true),
    ((B, 1), 1, 0, 2, true),
    ((C, 6), 3, 1, 0, false),
    ((C, 7), 3, 1, 1, false),
    ((C, 8), 3, 1, 2, false),
    ((C, 9), 3, 1, 3, false),
    ((A, 7), 3, 1, 0, true),
    ((B, 0), 3, 1, 1, true),
    ((B, 14), 3, 1, 1, true),
    ((B, 1), 3, 1, 2, true),
];

/// The timer's output that a pin carries with this alternate function.
pub fn output(pin: Pin, function: u32) -> Option<(usize, usize, bool)> {
    let found = OUTPUTS.iter().find(|row| row.0 == pin && row.1 == function)?;
    Some((found.2, found.3, found.4))
}

/// Encoder inputs: pins of channels 1 and 2, alternate function, timer from TIM2 on. DS8626, table 9.
const ENCODERS: [([Pin; 2], u32, usize); 5] = [
    ([(A, 15), (B, 3)], 1, 0),
    ([(B, 4), (B, 5)], 2, 1),
    ([(C, 6), (C, 7)], 2, 1),
    ([(B, 6), (B, 7)], 2, 2),
    ([(A, 0), (A, 1)], 2, 3),
];

/// The counter of an encoder on these pins, with its alternate function.
pub fn counter(pins: [Pin; 2]) -> Option<(usize, u32)> {
    ENCODERS.iter().find(|row| row.0 == pins).map(|row| (row.2, row.1))
}

/// The converter channel of a pin: DS8626, table 7.
pub fn channel(pin: Pin) -> usize {
    match pin {
        (A, number) if number < 8 => number.into(),
        (B, number) if number < 2 => 8 + usize::from(number),
        (C, number) if number < 6 => 10 + usize::from(number),
        other => panic!("{other:?} is no analogue pin"),
    }
}

/// The middle of the converter and counts per volt at the pin.
pub const PER_VOLT: f64 = 4096.0 / 3.3;

impl Wires {
    /// The board of `docs/hardware.md` with DRV8874 carriers: 1.1205 V/A, 100 kΩ over 10 kΩ.
    pub fn carrier() -> Self {
        let bridge = |inputs, sleep, current, encoder, fault| Bridge {
            lines: Lines::Inputs(inputs, sleep),
            current: Sensor::Mirror(current, 1.1205 * PER_VOLT),
            encoder,
            fault,
        };
        Wires {
            bridges: vec![
                bridge([(A, 8), (A, 9)], (B, 0), (C, 0), [(A, 15), (B, 3)], (B, 12)),
                bridge([(A, 10), (A, 11)], (B, 1), (C, 1), [(B, 4), (B, 5)], (B, 12)),
                bridge([(C, 6), (C, 7)], (B, 10), (C, 2), [(B, 6), (B, 7)], (A, 6)),
                bridge([(C, 8), (C, 9)], (B, 11), (C, 3), [(A, 0), (A, 1)], (A, 6)),
            ],
            supply: Supply((C, 4), PER_VOLT / 11.0),
            enable: (C, 10),
            drivers: None,
            high: &[],
            low: &[],
        }
    }

    /// The same chip with a discrete bridge and an amplifier of 0.1 V/A.
    pub fn discrete() -> Self {
        let mut wires = Self::carrier();
        wires.bridges.truncate(1);
        wires.bridges[0].lines = Lines::Gates([[(A, 8), (B, 13)], [(A, 9), (B, 14)]]);
        wires.bridges[0].current = Sensor::InLine((C, 0), 0.1 * PER_VOLT);
        wires
    }

    /// ODrive v3.5 and v3.6: `Firmware/Board/v3/Inc/main.h` of odriverobotics/ODrive, commit 074b042. Shunts of 500 µΩ with
    /// 80 V/V; `ratio` is its `VBUS_S_DIVIDER_RATIO`.
    pub fn odrive(ratio: f64) -> Self {
        let bridge = |gates, shunts, encoder| Bridge {
            lines: Lines::Gates(gates),
            current: Sensor::BelowLegs(shunts, 80.0 * 500e-6 * PER_VOLT),
            encoder,
            fault: (D, 2),
        };
        Wires {
            bridges: vec![
                // M0_BH, M0_BL, M0_CH, M0_CL; M0_IB, M0_IC; M0_ENC_A, M0_ENC_B; M1 alike.
                bridge([[(A, 9), (B, 14)], [(A, 10), (B, 15)]], [(C, 0), (C, 1)], [(B, 4), (B, 5)]),
                bridge([[(C, 7), (B, 0)], [(C, 8), (B, 1)]], [(C, 3), (C, 2)], [(B, 6), (B, 7)]),
            ],
            supply: Supply((A, 6), PER_VOLT / ratio),
            enable: (C, 4),
            drivers: Some(Drivers {
                enable: (B, 12),
                fault: (D, 2),
                clock: (C, 10),
                to_driver: (C, 12),
                from_driver: (C, 11),
                selects: vec![(C, 13), (C, 14)],
            }),
            high: &[],
            // AUX_L and AUX_H, and the legs that a brushed motor does not need.
            low: &[(B, 10), (B, 11), (A, 8), (B, 13), (C, 6), (A, 7)],
        }
    }

    /// VESC 6 from MK3 on: `hwconf/trampa/vesc6/hw_60_core.h` of vedderb/bldc, commit 10531f2. 0.5 mΩ and 20 V/V; 39 kΩ over
    /// 2.2 kΩ.
    pub fn vesc() -> Self {
        Wires {
            bridges: vec![Bridge {
                lines: Lines::Gates([[(A, 8), (B, 13)], [(A, 9), (B, 14)]]),
                current: Sensor::InLine((C, 0), 20.0 * 0.5e-3 * PER_VOLT),
                encoder: [(C, 6), (C, 7)],
                fault: (B, 7),
            }],
            supply: Supply((C, 3), PER_VOLT * 2.2 / 41.2),
            enable: (B, 6),
            drivers: Some(Drivers {
                enable: (B, 5),
                fault: (B, 7),
                clock: (C, 10),
                to_driver: (B, 4),
                from_driver: (B, 3),
                selects: vec![(C, 9)],
            }),
            // HW_SHUTDOWN_HOLD_ON and CURRENT_FILTER_ON.
            high: &[(C, 5), (D, 2)],
            // SENSOR_PORT_3V3, and the third leg.
            low: &[(A, 4), (A, 10), (B, 15)],
        }
    }
}
