//! Messages as JSON.

use crate::naming;
use crate::streams::Stream;
use serde::de::{DeserializeSeed, Deserializer, Error, IgnoredAny, MapAccess, SeqAccess, Visitor};
use std::borrow::Cow;
use std::fmt;

/// How `serde_json` hands on a number where another crate switches on its feature `arbitrary_precision`.
const NUMBER: &str = "$serde_json::private::Number";

/// Reads a message into a stream.
///
/// # Errors
/// What of it is no JSON.
pub fn read(message: &[u8], stream: &mut Stream) -> serde_json::Result<()> {
    let mut json = serde_json::Deserializer::from_slice(message);
    Value(stream).deserialize(&mut json)?;
    json.end()
}

struct Value<'a>(&'a mut Stream);

impl<'de> DeserializeSeed<'de> for Value<'_> {
    type Value = ();

    fn deserialize<D: Deserializer<'de>>(self, json: D) -> Result<(), D::Error> {
        json.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for Value<'_> {
    type Value = ();

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a value of JSON")
    }

    fn visit_bool<E: Error>(self, value: bool) -> Result<(), E> {
        self.0.number(f64::from(value));
        Ok(())
    }

    fn visit_i64<E: Error>(self, value: i64) -> Result<(), E> {
        self.0.number(value as f64);
        Ok(())
    }

    fn visit_u64<E: Error>(self, value: u64) -> Result<(), E> {
        self.0.number(value as f64);
        Ok(())
    }

    fn visit_f64<E: Error>(self, value: f64) -> Result<(), E> {
        self.0.number(value);
        Ok(())
    }

    fn visit_str<E: Error>(self, value: &str) -> Result<(), E> {
        if let Some(value) = naming::number(value) {
            self.0.number(value);
        }
        Ok(())
    }

    fn visit_unit<E: Error>(self) -> Result<(), E> {
        Ok(())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<(), A::Error> {
        let mut members = 0;
        loop {
            if members >= naming::MOST_MEMBERS {
                if list.next_element::<IgnoredAny>()?.is_none() {
                    break;
                }
            } else {
                let back = self.0.member(members);
                let more = list.next_element_seed(Value(&mut *self.0))?.is_some();
                self.0.leave(back);
                if !more {
                    break;
                }
            }
            members += 1;
        }
        self.0.close_list(members);
        Ok(())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<(), A::Error> {
        while let Some(name) = map.next_key::<Name>()? {
            if name.0 == NUMBER {
                map.next_value_seed(Value(&mut *self.0))?;
                continue;
            }
            let back = self.0.enter(&name.0);
            map.next_value_seed(Value(&mut *self.0))?;
            self.0.leave(back);
        }
        Ok(())
    }
}

/// The name of a field, without a copy where it stands as it is.
#[derive(serde::Deserialize)]
#[serde(transparent)]
struct Name<'a>(#[serde(borrow)] Cow<'a, str>);
