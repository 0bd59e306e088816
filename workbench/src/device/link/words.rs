//! The servo's codes in words that say what to do.

use servo::axis::{self, Sample};
use servo::config::ConfigError;
use servo::identify::estimate::Reason;
use servo::link::protocol::Refusal;
use servo::protect::{Fault, SettingsError};
use servo::record::Advisory;
use servo::store::SaveError;
use servo::store::StoreEvent;
use servo::store::{Found, LAYOUT};

/// Why a command was refused, one sentence.
pub fn refusal_text(refusal: &Refusal) -> String {
    match refusal {
        Refusal::Parameters(SettingsError::Action(forbidden)) => format!(
            "the servo refuses protection.{} = {}: open always works, brake does not for over-current, bridge fault and \
             enable contact, hold only for a command timeout",
            forbidden.fault.name(),
            forbidden.action.name()
        ),
        Refusal::Config(error) | Refusal::Parameters(SettingsError::Value(error)) => {
            format!("the servo refuses the configuration: {}", range_text(error))
        }
        Refusal::TickRate => {
            "the board cannot make this control rate: choose axis.tick_hz so that it divides the PWM frequency \
             84 MHz / axis.pwm_full_scale"
                .into()
        }
        Refusal::NotConfigured => "the servo has no configuration yet; send one first".into(),
        Refusal::BridgeDriven => "the servo can be configured only while its bridge is open; stop it first".into(),
        Refusal::Axis(axis::Refusal::Value(error)) => {
            format!("the servo refuses the command: {}", range_text(error))
        }
        Refusal::Axis(axis::Refusal::BeyondVoltage {
            needed_v,
            available_v,
        }) => format!(
            "the motion takes {needed_v:.2} V beyond the dead zone and {available_v:.2} V are left: choose an amplitude of \
             at most {:.3} times, or a lower frequency",
            available_v / needed_v
        ),
        Refusal::Axis(axis::Refusal::BeyondSpeed {
            needed_rad_s,
            available_rad_s,
        }) => format!(
            "the motion takes {needed_rad_s:.2} rad/s and limits.speed_rad_s leaves {available_rad_s:.2} rad/s: choose a \
             slower or smaller one, or raise the limit"
        ),
        Refusal::Axis(reason) => axis_text(*reason).into(),
        Refusal::NoSuchAxis => "this firmware has fewer axes; choose a smaller --axis, or build an image with more".into(),
        Refusal::SharedTick => {
            "the axes of one chip share axis.tick_hz, axis.pwm_full_scale and axis.pwm_delay_ticks, and another axis \
             has others; make them equal, or reset the other axis"
                .into()
        }
        Refusal::Storing => "the servo is storing its parameters; try again when it is done".into(),
        Refusal::NotAtRest => {
            "parameters are stored only while every bridge is open and every shaft stands; stop the servo and wait".into()
        }
        Refusal::Stale { expected } => format!("the servo expects command number {expected}; reconnect"),
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

fn axis_text(refusal: axis::Refusal) -> &'static str {
    match refusal {
        axis::Refusal::NotArmed => "the servo is not armed; arm it before asking for torque",
        axis::Refusal::Faulted => "a fault is latched; remove its cause and stop the servo to clear it",
        axis::Refusal::NotIdentified => {
            "gain and time constant are not known; commission first, or give axis.time_constant_hint_s"
        }
        axis::Refusal::Busy => "the servo is busy with another motion; stop it first",
        axis::Refusal::BeyondTravel => "the target lies beyond axis.travel_limit_rad; choose a smaller one",
        axis::Refusal::OutOfRange => {
            "amplitude, frequency or duration cannot be done at this control rate; choose a slower or smaller motion"
        }
        axis::Refusal::NotReferenced => "absolute targets need a reference: find one with `--reference`",
        axis::Refusal::CurrentZeroSought => {
            "the zero of the current sensor is still looked for, with the bridge open; try again in a second"
        }
        axis::Refusal::StreamFull => {
            "so many streamed points wait already; send this one again when one has been reached"
        }
        axis::Refusal::BeyondVoltage { .. } => {
            "the motion takes more voltage than is left; choose a slower or smaller one"
        }
        axis::Refusal::BeyondSpeed { .. } => {
            "the motion is faster than limits.speed_rad_s; choose a slower or smaller one"
        }
        axis::Refusal::Value(_) => "a number of the command is out of its range",
        axis::Refusal::NotForAxis => "the servo does not know this command; update its firmware",
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

/// What a latched fault means, and the remedy.
pub fn fault_advice(fault: Fault) -> String {
    let text = match fault {
        Fault::None => "no fault",
        Fault::NoMotion => {
            "voltage was applied and nothing moved: free the shaft, and check motor and encoder cables; without a current sensor a stall and an unplugged encoder look alike"
        }
        Fault::WrongDirection => {
            "the count runs against the voltage: swap the motor's leads or the encoder's A and B"
        }
        Fault::Overspeed => {
            "the speed limit was exceeded: look for a load that drives the shaft, or raise limits.speed_rad_s"
        }
        Fault::OverCurrent => {
            "the current limit was exceeded: look for a short or a jammed shaft, or raise limits.current_a"
        }
        Fault::SupplyLow => {
            "the supply fell below limits.supply_low_v (half of supply.nominal_v if it is not set): check the supply, its wiring and its current limit"
        }
        Fault::SupplyHigh => {
            "the supply rose above limits.supply_high_v (1.5 times supply.nominal_v if it is not set): braking feeds it; use a supply or a battery that can take energy, a braking resistor, or brake more gently"
        }
        Fault::Stalled => {
            "the shaft is blocked: voltage was applied, nothing moved, and the current was that of a motor at standstill; free the shaft"
        }
        Fault::EncoderUnplugged => {
            "the motor turned, as its current shows, but nothing was counted: check the encoder's cable and supply"
        }
        Fault::MotorDisconnected => {
            "voltage was applied, but no current flowed: check the motor's leads, its brushes and the bridge's enable line"
        }
        Fault::SlippingCounts => {
            "the count changed as no shaft can: check the encoder's cable, shield and supply, its mounting and the coupling"
        }
        Fault::Overload => {
            "the winding is as hot as the continuous current makes it: let it cool, and reduce load or duty"
        }
        Fault::SupplyNotMeasured => {
            "the supply was measured and is not any more: check the divider and its wiring to the converter"
        }
        Fault::CommandTimeout => {
            "no fresh command arrived while the motor ran on: check the link and the program that sends the commands"
        }
        Fault::TickOverrun => "a control tick took longer than its period: lower axis.tick_hz",
        Fault::WatchdogReset => {
            "the watchdog has reset the chip because the firmware hung: look at the log before the reset, and report it"
        }
        Fault::ParametersDamaged => {
            "the stored parameters are damaged and were not used: configure and commission again, then save"
        }
        Fault::Runaway => {
            "the shaft turned faster than the voltage can drive it: look for a load that drives it, a shorted bridge, or wrong parameters"
        }
        Fault::BridgeFault => {
            "the bridge driver reports a fault: look for a short at the motor's leads, let the driver cool, and check its supply"
        }
        Fault::Disabled => "the enable (emergency stop) contact is open: close it, then stop and arm again",
    };
    format!("{text} ({fault:?})")
}

/// What an advisory means, and what to do; `None` for none.
pub fn advisory_text(advisory: Advisory) -> Option<&'static str> {
    match advisory {
        Advisory::None => None,
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

/// What to do about a missing or doubtful number, or a refused commissioning: a line for every code.
const REASONS: &str = include_str!("reasons.txt");

/// The text of a reason.
pub fn advice(reason: Reason) -> &'static str {
    let text = |line: &'static str| line.strip_prefix(reason.code())?.strip_prefix(": ");
    REASONS.lines().find_map(text).unwrap_or(reason.code())
}
