//! Outside the library an effect is a static, never a name: who adds one need not look for lists of names, and a name that
//! is misspelt does not compile. These tests read the string literals of the product's code, as a compiler would.

use proc_macro2::{Delimiter, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use truing::system::effects::LIBRARY;

/// Product code.
const ROOMS: [&str; 18] = [
    "src",
    "workbench/src",
    "workbench/core/src",
    "workbench/files/src",
    "workbench/formats/src",
    "workbench/fleet/src",
    "workbench/params/src",
    "workbench/improve/src",
    "workbench/export/src",
    "workbench/fmu/src",
    "workbench/python/src",
    "workbench/page/src",
    "workbench/report/src",
    "workbench/servo/src",
    "workbench/proving/src",
    "xtask/src",
    "trials/src",
    "evaluation/src",
];

/// The library itself, and the reader of model files: `drive_gain` and `inertia` are keys and a kind of a model as well.
const AT_HOME: [&str; 2] = ["workbench/core/src/system/effects", "workbench/core/src/system/model"];

/// Places where such a word means something else, with the reason.
const OTHER_MEANINGS: [(&str, &str); 7] = [
    // A kind of table that the evaluation draws: a label beside "offset" and "zone+limit".
    ("evaluation/src/suites/steady_accuracy.rs", "dead_zone"),
    // Elements and attributes of MJCF and URDF.
    ("workbench/export/src/held.rs", "resistance"),
    ("workbench/export/src/held.rs", "inertia"),
    ("workbench/export/src/held.rs", "cogging"),
    ("workbench/export/src/import.rs", "resistance"),
    ("workbench/export/src/import.rs", "inertia"),
    ("workbench/export/src/urdf.rs", "inertia"),
];

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// The Rust files below a folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let paths = entries.map(|entry| entry.unwrap().path());
    let (folders, files): (Vec<_>, Vec<_>) = paths.partition(|path| path.is_dir());
    let rust = files.into_iter().filter(|path| path.extension().is_some_and(|end| end == "rs"));
    rust.chain(folders.iter().flat_map(|folder| self::files(folder))).collect()
}

/// The string literals of a stream, those of documentation and of what is compiled for tests alone left out.
fn literals(stream: TokenStream, found: &mut Vec<String>) {
    let mut tokens = stream.into_iter().peekable();
    while let Some(token) = tokens.next() {
        match token {
            TokenTree::Punct(mark) if mark.as_char() == '#' => match tokens.next_if(is_attribute) {
                Some(TokenTree::Group(attribute)) if is_test(&attribute.stream()) => skip_item(&mut tokens),
                Some(TokenTree::Group(attribute)) if !is_doc(&attribute.stream()) => {
                    literals(attribute.stream(), found)
                }
                _ => (),
            },
            TokenTree::Group(group) => literals(group.stream(), found),
            TokenTree::Literal(literal) => found.extend(text(&literal.to_string())),
            _ => (),
        }
    }
}

fn is_attribute(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Group(group) if group.delimiter() == Delimiter::Bracket)
}

fn is_doc(attribute: &TokenStream) -> bool {
    attribute.to_string().starts_with("doc")
}

fn is_test(attribute: &TokenStream) -> bool {
    attribute.to_string().replace(' ', "") == "cfg(test)"
}

/// Skips an item, as far as its body or its semicolon.
fn skip_item(tokens: &mut impl Iterator<Item = TokenTree>) {
    let _ = tokens.find(|token| match token {
        TokenTree::Group(group) => group.delimiter() == Delimiter::Brace,
        TokenTree::Punct(mark) => mark.as_char() == ';',
        _ => false,
    });
}

/// The text of a literal, if it is a string.
fn text(literal: &str) -> Option<String> {
    syn::parse_str::<syn::LitStr>(literal).ok().map(|text| text.value())
}

/// Every place outside the library where a name of an effect stands as a string, as `path: name`.
fn strays() -> Vec<String> {
    let names: BTreeSet<&str> = LIBRARY.iter().map(|effect| effect.name).collect();
    let root = root();
    let mut strays = Vec::new();
    for path in ROOMS.iter().flat_map(|room| files(&root.join(room))) {
        let shown = path.strip_prefix(&root).unwrap().display().to_string();
        if AT_HOME.iter().any(|home| shown.starts_with(home)) {
            continue;
        }
        let source = std::fs::read_to_string(&path).unwrap();
        let stream: TokenStream = source.parse().unwrap_or_else(|error| panic!("{shown}: {error}"));
        let mut found = Vec::new();
        literals(stream, &mut found);
        found.retain(|literal| names.contains(literal.as_str()));
        found.retain(|literal| !OTHER_MEANINGS.contains(&(shown.as_str(), literal.as_str())));
        strays.extend(found.iter().map(|name| format!("{shown}: {name}")));
    }
    strays
}

#[test]
fn no_effect_is_called_by_a_string_outside_the_library() {
    let strays = strays();
    assert!(strays.is_empty(), "{} names; write effects::NAME instead:\n{}", strays.len(), strays.join("\n"));
}

/// The statics of type `Effect` in the library's files.
fn statics() -> BTreeSet<String> {
    let files = files(&root().join(AT_HOME[0]));
    let sources = files.iter().map(|path| std::fs::read_to_string(path).unwrap());
    let names = |source: String| {
        let lines = source.lines().filter_map(|line| line.strip_prefix("pub static "));
        let effects = lines.filter_map(|line| line.strip_suffix(": Effect = Effect {"));
        effects.map(str::to_owned).collect::<Vec<_>>()
    };
    sources.flat_map(names).collect()
}

#[test]
fn every_effect_of_a_file_is_in_the_library_under_its_own_name() {
    let library: BTreeSet<String> = LIBRARY.iter().map(|effect| effect.name.to_uppercase()).collect();
    assert_eq!(statics(), library);
    assert_eq!(library.len(), LIBRARY.len(), "no effect twice");
}

#[test]
fn the_reader_sees_strings_and_neither_comments_nor_tests() {
    let source = r##"
        /// "gravity" in a comment, and "inertia".
        #[serde(rename = "cogging")]
        fn shown() { out!("{}", r"backlash"); matches!(name, "resistance" | "motor_gain") } // "supply_sag"
        #[cfg(test)]
        mod tests { const HIDDEN: &str = "dead_zone"; }
        const LAST: char = 'g';
        const KEY: &str = "sensor_\x6cag";
    "##;
    let mut found = Vec::new();
    literals(source.parse().unwrap(), &mut found);
    let expected = ["cogging", "{}", "backlash", "resistance", "motor_gain", "sensor_lag"];
    assert_eq!(found, expected);
}
