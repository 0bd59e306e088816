//! MAT files of level 5: what MATLAB saves by default, and what Octave and SciPy write.

use crate::mat::{DEEPEST, Variable, Variables};
use crate::taken::Taken;
use flate2::read::ZlibDecoder;
use std::io::Read;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Files of MATLAB 5 to 7.2.
pub struct Mat5;

/// Bytes before the first variable; the last four are version and order of bytes.
const HEADER: usize = 128;
/// The last four where bytes stand in the order of this machine, and where they do not.
const LITTLE: &[u8] = &[0x00, 0x01, b'I', b'M'];
const BIG: &[u8] = &[0x01, 0x00, b'M', b'I'];
/// Bytes of a variable that is no mistake.
const LONGEST: u64 = 1 << 32;

/// Types of what follows a tag.
mod mi {
    pub const MATRIX: u32 = 14;
    pub const COMPRESSED: u32 = 15;
}
/// Classes of arrays.
mod mx {
    pub const STRUCT: u8 = 2;
    /// Doubles, singles, and whole numbers of 8 to 64 bits.
    pub const NUMBERS: std::ops::RangeInclusive<u8> = 6..=15;
}
/// Flag of an array that has an imaginary part.
const COMPLEX: u8 = 0x08;

impl Source for Mat5 {
    fn takes(&self, _: &str, head: &[u8]) -> bool {
        head.get(HEADER - 4..HEADER).is_some_and(|mark| mark == LITTLE || mark == BIG)
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let held = crate::held(bytes)?;
        let mut elements =
            Elements { bytes: Taken::of(&held), big_endian: held.get(HEADER - 4..HEADER) == Some(BIG) };
        let mut variables = Variables::default();
        let end = elements.bytes.take(HEADER).map(|_| elements.variables(&mut variables));
        let at = elements.bytes.at;
        if let Some(Some(why)) = end {
            let what = format!("{why} in the variable at byte {at}; save it anew");
            if variables.list.is_empty() {
                return Err(InputError::file(bytes.name, what));
            }
            variables
                .told
                .push(format!("The file {why} in the variable at byte {at}: those before it are read."));
        }
        variables.cells("MAT level 5").map_err(|what| InputError::file(bytes.name, what))
    }
}

/// Elements one after the other, each behind its type and length.
struct Elements<'a> {
    bytes: Taken<'a>,
    big_endian: bool,
}

impl<'a> Elements<'a> {
    /// Takes all variables, or says why not.
    fn variables(&mut self, into: &mut Variables) -> Option<String> {
        while self.bytes.left() > 0 {
            let begin = self.bytes;
            let Some((kind, data)) = self.next() else {
                self.bytes = begin;
                return Some("is cut".into());
            };
            let mut inflated = Vec::new();
            let taken = if kind == mi::COMPRESSED {
                let read = ZlibDecoder::new(data).take(LONGEST).read_to_end(&mut inflated);
                let mut inner = Elements { bytes: Taken::of(&inflated), ..*self };
                read.ok().and_then(|_| inner.next()).and_then(|inner| self.variable(inner, into))
            } else {
                self.variable((kind, data), into)
            };
            if taken.is_none() {
                self.bytes = begin;
                return Some("is broken".into());
            }
        }
        None
    }

    fn variable(&self, (kind, data): (u32, &[u8]), into: &mut Variables) -> Option<()> {
        if kind != mi::MATRIX {
            return Some(());
        }
        Elements { bytes: Taken::of(data), ..*self }.array(None, DEEPEST, into)
    }

    fn u32(&mut self) -> Option<u32> {
        let value = self.bytes.array()?;
        Some(if self.big_endian { u32::from_be_bytes(value) } else { u32::from_le_bytes(value) })
    }

    /// The next element: its type and its bytes. They end on a multiple of eight, but for compressed ones.
    fn next(&mut self) -> Option<(u32, &'a [u8])> {
        let tag = self.u32()?;
        if tag >> 16 != 0 {
            let four = self.bytes.take(4)?;
            return Some((tag & 0xffff, four.get(..(tag >> 16) as usize)?));
        }
        let length = self.u32()? as usize;
        let data = self.bytes.take(length)?;
        if tag != mi::COMPRESSED {
            let padding = (8 - length % 8) % 8;
            self.bytes.take(padding.min(self.bytes.left()))?;
        }
        Some((tag, data))
    }

    /// An array, with the name of the structure that it is in.
    fn array(&mut self, outer: Option<&str>, deeper: usize, into: &mut Variables) -> Option<()> {
        let flags = self.next()?.1;
        let word = |k: usize| flags.get(if self.big_endian { 3 - k } else { k }).copied();
        let (class, flags) = (word(0)?, word(1)?);
        let dims = self.next()?;
        let dims: Vec<usize> = self.numbers(dims)?.into_iter().map(|length| length as usize).collect();
        let own = String::from_utf8_lossy(self.next()?.1).into_owned();
        let name = outer.map_or(own, str::to_owned);
        let count = dims.iter().try_fold(1_usize, |all, length| all.checked_mul(*length))?;
        match class {
            mx::STRUCT if count == 1 && deeper > 0 => return self.members(&name, deeper - 1, into),
            class if mx::NUMBERS.contains(&class) && flags & COMPLEX == 0 => {
                let data = self.next()?;
                let values = self.numbers(data)?;
                if values.len() != count {
                    return None;
                }
                into.list.push(Variable { name, dims, values });
            }
            _ if name.is_empty() => {}
            _ => into.left_out.push(name),
        }
        Some(())
    }

    /// The members of a structure.
    fn members(&mut self, name: &str, deeper: usize, into: &mut Variables) -> Option<()> {
        let width = self.next()?;
        let width = *self.numbers(width)?.first()? as usize;
        let names = self.next()?.1;
        if width == 0 {
            return None;
        }
        for member in names.chunks(width) {
            let end = member.iter().position(|byte| *byte == 0).unwrap_or(member.len());
            let member = String::from_utf8_lossy(&member[..end]);
            let (kind, data) = self.next()?;
            if kind != mi::MATRIX {
                return None;
            }
            if data.is_empty() {
                continue;
            }
            let mut inner = Elements { bytes: Taken::of(data), big_endian: self.big_endian };
            inner.array(Some(&format!("{name}.{member}")), deeper, into)?;
        }
        Some(())
    }

    /// Numbers of any type: a file keeps whole numbers in the shortest one that holds them.
    fn numbers(&self, (kind, data): (u32, &[u8])) -> Option<Vec<f64>> {
        Some(match kind {
            1 => data.iter().map(|byte| f64::from(*byte as i8)).collect(),
            2 => data.iter().copied().map(f64::from).collect(),
            3 => self.each(data, |it| i16::from_le_bytes(it).into()),
            4 => self.each(data, |it| u16::from_le_bytes(it).into()),
            5 => self.each(data, |it| i32::from_le_bytes(it).into()),
            6 => self.each(data, |it| u32::from_le_bytes(it).into()),
            7 => self.each(data, |it| f32::from_le_bytes(it).into()),
            9 => self.each(data, f64::from_le_bytes),
            12 => self.each(data, |it| i64::from_le_bytes(it) as f64),
            13 => self.each(data, |it| u64::from_le_bytes(it) as f64),
            _ => return None,
        })
    }

    fn each<const N: usize>(&self, data: &[u8], number: impl Fn([u8; N]) -> f64) -> Vec<f64> {
        let ordered = |bytes: &[u8; N]| {
            let mut bytes = *bytes;
            if self.big_endian {
                bytes.reverse();
            }
            number(bytes)
        };
        data.as_chunks::<N>().0.iter().map(ordered).collect()
    }
}
