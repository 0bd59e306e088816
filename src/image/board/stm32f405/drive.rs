//! The control interrupt's side of this board: sensors of all axes in, bridges out.

use super::super::Drive;
use super::axis::AxisOfBoard;
use super::gpio::Wire;
use super::pins::{Pin, Port};
use super::pwm::Timer;
use super::stage::PowerStage;
use super::{converter, timers, timing, watchdog};
use cortex_m::peripheral::DWT;
use servo::axis::{Bridge, Output, Sample};
use servo::config::Config;
use servo::protect::Interlock;
use stm32f4xx_hal::pac::ADC1;

/// High while a tick runs: for the oscilloscope.
const TICK: Wire = Wire(Pin(Port::C, 12));

/// Index lines of the four axes, as in [`super::pins::LINES`].
const INDEX: [Wire; 4] =
    [Wire(Pin(Port::B, 8)), Wire(Pin(Port::B, 9)), Wire(Pin(Port::C, 11)), Wire(Pin(Port::B, 15))];

/// Two looks at the phase, each with a tick for its correction.
const ALIGNING: u8 = 4;
/// 3 ms at the rate of power-up: a driver wakes within 1 ms (DRV8874 data sheet) and may report that as a fault, and fault
/// lines rise. The bridge cannot be driven yet: nothing is configured.
const SETTLING: u8 = 30;

/// The bridges and sensors of `N` axes.
pub struct DriveOf<const N: usize> {
    axes: [AxisOfBoard; N],
    converter: ADC1,
    /// Ticks in which the phase of the update is still checked.
    aligning: u8,
    /// Ticks in which faults of the bridge are those of waking up.
    settling: u8,
    periods: u8,
    full: u16,
}

impl<const N: usize> DriveOf<N> {
    /// Takes the drive when pins, timers and converters are set up.
    pub fn new(converter: ADC1, stage: &'static PowerStage) -> Self {
        let (full, periods) = (timing::START_FULL_SCALE, timing::START_PERIODS);
        let axes = core::array::from_fn(|axis| AxisOfBoard::new(axis, stage, full));
        Self { axes, converter, aligning: ALIGNING, settling: SETTLING, periods, full }
    }

    /// Sets one axis' bridge.
    pub fn set(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.axes[axis].apply(bridge, duty);
    }

    /// Updates belong at the upper turning point. Whether an odd repetition count lands there or at the lower one
    /// depends on its phase against the counter, about which the reference manuals of this timer disagree; so the first
    /// ticks look, and one interval shorter by half a period corrects it.
    fn align(&mut self) {
        let Some(left) = self.aligning.checked_sub(1) else {
            return;
        };
        self.aligning = left;
        let slip = left % 2 == 1 && !Timer::one().runs_down();
        for timer in timers::<N>() {
            timer.set_repetitions(timing::repetitions(self.periods).saturating_sub(u8::from(slip)));
        }
    }

    /// The break flag of power-up, when the fault line was still rising, is forgotten.
    fn settle(&mut self) {
        if let Some(left) = self.settling.checked_sub(1) {
            self.settling = left;
            timers::<N>().for_each(Timer::clear_break);
        }
    }
}

impl<const N: usize> Drive for DriveOf<N> {
    fn begin_tick(&mut self) {
        TICK.drive(true);
        converter::clear_end(&self.converter);
        self.align();
        self.settle();
    }

    fn sample(&mut self, axis: usize) -> Sample {
        if self.settling == 0 {
            self.axes[axis].judge();
        }
        self.axes[axis].sample()
    }

    fn interlock(&self, axis: usize) -> Interlock {
        self.axes[axis].permission()
    }

    fn index(&self, axis: usize) -> bool {
        INDEX[axis].level()
    }

    fn apply(&mut self, axis: usize, output: &Output) {
        self.set(axis, output.bridge, output.duty);
    }

    /// Tells the watchdog and the oscilloscope. The next measurement has already ended: the tick was too long.
    fn end_tick(&mut self) -> bool {
        watchdog::control_has_run();
        TICK.drive(false);
        converter::has_ended(&self.converter)
    }

    /// All axes are rescaled when the scale is new; else the other axes may be driven and are left alone.
    fn configure(&mut self, axis: usize, config: &Config) {
        let Some(periods) = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz) else {
            return;
        };
        if (self.full, self.periods) == (config.pwm_full_scale, periods) {
            if let Some(own) = self.axes.get_mut(axis) {
                own.rescale(axis, self.full);
            }
            return;
        }
        (self.full, self.periods) = (config.pwm_full_scale, periods);
        for timer in timers::<N>() {
            timer.set_period(self.full, periods);
        }
        for (number, axis) in self.axes.iter_mut().enumerate() {
            axis.rescale(number, self.full);
        }
        self.aligning = ALIGNING;
    }

    /// Core clocks.
    fn clock(&self) -> u32 {
        DWT::cycle_count()
    }

    fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start)
    }
}
