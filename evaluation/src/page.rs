//! Printed text that can also be kept in a file.

use crate::section;
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::process::Command;
use time::OffsetDateTime;

/// The option of every suite.
#[derive(clap::Args, Debug)]
pub struct Results {
    /// Keep what is printed in `<suite>.md` of this folder, below date, commit, command and seeds; the same command
    /// replaces what it has written before.
    #[arg(long, value_name = "DIR")]
    results: Option<PathBuf>,
}

impl Results {
    /// Begins to print.
    pub fn page(&self) -> Page {
        Page { folder: self.results.clone(), text: String::new() }
    }
}

/// What a suite has printed so far.
pub struct Page {
    folder: Option<PathBuf>,
    text: String,
}

impl Page {
    /// Prints a line.
    pub fn line(&mut self, line: impl Display) {
        self.print(format_args!("{line}\n"));
    }

    /// Prints a text that brings its line ends.
    pub fn print(&mut self, text: impl Display) {
        let text = text.to_string();
        print!("{text}");
        self.text.push_str(&text);
    }

    /// Writes the file if one was asked for. `seeds` says which plants or cases were drawn.
    ///
    /// A file that cannot be written ends the program with exit status 2.
    pub fn close(self, seeds: &str) {
        let Some(folder) = &self.folder else {
            return;
        };
        if let Err(error) = self.write(folder, seeds) {
            eprintln!("error: cannot write the results into {}: {error}", folder.display());
            std::process::exit(2);
        }
    }

    fn write(&self, folder: &Path, seeds: &str) -> std::io::Result<()> {
        let suite = suite();
        let file = folder.join(format!("{suite}.md"));
        let before = match std::fs::read_to_string(&file) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                format!("# Results of the suite `{suite}`\n")
            }
            Err(error) => return Err(error),
        };
        let facts = format!(
            "| date | commit | seeds |\n|---|---|---|\n| {} | {} | {seeds} |\n",
            OffsetDateTime::now_utc().date(),
            commit()
        );
        let section = format!("{facts}\n{}", self.text.trim_end());
        std::fs::create_dir_all(folder)?;
        std::fs::write(file, section::replaced(&before, &command(), &section))
    }
}

/// Name of the suite.
fn suite() -> String {
    std::env::args().nth(1).unwrap_or_default()
}

/// The command as a person would type it, without `--results`.
fn command() -> String {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    format!("cargo run -p evaluation -- {}", without_results(&arguments).join(" "))
}

fn without_results(arguments: &[String]) -> Vec<&str> {
    let mut arguments = arguments.iter().map(String::as_str);
    let mut kept = Vec::new();
    while let Some(argument) = arguments.next() {
        match argument {
            "--results" => drop(arguments.next()),
            _ if argument.starts_with("--results=") => {}
            _ => kept.push(argument),
        }
    }
    kept
}

/// The commit of the sources, marked when they were changed since.
fn commit() -> String {
    let git = Command::new("git")
        .args(["describe", "--always", "--dirty=, changed since", "--abbrev=7", "--exclude=*"])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output();
    let text = git.ok().filter(|output| output.status.success());
    let text = text.and_then(|output| String::from_utf8(output.stdout).ok());
    text.map_or("unknown".into(), |text| text.trim().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_leaves_out_where_it_was_kept() {
        let arguments = ["--plants", "3", "--results", "docs", "--results=x", "--blind"].map(String::from);
        assert_eq!(without_results(&arguments), ["--plants", "3", "--blind"]);
    }
}
