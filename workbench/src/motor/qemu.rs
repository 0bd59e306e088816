//! The firmware image in QEMU, one exchange a control tick (the layout stands in the image's `board/qemu`).

use super::firmware_log::FirmwareLog;
use super::pipe::{self, PATIENCE, Silence};
use crate::input_error::InputError;
use rustix::fs::{CWD, Mode, OFlags, mkfifoat, open};
use servo::axis::{Bridge, Sample};
use std::fs::File;
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// QEMU's machine with an STM32F405.
const MACHINE: &str = "netduinoplus2";
/// The program, unless the environment variable `TRUING_QEMU` names another one.
const PROGRAM: &str = "qemu-system-arm";
/// Fixed part of an exchange, either way.
const HEAD: usize = 12;
/// Link bytes that one answer may carry: what the image takes from its line in one tick.
pub const MOST_LINK_BYTES: usize = 512;

/// What the image says in one exchange.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// Number of the exchange.
    pub tick: u32,
    /// Duty that acts now, PWM counts.
    pub duty: i16,
    /// Bridge state that acts now.
    pub bridge: Bridge,
    /// Bytes of the servo's link.
    pub link: Vec<u8>,
}

/// Where the image is that `cargo xtask images` builds.
pub fn default_image() -> PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"))
        .parent()
        .unwrap_or(Path::new("."));
    root.join("target/images/qemu.elf")
}

/// How QEMU is run.
#[derive(Clone, Debug)]
pub struct Options {
    /// The image.
    pub image: PathBuf,
    /// Count instructions: one takes 2^shift ns. SysTick is then no time base but an instruction counter.
    pub icount_shift: Option<u8>,
    /// QEMU.
    pub program: PathBuf,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            image: default_image(),
            icount_shift: None,
            program: std::env::var_os("TRUING_QEMU")
                .unwrap_or_else(|| PROGRAM.into())
                .into(),
        }
    }
}

/// A running QEMU. Dropping it ends it.
pub struct Qemu {
    child: Child,
    to_host: File,
    from_host: File,
    log: FirmwareLog,
    errors: Option<std::process::ChildStderr>,
    _folder: TempDir,
}

impl Qemu {
    /// Starts the image; it waits for the first [`Qemu::listen`].
    pub fn start(options: &Options) -> Result<Self, InputError> {
        let image = std::fs::read(&options.image).map_err(|_| {
            let what = "is the firmware image and is missing; build it with `cargo xtask images`";
            InputError::file(options.image.display(), what)
        })?;
        let path = options
            .image
            .canonicalize()
            .unwrap_or_else(|_| options.image.clone());
        let folder = TempDir::new().map_err(pipes)?;
        let (to_host, from_host) = fifos(folder.path()).map_err(pipes)?;
        let mut child = command(&path, options)
            .current_dir(folder.path())
            .spawn()
            .map_err(|error| missing(&options.program, &error))?;
        let stdout = child.stdout.take().ok_or_else(|| pipes("no output"))?;
        Ok(Self {
            log: FirmwareLog::follow(&image, stdout),
            errors: child.stderr.take(),
            child,
            to_host,
            from_host,
            _folder: folder,
        })
    }

    /// What the image does in this tick.
    pub fn listen(&mut self) -> Result<Said, InputError> {
        let mut head = [0; HEAD];
        self.read(&mut head)?;
        let word = |at: usize| u32::from_le_bytes([head[at], head[at + 1], head[at + 2], head[at + 3]]);
        let mut link = vec![0; (word(8) as usize).min(1 << 16)];
        self.read(&mut link)?;
        let bridge = match head[6] {
            1 => Bridge::Driven,
            2 => Bridge::Shorted,
            _ => Bridge::Open,
        };
        Ok(Said {
            tick: word(0),
            duty: i16::from_le_bytes([head[4], head[5]]),
            bridge,
            link,
        })
    }

    /// The motor's answer. At most [`MOST_LINK_BYTES`] of `link`.
    pub fn answer(&mut self, sample: &Sample, link: &[u8]) -> Result<(), InputError> {
        let mut frame = Vec::with_capacity(HEAD + link.len());
        frame.extend(sample.count.to_le_bytes());
        frame.extend(sample.vbus_raw.to_le_bytes());
        frame.extend(sample.current_raw.to_le_bytes());
        frame.extend((link.len() as u16).to_le_bytes());
        frame.extend(0u16.to_le_bytes());
        frame.extend(link);
        self.from_host.write_all(&frame).map_err(pipes)
    }

    /// Ends the image and returns what it has logged.
    pub fn stop(&mut self) -> Vec<String> {
        let mut farewell = [0; HEAD];
        farewell[10] = 1;
        let _ = self.from_host.write_all(&farewell);
        let deadline = Instant::now() + Duration::from_secs(2);
        while Instant::now() < deadline && !matches!(self.child.try_wait(), Ok(Some(_))) {
            std::thread::sleep(Duration::from_millis(2));
        }
        self.end();
        self.log.finish()
    }

    /// QEMU's process number.
    pub fn process(&self) -> u32 {
        self.child.id()
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<(), InputError> {
        let child = &mut self.child;
        let alive = || matches!(child.try_wait(), Ok(None));
        match pipe::read_exact(&mut self.to_host, buffer, alive) {
            Ok(()) => Ok(()),
            Err(Silence::Closed) => Err(self.died()),
            Err(Silence::Late) => Err(self.hangs()),
        }
    }

    fn end(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    fn died(&mut self) -> InputError {
        self.end();
        let mut words = self.log.finish().join("; ");
        if let Some(mut errors) = self.errors.take() {
            let _ = errors.read_to_string(&mut words);
        }
        InputError(format!(
            "the firmware in QEMU has ended by itself ({}); rebuild it with `cargo xtask images`",
            words.trim().replace('\n', "; ")
        ))
    }

    fn hangs(&mut self) -> InputError {
        self.end();
        InputError(format!(
            "the firmware in QEMU has said nothing for {} s; rebuild it with `cargo xtask images`",
            PATIENCE.as_secs()
        ))
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.end();
    }
}

fn command(image: &Path, options: &Options) -> Command {
    let mut command = Command::new(&options.program);
    command
        .args(["-M", MACHINE, "-nographic", "-monitor", "none", "-serial", "none"])
        .args(["-semihosting-config", "enable=on,target=native", "-kernel"])
        .arg(image)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    if let Some(shift) = options.icount_shift {
        command.args(["-icount", &format!("shift={shift}")]);
    }
    command
}

/// The pipes of `board/qemu`, opened without waiting for the other end. The writing end is opened for reading too, which
/// Linux allows, so that it opens at once.
fn fifos(folder: &Path) -> std::io::Result<(File, File)> {
    let make = |name: &str, flags| -> std::io::Result<File> {
        let path = folder.join(name);
        mkfifoat(CWD, &path, Mode::RUSR | Mode::WUSR)?;
        Ok(open(&path, flags | OFlags::CLOEXEC, Mode::empty())?.into())
    };
    let to_host = make("to_host", OFlags::RDONLY | OFlags::NONBLOCK)?;
    let from_host = make("from_host", OFlags::RDWR)?;
    Ok((to_host, from_host))
}

fn pipes(error: impl std::fmt::Display) -> InputError {
    InputError(format!(
        "the pipes to QEMU failed ({error}); is the temporary folder full?"
    ))
}

fn missing(program: &Path, error: &std::io::Error) -> InputError {
    InputError(format!(
        "{} cannot be started ({error}); install it with `apt install {PROGRAM}` or run `cargo xtask setup`",
        program.display()
    ))
}
