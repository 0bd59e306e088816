//! The table of boards beside the files that repeat what stands in it, and the image's modules, which know no chip.

use boards::{BOARDS, QEMU, chosen};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use truing::device::motor::qemu::MACHINE;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|error| panic!("{path}: {error}"))
}

#[test]
fn the_workbench_starts_the_machine_of_the_table() {
    assert_eq!(QEMU.machine, Some(MACHINE));
}

#[test]
fn cargo_knows_the_features_of_every_board() {
    let manifest: toml::Table = read("src/image/Cargo.toml").parse().unwrap();
    let features = manifest["features"].as_table().unwrap();
    for board in BOARDS {
        for feature in board.feature.into_iter().chain(board.most_axes) {
            assert!(features.contains_key(feature), "{}: {feature}", board.name);
        }
    }
}

#[test]
fn one_feature_chooses_one_board() {
    assert_eq!(chosen(|_| false), Ok(boards::DEFAULT));
    for board in BOARDS.into_iter().filter(|board| board.feature.is_some()) {
        assert_eq!(chosen(|feature| board.feature == Some(feature)), Ok(board));
    }
    let features: BTreeSet<_> = BOARDS.iter().map(|board| board.feature).collect();
    assert_eq!(features.len(), BOARDS.len(), "two boards share a feature");
}

#[test]
fn boards_have_a_page_that_begins_with_what_is_not_verified() {
    for board in boards::real() {
        let page = read(board.page);
        let first = page.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap();
        assert!(first.starts_with("**Not verified on hardware.**"), "{}: {first}", board.page);
        assert!(
            page.contains(&format!("--board {}", board.name)) || board == boards::DEFAULT,
            "{}",
            board.page
        );
        let list = read("docs/boards/README.md");
        assert!(list.contains(&format!("`{}`", board.name)), "{}", board.name);
    }
}

/// `cargo fw` and `cargo flash` cannot read the table.
#[test]
fn the_aliases_of_cargo_build_and_flash_the_default_board() {
    let configuration: toml::Table = read(".cargo/config.toml").parse().unwrap();
    let chip = boards::DEFAULT.chip;
    for alias in ["fw", "flash"] {
        let command = configuration["alias"][alias].as_str().unwrap();
        assert!(command.contains(&format!("--target {} ", chip.target)), "{alias}");
    }
    let runner = configuration["target"][chip.target]["runner"].as_str();
    assert_eq!(runner.unwrap(), format!("probe-rs run --chip {}", chip.probe));
}

/// Length of a region of `memory.x` in bytes, with its origin.
fn region(memory: &str, name: &str) -> (u64, u64) {
    let line = memory.lines().find(|line| line.trim_start().starts_with(name)).unwrap();
    let value = |key: &str| {
        let text = line.split(key).nth(1).unwrap().trim_start_matches([' ', '=']);
        text.split([',', ' ']).next().unwrap().to_owned()
    };
    let origin = u64::from_str_radix(value("ORIGIN").trim_start_matches("0x"), 16).unwrap();
    let length: u64 = value("LENGTH").trim_end_matches('K').parse().unwrap();
    (origin, 1024 * length)
}

#[test]
fn the_linker_has_the_memory_of_the_table() {
    for board in BOARDS {
        let chip = board.chip;
        let memory = read(&format!("{}/memory.x", chip.memory));
        for (name, range) in [("FLASH", &chip.program), ("RAM", &chip.ram)] {
            assert_eq!(region(&memory, name), (range.start, range.end - range.start), "{name}");
        }
    }
}

/// Words that only an entry file or a folder of a board may hold.
const CHIP_WORDS: [&str; 9] = ["stm32", "rp2040", "nrf5", "esp32", "TIM1", "USART", "ADC", "IWDG", "_hal::"];

#[test]
fn the_modules_of_the_image_know_no_chip() {
    let entries: BTreeSet<_> = BOARDS.iter().map(|board| format!("{}.rs", board.chip.name)).collect();
    let mut seen = 0;
    for entry in std::fs::read_dir(root().join("src/image")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if !name.ends_with(".rs") || entries.contains(&name) || name == "boards.rs" || name == "mod.rs" {
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap();
        for word in CHIP_WORDS {
            assert!(!text.contains(word), "{name} names {word}");
        }
        seen += 1;
    }
    assert!(seen >= 6, "{seen} modules");
}
