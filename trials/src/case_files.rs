//! A hidden case as a user's files: written, and read back by the workbench.

use std::error::Error;
use std::path::Path;
use truing::files::log::{self, Columns, Dynamic, Log};
use truing::files::model::{self, Model};
use truing::synthetic::cases::Case;
use truing::synthetic::cases::sheet::Sheet;

/// What the analysis gets of a case.
pub struct Opened {
    /// The model file.
    pub model: Model,
    /// The log.
    pub log: Dynamic,
    /// The hold-out.
    pub holdout: Dynamic,
}

/// Writes the files of a case and reads them.
pub fn opened(case: &Case) -> Result<Opened, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let model = folder.path().join("model.toml");
    std::fs::write(&model, &case.model)?;
    Ok(Opened {
        model: model::read(&model)?,
        log: recorded(&case.log, &folder.path().join("log.csv"))?,
        holdout: recorded(&case.holdout, &folder.path().join("holdout.csv"))?,
    })
}

/// Writes a record into a file and reads it.
pub fn recorded(sheet: &Sheet, path: &Path) -> Result<Dynamic, Box<dyn Error>> {
    std::fs::write(path, sheet.to_csv())?;
    match log::read(path, &"".parse::<Columns>()?)? {
        Log::Dynamic(log) => Ok(log),
        Log::Table(_) => Err("read as a table".into()),
    }
}
