//! The pin table in code against the data sheet, against itself, against the wiring that was promised and against the
//! documentation; and the arithmetic from times to register values.

/// The data of a board, with what it is made of.
macro_rules! data {
    ($name:ident, $data:literal) => {
        #[allow(dead_code, unused_imports, unexpected_cfgs, unreachable_pub)]
        #[path = "../../../src/image/board/stm32f405"]
        mod $name {
            pub mod board;
            #[path = $data]
            pub mod chosen;
            pub mod pins;
            pub mod stage;
            pub mod timing;
        }
    };
}

data!(own, "boards/own.rs");
data!(odrive, "boards/odrive.rs");
data!(vesc, "boards/vesc.rs");

mod vendors;

use own::chosen::LINES;
use own::pins::{Line, Mode, Pin, Port, Use, fields, port_setup};
use own::timing;
use std::collections::BTreeMap;

/// STM32F405 data sheet (DS8626), table 9, the rows of the pins in use and of their neighbours: pin, function, signal.
/// Only timers and USARTs are listed: nothing else is used.
#[rustfmt::skip]
const TABLE_9: &[(&str, u8, &str)] = &[
    ("PA0",  1, "TIM2_CH1_ETR"), ("PA0",  2, "TIM5_CH1"), ("PA0",  3, "TIM8_ETR"), ("PA0", 7, "USART2_CTS"), ("PA0", 8, "UART4_TX"),
    ("PA1",  1, "TIM2_CH2"),     ("PA1",  2, "TIM5_CH2"), ("PA1",  7, "USART2_RTS"), ("PA1", 8, "UART4_RX"),
    ("PA2",  1, "TIM2_CH3"),     ("PA2",  2, "TIM5_CH3"), ("PA2",  3, "TIM9_CH1"), ("PA2", 7, "USART2_TX"),
    ("PA3",  1, "TIM2_CH4"),     ("PA3",  2, "TIM5_CH4"), ("PA3",  3, "TIM9_CH2"), ("PA3", 7, "USART2_RX"),
    ("PA6",  1, "TIM1_BKIN"),    ("PA6",  2, "TIM3_CH1"), ("PA6",  3, "TIM8_BKIN"), ("PA6", 9, "TIM13_CH1"),
    ("PA7",  1, "TIM1_CH1N"),    ("PA7",  2, "TIM3_CH2"), ("PA7",  3, "TIM8_CH1N"), ("PA7", 9, "TIM14_CH1"),
    ("PA8",  1, "TIM1_CH1"),     ("PA8",  7, "USART1_CK"),
    ("PA9",  1, "TIM1_CH2"),     ("PA9",  7, "USART1_TX"),
    ("PA10", 1, "TIM1_CH3"),     ("PA10", 7, "USART1_RX"),
    ("PA11", 1, "TIM1_CH4"),     ("PA11", 7, "USART1_CTS"),
    ("PA12", 1, "TIM1_ETR"),     ("PA12", 7, "USART1_RTS"),
    ("PA15", 1, "TIM2_CH1_ETR"),
    ("PB0",  1, "TIM1_CH2N"),    ("PB0",  2, "TIM3_CH3"), ("PB0",  3, "TIM8_CH2N"),
    ("PB1",  1, "TIM1_CH3N"),    ("PB1",  2, "TIM3_CH4"), ("PB1",  3, "TIM8_CH3N"),
    ("PB3",  1, "TIM2_CH2"),
    ("PB4",  2, "TIM3_CH1"),
    ("PB5",  2, "TIM3_CH2"),
    ("PB6",  2, "TIM4_CH1"),     ("PB6",  7, "USART1_TX"),
    ("PB7",  2, "TIM4_CH2"),     ("PB7",  7, "USART1_RX"),
    ("PB10", 1, "TIM2_CH3"),     ("PB10", 7, "USART3_TX"),
    ("PB11", 1, "TIM2_CH4"),     ("PB11", 7, "USART3_RX"),
    ("PB12", 1, "TIM1_BKIN"),    ("PB12", 7, "USART3_CK"),
    ("PB13", 1, "TIM1_CH1N"),    ("PB13", 7, "USART3_CTS"),
    ("PB14", 1, "TIM1_CH2N"),    ("PB14", 3, "TIM8_CH2N"), ("PB14", 7, "USART3_RTS"), ("PB14", 9, "TIM12_CH1"),
    ("PB15", 1, "TIM1_CH3N"),    ("PB15", 3, "TIM8_CH3N"), ("PB15", 9, "TIM12_CH2"),
    ("PC6",  2, "TIM3_CH1"),     ("PC6",  3, "TIM8_CH1"), ("PC6",  8, "USART6_TX"),
    ("PC7",  2, "TIM3_CH2"),     ("PC7",  3, "TIM8_CH2"), ("PC7",  8, "USART6_RX"),
    ("PC8",  2, "TIM3_CH3"),     ("PC8",  3, "TIM8_CH3"), ("PC8",  8, "USART6_CK"),
    ("PC9",  2, "TIM3_CH4"),     ("PC9",  3, "TIM8_CH4"),
];

/// DS8626, table 7, column "additional functions".
const ANALOGUE: &[(&str, &str)] = &[
    ("PA6", "ADC12_IN6"),
    ("PC0", "ADC123_IN10"),
    ("PC1", "ADC123_IN11"),
    ("PC2", "ADC123_IN12"),
    ("PC3", "ADC123_IN13"),
    ("PC4", "ADC12_IN14"),
    ("PC5", "ADC12_IN15"),
];

fn name(pin: Pin) -> String {
    format!("P{:?}{}", pin.0, pin.1)
}

#[test]
fn every_alternate_function_is_the_data_sheets() {
    let mut checked = 0;
    for line in LINES {
        let Mode::Alternate(function) = line.mode else {
            continue;
        };
        let pin = name(line.pin);
        let row = (pin.as_str(), function, line.signal);
        assert!(TABLE_9.contains(&row), "{row:?} is not in table 9");
        checked += 1;
    }
    assert_eq!(checked, 22, "8 PWM, 2 low sides, 8 encoder, 2 break, 2 link");
}

#[test]
fn every_analogue_input_is_a_converter_channel() {
    let analogue: Vec<_> = LINES.iter().filter(|line| line.mode == Mode::Analog).collect();
    assert_eq!(analogue.len(), 5);
    for line in analogue {
        assert!(ANALOGUE.contains(&(name(line.pin).as_str(), line.signal)), "{line:?}");
    }
}

#[test]
fn no_pin_serves_two_purposes() {
    let mut users: BTreeMap<Pin, Vec<&str>> = BTreeMap::new();
    for line in LINES {
        users.entry(line.pin).or_default().push(line.role);
    }
    let shared: Vec<_> = users.into_iter().filter(|(_, roles)| roles.len() > 1).collect();
    assert!(shared.is_empty(), "{shared:?}");
}

#[test]
fn no_signal_is_taken_twice() {
    let mut signals: Vec<_> =
        LINES.iter().map(|line| line.signal).filter(|signal| *signal != "GPIO").collect();
    let all = signals.len();
    signals.sort_unstable();
    signals.dedup();
    assert_eq!(signals.len(), all);
}

/// LQFP64 (DS8626, figure 12) brings out ports A, B and C whole, PD2, and the crystal's PH0 and PH1. PB11 is there on the
/// STM32F405, unlike on smaller relatives.
#[test]
fn every_pin_exists_on_the_package_of_64() {
    for line in LINES {
        let Pin(port, number) = line.pin;
        assert!(number < if port == Port::H { 2 } else { 16 }, "{line:?}");
    }
}

/// PA4 and PA5 are the only pins of the package that do not stand 5 V (DS8626, table 7: TTa); encoders and drivers of 5 V
/// are common.
#[test]
fn digital_inputs_stand_five_volts() {
    for line in LINES {
        assert!(![Pin(Port::A, 4), Pin(Port::A, 5)].contains(&line.pin), "{line:?}");
    }
}

fn signal_of(role: &str, needed: Use) -> (&'static str, String) {
    let found: Vec<&Line> = LINES.iter().filter(|line| line.role == role && line.needed == needed).collect();
    assert_eq!(found.len(), 1, "{role} of {needed:?}");
    (found[0].signal, name(found[0].pin))
}

#[test]
fn four_axes_have_the_pins_that_were_promised() {
    let promised = [
        ("TIM1_CH1", "PA8", "TIM1_CH2", "PA9", "TIM2_CH1_ETR", "PA15", "TIM2_CH2", "PB3"),
        ("TIM1_CH3", "PA10", "TIM1_CH4", "PA11", "TIM3_CH1", "PB4", "TIM3_CH2", "PB5"),
        ("TIM8_CH1", "PC6", "TIM8_CH2", "PC7", "TIM4_CH1", "PB6", "TIM4_CH2", "PB7"),
        ("TIM8_CH3", "PC8", "TIM8_CH4", "PC9", "TIM5_CH1", "PA0", "TIM5_CH2", "PA1"),
    ];
    for (axis, row) in promised.into_iter().enumerate() {
        let needed = Use::Axis(axis as u8);
        let expected = [
            ("PWM a", row.0, row.1),
            ("PWM b", row.2, row.3),
            ("encoder A", row.4, row.5),
            ("encoder B", row.6, row.7),
        ];
        for (role, signal, pin) in expected {
            assert_eq!(signal_of(role, needed), (signal, pin.to_string()), "axis {axis}");
        }
        signal_of("current", needed);
        signal_of("sleep or enable", needed);
        assert_eq!(signal_of("encoder index", needed).0, "GPIO");
    }
    assert_eq!(signal_of("link, to the host", Use::Always), ("USART2_TX", "PA2".into()));
    assert_eq!(signal_of("link, from the host", Use::Always), ("USART2_RX", "PA3".into()));
}

#[test]
fn the_debug_probe_and_the_crystal_are_never_touched() {
    for axes in 1..=4 {
        for low_sides in [false, true] {
            let a = port_setup(LINES, Port::A, axes, low_sides);
            assert_eq!(a.pins & (1 << 13 | 1 << 14), 0);
            assert_eq!(port_setup(LINES, Port::B, axes, low_sides).pins & (1 << 2), 0, "BOOT1");
            assert_eq!(port_setup(LINES, Port::C, axes, low_sides).pins & (1 << 14 | 1 << 15), 0);
            assert_eq!(port_setup(LINES, Port::H, axes, low_sides).pins, 0);
        }
    }
}

#[test]
fn register_values_stay_within_the_fields_of_their_pins() {
    for port in [Port::A, Port::B, Port::C] {
        let setup = port_setup(LINES, port, 4, true);
        let twos = !(fields(setup.pins, 2) as u32);
        assert_eq!((setup.mode | setup.pull | setup.speed) & twos, 0, "{port:?}");
        assert_eq!(setup.alternate & !fields(setup.pins, 4), 0, "{port:?}");
    }
    // Two pins by hand: PB3 alternate 1, pulled up; PC4 analogue.
    let b = port_setup(LINES, Port::B, 1, false);
    assert_eq!((b.mode >> 6) & 3, 0b10);
    assert_eq!((b.alternate >> 12) & 15, 1);
    assert_eq!((b.pull >> 6) & 3, 0b01);
    assert_eq!((port_setup(LINES, Port::C, 1, false).mode >> 8) & 3, 0b11);
}

/// Rows of the pin table in the documentation: `| PA8 | TIM1_CH1 (AF1) | … |`.
#[test]
fn the_documentation_shows_exactly_this_table() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/hardware.md");
    let text = std::fs::read_to_string(path).expect("docs/hardware.md is there");
    let documented: Vec<(String, String)> = text
        .lines()
        .filter_map(|row| {
            let mut cells = row.trim().strip_prefix("| P")?.split('|').map(str::trim);
            let (pin, signal) = (cells.next()?, cells.next()?);
            pin[1..].parse::<u8>().ok()?;
            Some((format!("P{pin}"), signal.to_string()))
        })
        .collect();
    let coded: Vec<(String, String)> = LINES
        .iter()
        .map(|line| {
            let function = match line.mode {
                Mode::Alternate(function) => format!("{} (AF{function})", line.signal),
                _ => line.signal.to_string(),
            };
            (name(line.pin), function)
        })
        .collect();
    assert_eq!(documented, coded);
}

// ── Timing ──────────────────────────────────────────────────────────────────────────────────────────────────────────

#[test]
fn the_pll_makes_168_mhz_from_every_common_crystal_within_its_ranges() {
    for hertz in [4, 8, 12, 16, 24, 25, 26].map(|megahertz| megahertz * 1_000_000u32) {
        let (m, n) = timing::pll(hertz).expect("a common crystal");
        // RM0090 section 7.3.2: 2 ≤ M ≤ 63, 50 ≤ N ≤ 432, comparison 1 … 2 MHz, oscillator 100 … 432 MHz.
        assert!((2..=63).contains(&m) && (50..=432).contains(&n), "{hertz}: {m} {n}");
        let comparison = f64::from(hertz) / f64::from(m);
        assert!((1e6..=2e6).contains(&comparison));
        assert_eq!(comparison * f64::from(n) / 2.0, 168e6);
        assert_eq!(comparison * f64::from(n) / 7.0, 48e6);
    }
    assert_eq!(timing::pll(8_000_000), Some((4, 168)));
    assert_eq!(timing::pll(11_059_200), None, "no whole megahertz");
}

/// The internal oscillator is off by −8 to +4.5 % (DS8626): it is the ruler.
#[test]
fn each_crystal_is_told_from_the_others_by_whatever_internal_oscillator() {
    let periods = 31.0 * 8.0 * f64::from(timing::CAPTURES);
    let counts = |crystal: f64, internal: f64| (periods / crystal * internal).round() as u32;
    for crystal in timing::CRYSTALS {
        for internal in [0.92, 0.99, 1.0, 1.01, 1.045] {
            let measured = counts(f64::from(crystal), internal * f64::from(timing::INTERNAL_HZ));
            assert_eq!(timing::crystal(measured), Some(crystal), "{crystal} Hz, {internal}");
        }
        let (m, n) = timing::pll(crystal).expect("the PLL takes it");
        assert_eq!(crystal / u32::from(m) * u32::from(n), 2 * timing::SYSTEM_HZ);
    }
    // A crystal for which nothing was prepared is not multiplied.
    for other in [4e6, 6e6, 10e6, 14e6, 20e6, 32e6] {
        assert_eq!(timing::crystal(counts(other, 16e6)), None, "{other} Hz");
    }
    assert_eq!(timing::crystal(0), None);
}

#[test]
fn the_currents_of_all_axes_are_measured_before_the_counter_turns_again() {
    // 28 + 12 clocks of 21 MHz each, and 2 µs.
    for (axes, microseconds) in [(1, 3.905), (2, 5.810), (4, 9.619)] {
        let half_period = f64::from(timing::least_full_scale(axes)) / 168.0;
        assert!((half_period - microseconds).abs() < 0.01, "{axes} axes: {half_period} µs");
    }
    assert!(timing::least_full_scale(4) < timing::START_FULL_SCALE);
}

#[test]
fn control_rates_are_those_that_divide_the_pwm_frequency_exactly() {
    // 168 MHz / (2 · 4200) = 20 kHz.
    for (tick_hz, periods) in [(20_000, 1), (10_000, 2), (5_000, 4), (4_000, 5), (1_000, 20)] {
        assert_eq!(timing::periods_per_tick(4200, tick_hz), Some(periods));
    }
    assert_eq!(timing::periods_per_tick(4200, 3_000), None, "20 / 3 is no integer");
    assert_eq!(timing::periods_per_tick(4000, 3_000), Some(7), "21 kHz / 7");
    assert_eq!(timing::periods_per_tick(4200, 40_000), None, "faster than the PWM");
    assert_eq!(timing::periods_per_tick(500, 1_000), None, "168 periods: the repetition counter has 8 bits");
    assert_eq!(timing::periods_per_tick(0, 10_000), None);
    assert_eq!(timing::periods_per_tick(4200, 0), None);
}

#[test]
fn repetitions_count_both_turning_points() {
    for periods in 1..=128u8 {
        assert_eq!(u32::from(timing::repetitions(periods)), 2 * u32::from(periods) - 1);
    }
}

/// RM0090, TIM1_BDTR, field DTG, with t = 1 / 168 MHz.
fn dead_time_of(code: u8) -> f64 {
    let clocks = match code {
        0..=127 => u32::from(code),
        128..=191 => (64 + u32::from(code & 0x3F)) * 2,
        192..=223 => (32 + u32::from(code & 0x1F)) * 8,
        224..=255 => (32 + u32::from(code & 0x1F)) * 16,
    };
    f64::from(clocks) / 168e6
}

#[test]
fn dead_time_is_never_shorter_than_asked_and_at_most_one_step_longer() {
    for nanoseconds in 0..=6_000u32 {
        let code = timing::dead_time(nanoseconds).expect("in range");
        let (asked, got) = (f64::from(nanoseconds) * 1e-9, dead_time_of(code));
        let step = match got {
            t if t < 128.0 / 168e6 => 1.0,
            t if t < 256.0 / 168e6 => 2.0,
            t if t < 512.0 / 168e6 => 8.0,
            _ => 16.0,
        } / 168e6;
        assert!(got >= asked - 1e-15, "{nanoseconds} ns: {got}");
        assert!(got - asked < step + 1e-15, "{nanoseconds} ns: {got}");
    }
    assert_eq!(timing::dead_time(6_001), None, "1008 clocks are 6,000 ns");
}

#[test]
fn watchdog_periods_follow_the_manuals_table() {
    // RM0090, table 107: shortest and longest timeout at 32 kHz for each prescaler.
    assert_eq!(timing::watchdog(512), Some((0, 4095)));
    assert_eq!(timing::watchdog(513), Some((1, 2051)));
    assert_eq!(timing::watchdog(1_024), Some((1, 4095)));
    assert_eq!(timing::watchdog(32_768), Some((6, 4095)));
    assert_eq!(timing::watchdog(32_769), None);
    assert_eq!(timing::watchdog(0), None);
    assert_eq!(timing::watchdog(16), Some((0, 127)));
}

#[test]
fn the_links_baud_rate_is_within_the_receivers_tolerance() {
    let divisor = timing::baud_divisor(timing::APB1_HZ, 921_600);
    let actual = f64::from(timing::APB1_HZ) / f64::from(divisor);
    // RM0090, table 140: 3.33 % between both ends; a host's clock takes well below 1 % of that.
    assert!((actual / 921_600.0 - 1.0).abs() < 0.01, "{actual}");
}
