//! Any program as the motor: one 16-byte little-endian frame each way a tick, over its standard input and output.

use super::pipe::{self, Silence};
use super::program::Program;
use super::{Drive, Motor, Reading};
use std::io::Write;
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::time::Duration;
use truing_core::text::input_error::InputError;
use truing_report::console::interrupt;

/// Length of a frame, either way.
pub const FRAME: usize = 16;
/// How long the program may take to end after its input has.
const FAREWELL: Duration = Duration::from_secs(2);
/// How long the program may take to end when the user has interrupted the session.
const SHORT_FAREWELL: Duration = Duration::from_millis(500);
/// How long it may take to end after its output has.
const FAILING: Duration = Duration::from_millis(500);
/// Nothing that a motor of this size needs lies beyond; numbers beyond are no measurements but text or a lost byte.
const MOST_AMPERES: f32 = 1e5;
const MOST_VOLTS: f32 = 1e4;
/// A supply is nothing, or not less than this.
const LEAST_VOLTS: f32 = 1e-9;
/// So many letters at the start of a frame are text: what follows may be the end of a line and a frame.
const LETTERS: usize = 6;

/// The running program. Dropping it closes its input, and ends it if it does not end by itself.
pub struct Exec {
    command: String,
    program: Program,
    input: Option<ChildStdin>,
    output: ChildStdout,
}

impl Exec {
    /// Starts `sh -c COMMAND`; its error output goes to ours.
    pub fn start(command: &str) -> Result<Self, InputError> {
        let broken = |error| InputError(format!("the motor `{command}` cannot be started: {error}"));
        let mut shell = Command::new("sh");
        shell.args(["-c", command]);
        shell.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut program = Program::start(&mut shell).map_err(broken)?;
        let (input, output) = (program.child.stdin.take(), program.child.stdout.take());
        Ok(Self {
            command: command.to_owned(),
            program,
            input,
            output: output.ok_or_else(|| broken(std::io::ErrorKind::BrokenPipe.into()))?,
        })
    }

    fn gone(&mut self, tick: u32) -> InputError {
        let status = match self.program.ends_within(FAILING) {
            true => self.program.end().map_or("ended".into(), |status| format!("ended with {status}")),
            false => "closed its output".into(),
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
            pipe::patience().as_secs()
        ))
    }

    /// What the frame says, unless it can be no measurement.
    fn understood(&self, tick: u32, frame: &[u8; FRAME]) -> Result<Reading, InputError> {
        let reading = decode(frame);
        let Some(what) = nonsense(frame, &reading) else {
            return Ok(reading);
        };
        Err(InputError(format!(
            "the motor `{}` answered tick {tick} with {what}; its standard output must carry nothing but frames of 16 bytes \
             (count i32, current f32, supply f32, flags u32, little-endian), so let it print to standard error",
            self.command
        )))
    }
}

impl Motor for Exec {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let frame = encode(drive);
        let sent = self.input.as_mut().map(|input| input.write_all(&frame).and_then(|()| input.flush()));
        if !matches!(sent, Some(Ok(()))) {
            return Err(self.gone(drive.tick));
        }
        let mut answer = [0; FRAME];
        match pipe::read_exact(&mut self.output, &mut answer, || true) {
            Ok(()) => self.understood(drive.tick, &answer),
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

/// What was received in place of a measurement, in words. NaN means "not measured" and is none.
fn nonsense(frame: &[u8; FRAME], reading: &Reading) -> Option<String> {
    let text = |bytes: &[u8]| bytes.iter().all(|byte| byte.is_ascii_graphic() || byte.is_ascii_whitespace());
    let (current, supply) = (reading.current_a, reading.supply_v);
    let no_supply = supply.abs() > MOST_VOLTS || supply != 0.0 && supply.abs() < LEAST_VOLTS;
    if text(frame) || text(&frame[..LETTERS]) && no_supply {
        return Some(format!("the text `{}`", frame.escape_ascii()));
    }
    if current.abs() > MOST_AMPERES || no_supply {
        return Some(format!(
            "a current of {current:e} A and a supply of {supply:e} V (bytes {})",
            frame.map(|byte| format!("{byte:02x}")).join(" ")
        ));
    }
    None
}

impl Drop for Exec {
    fn drop(&mut self) {
        self.input = None;
        self.program.ends_within(match interrupt::asked() {
            true => SHORT_FAREWELL,
            false => FAREWELL,
        });
        self.program.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(count: i32, current: f32, supply: f32) -> [u8; FRAME] {
        let mut frame = [0; FRAME];
        frame[0..4].copy_from_slice(&count.to_le_bytes());
        frame[4..8].copy_from_slice(&current.to_le_bytes());
        frame[8..12].copy_from_slice(&supply.to_le_bytes());
        frame
    }

    fn complaint(frame: [u8; FRAME]) -> Option<String> {
        nonsense(&frame, &decode(&frame))
    }

    #[test]
    fn text_in_place_of_frames_is_quoted() {
        let said = complaint(*b"initialising...\n").unwrap();
        assert!(said.contains("the text `initialising...\\n`"), "{said}");
        let said = complaint(*b"R=1.5 K=0.1\n\x07\0\0\0").unwrap();
        assert!(said.contains("R=1.5 K=0.1"), "{said}");
    }

    #[test]
    fn numbers_that_no_motor_has_are_told() {
        for (current, supply) in [(f32::INFINITY, 12.0), (0.0, f32::INFINITY), (0.0, -1e30), (1e20, 12.0)] {
            let said = complaint(frame(5, current, supply)).unwrap();
            assert!(said.contains(&format!("{supply:e} V (bytes 05 00")), "{said}");
        }
    }

    #[test]
    fn measurements_and_what_is_not_measured_pass() {
        for (current, supply) in [(0.3, 12.0), (f32::NAN, f32::NAN), (-40.0, 0.0), (5.0, 400.0)] {
            assert_eq!(complaint(frame(-7, current, supply)), None);
        }
    }
}
