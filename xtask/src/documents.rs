//! Commands that README and documents show: every one of them names something that exists, and its arguments are understood.

use crate::process::{root, run};
use crate::targets::Targets;
use anyhow::{Context, Result};
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::Command;

/// A command, word by word.
type Words = Vec<String>;

/// Has the programs look at the arguments that the documents show: `--help` behind them ends a program before it does
/// anything, but not before it has understood what stands in front. To be called when all programs are built.
pub fn check_arguments() -> Result<()> {
    let (shown, targets) = (shown()?, Targets::read()?);
    let started: Vec<_> = shown.iter().filter_map(|words| started(words)).collect();
    for (program, arguments) in &started {
        let file = root().join("target/debug").join(program);
        let help = run(Command::new(file).args(*arguments).arg("--help").stdout(std::process::Stdio::null()));
        help.with_context(|| {
            format!("a document shows `{program} {}`: correct it there", arguments.join(" "))
        })?;
    }
    for words in &shown {
        exists(&targets, words)?;
    }
    println!("{} commands, {} of them started with --help", shown.len(), started.len());
    Ok(())
}

/// Program and arguments of `cargo run … --bin PROGRAM -- …` and of `cargo truing …`.
fn started(words: &[String]) -> Option<(&str, &[String])> {
    match words.get(1)?.as_str() {
        "truing" => Some(("truing", &words[2..])),
        "run" if !words.iter().any(|word| word == "--example") => {
            let split = words.iter().position(|word| word == "--").unwrap_or(words.len());
            let name = after(words, &["--bin"]).or_else(|| after(words, &["-p", "--package"]))?;
            Some((name, words.get(split + 1..).unwrap_or_default()))
        }
        _ => None,
    }
}

/// Fails unless package, program, test and the test's module of the command exist.
fn exists(targets: &Targets, words: &[String]) -> Result<()> {
    let Some(package) = after(words, &["-p", "--package"]) else {
        return Ok(());
    };
    targets.find(package, None)?;
    for (option, kind) in [("--bin", "bin"), ("--test", "test"), ("--example", "example")] {
        if let Some(name) = after(words, &[option]) {
            targets
                .find(package, Some((kind, name)))
                .with_context(|| format!("a document shows `{}`", words.join(" ")))?;
        }
    }
    if let (Some(test), Some(module)) = (after(words, &["--test"]), module(words)) {
        targets.find_module(package, test, module)?;
    }
    Ok(())
}

/// `module` of the filter `module::`, which picks the tests of one file.
fn module(words: &[String]) -> Option<&str> {
    words.iter().find_map(|word| word.strip_suffix("::"))
}

/// The word behind one of `options`.
fn after<'a>(words: &'a [String], options: &[&str]) -> Option<&'a str> {
    let place = words.iter().position(|word| options.contains(&word.as_str()))?;
    words.get(place + 1).map(String::as_str)
}

/// All commands of the documents, each once; decisions are left out.
fn shown() -> Result<BTreeSet<Words>> {
    let mut shown = BTreeSet::new();
    for path in documents()? {
        let text =
            std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
        shown.extend(commands(&text));
    }
    Ok(shown)
}

fn documents() -> Result<Vec<PathBuf>> {
    let mut paths = vec![root().join("README.md"), root().join("CONTRIBUTING.md")];
    for folder in ["docs", "docs/boards", "docs/results"] {
        let folder = root().join(folder);
        let entries =
            std::fs::read_dir(&folder).with_context(|| format!("cannot read {}", folder.display()))?;
        for entry in entries {
            let path = entry?.path();
            if path.extension().is_some_and(|ending| ending == "md") {
                paths.push(path);
            }
        }
    }
    Ok(paths)
}

/// Commands of a text in Markdown: lines of a block of code, and pieces of code in a line.
fn commands(text: &str) -> Vec<Words> {
    let text = text.replace("\\\n", " ");
    let mut found = Vec::new();
    let mut in_block = false;
    for line in text.lines() {
        if line.starts_with("```") {
            in_block = !in_block;
        } else if in_block {
            found.extend(command(line));
        } else {
            found.extend(pieces(line));
        }
    }
    found
}

/// Pieces of code in a line. In "`cargo xtask images`, `size`" the second replaces the last word of the first.
fn pieces(line: &str) -> Vec<Words> {
    let mut found: Vec<Words> = Vec::new();
    let mut listing = false;
    for (number, piece) in line.split('`').enumerate() {
        if number % 2 == 0 {
            listing &= piece == ", ";
        } else if let Some(words) = command(piece) {
            found.push(words);
            listing = true;
        } else if let Some(last) = found.last().filter(|_| listing) {
            let fore = last[..last.len() - 1].iter().cloned();
            found.push(fore.chain(split(piece)).collect());
        }
    }
    found
}

/// The command in a line of code, if there is one. What stands before it are a prompt and variables; a comment ends it,
/// and "…" stands for anything.
fn command(code: &str) -> Option<Words> {
    let start = code.match_indices("cargo ").map(|(place, _)| place).find(|place| {
        !code[..*place].ends_with(|before: char| before.is_alphanumeric() || "-_/".contains(before))
    })?;
    let words: Words = split(&code[start..]);
    (words.len() > 1).then_some(words)
}

/// Words without quotes and without the brackets of what may be left out, up to a comment, a pipe or a redirection.
fn split(code: &str) -> Words {
    code.split_whitespace()
        .take_while(|word| !word.starts_with(['#', '|']) && !word.contains(['…', '>']))
        .map(|word| word.trim_matches(['"', '[', ']']).replace("=\"", "="))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Arguments;
    use clap::Parser;

    #[test]
    fn commands_are_found_in_blocks_and_in_lines() {
        let text = "Type `cargo xtask images`, `flash [--dry-run]`, or nothing, `else`.\n\
                    ```\n$ cargo run -p a --bin b -- --x 1 \\\n    --y \"u=v\" | head   # words\ncargofoo\n```\n";
        let found: Vec<String> = commands(text).iter().map(|words| words.join(" ")).collect();
        let expected =
            ["cargo xtask images", "cargo xtask flash --dry-run", "cargo run -p a --bin b -- --x 1 --y u=v"];
        assert_eq!(found, expected);
        let words: Words = split(expected[2]);
        assert_eq!(started(&words).unwrap(), ("b", &split("--x 1 --y u=v")[..]));
    }

    #[test]
    fn packages_programs_and_tests_that_documents_show_exist() {
        let (shown, targets) = (shown().unwrap(), Targets::read().unwrap());
        assert!(shown.len() > 40, "{shown:?}");
        for words in &shown {
            exists(&targets, words).unwrap();
        }
        assert!(exists(&targets, &split("cargo test -p host-tests --test nothing")).is_err());
        assert!(exists(&targets, &split("cargo test -p host-tests --test chip nothing::")).is_err());
    }

    #[test]
    fn packages_and_programs_of_cargo_s_aliases_exist() {
        let targets = Targets::read().unwrap();
        let text = std::fs::read_to_string(root().join(".cargo/config.toml")).unwrap();
        let settings: toml::Table = text.parse().unwrap();
        let aliases = settings["alias"].as_table().unwrap();
        assert!(!aliases.is_empty());
        for (name, words) in aliases {
            let words = split(&format!("cargo {}", words.as_str().unwrap()));
            exists(&targets, &words).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }

    #[test]
    fn commands_of_xtask_that_documents_show_are_understood() {
        let shown = shown().unwrap();
        let ours: Vec<&Words> = shown.iter().filter(|words| words[1] == "xtask").collect();
        assert!(ours.len() > 6, "{ours:?}");
        for words in ours {
            Arguments::try_parse_from(&words[1..]).unwrap_or_else(|error| panic!("{words:?}: {error}"));
        }
    }
}
