//! Ctrl-C, a termination and a hang-up. A command that moves a motor holds them: the first one is remembered, the session
//! sends `Stop`, and what was recorded is written. The second one, or one that nobody holds, ends the program at once, and
//! motor programs and temporary folders with it.

use rustix::process::{Pid, Signal, kill_process_group};
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Exit status of an interrupted program: 128 and the number of Ctrl-C's signal, as a shell would report it.
pub const STATUS: u8 = 130;

/// How many hold.
static HOLDS: AtomicUsize = AtomicUsize::new(0);
/// The session is to end.
static ASKED: AtomicBool = AtomicBool::new(false);
/// The session is to end because of a signal.
static SIGNALLED: AtomicBool = AtomicBool::new(false);
/// What would be left behind.
static LEFT: Mutex<Left> = Mutex::new(Left { groups: Vec::new(), folders: Vec::new() });

struct Left {
    groups: Vec<Pid>,
    folders: Vec<PathBuf>,
}

/// While it lives, the first signal is remembered instead of ending the program.
#[must_use]
pub struct Hold(());

/// Holds signals until the result is dropped.
pub fn hold() -> Hold {
    HOLDS.fetch_add(1, Ordering::SeqCst);
    Hold(())
}

impl Drop for Hold {
    fn drop(&mut self) {
        HOLDS.fetch_sub(1, Ordering::SeqCst);
    }
}

/// Ends the program if a signal came while something else held it, and nobody holds it any more.
pub fn heed_what_came() {
    if signalled() && HOLDS.load(Ordering::SeqCst) == 0 {
        abandon();
        low_level::exit(STATUS.into());
    }
}

/// Is the session to end?
pub fn asked() -> bool {
    ASKED.load(Ordering::SeqCst)
}

/// Has a signal asked for it?
pub fn signalled() -> bool {
    SIGNALLED.load(Ordering::SeqCst)
}

/// Ends the session as a signal would.
pub fn ask() {
    ASKED.store(true, Ordering::SeqCst);
}

/// Watches for signals from now on. One that the program was started to ignore (`nohup`) stays ignored.
pub fn watch() -> io::Result<()> {
    let ignored = ignored_signals();
    let heeded = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    let mut signals = Signals::new(heeded)?;
    std::thread::Builder::new().name("signals".into()).spawn(move || signals.forever().for_each(heed))?;
    Ok(())
}

fn heed(signal: i32) {
    let first = !SIGNALLED.swap(true, Ordering::SeqCst);
    ask();
    if first && HOLDS.load(Ordering::SeqCst) > 0 {
        return;
    }
    abandon();
    if first {
        let _ = low_level::emulate_default_handler(signal);
    }
    low_level::exit(STATUS.into());
}

/// Bit n − 1 stands for signal n.
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Nothing that was started or made stays.
fn abandon() {
    let Ok(mut left) = LEFT.lock() else { return };
    for group in left.groups.drain(..) {
        let _ = kill_process_group(group, Signal::KILL);
    }
    for folder in left.folders.drain(..) {
        let _ = std::fs::remove_dir_all(folder);
    }
}

fn change(change: impl FnOnce(&mut Left)) {
    if let Ok(mut left) = LEFT.lock() {
        change(&mut left);
    }
}

/// This process group is ended with the program, until [`forget_group`].
pub fn keep_group(group: Pid) {
    change(|left| left.groups.push(group));
}

/// It has ended.
pub fn forget_group(group: Pid) {
    change(|left| left.groups.retain(|other| *other != group));
}

/// A temporary folder that goes when it is dropped, and when the program is interrupted.
pub struct TemporaryFolder(tempfile::TempDir);

impl TemporaryFolder {
    /// An empty one.
    pub fn new() -> io::Result<Self> {
        let folder = tempfile::TempDir::new()?;
        change(|left| left.folders.push(folder.path().to_owned()));
        Ok(Self(folder))
    }

    /// Where it lies.
    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Drop for TemporaryFolder {
    fn drop(&mut self) {
        change(|left| left.folders.retain(|other| other != self.0.path()));
    }
}
