//! Clocks and reset cause.

use super::timing;
use stm32f4xx_hal::pac::RCC;
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::Config;

/// Crystal of the board, Hz. Other common values: 12 and 25 MHz; `docs/hardware.md` lists boards.
const CRYSTAL_HZ: u32 = 8_000_000;

/// 168 MHz from the crystal, APB1 42 MHz, APB2 84 MHz, flash wait states to match. A crystal that does not start stops
/// here, with the bridge still in its reset state.
pub fn start(rcc: RCC) -> RCC {
    let config = Config::hse(CRYSTAL_HZ.Hz())
        .sysclk(timing::SYSTEM_HZ.Hz())
        .pclk1(timing::APB1_HZ.Hz())
        .pclk2((timing::SYSTEM_HZ / 2).Hz());
    let frozen = rcc.freeze(config);
    debug_assert_eq!(frozen.clocks.sysclk().raw(), timing::SYSTEM_HZ);
    // SAFETY: the HAL's wrapper is dropped here, so this is again the only owner.
    unsafe { RCC::steal() }
}

/// Gives every peripheral of the board its clock. RM0090 sections 7.3.10, 7.3.13 and 7.3.14.
pub fn enable_peripherals(rcc: &RCC) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().set_bit();
        w.gpioben().set_bit();
        w.gpiocen().set_bit();
        w.dma1en().set_bit()
    });
    rcc.apb1enr().modify(|_, w| {
        w.tim2en().set_bit();
        w.tim3en().set_bit();
        w.tim4en().set_bit();
        w.tim5en().set_bit();
        w.usart2en().set_bit()
    });
    rcc.apb2enr().modify(|_, w| {
        w.tim1en().set_bit();
        w.tim8en().set_bit();
        w.adc1en().set_bit();
        w.adc2en().set_bit()
    });
    // A peripheral answers two bus cycles after its clock was enabled (RM0090 section 7.2.12): one read-back waits.
    let _ = rcc.apb2enr().read();
}

/// Why the chip started.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum ResetCause {
    /// Supply switched on or dipped.
    Power,
    /// Reset pin.
    Pin,
    /// The image asked for it.
    Software,
    /// The control tick or idle stopped coming.
    Watchdog,
}

/// Reads the cause and clears it, so that the next start tells its own (RM0090 section 7.3.21). The pin flag is set by
/// every cause, so it counts last.
pub fn take_reset_cause(rcc: &RCC) -> ResetCause {
    let flags = rcc.csr().read();
    rcc.csr().modify(|_, w| w.rmvf().set_bit());
    if flags.wdgrstf().bit_is_set() || flags.wwdgrstf().bit_is_set() {
        ResetCause::Watchdog
    } else if flags.sftrstf().bit_is_set() {
        ResetCause::Software
    } else if flags.porrstf().bit_is_set() || flags.borrstf().bit_is_set() {
        ResetCause::Power
    } else {
        ResetCause::Pin
    }
}
