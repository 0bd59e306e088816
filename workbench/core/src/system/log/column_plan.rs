//! What is known of a file's columns, what is proposed and what lacks.

use super::cells::Cells;
use super::formula::Formula;
use super::meaning::{Meaning, Sure};
use super::mend::Names;
use super::names::Quantity;
use super::spelling::in_shell;
use crate::text::input_error::InputError;

/// Where one quantity comes from.
#[derive(Clone, Debug)]
pub struct Origin {
    /// The quantity.
    pub quantity: Quantity,
    /// What it is computed from; the column behind the last one is the number of the row.
    pub formula: Formula,
    /// Factor to the SI unit.
    pub unit: f64,
    /// What the user sees of it, for messages.
    pub name: String,
}

impl Origin {
    /// The factor from a column to the SI unit. 1 for an expression.
    pub fn factor(&self) -> f64 {
        match self.formula {
            Formula::Scaled { factor, .. } => self.unit * factor,
            Formula::Expression { .. } => self.unit,
        }
    }
}

/// One item of `--columns`, and why.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Proposal {
    /// `ours=theirs`.
    pub item: String,
    /// What speaks for it, and what is guessed.
    pub why: String,
    /// The column it is about.
    pub column: Option<usize>,
}

/// What is known of a file's columns.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    /// The quantities that are there.
    pub origins: Vec<Origin>,
    /// What each column seems to be.
    pub meanings: Vec<Option<Meaning>>,
    /// Columns that are taken by name and unit, with our name.
    pub taken: Vec<(usize, &'static str)>,
    /// What the user has to confirm, for the quantities that are lacking.
    pub proposals: Vec<Proposal>,
    /// What is lacking and cannot be proposed.
    pub missing: Option<String>,
    /// The whole `--columns` that would work.
    pub items: String,
    /// How the file calls its columns.
    pub names: Names,
}

impl Plan {
    /// Where a quantity comes from, if it is there.
    pub fn origin(&self, quantity: Quantity) -> Option<&Origin> {
        self.origins.iter().find(|origin| origin.quantity == quantity)
    }

    /// Is this quantity there?
    pub fn has(&self, quantity: Quantity) -> bool {
        self.origin(quantity).is_some()
    }

    /// Is one of these there?
    pub fn any(&self, wanted: &[Quantity]) -> bool {
        wanted.iter().any(|quantity| self.has(*quantity))
    }

    /// Says which columns were taken by name and unit.
    pub fn note(&self, header: &[String]) -> Option<String> {
        let said = |taken: &(usize, &str)| format!("`{}` as {}", header[taken.0], taken.1);
        let said: Vec<String> = self.taken.iter().map(said).collect();
        (!said.is_empty()).then(|| format!("Columns read by name and unit: {}.", said.join(", ")))
    }

    /// Refuses a file that lacks something, with the option that mends it.
    pub fn complete(&self, source: &str, cells: &Cells) -> Result<(), InputError> {
        let reasons: Vec<&str> = self.proposals.iter().map(|proposal| proposal.why.as_str()).collect();
        let ready = format!("--columns {}", in_shell(&self.items));
        let what = match (&self.missing, reasons.is_empty()) {
            (None, true) => return Ok(()),
            (None, false) => format!("{}; if that is right, add {ready}", reasons.join("; ")),
            (Some(missing), true) => missing.clone(),
            (Some(missing), false) => format!("{missing}; besides, {}: {ready}", reasons.join("; ")),
        };
        Err(cells.wrong_names(source, what))
    }
}

/// What can drive an axis.
pub const INPUTS: [Quantity; 5] =
    [Quantity::Voltage, Quantity::Duty, Quantity::Torque, Quantity::Force, Quantity::CurrentInput];
/// What can be measured of its motion.
pub const OUTPUTS: [Quantity; 4] =
    [Quantity::Angle, Quantity::Position, Quantity::AngularSpeed, Quantity::LinearSpeed];

impl Plan {
    /// The columns that state quantity and unit and are not used.
    pub(super) fn stated(&self, wanted: impl Fn(Quantity) -> bool) -> Vec<(usize, Quantity, f64)> {
        let all = self.meanings.iter().enumerate();
        let stated = all.filter_map(|(index, meaning)| {
            let meaning = meaning.filter(|meaning| meaning.sure == Sure::Stated)?;
            let (quantity, unit) = meaning.quantity?;
            let used = self.origins.iter().any(|known| is_column(known, index));
            (!used && wanted(quantity)).then_some((index, quantity, unit))
        });
        stated.collect()
    }
}

/// Is a quantity this column as it is?
pub(super) fn is_column(origin: &Origin, index: usize) -> bool {
    matches!(origin.formula, Formula::Scaled { index: own, .. } if own == index)
}
