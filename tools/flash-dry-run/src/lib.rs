//! Would this image run on the chip? Everything that flashing it would do, without a probe: its segments are added to
//! probe-rs' own flash loader with the chip's memory map, which refuses what has no place, and the things that a running
//! image needs are looked up: vector table, log channel, message table, room for the stack.

use anyhow::{Context, Result, bail, ensure};
use boards::Chip;
use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Object, ObjectSection, ObjectSymbol, elf};
use probe_rs::config::{MemoryRegion, Registry};
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// The control block of SEGGER's RTT: 24 bytes of identification and counts, and a channel.
const RTT_SYMBOL: &str = "_SEGGER_RTT";
const RTT_HEADER: u64 = 24;

/// A loadable piece of the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Segment {
    /// Where it goes.
    pub address: u64,
    /// How many bytes.
    pub length: u64,
}

/// What the dry run found.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct DryRun {
    /// Pieces that would be programmed.
    pub segments: Vec<Segment>,
    /// Size of the chip's flash, bytes.
    pub flash: u64,
    /// Size of its main memory, bytes.
    pub ram: u64,
    /// Where the vector table lies.
    pub vector_table: u64,
    /// First stack pointer and reset vector.
    pub vectors: (u32, u32),
    /// Address and size of the RTT control block.
    pub rtt: (u64, u64),
    /// Log messages in the table that the host decodes with.
    pub messages: usize,
    /// Static data in RAM, bytes.
    pub static_ram: u64,
}

impl DryRun {
    /// Bytes that would be programmed.
    pub fn programmed(&self) -> u64 {
        self.segments.iter().map(|segment| segment.length).sum()
    }
}

/// Checks the image at `path` for this chip.
///
/// # Errors
/// One sentence that names what is missing or does not fit, and the remedy.
pub fn check(path: &Path, chip: &Chip) -> Result<DryRun> {
    let bytes = std::fs::read(path)
        .with_context(|| format!("{} cannot be read: build it with `cargo xtask images`", path.display()))?;
    check_bytes(&bytes, chip).with_context(|| path.display().to_string())
}

/// Checks an image that is in memory.
///
/// # Errors
/// As [`check`].
pub fn check_bytes(bytes: &[u8], chip: &Chip) -> Result<DryRun> {
    let image = ElfFile32::<object::Endianness>::parse(bytes)
        .context("not an ELF image of a 32-bit machine: build it with `cargo xtask images`")?;
    let (segments, flash) = load(&image, chip)?;
    Ok(DryRun {
        segments,
        flash,
        ram: chip.ram.end - chip.ram.start,
        vector_table: chip.program.start,
        vectors: vectors(&image, chip)?,
        rtt: rtt(&image, chip)?,
        messages: messages(&image)?,
        static_ram: static_ram(&image, chip)?,
    })
}

type Image<'a> = ElfFile32<'a, object::Endianness>;

/// Gives every segment with content to probe-rs' loader, by its *physical* address: that is where initial values of
/// variables lie in flash.
fn load(image: &Image, chip: &Chip) -> Result<(Vec<Segment>, u64)> {
    let target = Registry::from_builtin_families()
        .get_target_by_name(chip.probe)
        .with_context(|| format!("probe-rs does not know {}", chip.probe))?;
    let mut loader = target.flash_loader();
    let endian = image.endian();
    let mut segments = Vec::new();
    for header in image.elf_program_headers() {
        let data = header.data(endian, image.data()).unwrap_or_default();
        if header.p_type(endian) != elf::PT_LOAD || data.is_empty() {
            continue;
        }
        let address = u64::from(header.p_paddr(endian));
        let range = address..address + data.len() as u64;
        ensure!(
            in_flash(&target.memory_map, &range),
            "{} bytes at {address:#010x} lie outside the flash of {}: check memory.x and the linker's arguments",
            data.len(),
            chip.probe
        );
        loader.add_data(address, data).with_context(|| {
            format!("the flash loader refuses {} bytes at {address:#010x}: check memory.x", data.len())
        })?;
        segments.push(Segment { address, length: data.len() as u64 });
    }
    ensure!(
        !segments.is_empty(),
        "the image has nothing to program: the linker script was not used (build.rs)"
    );
    free_of_parameters(&segments, chip)?;
    Ok((segments, flash_size(&target.memory_map, chip)))
}

fn flash_of(map: &[MemoryRegion]) -> impl Iterator<Item = &Range<u64>> {
    map.iter().filter_map(|region| match region {
        MemoryRegion::Nvm(flash) if !flash.is_alias => Some(&flash.range),
        _ => None,
    })
}

/// The loader would take data for RAM as well; a flashed image has none.
fn in_flash(map: &[MemoryRegion], range: &Range<u64>) -> bool {
    flash_of(map).any(|flash| flash.start <= range.start && range.end <= flash.end)
}

fn flash_size(map: &[MemoryRegion], chip: &Chip) -> u64 {
    flash_of(map).filter(|flash| flash.start == chip.program.start).map(|flash| flash.end - flash.start).sum()
}

fn free_of_parameters(segments: &[Segment], chip: &Chip) -> Result<()> {
    let last = segments.iter().map(|segment| segment.address + segment.length).max().unwrap_or(0);
    ensure!(
        last <= chip.program.end,
        "the image ends at {last:#010x}, inside the sectors of the stored parameters from {:#010x} on: it is too large, or memory.x is wrong",
        chip.program.end
    );
    Ok(())
}

/// The first two words: stack pointer inside RAM, reset vector an odd (Thumb) address inside the image.
fn vectors(image: &Image, chip: &Chip) -> Result<(u32, u32)> {
    let table = image
        .section_by_name(".vector_table")
        .context("the image has no vector table: a RUSTFLAGS variable or a missing build.rs has dropped the linker script")?;
    ensure!(
        table.address() == chip.program.start,
        "the vector table lies at {:#010x} instead of {:#010x}: check FLASH in memory.x",
        table.address(),
        chip.program.start
    );
    let data = table.data().context("the vector table is unreadable")?;
    ensure!(data.len() >= 8, "the vector table has {} bytes: the image is damaged", data.len());
    let word = |at: usize| u32::from_le_bytes([data[at], data[at + 1], data[at + 2], data[at + 3]]);
    let (stack, reset) = (word(0), word(4));
    ensure!(
        chip.ram.start < u64::from(stack) && u64::from(stack) <= chip.ram.end && stack.is_multiple_of(8),
        "the first stack pointer {stack:#010x} is not in the {} KiB of RAM: check RAM in memory.x",
        kibibytes(&chip.ram)
    );
    let code = u64::from(reset & !1);
    let text = image.section_by_name(".text").context("the image has no code")?;
    ensure!(
        reset % 2 == 1 && (text.address()..text.address() + text.size()).contains(&code),
        "the reset vector {reset:#010x} does not point to the image's code: the image is damaged"
    );
    Ok((stack, reset))
}

fn rtt(image: &Image, chip: &Chip) -> Result<(u64, u64)> {
    let block = image.symbols().find(|symbol| symbol.name() == Ok(RTT_SYMBOL)).with_context(|| {
        format!("no RTT block ({RTT_SYMBOL}): the log would be silent; the board links defmt-rtt")
    })?;
    let (address, size) = (block.address(), block.size());
    ensure!(
        size >= RTT_HEADER && chip.ram.contains(&address) && address + size <= chip.ram.end,
        "the RTT block of {size} bytes at {address:#010x} is not in RAM: a probe would not find it"
    );
    Ok((address, size))
}

/// Messages are symbols of a section that is never loaded; the version symbol tells how to read them.
fn messages(image: &Image) -> Result<usize> {
    let table = image
        .section_by_name(".defmt")
        .context("no defmt table: the linker script defmt.x was not used (build.rs)")?;
    let inside = image
        .symbols()
        .filter(|symbol| symbol.section_index() == Some(table.index()))
        .filter_map(|symbol| symbol.name().ok());
    let messages = inside.filter(|name| name.starts_with('{')).count();
    ensure!(messages > 0, "the defmt table is empty: set DEFMT_LOG when the image is built");
    let versioned = image
        .symbols()
        .filter_map(|symbol| symbol.name().ok())
        .any(|name| name.trim_matches('"').starts_with("_defmt_version_"));
    ensure!(versioned, "the defmt table has no version: the log could not be decoded");
    Ok(messages)
}

fn kibibytes(range: &Range<u64>) -> u64 {
    (range.end - range.start) / 1024
}

/// Everything that the image reserves in RAM before it runs. What is left is the stack's.
fn static_ram(image: &Image, chip: &Chip) -> Result<u64> {
    let mut used = 0;
    for section in image.sections() {
        let (start, size) = (section.address(), section.size());
        // Sections that are not loaded (debug data) have address 0, everything else below RAM is flash.
        if size == 0 || start < chip.ram.start {
            continue;
        }
        if start + size > chip.ram.end {
            bail!(
                "{} reaches to {:#010x}, beyond the chip's {} KiB of RAM: shrink a buffer, or correct RAM in memory.x",
                section.name().unwrap_or("a section"),
                start + size,
                kibibytes(&chip.ram)
            );
        }
        used += size;
    }
    ensure!(
        used < chip.ram.end - chip.ram.start,
        "{used} bytes of static data leave no stack in {} KiB of RAM",
        kibibytes(&chip.ram)
    );
    Ok(used)
}

impl fmt::Display for DryRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ram = self.ram;
        for segment in &self.segments {
            writeln!(f, "segment       {:#010x}  {:>7} bytes", segment.address, segment.length)?;
        }
        let programmed = self.programmed();
        writeln!(
            f,
            "flash         {programmed} of {} bytes ({:.1} %), sectors 10 and 11 free for parameters",
            self.flash,
            100.0 * programmed as f64 / self.flash as f64
        )?;
        let (stack, reset) = self.vectors;
        writeln!(
            f,
            "vector table  {:#010x}: stack from {stack:#010x} down, reset at {reset:#010x}",
            self.vector_table
        )?;
        writeln!(f, "RTT block     {:#010x}, {} bytes", self.rtt.0, self.rtt.1)?;
        writeln!(f, "defmt table   {} messages", self.messages)?;
        write!(
            f,
            "RAM           {} of {ram} bytes static ({:.1} %), {} left for the stack",
            self.static_ram,
            100.0 * self.static_ram as f64 / ram as f64,
            ram - self.static_ram
        )
    }
}
