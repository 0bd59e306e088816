//! An image without its ELF: `.bin` for `dfu-util`, `.hex` for other programmers. What has been written is read back and
//! compared with the load segments of the ELF.

use anyhow::{Context, Result, bail, ensure};
use ihex::{Reader, Record};
use object::elf;
use object::read::elf::{ElfFile32, ProgramHeader};
use std::path::{Path, PathBuf};

/// A gap between segments reads like erased flash.
const ERASED: u8 = 0xFF;
/// Gaps of linker scripts are a few bytes of alignment; a megabyte is an address that is wrong.
const LONGEST: usize = 1 << 20;
/// Bytes of a line of Intel HEX.
const LINE: usize = 16;
/// The upper half of an address is one for so many bytes.
const PAGE: usize = 1 << 16;

/// Bytes of the flash, and where they begin.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Raw {
    address: u32,
    bytes: Vec<u8>,
}

/// Writes `.bin` and `.hex` beside an ELF, and reads them back.
pub fn write(elf: &Path) -> Result<()> {
    let content = std::fs::read(elf).with_context(|| format!("cannot read {}", elf.display()))?;
    let raw = flatten(&segments(&content)?)?;
    let (bin, hex) = files(elf);
    std::fs::write(&bin, &raw.bytes).with_context(|| format!("cannot write {}", bin.display()))?;
    std::fs::write(&hex, to_hex(&raw)?).with_context(|| format!("cannot write {}", hex.display()))?;
    let read = |path: &Path| std::fs::read(path).with_context(|| format!("cannot read {}", path.display()));
    ensure!(read(&bin)? == raw.bytes, "{} is not what was written", bin.display());
    let text = String::from_utf8(read(&hex)?).with_context(|| format!("{} is no text", hex.display()))?;
    ensure!(of_hex(&text)? == raw, "{} does not hold the image", hex.display());
    Ok(())
}

/// Where they lie.
fn files(elf: &Path) -> (PathBuf, PathBuf) {
    (elf.with_extension("bin"), elf.with_extension("hex"))
}

/// Load segments with content, by the address at which they lie in flash: that of variables is the one of their initial values.
fn segments(content: &[u8]) -> Result<Vec<Raw>> {
    let file =
        ElfFile32::<object::Endianness>::parse(content).context("not an ELF image of a 32-bit machine")?;
    let endian = file.endian();
    let headers = file.elf_program_headers().iter().filter(|header| header.p_type(endian) == elf::PT_LOAD);
    let raw = headers.map(|header| Raw {
        address: header.p_paddr(endian),
        bytes: header.data(endian, file.data()).unwrap_or_default().to_vec(),
    });
    Ok(raw.filter(|raw| !raw.bytes.is_empty()).collect())
}

/// All segments in one piece.
fn flatten(segments: &[Raw]) -> Result<Raw> {
    let address = segments.iter().map(|raw| raw.address).min().context("the image has nothing to program")?;
    let mut bytes = Vec::new();
    for raw in segments {
        let from = (raw.address - address) as usize;
        let end = from + raw.bytes.len();
        ensure!(
            end <= LONGEST,
            "{} bytes at {:#010x} are no part of this image",
            raw.bytes.len(),
            raw.address
        );
        bytes.resize(bytes.len().max(end), ERASED);
        bytes[from..end].copy_from_slice(&raw.bytes);
    }
    Ok(Raw { address, bytes })
}

fn to_hex(raw: &Raw) -> Result<String> {
    let mut records = Vec::new();
    let mut page = None;
    for (number, value) in raw.bytes.chunks(LINE).enumerate() {
        let address = raw.address as usize + number * LINE;
        if page != Some(address / PAGE) {
            page = Some(address / PAGE);
            records.push(Record::ExtendedLinearAddress((address / PAGE) as u16));
        }
        records.push(Record::Data { offset: (address % PAGE) as u16, value: value.to_vec() });
    }
    records.push(Record::EndOfFile);
    Ok(ihex::create_object_file_representation(&records)?)
}

fn of_hex(text: &str) -> Result<Raw> {
    let (mut upper, mut lines) = (0, Vec::new());
    for record in Reader::new(text) {
        match record? {
            Record::ExtendedLinearAddress(half) => upper = u32::from(half) << 16,
            Record::Data { offset, value } => {
                lines.push(Raw { address: upper + u32::from(offset), bytes: value })
            }
            Record::EndOfFile => break,
            other => bail!("a record that nobody wrote: {other:?}"),
        }
    }
    flatten(&lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two segments with a gap, across the border of a page, in any order.
    fn two() -> [Raw; 2] {
        let long = (0..=255).cycle().take(0x1_0123).collect();
        [Raw { address: 0x0801_0200, bytes: vec![1, 2, 3] }, Raw { address: 0x0800_0000, bytes: long }]
    }

    #[test]
    fn every_byte_of_every_segment_lies_in_both_files_where_the_elf_has_it() {
        let raw = flatten(&two()).unwrap();
        let read = of_hex(&to_hex(&raw).unwrap()).unwrap();
        assert_eq!(read, raw);
        for segment in two() {
            let from = (segment.address - raw.address) as usize;
            assert_eq!(raw.bytes[from..from + segment.bytes.len()], segment.bytes);
        }
        assert_eq!((raw.address, raw.bytes.len()), (0x0800_0000, 0x1_0203));
        assert_eq!(raw.bytes[0x1_0123..0x1_0200], [ERASED; 0xDD]);
    }

    #[test]
    fn a_damaged_hex_file_and_a_segment_far_away_are_refused() {
        let text = to_hex(&flatten(&two()).unwrap()).unwrap();
        assert!(of_hex(&text.replacen(":10", ":11", 1)).is_err());
        let far = Raw { address: 0x2000_0000, bytes: vec![0] };
        assert!(flatten(&[two()[0].clone(), far]).unwrap_err().to_string().contains("0x20000000"));
        assert!(flatten(&[]).is_err());
    }
}
