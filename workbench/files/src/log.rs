//! Logs in files, or at standard input.

pub use truing_core::system::log::*;

use look::Look;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;
use truing_core::text::input_error::InputError;
use truing_formats::SOURCES;

/// The name of standard input.
const STANDARD: &str = "-";
/// Bytes that are read at once.
const CHUNK: usize = 1 << 16;

/// Reads a log from a file.
pub fn read(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    open(path, columns).map(|reading| reading.log)
}

/// Reads a log from a file, and says how it was read.
pub fn open(path: &Path, columns: &Columns) -> Result<Reading, InputError> {
    opened(path, |bytes| reading(bytes, columns))
}

/// Reads a record that need not have an output: what a simulation is driven by.
pub fn read_input(path: &Path, columns: &Columns) -> Result<Log, InputError> {
    opened(path, |bytes| input(bytes, columns)).map(|reading| reading.log)
}

/// Looks at a file.
pub fn look(path: &Path, columns: &Columns) -> Result<Look, InputError> {
    opened(path, |bytes| look::look(bytes, columns))
}

/// Reads the bytes of a file, which is never in memory as a whole. A pipe can be read but once, and is held.
fn opened<T>(path: &Path, read: impl Fn(Bytes) -> Result<T, InputError>) -> Result<T, InputError> {
    let standard = path == Path::new(STANDARD);
    let name = if standard { "standard input".into() } else { path.display().to_string() };
    let failed = |error| InputError::unreadable(&name, error);
    if !standard && std::fs::metadata(path).map_err(failed)?.is_file() {
        let open = || File::open(path).map(|file| BufReader::with_capacity(CHUNK, file));
        return read(Bytes { name: &name, open: &|| Ok(Box::new(open()?)), sources: SOURCES });
    }
    let mut bytes = Vec::new();
    let all = match standard {
        true => std::io::stdin().read_to_end(&mut bytes),
        false => File::open(path).and_then(|mut file| file.read_to_end(&mut bytes)),
    };
    all.map_err(failed)?;
    read(Bytes { name: &name, open: &|| Ok(Box::new(bytes.as_slice())), sources: SOURCES })
}
