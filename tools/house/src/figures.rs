//! All figures at once.

use crate::arrows::Package;
use crate::body::{self, Function};
use crate::floors::{self, Floors};
use crate::parts::{self, Part};
use crate::source::Source;
use anyhow::Result;
use std::path::Path;

/// Files that are longer than this are counted as long.
pub const LONG_FILE: usize = 400;

/// What the code base is today.
pub struct Figures {
    /// Library, image and workbench.
    pub product: [Part; 3],
    /// Proving ground, reference plant, formats, fleet, loop, exports, FMU, parameters, Python, page, tests, evaluation and tools.
    pub rest: [Part; 15],
}

impl Figures {
    /// Reads the project below `root`.
    pub fn read(root: &Path) -> Result<Self> {
        Ok(Self { product: parts::product(root)?, rest: parts::beside_product(root)? })
    }

    /// The packages with rooms: folder, package, floors.
    pub fn packages(&self) -> impl Iterator<Item = (&'static str, Package, Floors)> {
        floors::PACKAGES.into_iter().map(|(folder, name, floors)| {
            let parts = self.product.iter().chain(&self.rest).flat_map(|part| &part.sources);
            let own: Vec<&Source> = parts.filter(|source| source.path.starts_with(folder)).collect();
            (folder, Package::of(folder, name, &own), floors)
        })
    }

    /// Product files of more than [`LONG_FILE`] lines, the longest first.
    pub fn long_files(&self) -> Vec<&Source> {
        let sources = self.product.iter().flat_map(|part| &part.sources);
        let mut long: Vec<&Source> = sources.filter(|source| source.lines > LONG_FILE).collect();
        long.sort_by_key(|source| std::cmp::Reverse(source.lines));
        long
    }
}

/// The functions of a part.
pub fn functions(part: &Part) -> Vec<Function> {
    part.sources.iter().flat_map(body::functions).collect()
}
