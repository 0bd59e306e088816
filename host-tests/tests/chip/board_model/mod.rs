//! The code of the real boards, run against a behavioural model of their chip: the registers that it writes make edges, trigger
//! converters and turn motors, and what the converters and counters read comes back.

mod clocks;
mod drv8301;
mod machine;
mod motor;
mod timer;
mod trap;
mod wires;

/// The chip's code with the data of a board, and a bench for it.
macro_rules! board {
    ($name:ident, $data:literal, $axes:literal, [$($row:literal: $board:ident, $wires:expr;)*]) => {
        #[path = "."]
        mod $name {
            #[allow(dead_code, unused_imports, unreachable_pub, reason = "the tests use some of what a board has")]
            #[allow(unexpected_cfgs, reason = "the build script of the image chooses among boards that share their data")]
            #[path = "../../../../src/image/board"]
            pub mod chip {
                mod interface;
                pub use interface::{Board, Drive, Idle, Line};

                pub mod stm32f405 {
                    pub mod axis;
                    pub mod board;
                    #[path = $data]
                    pub mod chosen;
                    pub mod clock;
                    pub mod converter;
                    pub mod counter;
                    pub mod drive;
                    pub mod gates;
                    pub mod gpio;
                    pub mod pins;
                    pub mod pwm;
                    pub mod stage;
                    pub mod timing;

                    pub use stm32f4::stm32f405 as pac;

                    pub mod watchdog {
                        pub fn control_has_run() {}
                    }

                    /// Waiting passes time in the model.
                    pub mod delay {
                        use crate::board_model::trap;
                        use embedded_hal::delay::DelayNs;

                        pub const CLOCKS_PER_MS: u32 = 168_000;
                        /// Of a turn of a loop that waits.
                        const LOOK: u64 = 300;

                        pub fn now() -> u32 {
                            trap::pass(LOOK) as u32
                        }

                        pub struct Clocks;

                        impl DelayNs for Clocks {
                            fn delay_ns(&mut self, nanoseconds: u32) {
                                trap::pass(u64::from(nanoseconds) * 168 / 1000);
                            }
                        }
                    }
                }
            }
            pub mod rig;
            mod power_up;
            mod suite;

            /// Axes of its image.
            const AXES: usize = $axes;
            /// Rows of the table of boards that share this data, each with its wires.
            pub const ROWS: [(&str, &chip::stm32f405::board::Board, fn() -> super::wires::Wires); ROW_NAMES.len()] =
                [$(($row, &chip::stm32f405::chosen::$board, || $wires)),*];
            pub const ROW_NAMES: &[&str] = &[$($row),*];
        }
    };
}

board!(own, "boards/own.rs", 4, ["stm32f405": OWN, super::wires::Wires::carrier();]);
board!(odrive, "boards/odrive.rs", 2, [
    "odrive-v3": ODRIVE_V3, super::wires::Wires::odrive(19.0);
    "odrive-v3-24v": ODRIVE_V3_24V, super::wires::Wires::odrive(11.0);
    "mks-odrive": MKS_ODRIVE, super::wires::Wires::odrive(19.0);
]);
board!(vesc, "boards/vesc.rs", 1, ["vesc-6": VESC_6, super::wires::Wires::vesc();]);

mod picture;
mod tests;
