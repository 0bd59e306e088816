//! Logs that are no text: each format makes a table of named columns from the bytes of a file.
//!
//! A format looks at the first bytes of a file, and at the end of its name where these say too little. What is cut is read up
//! to the cut where that is safe; what is broken is told with the byte or the row.

pub mod arrow;
mod cdr;
mod ipc;
mod ipc_frames;
mod json_message;
mod mat;
mod mat5;
mod mat73;
mod mcap;
mod naming;
mod parquet;
mod ros_schema;
mod streams;
mod sysid;
mod taken;
mod ulog;
mod wpilog;

use std::cell::Cell;
use std::io::Read;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;
use truing_core::system::log::cells::Cells;
use truing_core::system::log::{Bytes, Source};
use truing_core::text::input_error::InputError;

/// The formats of this package.
pub const SOURCES: &[&dyn Source] = &[
    &parquet::Parquet,
    &ipc::Ipc,
    &mcap::Mcap,
    &ulog::Ulog,
    &mat5::Mat5,
    &mat73::Mat73,
    &wpilog::Wpilog,
    &sysid::SysId,
];

/// Columns of numbers in memory as a table.
///
/// # Errors
/// A sentence where they do not have as many rows each, or fewer than two.
pub fn columns(columns: Vec<(String, Vec<f64>)>) -> Result<Cells, String> {
    let rows = columns.first().map_or(0, |column| column.1.len());
    if let Some((name, values)) = columns.iter().find(|column| column.1.len() != rows) {
        let (first, own) = (&columns[0].0, values.len());
        return Err(format!(
            "column `{name}` has {own} rows, `{first}` has {rows}; a table has as many in each"
        ));
    }
    let columns = columns.into_iter().map(|(name, values)| (name, naming::column(values)));
    naming::table(columns.collect(), naming::IN_MEMORY, &[])
}

/// All bytes of a file, where a format has its table of contents at the end.
fn held(bytes: Bytes) -> Result<Vec<u8>, InputError> {
    let mut all = Vec::new();
    let read = (bytes.open)().and_then(|mut reader| reader.read_to_end(&mut all));
    read.map_err(|error| InputError::unreadable(bytes.name, error)).map(|_| all)
}

thread_local! {
    /// A panic of this thread is caught and told as an error.
    static CAUGHT: Cell<bool> = const { Cell::new(false) };
}

/// What a library reads, where it stops the program on bytes that are broken: those of Parquet and Arrow do.
fn unbroken<T>(read: impl FnOnce() -> T) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let told = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !CAUGHT.get() {
                told(info)
            }
        }));
    });
    CAUGHT.set(true);
    let read = panic::catch_unwind(AssertUnwindSafe(read));
    CAUGHT.set(false);
    read.map_err(|_| "is broken so badly that it cannot be read; write the file anew".to_owned())
}
