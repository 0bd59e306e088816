//! The servo as the host meets it: bytes in, answers out, a motor behind the bridge.
//!
//! The motor is the simplest one that moves, stalls and coasts like one, so that a fuzzer gets through many ticks:
//! speed follows the voltage beyond a dead zone with one time constant (exact for a constant voltage), an open bridge
//! lets it coast, the encoder counts whole counts.

use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Bridge, Output, Sample};
use servo::config::Config;
use servo::link::inbox::{Inbox, Incoming};
use servo::link::protocol::{Command, Message, Refusal, Request};
use servo::optional::Optional;
use servo::protect::Condition;
use servo::store::AxisParameters;

/// Dead zone of the motor, share of the full duty.
const DEAD_ZONE: f64 = 0.08;
/// Counts per tick at full duty.
const FULL_SPEED: f64 = 8.0;
/// Ticks of the time constant, driven; an open bridge coasts twice as long.
const TIME_CONSTANT: f64 = 400.0;

/// A configuration that this motor fits.
pub fn config() -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4000,
        rated_speed_rad_s: 125.0,
        tick_hz: 10_000,
        time_constant_hint_s: Optional::new(0.04),
        gear_ratio: 10.0,
        pwm_delay_ticks: 1,
        pwm_full_scale: 8400,
        vbus_v_per_lsb: 0.01,
        current_a_per_lsb: 0.005,
        ..Config::EXAMPLE
    }
}

/// A motor on a shaft with an encoder.
#[derive(Clone, Debug, Default)]
struct Motor {
    position: f64,
    speed: f64,
}

impl Motor {
    fn pass(&mut self, bridge: Bridge, duty: i16) {
        let share = f64::from(duty) / f64::from(config().pwm_full_scale);
        let beyond = (share.abs() - DEAD_ZONE).max(0.0) * share.signum();
        let (target, time_constant) = match bridge {
            Bridge::Driven => (FULL_SPEED * beyond, TIME_CONSTANT),
            Bridge::Shorted => (0.0, TIME_CONSTANT),
            Bridge::Open => (0.0, 2.0 * TIME_CONSTANT),
        };
        self.speed += (target - self.speed) * (1.0 - (-1.0 / time_constant).exp());
        self.position += self.speed;
    }

    fn count(&self) -> i32 {
        self.position.floor() as i64 as i32
    }
}

/// Link, joint and motor in lock-step.
#[derive(Clone, Debug)]
pub struct SimulatedServo {
    inbox: Inbox,
    joint: ServoAxis,
    motor: Motor,
    waiting: Option<(Bridge, i16)>,
    tick: u32,
    /// Requests that came over the link and were executed.
    pub executed: Vec<(u16, Request)>,
    /// Was the axis armed and neither stopped nor configured since?
    pub armed: bool,
    /// The configuration in force.
    pub config: Option<Config>,
    /// What the converters read.
    pub world: Sample,
}

impl Default for SimulatedServo {
    fn default() -> Self {
        SimulatedServo {
            inbox: Inbox::new(),
            joint: ServoAxis::new(),
            motor: Motor::default(),
            waiting: None,
            tick: 0,
            executed: Vec::new(),
            armed: false,
            config: None,
            world: Sample { count: 0, vbus_raw: 1200, current_raw: Sample::CURRENT_NOT_SENSED },
        }
    }
}

impl SimulatedServo {
    /// Takes bytes; returns the answers. What the link task of the image does between two ticks.
    pub fn receive(&mut self, bytes: &[u8]) -> Vec<Message> {
        bytes
            .iter()
            .filter_map(|&byte| {
                let incoming = self.inbox.push(byte)?;
                self.handle(incoming)
            })
            .collect()
    }

    fn handle(&mut self, incoming: Incoming) -> Option<Message> {
        match incoming {
            Incoming::Execute(to, request) => {
                let (tick, result) = (self.tick, self.execute(to, request));
                let answer = Message::Answer { to, tick, result };
                self.inbox.answered(&answer);
                Some(answer)
            }
            Incoming::Answer(answer) => Some(answer),
            Incoming::Drop(_) => None,
        }
    }

    fn execute(&mut self, to: u16, request: Request) -> Result<(), Refusal> {
        self.executed.push((to, request));
        self.request(request)
    }

    /// A request that arrives without the link: the simulated servo has one axis.
    pub fn request(&mut self, request: Request) -> Result<(), Refusal> {
        match request.axis {
            0 => self.order(request.command),
            _ => Err(Refusal::NoSuchAxis),
        }
    }

    /// A command that reaches the joint without the link.
    pub fn order(&mut self, command: Command) -> Result<(), Refusal> {
        use Command::{Hello, OnTrial, Parameters, Save, Subscribe};
        if let Subscribe { .. } | OnTrial(_) | Hello | Parameters | Save = command {
            return Ok(());
        }
        self.joint.execute(&Order::of(&command)?)?;
        match command {
            Command::Arm => self.armed = true,
            Command::Stop => self.armed = false,
            Command::Configure(config) | Command::Restore(AxisParameters { config, .. }) => {
                (self.armed, self.config) = (false, Some(config));
            }
            Command::Reset => (self.armed, self.config) = (false, None),
            _ => {}
        }
        Ok(())
    }

    /// Something that only the image sees.
    pub fn raise(&mut self, notice: Condition) {
        self.joint.raise(notice);
    }

    /// The shaft is found elsewhere.
    pub fn jump(&mut self, counts: i32) {
        self.motor.position += f64::from(counts);
    }

    /// One control tick.
    pub fn tick(&mut self) -> Output {
        let sample = Sample { count: self.motor.count(), ..self.world };
        let output = self.joint.step(sample).output;
        let (bridge, duty) = self.waiting.replace((output.bridge, output.duty)).unwrap_or_default();
        self.motor.pass(bridge, duty);
        self.tick = self.tick.wrapping_add(1);
        output
    }

    /// So many ticks; the last output.
    pub fn ticks(&mut self, count: u32) -> Output {
        (0..count).map(|_| self.tick()).last().unwrap_or_default()
    }

    /// Configured, armed, and on the way to one radian: the state in which a stray command would do most.
    pub fn driving() -> Self {
        let mut servo_under_test = SimulatedServo::default();
        for command in [Command::Configure(config()), Command::Arm, Command::Position(1.0)] {
            servo_under_test.order(command).expect("the test's own commands are right");
            servo_under_test.tick();
        }
        let output = servo_under_test.ticks(20);
        assert!(output.bridge == Bridge::Driven && output.duty != 0, "the motor is driven: {output:?}");
        servo_under_test
    }
}
