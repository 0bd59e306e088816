//! TIM1: centre-aligned PWM for two inputs of an H-bridge driver, and the control tick (RM0090, chapter 17).
//!
//! Slow decay: the side that leads stays high and the other is low for the share `duty` of the period, so that in the
//! rest both are high and the winding is shorted; the mean voltage is linear in the duty. The timer counts up and down
//! once a PWM period; its update event, once in `ticks_of(config)` periods, loads the preloaded registers and starts
//! the control tick.

use servo::axis::Bridge;
use servo::config::Config;
use stm32f4xx_hal::gpio::{Alternate, PA8, PA9};
use stm32f4xx_hal::pac::{RCC, TIM1};
use stm32f4xx_hal::rcc::{Enable, Reset};

/// Clock of TIM1: twice APB2, 2 × 84 MHz.
const TIMER_HZ: u32 = 168_000_000;
/// Until a configuration arrives: 20 kHz PWM.
const START_FULL_SCALE: u16 = 4200;
/// … and 10 kHz ticks.
const START_PERIODS: u32 = 2;
/// A control rate may be off by this share: 1/1000.
const RATE_TOLERANCE: u32 = 1000;
/// The repetition counter has 8 bits and counts half periods.
const MOST_PERIODS: u32 = 128;

/// PWM periods per control tick, or `None` when the rate cannot be made.
pub fn ticks_of(config: &Config) -> Option<u32> {
    let full_scale = u32::from(config.pwm_full_scale);
    let ideal = TIMER_HZ / (2 * full_scale * config.tick_hz.max(1)).max(1);
    let rate = |periods: u32| TIMER_HZ / (2 * full_scale * periods);
    (ideal..=ideal + 1).find(|&periods| {
        (1..=MOST_PERIODS).contains(&periods)
            && rate(periods).abs_diff(config.tick_hz) * RATE_TOLERANCE <= config.tick_hz
    })
}

pub struct Timer {
    timer: TIM1,
    full_scale: u16,
}

impl Timer {
    pub fn new(timer: TIM1, _in1: PA8<Alternate<1>>, _in2: PA9<Alternate<1>>, rcc: &mut RCC) -> Self {
        TIM1::enable(rcc);
        TIM1::reset(rcc);
        // Centre-aligned mode 1, auto-reload preloaded.
        timer.cr1().write(|w| w.cms().center_aligned1().arpe().set_bit());
        // Channels 1 and 2: PWM mode 1, compare registers preloaded, outputs enabled, active high.
        timer.ccmr1_output().write(|w| {
            w.oc1m()
                .pwm_mode1()
                .oc1pe()
                .set_bit()
                .oc2m()
                .pwm_mode1()
                .oc2pe()
                .set_bit()
        });
        timer.ccer().write(|w| w.cc1e().set_bit().cc2e().set_bit());
        // When the main output is off the pins are driven to their idle level, low, instead of floating.
        timer.bdtr().write(|w| w.ossi().set_bit().ossr().set_bit());
        let mut this = Timer {
            timer,
            full_scale: START_FULL_SCALE,
        };
        this.rate(START_FULL_SCALE, START_PERIODS);
        this.timer.dier().write(|w| w.uie().set_bit());
        this.timer.cr1().modify(|_, w| w.cen().set_bit());
        this
    }

    pub fn configure(&mut self, config: &Config) {
        if let Some(periods) = ticks_of(config) {
            self.rate(config.pwm_full_scale, periods);
        }
    }

    fn rate(&mut self, full_scale: u16, periods: u32) {
        self.full_scale = full_scale;
        self.timer.arr().write(|w| w.arr().set(full_scale));
        self.timer.rcr().write(|w| w.rep().set((2 * periods - 1) as u8));
        self.timer.egr().write(|w| w.ug().set_bit());
    }

    pub fn acknowledge(&mut self) {
        self.timer.sr().modify(|_, w| w.uif().clear_bit());
    }

    pub fn drive(&mut self, bridge: Bridge, duty: i16) {
        // Above the reload value the output stays high for the whole period.
        let high = self.full_scale + 1;
        let other = high - duty.unsigned_abs().min(self.full_scale);
        let (in1, in2) = match (bridge, duty < 0) {
            (Bridge::Open, _) => (0, 0),
            (Bridge::Shorted, _) => (high, high),
            (Bridge::Driven, false) => (high, other),
            (Bridge::Driven, true) => (other, high),
        };
        self.timer.ccr1().write(|w| w.ccr().set(in1));
        self.timer.ccr2().write(|w| w.ccr().set(in2));
        self.timer
            .bdtr()
            .modify(|_, w| w.moe().bit(bridge != Bridge::Open));
    }
}

/// Usable from any context: clears MOE, nothing else.
pub fn outputs_off() {
    // SAFETY: one write to a register whose other fields are set once, at start, to these values.
    unsafe {
        (*TIM1::ptr())
            .bdtr()
            .write(|w| w.ossi().set_bit().ossr().set_bit())
    };
}
