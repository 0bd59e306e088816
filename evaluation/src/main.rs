//! The suites behind the measured tables, one subcommand each.

mod suites;

use clap::Parser;
use std::process::{ExitCode, Termination};

/// The suites behind the measured tables of docs/results.
#[derive(Parser)]
enum Suite {
    /// Commissionings of drawn motors: how far off are the numbers, and what is trusted?
    Accuracy(suites::accuracy::Arguments),
    /// Right files, and files with bad cells: what is said of them?
    Accused(suites::accused::Arguments),
    /// Instructions of the identifier, compensator and loop beside published crates, in QEMU.
    BenchImage(suites::bench_image::Arguments),
    /// Commissionings of motors that are wired, described or driven wrongly.
    CommissionFaults(suites::commission_faults::Arguments),
    /// Faults that are injected into a running servo, and false alarms.
    Faults(suites::faults::Arguments),
    /// Drawn fleets: spread, drift and new effects.
    Fleet(suites::fleet::Arguments),
    /// `truing improve` on drawn motors.
    Improve(suites::improve::Arguments),
    /// Commands that move a motor, interrupted at random instants.
    Interruptions(suites::interruptions::Arguments),
    /// Limits of the naming, chosen without the rig that they are tried on.
    LeaveOneRigOut(suites::leave_one_rig_out::Arguments),
    /// Mistakes in files: is their cause told?
    Mistakes(suites::mistakes::Arguments),
    /// Drawn cases: are hidden effects named?
    Naming(suites::naming::Arguments),
    /// Drawn cases that no name explains.
    Outsiders(suites::outsiders::Arguments),
    /// Learning in ordinary motion.
    Passive(suites::passive::Arguments),
    /// Power cuts while parameters are written.
    PowerCuts(suites::power_cuts::Arguments),
    /// First power-ups under a current limit.
    PowerUp(suites::power_up::Arguments),
    /// The image in QEMU beside the library, bit by bit.
    SameBits(suites::same_bits::Arguments),
    /// Numbers that `truing start` leaves open.
    StartModels(suites::start_models::Arguments),
    /// Drawn tables of settled speeds.
    SteadyAccuracy(suites::steady_accuracy::Arguments),
    /// Time of an inner step of the plant.
    StepCost(suites::step_cost::Arguments),
    /// Sines and positions followed by drawn motors.
    Tracking(suites::tracking::Arguments),
}

fn main() -> ExitCode {
    match Suite::parse() {
        Suite::Accuracy(arguments) => suites::accuracy::run(arguments),
        Suite::Accused(arguments) => suites::accused::run(arguments),
        Suite::BenchImage(arguments) => suites::bench_image::run(arguments),
        Suite::CommissionFaults(arguments) => suites::commission_faults::run(arguments),
        Suite::Faults(arguments) => suites::faults::run(arguments),
        Suite::Fleet(arguments) => suites::fleet::run(arguments),
        Suite::Improve(arguments) => suites::improve::run(arguments),
        Suite::Interruptions(arguments) => suites::interruptions::run(arguments),
        Suite::LeaveOneRigOut(arguments) => return suites::leave_one_rig_out::run(arguments).report(),
        Suite::Mistakes(arguments) => suites::mistakes::run(arguments),
        Suite::Naming(arguments) => suites::naming::run(arguments),
        Suite::Outsiders(arguments) => suites::outsiders::run(arguments),
        Suite::Passive(arguments) => suites::passive::run(arguments),
        Suite::PowerCuts(arguments) => suites::power_cuts::run(arguments),
        Suite::PowerUp(arguments) => suites::power_up::run(arguments),
        Suite::SameBits(arguments) => return suites::same_bits::run(arguments),
        Suite::StartModels(arguments) => suites::start_models::run(arguments),
        Suite::SteadyAccuracy(arguments) => suites::steady_accuracy::run(arguments),
        Suite::StepCost(arguments) => suites::step_cost::run(arguments),
        Suite::Tracking(arguments) => suites::tracking::run(arguments),
    }
    ExitCode::SUCCESS
}
