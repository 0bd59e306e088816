//! What the images occupy, and how deep the board's stack can get.

use crate::figures::{self, Figures};
use crate::image::{Boards, Image};
use crate::process::{root, text};
use crate::programs::Program;
use anyhow::{Context, Result, bail};
use boards::Chip;
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf::SHF_ALLOC};
use std::path::Path;

/// The function of an image that initialises it.
const INITIALISATION: &str = "main";

/// Flash that no image may exceed, bytes: 128 KiB, an eighth of what the STM32F405 has.
const MOST_FLASH: u64 = 131_072;

/// Bytes of one image.
struct Size {
    /// Code, constants and the initial values of variables.
    flash: u64,
    /// Initialised variables.
    data: u64,
    /// Zeroed and uninitialised variables. The stack takes what is left.
    zeroed: u64,
}

/// Builds the images, prints a table and checks or enters its figures.
pub fn print(boards: Boards, accept: bool) -> Result<()> {
    let mut figures = Figures::new();
    let mut too_large = Vec::new();
    println!("| image | flash, bytes | RAM, bytes | of which initialised | stack at most, bytes |");
    println!("|---|---|---|---|---|");
    for image in boards.watched() {
        let (name, board, file) = (image.name(), image.board, image.build()?);
        let size = measure(&file, board.chip)?;
        // In QEMU calls of its own carry the exchange with the host: its depth says nothing about the board.
        let stack = board.machine.is_none().then(|| stack(&file, board.chip)).transpose()?;
        println!(
            "| {name} | {} | {} | {} | {} |",
            size.flash,
            size.data + size.zeroed,
            size.data,
            stack.map_or("–".into(), |bytes| bytes.to_string())
        );
        if size.flash > MOST_FLASH {
            too_large.push(format!("{name} by {} bytes", size.flash - MOST_FLASH));
        }
        figures.insert(format!("{name} flash"), size.flash);
        figures.insert(format!("{name} ram"), size.data + size.zeroed);
        if let Some(bytes) = stack {
            figures.insert(format!("{name} stack"), bytes);
        }
    }
    if !too_large.is_empty() {
        bail!(
            "larger than {MOST_FLASH} bytes of flash, which `--accept` does not raise: {}",
            too_large.join(", ")
        );
    }
    figures::settle("size", &figures, accept)
}

/// Builds the image of each board and prints where it lies, from the root of the workspace, and what it occupies.
pub fn images(boards: Boards) -> Result<()> {
    println!("| board | image | flash, bytes | RAM, bytes |");
    println!("|---|---|---|---|");
    for image in boards.list().map(Image::of) {
        let file = image.build()?;
        let size = measure(&file, image.board.chip)?;
        let path = file.strip_prefix(root()).unwrap_or(&file);
        let ram = size.data + size.zeroed;
        println!("| {} | {} | {} | {ram} |", image.board.name, path.display(), size.flash);
    }
    Ok(())
}

/// The deepest calls of the initialisation, or of idle and, on top of them, of link and control with the frames of their
/// interrupts: an upper bound from the calls in the image.
fn stack(image: &Path, chip: &Chip) -> Result<u64> {
    let mut command = Program::StackDepth.run();
    // Lowest priority first: the order in which they can interrupt one another.
    let levels = [chip.tasks.idle, chip.tasks.link, chip.tasks.control];
    let output = command.arg(image).arg(INITIALISATION).args(levels).output()?;
    if !output.status.success() {
        bail!("`{}` failed: {}", text(&command), String::from_utf8_lossy(&output.stderr));
    }
    let output = String::from_utf8(output.stdout).context("the depths are not text")?;
    let most = output.lines().find_map(|line| line.strip_prefix("most | "));
    most.and_then(|bytes| bytes.trim().parse().ok()).context("the depths lack their sum")
}

fn measure(image: &Path, chip: &Chip) -> Result<Size> {
    let bytes = std::fs::read(image).with_context(|| format!("cannot read {}", image.display()))?;
    let file = object::File::parse(&*bytes).with_context(|| format!("{} is not an ELF", image.display()))?;
    let mut size = Size { flash: 0, data: 0, zeroed: 0 };
    for section in file.sections().filter(occupies_memory) {
        let (in_ram, filled) =
            (section.address() >= chip.ram.start, section.kind() != SectionKind::UninitializedData);
        match (in_ram, filled) {
            (false, _) => size.flash += section.size(),
            (true, true) => {
                size.data += section.size();
                size.flash += section.size();
            }
            (true, false) => size.zeroed += section.size(),
        }
    }
    Ok(size)
}

/// Debug information and the table of log messages stay on the host.
fn occupies_memory<'a>(section: &impl ObjectSection<'a>) -> bool {
    matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags.contains(SHF_ALLOC))
}
