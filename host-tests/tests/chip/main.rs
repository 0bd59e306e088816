//! The parts of the chip one by one, on the host: arithmetic, set-points, drivers, the pin table, and small doses for Miri.

mod board_pins;
mod compensate;
mod control_trajectory;
mod drivers;
mod fixed_vs_f64;
mod miri;
mod protect;
