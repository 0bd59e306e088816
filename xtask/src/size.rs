//! What the two images occupy.

use crate::figures::{self, Figures};
use crate::image;
use anyhow::{Context, Result};
use object::{Object, ObjectSection, SectionFlags, SectionKind, elf::SHF_ALLOC};
use std::path::Path;

/// Start of RAM on the chip; flash lies below.
const RAM: u64 = 0x2000_0000;

/// Bytes of one image.
struct Size {
    /// Code, constants and the initial values of variables.
    flash: u64,
    /// Initialised variables.
    data: u64,
    /// Zeroed and uninitialised variables. The stack takes what is left.
    zeroed: u64,
}

/// Builds both images, prints a table for docs/cost.md and checks or enters its figures.
pub fn print(accept: bool) -> Result<()> {
    let mut figures = Figures::new();
    println!("| image | flash, bytes | RAM, bytes | of which initialised |");
    println!("|---|---|---|---|");
    for board in ["stm32f405", "qemu"] {
        let size = measure(&image::build(board)?)?;
        println!(
            "| {board} | {} | {} | {} |",
            size.flash,
            size.data + size.zeroed,
            size.data
        );
        figures.insert(format!("{board} flash"), size.flash);
        figures.insert(format!("{board} ram"), size.data + size.zeroed);
    }
    figures::settle("size", &figures, accept)
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
