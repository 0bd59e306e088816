//! Clocks and reset cause.
//!
//! The crystal is measured before anything is multiplied: TIM11 counts the oscillator inside the chip between edges of the
//! divided crystal. One image runs with every crystal that boards carry, and none is overclocked.

use super::board::{Board, Link};
use super::pac::{DBGMCU, FLASH, RCC, TIM11};
use super::pins::Port;
use super::{gpio, timing};
use servo::link::board::Clock;
use servo::link::protocol::ResetCause;

/// DBGMCU_IDCODE of the one revision whose prefetch must stay off (errata ES0182: revision A).
const REVISION_A: u16 = 0x1000;
/// RTCPRE: the crystal divided by 31, in front of TIM11 (RM0090 section 7.3.3); TI1_RMP code of that line (section 19.5.12).
const DIVIDER: u8 = 31;
const CRYSTAL_LINE: u8 = 0b10;
/// Turns of the waiting loop that an edge gets, 496 clocks at most with a crystal of 8 MHz.
const EDGE_PATIENCE: u32 = 10_000;
/// Turns of the waiting loop that a crystal gets: some 30 ms at 16 MHz, where it needs 2 ms (DS8626).
const CRYSTAL_PATIENCE: u32 = 100_000;

/// What the clocks come from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Source {
    /// The crystal, of so many hertz.
    Crystal(u32),
    /// The oscillator inside the chip, because the crystal did not start or is none of [`timing::CRYSTALS`]: control rate
    /// and baud rate are off by up to 1 % at room temperature.
    Internal,
}

impl From<Source> for Clock {
    fn from(source: Source) -> Self {
        match source {
            Source::Crystal(hertz) => Clock::Crystal(hertz),
            Source::Internal => Clock::Internal,
        }
    }
}

/// 168 MHz for the core, 42 MHz for APB1, 84 MHz for APB2 (RM0090 section 7.2). The bridge is in its reset state meanwhile.
pub fn start(rcc: &RCC, flash: &FLASH, debug: &DBGMCU, measuring: &TIM11) -> Source {
    fall_back(rcc);
    let source = start_crystal(rcc, measuring);
    // 5 wait states at 168 MHz and 3.3 V (RM0090 table 10), before the core becomes faster.
    flash.acr().write(|w| {
        // SAFETY: 0 … 7 are defined.
        unsafe { w.latency().bits(5) };
        let prefetch = debug.idcode().read().rev_id().bits() != REVISION_A;
        w.prften().bit(prefetch).icen().set_bit().dcen().set_bit()
    });
    start_pll(rcc, source);
    // HPRE 0: no division; PPRE1 101: by 4; PPRE2 100: by 2. The bus dividers before the switch, so that no bus is ever too fast.
    rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div4().ppre2().div2());
    rcc.cfgr().modify(|_, w| w.sw().pll());
    while !rcc.cfgr().read().sws().is_pll() {}
    // A crystal that stops in operation breaks TIM1 and TIM8 in hardware and raises the non-maskable interrupt, on the
    // internal oscillator (RM0090 section 7.2.7).
    rcc.cr().modify(|_, w| w.csson().bit(source != Source::Internal));
    source
}

/// To the state after reset, whatever a boot loader has left: the multiplier of a running PLL cannot be changed.
fn fall_back(rcc: &RCC) {
    rcc.cr().modify(|_, w| w.hsion().set_bit());
    while rcc.cr().read().hsirdy().bit_is_clear() {}
    rcc.cfgr().modify(|_, w| w.sw().hsi());
    while !rcc.cfgr().read().sws().is_hsi() {}
    rcc.cr().modify(|_, w| w.pllon().clear_bit());
    while rcc.cr().read().pllrdy().bit_is_set() {}
    rcc.cfgr().modify(|_, w| w.hpre().div1().ppre1().div1().ppre2().div1());
}

fn start_crystal(rcc: &RCC, measuring: &TIM11) -> Source {
    rcc.cr().modify(|_, w| w.hseon().set_bit());
    let started = (0..CRYSTAL_PATIENCE).any(|_| rcc.cr().read().hserdy().bit_is_set());
    match started.then(|| measure(rcc, measuring)).flatten().and_then(timing::crystal) {
        Some(hertz) => Source::Crystal(hertz),
        None => Source::Internal,
    }
}

/// Counts of the internal oscillator for [`timing::CAPTURES`] captures, each after eight periods of the divided crystal.
fn measure(rcc: &RCC, timer: &TIM11) -> Option<u32> {
    rcc.cfgr().modify(|_, w| w.rtcpre().set(DIVIDER));
    rcc.apb2enr().modify(|_, w| w.tim11en().set_bit());
    // As in `enable_peripherals`.
    let _ = rcc.apb2enr().read();
    // SAFETY: the code is defined.
    timer.or().write(|w| unsafe { w.rmp().bits(CRYSTAL_LINE) });
    timer.ccmr1_input().write(|w| w.cc1s().ti1().ic1psc().eight_events());
    timer.ccer().write(|w| w.cc1e().set_bit());
    timer.cr1().write(|w| w.cen().set_bit());
    let counts = sum_of_captures(timer);
    timer.cr1().write(|w| w.cen().clear_bit());
    rcc.apb2enr().modify(|_, w| w.tim11en().clear_bit());
    counts
}

fn sum_of_captures(timer: &TIM11) -> Option<u32> {
    // The first one may have waited.
    let _ = capture(timer)?;
    let mut last = capture(timer)?;
    let mut sum = 0;
    for _ in 0..timing::CAPTURES {
        let now = capture(timer)?;
        sum += u32::from(now.wrapping_sub(last));
        last = now;
    }
    // An edge that came before the last one was read makes the sum worthless.
    timer.sr().read().cc1of().bit_is_clear().then_some(sum)
}

/// Reading the register clears the flag (RM0090 section 19.5.4).
fn capture(timer: &TIM11) -> Option<u16> {
    let seen = (0..EDGE_PATIENCE).any(|_| timer.sr().read().cc1if().bit_is_set());
    seen.then(|| timer.ccr1().read().bits() as u16)
}

/// Is the brown-out reset off? Then nothing stops the chip between 2.7 V, below which it must not run so fast nor program its
/// flash by words (DS8626), and 1.8 V, where it is reset.
pub fn is_brown_out_reset_off(flash: &FLASH) -> bool {
    flash.optcr().read().bor_lev().is_bor_off()
}

/// P divides by 2 (code 00), Q by 7: 48 MHz, which nobody uses but must not be exceeded.
fn start_pll(rcc: &RCC, source: Source) {
    let hertz = match source {
        Source::Crystal(hertz) => hertz,
        Source::Internal => timing::INTERNAL_HZ,
    };
    let (m, n) = timing::pll(hertz).unwrap_or(const { timing::pll(timing::INTERNAL_HZ).unwrap() });
    rcc.pllcfgr().write(|w| {
        w.pllsrc().bit(source != Source::Internal);
        // SAFETY: `timing::pll` keeps to the ranges of RM0090 section 7.3.2.
        unsafe { w.pllm().bits(m).plln().bits(n).pllq().bits(7) };
        w.pllp().div2()
    });
    rcc.cr().modify(|_, w| w.pllon().set_bit());
    while rcc.cr().read().pllrdy().bit_is_clear() {}
}

/// Gives every peripheral of the board its clock. RM0090 sections 7.3.10, 7.3.13 and 7.3.14.
pub fn enable_peripherals(rcc: &RCC, board: &Board) {
    rcc.ahb1enr().modify(|_, w| {
        w.gpioaen().set_bit();
        w.gpioben().set_bit();
        w.gpiocen().set_bit();
        w.gpioden().bit(const { gpio::uses(Port::D) });
        w.dma1en().set_bit()
    });
    rcc.apb1enr().modify(|_, w| {
        w.tim2en().set_bit();
        w.tim3en().set_bit();
        w.tim4en().set_bit();
        w.tim5en().set_bit();
        w.usart2en().bit(board.link == Link::Usart2).usart3en().bit(board.link == Link::Usart3)
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
