//! Source files as the compiler reads them.

use crate::code;
use anyhow::{Context, Result};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use walkdir::WalkDir;

/// One file.
pub struct Source {
    /// Its path from the project's folder.
    pub path: PathBuf,
    /// All of its lines, comments and tests included.
    pub lines: usize,
    /// The numbers of its lines of code, from 1: no comments, no documentation, no blank lines, no test modules.
    pub code: BTreeSet<usize>,
    /// What the parser made of it.
    pub tree: syn::File,
}

impl Source {
    /// Reads `path`, which is relative to `root`.
    pub fn read(root: &Path, path: PathBuf) -> Result<Self> {
        let text = std::fs::read_to_string(root.join(&path))
            .with_context(|| format!("cannot read {}", path.display()))?;
        let tree = syn::parse_file(&text).with_context(|| format!("{} is not Rust", path.display()))?;
        let tokens = text.parse().map_err(|error| anyhow::anyhow!("{}: {error}", path.display()))?;
        Ok(Self { path, lines: text.lines().count(), code: code::lines(tokens, &tree), tree })
    }
}

/// A test module in a file of its own, as `#[cfg(test)] mod tests;` names it: no code, like those within a file.
const TESTS: &str = "tests.rs";

/// Every Rust file below `folder`, by path, but test modules in sources. A folder that does not exist holds none.
pub fn below(root: &Path, folder: &str) -> Result<Vec<Source>> {
    let start = root.join(folder);
    if !start.exists() {
        return Ok(Vec::new());
    }
    let mut sources = Vec::new();
    for entry in WalkDir::new(start).sort_by_file_name() {
        let entry = entry?;
        let is_rust = entry.path().extension().is_some_and(|ending| ending == "rs");
        if is_rust && (entry.file_name() != TESTS || !folder.ends_with("src")) {
            let path = entry.path().strip_prefix(root)?.to_owned();
            sources.push(Source::read(root, path)?);
        }
    }
    Ok(sources)
}
