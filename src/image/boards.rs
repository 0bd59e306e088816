//! The table of boards: everything that the tools and the tests must know of a board, in one place.
//!
//! The build script reads it to choose the board of an image, `xtask` to build, measure, check and flash images, and the
//! tests to run them in QEMU. A new board is a row of [`BOARDS`], a new chip one more [`Chip`].

use core::ops::Range;

/// A chip that an image is built for.
#[derive(Debug, PartialEq, Eq)]
pub struct Chip {
    /// Its entry file in `src/image/` and its value of the configuration key `chip`.
    pub name: &'static str,
    /// Rust's name of the compilation target.
    pub target: &'static str,
    /// The chip as probe-rs names it.
    pub probe: &'static str,
    /// Folder with the memory map for the linker, from the root of the workspace.
    pub memory: &'static str,
    /// The tasks of an image, by the names of their functions.
    pub tasks: Tasks,
    /// Addresses of the flash that the program may use, from the vector table on.
    pub program: Range<u64>,
    /// Addresses of the main memory.
    pub ram: Range<u64>,
}

/// Functions in which the tasks of an image begin. Interrupts are named as in the vector table.
#[derive(Debug, PartialEq, Eq)]
pub struct Tasks {
    /// The interrupt of the control tick.
    pub control: &'static str,
    /// The interrupt of the link.
    pub link: &'static str,
    /// The loop below all interrupts.
    pub idle: &'static str,
}

/// What one count of a board's converters is worth. The image tells its own, from the resistors of the board; the tests
/// compare the two.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scales {
    /// Volts of supply.
    pub supply_v: f32,
    /// Amperes of winding current.
    pub current_a: f32,
}

/// A board: the chip and what is around it, or a program that plays both.
#[derive(Debug, PartialEq)]
pub struct Board {
    /// Its value of the configuration key `board`, and the name of its image.
    pub name: &'static str,
    /// Its page, from the root of the workspace.
    pub page: &'static str,
    /// What runs its program.
    pub chip: &'static Chip,
    /// The Cargo feature that chooses it. [`DEFAULT`] has none.
    pub feature: Option<&'static str>,
    /// The Cargo feature of an image for as many axes as the board can drive, if its own feature does not bring that along.
    pub most_axes: Option<&'static str>,
    /// The machine of QEMU, if QEMU plays the board.
    pub machine: Option<&'static str>,
    /// `None`: they are what the host says.
    pub scales: Option<Scales>,
}

/// Volts at a pin per count: 12 bits of 3.3 V.
const PIN_V: f32 = 3.3 / 4096.0;

/// Scales of a board: supply over the voltage at its pin, and volts at the pin per ampere.
const fn scales(divider: f32, volt_per_ampere: f32) -> Option<Scales> {
    Some(Scales { supply_v: PIN_V * divider, current_a: PIN_V / volt_per_ampere })
}

/// The Cargo feature of an image for two axes. Without a feature an image drives one.
pub const TWO_AXES: &str = "two-axes";
/// The Cargo feature of an image for four axes.
pub const FOUR_AXES: &str = "four-axes";

/// STM32F405RG. Memory: reference manual RM0090, section 2.3 and table 5; the last two sectors of the flash hold the
/// stored parameters, and the core-coupled memory is not used.
pub const STM32F405_CHIP: Chip = Chip {
    name: "stm32f405",
    target: "thumbv7em-none-eabihf",
    probe: "STM32F405RGTx",
    memory: ".",
    tasks: Tasks { control: "ADC", link: "USART2", idle: "firmware::image::stm32f405::app::idle" },
    program: 0x0800_0000..0x080C_0000,
    ram: 0x2000_0000..0x2002_0000,
};

/// An STM32F405RG with drivers or a discrete bridge, wired as its page tells.
pub const STM32F405: Board = Board {
    name: "stm32f405",
    page: "docs/hardware.md",
    chip: &STM32F405_CHIP,
    feature: None,
    most_axes: Some(FOUR_AXES),
    machine: None,
    // 100 kΩ over 10 kΩ, and a DRV8874 with 450 µA/A into 2.49 kΩ.
    scales: scales(11.0, 1.1205),
};

/// QEMU's board with the same chip, and motors on the host.
pub const QEMU: Board = Board {
    name: "qemu",
    page: "docs/verification.md",
    feature: Some("qemu"),
    machine: Some("netduinoplus2"),
    scales: None,
    ..STM32F405
};

/// ODrive v3.5 and v3.6 for 48 V and 56 V: two axes.
pub const ODRIVE_V3: Board = ready_made("odrive-v3", "docs/boards/odrive-v3.md", ODRIVE_56V);
/// ODrive v3.5 and v3.6 for 24 V: another divider of the supply.
pub const ODRIVE_V3_24V: Board = ready_made("odrive-v3-24v", "docs/boards/odrive-v3.md", scales(11.0, 0.04));
/// MKS ODrive and other clones for 56 V.
pub const MKS_ODRIVE: Board = ready_made("mks-odrive", "docs/boards/mks-odrive.md", ODRIVE_56V);
/// VESC 6: one axis. 39 kΩ over 2.2 kΩ, and a shunt of 0.5 mΩ behind 20 V/V.
pub const VESC_6: Board = ready_made("vesc-6", "docs/boards/vesc-6.md", scales(41.2 / 2.2, 0.01));

/// Divider 19:1, and shunts of 0.5 mΩ behind 80 V/V.
const ODRIVE_56V: Option<Scales> = scales(19.0, 0.04);

/// A board that one buys as a whole, with bridges: its feature, of the same name, chooses all of its axes.
const fn ready_made(name: &'static str, page: &'static str, scales: Option<Scales>) -> Board {
    Board { name, page, feature: Some(name), most_axes: None, scales, ..STM32F405 }
}

/// The board of an image without features.
pub const DEFAULT: &Board = &STM32F405;

/// All boards.
pub const BOARDS: [&Board; 6] = [&STM32F405, &QEMU, &ODRIVE_V3, &ODRIVE_V3_24V, &MKS_ODRIVE, &VESC_6];

/// The boards that are no program.
pub fn real() -> impl Iterator<Item = &'static Board> {
    BOARDS.into_iter().filter(|board| board.machine.is_none())
}

/// The board that these features choose.
///
/// # Errors
/// More than one of the features names a board.
pub fn chosen(is_on: impl Fn(&str) -> bool) -> Result<&'static Board, &'static str> {
    let mut named = BOARDS.into_iter().filter(|board| board.feature.is_some_and(&is_on));
    match (named.next(), named.next()) {
        (None, _) => Ok(DEFAULT),
        (Some(board), None) => Ok(board),
        _ => Err("an image is built for one board: choose one feature that names a board"),
    }
}
