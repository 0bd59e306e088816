//! Reading from a pipe whose other end may be slow or gone.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{ErrorKind, Read};
use std::os::fd::AsFd;
use std::time::{Duration, Instant};
use truing_report::console::interrupt;

/// A partner is given up after so long.
const PATIENCE: Duration = Duration::from_secs(10);
/// A partner is given up after so long when the user has interrupted the session.
const SHORT_PATIENCE: Duration = Duration::from_secs(1);

/// Why nothing came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Silence {
    /// The other end is closed.
    Closed,
    /// [`patience`] is over.
    Late,
}

/// A partner that says nothing for so long is given up.
pub fn patience() -> Duration {
    match interrupt::asked() {
        true => SHORT_PATIENCE,
        false => PATIENCE,
    }
}

/// How often the other end is looked after while it is silent.
const GLANCE: Duration = Duration::from_millis(100);

/// Fills `buffer`. `alive` tells whether the other end may still speak.
pub fn read_exact(
    pipe: &mut (impl Read + AsFd),
    buffer: &mut [u8],
    mut alive: impl FnMut() -> bool,
) -> Result<(), Silence> {
    let mut filled = 0;
    while filled < buffer.len() {
        wait(pipe, &mut alive)?;
        match pipe.read(&mut buffer[filled..]) {
            Ok(0) => return Err(Silence::Closed),
            Ok(count) => filled += count,
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {}
            Err(_) => return Err(Silence::Closed),
        }
    }
    Ok(())
}

fn wait(pipe: &impl AsFd, alive: &mut impl FnMut() -> bool) -> Result<(), Silence> {
    let glance = Timespec { tv_sec: 0, tv_nsec: GLANCE.subsec_nanos().into() };
    let begin = Instant::now();
    loop {
        match poll(&mut [PollFd::new(pipe, PollFlags::IN)], Some(&glance)) {
            Ok(1..) => return Ok(()),
            Ok(0) if begin.elapsed() > patience() => return Err(Silence::Late),
            Ok(0) if alive() => {}
            Err(rustix::io::Errno::INTR) => {}
            _ => return Err(Silence::Closed),
        }
    }
}
