//! From one function of the image along every call.

use crate::image::{Function, Image};
use addr2line::Loader;
use anyhow::{Result, anyhow};
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;

/// Functions that only ever panic, by the beginning of their names.
const PANICS: [&str; 12] = [
    "core::panicking::",
    "core::option::expect_failed",
    "core::option::unwrap_failed",
    "core::result::unwrap_failed",
    "core::slice::index::slice_",
    "core::slice::copy_from_slice_impl::len_mismatch_fail",
    "core::slice::<impl [T]>::copy_from_slice::len_mismatch_fail",
    "core::str::slice_error_fail",
    "core::cell::panic_",
    "rust_begin_unwind",
    "__rustc::rust_begin_unwind",
    "core::num::",
];

/// What a call by register is listed as.
pub const BY_REGISTER: &str = "a call by register";

/// A way to a panic: which function, as written in the sources, and what it calls.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Finding {
    /// The function in the sources, inlined or not.
    pub function: String,
    /// The panic, or [`BY_REGISTER`].
    pub panic: String,
}

/// What the walk saw.
#[derive(Debug, Default)]
pub struct Walk {
    /// Functions of the image that were visited.
    pub functions: usize,
    /// Findings, each with its places in the sources.
    pub findings: BTreeMap<Finding, BTreeSet<String>>,
}

/// Walks from the function `root` of the image at `path`.
pub fn walk(path: &Path, root: &str) -> Result<Walk> {
    let image = Image::read(path)?;
    let lines = Lines::of(path)?;
    let root = image.named(root).ok_or_else(|| anyhow!("the image has no function {root}"))?;
    let (mut seen, mut queue) = (BTreeSet::from([root.start]), VecDeque::from([root]));
    let mut walk = Walk::default();
    while let Some(function) = queue.pop_front() {
        walk.functions += 1;
        for branch in image.branches(function) {
            let callee = branch.to.and_then(|to| image.at(to));
            match callee {
                Some(callee) if !panics(callee) => {
                    if seen.insert(callee.start) {
                        queue.push_back(callee);
                    }
                }
                _ => {
                    let panic = callee.map_or(BY_REGISTER, |callee| &callee.name).to_string();
                    let (inner, place) = lines.of_address(branch.at, &function.name);
                    walk.findings.entry(Finding { function: inner, panic }).or_default().insert(place);
                }
            }
        }
    }
    Ok(walk)
}

/// Does it only ever panic?
pub(crate) fn panics(function: &Function) -> bool {
    PANICS.iter().any(|start| function.name.starts_with(start))
}

/// Debug information.
struct Lines(Loader);

impl Lines {
    fn of(path: &Path) -> Result<Self> {
        Loader::new(path).map(Self).map_err(|error| anyhow!("{}: {error}", path.display()))
    }

    /// The innermost function outside `core`, and its place in the sources.
    fn of_address(&self, address: u32, otherwise: &str) -> (String, String) {
        let mut found = (otherwise.to_string(), String::new());
        let Ok(mut frames) = self.0.find_frames(u64::from(address)) else {
            return found;
        };
        while let Ok(Some(frame)) = frames.next() {
            let name = frame.function.as_ref().and_then(|name| name.demangle().ok()).unwrap_or_default();
            let name = without_hash(&name);
            let place = frame.location.map(|location| {
                let file = location.file.unwrap_or_default();
                format!("{}:{}", file.rsplit("/").next().unwrap_or(file), location.line.unwrap_or(0))
            });
            found = (name.to_string(), place.unwrap_or_default());
            if !(name.starts_with("core::") || name.starts_with("<core::") || name.contains("as core::")) {
                break;
            }
        }
        found
    }
}

/// `module::function::h0123456789abcdef` without its last part.
fn without_hash(name: &str) -> &str {
    match name.rsplit_once("::h") {
        Some((rest, hash)) if hash.len() == 16 && hash.chars().all(|c| c.is_ascii_hexdigit()) => rest,
        _ => name,
    }
}
