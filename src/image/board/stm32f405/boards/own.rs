//! The board of `docs/hardware.md`: an STM32F405RG on a carrier, wired by hand to drivers or to a discrete bridge.
//!
//! There is room for four axes with single-ended PWM on one chip; a discrete bridge takes two more lines and the first
//! two channels of TIM1 for one axis.

use super::board::{self, Board, Current, EncoderTimer, FaultLine, Gates, Link, PwmTimer, Supply};
use super::pins::{Line, Mode, Pin, Port, Pull, Use, line};
use super::stage;
use Mode::{Alternate, Analog, AsReset, Input, Output};
use Port::{A, B, C, H};
use Use::{Always, Axis, LowSide};
use servo::drivers::sense::{CurrentSense, Divider};

/// The board of `docs/hardware.md`, with any of its power stages. A discrete bridge takes the whole of TIM1: one axis.
pub const OWN: Board = Board {
    name: "STM32F405",
    stage: &stage::ACTIVE,
    axes: &[
        own_axis(PwmTimer::One, [0, 1], EncoderTimer::Two, (Port::B, 8), 10, (Port::B, 0)),
        own_axis(PwmTimer::One, [2, 3], EncoderTimer::Three, (Port::B, 9), 11, (Port::B, 1)),
        own_axis(PwmTimer::Eight, [0, 1], EncoderTimer::Four, (Port::C, 11), 12, (Port::B, 10)),
        own_axis(PwmTimer::Eight, [2, 3], EncoderTimer::Five, (Port::B, 15), 13, (Port::B, 11)),
    ],
    most_discrete: 1,
    fault: FaultLine::Breaks,
    enable: Pin(Port::C, 10),
    tick: Pin(Port::C, 12),
    high: &[],
    // 100 kΩ over 10 kΩ: full scale 36.3 V.
    supply: Supply { channel: 14, divider: Divider { upper_ohm: 100e3, lower_ohm: 10e3 } },
    link: Link::Usart2,
};

const fn own_axis(
    timer: PwmTimer,
    legs: [u8; 2],
    encoder: EncoderTimer,
    index: (Port, u8),
    current: u8,
    sleep: (Port, u8),
) -> board::Axis {
    let fault = match timer {
        PwmTimer::One => Pin(Port::B, 12),
        PwmTimer::Eight => Pin(Port::A, 6),
    };
    board::Axis {
        timer,
        legs,
        encoder,
        index: Some(Pin(index.0, index.1)),
        current: Current::Sensor(current),
        sleep: Pin(sleep.0, sleep.1),
        fault,
    }
}

/// The board of this image.
pub const BOARD: Board = OWN;
/// It has none: its drivers start by themselves.
pub const GATES: Option<Gates> = None;
/// Of what measures its winding currents.
pub type CurrentOf<C> = CurrentSense<C>;

/// Every pin in use. The chip's own resistors are off while it is in reset: what keeps a bridge open then are the
/// pull-downs of the driver's inputs, or resistors of the wiring.
#[rustfmt::skip]
pub const LINES: &[Line] = &[
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
