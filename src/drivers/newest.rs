//! The search for the newest record, one record at a time.

use crate::store::RECORD_LEN;

/// Where the newest record of the flash was found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Newest {
    pub(super) sector: u32,
    pub(super) epoch: u32,
}

/// What a search does with the intact records of a sector, oldest first. The records are large and the stack is small:
/// a search holds one of them and knows of one more.
pub(super) enum Search<'a> {
    /// Keeps the newest.
    Keep(&'a mut Option<Newest>, &'a mut [u8; RECORD_LEN]),
    /// Is the newest this one?
    Compare(&'a [u8; RECORD_LEN], &'a mut bool),
}

impl Search<'_> {
    /// Within a sector the later record is the newer one; between two the epoch decides.
    pub(super) fn see(&mut self, sector: u32, epoch: u32, bytes: &[u8; RECORD_LEN]) {
        match self {
            Search::Keep(newest, record) => {
                let newer = |old: Newest| old.sector == sector || old.epoch <= epoch;
                if newest.is_none_or(newer) {
                    **newest = Some(Newest { sector, epoch });
                    record.copy_from_slice(bytes);
                }
            }
            Search::Compare(record, same) => **same = bytes == *record,
        }
    }
}
