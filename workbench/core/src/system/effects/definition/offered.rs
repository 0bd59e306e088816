//! Which logs may name an effect: records over time, tables of settled speeds, or both, and how a table shows it.

use super::Effect;

/// The kinds of logs that may name an effect.
#[derive(Clone, Copy, Debug)]
pub enum Offered {
    /// Records over time alone: a table shows nothing of it, or too little for a name.
    Records(InTables),
    /// Tables of settled speeds alone.
    Tables(Steady),
    /// Both.
    Both(Steady),
}

/// What a table is compared with when the model already contains an effect that no table names.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum InTables {
    /// The model with the effect.
    Counts,
    /// The model without it: its torque averages out over a turn or over time, or lets no speed settle.
    LeftOut,
}

/// How a table of settled speeds shows an effect.
#[derive(Clone, Copy, Debug)]
pub struct Steady {
    /// Its part in the search.
    pub role: Role,
    /// What it does to the curve of speed over voltage.
    pub shape: Shape,
    /// What the table must hold, or it is not offered.
    pub needs: Needs,
    /// In which forms it is tried.
    pub forms: Forms,
    /// Effects that never stand beside it, besides those of the same shape.
    pub never_beside: &'static [&'static Effect],
}

/// The part of an effect in the search for the set that explains a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// One effect of each kind of trace: what the search tries first.
    Representative,
    /// It refines a set that was found: it matters near standstill, or tells one direction from the other.
    Refinement,
    /// It enters as a rival of those that are found.
    Rival,
}

/// What an effect does to the curve of speed over voltage. Effects of one shape are one thing in a steady state, or nearly
/// so.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// It scales the curve.
    Slope,
    /// It holds the speed below a level.
    Limit,
    /// It holds the motor still between two voltages.
    Edges,
    /// It shifts the voltage about which the curve is symmetric.
    ZeroCrossing,
    /// It bends the curve: the speed falls behind the straight line, ever more.
    Bend,
    /// Another shape for each effect.
    Own,
}

/// What a table must hold for an effect to be offered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// A model with a winding: else the effect cannot be told from the gain.
    Winding,
    /// Voltages of both signs.
    Reversal,
    /// Voltages of both signs, and no reading below zero.
    Magnitudes,
}

/// In which forms an effect is tried.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Forms {
    /// With its optional parameters at their defaults, and with them fitted.
    PlainAndFree,
    /// With its optional parameters at their defaults.
    Plain,
    /// With these parameters pinned, and started where the table shows the motor starting from rest.
    FromRest(&'static [Option<f64>]),
}

impl Steady {
    /// An effect that every table may show.
    pub const fn new(role: Role, shape: Shape) -> Self {
        Self { role, shape, needs: Needs::Nothing, forms: Forms::PlainAndFree, never_beside: &[] }
    }

    /// Offered only where the table holds this.
    pub const fn needs(mut self, needs: Needs) -> Self {
        self.needs = needs;
        self
    }

    /// Tried in these forms.
    pub const fn forms(mut self, forms: Forms) -> Self {
        self.forms = forms;
        self
    }

    /// Never beside these.
    pub const fn never_beside(mut self, others: &'static [&'static Effect]) -> Self {
        self.never_beside = others;
        self
    }
}

impl Effect {
    /// How a table of settled speeds shows it; `None`: no table names it.
    pub fn steady(&self) -> Option<&Steady> {
        match &self.offered {
            Offered::Tables(steady) | Offered::Both(steady) => Some(steady),
            Offered::Records(_) => None,
        }
    }

    /// True if a record over time may name it.
    pub fn on_records(&self) -> bool {
        !matches!(self.offered, Offered::Tables(_))
    }

    /// True if a known one changes the curve with which a table is compared.
    pub fn counts_in_tables(&self) -> bool {
        !matches!(self.offered, Offered::Records(InTables::LeftOut))
    }

    /// Whether both are one thing in a steady state, or nearly so: they must not stand side by side. Base parameters may,
    /// since most of them change what friction is worth in volts as well.
    pub fn excludes_in_tables(&self, other: &Effect) -> bool {
        let (Some(own), Some(others)) = (self.steady(), other.steady()) else {
            return false;
        };
        let one_shape = own.shape == others.shape
            && own.shape != Shape::Own
            && !self.is_base_parameter()
            && !other.is_base_parameter();
        one_shape || own.never_beside.contains(&other) || others.never_beside.contains(&self)
    }
}
