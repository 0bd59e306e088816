//! A real board on a serial port, by the same protocol. Not verified on hardware.

use super::Wire;
use serialport::SerialPort;
use std::io::{ErrorKind, Read, Write};
use std::time::{Duration, SystemTime};
use truing_core::text::input_error::InputError;

/// As the board's USART2.
const BAUD: u32 = 921_600;
/// Length of a turn when nothing arrives.
const WAIT: Duration = Duration::from_millis(5);

/// An open port.
pub struct Serial {
    name: String,
    port: Box<dyn SerialPort>,
}

impl Serial {
    /// Opens the port.
    pub fn open(name: &str) -> Result<Self, InputError> {
        let port = serialport::new(name, BAUD).timeout(WAIT).open().map_err(|error| {
            InputError(format!(
                "the port {name} cannot be opened ({error}); check its name, the cable, and that you may use it (group dialout)"
            ))
        })?;
        Ok(Self { name: name.to_owned(), port })
    }

    fn lost(&self, error: &std::io::Error) -> InputError {
        InputError(format!("the port {} is lost ({error}); check the cable and start again", self.name))
    }
}

impl Wire for Serial {
    fn first_number(&self) -> u16 {
        let since = SystemTime::UNIX_EPOCH.elapsed().unwrap_or_default();
        // Milliseconds, so that two clients one after the other differ.
        since.as_millis() as u16
    }

    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        self.port.write_all(outgoing).map_err(|error| self.lost(&error))?;
        outgoing.clear();
        let mut buffer = [0; 4096];
        match self.port.read(&mut buffer) {
            Ok(count) => incoming.extend_from_slice(&buffer[..count]),
            // A signal interrupts the wait; it is heeded before the next turn.
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {}
            Err(error) => return Err(self.lost(&error)),
        }
        Ok(())
    }
}
