//! One effect of a hypothesis, and which of its parameters a fit moves.

use crate::system::effects::Effect;

/// Which parameters of an effect a fit moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Freedom {
    /// Those without a default: the simplest form.
    Plain,
    /// All, a softness too.
    Full,
    /// Those that are not pinned to a value here.
    Pinned(&'static [Option<f64>]),
}

/// One effect of a hypothesis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Item {
    /// The effect.
    pub effect: &'static Effect,
    /// Which of its parameters move.
    pub freedom: Freedom,
}

impl Item {
    /// An effect whose optional parameters keep their defaults.
    pub fn plain(effect: &'static Effect) -> Self {
        Self { effect, freedom: Freedom::Plain }
    }

    /// An effect whose parameters all move.
    pub fn full(effect: &'static Effect) -> Self {
        Self { effect, freedom: Freedom::Full }
    }

    /// True if all its parameters move.
    pub fn is_full(&self) -> bool {
        self.freedom == Freedom::Full
    }

    /// The value of a parameter that does not move.
    pub fn pinned(&self, parameter: usize) -> Option<f64> {
        match self.freedom {
            Freedom::Plain => self.effect.parameters[parameter].default,
            Freedom::Full => None,
            Freedom::Pinned(values) => values[parameter],
        }
    }

    /// Indices of the parameters that move.
    pub fn free(&self) -> impl Iterator<Item = usize> + '_ {
        (0..self.effect.parameters.len()).filter(|k| self.pinned(*k).is_none())
    }

    /// Number of the parameters that move.
    pub fn size(&self) -> usize {
        self.free().count()
    }
}
