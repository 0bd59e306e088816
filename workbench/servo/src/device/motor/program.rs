//! A program that runs beside ours, in a process group of its own: a Ctrl-C in the terminal does not reach it, and it goes
//! with all that it has started.

use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};
use std::io;
use std::os::unix::process::CommandExt;
use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};
use truing_report::console::interrupt;

/// How often it is looked after.
const GLANCE: Duration = Duration::from_millis(5);

/// The running program. Dropping it ends its process group.
pub struct Program {
    pub child: Child,
    group: Pid,
    over: bool,
}

impl Program {
    /// Starts it.
    pub fn start(command: &mut Command) -> io::Result<Self> {
        let child = command.process_group(0).spawn()?;
        let group = Pid::from_child(&child);
        interrupt::keep_group(group);
        Ok(Self { child, group, over: false })
    }

    /// Has it ended by itself? It is not reaped yet, so that its number stays its own.
    pub fn has_ended(&self) -> bool {
        let options = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        self.over || !matches!(waitid(WaitId::Pid(self.group), options), Ok(None))
    }

    /// Waits for it to end by itself.
    pub fn ends_within(&self, patience: Duration) -> bool {
        let deadline = Instant::now() + patience;
        while !self.has_ended() {
            if Instant::now() > deadline {
                return false;
            }
            std::thread::sleep(GLANCE);
        }
        true
    }

    /// Ends it, and what it has started.
    pub fn end(&mut self) -> Option<ExitStatus> {
        if !self.over {
            let _ = kill_process_group(self.group, Signal::KILL);
            interrupt::forget_group(self.group);
            self.over = true;
        }
        self.child.wait().ok()
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.end();
    }
}
