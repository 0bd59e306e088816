//! A NOR flash whose power can be cut at any operation.
//!
//! The model keeps two words a cell group: what the cells read, and which of them read unsteadily (random at every
//! read) because programming or erasing was interrupted in them. Its rules are those of the STM32F405 (RM0090,
//! section 3): programming pulls bits to zero, word by word; only an erase of a whole sector brings ones back;
//! programming a one over a zero, an odd address or a sector half is a mistake of the caller and panics.

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const WORD: usize = 4;

/// What the flash reports once its power is gone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PowerLost;

impl NorFlashError for PowerLost {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

/// Number of ways in which one operation is interrupted; see [`Flash::cut`].
pub const WAYS: u64 = 8;

/// Two sectors of `SECTOR` bytes.
#[derive(Clone)]
pub struct Flash<const SECTOR: usize> {
    words: Vec<u32>,
    unsteady: Vec<u32>,
    random: ChaCha8Rng,
    /// Word programmings and sector erasures so far.
    pub operations: u64,
    /// Numbers of those operations that were erasures.
    pub erasures: Vec<u64>,
    /// A word that cannot be programmed any more.
    pub worn: Option<usize>,
    cut_at: Option<(u64, u64)>,
    powered: bool,
}

impl<const SECTOR: usize> Flash<SECTOR> {
    /// Factory-new: all ones.
    pub fn new(seed: u64) -> Self {
        Flash {
            words: vec![u32::MAX; 2 * SECTOR / WORD],
            unsteady: vec![0; 2 * SECTOR / WORD],
            random: ChaCha8Rng::seed_from_u64(seed),
            operations: 0,
            erasures: Vec::new(),
            worn: None,
            cut_at: None,
            powered: true,
        }
    }

    /// Cuts the power in the operation with this number (from now on, 0 is the next), in one of [`WAYS`] ways.
    pub fn cut(&mut self, operation: u64, way: u64, seed: u64) {
        self.random = ChaCha8Rng::seed_from_u64(seed);
        self.cut_at = Some((self.operations + operation, way));
    }

    /// Power returns. Tells whether it had been lost.
    pub fn reboot(&mut self) -> bool {
        self.cut_at = None;
        !std::mem::replace(&mut self.powered, true)
    }

    /// Fills a sector with random words.
    pub fn scramble(&mut self, sector: usize) {
        let range = sector * SECTOR / WORD..(sector + 1) * SECTOR / WORD;
        for word in &mut self.words[range] {
            *word = self.random.random();
        }
    }

    /// What the cells read, unsteady ones as they were meant.
    pub fn bytes(&self) -> Vec<u8> {
        self.words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    /// The way in which this operation is interrupted, if it is.
    fn interruption(&mut self) -> Option<u64> {
        let operation = self.operations;
        self.operations += 1;
        let (_, way) = self.cut_at.filter(|&(at, _)| at == operation)?;
        self.powered = false;
        Some(way)
    }

    /// Programming one word stops half-way.
    fn program_partly(&mut self, index: usize, value: u32, way: u64) {
        let to_clear = self.words[index] & !value;
        let some = to_clear & self.random.random::<u32>();
        let (cleared, unsteady) = match way {
            // Nothing has happened that a reader could see, or only later.
            0 => (0, 0),
            1 => (0, to_clear & self.sparse()),
            // Some bits are through, the others not or half.
            2 => (some, 0),
            3 => (some, to_clear & !some),
            4 => (some, to_clear & !some & self.random.random::<u32>()),
            // Whole bytes only: an interface that programs byte by byte.
            5 => (to_clear & (u32::MAX >> (8 * self.random.random_range(1..4u32))), 0),
            // All but a few bits are through, and those few sometimes look it.
            6 => (to_clear & !self.sparse(), to_clear),
            _ => (to_clear, 0),
        };
        self.words[index] &= !cleared;
        self.unsteady[index] = (self.unsteady[index] | unsteady) & !cleared;
    }

    /// Erasing one sector stops half-way. Flash programs all cells to zero first and then lifts them to one.
    fn erase_partly(&mut self, sector: usize, way: u64) {
        let share = [0.0, 0.001, 0.03, 0.5, 0.97, 0.999, 1.0, 0.5][way as usize];
        for index in sector * SECTOR / WORD..(sector + 1) * SECTOR / WORD {
            let lifted = self.bits(share);
            let steady = self.random.random::<u32>() | self.random.random::<u32>();
            match way {
                0 => self.words[index] &= !self.bits(0.01),
                7 if index.is_multiple_of(2) => self.words[index] = self.random.random(),
                6 => self.unsteady[index] = self.bits(0.02),
                _ => {
                    self.words[index] |= lifted;
                    self.unsteady[index] = !self.words[index] & !steady;
                }
            }
            if way == 6 {
                self.words[index] = u32::MAX;
            }
        }
    }

    /// A word in which every bit is one with this probability.
    fn bits(&mut self, share: f64) -> u32 {
        match share {
            0.0 => 0,
            1.0 => u32::MAX,
            share => (0..32).fold(0, |word, bit| word | u32::from(self.random.random_bool(share)) << bit),
        }
    }

    /// Programs without asking whether the words can take it: what cannot be lifted stays zero.
    pub fn write_over(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerLost> {
        assert!(
            (offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD),
            "a write off the words"
        );
        for (chunk, index) in bytes.chunks_exact(WORD).zip(offset as usize / WORD..) {
            if !self.powered {
                return Err(PowerLost);
            }
            let value = u32::from_le_bytes(chunk.try_into().expect("four bytes"));
            if let Some(way) = self.interruption() {
                self.program_partly(index, value, way);
                return Err(PowerLost);
            }
            if self.worn != Some(index) {
                self.words[index] &= value;
            }
            self.unsteady[index] &= value;
        }
        Ok(())
    }

    /// One bit in sixteen.
    fn sparse(&mut self) -> u32 {
        (0..4).fold(u32::MAX, |word, _| word & self.random.random::<u32>())
    }
}

impl<const SECTOR: usize> ErrorType for Flash<SECTOR> {
    type Error = PowerLost;
}

impl<const SECTOR: usize> ReadNorFlash for Flash<SECTOR> {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
        if !self.powered {
            return Err(PowerLost);
        }
        assert!(
            (offset as usize).is_multiple_of(WORD) && bytes.len().is_multiple_of(WORD),
            "a read off the words"
        );
        for (chunk, index) in bytes.chunks_exact_mut(WORD).zip(offset as usize / WORD..) {
            let flipped = match self.unsteady[index] {
                0 => 0,
                unsteady => unsteady & self.random.next_u32(),
            };
            chunk.copy_from_slice(&(self.words[index] ^ flipped).to_le_bytes());
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        2 * SECTOR
    }
}

impl<const SECTOR: usize> NorFlash for Flash<SECTOR> {
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = SECTOR;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerLost> {
        assert!(
            (from as usize).is_multiple_of(SECTOR) && (to as usize).is_multiple_of(SECTOR),
            "an erase of half a sector"
        );
        for sector in from as usize / SECTOR..to as usize / SECTOR {
            if !self.powered {
                return Err(PowerLost);
            }
            self.erasures.push(self.operations);
            if let Some(way) = self.interruption() {
                self.erase_partly(sector, way);
                return Err(PowerLost);
            }
            let range = sector * SECTOR / WORD..(sector + 1) * SECTOR / WORD;
            self.words[range.clone()].fill(u32::MAX);
            self.unsteady[range].fill(0);
        }
        Ok(())
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerLost> {
        for (chunk, index) in bytes.chunks_exact(WORD).zip(offset as usize / WORD..) {
            let value = u32::from_le_bytes(chunk.try_into().expect("four bytes"));
            let lifts = value & !self.words[index] & !self.unsteady[index];
            assert!(lifts == 0, "word {index}: {value:08x} programmed over {:08x}", self.words[index]);
        }
        self.write_over(offset, bytes)
    }
}
