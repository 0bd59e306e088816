//! Any program as the motor: one 16-byte little-endian frame each way a tick, over its standard input and output.

use super::pipe::{self, PATIENCE, Silence};
use super::{Drive, Motor, Reading};
use crate::input_error::InputError;
use rustix::process::{Pid, Signal, kill_process_group};
use std::io::Write;
use std::os::unix::process::CommandExt;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// Length of a frame, either way.
pub const FRAME: usize = 16;
/// How long the program may take to end after its input has.
const FAREWELL: Duration = Duration::from_secs(2);

/// The running program. Dropping it closes its input, and ends it if it does not end by itself.
pub struct Exec {
    command: String,
    child: Child,
    input: Option<ChildStdin>,
    output: ChildStdout,
}

impl Exec {
    /// Starts `sh -c COMMAND`; its error output goes to ours.
    pub fn start(command: &str) -> Result<Self, InputError> {
        let broken = |error| InputError(format!("the motor `{command}` cannot be started: {error}"));
        let mut child = Command::new("sh")
            .args(["-c", command])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .process_group(0)
            .spawn()
            .map_err(broken)?;
        let (input, output) = (child.stdin.take(), child.stdout.take());
        Ok(Self {
            command: command.to_owned(),
            child,
            input,
            output: output.ok_or_else(|| broken(std::io::ErrorKind::BrokenPipe.into()))?,
        })
    }

    fn gone(&mut self, tick: u32) -> InputError {
        let deadline = Instant::now() + Duration::from_millis(500);
        let status = loop {
            match self.child.try_wait() {
                Ok(Some(status)) => break format!("ended with {status}"),
                _ if Instant::now() > deadline => break "closed its output".into(),
                _ => std::thread::sleep(Duration::from_millis(5)),
            }
        };
        InputError(format!(
            "the motor `{}` {status} at tick {tick}; it must answer every 16-byte frame with one until its input ends (its own messages are above)",
            self.command
        ))
    }

    fn late(&self, tick: u32) -> InputError {
        InputError(format!(
            "the motor `{}` has not answered tick {tick} for {} s; it must write 16 bytes for every 16 it reads, and flush them",
            self.command,
            PATIENCE.as_secs()
        ))
    }
}

impl Motor for Exec {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let frame = encode(drive);
        let sent = self
            .input
            .as_mut()
            .map(|input| input.write_all(&frame).and_then(|()| input.flush()));
        if !matches!(sent, Some(Ok(()))) {
            return Err(self.gone(drive.tick));
        }
        let mut answer = [0; FRAME];
        match pipe::read_exact(&mut self.output, &mut answer, || true) {
            Ok(()) => Ok(decode(&answer)),
            Err(Silence::Closed) => Err(self.gone(drive.tick)),
            Err(Silence::Late) => Err(self.late(drive.tick)),
        }
    }
}

/// The frame to the motor.
pub fn encode(drive: &Drive) -> [u8; FRAME] {
    let mut frame = [0; FRAME];
    frame[0..4].copy_from_slice(&drive.tick.to_le_bytes());
    frame[4..8].copy_from_slice(&drive.duty.to_le_bytes());
    frame[8] = drive.bridge as u8;
    frame[12..16].copy_from_slice(&drive.tick_s.to_le_bytes());
    frame
}

/// The frame from the motor.
pub fn decode(frame: &[u8; FRAME]) -> Reading {
    let word = |at: usize| [frame[at], frame[at + 1], frame[at + 2], frame[at + 3]];
    Reading {
        count: i32::from_le_bytes(word(0)),
        current_a: f32::from_le_bytes(word(4)),
        supply_v: f32::from_le_bytes(word(8)),
        flags: u32::from_le_bytes(word(12)),
    }
}

impl Drop for Exec {
    fn drop(&mut self) {
        self.input = None;
        let deadline = Instant::now() + FAREWELL;
        while Instant::now() < deadline {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(5));
        }
        let _ = kill_process_group(Pid::from_child(&self.child), Signal::KILL);
        let _ = self.child.wait();
    }
}
