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
    /// Reference plant, tests, evaluation and tools.
    pub rest: [Part; 6],
    /// Rooms of the workbench.
    pub workbench: Package,
    /// Rooms of `src`, library and image together.
    pub chip: Package,
}

impl Figures {
    /// Reads the project below `root`.
    pub fn read(root: &Path) -> Result<Self> {
        let product = parts::product(root)?;
        let [library, image, workbench] = &product;
        let chip: Vec<&Source> = library.sources.iter().chain(&image.sources).collect();
        let bench: Vec<&Source> = workbench.sources.iter().collect();
        Ok(Self {
            workbench: Package::of("workbench/src", "truing", &bench),
            chip: Package::of("src", "servo", &chip),
            rest: parts::rest(root)?,
            product,
        })
    }

    /// The packages with rooms: folder, package, floors.
    pub fn packages(&self) -> [(&str, &Package, Floors); 2] {
        [("workbench/src", &self.workbench, floors::WORKBENCH), ("src", &self.chip, floors::CHIP)]
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
