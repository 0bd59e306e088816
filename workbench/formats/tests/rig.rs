//! A rig's log, written in every format, is the same log as its text: what `truing gap` gets is equal to the bit.

mod files;

use files::{contents, names, taker};
use truing_core::system::log::look::look;
use truing_core::system::log::{Bytes, Columns, Dynamic, Log, reading};
use truing_formats::SOURCES;

fn log(name: &str, columns: &str) -> Dynamic {
    let bytes = contents(name);
    let columns: Columns = columns.parse().unwrap();
    let bytes = Bytes { name, open: &|| Ok(Box::new(bytes.as_slice())), sources: SOURCES };
    match reading(bytes, &columns).unwrap().log {
        Log::Dynamic(record) => record,
        Log::Table(_) => panic!("{name} is read as a table"),
    }
}

/// What has to be said of the columns where names carry the topic.
fn columns(name: &str) -> &'static str {
    match name {
        "rig.mcap" => "u_v='motor/state.u_v',omega_rad_s='motor/state.omega_rad_s'",
        "rig.ulg" => "u_v='motor.u_v',omega_rad_s='motor.omega_rad_s'",
        "rig.json" => "theta_rad=none",
        _ => "",
    }
}

#[test]
fn every_format_gives_the_log_that_the_text_gives() {
    let text = log("rig.csv", "");
    let rigs: Vec<String> =
        names().into_iter().filter(|name| name.starts_with("rig.") || name == "rig73.mat").collect();
    assert_eq!(rigs.len(), 8, "{rigs:?}");
    for name in rigs {
        let ours = log(&name, columns(&name));
        assert_eq!(ours.runs.len(), text.runs.len(), "{name}");
        for (ours, text) in ours.runs.iter().zip(&text.runs) {
            assert!(text.rows() > 50);
            assert_eq!(ours.t_s, text.t_s, "{name}");
            assert_eq!(ours.input, text.input, "{name}");
            assert_eq!(ours.speed, text.speed, "{name}");
        }
    }
}

#[test]
fn every_file_can_be_looked_at() {
    for name in names() {
        let bytes = contents(&name);
        let bytes = Bytes { name: &name, open: &|| Ok(Box::new(bytes.as_slice())), sources: SOURCES };
        let seen = look(bytes, &Columns::default()).unwrap();
        assert!(seen.rows > 1 && seen.columns.len() > 1, "{name}");
    }
}

#[test]
fn a_text_and_plain_json_are_taken_by_no_other_format() {
    assert!(taker("rig.csv").is_none());
    let plain: &[(&str, &[u8])] = &[
        ("log.json", b"{\"t_s\": [0, 1], \"u_v\": [1, 2]}"),
        ("log.csv", b"t_s,u_v,omega_rad_s\n0,1,2\n"),
        ("log.mat", b"t u w\n0 1 2\n"),
        ("log.parquet", b"t_s,u_v\n"),
        ("empty", b""),
    ];
    for (name, head) in plain {
        assert!(!SOURCES.iter().any(|source| source.takes(name, head)), "{name}");
    }
}
