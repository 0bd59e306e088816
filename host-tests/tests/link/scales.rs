//! What one count is worth belongs to the board: chip and host refuse a configuration of another board, with both numbers, and
//! an axis file that leaves the scales out takes those of the board it meets.

use servo::axis::servo_axis::Order;
use servo::axis::{Axis, Sample};
use servo::config::{Config, ConfigError, Field};
use servo::drivers::drv8301::{Faults, Register, Trouble};
use servo::drivers::gates::State;
use servo::drivers::reach::Reach;
use servo::drivers::scales::{ScaleError, Scales};
use servo::link::board::{Board, Clock, GateTrouble, Gates, Name};
use servo::link::in_force::InForce;
use servo::link::protocol::{
    Command, FRAME_CAPACITY, Message, Receiver, Refusal, Request, ResetCause, encode,
};
use servo::optional::Optional;
use servo::store::{Found, MAX_AXES};
use std::rc::Rc;
use trials::simulated_servo::config;
use truing::device::link::{Client, Hello, Wire, refusal_text};
use truing::device::setup::Setup;
use truing::device::{axis_file, board};
use truing::text::input_error::InputError;

/// As far as a VESC 6 sees: 12 bits of supply, and its amplifier on either side of the middle.
const REACH: Reach = Reach { supply: 4095, current: 1859 };

const MACHINE: &str =
    "[supply]\nnominal_v = 24.0\n[encoder]\ncounts_per_rev = 4000\n[axis]\nrated_speed_rad_s = 125.0\n";

fn vesc() -> Scales {
    board::scales(&boards::VESC_6)
}

/// How a board of the table introduces itself.
fn told(row: &boards::Board) -> Board {
    let clock = Clock::Crystal(8_000_000);
    Board { clock, ..Board::new(Name::new(row.name), board::scales(row)) }
}

fn parse(text: &str) -> Setup {
    axis_file::parse("axis.toml", text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn of_vesc() -> Config {
    let Scales { supply, current } = vesc();
    Config {
        supply_nominal_v: 24.0,
        vbus_v_per_lsb: supply.get().expect("known"),
        current_a_per_lsb: current.get().expect("known"),
        ..config()
    }
}

/// What the image of a VESC 6 does with a command, from the link to the order.
fn ordered(command: Command) -> Result<Order<Rc<Axis>>, Refusal> {
    let supports = |axis: &Axis| -> Result<(), Refusal> {
        vesc().allow(&axis.scale().config)?;
        Ok(REACH.allows(&axis.scale().config, Some(axis.protection()))?)
    };
    let in_force: InForce<Rc<Axis>, 1> = InForce::new([None]);
    in_force.prepare(&Request { axis: 0, command }, supports, |axis| Ok(Rc::new(axis)))
}

#[test]
fn the_chip_refuses_a_scale_of_another_board_with_both_numbers() {
    let copied = Config { current_a_per_lsb: Config::EXAMPLE.current_a_per_lsb, ..of_vesc() };
    let parameters = Setup::from(copied).parameters(None);
    for command in [Command::Configure(copied), Command::Restore(parameters)] {
        let Err(Refusal::Scale(error)) = ordered(command) else { panic!("{command:?}") };
        let ScaleError { field, given, board } = error;
        assert_eq!((field, given), (Field::CurrentPerLsb, copied.current_a_per_lsb));
        assert!((board - 0.080566).abs() < 1e-6, "{board}");
        let text = refusal_text(&Refusal::Scale(error));
        for part in ["limits.current_a_per_lsb", "0.009765625 A", "0.0805", "leave the key out"] {
            assert!(text.contains(part), "no {part} in {text}");
        }
    }
    let divider = Config { vbus_v_per_lsb: 0.0117, ..of_vesc() };
    let refused = ordered(Command::Configure(divider));
    assert!(
        matches!(refused, Err(Refusal::Scale(ScaleError { field: Field::VbusPerLsb, .. }))),
        "{refused:?}"
    );
}

/// Shunts, dividers and amplifiers have tolerances: whoever has measured his board may say so.
#[test]
fn a_scale_that_is_calibrated_within_a_tenth_is_taken_and_one_beyond_is_not() {
    let times = |share: f32| {
        let config = of_vesc();
        Config { current_a_per_lsb: share * config.current_a_per_lsb, ..config }
    };
    for (share, good) in [(0.88, false), (0.92, true), (1.0, true), (1.08, true), (1.12, false)] {
        assert_eq!(vesc().allow(&times(share)).is_ok(), good, "{share}");
        assert_eq!(ordered(Command::Configure(times(share))).is_ok(), good, "{share}");
    }
    // A program that plays a board says nothing, and takes what the host says.
    assert_eq!(Scales::default().allow(&times(30.0)), Ok(()));
}

/// In the user's scale 5 A would be 512 counts, and act at 41 A.
#[test]
fn a_limit_beyond_what_the_board_measures_is_refused_in_true_amperes_and_volts() {
    let limited = Config { current_limit_a: Optional::new(200.0), ..of_vesc() };
    let Err(Refusal::Config(ConfigError { field, maximum, .. })) = ordered(Command::Configure(limited))
    else {
        panic!("beyond the sensor")
    };
    assert_eq!(field, Field::CurrentLimit);
    // The axis holds the current at the limit, so the fault a sixteenth above it must be within reach of the sensor.
    assert!((maximum - 149.7 / 1.0625).abs() < 0.1, "{maximum}");
    let high = Config { supply_nominal_v: 50.0, supply_high_v: Optional::new(70.0), ..of_vesc() };
    let Err(Refusal::Config(ConfigError { field, maximum, .. })) = ordered(Command::Configure(high)) else {
        panic!("beyond the divider")
    };
    assert_eq!(field, Field::SupplyHigh);
    assert!((maximum - 61.77).abs() < 0.05, "{maximum}");
}

#[test]
fn a_file_without_scales_takes_those_of_the_board_it_meets() {
    let silent = parse(MACHINE);
    for row in boards::real() {
        let config = silent.on(&told(row)).expect("any board").config;
        let scales = row.scales.expect("a real board");
        assert_eq!((config.vbus_v_per_lsb, config.current_a_per_lsb), (scales.supply_v, scales.current_a));
    }
    // QEMU has none: the file's defaults hold, bit by bit as ever.
    let played = Board { clock: Clock::Simulated, ..told(&boards::QEMU) };
    assert_eq!(silent.on(&played).expect("any file"), silent);
    // A log that such a session has written is one of this file.
    assert!(silent.agrees(&silent.on(&told(&boards::VESC_6)).expect("any board").config));
}

#[test]
fn a_file_with_scales_keeps_them_and_is_refused_by_another_board() {
    let keys = "[limits]\ncurrent_a_per_lsb = 0.080566\ncurrent_a = 5.0\n";
    let text = MACHINE.replace("24.0\n", "24.0\nvbus_v_per_lsb = 0.015088\n") + keys;
    let setup = parse(&text);
    assert_eq!((setup.config.vbus_v_per_lsb, setup.config.current_a_per_lsb), (0.015088, 0.080566));
    assert_eq!(setup.on(&told(&boards::VESC_6)).expect("its board"), setup);
    let error = setup.on(&told(&boards::ODRIVE_V3_24V)).expect_err("another divider").0;
    assert!(error.contains("supply.vbus_v_per_lsb is 0.015088 V") && error.contains("0.00886"), "{error}");
    let error = setup.on(&told(&boards::ODRIVE_V3)).expect_err("another shunt").0;
    assert!(error.contains("limits.current_a_per_lsb is 0.080566 A") && error.contains("0.0201"), "{error}");
}

#[test]
fn a_file_that_names_its_board_needs_no_scales_and_fits_no_other_board() {
    let setup = parse(&["board = \"vesc-6\"\n", MACHINE].concat());
    let scales = boards::VESC_6.scales.expect("a real board");
    // Known without a servo, too: in QEMU and in files.
    assert_eq!(setup.config.vbus_v_per_lsb, scales.supply_v);
    assert_eq!(setup.config.current_a_per_lsb, scales.current_a);
    assert_eq!(setup.on(&told(&boards::VESC_6)).expect("its board"), setup);
    let played = Board { clock: Clock::Simulated, ..told(&boards::QEMU) };
    assert_eq!(setup.on(&played).expect("a rehearsal"), setup);
    let error = setup.on(&told(&boards::ODRIVE_V3)).expect_err("another board").0;
    assert!(error.contains("for the board vesc-6") && error.contains("odrive-v3"), "{error}");
}

#[test]
fn a_board_that_nobody_knows_and_a_key_that_contradicts_it_are_named_with_their_line() {
    let refused = |text: String| axis_file::parse("axis.toml", &text).expect_err("bad").to_string();
    let error = refused(["board = \"vesc6\"\n", MACHINE].concat());
    assert!(error.starts_with("axis.toml, line 1: `vesc6` is no board; the nearest is `vesc-6`"), "{error}");
    for row in boards::BOARDS {
        assert!(error.contains(row.name), "no {} in {error}", row.name);
    }
    let key = "[limits]\ncurrent_a_per_lsb = 0.00977\n";
    let error = refused(["board = \"vesc-6\"\n", MACHINE, key].concat());
    for part in ["line 9", "limits.current_a_per_lsb is 0.00977 A", "0.0805"] {
        assert!(error.contains(part), "no {part} in {error}");
    }
}

/// A servo that knows its board and nothing else.
struct Introduced(Board, Receiver<Request>);

impl Wire for Introduced {
    fn turn(&mut self, outgoing: &mut Vec<u8>, incoming: &mut Vec<u8>) -> Result<(), InputError> {
        for byte in outgoing.drain(..) {
            let Some(Ok(frame)) = self.1.push(byte) else { continue };
            let answer = Message::Answer { to: frame.sequence, tick: 1, result: Ok(()) };
            let hello =
                Message::Hello { axes: 1, cause: ResetCause::Pin, stored: Found::Blank, board: self.0 };
            for message in [answer, hello] {
                let mut buffer = [0; FRAME_CAPACITY];
                incoming.extend_from_slice(encode(0, message, &mut buffer).expect("it fits"));
            }
        }
        Ok(())
    }
}

#[test]
fn a_servo_that_was_on_before_is_asked_for_its_board_once() {
    let board = told(&boards::VESC_6);
    let mut client = Client::new(Box::new(Introduced(board, Receiver::new())));
    assert_eq!(client.board(&mut |_| {}).expect("an answer"), board);
    assert_eq!(client.board(&mut |_| {}).expect("known"), board);
    assert_eq!(client.hello().expect("an answer").board, board);
}

#[test]
fn all_that_a_board_tells_fits_a_message_and_is_told_in_words() {
    let faulty = GateTrouble { driver: 1, trouble: Trouble::Faulty(Faults(0x420)) };
    let none = [Sample::CURRENT_NOT_SENSED; 2];
    let board = Board {
        gates: Some(Gates { state: State::Failed, trouble: faulty.code() }),
        brown_out_reset_off: true,
        zeros: [[2041, 2060], [Sample::CURRENT_ZERO_OUTSIDE, 2050], none, none],
        ..told(&boards::ODRIVE_V3_24V)
    };
    let longest = Board { zeros: [[i16::MIN; 2]; MAX_AXES], ..board };
    let hello = Message::Hello {
        axes: 4,
        cause: ResetCause::Watchdog,
        stored: Found::Unreadable { layout: u16::MAX },
        board: longest,
    };
    assert!(encode(u16::MAX, hello, &mut [0; FRAME_CAPACITY]).is_ok());
    for clock in [Clock::Simulated, Clock::Internal, Clock::Crystal(25_000_000)] {
        for sent in [Board { clock, ..board }, Board { clock, gates: None, ..longest }] {
            let bytes = postcard::to_stdvec(&sent).expect("plain");
            assert_eq!(postcard::from_bytes::<Board>(&bytes), Ok(sent));
        }
    }
    let text = board::text(&Hello { axes: 3, cause: ResetCause::Watchdog, stored: Found::Blank, board });
    for part in [
        "odrive-v3-24v",
        "watchdog",
        "crystal of 8 MHz",
        "nothing is stored",
        "0.0201",
        "driver 1, over-current, 0x420",
        "2041 counts, 2060 counts",
        "sensor is connected",
        "not sensed",
        "BOR_LEV",
    ] {
        assert!(text.contains(part), "no {part} in\n{text}");
    }
    let internal = Board { clock: Clock::Internal, gates: None, ..board };
    let text = board::text(&Hello { axes: 1, cause: ResetCause::Pin, stored: Found::Blank, board: internal });
    assert!(text.contains("no crystal") && text.contains("none that"), "{text}");
    for row in boards::BOARDS {
        assert_eq!(Name::new(row.name).as_str(), row.name);
    }
}

#[test]
fn every_trouble_of_a_gate_driver_comes_back_from_its_number() {
    let troubles = [
        Trouble::NoAnswer(0xFFFF),
        Trouble::NotKept(Register::Control1, 0x123),
        Trouble::NotKept(Register::Control2, 0),
        Trouble::Faulty(Faults(0xFFF)),
        Trouble::LineLow,
    ];
    for trouble in troubles {
        for driver in [0, 1, 255] {
            let told = GateTrouble { driver, trouble };
            assert_eq!(GateTrouble::of_code(told.code()), Some(told));
        }
    }
    assert_eq!(GateTrouble::of_code(0), None);
}
