//! Steady-state tables: what is missing in a model that has to explain settled speeds.
//!
//! ```text
//! table → steady map of the model → residual → search → ties and rivals → verdict
//! ```
//!
//! A table shows no dynamics, so many names explain it equally; the verdict then is a tie, with the experiment over time
//! that separates the names.

mod acceptance;
mod candidates;
mod case;
mod fit;
pub mod map;
mod named;
mod plots;
mod rivals;
pub(in crate::gap) mod rows;
mod search;
mod separate;
mod sets;
mod settled;
mod speed_unit;
mod study;
mod table;
mod ties;
mod verdict;
mod words;

use crate::outcome::Outcome;
use crate::system::log::Table;
use crate::system::model::{Kind, Model};
use candidates::Offer;
use case::Case;
use rows::Rows;
use sets::Search;
pub use settled::{Answers, answers, left_if_settled, settled};
use study::HeldOut;

/// Compares a model with a table of settled speeds. Without `holdouts` every second row is held out (every third of a
/// short table); the parameters that are reported come from all rows. `without`: names of effects that are not offered.
pub fn run(model: &Model, log: &Table, holdouts: &[Table], without: &[String]) -> Outcome {
    analysed(model, log, holdouts, without).unwrap_or_else(|reason| verdict::insufficient(log, reason))
}

/// The result, or why nothing can be tested.
fn analysed(model: &Model, log: &Table, holdouts: &[Table], without: &[String]) -> Result<Outcome, String> {
    table::rich_enough(log)?;
    if matches!(model.kind, Kind::Inertia { .. }) {
        return Err("a table of voltages needs a model with a winding: dc_motor or first_order".into());
    }
    let rows = Rows::of(log, model, !holdouts.is_empty());
    let search = Search { offer: &Offer::new(model, &rows, without), rows: &rows, model };
    let found =
        search.run().ok_or("the model has no steady speed for these voltages; check its parameters")?;
    let case = Case {
        log,
        search,
        given: &map::visible(model),
        held_out: &held_out(&rows, holdouts),
        separate_files: !holdouts.is_empty(),
    };
    Ok(case.outcome(&search.canonical(found)))
}

fn held_out<'a>(rows: &'a Rows, holdouts: &'a [Table]) -> HeldOut<'a> {
    let own = || rows.fitted.iter().map(|fitted| !fitted).collect();
    let file = |table: &'a Table| (&table.u_v[..], &table.omega_rad_s[..], vec![true; table.u_v.len()]);
    let sweeps = match holdouts {
        [] => vec![(&rows.volts[..], &rows.omega[..], own())],
        files => files.iter().map(file).collect(),
    };
    HeldOut { sweeps }
}

/// Time constant of the model with the effects that it contains, s.
pub fn time_constant_s(model: &Model) -> f64 {
    map::visible(model).time_constant_s()
}
