//! Long logs: the search runs on stretches of them, and the report says on which part.

use trials::case_files::{Opened, opened};
use truing::gap::{self, Options};
use truing::outcome::{Outcome, Verdict};
use truing::report::{Exporter, html::Html, json::Json, terminal::Terminal};
use truing::synthetic::cases::{Set, Spec, draw};

/// A drawn case with so many rows, analysed.
fn analysed(seed: u32, rows: usize) -> Outcome {
    let Opened { model, log, holdout } =
        opened(&draw(&Spec { rows, ..Spec::new(Set::Single) }, seed)).unwrap();
    gap::run(&model, &log, std::slice::from_ref(&holdout), &Options::default(), &|_| {}).unwrap()
}

fn names(outcome: &Outcome) -> Vec<&str> {
    outcome.effects.iter().map(|effect| effect.name.as_str()).collect()
}

#[test]
fn a_long_log_names_the_effect_and_the_report_says_which_part_was_searched() {
    // A dead zone.
    let outcome = analysed(6218, 40_000);
    assert_eq!((outcome.verdict, names(&outcome)), (Verdict::Named, vec!["dead_zone"]));
    let searched = outcome.searched.expect("a long log");
    assert!(searched.rows <= 13_000 && searched.of_rows > 39_000, "{searched:?}");
    assert!((8..40).contains(&searched.stretches), "{searched:?}");
    let h = &outcome.holdout;
    assert!(h.rmse_after < 1.06 * h.noise_floor && h.rmse_before > h.rmse_after, "{h:?}");
    let said =
        format!("on {} of its {} rows, in {} stretches", searched.rows, searched.of_rows, searched.stretches);
    let text = Terminal.export(&outcome).unwrap().split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(text.contains(&said), "{text}");
    assert!(Html { subtitle: "", command: "" }.export(&outcome).unwrap().contains(&said));
    let json: serde_json::Value = serde_json::from_str(&Json.export(&outcome).unwrap()).unwrap();
    assert_eq!(json["searched"]["rows"], searched.rows);
    assert_eq!(json["searched"]["of_rows"], searched.of_rows);
    assert_eq!(json["searched"]["stretches"], searched.stretches);
}

#[test]
fn a_delay_is_told_from_a_lag_in_a_long_log() {
    assert_eq!(names(&analysed(6111, 60_000)), ["transport_delay"]);
}

#[test]
fn a_log_whose_run_is_repeated_takes_its_noise_from_the_repetition_however_long_it_is() {
    // The tacho's ripple is no noise of a smooth signal: only the repetition shows it.
    assert_eq!(names(&analysed(6101, 30_000)), ["sensor_lag"]);
}

#[test]
fn a_short_log_is_searched_as_a_whole_and_its_report_has_no_such_key() {
    let outcome = analysed(6218, 3000);
    assert_eq!(outcome.searched, None);
    assert!(!Json.export(&outcome).unwrap().contains("\"searched\""));
}
