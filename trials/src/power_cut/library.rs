//! The same power cuts on `sequential-storage` alone: its map over both sectors, nothing added. The figures are the
//! reason for what `servo::drivers::flash` adds.

use super::flash::{Flash, PowerLost, WAYS};
use super::suite::Tally;
use embedded_storage::nor_flash::{NorFlash as Blocking, ReadNorFlash as BlockingRead};
use embedded_storage_async::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use rayon::prelude::*;
use sequential_storage::cache::Cache;
use sequential_storage::map::{MapConfig, MapStorage};
use servo::store::RECORD_LEN;
use std::task::{Context, Poll, Waker};

/// The mock flash behind the asynchronous traits.
#[derive(Clone)]
struct Asynchronous<const SECTOR: usize>(Flash<SECTOR>);

impl<const SECTOR: usize> ErrorType for Asynchronous<SECTOR> {
    type Error = PowerLost;
}

impl<const SECTOR: usize> ReadNorFlash for Asynchronous<SECTOR> {
    const READ_SIZE: usize = 4;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), PowerLost> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<const SECTOR: usize> NorFlash for Asynchronous<SECTOR> {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = SECTOR;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), PowerLost> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), PowerLost> {
        // The library programs over what it takes for blank, which our rules forbid: real flash then keeps the zeros.
        self.0.write_over(offset, bytes)
    }
}

fn ready<T>(future: impl Future<Output = T>) -> T {
    match std::pin::pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => value,
        Poll::Pending => unreachable!("the mock flash never waits"),
    }
}

type Value = [u8; RECORD_LEN - 12];

fn map<const SECTOR: usize>(
    flash: &mut Asynchronous<SECTOR>,
) -> MapStorage<u8, &mut Asynchronous<SECTOR>, impl sequential_storage::cache::CacheImpl<u8>> {
    MapStorage::new(flash, MapConfig::new(0..2 * SECTOR as u32), Cache::new_uncached())
}

fn save<const SECTOR: usize>(flash: &mut Asynchronous<SECTOR>, value: u8) -> bool {
    let mut buffer = [0; RECORD_LEN];
    let bytes: Value = [value; RECORD_LEN - 12];
    ready(map(flash).store_item(&mut buffer, &0, &&bytes[..])).is_ok()
}

fn load<const SECTOR: usize>(flash: &mut Asynchronous<SECTOR>) -> Option<u8> {
    let mut buffer = [0; RECORD_LEN];
    let value: Option<&[u8]> = ready(map(flash).fetch_item(&mut buffer, &0)).ok().flatten();
    value.map(|bytes| bytes[0])
}

/// Cuts all operations of one plain save, or all of the first one that erases, in all ways, `seeds` times each.
pub fn cut_everywhere<const SECTOR: usize>(with_erase: bool, seeds: u64) -> Tally {
    let (flash, saves, whole) = before_save::<SECTOR>(with_erase);
    cut_at(&flash, saves, (0..whole.0.operations - flash.0.operations).collect(), seeds)
}

/// Cuts the erase alone.
pub fn cut_erase<const SECTOR: usize>(seeds: u64) -> Tally {
    let (flash, saves, whole) = before_save::<SECTOR>(true);
    let erase = whole.0.erasures.iter().map(|at| at - flash.0.operations).collect();
    cut_at(&flash, saves, erase, seeds)
}

/// The flash before such a save, the value on it, and the flash after.
fn before_save<const SECTOR: usize>(with_erase: bool) -> (Asynchronous<SECTOR>, u8, Asynchronous<SECTOR>) {
    let mut flash = Asynchronous(Flash::<SECTOR>::new(1));
    for value in 1..100 {
        assert!(save(&mut flash, value));
        let mut whole = flash.clone();
        assert!(save(&mut whole, 202));
        if !with_erase || !whole.0.erasures.is_empty() {
            return (flash, value, whole);
        }
    }
    unreachable!("a hundred saves fill a sector");
}

fn cut_at<const SECTOR: usize>(
    flash: &Asynchronous<SECTOR>,
    saves: u8,
    operations: Vec<u64>,
    seeds: u64,
) -> Tally {
    operations
        .into_par_iter()
        .flat_map_iter(|operation| (0..WAYS).map(move |way| (operation, way)))
        .flat_map_iter(|(operation, way)| (0..seeds).map(move |seed| (operation, way, seed)))
        .map(|(operation, way, seed)| {
            let mut flash = flash.clone();
            flash.0.cut(operation, way, seed + 100_000 * way + 1_000_000 * operation);
            save(&mut flash, 202);
            flash.0.reboot();
            judge(&mut flash, saves)
        })
        .reduce(Tally::default, Tally::plus)
}

fn judge<const SECTOR: usize>(flash: &mut Asynchronous<SECTOR>, old: u8) -> Tally {
    let read = load(flash);
    let steady = (0..3).all(|_| load(flash) == read);
    let saved = save(flash, 77);
    let back = (0..3).all(|_| load(flash) == Some(77));
    Tally {
        cuts: 1,
        old: u64::from(read == Some(old)),
        new: u64::from(read == Some(202)),
        neither: u64::from(read.is_none()),
        third: u64::from(read.is_some_and(|read| read != old && read != 202)),
        changed: u64::from(!steady),
        stuck: u64::from(!(saved && back)),
    }
}
