//! The log of records on two flash sectors: after a power cut at any moment the old or the new set is read.
//!
//! Each sector is one single-page queue of `sequential-storage`, followed by one *confirm word* a slot:
//!
//! ```text
//! │ page marker │ slot 0 │ slot 1 │ … │ unused │ … confirm 1 │ confirm 0 │
//! ```
//!
//! A slot is one queue item that holds one [`Record`]. The library frames, checks and finds items; what it does not
//! promise is added here (measured in docs/results/README.md):
//!
//! - **A half-erased sector reads as anything.** The library is never allowed to erase or to rotate pages by itself. A
//!   sector is written only after an erase that ran to its end since power-up, and only the sector *without* the newest
//!   record is ever erased. The epoch in the record says which sector is newer.
//! - **A half-programmed word reads unsteadily.** A slot counts as finished when it was read back and its confirm word
//!   was programmed after that. An intact record without it is programmed once more with its own bytes (flash may be
//!   programmed again as long as no bit returns to one, RM0090 section 3.6.3) before anyone is told about it.
//!   Every other unfinished slot is programmed to zero, which is steady and no header.
//! - **The end of the log may hold words that look blank and are not.** The first save after power-up gives up the first
//!   blank slot: it is programmed to zero, too.
//! - **A save is believed only when a fresh search finds it.** Otherwise its slot is zeroed and the next one is used.

use super::newest::{Newest, Search};
use super::page::{BLANK, ITEM_HEADER, NoCache, Page, SLOT, WORD, ready, slots};
use crate::store::{
    AtRest, Found, LAYOUT, Loaded, RECORD_LEN, Record, SaveError, StoredParameters, encode_into,
};
use core::pin::pin;
use embedded_storage::nor_flash::NorFlash;
use sequential_storage::cache::Cache;
use sequential_storage::queue::{QueueConfig, QueueStorage};
use serde::Serialize;

/// Slots that one save may spend on words that cannot be programmed.
const ATTEMPTS: u32 = 3;

/// Where the newest record lies.
#[derive(Clone, Copy, Debug)]
struct Head {
    sector: u32,
    epoch: u32,
    slot: u32,
    /// The slots from here on are blank.
    used: u32,
}

/// Two neighbouring sectors of a NOR flash as the store of parameters.
pub struct ParameterFlash<F> {
    flash: F,
    origin: u32,
    head: Option<Head>,
    /// The newest record is known to read the same for ever.
    settled: bool,
    /// The words behind it are.
    sealed: bool,
    /// A sector that was erased since power-up and not written since.
    fresh: Option<u32>,
}

impl<F: NorFlash> ParameterFlash<F> {
    /// Records that one sector holds.
    pub const SLOTS: u32 = slots(F::ERASE_SIZE as u32);

    /// `origin`: offset of the first of the two sectors from the start of the flash.
    pub fn new(flash: F, origin: u32) -> Self {
        const {
            assert!(
                (WORD as usize).is_multiple_of(F::WRITE_SIZE) && (WORD as usize).is_multiple_of(F::READ_SIZE)
            );
            assert!(Self::SLOTS > 0);
        }
        ParameterFlash { flash, origin, head: None, settled: false, sealed: false, fresh: None }
    }

    /// Finds the newest set. Call it at power-up, before the bridge may be driven: after a power cut it programs a few
    /// words (never an erase) to make final what it returns.
    pub fn load(&mut self) -> Loaded {
        let mut parameters = StoredParameters::default();
        let found = self.load_into(&mut parameters);
        Loaded::new(found, parameters)
    }

    /// Loads the newest set into the place where it is to stay, which is empty unless a set is found.
    #[inline(never)]
    pub fn load_into<const AXES: usize>(&mut self, set: &mut StoredParameters<AXES>) -> Found {
        set.axes.clear();
        let mut record = [0; RECORD_LEN];
        let (newest, blank) = self.find(&mut record);
        match newest.and_then(|_| Record::parse(&record)) {
            Some(record) => record.load_into(set),
            None if blank => Found::Blank,
            None => Found::Damaged,
        }
    }

    /// Finds the newest record and makes it final. And if there is none: is the flash blank?
    #[inline(never)]
    fn find(&mut self, record: &mut [u8; RECORD_LEN]) -> (Option<Newest>, bool) {
        (self.head, self.settled, self.sealed) = (None, false, false);
        let mut newest = None;
        for sector in 0..2 {
            self.search(sector, Search::Keep(&mut newest, record));
        }
        let blank = newest.is_none() && self.is_blank(0) && self.is_blank(1);
        // A flash that cannot be programmed can still be read; the next save tries again and reports it.
        let _ = self.settle(newest, record);
        (newest, blank)
    }

    /// Appends the set. Erases nothing.
    pub fn save<const AXES: usize>(
        &mut self,
        parameters: &StoredParameters<AXES>,
        rest: AtRest,
    ) -> Result<(), SaveError> {
        self.save_as(parameters, LAYOUT, rest)
    }

    /// Appends a set in any layout; tests leave with it what an older or a newer image would have left.
    pub fn save_as(&mut self, set: &impl Serialize, layout: u16, _rest: AtRest) -> Result<(), SaveError> {
        let mut record = [0; RECORD_LEN];
        self.insist_on_settled(&mut record)?;
        for _ in 0..ATTEMPTS {
            let (sector, slot, epoch) = self.next_slot()?;
            encode_into(&mut record, set, epoch, layout).map_err(|_| SaveError::TooLarge)?;
            if self.write(sector, slot, &record)? {
                let used = slot + 1;
                self.head = Some(Head { sector, epoch, slot, used });
                return Ok(());
            }
        }
        Err(SaveError::Flash)
    }

    /// Will the next save need an erase first?
    pub fn erase_needed(&self) -> bool {
        self.fresh.is_none()
            && self.head.is_none_or(|head| head.used + u32::from(!self.sealed) >= Self::SLOTS)
    }

    /// Erases the sector that does not hold the newest set. Stalls a single-bank flash for seconds: announce it.
    #[inline(never)]
    pub fn erase(&mut self, _rest: AtRest) -> Result<(), SaveError> {
        self.insist_on_settled(&mut [0; RECORD_LEN])?;
        let sector = self.head.map_or(0, |head| 1 - head.sector);
        let start = self.base(sector);
        self.fresh = None;
        self.flash.erase(start, start + F::ERASE_SIZE as u32).map_err(|_| SaveError::Flash)?;
        if !self.is_blank(sector) {
            return Err(SaveError::Flash);
        }
        self.fresh = Some(sector);
        Ok(())
    }

    /// The flash underneath.
    pub fn flash(&mut self) -> &mut F {
        &mut self.flash
    }

    /// Nothing may be built on a record that could still read differently tomorrow.
    #[inline(never)]
    fn insist_on_settled(&mut self, scratch: &mut [u8; RECORD_LEN]) -> Result<(), SaveError> {
        if self.head.is_some() && !self.settled {
            self.find(scratch);
        }
        if self.head.is_none() || self.settled { Ok(()) } else { Err(SaveError::Flash) }
    }

    /// Sector, slot and epoch of the next record.
    fn next_slot(&mut self) -> Result<(u32, u32, u32), SaveError> {
        if let Some(head) = self.head {
            if !self.sealed {
                self.seal(head)?;
            }
            if let Some(Head { used, .. }) = self.head.filter(|head| head.used < Self::SLOTS) {
                return Ok((head.sector, used, head.epoch));
            }
        }
        let epoch = self.head.map_or(0, |head| head.epoch);
        let sector = self.fresh.ok_or(SaveError::EraseNeeded)?;
        Ok((sector, self.used(sector)?, epoch.wrapping_add(1)))
    }

    /// One record into one slot; `false`: it cannot be found there, the slot is lost.
    fn write(&mut self, sector: u32, slot: u32, record: &[u8; RECORD_LEN]) -> Result<bool, SaveError> {
        self.sealed = false;
        let mut found = false;
        if self.push(sector, record) {
            self.search(sector, Search::Compare(record, &mut found));
        }
        found = found && self.slot_of(sector, record) == Some(slot);
        if found {
            self.confirm(sector, slot)?;
            self.fresh = self.fresh.filter(|&fresh| fresh != sector);
        } else {
            self.zero(sector, slot)?;
            self.lose(sector, slot);
        }
        self.sealed = true;
        Ok(found)
    }

    fn lose(&mut self, sector: u32, slot: u32) {
        if let Some(head) = self.head.as_mut().filter(|head| head.sector == sector) {
            head.used = slot + 1;
        }
    }

    /// The slot behind the log looks blank, but a write may have begun there before a power cut: gives it up.
    fn seal(&mut self, head: Head) -> Result<(), SaveError> {
        if head.used < Self::SLOTS {
            self.zero(head.sector, head.used)?;
            self.head = Some(Head { used: head.used + 1, ..head });
        }
        self.sealed = true;
        Ok(())
    }

    /// Makes what was read final: the newest record whole, and every unfinished one gone.
    #[inline(never)]
    fn settle(&mut self, newest: Option<Newest>, record: &[u8; RECORD_LEN]) -> Result<(), SaveError> {
        if let Some(newest) = newest {
            self.finish(newest, record)?;
        }
        for sector in 0..2 {
            // The length of the log is asked for once: a word that reads unsteadily could answer differently.
            let unfinished = match self.head.filter(|head| head.sector == sector) {
                Some(head) => head.slot + 1..head.used,
                None => 0..self.used(sector)?.min(ATTEMPTS),
            };
            for slot in unfinished {
                self.discard(sector, slot)?;
            }
        }
        self.settled = true;
        Ok(())
    }

    /// Remembers where the newest record lies, and programs it once more unless it is confirmed.
    fn finish(&mut self, newest: Newest, record: &[u8; RECORD_LEN]) -> Result<(), SaveError> {
        let Newest { sector, epoch } = newest;
        let slot = self.slot_of(sector, record).ok_or(SaveError::Flash)?;
        let used = self.used(sector)?;
        self.head = Some(Head { sector, epoch, slot, used });
        if self.is_confirmed(sector, slot)? {
            return Ok(());
        }
        let address = self.slot_address(sector, slot) + ITEM_HEADER;
        self.program(address, record)?;
        self.confirm(sector, slot)
    }

    /// A write that did not come to its end could read as a record one day: no more.
    fn discard(&mut self, sector: u32, slot: u32) -> Result<(), SaveError> {
        if self.is_confirmed(sector, slot)? {
            return Ok(());
        }
        self.zero(sector, slot)
    }

    fn is_confirmed(&mut self, sector: u32, slot: u32) -> Result<bool, SaveError> {
        let mut word = BLANK;
        self.read(self.confirm_address(sector, slot), &mut word)?;
        Ok(word != BLANK)
    }

    fn confirm(&mut self, sector: u32, slot: u32) -> Result<(), SaveError> {
        let address = self.confirm_address(sector, slot);
        self.program(address, &[0; WORD as usize])
    }

    /// Gives a slot up for good.
    fn zero(&mut self, sector: u32, slot: u32) -> Result<(), SaveError> {
        let start = self.slot_address(sector, slot);
        for address in (start..start + SLOT).step_by(WORD as usize) {
            self.program(address, &[0; WORD as usize])?;
        }
        self.confirm(sector, slot)
    }

    fn program(&mut self, address: u32, bytes: &[u8]) -> Result<(), SaveError> {
        self.flash.write(address, bytes).map_err(|_| SaveError::Flash)
    }

    #[inline(never)]
    fn push(&mut self, sector: u32, record: &[u8; RECORD_LEN]) -> bool {
        let mut queue = self.queue(sector);
        ready(pin!(queue.push(record, false))).is_ok()
    }

    /// Shows the search every intact record of a sector. A sector that a cut erase left behind can hold anything, also a
    /// header whose length is absurd: the search then ends with what it has.
    #[inline(never)]
    fn search(&mut self, sector: u32, mut search: Search<'_>) {
        let (mut queue, mut buffer) = (self.queue(sector), [0; RECORD_LEN]);
        ready(pin!(async {
            let Ok(mut items) = queue.iter().await else { return };
            while let Ok(Some(item)) = items.next(&mut buffer).await {
                let bytes: Result<&[u8; RECORD_LEN], _> = (&item[..]).try_into();
                if let (Ok(bytes), Some(record)) = (bytes, Record::parse(&item)) {
                    search.see(sector, record.epoch, bytes);
                }
            }
        }));
    }

    /// The last slot that holds this record. One word may differ: it may read unsteadily. Two records that are not the
    /// same differ in two words at least, one of them their checksum.
    #[inline(never)]
    fn slot_of(&mut self, sector: u32, record: &[u8; RECORD_LEN]) -> Option<u32> {
        (0..Self::SLOTS).rev().find(|&slot| {
            let address = self.slot_address(sector, slot) + ITEM_HEADER;
            let mut differing = 0;
            for (word, at) in record.chunks_exact(WORD as usize).zip((address..).step_by(WORD as usize)) {
                let mut read = BLANK;
                differing += u32::from(self.read(at, &mut read).is_err() || read != word);
                if differing > 1 {
                    return false;
                }
            }
            true
        })
    }

    /// Slots up to the last one with a programmed bit.
    #[inline(never)]
    fn used(&mut self, sector: u32) -> Result<u32, SaveError> {
        for slot in (0..Self::SLOTS).rev() {
            let start = self.slot_address(sector, slot);
            for address in (start..start + SLOT).step_by(WORD as usize) {
                let mut word = BLANK;
                self.read(address, &mut word)?;
                if word != BLANK {
                    return Ok(slot + 1);
                }
            }
        }
        Ok(0)
    }

    fn is_blank(&mut self, sector: u32) -> bool {
        let start = self.base(sector);
        let mut word = [0; WORD as usize];
        (start..start + F::ERASE_SIZE as u32)
            .step_by(WORD as usize)
            .all(|address| self.read(address, &mut word).is_ok() && word == BLANK)
    }

    fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), SaveError> {
        self.flash.read(address, bytes).map_err(|_| SaveError::Flash)
    }

    fn base(&self, sector: u32) -> u32 {
        self.origin + sector * F::ERASE_SIZE as u32
    }

    fn slot_address(&self, sector: u32, slot: u32) -> u32 {
        self.base(sector) + WORD + slot * SLOT
    }

    fn confirm_address(&self, sector: u32, slot: u32) -> u32 {
        self.base(sector + 1) - (slot + 1) * WORD
    }

    fn queue(&mut self, sector: u32) -> QueueStorage<Page<'_, F>, NoCache> {
        let page = Page { base: self.base(sector), flash: &mut self.flash };
        QueueStorage::new(page, const { QueueConfig::new(0..Page::<F>::LEN) }, Cache::new_uncached())
    }
}
