//! Constants of the search say where they come from.

use crate::invariants::sources;
use regex::Regex;

/// How a constant tells its origin: a study, a derivation or a source behind the first, or that nobody studied it.
const ORIGINS: [&str; 2] = ["Origin:", "judgement"];

/// Names and documentation of the constants that are numbers and do not follow from other constants. One without a
/// documentation of its own has that of the constant above it.
fn constants(text: &str) -> Vec<(String, String)> {
    let number = r"^(?:pub(?:\(\w+\))? )?const (\w+): [^=]*?\b(?:f32|f64|[iu]\d+|usize)\b([^=]*)= *(.*)$";
    let (number, other) =
        (Regex::new(number).expect("a pattern"), Regex::new(r"\b[A-Z][A-Z_0-9]+\b").expect("a pattern"));
    let (mut found, mut documentation, mut complete) = (vec![], String::new(), false);
    for line in text.split("#[cfg(test)]\nmod tests {").next().unwrap_or(text).lines().map(str::trim) {
        if let Some(said) = line.strip_prefix("///") {
            if std::mem::take(&mut complete) {
                documentation.clear();
            }
            documentation.push_str(said);
        } else if let Some(constant) = number.captures(line) {
            complete = true;
            let value = &constant[3];
            let stated =
                value.contains(|letter: char| letter.is_ascii_digit()) || value.ends_with(['[', '{']);
            if stated && !line.contains("str") && !other.is_match(value) {
                found.push((constant[1].to_owned(), documentation.clone()));
            }
        } else if !line.starts_with("#[") {
            documentation.clear();
        }
    }
    found
}

#[test]
fn every_constant_of_the_core_tells_its_origin() {
    let (mut all, mut judged, mut lacking) = (0, 0, vec![]);
    for (path, text) in sources("workbench/core/src") {
        if path.ends_with("tests.rs") {
            continue;
        }
        for (name, documentation) in constants(&text) {
            all += 1;
            judged += usize::from(!documentation.contains(ORIGINS[0]));
            if !ORIGINS.iter().any(|origin| documentation.contains(origin)) {
                lacking.push(format!("{}: {name}", path.display()));
            }
        }
    }
    println!("{all} constants; {} with a study, derivation or source, {judged} by judgement", all - judged);
    assert!(all > 300, "{all} constants");
    assert!(lacking.is_empty(), "say where it comes from:\n{}", lacking.join("\n"));
}

#[test]
fn a_constant_that_follows_from_others_needs_no_origin() {
    let text =
        "/// A.\nconst A: f64 = 2.0;\nconst B: [usize; 2] = [1, 2];\n\n/// C.\nconst C: f64 = 2.0 * A_B;\n";
    let found = constants(text);
    assert_eq!(found, [("A".into(), " A.".into()), ("B".into(), " A.".into())]);
}
