//! The dry run of flashing: the board's image passes, and each kind of damage is refused by its name.

use boards::DEFAULT;
use flash_dry_run::{DryRun, check, check_bytes};
use object::read::elf::ElfFile32;
use object::{Object, ObjectSection, ObjectSymbol};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// The board's image, as `cargo xtask images` builds it.
fn image() -> &'static [u8] {
    static IMAGE: OnceLock<Vec<u8>> = OnceLock::new();
    IMAGE.get_or_init(|| {
        let built = root().join("target/images/stm32f405.elf");
        let status = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()))
            .args(["xtask", "images"])
            .current_dir(root())
            .status()
            .expect("cargo starts");
        assert!(status.success(), "the images do not build");
        std::fs::read(&built).expect("xtask has put the image there")
    })
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

fn refusal(bytes: &[u8]) -> String {
    format!("{:#}", check_bytes(bytes, DEFAULT.chip).expect_err("must be refused"))
}

/// The image with every occurrence of `from` replaced by `to`, of equal length.
fn replaced(from: &[u8], to: &[u8]) -> Vec<u8> {
    assert_eq!(from.len(), to.len());
    let mut bytes = image().to_vec();
    let mut found = 0;
    for at in 0..=bytes.len() - from.len() {
        if &bytes[at..at + from.len()] == from {
            bytes[at..at + from.len()].copy_from_slice(to);
            found += 1;
        }
    }
    assert!(found > 0, "nothing to damage");
    bytes
}

/// Offset of the n-th program header with content; 32-bit ELF: e_phoff at 28, 32 bytes each, p_type 0, p_paddr 12, p_filesz 16.
fn program_header(bytes: &[u8], number: usize) -> usize {
    let word = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let count = usize::from(u16::from_le_bytes(bytes[44..46].try_into().unwrap()));
    (0..count)
        .map(|n| word(28) + 32 * n)
        .filter(|at| word(*at) == 1 && word(at + 16) > 0)
        .nth(number)
        .expect("so many segments")
}

fn with_word(at: usize, value: u32) -> Vec<u8> {
    let mut bytes = image().to_vec();
    bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
    bytes
}

/// Where a section's content lies in the file.
fn file_offset(section: &str) -> usize {
    let elf = ElfFile32::<object::Endianness>::parse(image()).unwrap();
    elf.section_by_name(section).unwrap().file_range().unwrap().0 as usize
}

fn found() -> DryRun {
    check_bytes(image(), DEFAULT.chip).expect("the board's image fits the chip")
}

#[test]
fn the_image_of_every_board_fits_its_chip() {
    image();
    for board in boards::real() {
        let built = root().join(format!("target/images/{}.elf", board.name));
        let found = check(&built, board.chip).unwrap_or_else(|error| panic!("{}: {error:#}", board.name));
        assert_eq!(found.vectors.0, 0x2002_0000, "{}", board.name);
    }
}

#[test]
fn the_boards_image_fits_the_chip() {
    let found = found();
    assert_eq!(found.flash, 1024 * 1024);
    assert!((20_000..256 * 1024).contains(&found.programmed()), "{}", found.programmed());
    assert_eq!(found.segments[0].address, 0x0800_0000);
    assert_eq!(found.vectors.0, 0x2002_0000, "the stack starts at the end of RAM");
    assert_eq!(found.vectors.1 % 2, 1);
    assert!(
        found.messages >= 5,
        "start, panic, hard fault, unexpected interrupt, sensor: {}",
        found.messages
    );
    assert!(found.static_ram < 64 * 1024, "{}", found.static_ram);
}

/// The same figures by another way: the sum of what the linker reports.
#[test]
fn programmed_bytes_and_static_ram_are_those_of_the_sections() {
    let elf = ElfFile32::<object::Endianness>::parse(image()).unwrap();
    let size = |name: &str| elf.section_by_name(name).map_or(0, |section| section.size());
    let flash: u64 =
        [".vector_table", ".text", ".rodata", ".data", ".gnu.sgstubs"].into_iter().map(size).sum();
    let ram: u64 = [".data", ".bss", ".uninit"].into_iter().map(size).sum();
    let found = found();
    assert!(found.programmed().abs_diff(flash) <= 32, "{} {flash}", found.programmed());
    assert_eq!(found.static_ram, ram);
    let rtt = elf.symbols().find(|symbol| symbol.name() == Ok("_SEGGER_RTT")).unwrap();
    assert_eq!(found.rtt, (rtt.address(), rtt.size()));
}

#[test]
fn a_segment_beyond_the_flash_is_refused() {
    let at = program_header(image(), 1) + 12;
    let message = refusal(&with_word(at, 0x0810_0000));
    assert!(
        message.contains("outside the flash of STM32F405RGTx") && message.contains("memory.x"),
        "{message}"
    );
}

#[test]
fn a_segment_that_would_overwrite_the_parameters_is_refused() {
    let at = program_header(image(), 1) + 12;
    let message = refusal(&with_word(at, 0x080C_0000));
    assert!(message.contains("stored parameters"), "{message}");
}

#[test]
fn a_segment_in_ram_is_refused() {
    let at = program_header(image(), 1) + 12;
    let message = refusal(&with_word(at, 0x2000_1000));
    assert!(message.contains("outside the flash"), "{message}");
}

#[test]
fn segments_that_overlap_are_refused_by_the_flash_loader() {
    let at = program_header(image(), 1) + 12;
    let message = refusal(&with_word(at, 0x0800_0004));
    assert!(message.contains("the flash loader refuses"), "{message}");
}

#[test]
fn a_missing_vector_table_is_refused() {
    let message = refusal(&replaced(b"\0.vector_table\0", b"\0.vectox_table\0"));
    assert!(message.contains("no vector table"), "{message}");
}

#[test]
fn a_stack_outside_the_chips_ram_is_refused() {
    // 192 KiB: what QEMU's model has in one piece, and the chip has not.
    let message = refusal(&with_word(file_offset(".vector_table"), 0x2003_0000));
    assert!(message.contains("stack pointer 0x20030000"), "{message}");
}

#[test]
fn a_reset_vector_outside_the_code_is_refused() {
    let at = file_offset(".vector_table") + 4;
    assert!(refusal(&with_word(at, 0x0800_0000)).contains("reset vector"));
    assert!(refusal(&with_word(at, 0x2000_0001)).contains("reset vector"));
}

#[test]
fn a_silent_image_is_refused() {
    assert!(refusal(&replaced(b"\0_SEGGER_RTT\0", b"\0_SEGGER_RTX\0")).contains("no RTT block"));
    assert!(refusal(&replaced(b"\0.defmt\0", b"\0.defmx\0")).contains("no defmt table"));
    assert!(refusal(&replaced(b"_defmt_version_", b"_defmt_versiox_")).contains("no version"));
}

#[test]
fn what_is_not_an_image_is_refused_with_the_command_that_builds_one() {
    assert!(refusal(b"not an image").contains("cargo xtask images"));
    assert!(refusal(&image()[..200]).contains("0x") || refusal(&image()[..200]).contains("image"));
    let missing = check(Path::new("no/such.elf"), DEFAULT.chip).expect_err("there is none");
    assert!(format!("{missing:#}").starts_with("no/such.elf cannot be read"));
}

#[test]
fn the_program_prints_the_table_and_ends_with_status_2_on_damage() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("image.elf");
    std::fs::write(&path, image()).unwrap();
    let program = || Command::new(env!("CARGO_BIN_EXE_flash-dry-run"));
    let good = program().arg(&path).output().unwrap();
    let text = String::from_utf8(good.stdout).unwrap();
    assert!(good.status.success(), "{text}");
    for line in ["flash ", "vector table  0x08000000", "RTT block", "defmt table", "RAM "] {
        assert!(text.contains(line), "{line} is missing in\n{text}");
    }
    assert!(text.contains(&format!("fits {}", DEFAULT.chip.probe)));
    std::fs::write(&path, "rubbish").unwrap();
    let bad = program().arg(&path).output().unwrap();
    assert_eq!(bad.status.code(), Some(2));
    let error = String::from_utf8(bad.stderr).unwrap();
    assert!(error.starts_with("error: ") && error.lines().count() == 1, "{error}");
    assert_eq!(program().output().unwrap().status.code(), Some(2), "no argument");
    let unknown = program().arg(&path).arg("no-board").output().unwrap();
    assert_eq!(unknown.status.code(), Some(2));
    assert!(String::from_utf8(unknown.stderr).unwrap().contains("docs/boards"));
}
