//! The table over the place in integers: beside the same sum in double precision, its bounds, and what it refuses.

use proptest::prelude::*;
use servo::compensate::position_load::{Harmonic, Load, MOST_HARMONICS, MOST_SHARE, PositionLoad};
use servo::config::{Config, ConfigError, Field};
use servo::units::Voltage;
use std::f64::consts::TAU;

fn build(period_counts: u32, constant_v: f32, harmonics: &[Harmonic]) -> Result<PositionLoad, ConfigError> {
    let scale = Config::EXAMPLE.build().expect("a configuration");
    Load { period_counts, constant_v, harmonics }.build(&scale)
}

/// V, from double precision, whatever the distance.
fn volts(period: u32, constant: f32, harmonics: &[Harmonic], counts: i32) -> f64 {
    let turned = |cycles: u16| (i64::from(counts) * i64::from(cycles)).rem_euclid(i64::from(period));
    let sine = |h: &Harmonic| {
        let angle = TAU * turned(h.cycles) as f64 / f64::from(period) + f64::from(h.phase_rad);
        f64::from(h.amplitude_v) * angle.sin()
    };
    f64::from(constant) + harmonics.iter().map(sine).sum::<f64>()
}

/// Tables that are accepted: 12 V nominal, so 6 V in all.
fn table() -> impl Strategy<Value = (u32, f32, Vec<Harmonic>)> {
    let harmonic = (1u16..=40, 0.0f32..1.3, -6.25f32..6.25)
        .prop_map(|(cycles, amplitude_v, phase_rad)| Harmonic { cycles, amplitude_v, phase_rad });
    (320u32..16_777_216, -0.7f32..0.7, prop::collection::vec(harmonic, 0..=MOST_HARMONICS))
}

proptest! {
    #[test]
    fn the_voltage_is_that_of_the_sum_however_far_away((period, constant, harmonics) in table(), counts in any::<i32>()) {
        let table = build(period, constant, &harmonics).expect("within the ranges");
        let voltage = f64::from(table.voltage(counts).0) / f64::from(Voltage::NOMINAL.0) * 12.0;
        // Half a place of Q15 for every amplitude and the constant, half a place of the phases' 2⁻¹⁶ turns.
        let places = (harmonics.len() + 1) as f64 * 0.5 * 12.0 / 32_768.0;
        let angles: f64 = harmonics.iter().map(|h| f64::from(h.amplitude_v) * TAU / 65_536.0).sum();
        let truth = volts(period, constant, &harmonics, counts);
        prop_assert!((voltage - truth).abs() < 1.05 * places + angles + 1e-4, "{voltage} V, {truth} V");
    }

    #[test]
    fn it_comes_back_from_its_bytes_as_it_was((period, constant, harmonics) in table(), bits in 0u8..8) {
        let table = build(period, constant, &harmonics).expect("within the ranges");
        let table = table.switched(bits & 1 == 0).trusted(bits & 2 == 0).absolute(bits & 4 == 0);
        let bytes = postcard::to_allocvec(&table).expect("bytes");
        prop_assert_eq!(postcard::from_bytes::<PositionLoad>(&bytes), Ok(table));
        prop_assert_eq!((table.period_counts(), table.is_on(), table.is_trusted(), table.is_absolute()),
            (period, bits & 1 == 0, bits & 2 == 0, bits & 4 == 0));
    }

    /// Whatever bytes arrive: no panic, and never more than the bound.
    #[test]
    fn no_bytes_are_more_than_the_bound(words in prop::collection::vec(any::<u64>(), 5), counts in any::<i32>()) {
        let bytes = postcard::to_allocvec(&(words[0], words[1], words[2], words[3], words[4])).expect("bytes");
        let table: PositionLoad = postcard::from_bytes(&bytes).expect("any words are a table");
        prop_assert!(table.voltage(counts).0.abs() <= (MOST_SHARE * Voltage::NOMINAL.0 as f32) as i32);
        let steepest = (-40..40).map(|n| (table.voltage(counts + n).0 - table.voltage(counts + n + 1).0).abs()).max();
        if table.check().is_ok() {
            let most = table.slope() * Voltage::NOMINAL.0 as f32 * 1.001 + 8.0;
            prop_assert!(steepest.expect("some") as f32 <= most, "{steepest:?} of {most}");
        }
    }
}

#[test]
fn numbers_out_of_range_are_refused_by_name() {
    let sine = Harmonic { cycles: 1, amplitude_v: 1.0, phase_rad: 0.5 };
    let field = |period, constant, harmonics: &[Harmonic]| {
        build(period, constant, harmonics).err().map(|error| error.field)
    };
    assert_eq!(field(2048, 0.0, &[sine; 4]), None);
    assert_eq!(field(7, 0.0, &[]), Some(Field::LoadPeriod));
    assert_eq!(field(1 << 24, 0.0, &[]), Some(Field::LoadPeriod));
    assert_eq!(field(2048, f32::NAN, &[]), Some(Field::LoadAmplitude));
    assert_eq!(field(2048, 6.1, &[]), Some(Field::LoadAmplitude));
    assert_eq!(field(2048, 0.0, &[sine; 5]), Some(Field::LoadHarmonics));
    for (wrong, why) in [
        (Harmonic { cycles: 0, ..sine }, Field::LoadCycles),
        (Harmonic { cycles: 257, ..sine }, Field::LoadCycles),
        (Harmonic { amplitude_v: f32::NAN, ..sine }, Field::LoadAmplitude),
        (Harmonic { amplitude_v: -0.1, ..sine }, Field::LoadAmplitude),
        // With the other one and the constant more than half the supply.
        (Harmonic { amplitude_v: 4.6, ..sine }, Field::LoadAmplitude),
        (Harmonic { phase_rad: f32::NAN, ..sine }, Field::LoadPhase),
        (Harmonic { phase_rad: 6.4, ..sine }, Field::LoadPhase),
    ] {
        assert_eq!(field(2048, -0.5, &[sine, wrong]), Some(why), "{wrong:?}");
    }
}

/// What follows the shaft takes 0.9 of the loops' stiffness at most.
#[test]
fn a_steep_table_follows_the_shaft_in_part() {
    let sine = Harmonic { cycles: 12, amplitude_v: 1.0, phase_rad: 0.5 };
    let table = build(2048, 0.0, &[sine]).expect("a table");
    let rest = |stiffness: f32| f32::from(table.rest(stiffness * table.slope())) / 32_768.0;
    assert_eq!((rest(1.2), rest(1.12), rest(0.0)), (0.0, 0.0, 1.0));
    assert!((rest(0.5) - 0.55).abs() < 1e-4, "{}", rest(0.5));
    let constant = build(2048, 0.5, &[]).expect("a table");
    assert_eq!((constant.rest(0.0), constant.rest(1.0), PositionLoad::default().rest(0.0)), (0, 0, 0));
}
