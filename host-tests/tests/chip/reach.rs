//! Limits that no reading of a board can exceed are refused, with the largest value that would act.

use servo::config::{Config, ConfigError, Field};
use servo::drivers::reach::Reach;
use servo::optional::Optional;
use servo::protect::{Settings, Thermal};

/// The board of `docs/hardware.md`: 36.3 V of supply, and a DRV8874 carrier that ends at 2.9 A.
const BOARD: Reach = Reach { supply: 4095, current: 4035 };
const VOLT: f32 = 8.862_305e-3;
const AMPERE: f32 = 719.022e-6;

fn config(nominal: f32) -> Config {
    Config { supply_nominal_v: nominal, vbus_v_per_lsb: VOLT, current_a_per_lsb: AMPERE, ..Config::EXAMPLE }
}

#[track_caller]
fn refused(reach: Reach, config: &Config, protection: Option<&Settings>, field: Field, most: f32) {
    let ConfigError { field: named, maximum, .. } =
        reach.allows(config, protection).expect_err("a limit that cannot act");
    assert_eq!(named, field);
    assert!((maximum - most).abs() < 0.002 * most.max(1e-3), "{maximum} instead of {most}");
}

/// The largest word of the supply and the lowest words of the current are marks of what is not measured.
#[test]
fn a_sample_reaches_as_far_as_its_words() {
    assert_eq!(Reach::WORDS, Reach { supply: 65_534, current: 32_767 });
}

#[test]
fn what_the_converters_reach_is_allowed() {
    let limited = Config {
        current_limit_a: Optional::new(2.7),
        energy_limit_j: Optional::new(100.0),
        supply_high_v: Optional::new(20.0),
        ..config(12.0)
    };
    assert_eq!(BOARD.allows(&config(24.0), None), Ok(()));
    assert_eq!(BOARD.allows(&limited, Some(&Settings::default())), Ok(()));
}

/// One and a half times 30 V lies above 36.3 V: the fault could never be seen.
#[test]
fn a_supply_limit_above_the_divider_is_refused_even_where_nobody_set_it() {
    refused(BOARD, &config(30.0), None, Field::SupplyHigh, 36.28);
    let lowered = Config { supply_high_v: Optional::new(36.0), ..config(30.0) };
    assert_eq!(BOARD.allows(&lowered, None), Ok(()));
    let set = Config { supply_high_v: Optional::new(40.0), ..config(24.0) };
    refused(BOARD, &set, None, Field::SupplyHigh, 36.28);
    refused(BOARD, &config(45.0), None, Field::SupplyNominal, 36.28);
}

#[test]
fn a_current_limit_above_the_sensor_is_refused() {
    let limited = |ampere| Config { current_limit_a: Optional::new(ampere), ..config(12.0) };
    // The fault lies a sixteenth above the limit.
    refused(BOARD, &limited(5.0), None, Field::CurrentLimit, 2.9006 / 1.0625);
    let thermal = Thermal { continuous_a: 5.0, time_constant_s: 60 };
    let settings = Settings { thermal: Some(thermal), ..Settings::default() };
    refused(BOARD, &config(12.0), Some(&settings), Field::ContinuousCurrent, 2.9006);
}

#[test]
fn a_limit_of_what_is_not_sensed_is_refused() {
    let blind = Reach { current: 0, ..BOARD };
    let current = Config { current_limit_a: Optional::new(1.0), ..config(12.0) };
    let energy = Config { energy_limit_j: Optional::new(1.0), ..config(12.0) };
    refused(blind, &current, None, Field::CurrentLimit, 0.0);
    refused(blind, &energy, None, Field::EnergyLimit, 0.0);
    assert_eq!(blind.allows(&config(12.0), None), Ok(()));
}

/// The largest limit that is allowed is one that the largest reading exceeds.
#[test]
fn the_largest_limit_that_is_told_is_allowed_and_acts() {
    let set = Config { current_limit_a: Optional::new(5.0), ..config(12.0) };
    let told = BOARD.allows(&set, None).expect_err("too large").maximum;
    let largest = Config { current_limit_a: Optional::new(told), ..set };
    assert_eq!(BOARD.allows(&largest, None), Ok(()));
    assert!(f32::from(BOARD.current) * AMPERE > told);
}
