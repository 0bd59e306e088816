//! Commissionings that begin badly: a shaft that turns on from before, a winding slower than the first pulses.

use crate::rig::{bench, config, power_up, text};
use servo::config::Config;
use servo::identify::estimate::Reason;
use servo::motion::excitation::{Sweep, Waveform};
use servo::optional::Optional;
use trials::host_servo::{HostServo, Outside};
use truing::device::motor::Builtin;
use truing::device::session::{Done, Start, Task};
use truing::improve::bench::Bench;
use truing::system::model;

const COMMISSION: Task = Task::Commission { budget_s: 5.0, seed: 1 };

/// Why it was refused.
fn commissioned(bench: &Bench, config: Config) -> Option<Reason> {
    let result = bench.session(Start::Configure(config.into()), &[COMMISSION]).expect("a servo that answers");
    let Some(Done::Commissioned(outcome)) = result.done.last() else { panic!("no commissioning") };
    outcome.refused
}

/// Hardly any friction: with the bridge open it turns on for seconds, the same way under both voltages of the ramps.
#[test]
fn a_shaft_that_turns_on_from_before_is_braked_first() {
    let waveform =
        Waveform { amplitude_v: 8.0, from_hz: 0.25, to_hz: 0.25, sweep: Sweep::Linear, duration_ms: 1000 };
    let bench = bench(power_up("", &Outside::default()));
    bench.session(Start::Configure(config().into()), &[Task::Excite(waveform)]).expect("an excited motor");
    assert_eq!(commissioned(&bench, config()), None);
}

/// What its first pulses show is the answer to the part before.
#[test]
fn a_slow_winding_is_no_reversed_motor() {
    let config =
        Config { gear_ratio: 20.0, time_constant_hint_s: Optional::NONE, counts_per_rev: 4096, ..config() };
    let slow = text("[known.transport_delay]\nseconds = 0.004\n").replace("L_h = 0.0005", "L_h = 0.02");
    let model = model::parse("motor.toml", &slow).expect("a model");
    let servo = HostServo::power_up(Box::new(Builtin::new(&model, &config, 3)), config, &Outside::default());
    assert_eq!(commissioned(&bench(servo), config), None);
}
