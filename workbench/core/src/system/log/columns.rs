//! Which column of a file is which quantity: by the user's `--columns`, by name, or by name and unit.

use super::cells::Cells;
use super::clock::Form;
use super::column_plan::{INPUTS, OUTPUTS, Origin, Plan, is_column};
use super::extent::{Extent, is_too_fast};
use super::formula::{Formula, Unreadable};
use super::meaning;
use super::mend::Names;
use super::names::{self, Quantity, name_of, quantity_of};
use super::propose::{self, Known};
use super::words::Topic;
use crate::system::model::Model;
use crate::text::input_error::{InputError, nearest};
use std::str::FromStr;

/// A name that stands for the number of the row, from 0, in a file without a time.
pub const ROW: &str = "row";

/// The user's `--columns`: `ours=theirs,…`, the right side a column, an expression over columns or a constant. `ours=none`
/// ignores a column that the file has. Besides, what the model file says of the supply and of the encoder.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Columns {
    mappings: Vec<Mapping>,
    /// Nominal supply, V, for a duty beside which no supply is logged.
    pub supply_v: Option<f64>,
    /// Counts of the encoder per turn, for proposals.
    pub counts_per_rev: Option<f64>,
    /// Time of the first row that is read, s.
    pub from_s: Option<f64>,
    /// Time of the last row that is read, s.
    pub to_s: Option<f64>,
}

#[derive(Clone, Debug, PartialEq)]
struct Mapping {
    ours: String,
    theirs: String,
}

impl FromStr for Columns {
    type Err = InputError;

    fn from_str(text: &str) -> Result<Self, InputError> {
        let items = parted(text).into_iter().map(str::trim).filter(|item| !item.is_empty());
        let mappings: Vec<Mapping> = items.map(mapping).collect::<Result<_, _>>()?;
        let quantity = |mapping: &Mapping| quantity_of(&mapping.ours).map(|known| known.0);
        for (k, mapping) in mappings.iter().enumerate() {
            if let Some(twice) = mappings[..k].iter().find(|other| quantity(other) == quantity(mapping)) {
                return Err(InputError(format!(
                    "--columns, `{}={}`: `{}` holds the same quantity already; choose one",
                    mapping.ours, mapping.theirs, twice.ours
                )));
            }
        }
        Ok(Self { mappings, ..Self::default() })
    }
}

/// The items between commas, those in quotes and in parentheses apart.
fn parted(text: &str) -> Vec<&str> {
    let (mut quote, mut depth) = (None, 0_i32);
    let separates = |c: char| {
        match (quote, c) {
            (Some(open), _) if open == c => quote = None,
            (None, '"' | '\'') => quote = Some(c),
            (None, '(') => depth += 1,
            (None, ')') => depth -= 1,
            _ => {}
        }
        c == ',' && quote.is_none() && depth <= 0
    };
    text.split(separates).collect()
}

fn mapping(item: &str) -> Result<Mapping, InputError> {
    let wrong = |what: String| InputError(format!("--columns, `{item}`: {what}"));
    let (ours, theirs) = item.split_once('=').ok_or_else(|| {
        wrong("write OUR_NAME=FILE_NAME, OUR_NAME=FILE_NAME*FACTOR or OUR_NAME=EXPRESSION".into())
    })?;
    let (ours, theirs) = (ours.trim(), theirs.trim());
    if quantity_of(ours).is_none() {
        return Err(wrong(unknown(ours)));
    }
    if theirs.is_empty() {
        return Err(wrong("nothing stands behind the `=`; write a column, an expression or a number".into()));
    }
    let factor = theirs.rsplit_once('*').and_then(|parts| parts.1.trim().parse::<f64>().ok());
    if factor.is_some_and(|factor| factor == 0.0 || !factor.is_finite()) {
        return Err(wrong("the factor is not a number other than 0".into()));
    }
    Ok(Mapping { ours: ours.to_owned(), theirs: theirs.to_owned() })
}

/// A sentence about a name that no quantity has.
fn unknown(name: &str) -> String {
    let near = nearest(name, names::ours()).map_or(String::new(), |it| format!("; the nearest is `{it}`"));
    format!(
        "`{name}` is no known column{near} (left of = stands a name with its unit, for example t_s, u_v, duty, theta_rad, omega_rad_s)"
    )
}

impl Columns {
    /// Finds every quantity that a file offers, and what lacks. What the user mapped goes before the names in the file, names
    /// of ours before names that state quantity and unit.
    pub fn plan(&self, source: &str, cells: &Cells, output_needed: bool) -> Result<Plan, InputError> {
        let header = &cells.header;
        let meanings = (0..header.len()).map(|k| match cells.columns[k].form {
            Some(Form::Clock { .. }) => Some(meaning::of_time(1.0)),
            _ => meaning::recognise(&header[k], cells.units[k].as_deref()).map(|meaning| {
                meaning.since_1970(|| Extent::of(cells.values(k)).map_or(0.0, |extent| extent.min))
            }),
        });
        let mut plan = Plan { meanings: meanings.collect(), ..Plan::default() };
        for mapping in self.mappings.iter().filter(|mapping| mapping.theirs != "none") {
            plan.origins.push(mapping.origin(source, cells)?);
        }
        self.exact(source, cells, &mut plan)?;
        self.stated(cells, &mut plan);
        let known = Known {
            supply_v: self.supply_v,
            counts_per_rev: self.counts_per_rev,
            time: self.mentions(Quantity::Time),
        };
        propose::complete(&known, cells, &mut plan, output_needed);
        let items = self.mappings.iter().map(|mapping| format!("{}={}", mapping.ours, mapping.theirs));
        let items = items.chain(plan.proposals.iter().map(|proposal| proposal.item.clone()));
        plan.items = items.collect::<Vec<_>>().join(",");
        let typed = self.mappings.iter().map(|mapping| (mapping.ours.clone(), mapping.theirs.clone()));
        let typed: Vec<(String, String)> = typed.collect();
        let mapped = typed.iter().filter(|item| item.1 != "none").count();
        let read = plan.origins.iter().skip(mapped).map(|it| (it.quantity, it.unit, it.name.clone()));
        plan.names = Names::of(typed, read.collect(), header);
        Ok(plan)
    }

    /// The same, of the rows from one time to another, s.
    pub fn cropped(self, from_s: Option<f64>, to_s: Option<f64>) -> Self {
        Self { from_s, to_s, ..self }
    }

    /// The user's text, or what the model file says of the columns, with what it says of supply and encoder.
    pub fn of(text: &str, model: &Model) -> Result<Self, InputError> {
        let counts_per_rev = model.encoder.map(|encoder| encoder.counts_per_rev).filter(|it| it.is_finite());
        let own = model.texts.iter().find(|(section, key, _)| section == "log" && key == "columns");
        let text = own.map(|own| own.2.as_str()).filter(|_| text.is_empty()).unwrap_or(text);
        Ok(Self { supply_v: model.supply_nominal_v, counts_per_rev, ..text.parse()? })
    }

    /// These items instead of the user's.
    pub(super) fn with(&self, items: &str) -> Result<Self, InputError> {
        Ok(Self { mappings: items.parse::<Self>()?.mappings, ..self.clone() })
    }

    /// A quantity that the user has spoken of.
    pub(super) fn mentions(&self, quantity: Quantity) -> bool {
        self.mappings
            .iter()
            .any(|mapping| quantity_of(&mapping.ours).is_some_and(|known| known.0 == quantity))
    }

    /// Columns whose names are ours.
    fn exact(&self, source: &str, cells: &Cells, plan: &mut Plan) -> Result<(), InputError> {
        for (index, name) in cells.header.iter().enumerate() {
            let Some((quantity, unit)) = quantity_of(name).filter(|known| !self.mentions(known.0)) else {
                continue;
            };
            let is_clock = matches!(cells.columns[index].form, Some(Form::Clock { .. }));
            let unit = if is_clock { 1.0 } else { unit };
            let too_fast = quantity == Quantity::Time && is_too_fast(cells, index, unit);
            if too_fast || plan.origins.iter().any(|known| is_column(known, index)) {
                continue;
            }
            if let Some(twice) = plan.origin(quantity) {
                let (first, ours) = (&twice.name, name_of(quantity, unit));
                let what = format!(
                    "columns `{first}` and `{name}` hold the same quantity; choose one with --columns \"{ours}={name}\""
                );
                return Err(cells.wrong_names(source, what));
            }
            plan.origins.push(column(index, name, quantity, unit));
        }
        Ok(())
    }

    /// Columns that state quantity and unit, one of each quantity, where nothing else speaks for it or against it.
    fn stated(&self, cells: &Cells, plan: &mut Plan) {
        let mut stated: Vec<(usize, Quantity, f64)> = plan.stated(|quantity| !self.mentions(quantity));
        stated.retain(|(index, quantity, unit)| {
            *quantity != Quantity::Time || !is_too_fast(cells, *index, *unit)
        });
        let alone = |quantity| stated.iter().filter(|known| known.1 == quantity).count() == 1;
        let duty = plan.meanings.iter().flatten().any(|meaning| meaning.topic == Topic::Duty);
        let is_linear = |quantity| matches!(quantity, Quantity::Position | Quantity::LinearSpeed);
        let both_axes = [true, false].iter().all(|linear| {
            let on_it = |quantity: &Quantity| OUTPUTS.contains(quantity) && is_linear(*quantity) == *linear;
            stated.iter().any(|known| on_it(&known.1))
                || plan.origins.iter().any(|known| on_it(&known.quantity))
        });
        let driven = plan.any(&INPUTS);
        let is_input = |known: &(usize, Quantity, f64)| INPUTS.contains(&known.1);
        let mut input = driven;
        for &(index, quantity, unit) in stated.iter().filter(|known| alone(known.1)) {
            let ambiguous = match quantity {
                // Beside a duty a voltage may be the supply.
                Quantity::Voltage => input || duty,
                Quantity::Duty | Quantity::Torque | Quantity::Force => {
                    input || stated.iter().filter(|known| is_input(known)).count() > 1
                }
                quantity if OUTPUTS.contains(&quantity) => both_axes,
                // Without another input a current may be what is commanded.
                Quantity::Current => !driven && !duty && !stated.iter().any(is_input),
                _ => false,
            };
            if ambiguous || plan.has(quantity) || plan.origins.iter().any(|known| is_column(known, index)) {
                continue;
            }
            input |= INPUTS.contains(&quantity);
            plan.origins.push(column(index, &cells.header[index], quantity, unit));
            plan.taken.push((index, name_of(quantity, unit)));
        }
    }

    /// The file's name of the time column, or its expression, and the factor to seconds.
    pub fn time(&self) -> (String, f64) {
        let of_time =
            |mapping: &&Mapping| quantity_of(&mapping.ours).is_some_and(|known| known.0 == Quantity::Time);
        self.mappings.iter().find(of_time).map_or(("t_s".into(), 1.0), |mapping| {
            let unit = quantity_of(&mapping.ours).map_or(1.0, |known| known.1);
            match mapping.theirs.rsplit_once('*').map(|parts| (parts.0, parts.1.trim().parse::<f64>())) {
                Some((name, Ok(factor))) => (name.trim().to_owned(), unit * factor),
                _ if mapping.theirs.contains(['/', '+', '(']) => (format!("({})", mapping.theirs), unit),
                _ => (mapping.theirs.clone(), unit),
            }
        })
    }
}

impl Mapping {
    fn origin(&self, source: &str, cells: &Cells) -> Result<Origin, InputError> {
        let (quantity, unit) = quantity_of(&self.ours).expect("checked when parsed");
        let mut names = cells.header.clone();
        if !names.iter().any(|name| name == ROW) {
            names.push(ROW.into());
        }
        let formula = Formula::read(&self.theirs, &names).map_err(|unreadable| {
            let what = match unreadable {
                Unreadable::NoColumn(name) => {
                    let listed = cells.header.join(", ");
                    format!("--columns names `{name}`, which the header lacks (it has: {listed})")
                }
                Unreadable::Broken(why) => {
                    format!("--columns, `{}={}`: cannot be computed ({why})", self.ours, self.theirs)
                }
            };
            cells.wrong_names(source, what)
        })?;
        let name = match formula.indices() {
            [index] => names[*index].clone(),
            _ => self.theirs.clone(),
        };
        Ok(Origin { quantity, formula, unit, name })
    }
}

fn column(index: usize, name: &str, quantity: Quantity, unit: f64) -> Origin {
    Origin { quantity, formula: Formula::Scaled { index, factor: 1.0 }, unit, name: name.to_owned() }
}
