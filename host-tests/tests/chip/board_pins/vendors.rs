//! The pins of boards that one buys against the map of their maker, and against the data sheet of the chip.

use super::{ANALOGUE, TABLE_9, odrive, own, vesc};
use std::collections::BTreeMap;

/// A pin as the maker names it: pin, the firmware's signal and alternate function, the maker's name.
type Map = &'static [(&'static str, &'static str, Option<u8>, &'static str)];

/// github.com/odriverobotics/ODrive: `Firmware/Board/v3/Inc/main.h` (commit 074b042, the branch of v3.5 and v3.6) and, for the
/// functions of timers and ports, `Firmware/Board/v3/board.cpp` (commit 02e29d8) and DS8626.
#[rustfmt::skip]
const ODRIVE: Map = &[
    ("PA9",  "TIM1_CH2",    Some(1), "M0_BH"),
    ("PB14", "TIM1_CH2N",   Some(1), "M0_BL"),
    ("PA10", "TIM1_CH3",    Some(1), "M0_CH"),
    ("PB15", "TIM1_CH3N",   Some(1), "M0_CL"),
    ("PB4",  "TIM3_CH1",    Some(2), "M0_ENC_A"),
    ("PB5",  "TIM3_CH2",    Some(2), "M0_ENC_B"),
    ("PC9",  "GPIO",        None,    "M0_ENC_Z"),
    ("PC0",  "ADC123_IN10", None,    "M0_IB"),
    ("PC1",  "ADC123_IN11", None,    "M0_IC"),
    ("PC7",  "TIM8_CH2",    Some(3), "M1_BH"),
    ("PB0",  "TIM8_CH2N",   Some(3), "M1_BL"),
    ("PC8",  "TIM8_CH3",    Some(3), "M1_CH"),
    ("PB1",  "TIM8_CH3N",   Some(3), "M1_CL"),
    ("PB6",  "TIM4_CH1",    Some(2), "M1_ENC_A"),
    ("PB7",  "TIM4_CH2",    Some(2), "M1_ENC_B"),
    ("PC15", "GPIO",        None,    "M1_ENC_Z"),
    ("PC3",  "ADC123_IN13", None,    "M1_IB"),
    ("PC2",  "ADC123_IN12", None,    "M1_IC"),
    ("PA8",  "GPIO",        None,    "M0_AH"),
    ("PB13", "GPIO",        None,    "M0_AL"),
    ("PC6",  "GPIO",        None,    "M1_AH"),
    ("PA7",  "GPIO",        None,    "M1_AL"),
    ("PB10", "GPIO",        None,    "AUX_L"),
    ("PB11", "GPIO",        None,    "AUX_H"),
    ("PB12", "GPIO",        None,    "EN_GATE"),
    ("PD2",  "GPIO",        None,    "nFAULT"),
    ("PC10", "GPIO",        None,    "SPI3_SCK"),
    ("PC11", "GPIO",        None,    "SPI3_MISO"),
    ("PC12", "GPIO",        None,    "SPI3_MOSI"),
    ("PC13", "GPIO",        None,    "M0_nCS"),
    ("PC14", "GPIO",        None,    "M1_nCS"),
    ("PA6",  "ADC12_IN6",   None,    "VBUS_S"),
    ("PC4",  "GPIO",        None,    "GPIO_5"),
    ("PB2",  "GPIO",        None,    "GPIO_6"),
    ("PA2",  "USART2_TX",   Some(7), "GPIO_3"),
    ("PA3",  "USART2_RX",   Some(7), "GPIO_4"),
];

/// github.com/vedderb/bldc: `hwconf/trampa/vesc6/hw_60_core.h` (commit 10531f2), the branches of MK3 to MK6, and the pins that
/// `hw_60_core.c` (commit 6106081) gives to TIM1.
#[rustfmt::skip]
const VESC: Map = &[
    ("PA8",  "TIM1_CH1",    Some(1), "phase 1, high side"),
    ("PB13", "TIM1_CH1N",   Some(1), "phase 1, low side"),
    ("PA9",  "TIM1_CH2",    Some(1), "phase 2, high side"),
    ("PB14", "TIM1_CH2N",   Some(1), "phase 2, low side"),
    ("PC6",  "TIM3_CH1",    Some(2), "HW_HALL_ENC_PIN1"),
    ("PC7",  "TIM3_CH2",    Some(2), "HW_HALL_ENC_PIN2"),
    ("PC8",  "GPIO",        None,    "HW_HALL_ENC_PIN3"),
    ("PC0",  "ADC123_IN10", None,    "ADC_IND_CURR1"),
    ("PA10", "GPIO",        None,    "phase 3, high side"),
    ("PB15", "GPIO",        None,    "phase 3, low side"),
    ("PB5",  "GPIO",        None,    "ENABLE_GATE"),
    ("PB7",  "GPIO",        None,    "IS_DRV_FAULT"),
    ("PC10", "GPIO",        None,    "DRV8301_SCK"),
    ("PB3",  "GPIO",        None,    "DRV8301_MISO"),
    ("PB4",  "GPIO",        None,    "DRV8301_MOSI"),
    ("PC9",  "GPIO",        None,    "DRV8301_CS"),
    ("PC5",  "GPIO",        None,    "HW_SHUTDOWN_PIN"),
    ("PD2",  "GPIO",        None,    "CURRENT_FILTER"),
    ("PA4",  "GPIO",        None,    "SENSOR_VOLTAGE_PIN"),
    ("PC3",  "ADC123_IN13", None,    "ADC_IND_VIN_SENS"),
    ("PB6",  "GPIO",        None,    "HW_ICU_PIN"),
    ("PB0",  "GPIO",        None,    "LED_GREEN"),
    ("PB10", "USART3_TX",   Some(7), "HW_UART_TX"),
    ("PB11", "USART3_RX",   Some(7), "HW_UART_RX"),
];

/// What the debug probe and the crystal need is no matter of the maker.
const OF_THE_CHIP: [&str; 4] = ["PA13", "PA14", "PH0", "PH1"];

/// CAN1 and USB (DS8626, table 9): left for later.
const FREE: [&str; 4] = ["PB8", "PB9", "PA11", "PA12"];

/// A row of a table in the code, in words.
struct Row {
    pin: String,
    signal: &'static str,
    function: Option<u8>,
    analogue: bool,
    output: bool,
}

macro_rules! rows {
    ($board:ident) => {
        $board::chosen::LINES
            .iter()
            .map(|line| Row {
                pin: format!("P{:?}{}", line.pin.0, line.pin.1),
                signal: line.signal,
                function: match line.mode {
                    $board::pins::Mode::Alternate(function) => Some(function),
                    _ => None,
                },
                analogue: line.mode == $board::pins::Mode::Analog,
                output: line.mode == $board::pins::Mode::Output,
            })
            .collect::<Vec<Row>>()
    };
}

fn boards() -> [(&'static str, &'static str, Map, Vec<Row>); 2] {
    [("ODrive v3", "odrive-v3", ODRIVE, rows!(odrive)), ("VESC 6", "vesc-6", VESC, rows!(vesc))]
}

#[test]
fn pins_of_boards_are_the_maker_s() {
    for (name, _, map, rows) in boards() {
        let coded: BTreeMap<_, _> = rows
            .iter()
            .filter(|row| !OF_THE_CHIP.contains(&row.pin.as_str()))
            .map(|row| (row.pin.as_str(), (row.signal, row.function)))
            .collect();
        let published: BTreeMap<_, _> =
            map.iter().map(|(pin, signal, function, _)| (*pin, (*signal, *function))).collect();
        assert_eq!(coded, published, "{name}");
        assert_eq!(rows.len(), coded.len() + OF_THE_CHIP.len(), "{name}: a pin serves two purposes");
        assert_eq!(map.len(), published.len(), "{name}: the map names a pin twice");
    }
}

#[test]
fn functions_of_boards_are_the_data_sheet_s() {
    for (name, _, _, rows) in boards() {
        for row in &rows {
            let pin = row.pin.as_str();
            match row.function {
                Some(function) => assert!(TABLE_9.contains(&(pin, function, row.signal)), "{name}: {pin}"),
                None => assert_eq!(row.analogue, ANALOGUE.contains(&(pin, row.signal)), "{name}: {pin}"),
            }
            // TTa pins stand no 5 V; none is a digital input.
            assert!(row.output || !["PA4", "PA5"].contains(&pin), "{name}");
            assert!(!FREE.contains(&pin), "{name}: {pin} is left for CAN or USB");
        }
    }
}

/// Lines that must be low or high from the beginning are outputs: enable, legs that nobody uses, select lines.
#[test]
fn enable_lines_select_lines_and_unused_legs_are_driven() {
    for (name, _, map, rows) in boards() {
        let driven =
            ["EN_GATE", "ENABLE_GATE", "M0_nCS", "M1_nCS", "DRV8301_CS", "M0_AH", "M0_AL", "M1_AH", "M1_AL"];
        let driven = [&driven[..], &["AUX_L", "AUX_H", "phase 3, high side", "phase 3, low side"]].concat();
        let mut seen = 0;
        for (pin, ..) in map.iter().filter(|row| driven.contains(&row.3)) {
            let row = rows.iter().find(|row| row.pin == *pin).expect("in the table");
            assert!(row.output, "{name}: {pin}");
            seen += 1;
        }
        assert!(seen >= 4, "{name}: {seen}");
    }
}

/// The shunts are 500 µΩ on both; gains and dividers as published.
#[test]
fn a_count_is_worth_what_the_maker_s_circuit_makes_of_it() {
    let volt = 3.3 / 4096.0;
    let odrive = [&odrive::chosen::ODRIVE_V3, &odrive::chosen::ODRIVE_V3_24V, &odrive::chosen::MKS_ODRIVE];
    for (board, ratio) in odrive.into_iter().zip([19.0, 11.0, 19.0]) {
        let supply = odrive::board::SCALE.supply_volt_per_lsb(board.supply.divider);
        assert!((f64::from(supply) - volt * ratio).abs() < 1e-6, "{}", board.name);
        let ampere = odrive::board::SCALE.ampere_per_lsb(board.stage.volt_per_ampere);
        assert!((f64::from(ampere) - volt / (80.0 * 500e-6)).abs() < 1e-6);
        // Within ±1.35 V of the amplifier, whatever its offset: 25.7 A.
        assert_eq!(board.reach().current, 1275);
    }
    let board = &vesc::chosen::VESC_6;
    let supply = vesc::board::SCALE.supply_volt_per_lsb(board.supply.divider);
    assert!((f64::from(supply) - volt * 41.2 / 2.2).abs() < 1e-6);
    let ampere = vesc::board::SCALE.ampere_per_lsb(board.stage.volt_per_ampere);
    assert!((f64::from(ampere) - volt / (20.0 * 0.5e-3)).abs() < 1e-6);
    assert_eq!(vesc::timing::dead_time(360), Some(61));
    // TIM_1_8_DEADTIME_CLOCKS.
    assert_eq!(odrive::timing::dead_time(119), Some(20));
}

/// The host knows boards by the table, the image by its resistors.
#[test]
fn the_table_of_boards_has_the_scales_of_the_images() {
    let scales = [
        (&boards::STM32F405, own::chosen::OWN.scales()),
        (&boards::ODRIVE_V3, odrive::chosen::ODRIVE_V3.scales()),
        (&boards::ODRIVE_V3_24V, odrive::chosen::ODRIVE_V3_24V.scales()),
        (&boards::MKS_ODRIVE, odrive::chosen::MKS_ODRIVE.scales()),
        (&boards::VESC_6, vesc::chosen::VESC_6.scales()),
    ];
    assert_eq!(scales.len(), boards::real().count());
    for (row, image) in scales {
        let table = row.scales.unwrap();
        for (table, image) in [(table.supply_v, image.supply), (table.current_a, image.current)] {
            assert!((table / image.get().unwrap() - 1.0).abs() < 1e-5, "{}: {table} {image:?}", row.name);
        }
    }
}

/// Rows of the pin table on the board's page: `| PA8 | TIM1_CH1 (AF1) | … |`.
#[test]
fn pages_of_boards_show_exactly_their_tables() {
    for (name, page, _, rows) in boards() {
        let path = format!("{}/../docs/boards/{page}.md", env!("CARGO_MANIFEST_DIR"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{path}: {error}"));
        let documented: Vec<(String, String)> = text
            .lines()
            .filter_map(|row| {
                let mut cells = row.trim().strip_prefix("| P")?.split('|').map(str::trim);
                let (pin, signal) = (cells.next()?, cells.next()?);
                pin[1..].parse::<u8>().ok()?;
                Some((format!("P{pin}"), signal.to_string()))
            })
            .collect();
        let coded: Vec<(String, String)> = rows
            .iter()
            .map(|row| {
                let function = row.function.map(|function| format!(" (AF{function})")).unwrap_or_default();
                (row.pin.clone(), format!("{}{function}", row.signal))
            })
            .collect();
        assert_eq!(documented, coded, "{name}");
    }
}
