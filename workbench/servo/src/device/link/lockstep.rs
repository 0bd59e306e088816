//! The firmware in QEMU with its motors on the host: a turn is one control tick.

use super::{Farewell, Wire};
use crate::device::motor::qemu::{Lines, MOST_LINK_BYTES, Options, Qemu};
use crate::device::motor::{Drive, Motor, Reading};
use servo::axis::Sample;
use servo::config::Config;
use std::cell::Cell;
use std::rc::Rc;
use truing_core::text::input_error::InputError;

/// Full scale of the virtual 12-bit converters.
const CONVERTER_MAX: f32 = 4095.0;

/// A motor, and what its axis is told: the converters between them go by it.
pub type Joint = (Box<dyn Motor>, Config);

/// QEMU, the motors, and the converters between them.
pub struct Lockstep {
    qemu: Qemu,
    joints: Vec<Joint>,
    /// Of the first motor.
    flags: Vec<u32>,
    lines: Rc<Cell<Lines>>,
}

impl Lockstep {
    /// Starts QEMU with an image of one axis.
    pub fn start(options: &Options, motor: Box<dyn Motor>, config: Config) -> Result<Self, InputError> {
        Self::start_all(options, vec![(motor, config)])
    }

    /// Starts QEMU with as many motors as the image has axes.
    pub fn start_all(options: &Options, joints: Vec<Joint>) -> Result<Self, InputError> {
        Ok(Self { qemu: Qemu::start(options)?, joints, flags: Vec::new(), lines: Rc::default() })
    }

    /// A handle to the lines of the virtual board, to be pulled while a client owns this wire.
    pub fn lines(&self) -> Rc<Cell<Lines>> {
        Rc::clone(&self.lines)
    }
}

impl Wire for Lockstep {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        let said = self.qemu.listen()?;
        incoming.extend_from_slice(&said.link);
        let (motors, axes) = (self.joints.len(), said.axes.len());
        if motors != axes {
            let what = format!("the firmware image drives {axes} axes, and there are motors for {motors}");
            return Err(InputError(what));
        }
        let mut samples = Vec::with_capacity(axes);
        for (axis, ((motor, config), acting)) in self.joints.iter_mut().zip(&said.axes).enumerate() {
            let reading = motor.pass(&Drive {
                tick: said.tick,
                duty: f32::from(acting.duty) / f32::from(config.pwm_full_scale),
                bridge: acting.bridge,
                tick_s: 1.0 / config.tick_hz as f32,
            })?;
            if axis == 0 {
                self.flags.push(reading.flags);
            }
            samples.push(convert(&reading, config));
        }
        let bytes: Vec<u8> = outgoing.drain(..outgoing.len().min(MOST_LINK_BYTES)).collect();
        self.qemu.answer(self.lines.get(), &samples, &bytes)
    }

    fn close(&mut self) -> Farewell {
        Farewell { firmware_log: self.qemu.stop(), motor_flags: std::mem::take(&mut self.flags) }
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
