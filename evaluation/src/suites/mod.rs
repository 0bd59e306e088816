//! A file for each suite.

pub mod accuracy;
pub mod accused;
pub mod bench_image;
pub mod commission_faults;
pub mod faults;
pub mod fleet;
pub mod improve;
pub mod interruptions;
pub mod leave_one_rig_out;
pub mod mistakes;
pub mod naming;
pub mod outsiders;
pub mod passive;
pub mod power_cuts;
pub mod power_up;
pub mod same_bits;
pub mod start_models;
pub mod steady_accuracy;
pub mod step_cost;
pub mod tracking;
