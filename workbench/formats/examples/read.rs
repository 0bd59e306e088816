//! Reads a file as the command line does, and prints the size of its table, the time and the memory:
//! `cargo run -p truing-formats --example read -- FILE`.

use std::fs::File;
use std::io::{BufReader, Read};
use std::time::Instant;
use truing_core::system::log::Bytes;
use truing_formats::SOURCES;

fn main() {
    let name = std::env::args().nth(1).expect("a file");
    let open = || File::open(&name).map(|file| BufReader::with_capacity(1 << 16, file));
    let mut head = Vec::new();
    open().and_then(|file| file.take(4096).read_to_end(&mut head)).expect("a file that can be read");
    let source = SOURCES.iter().find(|source| source.takes(&name, &head)).expect("a format that is known");
    let begun = Instant::now();
    let table = source.table(Bytes { name: &name, open: &|| Ok(Box::new(open()?)), sources: SOURCES });
    let cells = table.unwrap_or_else(|error| panic!("{error}"));
    let (rows, columns) = (cells.rows, cells.columns.len());
    println!("{rows} rows, {columns} columns: {} MB in {:?}", (rows * columns * 8) >> 20, begun.elapsed());
    println!("{}", cells.told.unwrap_or_default());
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    status.lines().filter(|line| line.starts_with("VmHWM")).for_each(|line| println!("{line}"));
}
