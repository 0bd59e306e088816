//! The boards. Each implements [`Board`], and nothing else in the image knows which one it is: the build script chooses
//! one by the Cargo features, and calls are resolved when the image is built.

mod interface;
#[cfg(board = "qemu")]
pub mod qemu;
#[cfg(not(board = "qemu"))]
pub mod stm32f405;

/// The board that this image is built for.
#[cfg(board = "qemu")]
pub type Selected = qemu::Qemu;
/// The board that this image is built for.
#[cfg(not(board = "qemu"))]
pub type Selected = stm32f405::Stm32f405;

pub use interface::{Board, Drive, Idle, Line, Started};
use servo::link::board::Name;

/// Name of the board as the table of boards spells it.
pub const NAME: Name = Name::new(env!("BOARD"));

/// Number of axes that this image drives.
pub const AXES: usize = if cfg!(feature = "four-axes") {
    4
} else if cfg!(feature = "two-axes") {
    2
} else {
    1
};
const _: () = assert!(AXES <= Selected::MOST_AXES, "the board cannot drive that many axes");

/// [`Board::bridge_off`] of the selected board, for handlers of faults.
pub fn bridge_off() {
    Selected::bridge_off();
}

/// [`Board::halt`] of the selected board, for handlers of faults.
pub fn halt() -> ! {
    Selected::halt()
}
