//! The firmware in QEMU with a motor on the host: a turn is one control tick.

use super::{Farewell, Wire};
use crate::input_error::InputError;
use crate::motor::qemu::{MOST_LINK_BYTES, Options, Qemu};
use crate::motor::{Drive, Motor, Reading};
use servo::axis::Sample;
use servo::config::Config;

/// Full scale of the virtual 12-bit converters.
const CONVERTER_MAX: f32 = 4095.0;

/// QEMU, the motor, and the converters between them.
pub struct Lockstep {
    qemu: Qemu,
    motor: Box<dyn Motor>,
    config: Config,
    flags: Vec<u32>,
}

impl Lockstep {
    /// Starts QEMU.
    pub fn start(options: &Options, motor: Box<dyn Motor>, config: Config) -> Result<Self, InputError> {
        Ok(Self {
            qemu: Qemu::start(options)?,
            motor,
            config,
            flags: Vec::new(),
        })
    }
}

impl Wire for Lockstep {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        let said = self.qemu.listen()?;
        incoming.extend_from_slice(&said.link);
        let reading = self.motor.pass(&Drive {
            tick: said.tick,
            duty: f32::from(said.duty) / f32::from(self.config.pwm_full_scale),
            bridge: said.bridge,
            tick_s: 1.0 / self.config.tick_hz as f32,
        })?;
        self.flags.push(reading.flags);
        let sample = convert(&reading, &self.config);
        let bytes: Vec<u8> = outgoing.drain(..outgoing.len().min(MOST_LINK_BYTES)).collect();
        self.qemu.answer(&sample, &bytes)
    }

    fn close(&mut self) -> Farewell {
        Farewell {
            firmware_log: self.qemu.stop(),
            motor_flags: std::mem::take(&mut self.flags),
        }
    }
}

/// Volts and amperes → what the converters of the board would read.
fn convert(reading: &Reading, config: &Config) -> Sample {
    let vbus = (reading.supply_v / config.vbus_v_per_lsb).round();
    let current = (reading.current_a / config.current_a_per_lsb).round();
    Sample {
        count: reading.count,
        vbus_raw: match vbus.is_finite() {
            true => vbus.clamp(0.0, CONVERTER_MAX) as u16,
            false => Sample::VBUS_NOT_MEASURED,
        },
        current_raw: match current.is_finite() {
            true => current.clamp(-CONVERTER_MAX, CONVERTER_MAX) as i16,
            false => Sample::CURRENT_NOT_SENSED,
        },
    }
}
