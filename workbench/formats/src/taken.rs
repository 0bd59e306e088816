//! Bytes that are taken one after the other, from memory.

/// A little-endian reader over bytes. Each method answers `None` where they are over.
#[derive(Clone, Copy)]
pub struct Taken<'a> {
    bytes: &'a [u8],
    /// Bytes that were taken.
    pub at: usize,
}

impl<'a> Taken<'a> {
    /// From the first byte on.
    pub fn of(bytes: &'a [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    /// How many are left.
    pub fn left(&self) -> usize {
        self.bytes.len() - self.at
    }

    /// The next ones.
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let taken = self.bytes.get(self.at..self.at.checked_add(count)?)?;
        self.at += count;
        Some(taken)
    }

    /// The next ones, of which there are so many.
    pub fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        self.take(N)?.try_into().ok()
    }

    /// A whole number of up to eight bytes.
    pub fn integer(&mut self, bytes: usize) -> Option<u64> {
        let mut all = [0; 8];
        all.get_mut(..bytes)?.copy_from_slice(self.take(bytes)?);
        Some(u64::from_le_bytes(all))
    }

    /// A text behind its length in four bytes.
    pub fn text(&mut self) -> Option<String> {
        let length = self.integer(4)? as usize;
        self.take(length).map(|bytes| String::from_utf8_lossy(bytes).into_owned())
    }
}
