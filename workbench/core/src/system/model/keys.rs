//! Names that the reader knows besides the table of keys, and typing errors of texts.

use crate::text::input_error::mistyped;

/// Key of a known effect: how sure the gap workflow was of its name.
pub const STANDING: &str = "standing";
/// Its value where no other name explains the data and nothing else is left.
pub const NAMED: &str = "named";

/// How the sections of terms without a name begin.
pub const UNNAMED: &str = "unnamed_";
/// Key of their variables.
pub const OVER: &str = "over";
/// Key of what a term acts on.
pub const ACTS: &str = "acts";
/// Key of the speed below which no direction is certain.
pub const STANDSTILL: &str = "standstill_speed";
/// Key of their values.
pub const VALUES: &str = "values";
/// Key of the standard deviations of those.
pub const VALUES_STD: &str = "values_std";

/// Letters of a part of a known value that is more than a word of a description. Chosen by judgement; not studied.
const PART: usize = 8;

/// Keys of a section whose values are texts, besides those of the table.
pub fn texts(section: &str) -> &'static [&'static str] {
    if section.starts_with("known.unnamed_") {
        return &["origin", STANDING, ACTS];
    }
    if section.starts_with("known.") {
        return &["origin", STANDING];
    }
    &[]
}

/// The known key of which the name of a text is a typing error.
pub fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    match known.clone().any(|key| key == name) {
        true => None,
        false => known.into_iter().find(|key| mistyped(name, key)),
    }
}

/// The known value that `text` was probably to be: a part of it, or mistyped. A description in words is none.
pub fn value_meant<'a>(text: &str, values: &[&'a str]) -> Option<&'a str> {
    let almost = |known: &&str| {
        let begin: String = known.chars().take(text.chars().count()).collect();
        (text.len() >= PART && known.contains(text)) || mistyped(text, known) || mistyped(text, &begin)
    };
    if text.is_empty() || values.contains(&text) { None } else { values.iter().copied().find(almost) }
}
