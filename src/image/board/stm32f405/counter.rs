//! TIM2 to TIM5 as quadrature counters: ×4, 32 bits on TIM2 and TIM5, 16 bits on TIM3 and TIM4.

use super::board::EncoderTimer;
use super::pac::{TIM2, TIM3, TIM4, TIM5, tim2::RegisterBlock};
use servo::drivers::encoder::Counter;

/// A pulse shorter than eight timer clocks (84 MHz: 95 ns) is taken for noise: ICxF 0011, RM0090 section 18.4.7. The
/// fastest encoders deliver an edge every 250 ns.
const FILTER: u8 = 0b0011;

/// One counter.
#[derive(Clone, Copy)]
pub struct Quadrature {
    timer: &'static RegisterBlock,
    bits: u32,
}

// SAFETY: registers lie at a fixed address for every context, and a device access needs no thread. Set-up hands each value
// to the one task that uses it.
unsafe impl Send for Quadrature {}

impl Quadrature {
    /// The counter of a timer.
    pub fn of(timer: EncoderTimer) -> Self {
        let (address, bits) = match timer {
            EncoderTimer::Two => (TIM2::ptr() as usize, 32),
            EncoderTimer::Three => (TIM3::ptr() as usize, 16),
            EncoderTimer::Four => (TIM4::ptr() as usize, 16),
            EncoderTimer::Five => (TIM5::ptr() as usize, 32),
        };
        // SAFETY: TIM2 to TIM5 share one register map (RM0090 section 18.4.21); where a counter has 16 bits the upper
        // halves of CNT and ARR are reserved and read as zero. The address is valid for the life of the program.
        Self { timer: unsafe { &*(address as *const RegisterBlock) }, bits }
    }

    /// Encoder mode 3: both inputs, both edges (RM0090 section 18.3.12), and the start.
    pub fn start(self) {
        let range = u32::MAX >> (32 - self.bits);
        self.timer.ccmr1_input().write(|w| {
            w.cc1s().ti1().cc2s().ti2();
            w.ic1f().set(FILTER).ic2f().set(FILTER)
        });
        self.timer.smcr().write(|w| w.sms().encoder_mode_3());
        self.timer.arr().write(|w| w.arr().set(range));
        self.timer.cr1().write(|w| w.cen().set_bit());
    }
}

impl Counter for Quadrature {
    fn bits(&self) -> u32 {
        self.bits
    }

    fn count(&self) -> u32 {
        self.timer.cnt().read().bits()
    }
}
