//! A board whose motor, encoder, supply or wiring breaks.

use crate::bench::Board;
use crate::families::Plant;
use servo::axis::{Bridge, Sample};
use truing::synthetic::reference_plant::drive::{Command, Piece};
use truing::synthetic::reference_plant::{Drive, Motor, Reading};

/// What breaks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Injury {
    /// Nothing.
    None,
    /// The shaft is seized: it stands where it is, the winding goes on.
    Stall,
    /// The counter stands where it is.
    EncoderUnplugged,
    /// The counter runs backwards from now on.
    EncoderReversed,
    /// The motor's leads are swapped.
    MotorReversed,
    /// The motor's leads are off: no current, no torque.
    MotorDisconnected,
    /// The counter jumps once.
    Jump(i32),
    /// The coupling slips: the counter shows this share of the motion.
    Slip(f64),
    /// The supply is this share of what it was.
    Supply(f64),
    /// The supply is not measured any more.
    SupplyUnseen,
    /// The current sensor shows this many times the current.
    Current(f64),
}

/// A shaft that stands: `L di/dt = v − R i`.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Seized {
    current: f64,
    /// Mean over the last tick.
    shown: f64,
    count: i32,
    /// It is an end stop: a voltage of the other sign lets go.
    towards: Option<f64>,
}

/// A board that may break. Feed it commands, read samples.
#[derive(Clone, Debug)]
pub struct World {
    /// The board as it was built.
    pub board: Board,
    motor: Motor,
    injury: Injury,
    seized: Option<Seized>,
    /// Counter when it broke.
    broken_at: i32,
    /// Supply as a share of the motor's own.
    supply: f64,
    amperes: f64,
    full_scale: f64,
    tick_s: f64,
    acting: (Bridge, f64),
}

impl World {
    /// A whole one.
    pub fn new(plant: &Plant) -> Self {
        Self::around(plant, Board::new(plant))
    }

    /// … that has already run.
    pub fn around(plant: &Plant, board: Board) -> Self {
        Self {
            board,
            motor: plant.motor.clone(),
            injury: Injury::None,
            seized: None,
            broken_at: 0,
            supply: 1.0,
            amperes: f64::from(plant.config.current_a_per_lsb),
            full_scale: f64::from(plant.config.pwm_full_scale),
            tick_s: 1.0 / f64::from(plant.config.tick_hz),
            acting: (Bridge::Open, 0.0),
        }
    }

    /// Breaks now.
    pub fn injure(&mut self, injury: Injury) {
        let count = self.board.sample().count;
        self.injury = injury;
        self.broken_at = count;
        if injury == Injury::Stall {
            self.seize(count, None);
        }
        if let Injury::Supply(share) = injury {
            self.supply = share;
        }
    }

    /// A hard end stop stands right here: the shaft cannot go on in this direction, but can turn back.
    pub fn block(&mut self, direction: f64) {
        let count = self.board.sample().count;
        self.seize(count, Some(direction));
    }

    fn seize(&mut self, count: i32, towards: Option<f64>) {
        let current = self.board.reading().current;
        self.seized = Some(Seized { current, shown: current, count, towards });
    }

    /// The supply is this share of the motor's own from now on.
    pub fn set_supply(&mut self, share: f64) {
        self.supply = share;
    }

    /// What the firmware reads now.
    pub fn sample(&mut self) -> Sample {
        let mut sample = self.board.sample();
        if sample.vbus_raw != Sample::VBUS_NOT_MEASURED {
            sample.vbus_raw = (f64::from(sample.vbus_raw) * self.supply).round() as u16;
        }
        let since = sample.count.wrapping_sub(self.broken_at);
        let of_current = |share: f64| (f64::from(sample.current_raw) * share).round() as i16;
        match self.injury {
            Injury::EncoderUnplugged => sample.count = self.broken_at,
            Injury::EncoderReversed => sample.count = self.broken_at.wrapping_sub(since),
            Injury::Jump(counts) => sample.count = sample.count.wrapping_add(counts),
            Injury::Slip(share) => {
                sample.count = self.broken_at.wrapping_add((f64::from(since) * share).floor() as i32);
            }
            // The sensor sits at the bridge: it sees what the bridge drives.
            Injury::MotorReversed if Sample::sensed(sample.current_raw).is_some() => {
                sample.current_raw = sample.current_raw.saturating_neg();
            }
            Injury::SupplyUnseen => sample.vbus_raw = Sample::VBUS_NOT_MEASURED,
            Injury::Current(share) if Sample::sensed(sample.current_raw).is_some() => {
                sample.current_raw = of_current(share);
            }
            _ => {}
        }
        if let Some(seized) = &self.seized {
            sample.count = seized.count;
            if Sample::sensed(sample.current_raw).is_some() {
                sample.current_raw = (seized.shown / self.amperes).round() as i16;
            }
        }
        sample
    }

    /// Takes the command of this tick and lets one tick pass.
    pub fn pass(&mut self, bridge: Bridge, duty: i16) -> Reading {
        let (bridge, duty) = match self.injury {
            Injury::MotorReversed => (bridge, -duty),
            Injury::MotorDisconnected => (Bridge::Open, 0),
            _ => (bridge, duty),
        };
        let scaled = (f64::from(duty) * self.supply).round() as i16;
        let acting = std::mem::replace(&mut self.acting, (bridge, f64::from(scaled) / self.full_scale));
        if let Some(seized) = self.seized
            && seized.towards.is_some_and(|side| side * acting.1 < 0.0)
        {
            self.seized = None;
            self.board.released(seized.current);
        }
        if let Some(seized) = &mut self.seized {
            seized.pass(&self.motor, acting, self.tick_s);
            return Reading { omega: 0.0, current: seized.shown, ..self.board.reading() };
        }
        self.board.pass(bridge, scaled)
    }

    /// The state of the world; a seized shaft stands where it was seized.
    pub fn reading(&self) -> Reading {
        self.board.reading()
    }
}

impl Seized {
    /// One tick, exact for a constant voltage.
    fn pass(&mut self, motor: &Motor, (bridge, duty): (Bridge, f64), tick_s: f64) {
        let volts = match bridge {
            Bridge::Open => {
                (self.current, self.shown) = (0.0, 0.0);
                return;
            }
            Bridge::Shorted => 0.0,
            Bridge::Driven => at_winding(&motor.drive, duty),
        };
        let end = volts / motor.resistance_ohm;
        let constants = tick_s * motor.resistance_ohm / motor.inductance_h;
        let away = self.current - end;
        self.shown = end + away * -(-constants).exp_m1() / constants;
        self.current = end + away * (-constants).exp();
    }
}

/// Voltage that the drive offers the winding.
fn at_winding(drive: &Drive, duty: f64) -> f64 {
    let scaled = drive.scaled(drive.requested(Command::Duty(duty), drive.supply_v));
    let behind = drive.behind_dead_zone(scaled, Piece::of(scaled, drive.dead_zone_v));
    drive.behind_limit(behind, Piece::of(behind, drive.limit_v))
}
