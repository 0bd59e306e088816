//! From times and rates to register values. Pure arithmetic, so it is tested on the host.
//!
//! Clock tree (RM0090 section 7.2): crystal → PLL → 168 MHz core; APB1 42 MHz, APB2 84 MHz. A timer behind a
//! divided bus runs at twice the bus clock: TIM1 and TIM8 at 168 MHz, TIM2 to TIM5 at 84 MHz.

/// Core clock, Hz: the highest that the STM32F405 allows.
pub const SYSTEM_HZ: u32 = 168_000_000;
/// Clock of TIM1 and TIM8, Hz.
pub const PWM_TIMER_HZ: u32 = SYSTEM_HZ;
/// Clock of USART2 and USART3, Hz.
pub const APB1_HZ: u32 = 42_000_000;

/// The oscillator inside the chip, Hz: within 1 % at 25 °C, −8 … +4.5 % over all temperatures (DS8626).
pub const INTERNAL_HZ: u32 = 16_000_000;
/// Crystals that boards carry, Hz.
pub const CRYSTALS: [u32; 4] = [8_000_000, 12_000_000, 16_000_000, 25_000_000];
/// Intervals of a measurement of the crystal, and its periods in each: divided by 31, one capture in eight edges.
pub const CAPTURES: u32 = 16;
const PERIODS_PER_CAPTURE: u32 = 31 * 8;

/// The crystal whose [`CAPTURES`] intervals took `counts` of the internal oscillator: the one within 10 %, which is more
/// than the internal oscillator can be off, and less than half of what lies between two of them.
pub fn crystal(counts: u32) -> Option<u32> {
    let clocks = u64::from(INTERNAL_HZ) * u64::from(CAPTURES * PERIODS_PER_CAPTURE);
    // Clocks that a crystal of so many hertz would have taken: multiplied, for a 64-bit division takes 900 bytes.
    let of = |hertz: u32| u64::from(hertz) * u64::from(counts);
    let within =
        |crystal: u32| clocks >= of(crystal - crystal / 10) && clocks < of(crystal + crystal / 10 + 1);
    CRYSTALS.into_iter().find(|&crystal| within(crystal))
}

/// Divider M and multiplier N of the PLL for a source of `hertz`: the comparison runs at 2 MHz, which RM0090 recommends
/// against jitter, or else at 1 MHz; the oscillator at 336 MHz, twice the core clock.
pub const fn pll(hertz: u32) -> Option<(u8, u16)> {
    let comparison = if hertz.is_multiple_of(2_000_000) { 2_000_000 } else { 1_000_000 };
    let m = hertz / comparison;
    match hertz.is_multiple_of(comparison) && m >= 2 && m <= 63 {
        true => Some((m as u8, (2 * SYSTEM_HZ / comparison) as u16)),
        false => None,
    }
}

/// PWM counts of full duty that are used until a configuration arrives: 168 MHz / (2 · 4200) = 20 kHz.
pub const START_FULL_SCALE: u16 = 4200;
/// Control rate until a configuration arrives, Hz.
pub const START_TICK_HZ: u32 = 10_000;
/// PWM periods per control tick until then.
pub const START_PERIODS: u8 = periods_per_tick(START_FULL_SCALE, START_TICK_HZ).unwrap();

/// PWM periods n per control tick, 1 … 128, if the timer can make `tick_hz` exactly: a centre-aligned period takes
/// 2 · `full_scale` clocks, and the repetition counter of 8 bits counts both of its turning points.
pub const fn periods_per_tick(full_scale: u16, tick_hz: u32) -> Option<u8> {
    let Some(clocks) = (2 * full_scale as u32).checked_mul(tick_hz) else {
        return None;
    };
    if clocks == 0 || !PWM_TIMER_HZ.is_multiple_of(clocks) {
        return None;
    }
    match PWM_TIMER_HZ / clocks {
        periods @ 1..=128 => Some(periods as u8),
        _ => None,
    }
}

/// The smallest full scale with which `currents` currents are measured before the counter turns again, so that the
/// control tick can see in which half of the period it was begun: 40 clocks of the converter at 21 MHz each, and 2 µs
/// until the tick looks.
pub const fn least_full_scale(currents: u8) -> u16 {
    const CONVERSION: u16 = (40 * (PWM_TIMER_HZ / 21_000_000)) as u16;
    CONVERSION * currents as u16 + (2 * (PWM_TIMER_HZ / 1_000_000)) as u16
}

/// Value of the repetition counter for one update every `periods` PWM periods: 2n turning points, less one.
pub const fn repetitions(periods: u8) -> u8 {
    match periods {
        0 => 1,
        // 2 · 128 − 1 still fits eight bits, hence the subtraction first.
        periods => (periods - 1).saturating_mul(2).saturating_add(1),
    }
}

/// DTG field for a dead time of at least `nanoseconds`, at most 6,000 (RM0090, TIM1_BDTR). Its four ranges count steps
/// of 1, 2, 8 and 16 timer clocks.
pub const fn dead_time(nanoseconds: u32) -> Option<u8> {
    let clocks = (nanoseconds as u64 * PWM_TIMER_HZ as u64).div_ceil(1_000_000_000);
    match clocks {
        0..=127 => Some(clocks as u8),
        128..=254 => Some(0x80 | (clocks.div_ceil(2) - 64) as u8),
        255..=504 => Some(0xC0 | (clocks.div_ceil(8) - 32) as u8),
        505..=1008 => Some(0xE0 | (clocks.div_ceil(16) - 32) as u8),
        _ => None,
    }
}

/// Prescaler code and reload value of the independent watchdog for `milliseconds` at its nominal 32 kHz (the data sheet
/// allows 17 to 47 kHz, so the true period lies between 0.68 and 1.9 times that), rounded up. Longest: 32,768 ms.
pub const fn watchdog(milliseconds: u32) -> Option<(u8, u16)> {
    let mut code = 0;
    while code <= 6 {
        let divider = 4 << code;
        let counts = (milliseconds as u64 * 32).div_ceil(divider);
        if counts >= 1 && counts <= 4096 {
            return Some((code, (counts - 1) as u16));
        }
        code += 1;
    }
    None
}

/// Baud rate divisor of a USART with 16-fold oversampling, rounded (RM0090 section 30.3.4: the register holds 16 times
/// the divider, that is clock / baud).
pub const fn baud_divisor(clock_hz: u32, baud: u32) -> u16 {
    ((clock_hz + baud / 2) / baud) as u16
}
