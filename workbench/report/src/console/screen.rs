//! The one place that writes to standard output and standard error: nothing here panics. What cannot be written is
//! remembered and the rest is left out, so that a command still does its work: a servo is stopped, files are written.
//! At the end [`finish`] tells.

use dialoguer::console::Term;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};
use std::sync::Mutex;

/// Why standard output takes nothing more.
static BROKEN: Mutex<Option<io::Error>> = Mutex::new(None);

/// Writes to standard output.
#[macro_export]
macro_rules! out {
    ($($text:tt)*) => { $crate::console::screen::print(format_args!($($text)*)) };
}

/// Writes a line to standard output.
#[macro_export]
macro_rules! outln {
    ($($text:tt)*) => { $crate::console::screen::print(format_args!("{}\n", format_args!($($text)*))) };
}

/// Writes a line to standard error.
#[macro_export]
macro_rules! errln {
    ($($text:tt)*) => { $crate::console::screen::complain(format_args!($($text)*)) };
}

/// Behind [`out!`].
pub fn print(text: Arguments) {
    keep(|stdout| stdout.write_fmt(text));
}

/// Behind [`errln!`]. There is nobody to tell if that fails.
pub fn complain(text: Arguments) {
    let _ = writeln!(io::stderr(), "{text}");
}

/// Shows what is still in the buffer.
pub fn flush() {
    keep(|stdout| stdout.flush());
}

/// Writes to standard output, unless that has failed before.
fn keep(write: impl FnOnce(&mut io::Stdout) -> io::Result<()>) {
    let Ok(mut broken) = BROKEN.lock() else { return };
    if broken.is_none() {
        *broken = write(&mut io::stdout()).err();
    }
}

/// Lines and columns of the terminal. `None`: standard output is none.
pub fn size() -> Option<(usize, usize)> {
    Term::stdout().size_checked().map(|(lines, columns)| (lines.into(), columns.into()))
}

/// Has standard output failed?
pub fn is_broken() -> bool {
    BROKEN.lock().is_ok_and(|broken| broken.is_some())
}

/// At the end of the program: was everything printed? A reader that has seen enough (`| head`) is no error.
pub fn finish() -> Result<(), io::Error> {
    flush();
    let broken = BROKEN.lock().ok().and_then(|mut broken| broken.take());
    match broken {
        Some(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}
