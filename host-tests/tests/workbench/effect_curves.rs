//! What the report says and draws of a named effect: its curve in its own variable, where it shows, and its two sides.

use super::unnamed_term::{analysed, motor, nominal, recorded};
use truing::outcome::{NamedEffect, Outcome, Role};
use truing::synthetic::reference_plant::Motor;

/// The first name of what such a motor lacks of the data sheet.
fn told(hidden: &Motor, seed: u64) -> (Outcome, NamedEffect) {
    let outcome = analysed(&nominal(), &recorded(hidden, seed), &recorded(hidden, seed + 1));
    let first = outcome.effects.first().cloned().unwrap_or_else(|| panic!("{:?}", outcome.unexplained));
    (outcome, first)
}

/// The numbers in a sentence.
fn numbers(text: &str) -> Vec<f64> {
    let number = |c: char| !(c.is_ascii_digit() || c == '.' || c == '-');
    text.split(number).filter_map(|word| word.trim_end_matches('.').parse().ok()).collect()
}

#[test]
fn the_curve_of_a_dead_zone_goes_through_what_was_measured() {
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [1.5, 1.5];
    let (outcome, effect) = told(&hidden, 81);
    assert_eq!(effect.name, "dead_zone");
    let place = numbers(&effect.place.expect("it shows at small inputs"));
    assert!(place.len() == 2 && place.iter().all(|edge| (edge.abs() - 1.5).abs() < 0.05), "{place:?}");
    let plot = outcome.plots.iter().find(|plot| plot.title == "The curve of dead_zone").expect("it is drawn");
    let measured = plot.series.iter().find(|series| series.role == Some(Role::Measured)).expect("points");
    let acts = |u: f64| u.signum() * (u.abs() - 1.5).max(0.0);
    let (curve, points) = (&measured.curve, measured.curve.x.len());
    let near = curve.x.iter().zip(&curve.y).filter(|(x, y)| (acts(**x) - **y).abs() < 0.3).count();
    assert!(points > 30 && near * 10 >= points * 9, "{near} of {points}: {curve:?}");
}

#[test]
fn two_sides_that_hardly_differ_are_one_name_with_two_numbers() {
    let mut hidden = motor();
    hidden.drive.dead_zone_v = [1.48, 1.52];
    let (_, effect) = told(&hidden, 83);
    assert_eq!(effect.name, "dead_zone");
    let (_, sides) = effect.evidence.split_once("its two sides are").expect(&effect.evidence);
    let sides = numbers(sides);
    assert!((sides[0] - 1.48).abs() < 0.03 && (sides[1] - 1.52).abs() < 0.03, "{}", effect.evidence);
}
