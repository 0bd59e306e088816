//! VESC 6 (60 MK3 to MK6, not "MAX") and boards built after it: one brushed motor between phases 1 and 2.
//!
//! Pins: `hwconf/trampa/vesc6/hw_60_core.h` and `hw_60_core.c` of github.com/vedderb/bldc, commits 10531f2 and 6106081. Leg 3 stays
//! off. Free for later: CAN on PB8 and PB9, USB on PA11 and PA12.

use super::board::{self, Board, Current, EncoderTimer, FaultLine, Gates, Link, PwmTimer, Supply};
use super::pins::{Line, Mode, Pin, Port, Pull, Use, line};
use super::stage;
use Mode::{Alternate, Analog, AsReset, Input, Output};
use Port::{A, B, C, D, H};
use Use::{Always, Axis};
use servo::drivers::drv8301::{Gain, Settings};
use servo::drivers::sense::{CurrentSense, Divider};

/// EN_GATE and FAULT.
const ENABLE: Pin = Pin(B, 5);
const FAULT: Pin = Pin(B, 7);

/// VESC 6.
pub const VESC_6: Board = Board {
    name: "VESC 6",
    stage: &stage::VESC_6,
    axes: &[board::Axis {
        timer: PwmTimer::One,
        legs: [0, 1],
        encoder: EncoderTimer::Three,
        index: Some(Pin(C, 8)),
        // Its firmware counts a current from the bridge into the motor as positive where INVERTED_SHUNT_POLARITY is absent.
        current: Current::Sensor(10),
        sleep: ENABLE,
        fault: FAULT,
    }],
    most_discrete: 1,
    fault: FaultLine::Polled,
    // The signal pin of the servo connector.
    enable: Pin(B, 6),
    // The green LED glows while ticks run.
    tick: Pin(B, 0),
    // The board keeps itself switched on, and filters its current.
    high: &[Pin(C, 5), Pin(D, 2)],
    // VIN_R1 and VIN_R2: full scale 61.8 V.
    supply: Supply { channel: 13, divider: Divider { upper_ohm: 39e3, lower_ohm: 2.2e3 } },
    link: Link::Usart3,
};

/// The board of this image.
pub const BOARD: Board = VESC_6;
/// Its DRV8301. Beside it the board has amplifiers of its own, so the gain concerns nobody; it is the one of theirs. The
/// over-current threshold is 0.403 V, the state of the driver at power-up, which does not latch then.
pub const GATES: Option<Gates> = Some(Gates {
    enable: ENABLE,
    fault: FAULT,
    spi: [Pin(C, 10), Pin(B, 4), Pin(B, 3)],
    selects: &[Pin(C, 9)],
    settings: Settings { gain: Gain::Twenty, trip: 16 },
});
/// Of what measures its winding current.
pub type CurrentOf<C> = CurrentSense<C>;

/// Every pin in use. The driver pulls its inputs down, also while the chip is in reset (SLOS719, pin functions).
#[rustfmt::skip]
pub const LINES: &[Line] = &[
    line(Pin(A, 8),  "TIM1_CH1",      Alternate(1), Pull::Down, Axis(0), "phase 1, high side"),
    line(Pin(B, 13), "TIM1_CH1N",     Alternate(1), Pull::Down, Axis(0), "phase 1, low side"),
    line(Pin(A, 9),  "TIM1_CH2",      Alternate(1), Pull::Down, Axis(0), "phase 2, high side"),
    line(Pin(B, 14), "TIM1_CH2N",     Alternate(1), Pull::Down, Axis(0), "phase 2, low side"),
    line(Pin(C, 6),  "TIM3_CH1",      Alternate(2), Pull::Up,   Axis(0), "encoder A (hall 1)"),
    line(Pin(C, 7),  "TIM3_CH2",      Alternate(2), Pull::Up,   Axis(0), "encoder B (hall 2)"),
    line(Pin(C, 8),  "GPIO",          Input,        Pull::Down, Axis(0), "encoder index (hall 3)"),
    line(Pin(C, 0),  "ADC123_IN10",   Analog,       Pull::None, Axis(0), "current of phase 1"),

    line(Pin(A, 10), "GPIO",          Output,       Pull::None, Always,  "phase 3, high side: off"),
    line(Pin(B, 15), "GPIO",          Output,       Pull::None, Always,  "phase 3, low side: off"),
    line(Pin(B, 5),  "GPIO",          Output,       Pull::None, Always,  "EN_GATE of the driver"),
    line(Pin(B, 7),  "GPIO",          Input,        Pull::Up,   Always,  "FAULT of the driver"),
    line(Pin(C, 10), "GPIO",          Output,       Pull::None, Always,  "SPI clock to the driver"),
    line(Pin(B, 3),  "GPIO",          Input,        Pull::Up,   Always,  "SPI data from the driver"),
    line(Pin(B, 4),  "GPIO",          Output,       Pull::None, Always,  "SPI data to the driver"),
    line(Pin(C, 9),  "GPIO",          Output,       Pull::None, Always,  "select line of the driver"),
    line(Pin(C, 5),  "GPIO",          Output,       Pull::None, Always,  "high: keeps the power switch on"),
    line(Pin(D, 2),  "GPIO",          Output,       Pull::None, Always,  "high: current filter on"),
    line(Pin(A, 4),  "GPIO",          Output,       Pull::None, Always,  "low: 3.3 V for the encoder (MK6)"),
    line(Pin(C, 3),  "ADC123_IN13",   Analog,       Pull::None, Always,  "supply"),
    line(Pin(B, 6),  "GPIO",          Input,        Pull::Down, Always,  "enable input on the servo connector, high permits motion"),
    line(Pin(B, 0),  "GPIO",          Output,       Pull::None, Always,  "green LED: high during the control tick"),
    line(Pin(B, 10), "USART3_TX",     Alternate(7), Pull::Up,   Always,  "TX: link, to the host"),
    line(Pin(B, 11), "USART3_RX",     Alternate(7), Pull::Up,   Always,  "RX: link, from the host"),
    line(Pin(A, 13), "JTMS-SWDIO",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(A, 14), "JTCK-SWCLK",    AsReset,      Pull::None, Always,  "debug probe"),
    line(Pin(H, 0),  "OSC_IN",        AsReset,      Pull::None, Always,  "crystal"),
    line(Pin(H, 1),  "OSC_OUT",       AsReset,      Pull::None, Always,  "crystal"),
];
