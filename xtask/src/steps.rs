//! The steps of a long command: a heading for each, and at its end where the time went.

use crate::process::root;
use anyhow::{Context, Result};
use std::process::Command;
use std::time::{Duration, Instant};

/// Steps shorter than this are not listed.
const LISTED: Duration = Duration::from_secs(5);

/// What has been done, and since when.
pub struct Steps {
    begin: Instant,
    headings: Vec<(String, Instant)>,
}

impl Steps {
    pub fn begin() -> Self {
        Self { begin: Instant::now(), headings: Vec::new() }
    }

    /// The next one begins.
    pub fn next(&mut self, heading: &str) {
        println!("── {heading}");
        self.headings.push((heading.to_string(), Instant::now()));
    }

    /// Where the time went, and how long it was.
    pub fn close(&self) {
        let ends = self.headings.iter().skip(1).map(|(_, begin)| *begin).chain([Instant::now()]);
        for ((heading, begin), end) in self.headings.iter().zip(ends) {
            let spent = end - *begin;
            if spent >= LISTED {
                println!("{:6.0} s  {heading}", spent.as_secs_f64());
            }
        }
        println!("── all checks passed in {:.0} s", self.begin.elapsed().as_secs_f64());
    }
}

/// Writes the hash of the tree that has passed into `target/green`. A tree with changes that are not committed has none.
pub fn mark_green() -> Result<()> {
    let path = root().join("target/green");
    match (git(&["status", "--porcelain"]), git(&["rev-parse", "HEAD^{tree}"])) {
        (Some(changes), Some(tree)) if changes.is_empty() => {
            std::fs::write(&path, tree + "\n").with_context(|| format!("cannot write {}", path.display()))
        }
        _ => Ok(()),
    }
}

/// What git says; `None`: it is not there, or this is no repository.
fn git(arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").args(arguments).current_dir(root()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim().to_string())
}
