//! The extended model: the model file as the user wrote it, comments and all, with every accepted effect under
//! `[known.<effect>]` and every base parameter moved by the shift that the data ask for within its tolerance.

use super::Exporter;
use anyhow::{Context, Result, anyhow};
use toml_edit::{Array, DocumentMut, Item, Table, Value, value};
use truing_core::outcome::volts;
use truing_core::outcome::{NamedEffect, Outcome, Shift, Tie, UnnamedTerm, Verdict};
use truing_core::system::model::{ACTS, NAMED, OVER, STANDING, STANDSTILL, VALUES, VALUES_STD};

/// Sections that hold base parameters.
const BASE_SECTIONS: [&str; 2] = ["motor", "model"];

/// Writes the extended model.
pub struct ModelFile<'a> {
    /// The text of the model that was analysed.
    pub original: &'a str,
    /// Where the effects come from, e.g. the name of the log.
    pub origin: &'a str,
}

impl Exporter for ModelFile<'_> {
    fn export(&self, outcome: &Outcome) -> Result<String> {
        let mut document: DocumentMut = self.original.parse().context("the model is not valid TOML")?;
        for shift in &outcome.within_tolerance {
            apply(&mut document, shift);
        }
        let known = document.entry("known").or_insert_with(implicit_table);
        let known = known
            .as_table_mut()
            .ok_or_else(|| anyhow!("model: `known` is not a table; write [known.<effect>]"))?;
        let mut add = |name: &str, mut table: Table, standing: &str| {
            table.insert("origin", value(self.origin));
            table.insert(STANDING, value(standing));
            known.insert(name, Item::Table(table));
        };
        for effect in &outcome.effects {
            add(&effect.name, table(effect), standing(outcome, &effect.name));
        }
        if let Some(term) = &outcome.unexplained.unnamed {
            add(&term.name, unnamed(term), "unnamed");
        }
        Ok(document.to_string())
    }
}

/// A term without a name: variables, knots, values with their standard deviations. Outside its knots it is constant.
fn unnamed(term: &UnnamedTerm) -> Table {
    let mut table = Table::new();
    table.insert(OVER, value(term.over.iter().copied().collect::<Array>()));
    table.insert(ACTS, value(term.acts));
    table.insert(STANDSTILL, value(term.standstill_speed));
    for ((variable, knots), unit) in term.over.iter().zip(&term.knots).zip(&term.knot_units) {
        table.insert(variable, numbers(knots.iter().copied(), unit));
    }
    table.insert(VALUES, numbers(term.values.iter().copied(), &term.unit));
    if let Some(stds) = term.values_std.iter().copied().collect::<Option<Vec<f64>>>() {
        table.insert(VALUES_STD, numbers(stds.into_iter(), &term.unit));
    }
    table
}

fn table(effect: &NamedEffect) -> Table {
    let mut table = Table::new();
    for (name, v) in &effect.parameters {
        let mut number = value(v.value);
        if let Some((name, volts)) = volts::of(effect, name) {
            comment(&mut number, &format!("{name}: {}", super::format::value(volts)));
        }
        table.insert(name, number);
        if let Some(std) = v.std.filter(|s| s.is_finite()) {
            table.insert(&format!("{name}_std"), value(std));
        }
    }
    table
}

/// How sure the name is: `named`, `tie` (other names explain the data, too) or `unexplained` (something else is left).
fn standing(outcome: &Outcome, name: &str) -> &'static str {
    let in_doubt = |tie: &Tie| {
        let has = |rival: &Vec<String>| rival.iter().any(|other| other == name);
        tie.rivals.iter().any(has) && !tie.rivals.iter().all(has)
    };
    match outcome.verdict {
        Verdict::Unexplained | Verdict::InsufficientExcitation | Verdict::Data => "unexplained",
        _ if outcome.ties.iter().any(in_doubt) => "tie",
        _ => NAMED,
    }
}

/// An array with its unit behind it.
fn numbers(numbers: impl Iterator<Item = f64>, unit: &str) -> Item {
    let mut array =
        value(numbers.map(|number| truing_core::text::figures::rounded(number, 5)).collect::<Array>());
    if let Some(array) = array.as_value_mut().filter(|_| unit != "1") {
        array.decor_mut().set_suffix(format!(" # {unit}"));
    }
    array
}

/// Behind a torque that is none: a reader of the file sees what it stands for.
fn comment(number: &mut Item, text: &str) {
    if let Some(number) = number.as_value_mut() {
        number.decor_mut().set_suffix(format!(" # stands for {text}"));
    }
}

/// `[known]` itself has no keys, so its heading is not written.
fn implicit_table() -> Item {
    let mut table = Table::new();
    table.set_implicit(true);
    Item::Table(table)
}

/// Moves a base parameter; a name that is no key of the file has nothing to move.
fn apply(document: &mut DocumentMut, shift: &Shift) {
    for section in BASE_SECTIONS {
        let entry =
            document.get_mut(section).and_then(|s| s.get_mut(&shift.parameter)).and_then(Item::as_value_mut);
        if let Some(entry) = entry {
            scale(entry, 1.0 + shift.shift_percent / 100.0);
        }
    }
}

/// Scales a number in place; the comment behind it stays.
fn scale(entry: &mut Value, factor: f64) {
    let Some(number) = entry.as_float().or(entry.as_integer().map(|i| i as f64)) else {
        return;
    };
    let decor = entry.decor().clone();
    *entry = Value::from(number * factor);
    *entry.decor_mut() = decor;
}
