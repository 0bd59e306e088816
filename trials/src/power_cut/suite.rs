//! Every operation of a save, an update and an erase is interrupted once, in every way, several times.

use super::flash::{Flash, WAYS};
use super::sets::{SetLayout1, migrated, set};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use servo::axis::Bridge;
use servo::drivers::flash::ParameterFlash;
use servo::store::SaveError;
use servo::store::{AtRest, Loaded, StoredParameters};

/// The store on a flash of two sectors.
pub type Store<const SECTOR: usize> = ParameterFlash<Flash<SECTOR>>;

/// What was read after the cuts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tally {
    /// Power cuts.
    pub cuts: u64,
    /// The set of before was read.
    pub old: u64,
    /// The set that was being written was read.
    pub new: u64,
    /// Neither was read although there was an old one: a loss.
    pub neither: u64,
    /// A set of longer ago was read: a loss.
    pub third: u64,
    /// A later power-up read something else: a loss.
    pub changed: u64,
    /// The next save failed or could not be read back: a loss.
    pub stuck: u64,
}

impl Tally {
    /// All that must be zero.
    pub fn losses(&self) -> u64 {
        self.neither + self.third + self.changed + self.stuck
    }

    /// Sum, field by field.
    pub fn plus(self, other: Tally) -> Tally {
        Tally {
            cuts: self.cuts + other.cuts,
            old: self.old + other.old,
            new: self.new + other.new,
            neither: self.neither + other.neither,
            third: self.third + other.third,
            changed: self.changed + other.changed,
            stuck: self.stuck + other.stuck,
        }
    }
}

/// What is interrupted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Situation {
    /// The first save ever: erase and write on a factory-new flash.
    First,
    /// The first save after power-up.
    AfterPowerUp,
    /// Another save in the same session.
    SameSession,
    /// The sector is full: erase of the other sector, then save. The other one was never used.
    SectorChange,
    /// The same with a second sector full of older sets.
    SectorChangeBack,
    /// An older image's set is read, migrated and saved.
    Update,
}

impl Situation {
    /// All of them.
    pub const ALL: [Situation; 6] = [
        Situation::First,
        Situation::AfterPowerUp,
        Situation::SameSession,
        Situation::SectorChange,
        Situation::SectorChangeBack,
        Situation::Update,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Situation::First => "first save ever (erase + save)",
            Situation::AfterPowerUp => "save after power-up",
            Situation::SameSession => "further save",
            Situation::SectorChange => "sector full: erase + save",
            Situation::SectorChangeBack => "sector full, other one full of old sets: erase + save",
            Situation::Update => "update: older layout migrated and saved",
        }
    }

    /// The flash before, and the set that is on it.
    fn prepare<const SECTOR: usize>(self) -> (Flash<SECTOR>, Option<StoredParameters>) {
        let slots = Store::<SECTOR>::SLOTS;
        let mut store = Store::new(Flash::new(1), 0);
        let saves = match self {
            Situation::First | Situation::Update => 0,
            Situation::AfterPowerUp | Situation::SameSession => 2,
            Situation::SectorChange => slots,
            Situation::SectorChangeBack => 2 * slots,
        };
        store.load();
        for number in 0..saves {
            save(&mut store, &set(number)).expect("saves without a power cut");
        }
        let old = match self {
            Situation::Update => Some(store_layout_1(&mut store)),
            _ => saves.checked_sub(1).map(set),
        };
        (store.flash().clone(), old)
    }
}

/// What an older image leaves: a set of layout 1, after one erase.
fn store_layout_1<const SECTOR: usize>(store: &mut Store<SECTOR>) -> StoredParameters {
    let old = set(2);
    store.erase(at_rest()).expect("erases");
    store.save_as(&SetLayout1::of(&old), 1, at_rest()).expect("saves");
    migrated(&old)
}

fn at_rest() -> AtRest {
    AtRest::check(Bridge::Open, true).expect("open and standing is at rest")
}

/// Saves, with the erase when it is needed.
pub fn save<const SECTOR: usize>(store: &mut Store<SECTOR>, set: &StoredParameters) -> Result<(), SaveError> {
    match store.save(set, at_rest()) {
        Err(SaveError::EraseNeeded) => {
            store.erase(at_rest())?;
            store.save(set, at_rest())
        }
        result => result,
    }
}

/// The set of a load.
pub fn loaded<const SECTOR: usize>(store: &mut Store<SECTOR>) -> Option<StoredParameters> {
    match store.load() {
        Loaded::Set { parameters, .. } => Some(parameters),
        _ => None,
    }
}

/// The session that is interrupted: power-up, then one save (or two, of which the second is interrupted).
fn session<const SECTOR: usize>(
    situation: Situation,
    flash: Flash<SECTOR>,
) -> (Store<SECTOR>, Option<StoredParameters>) {
    let mut store = Store::new(flash, 0);
    let mut old = loaded(&mut store);
    if situation == Situation::SameSession {
        save(&mut store, &set(101)).expect("the first save of the session is not interrupted");
        old = Some(set(101));
    }
    (store, old)
}

const NEW: u32 = 202;
const NEXT: u32 = 303;

/// Flash operations of the save in this situation.
pub fn operations<const SECTOR: usize>(situation: Situation) -> u64 {
    let (flash, _) = situation.prepare::<SECTOR>();
    let (mut store, _) = session(situation, flash);
    let before = store.flash().operations;
    save(&mut store, &set(NEW)).expect("saves without a power cut");
    store.flash().operations - before
}

/// Interrupts every `stride`-th operation in all ways, `seeds` times each.
pub fn cut_everywhere<const SECTOR: usize>(situation: Situation, stride: usize, seeds: u64) -> Tally {
    let operations = 0..operations::<SECTOR>(situation);
    cut_at::<SECTOR>(situation, operations.step_by(stride), seeds)
}

/// Interrupts the erase of a sector change in all ways, `seeds` times each.
pub fn cut_erase<const SECTOR: usize>(seeds: u64) -> Tally {
    cut_at::<SECTOR>(Situation::SectorChangeBack, std::iter::once(0), seeds)
}

fn cut_at<const SECTOR: usize>(
    situation: Situation,
    operations: impl Iterator<Item = u64> + Send,
    seeds: u64,
) -> Tally {
    let (flash, old) = situation.prepare::<SECTOR>();
    operations
        .flat_map(|operation| (0..WAYS).map(move |way| (operation, way)))
        .flat_map(|(operation, way)| (0..seeds).map(move |seed| (operation, way, seed)))
        .par_bridge()
        .map(|(operation, way, seed)| {
            let (mut store, before) = session(situation, flash.clone());
            assert!(before == old || situation == Situation::SameSession, "{situation:?} starts elsewhere");
            let seed = seed + 100_000 * way + 1_000_000 * operation;
            store.flash().cut(operation, way, seed);
            save(&mut store, &set(NEW)).expect_err("the power was cut");
            assert!(store.flash().reboot(), "{situation:?}: operation {operation} did not happen");
            judge(store.flash().clone(), before, set(NEW), seed)
        })
        .reduce(Tally::default, Tally::plus)
}

/// What is read after the cut, at this and at later power-ups; and can the store go on?
fn judge<const SECTOR: usize>(
    flash: Flash<SECTOR>,
    old: Option<StoredParameters>,
    new: StoredParameters,
    seed: u64,
) -> Tally {
    let mut store = Store::new(flash, 0);
    let read = loaded(&mut store);
    let mut tally = verdict(&read, &old, &new);
    let steady = (0..3).all(|_| loaded(&mut Store::new(store.flash().clone(), 0)) == read);
    tally.changed = u64::from(!steady);
    let next = set(NEXT + (seed % 4) as u32);
    let saved = save(&mut store, &next).is_ok();
    let back = (0..3).all(|_| loaded(&mut Store::new(store.flash().clone(), 0)).as_ref() == Some(&next));
    tally.stuck = u64::from(!(saved && back));
    tally
}

fn verdict(read: &Option<StoredParameters>, old: &Option<StoredParameters>, new: &StoredParameters) -> Tally {
    Tally {
        cuts: 1,
        old: u64::from(read == old),
        new: u64::from(read.as_ref() == Some(new)),
        neither: u64::from(read.is_none() && old.is_some()),
        third: u64::from(read.is_some() && read != old && read.as_ref() != Some(new)),
        ..Tally::default()
    }
}

/// A life of power-ups, saves and power cuts in any order, from a flash full of random bits: several cuts in a row hit
/// the same record, also while the store makes final what the cut before left behind.
pub fn life<const SECTOR: usize>(seed: u64, sessions: u32) -> Tally {
    let mut life = Life::<SECTOR>::new(seed);
    for _ in 0..sessions {
        life.power_up(None);
        for _ in 0..life.random.random_range(0..4) {
            life.save();
        }
    }
    life.tally
}

struct Life<const SECTOR: usize> {
    random: ChaCha8Rng,
    store: Store<SECTOR>,
    known: Option<StoredParameters>,
    number: u32,
    tally: Tally,
}

impl<const SECTOR: usize> Life<SECTOR> {
    fn new(seed: u64) -> Self {
        let mut flash = Flash::new(seed);
        flash.scramble(0);
        flash.scramble(1);
        Life {
            random: ChaCha8Rng::seed_from_u64(seed),
            store: Store::new(flash, 0),
            known: None,
            number: 0,
            tally: Tally::default(),
        }
    }

    /// The power is cut somewhere in the next `operations`, or is not.
    fn maybe_cut(&mut self, probability: f64, operations: u64) {
        if self.random.random_bool(probability) {
            let (operation, way) =
                (self.random.random_range(0..operations), self.random.random_range(0..WAYS));
            self.store.flash().cut(operation, way, self.random.random());
        }
    }

    /// Powers up, with cuts in the middle of it, until one load gets through. The set must be the known one, or the
    /// one that was being written when the power went.
    fn power_up(&mut self, writing: Option<StoredParameters>) {
        let read = loop {
            self.store = Store::new(self.store.flash().clone(), 0);
            self.maybe_cut(0.5, 4);
            let read = loaded(&mut self.store);
            if !self.store.flash().reboot() {
                break read;
            }
            self.tally.cuts += 1;
        };
        match writing {
            Some(new) => self.tally = self.tally.plus(verdict(&read, &self.known, &new)),
            None => self.tally.changed += u64::from(read != self.known),
        }
        self.known = read;
    }

    fn save(&mut self) {
        self.number += 1;
        let new = set(self.number);
        self.maybe_cut(0.4, 500);
        let saved = save(&mut self.store, &new);
        if self.store.flash().reboot() {
            return self.power_up(Some(new));
        }
        self.tally.stuck += u64::from(saved.is_err());
        self.known = Some(new);
    }
}
