//! The workbench on the host: the gap workflow, its effects, plants, readers and reports, and the command line.

mod bad_input;
mod cases;
mod effects_library;
mod effects_names;
mod examine;
mod foreign_logs;
mod gap_hidden;
mod gap_measured_data;
mod interruption;
mod log_dialects;
mod log_reading;
mod model_reading;
mod next_experiment;
mod paper;
mod plant_motor;
mod position;
mod report;
mod results_kept;
mod rigs;
mod screen;
mod steady_map;
mod steady_measured;
mod steady_paper;
mod time_base;
mod truth;
mod unnamed_term;
