//! What the images occupy, and how deep the board's stack can get.

use crate::figures::{self, Figures};
use crate::image;
use crate::process::text;
use crate::programs::Program;
use anyhow::{Context, Result, bail};
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf::SHF_ALLOC};
use std::path::Path;

/// Start of RAM on the chip; flash lies below.
const RAM: u64 = 0x2000_0000;

/// Initialisation; then what can interrupt one another, lowest priority first: idle, link, control.
const LEVELS: [&str; 4] = ["main", "firmware::app::idle", "USART2", "ADC"];

/// Bytes of one image.
struct Size {
    /// Code, constants and the initial values of variables.
    flash: u64,
    /// Initialised variables.
    data: u64,
    /// Zeroed and uninitialised variables. The stack takes what is left.
    zeroed: u64,
}

/// Builds both images, prints a table for docs/results/cost.md and checks or enters its figures.
pub fn print(accept: bool) -> Result<()> {
    let mut figures = Figures::new();
    println!("| image | flash, bytes | RAM, bytes | of which initialised | stack at most, bytes |");
    println!("|---|---|---|---|---|");
    for board in ["stm32f405", image::FOUR_AXES, "qemu"] {
        let image = image::build(board)?;
        let size = measure(&image)?;
        // In QEMU calls of its own carry the exchange with the host: its depth says nothing about the board.
        let stack = (board != "qemu").then(|| stack(&image)).transpose()?;
        println!(
            "| {board} | {} | {} | {} | {} |",
            size.flash,
            size.data + size.zeroed,
            size.data,
            stack.map_or("–".into(), |bytes| bytes.to_string())
        );
        figures.insert(format!("{board} flash"), size.flash);
        figures.insert(format!("{board} ram"), size.data + size.zeroed);
        if let Some(bytes) = stack {
            figures.insert(format!("{board} stack"), bytes);
        }
    }
    figures::settle("size", &figures, accept)
}

/// The deepest calls of the initialisation, or of idle and, on top of them, of link and control with the frames of their
/// interrupts: an upper bound from the calls in the image.
fn stack(image: &Path) -> Result<u64> {
    let mut command = Program::StackDepth.run();
    let output = command.arg(image).args(LEVELS).output()?;
    if !output.status.success() {
        bail!(
            "`{}` failed: {}",
            text(&command),
            String::from_utf8_lossy(&output.stderr)
        );
    }
    let output = String::from_utf8(output.stdout).context("the depths are not text")?;
    let most = output.lines().find_map(|line| line.strip_prefix("most | "));
    most.and_then(|bytes| bytes.trim().parse().ok())
        .context("the depths lack their sum")
}

fn measure(image: &Path) -> Result<Size> {
    let bytes = std::fs::read(image).with_context(|| format!("cannot read {}", image.display()))?;
    let file = object::File::parse(&*bytes).with_context(|| format!("{} is not an ELF", image.display()))?;
    let mut size = Size {
        flash: 0,
        data: 0,
        zeroed: 0,
    };
    for section in file.sections().filter(occupies_memory) {
        let (in_ram, filled) = (
            section.address() >= RAM,
            section.kind() != SectionKind::UninitializedData,
        );
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
