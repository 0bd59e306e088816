//! What ties an effect to other effects and to the numbers of the model.

use super::Effect;

/// What ties an effect to other effects and to the numbers of the model.
#[derive(Clone, Copy, Debug)]
pub struct Relations {
    /// Effects whose sum with this one is one effect of the library, exactly: no record can tell the two names from the
    /// one, so they never hide together in a drawn case.
    pub inseparable_from: &'static [&'static Effect],
    /// The effect of which this is the form with two different sides.
    pub uneven_of: Option<Uneven>,
    /// The number that the effect multiplies by its ratio.
    pub multiplies: Option<Multiplies>,
}

impl Relations {
    /// It stands for itself.
    pub const NONE: Self = Self { inseparable_from: &[], uneven_of: None, multiplies: None };

    /// It is the form with two different sides.
    pub const fn uneven(even: &'static Effect, with: &'static [&'static Effect]) -> Self {
        Self { uneven_of: Some(Uneven { even, with }), ..Self::NONE }
    }
}

/// A form with two different sides.
#[derive(Clone, Copy, Debug)]
pub struct Uneven {
    /// The form with equal sides.
    pub even: &'static Effect,
    /// Constants that make two different sides of the equal ones in a steady state.
    pub with: &'static [&'static Effect],
}

/// A number of the model, or a 1 that the model leaves unsaid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Multiplies {
    /// A base parameter.
    Base {
        /// Its key in the model file.
        key: &'static str,
        /// Its key on a linear axis.
        linear_key: &'static str,
    },
    /// The gain of the drive or the scale of the sensor, with the key under which its tolerance may stand.
    Chain(&'static str),
}

impl Multiplies {
    /// A base parameter whose key is the same on every axis.
    pub const fn base(key: &'static str) -> Self {
        Self::Base { key, linear_key: key }
    }

    /// The key of its tolerance in the model file.
    pub fn tolerance_key(self, linear: bool) -> &'static str {
        match self {
            Self::Base { linear_key, .. } if linear => linear_key,
            Self::Base { key, .. } | Self::Chain(key) => key,
        }
    }
}
