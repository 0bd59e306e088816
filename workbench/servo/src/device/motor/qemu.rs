//! The firmware image in QEMU, one exchange a control tick (the layout stands in the image's `board/qemu`).

use super::firmware_log::FirmwareLog;
use super::pipe::{self, Silence};
use super::program::Program;
use rustix::fs::{CWD, Mode, OFlags, mkfifoat, open};
use servo::axis::{Bridge, Sample};
use servo::protect::Interlock;
use std::fs::{File, TryLockError};
use std::io::{Read, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use truing_core::text::input_error::InputError;
use truing_report::console::interrupt::TemporaryFolder;

/// QEMU's machine for the image.
pub const MACHINE: &str = "netduinoplus2";
/// The program, unless the environment variable `TRUING_QEMU` names another one.
const PROGRAM: &str = "qemu-system-arm";
/// Fixed part of what the image says, and its part for one axis.
const HEAD: usize = 8;
const AXIS: usize = 4;
/// Flag of an answer: end the program.
const STOP: u16 = 1;
/// Bytes of the stand-in for the chip's flash: two sectors (see the image's `board/qemu/flash.rs`).
const FLASH_BYTES: usize = 2 * 4096;
/// Link bytes that one answer may carry: what the image takes from its line in one tick.
pub const MOST_LINK_BYTES: usize = 512;
/// How long the image may take to end when it is told to.
const FAREWELL: Duration = Duration::from_secs(2);
/// A copy of an open file lives this long at most, in a process that is being started.
const COPIES_LAST: Duration = Duration::from_millis(100);

/// What the image sees of the world apart from samples and link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Lines {
    /// Pretend that the control tick took longer than its period.
    pub overrun: bool,
    /// What enable contact and bridge drivers say.
    pub interlock: Interlock,
    /// The encoder's index pulse is there.
    pub index: bool,
}

impl Lines {
    fn flags(self) -> u16 {
        let interlock = match self.interlock {
            Interlock::Granted => 0,
            Interlock::Disabled => 4,
            Interlock::BridgeFault => 8,
        };
        interlock | if self.overrun { 2 } else { 0 } | if self.index { 16 } else { 0 }
    }
}

/// What one bridge does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Acting {
    /// Duty that acts now, PWM counts.
    pub duty: i16,
    /// Bridge state that acts now.
    pub bridge: Bridge,
}

/// What the image says in one exchange.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Said {
    /// Number of the exchange.
    pub tick: u32,
    /// One for each axis of the image.
    pub axes: Vec<Acting>,
    /// Bytes of the servo's link.
    pub link: Vec<u8>,
}

/// How every ELF file begins.
const ELF: &[u8] = b"\x7fELF";

/// Where the image is that `cargo xtask images` builds: below the folder of the call, else where this program was built.
pub fn default_image() -> PathBuf {
    let here = PathBuf::from("target/images/qemu.elf");
    if here.exists() {
        return here;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap_or(Path::new("."));
    root.join(here)
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
    /// A file that holds the stored parameters from one session to the next, made if it is missing; without it every
    /// session begins with a blank flash.
    pub flash: Option<PathBuf>,
    /// Have the image believe that the watchdog has started it.
    pub started_by_watchdog: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            image: default_image(),
            icount_shift: None,
            program: std::env::var_os("TRUING_QEMU").unwrap_or_else(|| PROGRAM.into()).into(),
            flash: None,
            started_by_watchdog: false,
        }
    }
}

/// A running QEMU. Dropping it ends it; the folder goes after the program.
pub struct Qemu {
    program: Program,
    to_host: File,
    from_host: File,
    log: FirmwareLog,
    errors: Option<std::process::ChildStderr>,
    /// As the image has said in its first message.
    axes: usize,
    _folder: TemporaryFolder,
    _flash: Option<File>,
}

impl Qemu {
    /// Starts the image; it waits for the first [`Qemu::listen`].
    pub fn start(options: &Options) -> Result<Self, InputError> {
        let image = std::fs::read(&options.image).map_err(|_| {
            let what = "is the firmware image and is missing; build it with `cargo xtask images`";
            InputError::file(options.image.display(), what)
        })?;
        if !image.starts_with(ELF) {
            let what = "is no firmware image (an ELF file); build one with `cargo xtask images`";
            return Err(InputError::file(options.image.display(), what));
        }
        let path = options.image.canonicalize().unwrap_or_else(|_| options.image.clone());
        let folder = TemporaryFolder::new().map_err(pipes)?;
        let (to_host, from_host) = fifos(folder.path()).map_err(pipes)?;
        let flash = flash(folder.path(), options.flash.as_deref())?;
        if options.started_by_watchdog {
            std::fs::write(folder.path().join("started_by_watchdog"), "").map_err(pipes)?;
        }
        let mut program = Program::start(command(&path, options).current_dir(folder.path()))
            .map_err(|error| missing(&options.program, &error))?;
        let stdout = program.child.stdout.take().ok_or_else(|| pipes("no output"))?;
        Ok(Self {
            log: FirmwareLog::follow(&image, stdout),
            errors: program.child.stderr.take(),
            axes: 1,
            program,
            to_host,
            from_host,
            _folder: folder,
            _flash: flash,
        })
    }

    /// What the image does in this tick.
    pub fn listen(&mut self) -> Result<Said, InputError> {
        let mut head = [0; HEAD];
        self.read(&mut head)?;
        let half = |at: usize| u16::from_le_bytes([head[at], head[at + 1]]);
        let mut axes = vec![0; AXIS * usize::from(half(6))];
        self.read(&mut axes)?;
        let mut link = vec![0; usize::from(half(4))];
        self.read(&mut link)?;
        self.axes = usize::from(half(6));
        Ok(Said {
            tick: u32::from_le_bytes([head[0], head[1], head[2], head[3]]),
            axes: axes.chunks_exact(AXIS).map(acting).collect(),
            link,
        })
    }

    /// The motors' answers, one an axis. At most [`MOST_LINK_BYTES`] of `link`.
    pub fn answer(&mut self, lines: Lines, samples: &[Sample], link: &[u8]) -> Result<(), InputError> {
        let frame = answer(lines.flags(), samples, link);
        self.from_host.write_all(&frame).map_err(pipes)
    }

    /// Ends the image and returns what it has logged.
    pub fn stop(&mut self) -> Vec<String> {
        let still =
            Sample { count: 0, vbus_raw: Sample::VBUS_NOT_MEASURED, current_raw: Sample::CURRENT_NOT_SENSED };
        let _ = self.from_host.write_all(&answer(STOP, &vec![still; self.axes], &[]));
        self.program.ends_within(FAREWELL);
        self.program.end();
        self.log.finish()
    }

    /// QEMU's process number.
    pub fn process(&self) -> u32 {
        self.program.child.id()
    }

    fn read(&mut self, buffer: &mut [u8]) -> Result<(), InputError> {
        let program = &self.program;
        let alive = || !program.has_ended();
        match pipe::read_exact(&mut self.to_host, buffer, alive) {
            Ok(()) => Ok(()),
            Err(Silence::Closed) => Err(self.died()),
            Err(Silence::Late) => Err(self.hangs()),
        }
    }

    fn died(&mut self) -> InputError {
        self.program.end();
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
        self.program.end();
        InputError(format!(
            "the firmware in QEMU has said nothing for {} s; rebuild it with `cargo xtask images`",
            pipe::patience().as_secs()
        ))
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

fn acting(bytes: &[u8]) -> Acting {
    Acting {
        duty: i16::from_le_bytes([bytes[0], bytes[1]]),
        bridge: match bytes[2] {
            1 => Bridge::Driven,
            2 => Bridge::Shorted,
            _ => Bridge::Open,
        },
    }
}

fn answer(flags: u16, samples: &[Sample], link: &[u8]) -> Vec<u8> {
    let mut frame = Vec::new();
    frame.extend((link.len() as u16).to_le_bytes());
    frame.extend(flags.to_le_bytes());
    for sample in samples {
        frame.extend(sample.count.to_le_bytes());
        frame.extend(sample.vbus_raw.to_le_bytes());
        frame.extend(sample.current_raw.to_le_bytes());
    }
    frame.extend(link);
    frame
}

/// The flash that the image finds: a blank one, or the one that `kept` holds.
/// What is returned keeps others away from it.
fn flash(folder: &Path, kept: Option<&Path>) -> Result<Option<File>, InputError> {
    let place = folder.join("flash");
    let Some(kept) = kept else {
        return std::fs::write(place, [0xFF; FLASH_BYTES]).map(|()| None).map_err(pipes);
    };
    let broken = |error: std::io::Error| {
        let what =
            format!("holds the stored parameters and cannot be used ({error}); check folder and rights");
        InputError::file(kept.display(), what)
    };
    if !kept.exists() {
        std::fs::write(kept, [0xFF; FLASH_BYTES]).map_err(broken)?;
    }
    let length = std::fs::metadata(kept).map_err(broken)?.len();
    if length != FLASH_BYTES as u64 {
        let what = format!(
            "has {length} bytes and is no flash of {FLASH_BYTES}; remove it to begin with a blank one"
        );
        return Err(InputError::file(kept.display(), what));
    }
    let held = File::options().read(true).write(true).open(kept).map_err(broken)?;
    if !locked(&held) {
        let what = "is in use by another servo in QEMU; wait for its end, or give each its own --flash";
        return Err(InputError::file(kept.display(), what));
    }
    let whole = kept.canonicalize().map_err(broken)?;
    std::os::unix::fs::symlink(whole, place).map_err(pipes)?;
    Ok(Some(held))
}

/// Takes the lock of a flash. A servo that has just ended may still seem to hold it: a process that is started at that moment has a copy of
/// the open file until it runs its own program.
fn locked(flash: &File) -> bool {
    let begin = Instant::now();
    while matches!(flash.try_lock(), Err(TryLockError::WouldBlock)) {
        if begin.elapsed() > COPIES_LAST {
            return false;
        }
        std::thread::sleep(COPIES_LAST / 20);
    }
    true
}

fn pipes(error: impl std::fmt::Display) -> InputError {
    InputError(format!("the pipes to QEMU failed ({error}); is the temporary folder full?"))
}

fn missing(program: &Path, error: &std::io::Error) -> InputError {
    InputError(format!(
        "{} cannot be started ({error}); install it with `apt install {PROGRAM}` or run `cargo xtask setup`",
        program.display()
    ))
}
