//! Measured data are published elsewhere and are not part of the project. Tests that need them look for a folder, and
//! say that they were skipped where it is absent; `cargo xtask test` counts and lists those skips.

use std::io::Write;
use std::path::PathBuf;

/// The measured file `relative` (e.g. `emps/emps_id.csv`), or `None` after having reported the skip.
///
/// The folder is `$TRUING_SHARED/data`, or `../shared/data` beside the project; `docs/measured-data.md` tells where each
/// set is published.
pub fn measured(relative: &str) -> Option<PathBuf> {
    let path = root().join(relative);
    if path.is_file() {
        return Some(path);
    }
    skip(&format!("measured data {relative} not present, see docs/measured-data.md"));
    None
}

/// The folder of measured data, present or not.
pub fn root() -> PathBuf {
    let shared = std::env::var_os("TRUING_SHARED")
        .map(PathBuf::from)
        .unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared"));
    shared.join("data")
}

/// Reports that the calling test is skipped, and why.
pub fn skip(reason: &str) {
    eprintln!("skipped: {reason}");
    if let Some(file) = std::env::var_os("TRUING_SKIP_LOG") {
        let mut log = std::fs::OpenOptions::new()
            .create(true)
            .append(true)
            .open(&file)
            .unwrap_or_else(|error| panic!("cannot open {}: {error}", file.display()));
        // One write per line: tests run side by side. `cargo xtask test` counts a test once, however often it skips.
        log.write_all(format!("{}\t{reason}\n", test()).as_bytes()).expect("skip log is writable");
    }
}

/// The test that calls: its binary and its path in there. The test runner names each thread after its test.
fn test() -> String {
    let binary = std::env::current_exe().expect("a program knows its file");
    let thread = std::thread::current();
    format!(
        "{}: {}",
        binary.file_name().unwrap_or_default().to_string_lossy(),
        thread.name().unwrap_or("no name")
    )
}
