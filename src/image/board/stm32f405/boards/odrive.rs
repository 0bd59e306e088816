//! ODrive v3.5 and v3.6, and the clones that run its firmware: two brushed motors, each between terminals B and C of its output.
//!
//! Pins: `Firmware/Board/v3/Inc/main.h` and `Firmware/Board/v3/board.cpp` of github.com/odriverobotics/ODrive, commits 074b042
//! and 02e29d8. Legs B and C because only they have a shunt; leg A stays off. Free for later: CAN on PB8 and PB9, USB on PA11 and
//! PA12, GPIO 1, 2, 7 and 8.

use super::board::{self, Board, Current, EncoderTimer, FaultLine, Gates, Link, PwmTimer, Supply};
use super::pins::{Line, Mode, Pin, Port, Pull, Use, line};
use super::stage;
use Mode::{Alternate, Analog, AsReset, Input, Output};
use Port::{A, B, C, D, H};
use Use::{Always, Axis};
use servo::drivers::drv8301::{Gain, Settings};
use servo::drivers::sense::{Divider, LowLegSense, Rises};

/// EN_GATE and nFAULT, of both drivers.
const ENABLE: Pin = Pin(B, 12);
const FAULT: Pin = Pin(D, 2);

/// ODrive v3.5 and v3.6 for 48 V and 56 V.
pub const ODRIVE_V3: Board = odrive("ODrive v3", 19.0);
/// ODrive v3.5 and v3.6 for 24 V.
pub const ODRIVE_V3_24V: Board = odrive("ODrive v3, 24 V", 11.0);
/// MKS ODrive and other clones of the board for 56 V.
pub const MKS_ODRIVE: Board = odrive("MKS ODrive", 19.0);

/// `ratio`: supply over the voltage at the pin (`VBUS_S_DIVIDER_RATIO`).
const fn odrive(name: &'static str, ratio: f32) -> Board {
    Board {
        name,
        stage: &stage::ODRIVE,
        axes: &AXES,
        most_discrete: 2,
        fault: FaultLine::Polled,
        // GPIO 5.
        enable: Pin(C, 4),
        // GPIO 6.
        tick: Pin(B, 2),
        high: &[],
        supply: Supply { channel: 6, divider: Divider { upper_ohm: ratio - 1.0, lower_ohm: 1.0 } },
        link: Link::Usart2,
    }
}

/// Its firmware counts a current from the bridge into the motor as positive (`phase_current_from_adcval`, and the sum in
/// `measure_phase_resistance`), and that one comes up from ground through the shunt of a low leg.
const AXES: [board::Axis; 2] = [
    board::Axis {
        timer: PwmTimer::One,
        legs: [1, 2],
        encoder: EncoderTimer::Three,
        index: Some(Pin(C, 9)),
        current: Current::LowLegs([10, 11], Rises::WithCurrentUp),
        sleep: ENABLE,
        fault: FAULT,
    },
    board::Axis {
        timer: PwmTimer::Eight,
        legs: [1, 2],
        encoder: EncoderTimer::Four,
        index: Some(Pin(C, 15)),
        current: Current::LowLegs([13, 12], Rises::WithCurrentUp),
        sleep: ENABLE,
        fault: FAULT,
    },
];

/// The board of this image.
pub const BOARD: Board = if cfg!(board = "odrive-v3-24v") {
    ODRIVE_V3_24V
} else if cfg!(board = "mks-odrive") {
    MKS_ODRIVE
} else {
    ODRIVE_V3
};
/// Both DRV8301, with the over-current threshold of its firmware (`VdsLevel_0p730_V`).
pub const GATES: Option<Gates> = Some(Gates {
    enable: ENABLE,
    fault: FAULT,
    spi: [Pin(C, 10), Pin(C, 12), Pin(C, 11)],
    selects: &[Pin(C, 13), Pin(C, 14)],
    settings: Settings { gain: Gain::Eighty, trip: 21 },
});
/// Of what measures its winding currents.
pub type CurrentOf<C> = LowLegSense<C>;

/// Every pin in use. The drivers pull their inputs down, also while the chip is in reset (SLOS719, pin functions).
#[rustfmt::skip]
pub const LINES: &[Line] = &[
    line(Pin(A, 9),  "TIM1_CH2",      Alternate(1), Pull::Down, Axis(0), "M0 leg B, high side"),
    line(Pin(B, 14), "TIM1_CH2N",     Alternate(1), Pull::Down, Axis(0), "M0 leg B, low side"),
    line(Pin(A, 10), "TIM1_CH3",      Alternate(1), Pull::Down, Axis(0), "M0 leg C, high side"),
    line(Pin(B, 15), "TIM1_CH3N",     Alternate(1), Pull::Down, Axis(0), "M0 leg C, low side"),
    line(Pin(B, 4),  "TIM3_CH1",      Alternate(2), Pull::Up,   Axis(0), "M0 encoder A"),
    line(Pin(B, 5),  "TIM3_CH2",      Alternate(2), Pull::Up,   Axis(0), "M0 encoder B"),
    line(Pin(C, 9),  "GPIO",          Input,        Pull::Down, Axis(0), "M0 encoder index"),
    line(Pin(C, 0),  "ADC123_IN10",   Analog,       Pull::None, Axis(0), "M0 current of leg B"),
    line(Pin(C, 1),  "ADC123_IN11",   Analog,       Pull::None, Axis(0), "M0 current of leg C"),

    line(Pin(C, 7),  "TIM8_CH2",      Alternate(3), Pull::Down, Axis(1), "M1 leg B, high side"),
    line(Pin(B, 0),  "TIM8_CH2N",     Alternate(3), Pull::Down, Axis(1), "M1 leg B, low side"),
    line(Pin(C, 8),  "TIM8_CH3",      Alternate(3), Pull::Down, Axis(1), "M1 leg C, high side"),
    line(Pin(B, 1),  "TIM8_CH3N",     Alternate(3), Pull::Down, Axis(1), "M1 leg C, low side"),
    line(Pin(B, 6),  "TIM4_CH1",      Alternate(2), Pull::Up,   Axis(1), "M1 encoder A"),
    line(Pin(B, 7),  "TIM4_CH2",      Alternate(2), Pull::Up,   Axis(1), "M1 encoder B"),
    line(Pin(C, 15), "GPIO",          Input,        Pull::Down, Axis(1), "M1 encoder index"),
    line(Pin(C, 3),  "ADC123_IN13",   Analog,       Pull::None, Axis(1), "M1 current of leg B"),
    line(Pin(C, 2),  "ADC123_IN12",   Analog,       Pull::None, Axis(1), "M1 current of leg C"),

    line(Pin(A, 8),  "GPIO",          Output,       Pull::None, Always,  "M0 leg A, high side: off"),
    line(Pin(B, 13), "GPIO",          Output,       Pull::None, Always,  "M0 leg A, low side: off"),
    line(Pin(C, 6),  "GPIO",          Output,       Pull::None, Always,  "M1 leg A, high side: off"),
    line(Pin(A, 7),  "GPIO",          Output,       Pull::None, Always,  "M1 leg A, low side: off"),
    line(Pin(B, 10), "GPIO",          Output,       Pull::None, Always,  "brake resistor, low side: off"),
    line(Pin(B, 11), "GPIO",          Output,       Pull::None, Always,  "brake resistor, high side: off"),
    line(Pin(B, 12), "GPIO",          Output,       Pull::None, Always,  "EN_GATE of both drivers"),
    line(Pin(D, 2),  "GPIO",          Input,        Pull::Up,   Always,  "nFAULT of both drivers"),
    line(Pin(C, 10), "GPIO",          Output,       Pull::None, Always,  "SPI clock to the drivers"),
    line(Pin(C, 11), "GPIO",          Input,        Pull::Up,   Always,  "SPI data from the drivers"),
    line(Pin(C, 12), "GPIO",          Output,       Pull::None, Always,  "SPI data to the drivers"),
    line(Pin(C, 13), "GPIO",          Output,       Pull::None, Always,  "select line of driver M0"),
    line(Pin(C, 14), "GPIO",          Output,       Pull::None, Always,  "select line of driver M1"),
    line(Pin(A, 6),  "ADC12_IN6",     Analog,       Pull::None, Always,  "supply"),
    line(Pin(C, 4),  "GPIO",          Input,        Pull::Down, Always,  "enable input on GPIO 5, high permits motion"),
    line(Pin(B, 2),  "GPIO",          Output,       Pull::None, Always,  "GPIO 6: high during the control tick, for an oscilloscope"),
    line(Pin(A, 2),  "USART2_TX",     Alternate(7), Pull::Up,   Always,  "GPIO 3: link, to the host"),
    line(Pin(A, 3),  "USART2_RX",     Alternate(7), Pull::Up,   Always,  "GPIO 4: link, from the host"),
    line(Pin(A, 13), "JTMS-SWDIO",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(A, 14), "JTCK-SWCLK",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(H, 0),  "OSC_IN",        AsReset,      Pull::None, Always,  "crystal"),
    line(Pin(H, 1),  "OSC_OUT",       AsReset,      Pull::None, Always,  "crystal"),
];
