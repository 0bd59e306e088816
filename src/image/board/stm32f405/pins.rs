//! The pin table, as data: what the image sets up, what the tests check against the data sheet (DS8626, table 9) and
//! what `docs/hardware.md` shows. STM32F405RG, LQFP64.
//!
//! There is room for four axes with single-ended PWM on one chip; a discrete bridge takes two more lines and the first
//! two channels of TIM1 for one axis.

/// A GPIO port.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Port {
    /// GPIOA.
    A,
    /// GPIOB.
    B,
    /// GPIOC.
    C,
    /// GPIOH: the crystal alone.
    H,
}

/// One pin of a port, 0 … 15.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Pin(pub Port, pub u8);

/// What the pin is switched to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Alternate function 0 … 15.
    Alternate(u8),
    /// Push-pull output, low at reset.
    Output,
    /// Digital input.
    Input,
    /// Analogue input.
    Analog,
    /// Left as it is after reset.
    AsReset,
}

/// Resistor inside the chip, about 40 kΩ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Pull {
    /// None.
    None,
    /// To 3.3 V.
    Up,
    /// To ground.
    Down,
}

/// Who needs the line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// Every image.
    Always,
    /// An image with at least this axis (counted from 0).
    Axis(u8),
    /// The low sides of a discrete bridge of axis 0.
    LowSide,
}

/// One row of the table.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// The pin.
    pub pin: Pin,
    /// The chip's name of the signal, as in the data sheet; `GPIO` for a plain pin.
    pub signal: &'static str,
    /// What the pin is switched to.
    pub mode: Mode,
    /// Resistor inside the chip.
    pub pull: Pull,
    /// Who needs it.
    pub needed: Use,
    /// What it is for.
    pub role: &'static str,
}

use Mode::{Alternate, Analog, AsReset, Input, Output};
use Port::{A, B, C, H};
use Use::{Always, Axis, LowSide};

const fn line(
    pin: Pin,
    signal: &'static str,
    mode: Mode,
    pull: Pull,
    needed: Use,
    role: &'static str,
) -> Line {
    Line { pin, signal, mode, pull, needed, role }
}

/// Every pin in use. The chip's own resistors are off while it is in reset: what keeps a bridge open then are the
/// pull-downs of the driver's inputs, or resistors of the wiring.
#[rustfmt::skip]
pub const LINES: [Line; 44] = [
    line(Pin(A, 8),  "TIM1_CH1",      Alternate(1), Pull::Down, Axis(0), "PWM a"),
    line(Pin(A, 9),  "TIM1_CH2",      Alternate(1), Pull::Down, Axis(0), "PWM b"),
    line(Pin(B, 13), "TIM1_CH1N",     Alternate(1), Pull::Down, LowSide, "PWM a, low side"),
    line(Pin(B, 14), "TIM1_CH2N",     Alternate(1), Pull::Down, LowSide, "PWM b, low side"),
    line(Pin(A, 15), "TIM2_CH1_ETR",  Alternate(1), Pull::Up,   Axis(0), "encoder A"),
    line(Pin(B, 3),  "TIM2_CH2",      Alternate(1), Pull::Up,   Axis(0), "encoder B"),
    line(Pin(C, 0),  "ADC123_IN10",   Analog,       Pull::None, Axis(0), "current"),
    line(Pin(B, 0),  "GPIO",          Output,       Pull::Down, Axis(0), "sleep or enable"),
    line(Pin(B, 12), "TIM1_BKIN",     Alternate(1), Pull::Up,   Axis(0), "bridge fault, axes 0 and 1"),
    line(Pin(B, 8),  "GPIO",          Input,        Pull::Down, Axis(0), "encoder index"),

    line(Pin(A, 10), "TIM1_CH3",      Alternate(1), Pull::Down, Axis(1), "PWM a"),
    line(Pin(A, 11), "TIM1_CH4",      Alternate(1), Pull::Down, Axis(1), "PWM b"),
    line(Pin(B, 4),  "TIM3_CH1",      Alternate(2), Pull::Up,   Axis(1), "encoder A"),
    line(Pin(B, 5),  "TIM3_CH2",      Alternate(2), Pull::Up,   Axis(1), "encoder B"),
    line(Pin(C, 1),  "ADC123_IN11",   Analog,       Pull::None, Axis(1), "current"),
    line(Pin(B, 1),  "GPIO",          Output,       Pull::Down, Axis(1), "sleep or enable"),
    line(Pin(B, 9),  "GPIO",          Input,        Pull::Down, Axis(1), "encoder index"),

    line(Pin(C, 6),  "TIM8_CH1",      Alternate(3), Pull::Down, Axis(2), "PWM a"),
    line(Pin(C, 7),  "TIM8_CH2",      Alternate(3), Pull::Down, Axis(2), "PWM b"),
    line(Pin(B, 6),  "TIM4_CH1",      Alternate(2), Pull::Up,   Axis(2), "encoder A"),
    line(Pin(B, 7),  "TIM4_CH2",      Alternate(2), Pull::Up,   Axis(2), "encoder B"),
    line(Pin(C, 2),  "ADC123_IN12",   Analog,       Pull::None, Axis(2), "current"),
    line(Pin(B, 10), "GPIO",          Output,       Pull::Down, Axis(2), "sleep or enable"),
    line(Pin(A, 6),  "TIM8_BKIN",     Alternate(3), Pull::Up,   Axis(2), "bridge fault, axes 2 and 3"),
    line(Pin(C, 11), "GPIO",          Input,        Pull::Down, Axis(2), "encoder index"),

    line(Pin(C, 8),  "TIM8_CH3",      Alternate(3), Pull::Down, Axis(3), "PWM a"),
    line(Pin(C, 9),  "TIM8_CH4",      Alternate(3), Pull::Down, Axis(3), "PWM b"),
    line(Pin(A, 0),  "TIM5_CH1",      Alternate(2), Pull::Up,   Axis(3), "encoder A"),
    line(Pin(A, 1),  "TIM5_CH2",      Alternate(2), Pull::Up,   Axis(3), "encoder B"),
    line(Pin(C, 3),  "ADC123_IN13",   Analog,       Pull::None, Axis(3), "current"),
    line(Pin(B, 11), "GPIO",          Output,       Pull::Down, Axis(3), "sleep or enable"),
    line(Pin(B, 15), "GPIO",          Input,        Pull::Down, Axis(3), "encoder index"),

    line(Pin(C, 4),  "ADC12_IN14",    Analog,       Pull::None, Always,  "supply"),
    line(Pin(C, 10), "GPIO",          Input,        Pull::Down, Always,  "enable input, high permits motion"),
    line(Pin(C, 12), "GPIO",          Output,       Pull::None, Always,  "high during the control tick, for an oscilloscope"),
    line(Pin(A, 2),  "USART2_TX",     Alternate(7), Pull::Up,   Always,  "link, to the host"),
    line(Pin(A, 3),  "USART2_RX",     Alternate(7), Pull::Up,   Always,  "link, from the host"),
    line(Pin(A, 13), "JTMS-SWDIO",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(A, 14), "JTCK-SWCLK",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(H, 0),  "OSC_IN",        AsReset,      Pull::None, Always,  "crystal"),
    line(Pin(H, 1),  "OSC_OUT",       AsReset,      Pull::None, Always,  "crystal"),
    line(Pin(B, 2),  "BOOT1",         AsReset,      Pull::None, Always,  "strap, leave low"),
    line(Pin(C, 14), "OSC32_IN",      AsReset,      Pull::None, Always,  "clock crystal on many boards"),
    line(Pin(C, 15), "OSC32_OUT",     AsReset,      Pull::None, Always,  "clock crystal on many boards"),
];

/// Register values of one port, with the bits that they cover.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PortSetup {
    /// Pins that are set up, one bit each.
    pub pins: u16,
    /// MODER, two bits a pin.
    pub mode: u32,
    /// PUPDR, two bits a pin.
    pub pull: u32,
    /// OSPEEDR, two bits a pin.
    pub speed: u32,
    /// AFRL and AFRH together, four bits a pin.
    pub alternate: u64,
}

/// Every bit of `pins` widened to a field of `width` bits of ones.
pub const fn fields(pins: u16, width: u32) -> u64 {
    let mut mask = 0;
    let mut number = 0;
    while number < 16 {
        if pins & (1 << number) != 0 {
            mask |= ((1 << width) - 1) << (number * width);
        }
        number += 1;
    }
    mask
}

/// Registers of `port` for an image with `axes` axes, with or without the low sides of a discrete bridge.
pub const fn port_setup(port: Port, axes: u8, low_sides: bool) -> PortSetup {
    let mut setup = PortSetup { pins: 0, mode: 0, pull: 0, speed: 0, alternate: 0 };
    let mut index = 0;
    while index < LINES.len() {
        let line = &LINES[index];
        let wanted = match line.needed {
            Use::Always => true,
            Use::Axis(axis) => axis < axes,
            Use::LowSide => low_sides,
        };
        if wanted && line.pin.0 as u8 == port as u8 {
            add(&mut setup, line);
        }
        index += 1;
    }
    setup
}

/// MODER: 00 input, 01 output, 10 alternate, 11 analogue. PUPDR: 01 up, 10 down. OSPEEDR: 01 is 25 MHz, more than 20 kHz
/// and 1 Mbaud need, and kind to the wires. RM0090 section 8.4.
const fn add(setup: &mut PortSetup, line: &Line) {
    let number = line.pin.1;
    let (mode, speed, function) = match line.mode {
        Mode::Input => (0b00, 0b00, 0),
        Mode::Output => (0b01, 0b01, 0),
        Mode::Alternate(function) => (0b10, 0b01, function),
        Mode::Analog => (0b11, 0b00, 0),
        Mode::AsReset => return,
    };
    let pull = match line.pull {
        Pull::None => 0b00,
        Pull::Up => 0b01,
        Pull::Down => 0b10,
    };
    setup.pins |= 1 << number;
    setup.mode |= mode << (2 * number);
    setup.speed |= speed << (2 * number);
    setup.pull |= pull << (2 * number);
    setup.alternate |= (function as u64) << (4 * number);
}
