//! The image in QEMU behind a pseudo terminal, in real time: what a board on a serial port looks like from the host.

use crate::families::Plant;
use crate::firmware::qemu;
use crate::virtual_motor::VirtualMotor;
use serialport::{SerialPort, TTYPort};
use std::fs::OpenOptions;
use std::io::{ErrorKind, Read, Write};
use std::os::unix::fs::OpenOptionsExt;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use truing::device::link::{Lockstep, Wire};
use truing::device::motor::qemu::Options;

/// Real time between two looks at the clock and the line.
const PACE: Duration = Duration::from_millis(2);

/// `O_NOCTTY` of Linux.
const NO_CONTROLLING_TERMINAL: i32 = 0o400;

/// A servo on a line. Dropping it switches it off.
pub struct SerialServo {
    port: String,
    off: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl SerialServo {
    /// Powers up.
    ///
    /// # Panics
    /// If there is no pseudo terminal to be had.
    pub fn start(plant: &Plant, flash: Option<PathBuf>) -> Self {
        let (master, slave) = TTYPort::pair().expect("a pseudo terminal");
        let port = slave.name().expect("a name");
        // The line stays up when a client hangs up. A client locks it, so this end must not.
        let kept = OpenOptions::new()
            .read(true)
            .write(true)
            .custom_flags(NO_CONTROLLING_TERMINAL)
            .open(&port)
            .expect("the other end");
        drop(slave);
        let off = Arc::new(AtomicBool::new(false));
        let (plant, switched_off) = (plant.clone(), Arc::clone(&off));
        let options = Options { flash, ..qemu() };
        let thread = std::thread::spawn(move || {
            let motor = Box::new(VirtualMotor::new(&plant));
            let wire = Lockstep::start(&options, motor, plant.config).expect("QEMU");
            carry(wire, master, plant.config.tick_hz, &switched_off);
            drop(kept);
        });
        Self { port, off, thread: Some(thread) }
    }

    /// The argument of `--motor`.
    pub fn door(&self) -> String {
        format!("serial:{}", self.port)
    }
}

impl Drop for SerialServo {
    fn drop(&mut self) {
        self.off.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// As many control ticks as the clock says, and the bytes of both directions between them.
fn carry(mut wire: Lockstep, mut line: TTYPort, tick_hz: u32, off: &AtomicBool) {
    line.set_timeout(Duration::from_millis(1)).expect("a timeout");
    let (begin, mut ticks) = (Instant::now(), 0.0);
    let (mut to_servo, mut from_servo, mut buffer) = (Vec::new(), Vec::new(), [0; 1024]);
    while !off.load(Ordering::Relaxed) {
        match line.read(&mut buffer) {
            Ok(count) => to_servo.extend_from_slice(&buffer[..count]),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(_) => return,
        }
        while ticks < begin.elapsed().as_secs_f64() * f64::from(tick_hz) {
            wire.turn(&mut to_servo, &mut from_servo).expect("a turn");
            ticks += 1.0;
        }
        // Nobody listens: as on a real line, what does not fit is lost.
        let _ = line.write(&from_servo);
        from_servo.clear();
        std::thread::sleep(PACE);
    }
    wire.close();
}
