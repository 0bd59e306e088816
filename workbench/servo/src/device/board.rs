//! The board of a servo: which ones there are, what one count of theirs is worth, and how one is.

use crate::device::link::{Hello, current_text, found_text};
use servo::axis::Sample;
use servo::drivers::scales::Scales;
use servo::link::board::{Clock, GateTrouble, Gates};
use servo::optional::Optional;
use truing_core::text::input_error::{InputError, nearest_hint};

/// A board of the table.
pub fn named(name: &str) -> Result<&'static boards::Board, InputError> {
    let names = || boards::BOARDS.iter().map(|board| board.name);
    boards::BOARDS.into_iter().find(|board| board.name == name).ok_or_else(|| {
        let all = names().collect::<Vec<_>>().join(", ");
        InputError(format!("`{name}` is no board{}; the boards are {all}", nearest_hint(name, names())))
    })
}

/// What one count of it is worth, as far as the table knows.
pub fn scales(board: &boards::Board) -> Scales {
    board.scales.map_or_else(Scales::default, |scales| Scales {
        supply: Optional::new(scales.supply_v),
        current: Optional::new(scales.current_a),
    })
}

/// All that a servo tells of its board, a line each.
pub fn text(hello: &Hello) -> String {
    let board = &hello.board;
    let told = "as the axis file says";
    let scale = |scale: Optional, unit: &str| {
        scale.get().map_or_else(|| told.into(), |scale| format!("{scale} {unit} a count"))
    };
    let mut lines = vec![
        ("board", board.name.as_str().into()),
        ("started by", format!("{:?}", hello.cause).to_lowercase()),
        ("clock", clock(board.clock)),
        ("store", found_text(hello.stored)),
        ("supply", scale(board.scales.supply, "V")),
        ("current", scale(board.scales.current, "A")),
        ("gate drivers", board.gates.map_or_else(|| "none that are set up".into(), gates)),
    ];
    lines.extend(board.zeros.iter().take(hello.axes.into()).map(|&zeros| ("zero", zero(zeros))));
    if board.brown_out_reset_off {
        lines.push(("brown-out", "its reset is off: set BOR_LEV of the option bytes to level 3".into()));
    }
    lines.iter().map(|(name, text)| format!("{name:13} {text}\n")).collect()
}

fn clock(clock: Clock) -> String {
    match clock {
        Clock::Simulated => "the host's".into(),
        Clock::Internal => "inside the chip, off by up to 1 %: no crystal of 8, 12, 16 or 25 MHz runs".into(),
        Clock::Crystal(hertz) => format!("crystal of {} MHz", f64::from(hertz) / 1e6),
    }
}

fn gates(Gates { state, trouble }: Gates) -> String {
    let last = GateTrouble::of_code(trouble).map(|GateTrouble { driver, trouble }| {
        let (text, word) = trouble.words();
        format!("; last trouble: driver {driver}, {text}, {word:#x}")
    });
    format!("{}{}", format!("{state:?}").to_lowercase(), last.unwrap_or_default())
}

/// Counts at which the current of an axis reads zero, or why it has none.
fn zero(zeros: [i16; 2]) -> String {
    let told = zeros.into_iter().filter(|zero| *zero != Sample::CURRENT_NOT_SENSED);
    let texts: Vec<String> = told
        .map(|zero| match (Sample::sensed(zero), current_text(zero)) {
            (None, Some(text)) => text.into(),
            _ => format!("{zero} counts"),
        })
        .collect();
    if texts.is_empty() { "the current is not sensed".into() } else { texts.join(", ") }
}
