//! How a file calls what it holds, and the `--columns` that reads a column in another way.

use super::formula::unquoted;
use super::names::{Quantity, name_of, quantity_of};
use super::spelling::in_shell;

/// How a file calls what it holds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Names {
    /// What the user or the model file has mapped: our name and theirs. A mended line repeats it.
    typed: Vec<(String, String)>,
    /// What was read by its name: quantity, factor to its SI unit, their name.
    read: Vec<(Quantity, f64, String)>,
    /// The columns of the file.
    header: Vec<String>,
}

/// What stands on the right of `=` now, as a part of an expression, and the factor from it to the SI unit.
pub struct Theirs {
    /// A column or an expression in parentheses.
    pub text: String,
    /// Factor to the SI unit.
    pub unit: f64,
}

/// Our name of a column, and what is to stand in the place of what is read.
pub type Change<'a> = (&'a str, &'a dyn Fn(&Theirs) -> String);

impl Names {
    pub(super) fn of(
        typed: Vec<(String, String)>,
        read: Vec<(Quantity, f64, String)>,
        header: &[String],
    ) -> Self {
        Self { typed, read, header: header.to_vec() }
    }

    /// The option that reads our columns in another way.
    pub fn mended(&self, changes: &[Change]) -> String {
        let mut items = self.typed.clone();
        for (ours, change) in changes {
            let theirs = self.theirs(ours);
            match items.iter_mut().find(|item| same(&item.0, ours)) {
                Some(item) => item.1 = change(&theirs.1),
                None => items.push((theirs.0, change(&theirs.1))),
            }
        }
        let items: Vec<String> = items.iter().map(|item| format!("{}={}", item.0, item.1)).collect();
        format!("--columns {}", in_shell(&items.join(",")))
    }

    /// The option that reads one of our columns times a factor.
    pub fn times(&self, ours: &str, factor: f64) -> String {
        self.mended(&[(ours, &|theirs| format!("{}*{}", theirs.text, super::in_digits(factor, 6)))])
    }

    /// The option that reads two of our columns in each other's place.
    pub fn exchanged(&self, one: &str, other: &str) -> String {
        let (of_one, of_other) = (self.theirs(one).1, self.theirs(other).1);
        let read_as = |from: &Theirs, own: &Theirs| {
            let factor = from.unit / own.unit;
            let same = (factor - 1.0).abs() < 1e-9;
            if same { from.text.clone() } else { format!("{}*{}", from.text, super::in_digits(factor, 6)) }
        };
        self.mended(&[(one, &|own| read_as(&of_other, own)), (other, &|own| read_as(&of_one, own))])
    }

    /// The name on the left of `=`, and what stands on the right.
    pub fn theirs(&self, ours: &str) -> (String, Theirs) {
        if let Some((name, text)) = self.typed.iter().find(|item| same(&item.0, ours)) {
            let unit = quantity_of(name).map_or(1.0, |known| known.1);
            return (name.clone(), Theirs { text: self.operand(text), unit });
        }
        let known = self.read.iter().find(|known| same(name_of(known.0, 1.0), ours));
        let (name, text, unit) = known.map_or((ours, ours, 1.0), |(quantity, unit, theirs)| {
            (name_of(*quantity, *unit), theirs.as_str(), *unit)
        });
        (name.to_owned(), Theirs { text: self.operand(text), unit })
    }

    /// A text that can be a factor of a product. A name that could be taken apart stands in quotes.
    fn operand(&self, text: &str) -> String {
        let is_column = text.is_empty() || self.header.iter().any(|name| name == unquoted(text));
        match (is_column, unquoted(text).contains([',', '*', '(', ')', '='])) {
            (false, _) if !self.header.is_empty() => format!("({text})"),
            (true, true) => format!("'{}'", unquoted(text)),
            _ => text.to_owned(),
        }
    }
}

/// Are these names of the same quantity? A duty stands for the voltage that it makes.
fn same(name: &str, ours: &str) -> bool {
    let of = |name: &str| quantity_of(name).map(|known| known.0);
    of(name).is_some() && of(name) == of(ours)
        || of(name) == Some(Quantity::Duty) && of(ours) == Some(Quantity::Voltage)
}
