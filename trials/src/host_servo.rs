//! The servo's library behind a wire, without a chip: the bytes, the commands and the control tick of the firmware, any motor,
//! and a store that outlives a power cut. Much faster than QEMU, so that hours of motion can be interrupted hundreds of times.

use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Bridge, Sample};
use servo::config::Config;
use servo::link::board::{Board, Clock, Name};
use servo::link::inbox::{Inbox, Incoming};
use servo::link::protocol::{Command, Message, Refusal, Request, ResetCause, encode};
use servo::link::trial::Trial;
use servo::store::{AxisParameters, Found, LAYOUT, StoreEvent};
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;
use std::rc::Rc;
use truing::device::link::Wire;
use truing::device::motor::{Drive, Motor};
use truing::text::input_error::InputError;

/// Full scale of the virtual 12-bit converters.
const CONVERTER_MAX: f32 = 4095.0;

/// What survives the servo, and what a test may look at or pull.
#[derive(Clone, Default)]
pub struct Outside {
    /// The flash.
    pub stored: Rc<RefCell<Option<AxisParameters>>>,
    /// What is in force, tick by tick.
    pub in_force: Rc<RefCell<Option<AxisParameters>>>,
    /// State of the bridge in the last tick.
    pub bridge: Rc<Cell<Bridge>>,
    /// Ticks since power-up.
    pub ticks: Rc<Cell<u32>>,
    /// From this tick on the wire is lost, for the host; the servo goes on.
    pub lost_at: Rc<Cell<Option<u32>>>,
    /// It goes on for a second and so many more before its host is told.
    pub lives_on_s: Rc<Cell<u32>>,
}

/// A servo of one axis with its motor.
pub struct HostServo {
    inbox: Inbox,
    joint: ServoAxis,
    motor: Box<dyn Motor>,
    config: Config,
    /// Commands on their way through the PWM.
    line: VecDeque<(Bridge, i16)>,
    every: u32,
    sequence: u16,
    trial: Trial,
    outside: Outside,
}

impl HostServo {
    /// A power-up: what is stored comes into force. `config`: what the converters are scaled by.
    pub fn power_up(motor: Box<dyn Motor>, config: Config, outside: &Outside) -> Self {
        outside.ticks.set(0);
        // The motor passes the time before a tick, in which what the tick before has said acts at the earliest.
        let line = VecDeque::from(vec![(Bridge::Open, 0); usize::from(config.pwm_delay_ticks) + 1]);
        Self {
            inbox: Inbox::new(),
            joint: stored(outside),
            motor,
            config,
            line,
            every: 0,
            sequence: 0,
            trial: Trial::default(),
            outside: outside.clone(),
        }
    }

    /// The chip starts anew; the motor goes on as it is.
    fn restart(&mut self) {
        (self.inbox, self.joint, self.trial) = (Inbox::new(), stored(&self.outside), Trial::default());
        self.every = 0;
        self.outside.ticks.set(0);
    }

    fn say(&mut self, message: Message, out: &mut Vec<u8>) {
        self.inbox.answered(&message);
        self.sequence = self.sequence.wrapping_add(1);
        let mut buffer = [0; servo::link::protocol::FRAME_CAPACITY];
        out.extend_from_slice(encode(self.sequence, message, &mut buffer).expect("it fits"));
    }

    fn execute(&mut self, to: u16, request: Request, out: &mut Vec<u8>) {
        self.trial.heard();
        let result = self.order(&request);
        self.say(Message::Answer { to, tick: self.outside.ticks.get(), result }, out);
        let parameters = self.joint.parameters();
        match request.command {
            Command::Hello if result.is_ok() => self.say(hello(), out),
            Command::Parameters if result.is_ok() => {
                self.say(Message::Parameters { axis: 0, parameters }, out)
            }
            Command::Save if result.is_ok() => {
                *self.outside.stored.borrow_mut() = parameters;
                self.say(Message::Store(StoreEvent::Saved), out);
            }
            _ => {}
        }
    }

    fn order(&mut self, request: &Request) -> Result<(), Refusal> {
        match request.command {
            _ if request.axis != 0 => Err(Refusal::NoSuchAxis),
            Command::Subscribe { every } => {
                self.every = every;
                Ok(())
            }
            Command::OnTrial(ticks) => {
                self.trial = Trial::new(request.axis, ticks);
                Ok(())
            }
            Command::Save => self.joint.rests().map(|_| ()).ok_or(Refusal::NotAtRest),
            Command::Hello | Command::Parameters => Ok(()),
            ref command => self.joint.execute(&Order::of(command)?),
        }
    }

    /// One control tick; the motor answers the command that acts now.
    fn tick(&mut self, out: &mut Vec<u8>) -> Result<(), InputError> {
        let tick = self.outside.ticks.get();
        let (bridge, duty) = self.line.front().copied().unwrap_or_default();
        let reading = self.motor.pass(&Drive {
            tick,
            duty: f32::from(duty) / f32::from(self.config.pwm_full_scale),
            bridge,
            tick_s: 1.0 / self.config.tick_hz as f32,
        })?;
        let converted =
            |value: f32, per_lsb: f32| (value / per_lsb).round().clamp(-CONVERTER_MAX, CONVERTER_MAX);
        let sample = Sample {
            count: reading.count,
            vbus_raw: match reading.supply_v.is_finite() {
                true => converted(reading.supply_v, self.config.vbus_v_per_lsb) as u16,
                false => Sample::VBUS_NOT_MEASURED,
            },
            current_raw: match reading.current_a.is_finite() {
                true => converted(reading.current_a, self.config.current_a_per_lsb) as i16,
                false => Sample::CURRENT_NOT_SENSED,
            },
        };
        let ended = self.joint.step(sample);
        let (output, concluded) = (ended.output, ended.concluded.copied());
        self.line.pop_front();
        self.line.push_back((output.bridge, output.duty));
        if self.every > 0 && tick.is_multiple_of(self.every) {
            self.say(Message::Telemetry { axis: 0, tick, cost: 0, record: output.record }, out);
        }
        if let Some(outcome) = concluded {
            self.say(Message::Commissioned { axis: 0, tick, outcome }, out);
        }
        self.outside.ticks.set(tick.wrapping_add(1));
        self.outside.bridge.set(output.bridge);
        if self.trial.silent().is_some() {
            self.joint.execute(&Order::of(&Command::Stop).expect("no numbers")).expect("always");
            if !self.joint.is_driven() {
                self.restart();
            }
        }
        *self.outside.in_force.borrow_mut() = self.joint.parameters();
        Ok(())
    }
}

/// An axis after power-up: what is stored is in force.
fn stored(outside: &Outside) -> ServoAxis {
    let mut joint = ServoAxis::new();
    if let Some(stored) = *outside.stored.borrow() {
        let order = Order::restore(&stored).expect("what was stored was in force once");
        joint.execute(&order).expect("nothing runs at power-up");
    }
    joint
}

impl Wire for HostServo {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        if self.outside.lost_at.get().is_some_and(|lost| self.outside.ticks.get() >= lost) {
            // It stays lost, whatever its ticks are after a new start.
            self.outside.lost_at.set(Some(0));
            for _ in 0..(1 + self.outside.lives_on_s.get()) * self.config.tick_hz {
                self.tick(&mut Vec::new())?;
            }
            return Err(InputError("the line is lost".into()));
        }
        for byte in outgoing.drain(..) {
            match self.inbox.push(byte) {
                Some(Incoming::Execute(to, request)) => self.execute(to, request, incoming),
                Some(Incoming::Answer(answer)) => self.say(answer, incoming),
                Some(Incoming::Drop(_)) | None => {}
            }
        }
        self.tick(incoming)
    }
}

fn hello() -> Message {
    let board = Board {
        name: Name::new("host"),
        scales: servo::drivers::scales::Scales::default(),
        clock: Clock::Simulated,
        brown_out_reset_off: false,
        gates: None,
        zeros: [[Sample::CURRENT_NOT_SENSED; 2]; servo::store::MAX_AXES],
    };
    Message::Hello { axes: 1, cause: ResetCause::Power, stored: Found::Set { layout: LAYOUT }, board }
}
