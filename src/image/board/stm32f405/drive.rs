//! The control interrupt's side of this board: sensors of all axes in, bridges out.

use super::super::Drive;
use super::axis::{Stm32Parts, breakers, guarded, power_stage};
use super::board::{Board, PwmTimer};
use super::counter::Quadrature;
use super::gpio::Wire;
use super::pac::{ADC_COMMON, ADC1, ADC2};
use super::pwm::Timer;
use super::pwm::{named_timers, timers};
use super::{converter, gates, gpio, timing, watchdog};
use cortex_m::peripheral::DWT;
use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::drivers::axes::Axes;
use servo::link::board::Gates;
use servo::protect::Interlock;

/// Two looks at the phase, each with a tick for its correction.
const ALIGNING: u8 = 4;
/// Ticks after power-up in which no bridge is driven: 3 ms at the rate of power-up. A driver wakes within 1 ms (DRV8874 data
/// sheet) and may report that as a fault, and fault lines rise.
pub const SETTLING: u8 = 30;

/// Takes the shortest way, from any context: outputs held low by the timers, drivers put to sleep. Two registers and one pin
/// an axis.
pub fn switch_off<const N: usize>(board: &'static Board) {
    timers::<N>(board).for_each(Timer::disable_outputs);
    board.axes.iter().take(N).for_each(|axis| Wire(axis.sleep).drive(false));
}

/// The bridges and sensors of `N` axes.
pub struct DriveOf<const N: usize> {
    axes: Axes<Stm32Parts, N>,
    board: &'static Board,
    converter: ADC1,
    /// Ticks in which the phase of the update is still checked.
    aligning: u8,
    /// Core clock at the beginning of the last tick, if the next one is due a period later.
    begun: Option<u32>,
    /// A tick was lost altogether.
    late: bool,
    periods: u8,
    full: u16,
}

impl<const N: usize> DriveOf<N> {
    /// Sets up timers, pins, counters and converters. Order: safe lines first, pins leave their reset state last.
    pub fn prepare(
        common: &ADC_COMMON,
        currents: ADC1,
        supply: &ADC2,
        board: &'static Board,
        settling: u8,
    ) -> Self {
        board.axes.iter().take(N).for_each(|axis| Wire(axis.sleep).drive(false));
        gates::rest_lines();
        board.high.iter().for_each(|pin| Wire(*pin).drive(true));
        for (name, timer) in named_timers::<N>(board) {
            timer.set_up(name, board, N, timing::START_FULL_SCALE, timing::START_PERIODS);
        }
        gpio::set_up::<N>(board.stage.has_low_sides());
        board.axes.iter().take(N).for_each(|axis| Quadrature::of(axis.encoder).start());
        converter::start(common, &currents, supply, board, N);
        Self::new(currents, board, settling)
    }

    /// Lets outputs follow where that is not the enable line of the bridge, and time begin.
    pub fn go(&self) {
        if !self.board.stage.has_low_sides() {
            timers::<N>(self.board).for_each(Timer::enable_outputs);
        }
        timers::<N>(self.board).for_each(Timer::start);
    }

    /// Takes the drive when pins, timers and converters are set up.
    fn new(converter: ADC1, board: &'static Board, settling: u8) -> Self {
        let (full, periods) = (timing::START_FULL_SCALE, timing::START_PERIODS);
        let axes = core::array::from_fn(|axis| guarded(axis, board, full));
        Self {
            axes: Axes::new(axes, breakers::<N>(board), settling),
            board,
            converter,
            aligning: ALIGNING,
            begun: None,
            late: false,
            periods,
            full,
        }
    }

    /// Sets one axis' bridge.
    pub fn set(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.axes.apply(axis, bridge, duty);
    }

    /// Takes over the full scale, which needs new lines.
    fn rescale(&mut self, axis: usize) {
        self.axes.put_bridge(axis, power_stage(axis, self.board, self.full));
    }

    /// A measurement that ends while the one before has not been looked at leaves no trace but the time.
    fn watch(&mut self) {
        let now = DWT::cycle_count();
        let period = 2 * u32::from(self.full) * u32::from(self.periods);
        self.late = self.begun.is_some_and(|begun| now.wrapping_sub(begun) > period + period / 2);
        self.begun = Some(now);
    }

    /// Updates belong at the upper turning point. Whether an odd repetition count lands there or at the lower one
    /// depends on its phase against the counter, about which the reference manuals of this timer disagree; so the first
    /// ticks look, and one interval shorter by half a period corrects it.
    fn align(&mut self) {
        let Some(left) = self.aligning.checked_sub(1) else {
            return;
        };
        self.aligning = left;
        let slip = left % 2 == 1 && !Timer::of(PwmTimer::One).runs_down();
        for timer in timers::<N>(self.board) {
            timer.set_repetitions(timing::repetitions(self.periods).saturating_sub(u8::from(slip)));
        }
    }
}

impl<const N: usize> Drive for DriveOf<N> {
    fn begin_tick(&mut self) {
        self.watch();
        Wire(self.board.tick).drive(true);
        converter::clear_end(&self.converter);
        self.axes.begin_tick();
        self.align();
    }

    fn sample(&self, axis: usize) -> Sample {
        self.axes.sample(axis)
    }

    fn interlock(&self, axis: usize) -> Interlock {
        self.axes.interlock(axis)
    }

    fn index(&self, axis: usize) -> bool {
        self.axes.index(axis)
    }

    fn apply(&mut self, axis: usize, bridge: Bridge, duty: i16) {
        self.set(axis, bridge, duty);
    }

    /// Tells the watchdog and the oscilloscope. The next measurement has already ended: the tick was too long. So it was, or
    /// something held it up, where it began more than a period and a half after the one before.
    fn end_tick(&mut self) -> bool {
        watchdog::control_has_run();
        Wire(self.board.tick).drive(false);
        converter::has_ended(&self.converter) || self.late
    }

    fn zeros(&self, axis: usize) -> [i16; 2] {
        self.axes.zeros(axis)
    }

    fn gates(&self) -> Option<Gates> {
        gates::report()
    }

    fn goes_round(&self, axis: usize) -> bool {
        self.axes.goes_round(axis)
    }

    /// The request for a reset, ARMv7-M Architecture Reference Manual, B3.2.6. Outputs float, and the gates are pulled down.
    fn restart(&mut self) {
        cortex_m::peripheral::SCB::sys_reset()
    }

    /// All axes are rescaled when the scale is new; else the other axes may be driven and are left alone.
    fn configure(&mut self, axis: usize, config: &Config) {
        let Some(periods) = timing::periods_per_tick(config.pwm_full_scale, config.tick_hz) else {
            return;
        };
        if (self.full, self.periods) == (config.pwm_full_scale, periods) {
            self.rescale(axis);
            return;
        }
        (self.full, self.periods) = (config.pwm_full_scale, periods);
        for timer in timers::<N>(self.board) {
            timer.set_period(self.full, periods);
        }
        (0..N).for_each(|axis| self.rescale(axis));
        (self.aligning, self.begun) = (ALIGNING, None);
    }

    /// Core clocks.
    fn clock(&self) -> u32 {
        DWT::cycle_count()
    }

    fn clock_since(&self, start: u32) -> u32 {
        self.clock().wrapping_sub(start)
    }
}
