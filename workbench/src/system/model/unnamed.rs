//! Terms without a name under `[known.unnamed_…]`.

use super::file::File;
use super::keys::{ACTS, OVER, STANDSTILL, VALUES, VALUES_STD};
use super::section::Section;
use crate::console::input_error::{InputError, nearest};
use crate::system::plant::unnamed::{Acting, Knots, Term, Variable};
use toml::{Table, Value};

/// A term without a name that the model already contains.
#[derive(Clone, Debug)]
pub struct Unnamed {
    /// `unnamed_1`, …
    pub name: String,
    /// What acts.
    pub term: Term,
    /// Standard deviations of its values, where the file gives them.
    pub stds: Option<Vec<f64>>,
    /// Where it came from.
    pub origin: Option<String>,
}

impl Acting {
    /// Its word in the model file.
    pub fn key(self) -> &'static str {
        match self {
            Self::Torque => "torque",
            Self::Input => "input",
            Self::Reading => "reading",
        }
    }
}

impl<'a> File<'a> {
    /// Reads one term.
    pub(super) fn unnamed(&'a self, name: &str, table: &Table) -> Result<Unnamed, InputError> {
        let section = Section { file: self, name: format!("known.{name}"), table: table.clone() };
        let over = section.variables()?;
        let mut allowed = vec![OVER, ACTS, STANDSTILL, VALUES, VALUES_STD];
        allowed.extend(over.iter().map(|variable| variable.key()));
        InputError::all(self.keys(&section.name, table, &allowed))?;
        let over = over.into_iter().map(|variable| section.knots(variable)).collect::<Result<Vec<_>, _>>()?;
        let size = Term::size(&over);
        let values = section.numbers(VALUES, size)?;
        let stds = table.contains_key(VALUES_STD).then(|| section.numbers(VALUES_STD, size)).transpose()?;
        let term = Term { over, values, acts: section.acting()?, standstill: section.positive(STANDSTILL)? };
        Ok(Unnamed { name: name.to_owned(), term, stds, origin: section.text("origin")? })
    }
}

impl Section<'_> {
    fn variables(&self) -> Result<Vec<Variable>, InputError> {
        let known = || Variable::ALL.map(Variable::key).join(", ");
        let Some(Value::Array(names)) = self.table.get(OVER) else {
            return Err(self.wrong(OVER, &format!("must be an array of one or two of {}", known())));
        };
        let variable = |name: &Value| {
            let text = name.as_str().unwrap_or_default();
            Variable::find(text).ok_or_else(|| {
                let near = nearest(text, Variable::ALL.map(Variable::key)).unwrap_or("speed");
                self.wrong(OVER, &format!("names {name}, which is no variable; the nearest is \"{near}\""))
            })
        };
        match names.len() {
            1 | 2 => names.iter().map(variable).collect(),
            count => {
                Err(self.wrong(OVER, &format!("has {count} entries; a table is over one or two variables")))
            }
        }
    }

    fn knots(&self, variable: Variable) -> Result<Knots, InputError> {
        let Some(Value::Array(given)) = self.table.get(variable.key()) else {
            return Err(
                self.wrong(variable.key(), "is missing; give the values at which the table has its knots")
            );
        };
        let at = self.numbers(variable.key(), given.len())?;
        match at.len() < 2 || at.windows(2).any(|pair| pair[1] <= pair[0]) {
            true => Err(self.wrong(variable.key(), "must hold at least two knots that rise")),
            false => Ok(Knots { variable, at }),
        }
    }

    fn acting(&self) -> Result<Acting, InputError> {
        let text = self.text(ACTS)?.unwrap_or_else(|| Acting::Torque.key().to_owned());
        let all = [Acting::Torque, Acting::Input, Acting::Reading];
        all.into_iter().find(|acting| acting.key() == text).ok_or_else(|| {
            let near = nearest(&text, all.map(Acting::key)).unwrap_or(Acting::Torque.key());
            self.wrong(ACTS, &format!("\"{text}\" is unknown; the nearest is \"{near}\""))
        })
    }

    /// An array of so many finite numbers.
    fn numbers(&self, key: &str, count: usize) -> Result<Vec<f64>, InputError> {
        let Some(Value::Array(given)) = self.table.get(key) else {
            return Err(self.wrong(key, &format!("must be an array of {count} numbers")));
        };
        let number = |value: &Value| value.as_float().or(value.as_integer().map(|it| it as f64));
        let numbers: Option<Vec<f64>> = given.iter().map(number).collect();
        match numbers.filter(|numbers| numbers.iter().all(|it| it.is_finite())) {
            Some(numbers) if numbers.len() == count => Ok(numbers),
            Some(numbers) => {
                let what = format!("holds {} numbers; the knots ask for {count}", numbers.len());
                Err(self.wrong(key, &what))
            }
            None => Err(self.wrong(key, "must hold finite numbers alone")),
        }
    }
}
