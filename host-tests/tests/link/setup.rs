//! What an axis file chooses about loops, limits and protection: read with errors that tell what to do, put in force over
//! the link, and kept where a later file is silent.

use servo::axis::servo_axis::{Order, ServoAxis};
use servo::drivers::scales::Scales;
use servo::link::protocol::{Command, Refusal};
use servo::optional::Optional;
use servo::protect::{Action, Fault, Thermal};
use servo::store::AxisParameters;
use std::path::Path;
use trials::families::{Family, Options as PlantOptions, Plant, Seeds, Severity};
use trials::firmware::power_up;
use trials::simulated_servo::{self, SimulatedServo};
use truing::device::axis_file;
use truing::device::link::{Client, Lockstep};
use truing::device::replay;
use truing::device::session::{self, Listening, Profile, SessionResult, Start, Task};
use truing::device::setup::{Choices, Setup};

const MACHINE: &str = "[supply]\nnominal_v = 12.0\n[encoder]\ncounts_per_rev = 4000\n\
                       [axis]\nrated_speed_rad_s = 125.0\ntick_hz = 1000\n";
const CHOICES: &str = "[limits]\ncurrent_a = 6.5\ncontinuous_current_a = 1.5\nthermal_time_constant_s = 40\n\
                       command_timeout_ms = 250\n[loops]\nbandwidth = 2.5\nintegral = false\ncompensation = false\n\
                       [protection]\nstalled = \"brake\"\ncommand_timeout = \"hold\"\n";

fn parse(text: &str) -> Setup {
    axis_file::parse("axis.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// All that `CHOICES` says.
fn assert_chosen(parameters: &AxisParameters) {
    assert_eq!(parameters.config.current_limit_a, Optional::new(6.5));
    assert_eq!((parameters.tuning.bandwidth, parameters.tuning.integral), (2.5, false));
    assert!(!parameters.compensation);
    let protection = &parameters.protection;
    let thermal = Thermal { continuous_a: 1.5, time_constant_s: 40 };
    assert_eq!((protection.thermal, protection.command_timeout_ms), (Some(thermal), 250));
    let braking: Vec<Fault> =
        Fault::ALL.into_iter().filter(|fault| protection.actions.of(*fault) == Action::Brake).collect();
    assert_eq!(braking, [Fault::Stalled]);
    assert_eq!(protection.actions.of(Fault::CommandTimeout), Action::Hold);
}

#[test]
fn a_file_chooses_by_the_keys_of_truing_params() {
    let chosen = parse(&[MACHINE, CHOICES].concat()).parameters(None);
    assert_chosen(&chosen);
    // What `truing params get` prints of it is the file again, key by key.
    let printed = truing::device::parameters::print(&chosen);
    let table: toml::Table = printed.parse().expect("TOML");
    let file: toml::Table = CHOICES.parse().expect("TOML");
    for (section, keys) in &file {
        for (key, value) in keys.as_table().expect("a table") {
            let get = table[section].get(key).unwrap_or_else(|| panic!("{section}.{key}"));
            assert_eq!(get.to_string(), value.to_string(), "{section}.{key}");
        }
    }
    // A file that says nothing chooses nothing.
    let silent = parse(MACHINE);
    assert_eq!(silent.choices, Choices::default());
    assert_chosen(&silent.parameters(Some(&chosen)));
}

#[test]
fn a_choice_that_cannot_be_is_named_with_what_to_do() {
    let cases: [(&str, &[&str]); 13] = [
        (
            "[loops]\nbandwith = 2.0\n",
            &["line 9", "[loops] bandwith", "nearest is `bandwidth`", "`integral`", "`compensation`"],
        ),
        ("[loops]\nbandwidth = 50.0\n", &["line 9", "loops.bandwidth", "between 0.6 and 20"]),
        (
            "[limits]\ncurrent_a = 6.5\nsupply_high_v = 500.0\n",
            &["line 10", "limits.supply_high_v", "between"],
        ),
        ("[limits]\njerk = 500.0\n", &["line 9", "[limits]", "nearest is `jerk_rad_s3`"]),
        ("[loops]\nbandwidth = \"fast\"\n", &["line 9", "[loops] bandwidth", "a number"]),
        ("[loops]\nintegral = 1\n", &["line 9", "[loops] integral", "true or false"]),
        ("[limits]\ncommand_timeout_s = 0.25\n", &["line 9", "[limits]", "nearest is `command_timeout_ms`"]),
        ("[limits]\ncommand_timeout_ms = 100000\n", &["line 9", "[limits] command_timeout_ms", "100000"]),
        (
            "[limits]\nthermal_time_constant_s = 30\n",
            &["limits.thermal_time_constant_s", "limits.continuous_current_a"],
        ),
        ("[limits]\ncontinuous_current_a = 1e6\n", &["limits.continuous_current_a", "between"]),
        (
            "[protection]\nstaled = \"brake\"\n",
            &["line 9", "`staled`", "[protection]", "nearest is stalled", "overspeed"],
        ),
        (
            "[protection]\nstalled = \"open\"\nover_current = \"brake\"\n",
            &["line 10", "protection.over_current", "`brake`", "choose open"],
        ),
        ("[protecton]\nstalled = \"brake\"\n", &["line 8", "protecton", "`protection`"]),
    ];
    for (text, expected) in cases {
        let error = axis_file::parse("axis.toml", &[MACHINE, text].concat()).expect_err(text).to_string();
        assert!(error.starts_with("axis.toml"), "{error}");
        assert_eq!(error.lines().count(), 1, "{error}");
        for part in expected {
            assert!(error.contains(part), "{part}: {error}");
        }
    }
}

fn order(axis: &mut ServoAxis, command: Command) -> Result<(), Refusal> {
    axis.execute(&Order::of(&command)?)
}

fn in_force(joint: &ServoAxis) -> AxisParameters {
    joint.parameters().expect("configured")
}

#[test]
fn a_new_configuration_keeps_choices_and_forgets_what_was_learned() {
    let mut chosen = parse(&[MACHINE, CHOICES].concat()).parameters(None);
    chosen.estimates.gain = trials::power_cut::sets::set(1).axes[0].expect("an axis").estimates.gain;
    let mut joint = ServoAxis::new();
    order(&mut joint, Command::Restore(chosen)).expect("accepted");
    assert_chosen(&in_force(&joint));

    let mut other = parse(MACHINE).config;
    other.supply_nominal_v = 24.0;
    order(&mut joint, Command::Configure(other)).expect("accepted");
    let now = in_force(&joint);
    assert_chosen(&now);
    assert_eq!(now.config.supply_nominal_v, 24.0);
    assert!(now.estimates.gain.trusted().is_none() && chosen.estimates.gain.trusted().is_some());

    // A limit of its own replaces the one before.
    other.current_limit_a = Optional::new(3.0);
    order(&mut joint, Command::Configure(other)).expect("accepted");
    assert_eq!(in_force(&joint).config.current_limit_a, Optional::new(3.0));

    // A current range that the thermal limit does not fit: refused as a whole, nothing has changed.
    let before = in_force(&joint);
    let coarse = servo::config::Config { current_a_per_lsb: 2.0, ..other };
    let refused = order(&mut joint, Command::Configure(coarse));
    assert!(matches!(refused, Err(Refusal::Parameters(_))), "{refused:?}");
    assert_eq!(in_force(&joint), before);

    // Reset forgets them.
    order(&mut joint, Command::Reset).expect("accepted");
    order(&mut joint, Command::Configure(other)).expect("accepted");
    let fresh = in_force(&joint);
    assert_eq!(fresh, Setup::from(other).parameters(None));
    // Nor does the servo_under_test of the other tests, which never chose anything, see a difference.
    assert_eq!(SimulatedServo::default().order(Command::Configure(simulated_servo::config())), Ok(()));
}

const COMMISSION: Task = Task::Commission { budget_s: 5.0, seed: 1 };

fn plant() -> Plant {
    let options = PlantOptions::default();
    Plant::draw(Family::G1, Severity::Nominal, Seeds::Evaluation(400_021), &options)
}

fn wire(flash: &Path) -> Lockstep {
    power_up(flash, &plant())
}

fn run(flash: &Path, setup: Setup, tasks: &[Task]) -> SessionResult {
    let listening = Listening { axis: 0, every: 1 };
    session::run_kept(Box::new(wire(flash)), Start::Configure(setup), listening, tasks, &mut |_| {})
        .and_then(session::SessionResult::complete)
        .expect("a session")
}

#[test]
fn the_image_takes_the_choices_of_a_file_and_keeps_them_through_the_next() {
    let folder = tempfile::tempdir().expect("a folder");
    let flash = folder.path().join("flash.bin");
    let choices = parse(&[MACHINE, CHOICES].concat()).choices;
    let mut config = plant().config;
    config.current_limit_a = Optional::new(6.5);
    let chosen = Setup { choices, ..config.into() };
    let sine = Task::Track {
        profile: Profile::Sine { amplitude_rad: 1.0, frequency_hz: 1.0, seconds: 1.0 },
        compensation: false,
    };
    let first = run(&flash, chosen, &[COMMISSION, sine.clone(), Task::Store]);
    assert_eq!(first.done.len(), 3, "{:?}", first.done);
    assert_eq!(first.tuning.bandwidth, 2.5);
    let verdict = replay::replay(&first.log.tape()).expect("a tape");
    assert!(verdict.identical(), "{verdict}");

    let mut client = Client::new(Box::new(wire(&flash)));
    assert_chosen(&client.parameters().expect("an answer").expect("stored"));
    // QEMU has no scales of its own: it keeps the host's.
    let board = client.hello().expect("an answer").board;
    assert_eq!((board.name.as_str(), board.scales), ("qemu", Scales::default()));
    client.close();

    // Another life, commissioned by a file that says nothing of it.
    let silent = Setup::from(plant().config);
    let second = run(&flash, silent, &[COMMISSION, sine, Task::Store]);
    assert_eq!(second.tuning.bandwidth, 2.5);
    let verdict = replay::replay(&second.log.tape()).expect("a tape");
    assert!(verdict.identical() && verdict.commissionings == 1, "{verdict}");
    let mut client = Client::new(Box::new(wire(&flash)));
    let kept = client.parameters().expect("an answer").expect("stored");
    client.close();
    assert_chosen(&kept);
    assert!(kept.estimates.gain.trusted().is_some());
}
