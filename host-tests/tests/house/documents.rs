//! README and documents keep their word: shown commands print what is shown, links lead somewhere, and the tests that the
//! architecture names exist.
//!
//! A block marked `console` holds commands after `$ ` and their output. A line `…` stands for any lines. Numbers may
//! differ by [`TOLERANCE`]. A block under a comment `<!-- not run: REASON -->` is listed and left out. A block marked
//! `toml file=NAME` is written to NAME first, so that the commands use what the reader sees.

use regex::Regex;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::LazyLock;
use trials::firmware::{qemu, truing};

/// Relative difference that a shown number may have. Results repeat to the bit on one machine; another mathematical
/// library moves the last digits of a fit.
const TOLERANCE: f64 = 0.02;
/// Most words of README.md.
const README_WORDS: usize = 900;
/// Fewest blocks that have to run: below, the runner has lost its documents.
const FEWEST_BLOCKS: usize = 6;

/// `cargo truing` and `truing` are the program under test, with the tested image behind commands that drive a motor;
/// `cargo run` runs an example.
const SHELL: &str = r#"
truing() {
    case "$1" in
        commission|track|move|capture|monitor) "$TRUING" "$@" --image "$IMAGE" ;;
        *) "$TRUING" "$@" ;;
    esac
}
cargo() {
    case "$1" in
        truing) shift && truing "$@" ;;
        run) shift && (cd "$ROOT" && command "$CARGO" run --quiet "$@") ;;
        *) echo "not for this test: cargo $*" >&2 && false ;;
    esac
}
"#;

pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

/// Every Markdown file that people read, relative to the root.
fn documents() -> Vec<PathBuf> {
    let mut found = vec![PathBuf::from("README.md"), PathBuf::from("CONTRIBUTING.md")];
    collect(Path::new("docs"), &mut found);
    found.sort();
    found
}

pub fn collect(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(root().join(folder)).expect("a folder of documents") {
        let entry = entry.expect("an entry");
        let path = folder.join(entry.file_name());
        if entry.path().is_dir() {
            collect(&path, found);
        } else if path.extension().is_some_and(|ending| ending == "md") {
            found.push(path);
        }
    }
}

pub fn text(document: &Path) -> String {
    std::fs::read_to_string(root().join(document)).unwrap_or_else(|e| panic!("{}: {e}", document.display()))
}

/// A fenced block of a document.
struct Block {
    line: usize,
    /// What stands behind the fence, e.g. `console` or `toml file=axis.toml`.
    mark: String,
    /// Why it is not run, from the comment above it.
    not_run: Option<String>,
    body: Vec<String>,
}

fn blocks(text: &str) -> Vec<Block> {
    let (mut found, mut open, mut comment): (Vec<Block>, Option<Block>, Option<String>) =
        (vec![], None, None);
    for (index, line) in text.lines().enumerate() {
        match (&mut open, line.strip_prefix("```")) {
            (Some(_), Some(_)) => found.extend(open.take()),
            (Some(block), None) => block.body.push(line.to_owned()),
            (None, Some(mark)) => {
                open = Some(Block {
                    line: index + 1,
                    mark: mark.to_owned(),
                    not_run: comment.take(),
                    body: vec![],
                });
            }
            (None, None) => comment = reason(line),
        }
    }
    found
}

fn reason(line: &str) -> Option<String> {
    let words = line.strip_prefix("<!-- not run:")?.strip_suffix("-->")?.trim();
    Some(words.to_owned())
}

/// A command and the lines that it is to print.
struct Shown {
    command: String,
    output: Vec<String>,
}

/// Commands of a console block; a line that ends in `\` goes on in the next.
fn commands(body: &[String]) -> Vec<Shown> {
    let mut found: Vec<Shown> = Vec::new();
    let mut goes_on = false;
    for line in body {
        if goes_on {
            let last = found.last_mut().expect("a command goes on");
            last.command.push('\n');
            last.command.push_str(line);
        } else if let Some(command) = line.strip_prefix("$ ") {
            let (command, output) = (command.to_owned(), vec![]);
            found.push(Shown { command, output });
        } else {
            let last = found.last_mut().expect("a console block begins with a command");
            last.output.push(line.clone());
        }
        goes_on = line.ends_with('\\') && (goes_on || line.starts_with("$ "));
    }
    found
}

/// The folder in which the commands of one document run.
struct SimulatedServo {
    folder: tempfile::TempDir,
}

impl SimulatedServo {
    fn new() -> Self {
        let folder = tempfile::tempdir().expect("a temporary folder");
        for name in ["data", "workbench"] {
            std::os::unix::fs::symlink(root().join(name), folder.path().join(name)).expect("a link");
        }
        Self { folder }
    }

    /// Writes the file that the document shows.
    fn write(&self, name: &str, body: &[String]) {
        std::fs::write(self.folder.path().join(name), body.join("\n") + "\n").expect("a file");
    }

    /// Runs a command; what is wrong with its output, if anything is.
    fn run(&self, shown: &Shown) -> Option<String> {
        let mut shell = Command::new("sh");
        shell
            .args(["-c", &format!("{SHELL}{}", shown.command)])
            .current_dir(self.folder.path())
            .env("TRUING", truing().get_program())
            .env("CARGO", env!("CARGO"))
            .env("ROOT", root());
        if shown.command.contains("--motor") {
            shell.env("IMAGE", qemu().image);
        }
        let output = shell.output().expect("sh runs");
        let (printed, errors) =
            (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
        if shown.output.is_empty() && !output.status.success() {
            return Some(format!("$ {}\nfailed: {errors}", shown.command));
        }
        let expected: Vec<&str> = shown.output.iter().map(|line| line.trim_end()).collect();
        let actual: Vec<&str> = printed.trim_end().lines().map(str::trim_end).collect();
        (!expected.is_empty() && !matches(&expected, &actual))
            .then(|| format!("$ {}\nprints\n{printed}\n{errors}", shown.command))
    }
}

/// Whether the printed lines are the expected ones.
fn matches(expected: &[&str], actual: &[&str]) -> bool {
    match expected.split_first() {
        None => actual.iter().all(|line| line.is_empty()),
        Some((&"…", rest)) => (0..=actual.len()).any(|skipped| matches(rest, &actual[skipped..])),
        Some((line, rest)) => {
            let alike = |(first, others): (&&str, &[&str])| alike(line, first) && matches(rest, others);
            actual.split_first().is_some_and(alike)
        }
    }
}

/// Whether two lines differ by nothing but numbers within the tolerance, spaces and the lengths of bars.
fn alike(expected: &str, actual: &str) -> bool {
    static NUMBER: LazyLock<Regex> =
        LazyLock::new(|| Regex::new(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?").expect("a pattern"));
    static FILLING: LazyLock<Regex> = LazyLock::new(|| Regex::new(r"\s+|█+").expect("a pattern"));
    let words = |line: &str| FILLING.replace_all(&NUMBER.replace_all(line, "0"), " ").trim().to_owned();
    let numbers = |line: &str| -> Vec<String> {
        NUMBER.find_iter(line).map(|found| found.as_str().to_owned()).collect()
    };
    let mut pairs = numbers(expected).into_iter().zip(numbers(actual));
    words(expected) == words(actual) && pairs.all(|(a, b)| close(&a, &b))
}

/// Within the tolerance, or within one of the last printed digit.
fn close(expected: &str, actual: &str) -> bool {
    let (a, b): (f64, f64) = (expected.parse().expect("a number"), actual.parse().expect("a number"));
    let mantissa = expected.split('e').next().unwrap_or(expected);
    let digits = mantissa.split_once('.').map_or(0, |(_, decimals)| decimals.len() as i32);
    let last = if expected.contains('e') { 0.0 } else { 10f64.powi(-digits) };
    (a - b).abs() <= (TOLERANCE * a.abs()).max(1.001 * last)
}

#[test]
fn commands_in_documents_print_what_is_shown() {
    let (mut wrong, mut ran, mut left_out) = (vec![], 0, vec![]);
    for document in documents() {
        let mut servo_under_test = None;
        for block in blocks(&text(&document)) {
            let place = format!("{}:{}", document.display(), block.line);
            if let Some(name) = block.mark.strip_prefix("toml file=") {
                servo_under_test.get_or_insert_with(SimulatedServo::new).write(name, &block.body);
            } else if let (true, Some(reason)) = (block.mark == "console", &block.not_run) {
                assert!(!reason.is_empty(), "{place}: say why it is not run");
                left_out.push(format!("{place}: not run: {reason}"));
            } else if block.mark == "console" {
                ran += 1;
                let servo_under_test = servo_under_test.get_or_insert_with(SimulatedServo::new);
                let found = commands(&block.body);
                wrong.extend(
                    found
                        .iter()
                        .filter_map(|shown| Some(format!("{place}\n{}", servo_under_test.run(shown)?))),
                );
            }
        }
    }
    println!("{ran} blocks run, {} not:\n{}", left_out.len(), left_out.join("\n"));
    assert!(wrong.is_empty(), "{}", wrong.join("\n\n"));
    assert!(ran >= FEWEST_BLOCKS, "{ran} blocks ran");
}

#[test]
fn output_is_compared_line_by_line_with_numbers_within_the_tolerance() {
    let actual = ["gap  3.820  ██████", "", "a", "fit 60.30 % → 98.49 %"];
    assert!(matches(&["gap 3.82 ███", "…", "fit 60.3 % → 98.9 %"], &actual));
    assert!(!matches(&["gap 3.82 ███", "…", "fit 65.3 % → 98.9 %"], &actual));
    assert!(!matches(&["gap 3.82 ███", "fit 60.3 % → 98.9 %"], &actual));
    assert!(!matches(&["…", "gap -3.82 ███", "…"], &actual));
    assert!(!matches(&["gap 3.82 ███"], &actual), "nothing is left out in silence");
    assert!(alike("1.59e-5 V", "1.60e-5 V") && !alike("1.59e-5 V", "1.70e-5 V"));
    assert!(alike("took 5.01 s", "took 5.02 s") && !alike("not_seen", "trusted"));
}

#[test]
fn a_command_goes_on_behind_a_backslash_and_a_comment_leaves_a_block_out() {
    let text = "<!-- not run: needs a board -->\n```console\n$ a \\\n    b\nout\n$ c\n```\n```text\nx\n```\n";
    let found = blocks(text);
    assert_eq!(found.len(), 2);
    assert_eq!(found[0].not_run.as_deref(), Some("needs a board"));
    assert_eq!(found[1].not_run, None);
    let commands = commands(&found[0].body);
    assert_eq!(commands[0].command, "a \\\n    b");
    assert_eq!((commands[0].output.len(), commands[1].command.as_str()), (1, "c"));
}

#[test]
fn links_between_documents_lead_to_files() {
    let link = Regex::new(r"\]\(([^)#\s]+)").expect("a pattern");
    let mut dead = Vec::new();
    for document in documents() {
        let text = text(&document);
        let folder = root().join(document.parent().expect("a folder"));
        for target in link.captures_iter(&text).map(|found| found[1].to_owned()) {
            if !target.contains("://") && !folder.join(&target).exists() {
                dead.push(format!("{}: {target}", document.display()));
            }
        }
    }
    assert!(dead.is_empty(), "{}", dead.join("\n"));
}

#[test]
fn tests_that_the_architecture_names_exist() {
    let named = Regex::new(r"`([a-z][a-z0-9]*(?:_[a-z0-9]+){2,})`").expect("a pattern");
    let architecture = text(Path::new("docs/architecture.md"));
    let invariants = architecture.split("## Invariants").nth(1).expect("a section of invariants");
    let invariants = invariants.split("\n## ").next().unwrap_or(invariants);
    let names: BTreeSet<&str> =
        named.captures_iter(invariants).map(|found| found.get(1).expect("a name").as_str()).collect();
    assert!(names.len() >= 8, "{names:?}");
    let mut sources = String::new();
    for folder in ["host-tests", "src", "tools", "workbench", "xtask"] {
        read_sources(&root().join(folder), &mut sources);
    }
    let missing = names.iter().filter(|name| !sources.contains(&format!("fn {name}(")));
    assert_eq!(missing.collect::<Vec<_>>(), Vec::<&&str>::new());
}

fn read_sources(folder: &Path, sources: &mut String) {
    for entry in std::fs::read_dir(folder).expect("a folder of sources") {
        let path = entry.expect("an entry").path();
        if path.is_dir() && path.file_name().is_some_and(|name| name != "target") {
            read_sources(&path, sources);
        } else if path.extension().is_some_and(|ending| ending == "rs") {
            sources.push_str(&std::fs::read_to_string(&path).expect("a source"));
        }
    }
}

#[test]
fn readme_is_short() {
    let words = text(Path::new("README.md")).split_whitespace().count();
    assert!(words <= README_WORDS, "{words} words");
}
