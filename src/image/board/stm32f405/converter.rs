//! ADC1 and ADC2: at every control tick TIM1's trigger starts one injected sequence on each, currents of all axes on the
//! first, the supply on the second. The end of the first is the interrupt that runs the control tick, so both values are
//! fresh and nobody waits: with one axis 40 clocks of 21 MHz, 1.9 µs, after the middle of the driven part of the period.

use super::board::Board;
use super::pac::{ADC_COMMON, ADC1, ADC2, adc1::RegisterBlock};
use servo::drivers::sense::Converter;

/// SMPx code of 28 clocks, 1.3 µs: settles a 12-bit sample behind 20 kΩ (DS8626, ADC characteristics).
const SAMPLE_TIME: u8 = 0b010;
/// JEXTSEL code of TIM1's trigger output, RM0090 section 13.13.3.
const TRIGGER_TIM1: u8 = 0b0001;

/// Sets both converters up for the first `axes` axes of a board, and lets them wait for the trigger.
pub fn start(common: &ADC_COMMON, currents: &ADC1, supply: &ADC2, board: &Board, axes: usize) {
    // APB2 / 4 = 21 MHz; the limit is 36 MHz.
    common.ccr().write(|w| w.adcpre().div4());
    sequence(currents, &board.currents(axes));
    sequence(supply, &[board.supply.channel]);
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

/// At most [`MOST_CHANNELS`](super::board::MOST_CHANNELS). A sequence shorter than four *ends* at JSQ4 (RM0090 section 13.13.12); its results begin at JDR1
/// all the same.
fn sequence(converter: &RegisterBlock, channels: &[u8]) {
    let unused = 4 - channels.len().clamp(1, 4) as u8;
    converter.jsqr().write(|w| {
        for (place, &channel) in (unused..4).zip(channels) {
            // SAFETY: channels 0 … 18 are defined.
            unsafe { w.jsq(place).bits(channel) };
        }
        w.jl().set(3 - unused)
    });
    converter.smpr1().write(|w| {
        for channel in 0..5 {
            w.smp(channel).set(SAMPLE_TIME);
        }
        w
    });
    if channels.iter().any(|&channel| channel < 10) {
        converter.smpr2().write(|w| {
            for channel in 0..10 {
                w.smp(channel).set(SAMPLE_TIME);
            }
            w
        });
    }
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
    /// Currents of the axis of this number: the only one, or those of leg a and leg b.
    pub fn currents(board: &Board, axis: usize) -> [Self; 2] {
        let first = board.currents(axis).len();
        // SAFETY: valid for the life of the program; reading a result has no side effect.
        let converter: &'static RegisterBlock = unsafe { &*ADC1::ptr() };
        [first, first + 1].map(|place| Self { converter, place })
    }

    /// The supply.
    pub fn supply() -> Self {
        // SAFETY: as above.
        Self { converter: unsafe { &*ADC2::ptr() }, place: 0 }
    }
}

impl Converter for Channel {
    fn sample(&self) -> u16 {
        self.converter.jdr(self.place & 3).read().jdata().bits()
    }
}
