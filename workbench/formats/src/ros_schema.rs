//! Definitions of ROS 2 messages, as a recorder writes them beside the messages: the `.msg` text, then those it uses.

use std::collections::HashMap;

/// What a field holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A flag or a whole number of so many bytes.
    Integer {
        /// 1, 2, 4 or 8.
        bytes: usize,
        /// It has a sign.
        signed: bool,
    },
    /// A number of 4 or 8 bytes.
    Real(usize),
    /// A text; `wide`: of 16-bit characters.
    Text {
        /// UTF-16.
        wide: bool,
    },
    /// Another message: its place among the definitions.
    Message(usize),
}

/// How many of them a field holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Many {
    /// One.
    One,
    /// Always so many.
    Fixed(usize),
    /// As many as stand before them.
    Counted,
}

/// A field of a message.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub kind: Kind,
    /// How many of them.
    pub many: Many,
}

/// The definitions of a message and of those in it; the first one is its own.
pub type Schema = Vec<Vec<Field>>;

/// A message in a message in a message.
const DEEPEST: usize = 16;

/// Types that definitions may leave out, because each ROS has them.
const BUILT_IN: [(&str, &str); 2] = [
    ("builtin_interfaces/Time", "int32 sec\nuint32 nanosec"),
    ("builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"),
];

/// Reads the definition of a message and those behind it.
///
/// # Errors
/// A sentence where a line is none, or a type is missing.
pub fn read(name: &str, text: &str) -> Result<Schema, String> {
    let own = [short(name)];
    let mut parts: Vec<(String, String)> = Vec::new();
    let mut lines = String::new();
    let mut at = own[0].clone();
    for line in text.lines() {
        if let Some(next) = line.trim().strip_prefix("MSG:") {
            parts.push((std::mem::replace(&mut at, short(next.trim())), std::mem::take(&mut lines)));
        } else if !line.starts_with("===") {
            lines += line;
            lines.push('\n');
        }
    }
    parts.push((at, lines));
    for (name, text) in BUILT_IN {
        if !parts.iter().any(|part| part.0 == name) {
            parts.push((name.into(), text.into()));
        }
    }
    let places: HashMap<&str, usize> =
        parts.iter().enumerate().rev().map(|(k, part)| (part.0.as_str(), k)).collect();
    let schema: Result<Schema, String> =
        parts.iter().map(|(name, text)| fields(name, text, &places)).collect();
    schema.and_then(
        |schema| if depth(&schema, 0, DEEPEST) { Ok(schema) } else { Err("contains itself".into()) },
    )
}

/// `sensor_msgs/msg/JointState` without its middle.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn depth(schema: &Schema, at: usize, left: usize) -> bool {
    let inside = |field: &Field| match field.kind {
        Kind::Message(inner) => left > 0 && depth(schema, inner, left - 1),
        _ => true,
    };
    schema[at].iter().all(inside)
}

fn fields(message: &str, text: &str, places: &HashMap<&str, usize>) -> Result<Vec<Field>, String> {
    let mut fields = Vec::new();
    for line in text.lines() {
        let line = line.split('#').next().unwrap_or_default().trim();
        let Some((kind, rest)) = line.split_once(char::is_whitespace) else { continue };
        let rest = rest.trim_start();
        let end = rest.find(|c: char| c.is_whitespace() || c == '=').unwrap_or(rest.len());
        if rest[end..].trim_start().starts_with('=') {
            // A constant.
            continue;
        }
        let (kind, many) = many(kind);
        let kind = primitive(kind).or_else(|| {
            let (package, _) = message.split_once('/').unwrap_or_default();
            let header = (kind == "Header").then(|| "std_msgs/Header".to_owned());
            let names = [short(kind), format!("{package}/{kind}"), header.unwrap_or_default()];
            names.iter().find_map(|name| places.get(name.as_str())).map(|place| Kind::Message(*place))
        });
        let kind =
            kind.ok_or_else(|| format!("its definition has a line that is not understood, `{line}`"))?;
        fields.push(Field { name: rest[..end].to_owned(), kind, many });
    }
    Ok(fields)
}

/// The type of one member, and how many there are: `float64[3]`, `string<=10[<=5]`.
fn many(kind: &str) -> (&str, Many) {
    let (bare, many) = match kind.strip_suffix(']').and_then(|kind| kind.rsplit_once('[')) {
        Some((bare, count)) => (bare, count.parse().map_or(Many::Counted, Many::Fixed)),
        None => (kind, Many::One),
    };
    (bare.split("<=").next().unwrap_or(bare), many)
}

fn primitive(kind: &str) -> Option<Kind> {
    let integer = |bytes, signed| Some(Kind::Integer { bytes, signed });
    match kind {
        "bool" | "byte" | "char" | "uint8" => integer(1, false),
        "int8" => integer(1, true),
        "int16" => integer(2, true),
        "uint16" => integer(2, false),
        "int32" => integer(4, true),
        "uint32" => integer(4, false),
        "int64" => integer(8, true),
        "uint64" => integer(8, false),
        "float32" => Some(Kind::Real(4)),
        "float64" => Some(Kind::Real(8)),
        "string" => Some(Kind::Text { wide: false }),
        "wstring" => Some(Kind::Text { wide: true }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_definition_is_read_with_those_behind_it() {
        let text = "uint8 A=1 # one\nstring<=5 B = \"x=y\"\nHeader header\nfloat64[3] q 1.0\nInner[] inner\nstring<=10[<=5] s\n\
                    ===\nMSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n===\nMSG: a/Inner\nbool on";
        let schema = read("a/msg/Outer", text).unwrap();
        let names: Vec<&str> = schema[0].iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["header", "q", "inner", "s"]);
        assert_eq!(schema[0][0].kind, Kind::Message(1));
        assert_eq!(schema[0][1].many, Many::Fixed(3));
        assert_eq!((schema[0][2].kind, schema[0][2].many), (Kind::Message(2), Many::Counted));
        assert_eq!(schema[0][3].kind, Kind::Text { wide: false });
    }

    #[test]
    fn a_message_that_contains_itself_is_refused() {
        assert!(read("a/B", "B b").is_err());
        assert!(read("a/B", "Missing m").unwrap_err().contains("Missing m"));
    }
}
