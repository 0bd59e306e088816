//! Terms without a name under `[known.unnamed_…]`.

use super::complaints::File;
use super::file::number;
use super::keys::{ACTS, OVER, STANDSTILL, VALUES, VALUES_STD};
use super::section::Section;
use crate::system::plant::unnamed::{Acting, Knots, Term, Variable};
use crate::text::input_error::nearest;
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

impl<'a> File<'a> {
    /// Reads one term. `None`: something is wrong with it.
    pub(super) fn unnamed(&'a self, name: &str, table: &Table) -> Option<Unnamed> {
        let section = Section { file: self, name: format!("known.{name}"), table: table.clone() };
        let over = section.variables()?;
        let mut allowed = vec![OVER, ACTS, STANDSTILL, VALUES, VALUES_STD];
        allowed.extend(over.iter().map(|variable| variable.key()));
        self.check_effect(&section.name, table, &allowed);
        let over: Vec<Option<Knots>> = over.into_iter().map(|variable| section.knots(variable)).collect();
        let (acts, standstill) = (section.acting(), section.positive(STANDSTILL));
        let over: Vec<Knots> = over.into_iter().collect::<Option<_>>()?;
        let size = Term::size(&over);
        let values = section.numbers(VALUES, size);
        let stds = table.contains_key(VALUES_STD).then(|| section.numbers(VALUES_STD, size));
        let term = Term { over, values: values?, acts: acts?, standstill: standstill? };
        Some(Unnamed { name: name.to_owned(), term, stds: stds.flatten(), origin: section.text("origin") })
    }
}

impl Section<'_> {
    fn variables(&self) -> Option<Vec<Variable>> {
        let known = || Variable::ALL.map(Variable::key).join(", ");
        let Some(Value::Array(names)) = self.table.get(OVER) else {
            return self.refused(OVER, &format!("must be an array of one or two of {}", known()));
        };
        let variable = |name: &Value| {
            let text = name.as_str().unwrap_or_default();
            Variable::find(text).or_else(|| {
                let near = nearest(text, Variable::ALL.map(Variable::key));
                let remedy = near.map_or(format!("the known ones are {}", known()), |near| {
                    format!("the nearest is \"{near}\"")
                });
                self.refused(OVER, &format!("names {name}, which is no variable; {remedy}"))
            })
        };
        match names.len() {
            1 | 2 => names.iter().map(variable).collect(),
            count => {
                self.refused(OVER, &format!("has {count} entries; a table is over one or two variables"))
            }
        }
    }

    fn knots(&self, variable: Variable) -> Option<Knots> {
        let key = variable.key();
        let Some(Value::Array(given)) = self.table.get(key) else {
            return self.refused(key, "is missing; give the values at which the table has its knots");
        };
        let at = self.numbers(key, given.len())?;
        match at.len() < 2 || at.windows(2).any(|pair| pair[1] <= pair[0]) {
            true => self.refused(key, "must hold at least two knots that rise"),
            false => Some(Knots { variable, at }),
        }
    }

    fn acting(&self) -> Option<Acting> {
        let text = self.text(ACTS).unwrap_or_else(|| Acting::Torque.key().to_owned());
        Acting::ALL.into_iter().find(|acting| acting.key() == text).or_else(|| {
            let known = Acting::ALL.map(Acting::key);
            let remedy = match nearest(&text, known) {
                Some(near) => format!("the nearest is \"{near}\""),
                None => format!("write one of {}", known.join(", ")),
            };
            self.refused(ACTS, &format!("\"{text}\" is unknown; {remedy}"))
        })
    }

    /// An array of so many finite numbers.
    fn numbers(&self, key: &str, count: usize) -> Option<Vec<f64>> {
        let Some(Value::Array(given)) = self.table.get(key) else {
            return self.refused(key, &format!("must be an array of {count} numbers"));
        };
        let numbers: Option<Vec<f64>> = given.iter().map(number).collect();
        match numbers.filter(|numbers| numbers.iter().all(|it| it.is_finite())) {
            Some(numbers) if numbers.len() == count => Some(numbers),
            Some(numbers) => {
                self.refused(key, &format!("holds {} numbers; the knots ask for {count}", numbers.len()))
            }
            None => self.refused(key, "must hold finite numbers alone"),
        }
    }
}
