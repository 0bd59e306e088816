//! One sector of the flash as the queue of `sequential-storage` sees it.

use crate::store::RECORD_LEN;
use core::future::Future;
use core::pin::Pin;
use core::task::{Context, Poll, Waker};
use embedded_storage::nor_flash::{NorFlash, NorFlashErrorKind, ReadNorFlash};
use embedded_storage_async::nor_flash as asynchronous;
use sequential_storage::cache::{Cache, Uncached};

/// The flash word: the unit of programming.
pub(super) const WORD: u32 = 4;
/// Length and checksum that the library puts in front of an item.
pub(super) const ITEM_HEADER: u32 = 8;
/// Bytes of a record in the queue.
pub(super) const SLOT: u32 = ITEM_HEADER + RECORD_LEN as u32;

/// Records that a sector has room for, each with its confirm word, behind the two words of the sector's own.
pub(super) const fn slots(sector: u32) -> u32 {
    (sector - 2 * WORD) / (SLOT + WORD)
}

/// The queue keeps nothing in RAM.
pub(super) type NoCache = Cache<Uncached, Uncached, Uncached, ()>;
/// A word that was erased.
pub(super) const BLANK: [u8; WORD as usize] = [0xFF; WORD as usize];

/// One sector without its confirm words, as the library sees it: words, no erase. The blocking flash underneath is
/// always ready, so the library's futures finish at their first poll.
pub(super) struct Page<'a, F> {
    pub(super) flash: &'a mut F,
    pub(super) base: u32,
}

impl<F: NorFlash> Page<'_, F> {
    pub(super) const LEN: u32 = F::ERASE_SIZE as u32 - WORD * slots(F::ERASE_SIZE as u32);
}

/// Why the library's request was not carried out.
#[derive(Debug)]
pub(super) enum PageError {
    Flash,
    /// The library wanted to erase by itself.
    EraseRefused,
}

impl asynchronous::NorFlashError for PageError {
    fn kind(&self) -> NorFlashErrorKind {
        NorFlashErrorKind::Other
    }
}

impl<F> asynchronous::ErrorType for Page<'_, F> {
    type Error = PageError;
}

impl<F: NorFlash> asynchronous::ReadNorFlash for Page<'_, F> {
    const READ_SIZE: usize = WORD as usize;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PageError> {
        ReadNorFlash::read(self.flash, self.base + offset, bytes).map_err(|_| PageError::Flash)
    }

    fn capacity(&self) -> usize {
        Self::LEN as usize
    }
}

impl<F: NorFlash> asynchronous::NorFlash for Page<'_, F> {
    const WRITE_SIZE: usize = WORD as usize;
    const ERASE_SIZE: usize = Self::LEN as usize;

    async fn erase(&mut self, _from: u32, _to: u32) -> Result<(), PageError> {
        Err(PageError::EraseRefused)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PageError> {
        self.flash.write(self.base + offset, bytes).map_err(|_| PageError::Flash)
    }
}

/// Runs a future that never waits, where it lies: it holds hundreds of bytes.
pub(super) fn ready<T>(mut future: Pin<&mut impl Future<Output = T>>) -> T {
    let mut context = Context::from_waker(Waker::noop());
    loop {
        if let Poll::Ready(value) = future.as_mut().poll(&mut context) {
            return value;
        }
    }
}
