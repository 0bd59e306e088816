//! The parts of the project that figures are given for.

use crate::source::{self, Source};
use anyhow::Result;
use std::path::Path;

/// One part.
pub struct Part {
    /// Its name in tables.
    pub name: &'static str,
    /// Its files.
    pub sources: Vec<Source>,
}

impl Part {
    /// Lines of code.
    pub fn code(&self) -> usize {
        self.sources.iter().map(|source| source.code.len()).sum()
    }
}

/// Folders of the workbench's crates: engine, files, reports, the servo's host side, command line.
const WORKBENCH: [&str; 5] = [
    "workbench/core/src",
    "workbench/files/src",
    "workbench/report/src",
    "workbench/servo/src",
    "workbench/src",
];

/// What users run: library, image and workbench.
pub fn product(root: &Path) -> Result<[Part; 3]> {
    let [library, image] = chip(root)?;
    let crates: Result<Vec<_>> = WORKBENCH.iter().map(|folder| source::below(root, folder)).collect();
    let workbench = Part { name: "workbench", sources: crates?.into_iter().flatten().collect() };
    Ok([library, image, workbench])
}

/// Everything else that is built.
pub fn beside_product(root: &Path) -> Result<[Part; 15]> {
    Ok([
        part(root, "proving ground", "workbench/proving/src")?,
        part(root, "reference plant", "workbench/reference_plant/src")?,
        part(root, "formats of logs", "workbench/formats/src")?,
        part(root, "fleet", "workbench/fleet/src")?,
        part(root, "loop", "workbench/improve/src")?,
        part(root, "exports", "workbench/export/src")?,
        part(root, "FMU", "workbench/fmu/src")?,
        part(root, "parameters", "workbench/params/src")?,
        part(root, "Python package", "workbench/python/src")?,
        part(root, "page in the browser", "workbench/page/src")?,
        part(root, "tests", "host-tests/tests")?,
        part(root, "trials", "trials/src")?,
        part(root, "evaluation", "evaluation")?,
        part(root, "tools", "tools")?,
        part(root, "xtask", "xtask/src")?,
    ])
}

fn part(root: &Path, name: &'static str, folder: &str) -> Result<Part> {
    let sources = source::below(root, folder)?;
    Ok(Part { name, sources })
}

/// Library and image share `src/`: what `lib.rs` declares is the library, the other files are the image.
fn chip(root: &Path) -> Result<[Part; 2]> {
    let sources = source::below(root, "src")?;
    let declared = declared(root)?;
    let is_library = |source: &Source| {
        let top = top_room(&source.path, Path::new("src"));
        top.is_none_or(|room| declared.contains(&room)) && !source.path.ends_with("main.rs")
    };
    let (library, image) = sources.into_iter().partition(is_library);
    Ok([Part { name: "library", sources: library }, Part { name: "image", sources: image }])
}

/// Modules that `src/lib.rs` declares.
fn declared(root: &Path) -> Result<Vec<String>> {
    let library = Source::read(root, "src/lib.rs".into())?;
    let modules = library.tree.items.iter().filter_map(|item| match item {
        syn::Item::Mod(module) => Some(module.ident.to_string()),
        _ => None,
    });
    Ok(modules.collect())
}

/// The room that a file belongs to: the first name of its path below `folder`; `None` for the roots of a package.
pub fn top_room(path: &Path, folder: &Path) -> Option<String> {
    let first = path.strip_prefix(folder).ok()?.iter().next()?;
    let name = first.to_str()?.trim_end_matches(".rs");
    (!["lib", "main", "mod"].contains(&name)).then(|| name.to_owned())
}
