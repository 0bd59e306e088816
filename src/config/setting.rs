//! What one setting is, and the types that a setting may have.

use super::{Config, ConfigError, Field, within};
use crate::optional::Optional;

/// One row of the table [`super::SETTINGS`].
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// Its number in messages; its key is [`Field::name`].
    pub field: Field,
    /// Unit, "" for a plain number.
    pub unit: &'static str,
    /// What it is, as whole sentences.
    pub about: &'static str,
    /// The range in words, for documents.
    pub range: &'static str,
    /// The value of a file that leaves it out, in words; `None`: it is required.
    pub default: Option<&'static str>,
    /// Layout of the store since which it is stored.
    pub since: u16,
    /// Reads it.
    pub get: fn(&Config) -> Value,
    /// Puts a value in; `None`: the value has another type. The range is checked by [`Config::build`].
    pub set: fn(&mut Config, Value) -> Option<()>,
    /// The value of a file that leaves it out. The nominal supply must be known.
    pub fallback: fn(&Config) -> Option<Value>,
}

/// The value of a setting.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Not set.
    None,
    /// A number.
    Number(f32),
    /// A count.
    Whole(u32),
    /// Two numbers.
    Pair([f32; 2]),
}

/// What the type of a setting must be able to do.
pub(super) trait Kind: Copy {
    /// Refuses what lies outside the range.
    fn check(self, field: Field, range: [f32; 2]) -> Result<(), ConfigError>;
    /// Its value for the host.
    fn value(self) -> Value;
    /// From a value of the host.
    fn of(value: Value) -> Option<Self>;
}

impl Kind for f32 {
    #[inline]
    fn check(self, field: Field, [low, high]: [f32; 2]) -> Result<(), ConfigError> {
        within(field, self, low, high)
    }

    fn value(self) -> Value {
        Value::Number(self)
    }

    fn of(value: Value) -> Option<Self> {
        match value {
            Value::Number(number) => Some(number),
            Value::Whole(count) => Some(count as f32),
            Value::None | Value::Pair(_) => None,
        }
    }
}

/// Counts of different widths.
macro_rules! count {
    ($($type:ty),+) => {$(
        impl Kind for $type {
            #[inline]
            fn check(self, field: Field, [low, high]: [f32; 2]) -> Result<(), ConfigError> {
                within(field, self as f32, low, high)
            }

            fn value(self) -> Value {
                Value::Whole(u32::from(self))
            }

            fn of(value: Value) -> Option<Self> {
                match value {
                    Value::Whole(count) => count.try_into().ok(),
                    _ => None,
                }
            }
        }
    )+};
}

count!(u8, u16, u32);

impl Kind for Optional {
    #[inline]
    fn check(self, field: Field, [low, high]: [f32; 2]) -> Result<(), ConfigError> {
        self.get().map_or(Ok(()), |value| within(field, value, low, high))
    }

    fn value(self) -> Value {
        self.get().map_or(Value::None, Value::Number)
    }

    fn of(value: Value) -> Option<Self> {
        match value {
            Value::None => Some(Optional::NONE),
            other => f32::of(other).map(Optional::new),
        }
    }
}

/// A pair lies around zero: its range is that of both ends.
impl Kind for Option<[f32; 2]> {
    #[inline]
    fn check(self, field: Field, [low, high]: [f32; 2]) -> Result<(), ConfigError> {
        let Some([lower, upper]) = self else { return Ok(()) };
        within(field, lower, low, 0.0)?;
        within(field, upper, 0.0, high)
    }

    fn value(self) -> Value {
        self.map_or(Value::None, Value::Pair)
    }

    fn of(value: Value) -> Option<Self> {
        match value {
            Value::None => Some(None),
            Value::Pair(pair) => Some(Some(pair)),
            _ => None,
        }
    }
}
