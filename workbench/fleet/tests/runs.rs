//! Runs of a fleet: interrupted, with several workers, with a log that comes in late.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs;
use std::path::{Path, PathBuf};
use truing_core::system::effects::{COULOMB_FRICTION, INERTIA};
use truing_fleet::generator::{Fate, Fleet};
use truing_fleet::ingest::{self, Summary};
use truing_fleet::manifest;
use truing_fleet::store::Store;

const SHEET: &str = "schema = \"truing-model/1\"\n[model]\nkind = \"first_order\"\ngain_rad_s_per_v = 10.0\ntime_constant_s = 0.1\n\
                     [supply]\nnominal_v = 12.0\n";

/// Settled speeds of a motor that stands below some volts: a log that is judged in milliseconds.
fn table(unit: u32, day: u32) -> String {
    let edge = 0.8 + 0.1 * f64::from(unit);
    let mut rows = String::from("u_v,omega_rad_s\n");
    for tenth in (-100..=100_i32).step_by(5) {
        let volts = f64::from(tenth) / 10.0;
        let jitter = f64::from((tenth * 7 + 3 * day as i32 + unit as i32).rem_euclid(11)) - 5.0;
        let speed = 10.0 * volts.signum() * (volts.abs() - edge).max(0.0) + 0.02 * jitter;
        writeln!(rows, "{volts},{speed}").unwrap();
    }
    rows
}

/// A fleet of tables in a folder: five units, three days.
fn tables(folder: &Path) -> PathBuf {
    fs::write(folder.join("sheet.toml"), SHEET).unwrap();
    let mut rows = String::from("unit,time,model,log\n");
    for (unit, day) in (1..=5).flat_map(|unit| (1..=3).map(move |day| (unit, day))) {
        fs::write(folder.join(format!("{unit}-{day}.csv")), table(unit, day)).unwrap();
        writeln!(rows, "u{unit},2026-03-0{day},sheet.toml,{unit}-{day}.csv").unwrap();
    }
    let path = folder.join("manifest.csv");
    fs::write(&path, rows).unwrap();
    path
}

fn ingested(manifest: &Path, into: &Path, workers: usize) -> Summary {
    ingest::run(&manifest::read(manifest).unwrap(), &Store::new(into), workers, &|_, _| ()).unwrap()
}

/// Every file below a folder with its bytes.
fn bytes(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => all.extend(
                bytes(&path)
                    .into_iter()
                    .map(|(name, bytes)| (Path::new(path.file_name().unwrap()).join(name), bytes)),
            ),
            false => drop(all.insert(path.file_name().unwrap().into(), fs::read(&path).unwrap())),
        }
    }
    all
}

#[test]
fn one_two_and_four_workers_write_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = tables(folder.path());
    let of = |workers: usize| {
        let into = folder.path().join(format!("by-{workers}"));
        let summary = ingested(&manifest, &into, workers);
        assert_eq!((summary.written(), summary.failed), (15, vec![]));
        bytes(&into)
    };
    let one = of(1);
    // A result a log, and one model file.
    assert_eq!(one.len(), 16);
    assert_eq!(one, of(2));
    assert_eq!(one, of(4));
}

#[test]
fn an_interrupted_run_goes_on_and_ends_with_the_bytes_of_one_that_was_not() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = tables(folder.path());
    let (whole, broken) = (folder.path().join("whole"), folder.path().join("broken"));
    ingested(&manifest, &whole, 2);
    // What a kill leaves: some results, each complete, and a draft under another name.
    let mut units = manifest::read(&manifest).unwrap();
    units.truncate(3);
    units[2].truncate(1);
    ingest::run(&units, &Store::new(&broken), 1, &|_, _| ()).unwrap();
    fs::write(broken.join("units/u3/.truing-draft"), "{ \"schema\"").unwrap();
    let summary = ingested(&manifest, &broken, 2);
    assert_eq!((summary.there, summary.written(), summary.failed), (7, 8, vec![]));
    fs::remove_file(broken.join("units/u3/.truing-draft")).unwrap();
    assert_eq!(bytes(&broken), bytes(&whole));
    assert_eq!(ingested(&manifest, &broken, 2).there, 15);
}

#[test]
fn a_log_that_comes_in_late_changes_what_follows_it_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = tables(folder.path());
    let (whole, late) = (folder.path().join("whole"), folder.path().join("late"));
    ingested(&manifest, &whole, 1);
    let mut units = manifest::read(&manifest).unwrap();
    units[1].remove(1);
    ingest::run(&units, &Store::new(&late), 1, &|_, _| ()).unwrap();
    let summary = ingested(&manifest, &late, 1);
    // The late one and the day behind it.
    assert_eq!((summary.there, summary.written()), (13, 2));
    assert_eq!(bytes(&late), bytes(&whole));
}

#[test]
fn a_log_that_fails_is_told_and_keeps_no_other_from_being_judged() {
    let folder = tempfile::tempdir().unwrap();
    let manifest = tables(folder.path());
    fs::write(folder.path().join("2-3.csv"), "u_v,omega_rad_s\n1,two\n").unwrap();
    fs::copy(folder.path().join("4-1.csv"), folder.path().join("4-2.csv")).unwrap();
    let summary = ingested(&manifest, &folder.path().join("into"), 2);
    assert_eq!(summary.written(), 13);
    assert!(
        summary.failed[0].starts_with("u2 at 2026-03-03") && summary.failed[0].contains("2-3.csv"),
        "{summary:?}"
    );
    assert!(summary.failed[1].contains("unit u4 has this log already, at 2026-03-01"), "{summary:?}");
}

#[test]
fn a_motor_that_stays_as_it_is_is_searched_once() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = Fleet::draw(3, 3, 800);
    fleet.write(folder.path(), &[Fate::Quiet]).unwrap();
    let into = folder.path().join("into");
    let summary = ingested(&folder.path().join("manifest.csv"), &into, 2);
    assert_eq!((summary.searched, summary.unchanged, summary.failed), (1, 2, vec![]));
    let (_, results) = &Store::new(&into).all().unwrap()[0];
    let names: Vec<Vec<&str>> = results.iter().map(|kept| kept.outcome.names()).collect();
    assert_eq!(names, [["coulomb_friction"]; 3]);
    let sharp = |kept: &truing_fleet::store::Kept| {
        let number = &kept.outcome.effects[0].parameters["level_nm"];
        number.std.unwrap() < 0.2 * number.value.unwrap()
    };
    assert!(results.iter().all(sharp), "{results:?}");
    assert_eq!(results.iter().map(|kept| kept.unchanged).collect::<Vec<bool>>(), [false, true, true]);
}

#[test]
fn a_new_effect_that_hides_in_the_tolerances_of_the_data_sheet_moves_its_numbers_and_is_searched_for() {
    let folder = tempfile::tempdir().unwrap();
    let fleet = Fleet::draw(1, 6, 900);
    // An inertia of 0.86 times that of the sheet: friction alone explains the log, with another motor constant.
    let Fate::Gets(effect, values, _) = fleet.new_effect(3, 12) else { panic!("no effect was drawn") };
    let fates = [Fate::Quiet, Fate::Quiet, Fate::Gets(effect, values, 4)];
    fleet.write(folder.path(), &fates).unwrap();
    let units = manifest::read(&folder.path().join("manifest.csv")).unwrap();
    let store = Store::new(&folder.path().join("into"));
    ingest::run(&units[2..], &store, 1, &|_, _| ()).unwrap();
    let (_, results) = &store.all().unwrap()[0];
    let names: Vec<Vec<&str>> = results.iter().map(|kept| kept.outcome.names()).collect();
    let (old, new) = (vec![COULOMB_FRICTION.name], vec![COULOMB_FRICTION.name, INERTIA.name]);
    assert_eq!(names, [&old, &old, &old, &old, &new, &new].map(Clone::clone));
    assert_eq!(
        results.iter().map(|kept| kept.unchanged).collect::<Vec<bool>>(),
        [false, true, true, true, false, true]
    );
}
