//! Constants that the link prepares and the control tick puts in force by pointer: they come to the same as in an axis that works
//! them out itself, whatever is refused on the way, and no place for them is ever lost.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Axis, Sample};
use servo::config::Config;
use servo::link::in_force::InForce;
use servo::link::protocol::{Command, Refusal, Request};
use servo::optional::Optional;
use servo::protect::Thermal;
use servo::store::AxisParameters;
use std::cell::Cell;
use std::rc::Rc;
use trials::power_cut::sets;
use trials::simulated_servo::config;

const AXES: usize = 2;

/// Constants in one of [`AXES`] + 1 places.
#[derive(Clone)]
struct Handle(Rc<Held>);

struct Held {
    axis: Axis,
    free: Rc<Cell<usize>>,
}

impl AsRef<Axis> for Handle {
    fn as_ref(&self) -> &Axis {
        &self.0.axis
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        self.free.set(self.free.get() + 1);
    }
}

/// Link and control tick of an image, in little: one order at a time.
struct Image {
    free: Rc<Cell<usize>>,
    in_force: InForce<Handle, AXES>,
    axes: [ServoAxis<Handle>; AXES],
}

impl Image {
    fn new() -> Self {
        Image {
            free: Rc::new(Cell::new(AXES + 1)),
            in_force: InForce::new([const { None }; AXES]),
            axes: Default::default(),
        }
    }

    fn command(&mut self, axis: u8, command: Command) -> Result<(), Refusal> {
        let place = |axis| {
            let free = self.free.get().checked_sub(1).expect("a place is free");
            self.free.set(free);
            Ok(Handle(Rc::new(Held { axis, free: Rc::clone(&self.free) })))
        };
        let order = self.in_force.prepare(&Request { axis, command }, |_| Ok(()), place)?;
        self.axes[usize::from(axis)].carry_out(&order)?;
        self.in_force.note(axis, &order);
        Ok(())
    }

    fn parameters(&self, axis: u8) -> Option<AxisParameters> {
        self.axes[usize::from(axis)].parameters()
    }
}

fn chosen() -> AxisParameters {
    let mut parameters = sets::set(1).axes[0].expect("an axis");
    parameters.config = Config { current_limit_a: Optional::new(3.0), ..config() };
    parameters.protection.thermal = Some(Thermal { continuous_a: 1.5, time_constant_s: 40 });
    parameters.protection.command_timeout_ms = 250;
    parameters.tuning.bandwidth = 2.5;
    parameters.compensation = false;
    parameters
}

/// Another machine, which says nothing about limits.
fn other() -> Config {
    Config { supply_nominal_v: 24.0, current_limit_a: Optional::NONE, ..config() }
}

fn assert_kept(image: &Image, axis: u8) {
    let (now, before) = (image.parameters(axis).expect("configured"), chosen());
    assert_eq!(now.config, Config { current_limit_a: before.config.current_limit_a, ..other() });
    assert_eq!((now.tuning, now.protection), (before.tuning, before.protection));
    assert!(!now.compensation);
    assert!(now.estimates.gain.trusted().is_none(), "what was learned is forgotten");
}

fn drive(image: &mut Image) {
    image.command(0, Command::Arm).expect("it rests");
    image.command(0, Command::Voltage(3.0)).expect("armed");
    image.axes[0].advance(Sample::NONE);
}

#[test]
fn a_bare_configuration_keeps_limits_loops_and_protection_through_the_link() {
    let mut image = Image::new();
    image.command(0, Command::Restore(chosen())).expect("a good one");
    image.command(0, Command::Configure(other())).expect("a good one");
    assert_kept(&image, 0);
    // Not those of another axis.
    image.command(1, Command::Configure(other())).expect("a good one");
    assert_eq!(image.parameters(1).expect("configured").config, other());
    // Nothing is kept beyond a reset.
    image.command(0, Command::Reset).expect("open");
    image.command(0, Command::Configure(other())).expect("a good one");
    assert_eq!(image.parameters(0).expect("configured").config, other());
}

#[test]
fn what_is_refused_is_not_kept_and_the_next_configuration_is_right() {
    let mut image = Image::new();
    image.command(0, Command::Restore(chosen())).expect("a good one");
    drive(&mut image);
    let before = image.parameters(0);
    let mut another = chosen();
    another.tuning.bandwidth = 1.5;
    another.protection.command_timeout_ms = 100;
    for command in [Command::Restore(another), Command::Configure(other()), Command::Reset] {
        assert_eq!(image.command(0, command), Err(Refusal::BridgeDriven), "{command:?}");
        assert_eq!(image.parameters(0), before, "{command:?}");
    }
    // The thermal limit does not fit this range of the current: the link says so.
    image.command(0, Command::Stop).expect("always");
    image.axes[0].advance(Sample::NONE);
    let coarse = Config { current_a_per_lsb: 2.0, ..other() };
    let refused = image.command(0, Command::Configure(coarse));
    assert!(matches!(refused, Err(Refusal::Parameters(_))), "{refused:?}");
    assert_eq!(image.parameters(0), before);

    image.command(0, Command::Configure(other())).expect("the bridge is open");
    assert_kept(&image, 0);
}

/// Draws what a host may send, refused or not.
fn draw(random: &mut ChaCha8Rng) -> Command {
    let bandwidth = random.random_range(0.7..5.0);
    match random.random_range(0..10) {
        0..3 => Command::Configure(other()),
        3 => Command::Configure(Config { current_a_per_lsb: 2.0, ..other() }),
        4 => Command::Configure(Config { tick_hz: 10_000, ..config() }),
        5 => {
            let mut parameters = chosen();
            parameters.tuning.bandwidth = bandwidth;
            Command::Restore(parameters)
        }
        6 => Command::Arm,
        7 => Command::Voltage(2.0),
        8 => Command::Stop,
        _ => Command::Reset,
    }
}

#[test]
fn hundreds_of_orders_come_to_the_same_as_without_a_link_and_lose_no_place() {
    let mut random = ChaCha8Rng::seed_from_u64(305);
    let (mut image, mut owners) = (Image::new(), [(); AXES].map(|()| ServoAxis::new()));
    let mut carried_out = 0;
    for turn in 0..3_000 {
        let (axis, command) = (random.random_range(0..AXES as u8), draw(&mut random));
        let owner = &mut owners[usize::from(axis)];
        let alone = Order::of(&command).and_then(|order| owner.execute(&order)).is_ok();
        assert_eq!(image.command(axis, command).is_ok(), alone, "{turn}: {command:?}");
        carried_out += usize::from(alone);
        for (owner, axis) in owners.iter_mut().zip(&mut image.axes) {
            owner.advance(Sample::NONE);
            axis.advance(Sample::NONE);
            assert_eq!((owner.parameters(), owner.record()), (axis.parameters(), axis.record()), "{turn}");
        }
        let configured = owners.iter().filter(|owner| owner.config().is_some()).count();
        assert_eq!(image.free.get(), AXES + 1 - configured, "{turn}");
    }
    assert!(carried_out > 1_000, "{carried_out}");
}
