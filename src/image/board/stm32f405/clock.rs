//! Clocks and reset cause.

use super::timing;
use servo::link::protocol::ResetCause;
use stm32f4xx_hal::pac::{FLASH, RCC};

/// Crystal of the board, Hz. Other common values: 12 and 25 MHz. A wrong value here runs the chip at a wrong speed.
const CRYSTAL_HZ: u32 = 8_000_000;
/// The oscillator inside the chip, within 1 %.
const INTERNAL_HZ: u32 = 16_000_000;
/// Turns of the waiting loop that a crystal gets: some 30 ms at 16 MHz, where it needs 2 ms (DS8626).
const CRYSTAL_PATIENCE: u32 = 100_000;

/// What the clocks come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub enum Source {
    /// The crystal.
    Crystal,
    /// The oscillator inside the chip, because the crystal did not start: control rate and baud rate are off by up to 1 %.
    Internal,
}

/// 168 MHz for the core, 42 MHz for APB1, 84 MHz for APB2 (RM0090 section 7.2). The bridge is in its reset state meanwhile.
pub fn start(rcc: &RCC, flash: &FLASH) -> Source {
    let source = start_crystal(rcc);
    // 5 wait states at 168 MHz and 3.3 V (RM0090 table 10), before the core becomes faster.
    flash.acr().write(|w| {
        // SAFETY: 0 … 7 are defined.
        unsafe { w.latency().bits(5) };
        w.prften().set_bit().icen().set_bit().dcen().set_bit()
    });
    start_pll(rcc, source);
    // HPRE 0: no division; PPRE1 101: by 4; PPRE2 100: by 2. The bus dividers before the switch, so that no bus is ever too fast.
    rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    while !rcc.cfgr().read().sws().is_pll() {}
    source
}

fn start_crystal(rcc: &RCC) -> Source {
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    for _ in 0..CRYSTAL_PATIENCE {
        if rcc.cr().read().hserdy().bit_is_set() {
            return Source::Crystal;
        }
    }
    Source::Internal
}

/// P divides by 2 (code 00), Q by 7: 48 MHz, which nobody uses but must not be exceeded.
fn start_pll(rcc: &RCC, source: Source) {
    let (m, n) = match source {
        Source::Crystal => const { timing::pll(CRYSTAL_HZ).unwrap() },
        Source::Internal => const { timing::pll(INTERNAL_HZ).unwrap() },
    };
    rcc.pllcfgr().write(|w| {
        w.pllsrc().bit(source == Source::Crystal);
        // SAFETY: `timing::pll` keeps to the ranges of RM0090 section 7.3.2.
        unsafe { w.pllm().bits(m).plln().bits(n).pllq().bits(7) };
        w.pllp().div2()
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    while rcc.cr().read().pllrdy().bit_is_clear() {}
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
