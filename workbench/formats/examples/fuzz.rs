//! Breaks the files of a format at random for some seconds: `cargo run -p truing-formats --example fuzz -- mcap 600`.
//!
//! Prints each case that panics, takes long or asks for much memory; an allocation beyond the cap ends the program.

#[path = "../tests/files/mod.rs"]
mod files;
#[path = "../tests/files/spoil.rs"]
mod spoil;

use cap::Cap;
use files::{contents, names, table, taker};
use spoil::{Random, spoiled};
use std::alloc::System;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::time::{Duration, Instant};

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, 1 << 30);
/// Where panics came from, those inside of libraries included, and how many.
static PANICS: Mutex<BTreeMap<String, usize>> = Mutex::new(BTreeMap::new());

fn main() {
    let words: Vec<String> = std::env::args().collect();
    let [_, format, seconds] = &words[..] else { panic!("fuzz ENDING SECONDS") };
    let lasts = Duration::from_secs(seconds.parse().expect("seconds"));
    let files: Vec<String> = names().into_iter().filter(|name| name.ends_with(format.as_str())).collect();
    // The readers quiet what they catch from their first use on: a hook that is set later sees it all.
    for name in &files {
        let _ = table(taker(name).expect("a format"), name, &contents(name));
    }
    std::panic::set_hook(Box::new(|info| {
        let place = info.location().map_or_else(String::new, ToString::to_string);
        *PANICS.lock().expect("no panic while it is held").entry(place).or_default() += 1;
    }));
    let (begun, mut seed, mut read, mut slowest) = (Instant::now(), 0_u64, 0, Duration::ZERO);
    while begun.elapsed() < lasts {
        for name in &files {
            let copy = spoiled(&contents(name), &mut Random(seed ^ 0x5eed));
            // The case in hand, for what ends the program.
            let at = std::env::temp_dir().join(format!("fuzz_{format}"));
            std::fs::write(&at, &copy).expect("a temporary file");
            let (source, from) = (taker(name).expect("a format"), Instant::now());
            let outcome = catch_unwind(AssertUnwindSafe(|| table(source, name, &copy)));
            slowest = slowest.max(from.elapsed());
            match outcome {
                Ok(table) => read += usize::from(table.is_ok()),
                Err(_) => println!("{name}, seed {seed}: a panic got out"),
            }
            if from.elapsed() > Duration::from_secs(2) {
                println!("{name}, seed {seed}: {:?}", from.elapsed());
            }
        }
        seed += 1;
    }
    let cases = seed as usize * files.len();
    println!("{format}: {cases} cases, {read} read, slowest {slowest:?}");
    for (place, count) in &*PANICS.lock().expect("no panic while it is held") {
        println!("{format}: {count} panics at {place}");
    }
}
