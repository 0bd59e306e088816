//! The servo's codes in words that say what to do.

use servo::axis::Sample;
use servo::config::{ConfigError, Field};
use servo::drivers::scales::ScaleError;
use servo::identify::estimate::Reason;
use servo::link::protocol::Refusal;
use servo::protect::{Fault, SettingsError};
use servo::record::Advisory;
use servo::store::{Found, LAYOUT, SaveError, StoreEvent};

/// A sentence for every code, a line each.
macro_rules! sentences {
    ($code:expr; $($variant:pat => $text:expr,)+) => {
        match $code { $($variant => $text,)+ }
    };
}

/// Why a command was refused, one sentence.
pub fn refusal_text(refusal: &Refusal) -> String {
    let text = sentences! { refusal;
        Refusal::Parameters(error) => return settings_text(error),
        Refusal::Config(error) => return format!("the servo refuses the configuration: {}", range_text(error)),
        Refusal::Scale(error) => return format!("the servo refuses the configuration: {}", scale_text(error)),
        Refusal::Value(error) => return format!("the servo refuses the command: {}", range_text(error)),
        Refusal::Stale { expected } => return format!("the servo expects command number {expected}; reconnect"),
        Refusal::BeyondVoltage { needed_v, available_v } => return format!(
            "the motion takes {needed_v:.2} V beyond the dead zone and {available_v:.2} V are left: choose an amplitude of \
             at most {:.3} times, or a lower frequency",
            available_v / needed_v
        ),
        Refusal::BeyondSpeed { needed_rad_s, available_rad_s } => return format!(
            "the motion takes {needed_rad_s:.2} rad/s and limits.speed_rad_s leaves {available_rad_s:.2} rad/s: choose a \
             slower or smaller one, or raise the limit"
        ),
        Refusal::TickRate => "the board cannot make this control rate: choose axis.tick_hz so that it divides the PWM frequency 84 MHz / axis.pwm_full_scale",
        Refusal::NotConfigured => "the servo has no configuration yet; send one first",
        Refusal::BridgeDriven => "the servo can be configured only while its bridge is open; stop it first",
        Refusal::NoSuchAxis => "this firmware has fewer axes; choose a smaller --axis, or build an image with more",
        Refusal::SharedTick => "the axes of one chip share axis.tick_hz, axis.pwm_full_scale and axis.pwm_delay_ticks, and another axis has others; make them equal, or reset the other axis",
        Refusal::Storing => "the servo is storing its parameters; try again when it is done",
        Refusal::NotAtRest => "parameters are stored only while every bridge is open and every shaft stands; stop the servo and wait",
        Refusal::NotArmed => "the servo is not armed; arm it before asking for torque",
        Refusal::Faulted => "a fault is latched; remove its cause and stop the servo to clear it",
        Refusal::NotIdentified => "gain and time constant are not known; commission first, or give axis.time_constant_hint_s",
        Refusal::Busy => "the servo is busy with another motion; stop it first",
        Refusal::BeyondTravel => "the target lies beyond axis.travel_limit_rad; choose a smaller one",
        Refusal::OutOfRange => "amplitude, frequency or duration cannot be done at this control rate; choose a slower or smaller motion",
        Refusal::NotReferenced => "absolute targets need a reference: find one with `--reference`",
        Refusal::CurrentZeroSought => "the zero of the current sensor is still looked for, with the bridge open; try again in a second",
        Refusal::StreamFull => "so many streamed points wait already; send this one again when one has been reached",
        Refusal::NotForAxis => "the servo does not know this command; update its firmware",
    };
    text.into()
}

fn settings_text(error: &SettingsError) -> String {
    match error {
        SettingsError::Value(error) => format!("the servo refuses the configuration: {}", range_text(error)),
        SettingsError::Action(forbidden) => format!(
            "the servo refuses protection.{} = {}: open always works, brake does not for over-current, bridge fault and \
             enable contact, hold only for a command timeout",
            forbidden.fault.name(),
            forbidden.action.name()
        ),
    }
}

/// Which number, and its range.
pub fn range_text(error: &ConfigError) -> String {
    let (field, low, high) = (error.field.name(), error.minimum, error.maximum);
    if high <= 0.0 && low >= high {
        return format!("{field} could never act: this board does not sense the current");
    }
    format!("{field} must lie between {low} and {high}")
}

/// Both scales, and what to do.
pub fn scale_text(error: &ScaleError) -> String {
    let ScaleError { field, given, board } = error;
    let unit = if *field == Field::VbusPerLsb { "V" } else { "A" };
    format!(
        "{} is {given} {unit}, and one count of the board is {board} {unit}: leave the key out, then the board's scale \
         holds; a calibrated one lies within 10 % of it",
        field.name()
    )
}

/// How a save goes on, and what to do if it has failed.
pub fn store_text(event: StoreEvent) -> String {
    match event {
        StoreEvent::Erasing { longest_ms } => format!(
            "the servo erases a flash sector and will be silent for up to {:.1} s",
            f64::from(longest_ms) / 1000.0
        ),
        StoreEvent::Saved => "the parameters are stored".into(),
        StoreEvent::Failed(SaveError::Flash) => {
            "the flash does not hold what was written; what was stored before is untouched. Try again, and check the \
             supply; a worn flash stays that way"
                .into()
        }
        StoreEvent::Failed(error) => format!(
            "the parameters could not be stored ({error:?}); what was stored before is untouched. Update the firmware"
        ),
    }
}

/// What a servo has found in its store, and what to do about it.
pub fn found_text(found: Found) -> String {
    match found {
        Found::Set { layout } if layout == LAYOUT => "stored parameters are in force".into(),
        Found::Set { layout } => format!(
            "stored parameters of layout {layout} were migrated and are in force; the next save writes layout {LAYOUT}"
        ),
        Found::Blank => "nothing is stored".into(),
        Found::Unreadable { layout } => format!(
            "parameters of layout {layout} are stored that this firmware cannot use; commission again, or go back to \
             the firmware that has stored them"
        ),
        Found::Damaged => "the stored parameters are damaged and not used; commission again and store".into(),
    }
}

/// Why a current sensor delivers nothing, and the remedy; `None`: it delivers, or there is none.
pub fn current_text(current_raw: i16) -> Option<&'static str> {
    match current_raw {
        Sample::CURRENT_ZERO_SOUGHT => Some(
            "the zero of the current sensor is still looked for: limits of current, energy and heat do not act yet",
        ),
        Sample::CURRENT_ZERO_UNSTEADY => Some(
            "the current sensor has no zero, since its readings with the bridge open spread too far: limits of current, energy and heat do not act; let the shaft rest at power-up, and check the sensor's wiring for noise",
        ),
        Sample::CURRENT_ZERO_OUTSIDE => Some(
            "the current sensor has no zero, since its readings with the bridge open are none of a sensor at rest: limits of current, energy and heat do not act; check that the sensor is connected and that the image is for this power stage",
        ),
        Sample::CURRENT_ZERO_UNSEEN => Some(
            "the current sensor has no zero, since the bridge was not open long enough: limits of current, energy and heat do not act; stop the servo for a second",
        ),
        _ => None,
    }
}

/// What a latched fault means, and the remedy; its number and name as log and axis file have them.
pub fn fault_advice(fault: Fault) -> String {
    let text = sentences! { fault;
        Fault::None => "no fault",
        Fault::NoMotion => advice(Reason::NoMotion),
        Fault::WrongDirection => "the count runs against the voltage: swap the motor's leads or the encoder's A and B",
        Fault::Overspeed => "the speed limit was exceeded: look for a load that drives the shaft, or raise limits.speed_rad_s",
        Fault::OverCurrent => "the current rose far above limits.current_a although the voltage gave way: look for a short, a load that drives the shaft or an end stop met at speed, or raise the limit",
        Fault::SupplyLow => "the supply fell below limits.supply_low_v (half of supply.nominal_v if it is not set): check the supply, its wiring and its current limit",
        Fault::SupplyHigh => "the supply rose above limits.supply_high_v (1.5 times supply.nominal_v if it is not set): braking feeds it; use a supply or a battery that can take energy, a braking resistor, or brake more gently",
        Fault::Stalled => advice(Reason::Stalled),
        Fault::EncoderUnplugged => advice(Reason::EncoderUnplugged),
        Fault::MotorDisconnected => advice(Reason::MotorDisconnected),
        Fault::SlippingCounts => "the count changed as no shaft can: check the encoder's cable, shield and supply, its mounting and the coupling",
        Fault::Overload => "the winding is as hot as the continuous current makes it: let it cool, and reduce load or duty",
        Fault::SupplyNotMeasured => "the supply was measured and is not any more: check the divider and its wiring to the converter",
        Fault::CommandTimeout => "no fresh command arrived while the motor ran on: check the link and the program that sends the commands",
        Fault::TickOverrun => "a control tick took longer than its period: lower axis.tick_hz",
        Fault::WatchdogReset => "the watchdog has reset the chip because the firmware hung: look at the log before the reset, and report it",
        Fault::ParametersDamaged => "the stored parameters are damaged and were not used: configure and commission again, then save",
        Fault::Runaway => "the shaft turned faster than the voltage can drive it: look for a load that drives it, a shorted bridge, or wrong parameters",
        Fault::BridgeFault => "the bridge driver reports a fault: look for a short at the motor's leads, let the driver cool, and check its supply",
        Fault::Disabled => "the enable (emergency stop) contact is open: close it, then stop and arm again",
    };
    named(text, fault)
}

/// With the number and the name that log and axis file have.
pub fn named(text: &str, fault: Fault) -> String {
    format!("{text} (fault {}, {})", fault as u8, fault.name())
}

/// What an advisory means, and what to do; `None` for none.
pub fn advisory_text(advisory: Advisory) -> Option<&'static str> {
    match advisory {
        Advisory::None => None,
        Advisory::PositionLoadOff => Some(
            "the table of the load does not act: its angle is not known since power-up (find the reference), or it is too steep for the loops",
        ),
        Advisory::StreamRanDry => Some(
            "no further point of the streamed motion came in time, and the axis slowed down to rest by itself: send points \
             earlier, or fewer of them",
        ),
        Advisory::DeadZoneMoved => Some(
            "a dead zone has moved by more than a quarter since it was commissioned: look for wear, lack of grease or a \
             changed load; the loops follow it, and a new commissioning makes it the new normal",
        ),
    }
}

/// What to do about a missing or doubtful number, or a refused commissioning.
pub fn advice(reason: Reason) -> &'static str {
    sentences! { reason;
        Reason::NotIdentified => "nothing was learned yet: run a commissioning",
        Reason::NotExcited => "the speed did not vary enough: give a longer --budget-s, or free the axis so that it can move",
        Reason::TooUncertain => "the uncertainty is above the limit of trust: give a longer --budget-s, or use a finer encoder",
        Reason::NotVerified => "the check at another voltage did not agree or did not fit into the time: give a longer --budget-s and keep the load constant",
        Reason::NotSeen => "speed kept growing up to the highest voltage: there is no saturation to report below the supply",
        Reason::Aged => "it was learned too long ago: move the axis or commission again",
        Reason::Implausible => "the dead zone came out negative: remove a load that pulls, and check the encoder for lost counts",
        Reason::LoadChanged => "friction or load changed while learning: keep the load constant and repeat",
        Reason::SupplyMoved => "the supply moved too much while the motor turned: use a stiffer supply, or check its wiring",
        Reason::TravelTooShort => "the travel between the end stops is too short for this part: widen axis.travel_limit_rad if the joint allows it",
        Reason::EncoderTooSlow => "the encoder gives too few counts per time constant: use a finer encoder, or mount it before the gear",
        Reason::TooShort => "the budget is used up before enough was seen: give a longer --budget-s, ten to fifteen of the motor's time constants",
        Reason::NoMotion => "voltage was applied and nothing moved: free the shaft, check the motor's and the encoder's cables and the supply; without a current sensor a stall and an unplugged encoder look alike",
        Reason::Reversed => "positive voltage moves the count down: swap the motor's leads or the encoder's A and B",
        Reason::MotionLost => "the motion stopped while driven: look for a stall, for a loose encoder cable and for a loose motor lead",
        Reason::Overspeed => "the speed limit was reached: raise limits.speed_rad_s, or check axis.rated_speed_rad_s",
        Reason::EnergySpent => "the energy budget is spent: raise limits.energy_j, or give a shorter --budget-s",
        Reason::TravelExceeded => "the travel limit was reached: start in the middle of the travel, or widen axis.travel_limit_rad",
        Reason::Aborted => "it was stopped before the end: run it again",
        Reason::Stalled => "voltage was applied, current flowed and nothing moved: free the shaft, or let a stronger motor do the work",
        Reason::EncoderUnplugged => "the current is that of a motor that turns, yet nothing was counted: check the encoder's cable, its supply and its coupling to the shaft",
        Reason::MotorDisconnected => "voltage was applied and no current flowed: check the motor's leads, its brushes and the bridge's enable line",
        Reason::CurrentLimited => "the current limit held the voltage back before this could be learned: raise limits.current_a by half and repeat",
        Reason::ChannelMissing => "the count moves the same way under both voltages, or to and fro by one: an encoder channel is missing, the drive's direction line is loose, or a load or an offset turns the shaft; check the encoder's A and B, then the direction line",
        Reason::OneDirection => "the shaft moves in one direction only, under one sign of the voltage: look for a half bridge or PWM line that does not work, and for an end stop at the shaft",
        Reason::DirectionChanged => "the count followed the voltage, and then ran against it: look for a loose wire at the encoder, the motor or the drive's direction line",
        Reason::SupplyNotNominal => "the supply is far from supply.nominal_v: correct it in the axis file, or check the supply and supply.vbus_v_per_lsb",
        Reason::SpeedContradicts => "the speed by the count contradicts the axis file: check encoder.counts_per_rev (edges after x4), axis.rated_speed_rad_s (not rpm) and supply.nominal_v",
        Reason::StartsHigher => "a start takes far more voltage than turning does: the drive gives nothing below a threshold, or friction at rest is that high; use a drive without a threshold, or free the shaft",
        Reason::GainsDiffer => "the gain differs by direction: look for a weak half bridge, a bad contact, or a load that always pulls one way",
        Reason::SupplyTooLow => "the supply is far below supply.nominal_v: check the supply, or correct the axis file",
    }
}
