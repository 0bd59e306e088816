//! Optional numbers of a configuration: on the wire, in text, and when they are no numbers.

use servo::config::{Config, Field};
use servo::optional::Optional;
use trials::simulated_servo::config;

#[test]
fn it_takes_the_room_of_a_number() {
    assert_eq!(size_of::<Optional>(), size_of::<f32>());
}

#[test]
fn on_the_wire_it_is_a_number_and_none_is_the_one_nan() {
    let bytes = |value: Optional| postcard::to_stdvec(&value).expect("fits");
    assert_eq!(bytes(Optional::new(2.5)), 2.5f32.to_le_bytes());
    assert_eq!(bytes(Optional::NONE), 0x7FC0_0000u32.to_le_bytes());
    for (bits, expected) in [
        (2.5f32.to_bits(), Some(2.5)),
        (0x8000_0000, Some(-0.0)),
        // A quiet NaN with a sign and a payload, and a signalling one.
        (0xFFC1_2345, None),
        (0x7F80_0001, None),
    ] {
        let value: Optional = postcard::from_bytes(&bits.to_le_bytes()).expect("four bytes");
        assert_eq!(value.get(), expected);
        assert_eq!(value, Optional::from(expected));
        if expected.is_none() {
            assert_eq!(bytes(value), bytes(Optional::NONE));
        }
    }
}

#[test]
fn in_text_it_is_a_number_or_nothing() {
    for (value, text) in [(Optional::new(2.5), "2.5"), (Optional::NONE, "null")] {
        assert_eq!(serde_json::to_string(&value).expect("text"), text);
        assert_eq!(serde_json::from_str::<Optional>(text).expect("a value"), value);
    }
}

/// Also after a way over the wire, where NaN stands for none.
#[test]
fn a_number_that_is_none_does_not_pass_for_an_absent_one() {
    for value in [Optional::new(f32::NAN), Some(-f32::NAN).into()] {
        let config = Config { energy_limit_j: value, ..config() };
        let bytes = postcard::to_stdvec(&config).expect("fits");
        let arrived: Config = postcard::from_bytes(&bytes).expect("a configuration");
        for config in [config, arrived] {
            assert_eq!(config.build().map(|_| ()).map_err(|error| error.field), Err(Field::EnergyLimit));
        }
    }
}
