//! Arrow's own files: Feather, and streams of batches.

use crate::{arrow, ipc_frames};
use arrow_ipc::reader::StreamReader;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// Tables as Arrow IPC: Feather 2, `.arrow`, `.arrows`.
pub struct Ipc;

/// How a file begins.
const FILE: &[u8] = b"ARROW1\0\0";
/// How a stream begins: the mark of a message, which any bytes may be.
const CONTINUED: &[u8] = &[0xff; 4];
/// How the names of streams end.
const ENDINGS: [&str; 3] = [".arrows", ".arrow", ".ipc"];

impl Source for Ipc {
    fn takes(&self, name: &str, head: &[u8]) -> bool {
        let named = ENDINGS.iter().any(|ending| name.to_lowercase().ends_with(ending));
        head.starts_with(FILE) || head.starts_with(CONTINUED) && named
    }

    fn table(&self, bytes: Bytes) -> Result<Cells, InputError> {
        let held = crate::held(bytes)?;
        crate::unbroken(|| table(&held)).and_then(|it| it).map_err(|what| InputError::file(bytes.name, what))
    }
}

fn table(held: &[u8]) -> Result<Cells, String> {
    // A file is a stream between its marks, with a table of contents at its end that is not needed.
    let (format, stream) = match held.strip_prefix(FILE) {
        Some(stream) => ("an Arrow file", stream),
        None => ("an Arrow stream", held),
    };
    let (end, mut why) = ipc_frames::sound(stream);
    let reader = StreamReader::try_new(&stream[..end], None).map_err(|error| {
        let why = why.take().unwrap_or_else(|| format!("is no Arrow that can be read ({error})"));
        format!("{why}; write the file anew")
    })?;
    let (mut all, mut rows) = (Vec::new(), 0);
    for batch in reader {
        match batch {
            Ok(batch) => {
                rows += batch.num_rows();
                all.push(batch);
            }
            Err(error) => {
                why = Some(format!("is broken at row {} ({error})", rows + 1));
                break;
            }
        }
    }
    if rows == 0 {
        return Err(format!("{}; write the file anew", why.unwrap_or_else(|| "holds no rows".into())));
    }
    let told = why.map(|why| format!("The file {why}: what stands before it is read."));
    arrow::written(&all, format, told.into_iter().collect())
}
