//! A drawn plant as the motor behind the firmware image: the truth's simulator with its sensors' imperfections.

use crate::families::Plant;
use truing::device::motor::{Drive, Motor, Reading};
use truing::synthetic::reference_plant::{Converter, Encoder, Simulator};
use truing::text::input_error::InputError;

/// Error of the simulation in one step, relative to full scale.
const TOLERANCE: f64 = 1e-6;

/// The plant in lock-step with the image.
pub struct VirtualMotor {
    simulator: Simulator,
    encoder: Encoder,
    supply: Option<Converter>,
    current: Option<Converter>,
}

impl VirtualMotor {
    /// At rest.
    pub fn new(plant: &Plant) -> Self {
        let (config, sensing) = (&plant.config, &plant.sensing);
        let noise = sensing.vbus_noise * f64::from(config.supply_nominal_v);
        let stall = plant.motor.drive.supply_v / plant.motor.resistance_ohm;
        let converter = |rms, delay, salt: u64| Converter::new(rms, 0.0, delay, plant.seed ^ salt);
        Self {
            simulator: Simulator::new(plant.motor.clone(), TOLERANCE, plant.seed),
            encoder: Encoder::new(config.counts_per_rev, sensing.phase_error, plant.seed ^ 1)
                .losing(sensing.missing),
            supply: sensing.vbus.then(|| converter(noise, sensing.vbus_delay, 2)),
            current: sensing.current.then(|| converter(sensing.current_noise * stall, 0, 3)),
        }
    }
}

impl Motor for VirtualMotor {
    fn pass(&mut self, drive: &Drive) -> Result<Reading, InputError> {
        let reading = self.simulator.step(f64::from(drive.duty), drive.bridge, f64::from(drive.tick_s));
        let measured = |converter: &mut Option<Converter>, value| {
            converter.as_mut().map_or(f32::NAN, |converter| converter.read(value) as f32)
        };
        Ok(Reading {
            count: self.encoder.count(reading.theta) as i32,
            current_a: measured(&mut self.current, reading.current),
            supply_v: measured(&mut self.supply, reading.supply),
            flags: 0,
        })
    }
}
