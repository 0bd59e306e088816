//! ADC1 and ADC2: at every control tick TIM1's trigger starts one injected sequence on each, currents of all axes on the
//! first, the supply on the second. The end of the first is the interrupt that runs the control tick, so both values are
//! fresh and nobody waits: with one axis 40 clocks of 21 MHz, 1.9 µs, after the middle of the driven part of the period.

use servo::drivers::sense::Converter;
use stm32f4xx_hal::pac::{ADC_COMMON, ADC1, ADC2, adc1::RegisterBlock};

/// First channel of the currents, PC0; the others follow.
const CURRENT_CHANNEL: u8 = 10;
/// Channel of the supply, PC4.
const SUPPLY_CHANNEL: u8 = 14;
/// SMPx code of 28 clocks, 1.3 µs: settles a 12-bit sample behind 20 kΩ (DS8626, ADC characteristics).
const SAMPLE_TIME: u8 = 0b010;
/// JEXTSEL code of TIM1's trigger output, RM0090 section 13.13.3.
const TRIGGER_TIM1: u8 = 0b0001;

/// Sets both converters up for `axes` axes, 1 … 4, and lets them wait for the trigger.
pub fn start(common: &ADC_COMMON, currents: &ADC1, supply: &ADC2, axes: u8) {
    // APB2 / 4 = 21 MHz; the limit is 36 MHz.
    common.ccr().write(|w| w.adcpre().div4());
    sequence(currents, CURRENT_CHANNEL, axes);
    sequence(supply, SUPPLY_CHANNEL, 1);
    currents.cr1().write(|w| w.scan().set_bit().jeocie().set_bit());
    supply.cr1().write(|w| w.scan().set_bit());
    for converter in [&**currents, &**supply] {
        converter.cr2().write(|w| {
            w.jextsel().set(TRIGGER_TIM1);
            w.jexten().rising_edge();
            w.adon().set_bit()
        });
    }
}

/// `length` channels from `first` on. A sequence shorter than four *ends* at JSQ4 (RM0090 section 13.13.12); its results
/// begin at JDR1 all the same.
fn sequence(converter: &RegisterBlock, first: u8, length: u8) {
    let unused = 4 - length.clamp(1, 4);
    converter.jsqr().write(|w| {
        for place in unused..4 {
            // SAFETY: channels 0 … 18 are defined.
            unsafe { w.jsq(place).bits(first + place - unused) };
        }
        w.jl().set(3 - unused)
    });
    converter.smpr1().write(|w| {
        for channel in 0..5 {
            w.smp(channel).set(SAMPLE_TIME);
        }
        w
    });
}

/// Acknowledges the interrupt of the finished sequence.
pub fn clear_end(currents: &ADC1) {
    // SAFETY: flags are cleared by writing 0; ones leave them (RM0090 section 13.13.1).
    currents.sr().write(|w| unsafe { w.bits(!(INJECTED_END | INJECTED_START)) });
}

/// True if a measurement has ended since [`clear_end`].
pub fn has_ended(currents: &ADC1) -> bool {
    currents.sr().read().bits() & INJECTED_END != 0
}

/// ADC_SR bits JEOC and JSTRT.
const INJECTED_END: u32 = 1 << 2;
const INJECTED_START: u32 = 1 << 3;

/// One result of an injected sequence.
#[derive(Clone, Copy)]
pub struct Channel {
    converter: &'static RegisterBlock,
    place: usize,
}

// SAFETY: registers lie at a fixed address for every context, and a device access needs no thread. Set-up hands each value
// to the one task that uses it.
unsafe impl Send for Channel {}

impl Channel {
    /// The winding current of axis 0 … 3.
    pub fn current(axis: usize) -> Self {
        // SAFETY: valid for the life of the program; reading a result has no side effect.
        Self { converter: unsafe { &*ADC1::ptr() }, place: axis }
    }

    /// The supply.
    pub fn supply() -> Self {
        // SAFETY: as above.
        Self { converter: unsafe { &*ADC2::ptr() }, place: 0 }
    }
}

impl Converter for Channel {
    fn sample(&self) -> u16 {
        self.converter.jdr(self.place).read().jdata().bits()
    }
}
