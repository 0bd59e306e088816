//! The flash of the stored parameters, as a file on the host that behaves like one: blank bytes are 0xFF, programming
//! only clears bits, and only an erase of a whole sector sets them again. The host decides whether the file survives the
//! session. Sectors are smaller than the chip's, so that a test sees an erase after a few saves.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};
use semihosting::fs::File;
use semihosting::io::{Read, Seek, SeekFrom, Write};

/// In QEMU's working directory.
const FILE: &core::ffi::CStr = c"flash";
/// The file is these two sectors.
pub const PARAMETERS: u32 = 0;
const SECTOR: usize = 4096;
const SIZE: usize = 2 * SECTOR;

/// The file.
pub struct FileFlash {
    file: File,
}

/// What went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Not on a word, or outside the flash.
    Address(NorFlashErrorKind),
    /// The host's file failed.
    File,
    /// A bit was to be set without an erase.
    NotErased,
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Error::Address(kind) => *kind,
            _ => NorFlashErrorKind::Other,
        }
    }
}

impl FileFlash {
    /// Opens the file that the host has made.
    pub fn open() -> Self {
        let file = File::options().read(true).write(true).open(FILE);
        Self { file: file.expect("the host has not made the flash file") }
    }

    fn seek(&mut self, offset: u32) -> Result<(), Error> {
        let place = SeekFrom::Start(u64::from(offset));
        self.file.seek(place).map(drop).map_err(|_| Error::File)
    }

    fn put(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        self.seek(offset)?;
        self.file.write_all(bytes).map_err(|_| Error::File)
    }
}

impl ErrorType for FileFlash {
    type Error = Error;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(Error::Address)?;
        self.seek(offset)?;
        self.file.read_exact(bytes).map_err(|_| Error::File)
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(Error::Address)?;
        for offset in (from..to).step_by(4) {
            self.put(offset, &[0xFF; 4])?;
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(Error::Address)?;
        for (place, word) in (offset..).step_by(4).zip(bytes.chunks_exact(4)) {
            let mut held = [0; 4];
            self.read(place, &mut held)?;
            if held.iter().zip(word).any(|(held, new)| new & !held != 0) {
                return Err(Error::NotErased);
            }
            self.put(place, word)?;
        }
        Ok(())
    }
}
