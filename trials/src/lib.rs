//! Helpers of the tests: families of motors with known truth, a board made of numbers, measured data that may be absent,
//! skips that are counted, tolerances with their reasons.

pub mod bench;
pub mod case_files;
pub mod case_motor;
pub mod commissioning;
pub mod counts;
pub mod exec_bench;
pub mod extent;
pub mod families;
pub mod faults;
pub mod firmware;
pub mod host_servo;
pub mod measured;
pub mod naming;
pub mod next_experiment;
pub mod passive;
pub mod power_cut;
pub mod power_up;
pub mod serial_line;
pub mod sets;
pub mod simulated_servo;
pub mod stops;
pub mod test_image;
pub mod tracking;
pub mod virtual_motor;
