//! The flash memory as `embedded-storage` sees it: the last two sectors, 10 and 11, of 128 KiB each, where the stored
//! parameters live (RM0090 section 3.3, table 5).
//!
//! There is one bank: while it programs a word (100 µs at most) or erases a sector (2 s at most at 2.7 to 3.6 V, DS8626),
//! the processor stands still at its next fetch from flash, interrupts included. So the store writes at rest with the
//! bridge off, and announces an erase.

use super::pac::{FLASH, flash::RegisterBlock};
use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read, check_write,
};

/// First byte of the flash.
const BASE: u32 = 0x0800_0000;
/// Offset of sector 10 from there: 4 · 16 + 64 + 5 · 128 KiB.
pub const PARAMETERS: u32 = 0x000C_0000;
const SECTOR: u32 = 128 * 1024;
const FIRST_SECTOR: u8 = 10;
/// The chip's flash, 1 MiB.
const SIZE: usize = 1024 * 1024;

/// RM0090 section 3.9.4.
const KEYS: [u32; 2] = [0x4567_0123, 0xCDEF_89AB];
/// PSIZE: 32 bits at a time, for a supply of 2.7 to 3.6 V (RM0090 section 3.6.2).
const BY_WORDS: u8 = 0b10;
/// FLASH_SR: PGSERR, PGPERR, PGAERR, WRPERR, OPERR; cleared by writing ones.
const ERRORS: u32 = 0b1111_0010;

/// What the flash reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error {
    /// Not on a word, outside the flash, or outside the two sectors.
    Address(NorFlashErrorKind),
    /// The controller refused or failed; the bits of FLASH_SR.
    Controller(u32),
}

impl NorFlashError for Error {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Error::Address(kind) => *kind,
            Error::Controller(_) => NorFlashErrorKind::Other,
        }
    }
}

/// The flash controller. Offsets count from the start of the flash; only sectors 10 and 11 can be written.
pub struct ChipFlash {
    registers: &'static RegisterBlock,
}

// SAFETY: registers lie at a fixed address for every context, and a device access needs no thread. The clocks set the
// wait states once before there is a value; afterwards only its one owner writes.
unsafe impl Send for ChipFlash {}

impl ChipFlash {
    /// Takes the controller, when the clocks run.
    pub fn new() -> Self {
        Self {
            // SAFETY: the address is valid for the life of the program.
            registers: unsafe { &*FLASH::ptr() },
        }
    }

    /// Runs `work` with the control register unlocked, and locks it again.
    fn unlocked(&mut self, work: impl FnOnce(&Self)) -> Result<(), Error> {
        self.wait();
        // SAFETY: the flags are cleared by ones, the keys are the only words that the key register takes.
        unsafe {
            self.registers.sr().write(|w| w.bits(ERRORS));
            for key in KEYS {
                self.registers.keyr().write(|w| w.bits(key));
            }
        }
        work(self);
        self.wait();
        self.registers.cr().write(|w| w.lock().set_bit());
        match self.registers.sr().read().bits() & ERRORS {
            0 => Ok(()),
            errors => Err(Error::Controller(errors)),
        }
    }

    fn wait(&self) {
        while self.registers.sr().read().bsy().bit_is_set() {}
    }

    fn erase_sector(&self, number: u8) {
        // SAFETY: sector numbers 0 … 11 and the size code are defined.
        self.registers.cr().write(|w| unsafe {
            w.psize().bits(BY_WORDS);
            w.ser().set_bit().snb().bits(number).strt().set_bit()
        });
        self.wait();
    }

    fn program(&self, offset: u32, bytes: &[u8]) {
        // SAFETY: the size code is defined.
        self.registers.cr().write(|w| unsafe { w.psize().bits(BY_WORDS).pg().set_bit() });
        for (place, word) in bytes.chunks_exact(4).enumerate() {
            let value = u32::from_le_bytes([word[0], word[1], word[2], word[3]]);
            let address = (BASE + offset) as usize + 4 * place;
            // SAFETY: inside the two sectors and on a word, checked by the caller; no reference into them exists.
            unsafe { (address as *mut u32).write_volatile(value) };
            // The write must have reached the controller before its flag is asked.
            cortex_m::asm::dsb();
            self.wait();
        }
    }

    /// An erase leaves old words in the data cache, and programming puts the new ones there (RM0090 section 3.5.2): it is
    /// reset, which needs it off, so that what is read back comes from the cells.
    fn drop_cache(&self) {
        self.registers.acr().modify(|_, w| w.dcen().clear_bit());
        self.registers.acr().modify(|_, w| w.dcrst().set_bit());
        self.registers.acr().modify(|_, w| w.dcrst().clear_bit());
        self.registers.acr().modify(|_, w| w.dcen().set_bit());
    }
}

/// Everything below the two sectors is the program.
fn above_program(from: u32) -> Result<(), Error> {
    match from >= PARAMETERS {
        true => Ok(()),
        false => Err(Error::Address(NorFlashErrorKind::OutOfBounds)),
    }
}

impl ErrorType for ChipFlash {
    type Error = Error;
}

impl ReadNorFlash for ChipFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Error> {
        check_read(self, offset, bytes.len()).map_err(Error::Address)?;
        for (place, byte) in bytes.iter_mut().enumerate() {
            // SAFETY: inside the flash, which is always readable; volatile, because it changes behind the compiler.
            *byte = unsafe { ((BASE + offset) as usize as *const u8).add(place).read_volatile() };
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl NorFlash for ChipFlash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR as usize;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Error> {
        check_erase(self, from, to).map_err(Error::Address)?;
        above_program(from)?;
        for sector in (from - PARAMETERS) / SECTOR..(to - PARAMETERS) / SECTOR {
            self.unlocked(|flash| flash.erase_sector(FIRST_SECTOR + sector as u8))?;
            self.drop_cache();
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Error> {
        check_write(self, offset, bytes.len()).map_err(Error::Address)?;
        above_program(offset)?;
        self.unlocked(|flash| flash.program(offset, bytes))?;
        self.drop_cache();
        Ok(())
    }
}
