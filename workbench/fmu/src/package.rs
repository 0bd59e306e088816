//! Packs an FMU.

use crate::description::{Version, xml};
use crate::{LIBRARY, MODEL, variables};
use std::env::consts::{ARCH, DLL_EXTENSION, DLL_PREFIX, DLL_SUFFIX, OS};
use std::io::{Cursor, Write};
use std::path::{Path, PathBuf};
use truing_core::system::model::Model;
use truing_core::text::input_error::InputError;
use zip::ZipWriter;
use zip::result::ZipResult;
use zip::write::SimpleFileOptions;

/// Where the library is, for programs that do not lie beside it.
pub const VARIABLE: &str = "TRUING_FMU_LIBRARY";

/// The bytes of an FMU of a model. `library`: what [`library`] found.
pub fn packed(model: &Model, version: Version, library: &Path) -> Result<Vec<u8>, InputError> {
    let binary = std::fs::read(library).map_err(|error| InputError::unreadable(library.display(), error))?;
    let variables = variables::of(model)?;
    let text =
        |key: &str| model.texts.iter().find(|it| it.0.is_empty() && it.1 == key).map(|it| it.2.as_str());
    let about = text("description").or(text("id")).unwrap_or("A motor model of Truing");
    let description = xml(version, &model.source_text, about, &variables)
        .map_err(|error| InputError::file("modelDescription.xml", error))?;
    let files = [
        ("modelDescription.xml".to_owned(), description.as_slice()),
        (format!("binaries/{}/{LIBRARY}.{DLL_EXTENSION}", platform(version)), &binary),
        (MODEL.to_owned(), model.source_text.as_bytes()),
    ];
    zipped(&files).map_err(|error| InputError::file(&model.source, format!("cannot be packed ({error})")))
}

fn zipped(files: &[(String, &[u8])]) -> ZipResult<Vec<u8>> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(name, SimpleFileOptions::default())?;
        zip.write_all(bytes)?;
    }
    Ok(zip.finish()?.into_inner())
}

/// The folder of this machine's library.
fn platform(version: Version) -> String {
    match (version, OS) {
        (Version::Two, "macos") => "darwin64".into(),
        (Version::Two, "windows") => "win64".into(),
        (Version::Two, _) => "linux64".into(),
        (Version::Three, "macos") => format!("{ARCH}-darwin"),
        (Version::Three, os) => format!("{ARCH}-{os}"),
    }
}

/// The library: the one that is given, or named by [`VARIABLE`], or beside the program.
pub fn library(given: Option<&Path>) -> Result<PathBuf, InputError> {
    let named = given.map(Path::to_owned).or_else(|| std::env::var_os(VARIABLE).map(PathBuf::from));
    let path = named.unwrap_or_else(|| {
        let folder = std::env::current_exe().ok().and_then(|program| Some(program.parent()?.to_owned()));
        folder.unwrap_or_default().join(format!("{DLL_PREFIX}{LIBRARY}{DLL_SUFFIX}"))
    });
    if path.is_file() {
        return Ok(path);
    }
    Err(InputError(format!(
        "{} is missing, the library that an FMU carries; build it with `cargo rustc --release -p truing-fmu --lib --crate-type cdylib`, \
        or take it from the archive of the program, and name it with --fmu-library or {VARIABLE}",
        path.display()
    )))
}
