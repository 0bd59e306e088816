//! What is cut is read up to the cut, what is broken is told with its place, and nothing stops the program.

mod files;
#[path = "files/spoil.rs"]
mod spoil;

use cap::Cap;
use files::{cells, contents, names, table, taker};
use spoil::{Random, spoiled};
use std::alloc::System;
use std::time::{Duration, Instant};

/// More than this is not given: a length in a broken file is no reason for it.
const MOST_BYTES: usize = 512 << 20;
/// Files of a few kilobytes.
const LONGEST: Duration = Duration::from_secs(5);
/// Broken copies of each file.
const COPIES: u64 = 150;

#[global_allocator]
static ALLOCATOR: Cap<System> = Cap::new(System, MOST_BYTES);

#[test]
fn broken_bytes_are_read_or_refused_with_a_sentence() {
    for name in names() {
        let (source, bytes) = (taker(&name).unwrap(), contents(&name));
        for seed in 0..COPIES {
            let copy = spoiled(&bytes, &mut Random(seed));
            let begun = Instant::now();
            match table(source, &name, &copy) {
                Ok(cells) => {
                    assert_eq!(cells.header.len(), cells.columns.len(), "{name}, {seed}");
                    assert!(
                        cells.columns.iter().all(|column| column.values.len() == cells.rows),
                        "{name}, {seed}"
                    );
                }
                Err(said) => {
                    assert!(said.starts_with(&name) && said.len() > name.len() + 10, "{name}, {seed}: {said}")
                }
            }
            assert!(begun.elapsed() < LONGEST, "{name}, {seed}");
        }
    }
}

/// How many rows the first part of a file has, and what is said of it.
fn cut(name: &str, share: f64) -> Result<(usize, String), String> {
    let bytes = contents(name);
    let to = (share * bytes.len() as f64) as usize;
    let cells = table(taker(name).unwrap(), name, &bytes[..to])?;
    Ok((cells.rows, cells.told.unwrap()))
}

#[test]
fn what_stands_before_a_cut_is_read() {
    for name in
        ["rig.mcap", "mixed.mcap", "json.mcap", "rig.ulg", "rig.wpilog", "lerobot.arrows", "lerobot.feather"]
    {
        let all = cells(name).rows;
        // A recording ends with an index.
        let share = if name.ends_with(".mcap") { 0.35 } else { 0.6 };
        let (rows, told) = cut(name, share).unwrap_or_else(|said| panic!("{said}"));
        assert!(rows > all / 4 && rows < all, "{name}: {rows} of {all} rows");
        assert!(told.contains("cut") && told.contains("what stands before it is read"), "{name}: {told}");
        assert!(told.contains("byte ") || told.contains("row "), "{name}: {told}");
    }
    let (rows, told) = cut("motors.mat", 0.5).unwrap();
    assert_eq!(rows, 50);
    assert!(told.contains("is cut in the variable at byte"), "{told}");
}

#[test]
fn what_is_cut_before_its_table_of_contents_is_refused_with_the_byte() {
    let said = cut("rig.parquet", 0.9).unwrap_err();
    assert!(said.contains("rig.parquet, byte ") && said.contains("is cut"), "{said}");
    let said = cut("rig73.mat", 0.5).unwrap_err();
    assert!(said.contains("save it with -v7"), "{said}");
}

#[test]
fn a_chunk_that_fails_its_checksum_is_left_out() {
    let name = "mixed.mcap";
    let mut bytes = contents(name);
    let at = bytes.len() / 2;
    bytes[at] ^= 0x10;
    let cells = table(taker(name).unwrap(), name, &bytes).unwrap();
    let told = cells.told.unwrap();
    assert!(told.contains("checksum") && told.contains("what stands before it is read"), "{told}");
}

#[test]
fn an_empty_recording_is_refused() {
    for (name, length) in [("rig.mcap", 8), ("rig.ulg", 16), ("rig.wpilog", 12), ("rig.mat", 128)] {
        let said = table(taker(name).unwrap(), name, &contents(name)[..length]).unwrap_err();
        assert!(said.starts_with(name), "{said}");
    }
}
