//! Files that appear complete or not at all.

use super::files::folder_of;
use super::interrupt;
use anyhow::{Context, Result};
use std::fs::Permissions;
use std::io::Write;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;

/// Writes `text` to `path` by way of a temporary file in the same folder; an earlier file stays until the new one is
/// complete. `-` is standard output. The folder is made if it is missing. What is no file (a device, a pipe) is written to, and never replaced.
pub fn write_atomically(path: &Path, text: &str) -> Result<()> {
    if path == Path::new("-") {
        crate::out!("{text}");
        return Ok(());
    }
    write_bytes(path, text.as_bytes())
}

/// The same of what is no text, to a file.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<()> {
    if path.exists() && !path.is_file() {
        return std::fs::OpenOptions::new()
            .write(true)
            .open(path)
            .and_then(|mut place| place.write_all(bytes))
            .with_context(|| format!("{}: cannot be written", path.display()));
    }
    let folder = folder_of(path);
    let complaint = || format!("{}: cannot be written; check the folder and its permissions", path.display());
    // A signal ends the program before or after, so that no draft stays.
    let hold = interrupt::hold();
    let written =
        std::fs::create_dir_all(folder).and_then(|()| replace(path, folder, bytes)).with_context(complaint);
    drop(hold);
    interrupt::heed_what_came();
    written
}

fn replace(path: &Path, folder: &Path, bytes: &[u8]) -> std::io::Result<()> {
    let mut draft = tempfile::Builder::new().prefix(".truing-").tempfile_in(folder)?;
    draft.write_all(bytes)?;
    // A temporary file is private to its owner; a report is not.
    draft.as_file().set_permissions(Permissions::from_mode(0o644))?;
    // The error of `persist` owns the draft; only its cause is passed on, so that the draft is removed.
    draft.persist(path).map(|_| ()).map_err(|error| error.error)
}
