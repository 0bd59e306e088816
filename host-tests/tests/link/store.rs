//! Stored parameters: the record and its layouts, the log on flash, and the power cuts (reduced; the full table comes
//! from `cargo run --package evaluation -- power-cuts`).

use embedded_storage::nor_flash::NorFlash;
use servo::axis::Bridge;
use servo::compensate::modelled::Modelled;
use servo::compensate::position_load::{Harmonic, Load, PositionLoad};
use servo::config::Config;
use servo::control::Tuning;
use servo::identify::estimate::{Estimate, Estimates, Mechanism, Standing};
use servo::optional::Optional;
use servo::protect::{Action, Actions, Fault, Settings, Thermal};
use servo::store::SaveError;
use servo::store::{
    AtRest, AxisParameters, Found, LAYOUT, Loaded, RECORD_LEN, Record, StoredParameters, encode,
};
use trials::power_cut::flash::Flash;
use trials::power_cut::library;
use trials::power_cut::sets::{
    SetLayout1, SetLayout2, SetLayout3, SetLayout5, limited_as_layout_3, migrated, set, untold,
};
use trials::power_cut::suite::{
    Situation, Store, Tally, cut_erase, cut_everywhere, life, loaded, operations, save,
};

const SMALL: usize = 4096;

fn at_rest() -> AtRest {
    AtRest::check(Bridge::Open, true).expect("open and standing is at rest")
}

fn new_store() -> Store<SMALL> {
    let mut store = Store::new(Flash::new(3), 0);
    assert_eq!(store.load(), Loaded::Blank);
    store
}

fn power_cycle(store: &mut Store<SMALL>) -> Store<SMALL> {
    Store::new(store.flash().clone(), 0)
}

#[test]
fn every_flash_operation_is_cut_and_the_old_or_the_new_set_is_read() {
    for situation in Situation::ALL {
        let tally = cut_everywhere::<SMALL>(situation, 1, 1);
        assert_eq!(tally.losses(), 0, "{situation:?}: {tally:?}");
        assert_eq!(tally.cuts, 8 * operations::<SMALL>(situation), "{situation:?}");
        assert_eq!(tally.old + tally.new, tally.cuts, "{situation:?}: {tally:?}");
        assert!(tally.old > 0 && tally.new > 0, "{situation:?}: {tally:?}");
    }
}

#[test]
fn a_cut_erase_never_costs_the_set() {
    let tally = cut_erase::<SMALL>(100);
    assert_eq!((tally.cuts, tally.old, tally.losses()), (800, 800, 0), "{tally:?}");
}

#[test]
fn lives_with_several_cuts_in_a_row_lose_nothing() {
    let tally = (0..40).map(|seed| life::<SMALL>(seed, 40)).fold(Tally::default(), Tally::plus);
    assert_eq!(tally.losses(), 0, "{tally:?}");
    assert!(tally.cuts > 500, "{tally:?}");
}

/// The same cuts do find losses where there are some.
#[test]
fn the_cuts_find_the_losses_of_the_bare_library() {
    let tally = library::cut_erase::<SMALL>(100);
    assert_eq!(tally.cuts, 800);
    assert!(tally.losses() >= 5, "{tally:?}");
}

#[test]
fn sectors_of_real_size_hold_two_hundred_records() {
    assert_eq!(Store::<{ 128 * 1024 }>::SLOTS, 201);
    let tally = cut_everywhere::<{ 128 * 1024 }>(Situation::AfterPowerUp, 81, 1);
    assert_eq!(tally.losses(), 0, "{tally:?}");
}

#[test]
fn saves_erase_only_when_told_to() {
    let mut store = new_store();
    assert_eq!(store.save(&set(0), at_rest()), Err(SaveError::EraseNeeded));
    assert_eq!(store.flash().operations, 0, "nothing was touched");
    store.erase(at_rest()).expect("erases");
    for number in 0..Store::<SMALL>::SLOTS {
        assert!(!store.erase_needed(), "save {number}");
        store.save(&set(number), at_rest()).expect("a slot is left");
    }
    assert!(store.erase_needed());
    let operations = store.flash().operations;
    assert_eq!(store.save(&set(90), at_rest()), Err(SaveError::EraseNeeded));
    assert_eq!(store.flash().operations, operations, "nothing was touched");
    assert_eq!(store.flash().erasures.len(), 1);
    store.erase(at_rest()).expect("erases");
    store.save(&set(91), at_rest()).expect("the other sector is blank");
    assert_eq!(loaded(&mut power_cycle(&mut store)), Some(set(91)));
    assert_eq!(store.flash().erasures.len(), 2);
}

#[test]
fn a_clean_power_up_writes_nothing() {
    let mut store = new_store();
    save(&mut store, &set(5)).expect("saves");
    let operations = store.flash().operations;
    let mut store = power_cycle(&mut store);
    assert_eq!(loaded(&mut store), Some(set(5)));
    assert_eq!(store.flash().operations, operations);
}

/// Two thousand saves over power-ups: every one read back, both sectors worn alike.
#[test]
fn a_long_life_without_cuts_loses_nothing() {
    let mut store = new_store();
    for number in 0..2000 {
        save(&mut store, &set(number)).expect("saves");
        store = power_cycle(&mut store);
        assert_eq!(loaded(&mut store), Some(set(number)), "save {number}");
    }
    // A session with one save takes two of the six slots; the first one after a sector change takes one.
    let erasures = store.flash().erasures.len();
    assert!((2000 / 4..=2000 / 3 + 1).contains(&erasures), "{erasures}");
}

#[test]
fn a_worn_word_costs_one_slot_and_no_set() {
    let mut store = new_store();
    save(&mut store, &set(1)).expect("saves");
    store.flash().worn = Some((4 + 648 + 100) / 4);
    store.save(&set(2), at_rest()).expect("the slot behind is used");
    assert_eq!(loaded(&mut power_cycle(&mut store)), Some(set(2)));
    store.save(&set(3), at_rest()).expect("saves");
    assert_eq!(loaded(&mut power_cycle(&mut store)), Some(set(3)));
}

#[test]
fn only_an_open_bridge_and_a_standing_shaft_are_at_rest() {
    assert!(AtRest::check(Bridge::Open, true).is_some());
    assert!(AtRest::check(Bridge::Open, false).is_none());
    assert!(AtRest::check(Bridge::Driven, true).is_none());
    assert!(AtRest::check(Bridge::Shorted, true).is_none());
}

#[test]
fn random_bits_are_damaged_not_a_set() {
    for seed in 0..50 {
        let mut flash = Flash::<SMALL>::new(seed);
        flash.scramble(0);
        flash.scramble(1);
        assert_eq!(Store::new(flash, 0).load(), Loaded::Damaged);
    }
}

#[test]
fn a_damaged_newest_record_leaves_the_one_before() {
    let mut store = new_store();
    save(&mut store, &set(1)).expect("saves");
    save(&mut store, &set(2)).expect("saves");
    let word = 4 + 648 + 8 + 40;
    store.flash().write(word, &[0; 4]).expect("programs");
    assert_eq!(loaded(&mut power_cycle(&mut store)), Some(set(1)));
}

#[test]
fn layout_1_is_migrated() {
    let mut store = new_store();
    store.erase(at_rest()).expect("erases");
    store.save_as(&SetLayout1::of(&set(7)), 1, at_rest()).expect("saves");
    let mut store = power_cycle(&mut store);
    let expected = Loaded::Set { parameters: migrated(&set(7)), layout: 1 };
    assert_eq!(store.load(), expected);
    save(&mut store, &migrated(&set(7))).expect("saves");
    let Loaded::Set { layout, .. } = power_cycle(&mut store).load() else {
        panic!("the migrated set is read");
    };
    assert_eq!(layout, LAYOUT);
}

/// The very bytes that layout 2 had: header, set without empty axes, checksum.
#[test]
fn layout_2_is_migrated() {
    let record = encode(&SetLayout2::of(&set(0)), 1, 2).expect("fits");
    assert_eq!(hex(used(&record)), include_str!("store_layout_2.hex").trim());
    let expected = Loaded::Set { parameters: limited_as_layout_3(&set(0)), layout: 2 };
    assert_eq!(Record::parse(&record).expect("intact").load(), expected);
}

/// The very bytes that layout 3 had: configurations without the limits that came later, empty axes too.
#[test]
fn layout_3_is_migrated() {
    let record = encode(&SetLayout3::of(&set(0)), 1, 3).expect("fits");
    assert_eq!(hex(used(&record)), include_str!("store_layout_3.hex").trim());
    for number in [0, 5, 7] {
        let record = encode(&SetLayout3::of(&set(number)), 1, 3).expect("fits");
        let expected = Loaded::Set { parameters: limited_as_layout_3(&set(number)), layout: 3 };
        assert_eq!(Record::parse(&record).expect("intact").load(), expected);
    }
}

/// An older image on a newer image's flash: it asks for commissioning and does not reach for an older set.
/// The very bytes that layout 4 had: no load over the place.
#[test]
fn layout_4_is_migrated() {
    let text = include_str!("store_layout_4.hex").trim();
    let byte = |at: usize| u8::from_str_radix(&text[at..at + 2], 16).expect("a byte");
    let used: Vec<u8> = (0..text.len()).step_by(2).map(byte).collect();
    let mut record = encode(&(), 1, 4).expect("fits");
    record[..used.len()].copy_from_slice(&used);
    let step = |crc: u32, _| if crc & 1 == 1 { crc >> 1 ^ 0xEDB8_8320 } else { crc >> 1 };
    let covered = &record[..RECORD_LEN - 4];
    let checksum = !covered.iter().fold(u32::MAX, |crc, byte| (0..8).fold(crc ^ u32::from(*byte), step));
    record[RECORD_LEN - 4..].copy_from_slice(&checksum.to_le_bytes());
    let mut parameters = untold(&set(0));
    for axis in parameters.axes.iter_mut().flatten() {
        assert_ne!(axis.position_load, PositionLoad::default());
        axis.position_load = PositionLoad::default();
    }
    let loaded = Record::parse(&record).expect("a record").load();
    assert_eq!(loaded, Loaded::Set { parameters, layout: 4 });
}

/// The very bytes that layout 5 had: no lag.
#[test]
fn layout_5_is_migrated() {
    let record = encode(&SetLayout5::of(&set(0)), 1, 5).expect("fits");
    assert_eq!(hex(used(&record)), include_str!("store_layout_5.hex").trim());
    for number in [1, 5, 7] {
        let record = encode(&SetLayout5::of(&set(number)), 1, 5).expect("fits");
        let expected = Loaded::Set { parameters: untold(&set(number)), layout: 5 };
        assert_eq!(Record::parse(&record).expect("intact").load(), expected);
    }
}

/// Layout 6 knew the lag alone, layout 7 the share of the torque, too, and layout 8 no doubts.
#[test]
fn layouts_6_to_8_are_migrated() {
    let mut parameters = set(0);
    parameters.axes.iter_mut().flatten().for_each(|axis| axis.modelled.doubted = 0);
    let older =
        |it: Modelled| Modelled { lag: it.lag, load_friction: it.load_friction, ..Modelled::default() };
    let stored = |parameters: &StoredParameters, layout: u16, bytes: &str| {
        let record = encode(parameters, 1, layout).expect("fits");
        assert_eq!(hex(used(&record)), bytes.trim());
        let parameters = parameters.clone();
        assert_eq!(Record::parse(&record).expect("intact").load(), Loaded::Set { parameters, layout });
    };
    stored(&parameters, 8, include_str!("store_layout_8.hex"));
    parameters.axes.iter_mut().flatten().for_each(|axis| axis.modelled = older(axis.modelled));
    stored(&parameters, 7, include_str!("store_layout_7.hex"));
    parameters.axes.iter_mut().flatten().for_each(|axis| axis.modelled.load_friction = 0);
    stored(&parameters, 6, include_str!("store_layout_6.hex"));
}

#[test]
fn an_unknown_layout_asks_for_commissioning() {
    let mut store = new_store();
    save(&mut store, &set(1)).expect("saves");
    store.save_as(&(1u8, [2u16; 9]), LAYOUT + 1, at_rest()).expect("saves");
    let mut store = power_cycle(&mut store);
    assert_eq!(store.load(), Loaded::Unreadable { layout: LAYOUT + 1 });
    save(&mut store, &set(4)).expect("saves");
    assert_eq!(loaded(&mut power_cycle(&mut store)), Some(set(4)));
}

#[test]
fn a_set_outside_this_images_ranges_is_not_used() {
    let mut bad = set(1);
    bad.axes[1].as_mut().expect("an axis").config.supply_nominal_v = f32::NAN;
    let record = encode(&bad, 1, LAYOUT).expect("fits");
    let loaded = Record::parse(&record).expect("intact").load();
    assert_eq!(loaded, Loaded::Unreadable { layout: LAYOUT });
}

#[test]
fn a_payload_with_bytes_left_over_is_not_a_set() {
    let record = encode(&(set(1), 0u8), 1, LAYOUT).expect("fits");
    let loaded = Record::parse(&record).expect("intact").load();
    assert_eq!(loaded, Loaded::Unreadable { layout: LAYOUT });
}

#[test]
fn every_single_bit_error_in_a_record_is_found() {
    let record = encode(&set(3), 1, LAYOUT).expect("fits");
    assert!(Record::parse(&record).is_some());
    for bit in 0..8 * RECORD_LEN {
        let mut damaged = record;
        damaged[bit / 8] ^= 1 << (bit % 8);
        assert!(Record::parse(&damaged).is_none(), "bit {bit}");
    }
}

/// Numbers that take the most bytes in postcard.
#[test]
fn the_largest_set_fits_into_a_record() {
    let long = Estimate { value: i32::MIN, u95: i32::MIN, standing: Standing::Trusted };
    let mut axis = AxisParameters {
        config: set(1).axes[0].expect("an axis").config,
        estimates: Estimates {
            dead_zone: [long; 2],
            saturation: [long; 2],
            gain_skew: i32::MIN,
            gain: long,
            time_constant: long,
            mechanism: Mechanism::InputDeadZone,
        }
        .to_store(),
        tuning: Tuning { bandwidth: 20.0, integral: true },
        compensation: true,
        protection: Settings {
            actions: Fault::ALL
                .iter()
                .fold(Actions::default(), |table, &fault| table.with(fault, Action::Brake).unwrap_or(table)),
            thermal: Some(Thermal { continuous_a: 1.0, time_constant_s: u16::MAX }),
            command_timeout_ms: u16::MAX,
        },
        position_load: PositionLoad::default(),
        modelled: Modelled { lag: 127, ..Modelled::default() },
    };
    // The largest that a configuration may have.
    axis.config.counts_per_rev = 1_000_000;
    axis.config.tick_hz = 20_000;
    axis.config.energy_limit_j = Optional::new(1.0);
    axis.config.pwm_full_scale = u16::MAX;
    axis.config.pwm_delay_ticks = u8::MAX;
    axis.config.supply_high_v = Optional::new(18.0);
    axis.config.jerk_limit_rad_s3 = Optional::new(1e6);
    let set: StoredParameters = StoredParameters { axes: core::iter::repeat_n(Some(axis), 4).collect() };
    assert_eq!(set.axes.len(), 4);
    let record = encode(&set, u32::MAX, LAYOUT).expect("fits");
    assert_eq!(used(&record).len() - 8, 625, "as docs/store.md and `RECORD_LEN` say");
    // With a table of four sines three axes fit, whatever their numbers.
    let sine = Harmonic { cycles: 60_000, amplitude_v: 0.8, phase_rad: -0.001 };
    let table = Load { period_counts: 1 << 23, constant_v: -2.7, harmonics: &[sine; 4] };
    let scale = Config::EXAMPLE.build().expect("a scale");
    axis.position_load = table.build(&scale).expect("a table").absolute(true);
    let axes = |number| -> StoredParameters {
        StoredParameters { axes: core::iter::repeat_n(Some(axis), number).collect() }
    };
    assert!(encode(&axes(3), u32::MAX, LAYOUT).is_ok() && encode(&axes(4), u32::MAX, LAYOUT).is_err());
}

/// An image has room for the axes that it drives, and what it has no room for must be nothing.
#[test]
fn an_image_with_one_axis_reads_a_set_of_one_axis_alone() {
    let whole = set(0);
    let first = whole.axes[0];
    assert!(first.is_some());
    for (axes, fits) in [
        (vec![first], true),
        (vec![first, None, None, None], true),
        (vec![None, None], true),
        (vec![first, first], false),
        (vec![None, first], false),
        // More than any image drives.
        (vec![None; 5], false),
    ] {
        let bytes = encode(&axes, 1, LAYOUT).expect("fits");
        let mut room = StoredParameters::<1>::default();
        let found = Record::parse(&bytes).expect("a record").load_into(&mut room);
        if fits {
            assert_eq!(found, Found::Set { layout: LAYOUT });
            assert_eq!(room.axes.as_slice(), &axes[..1]);
        } else {
            assert_eq!(found, Found::Unreadable { layout: LAYOUT });
            assert!(room.axes.is_empty());
        }
    }
}

/// The bytes on the flash of customers. If this fails, the layout has changed: raise `LAYOUT`, keep a reader for the
/// layout before, and only then put the new bytes here.
#[test]
fn the_layout_is_what_it_was() {
    let record = encode(&set(0), 1, LAYOUT).expect("fits");
    let file = format!("{}/tests/link/store_layout_{LAYOUT}.hex", env!("CARGO_MANIFEST_DIR"));
    assert_eq!(hex(used(&record)), std::fs::read_to_string(file).expect("the bytes of this layout").trim());
}

/// Header and set, without the padding.
fn used(record: &[u8; RECORD_LEN]) -> &[u8] {
    &record[..8 + usize::from(u16::from_le_bytes([record[6], record[7]]))]
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[test]
#[should_panic(expected = "programmed over")]
fn the_mock_flash_refuses_to_lift_a_bit() {
    let mut flash = Flash::<SMALL>::new(1);
    flash.write(8, &[0xF0; 4]).expect("programs");
    let _ = flash.write(8, &[0x0F; 4]);
}

#[test]
#[should_panic(expected = "off the words")]
fn the_mock_flash_refuses_an_odd_address() {
    let _ = Flash::<SMALL>::new(1).write(2, &[0; 4]);
}
