//! The paper's servo model, its claims, and the data files that they are computed from.

use truing::proving::commands::paper;
use truing::report::section::{Check, Section};

fn failing(section: &Section) -> Vec<&Check> {
    section.checks.iter().filter(|c| !c.holds).collect()
}

#[test]
fn the_servo_model_shows_the_figures_that_closed_forms_demand() {
    let servo = paper::servo();
    assert!(failing(&servo).is_empty(), "{:#?}", failing(&servo));
    assert!(servo.checks.len() >= 13, "peaks, crossings, speeds");
    let found = |claim: &str| &servo.checks.iter().find(|c| c.claim.contains(claim)).expect(claim).found;
    assert_eq!(found("9 V sine, behind"), "7.8 V");
    assert_eq!(found("9 V step, behind"), "7.8 V");
    assert_eq!(found("Table 3.2's own 10 V"), "8.8 V");
}

#[test]
fn three_scopes_are_drawn_for_every_input() {
    let servo = paper::servo();
    assert_eq!(servo.plots.len(), 6, "three inputs, a plot of the voltages and one of the speed each");
    for pair in servo.plots.chunks(2) {
        let labels: Vec<&str> = pair.iter().flat_map(|p| &p.series).map(|s| s.label.as_str()).collect();
        for scope in ["before the dead zone", "behind the dead zone", "speed"] {
            assert!(labels.contains(&scope), "{labels:?}");
        }
    }
}

#[test]
fn a_zone_of_another_width_fails_the_checks() {
    // The checks must be able to fail: without the dead zone 9 V stay 9 V.
    let plain = paper::motor().physics();
    let scopes = paper::Scopes::run(&plain, |t| 9.0 * (6.0 * t).sin(), 2.0);
    assert!((scopes.peak_behind() - (9.0 - paper::DEAD_ZONE_V)).abs() > 1.0);
}

#[test]
fn the_contradictions_are_found_from_the_tables() {
    let claims = paper::claims();
    let check = |part: &str| claims.checks.iter().find(|c| c.claim.contains(part)).expect(part);
    assert!(check("saturates at 1547 rpm").holds);
    for wrong in [
        "parameters describe",
        "shows a dead zone",
        "in a dead zone",
        "9 V and 6 rad/s",
        "at once",
        "tell a dead zone",
    ] {
        assert!(!check(wrong).holds, "{wrong}: {}", check(wrong).found);
    }
    assert!(check("parameters describe").found.contains("98.79 rpm/V from the parameters, 225.6 rpm/V"));
    assert!(
        check("9 V and 6 rad/s").found.contains("10.0 V · sin(1.000 t − 0.200), rms deviation 0.04 V"),
        "{:?}",
        check("9 V and 6")
    );
    assert!(check("at once").found.contains("2.0 V there, and 9.0 V from 1.0 s"), "{:?}", check("at once"));
    assert!(check("saturates").found.contains("6.79 V"));
    assert!(check("shows a dead zone").found.contains("-0.06 V"), "{:?}", check("shows a dead zone"));
    let table: String = claims.tables[0].rows.concat().join(" ");
    for figure in [
        "10.34 rad/s/V",
        "14.6",
        "worst 7.9",
        "229.3 rpm/V",
        "residual 7.885 rpm",
        "-0.456 and -4.106",
        "rms residual 2.672 rpm",
    ] {
        assert!(table.contains(figure), "{figure} in {table}");
    }
}
