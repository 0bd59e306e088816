//! A number that may be absent, in the room of a number: not a number (NaN) tells that there is none.
//!
//! `Option<f32>` takes twice the room, and a configuration with eight of them lies in every queue, answer and set of
//! parameters that can hold one.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// As [`Option<f32>`]. It travels as a number, NaN when there is none: so four axes fit into a record of the store. In text
/// it is what it is.
#[derive(Clone, Copy)]
pub struct Optional(f32);

impl Optional {
    /// There is none.
    pub const NONE: Self = Optional(f32::NAN);

    /// This number. NaN was meant to be one, so it must not pass for none: it becomes infinite, which no range allows.
    #[must_use]
    pub const fn new(value: f32) -> Self {
        Optional(if value.is_nan() { f32::INFINITY } else { value })
    }

    /// The number, if there is one.
    #[must_use]
    #[inline]
    pub const fn get(self) -> Option<f32> {
        if self.0.is_nan() { None } else { Some(self.0) }
    }

    /// This one, or the other if it is none.
    #[must_use]
    pub const fn or(self, other: Self) -> Self {
        if self.0.is_nan() { other } else { self }
    }
}

impl Optional {
    /// As a word, to travel in an array of words.
    #[must_use]
    pub(crate) const fn to_bits(self) -> u32 {
        self.0.to_bits()
    }

    /// Back from [`Optional::to_bits`]. Whatever NaN has arrived, it is always the same from now on.
    #[must_use]
    pub(crate) const fn from_bits(bits: u32) -> Self {
        Optional(f32::from_bits(bits)).or(Self::NONE)
    }
}

impl Default for Optional {
    fn default() -> Self {
        Self::NONE
    }
}

impl From<Option<f32>> for Optional {
    fn from(value: Option<f32>) -> Self {
        value.map_or(Self::NONE, Self::new)
    }
}

impl PartialEq for Optional {
    fn eq(&self, other: &Self) -> bool {
        self.get() == other.get()
    }
}

impl core::fmt::Debug for Optional {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.get().fmt(f)
    }
}

impl Serialize for Optional {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            return self.get().serialize(serializer);
        }
        self.0.serialize(serializer)
    }
}

impl<'de> Deserialize<'de> for Optional {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        if deserializer.is_human_readable() {
            return Option::deserialize(deserializer).map(Self::from);
        }
        // Whatever NaN has arrived, the one that leaves again is always the same.
        f32::deserialize(deserializer).map(|value| Optional(value).or(Self::NONE))
    }
}
