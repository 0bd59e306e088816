//! From the stored parameters to axes that are ready to be armed.

use super::board::{AXES, Board, Drive};
use core::mem::MaybeUninit;
use fast_tick::{ServoAxis, constants};
use servo::axis::Axis;
use servo::axis::servo_axis::{Order, Restored};
use servo::drivers::saving::Archive;
use servo::link::protocol::ResetCause;
use servo::protect::Condition;
use servo::store::{Found, StoredParameters};

/// Reads the store into the archive. A set that this board cannot run counts as unreadable: it is reported, not mended.
#[inline(never)]
pub fn restore<B: Board>(archive: &mut Archive<B::Flash, AXES>) -> Found {
    let found = match archive.load() {
        Found::Set { layout } if !suits::<B>(archive.set()) => {
            archive.forget();
            Found::Unreadable { layout }
        }
        found => found,
    };
    // Words by hand: `Debug` would bring 5 KiB of formatting into the image.
    match found {
        Found::Set { layout } => defmt::info!("stored parameters: layout {=u16}", layout),
        Found::Blank => defmt::info!("stored parameters: none"),
        Found::Unreadable { layout } => defmt::info!("stored parameters: unreadable, layout {=u16}", layout),
        Found::Damaged => defmt::info!("stored parameters: damaged"),
    }
    found
}

fn suits<B: Board>(set: &StoredParameters<AXES>) -> bool {
    let mut stored = set.axes.iter().flatten();
    stored.all(|axis| B::supports(&axis.config, Some(&axis.protection)).is_ok())
}

/// Makes the axes, each as it was stored or else not configured, in the place where they stay: they are kilobytes, and copies
/// would make this the deepest point of the stack. The archive is then ready for the next save.
#[inline(never)]
pub fn axes<'a, B: Board>(
    places: &'a mut [MaybeUninit<ServoAxis>; AXES],
    archive: &mut Archive<B::Flash, AXES>,
    found: Found,
    cause: ResetCause,
    drive: &mut B::Drive,
) -> [&'a mut ServoAxis; AXES] {
    let mut axes = places.each_mut().map(|place| place.write(ServoAxis::default()));
    for (axis, servo_axis) in axes.iter_mut().enumerate() {
        if cause == ResetCause::Watchdog {
            servo_axis.raise(Condition::WatchdogReset);
        }
        if found == Found::Damaged {
            servo_axis.raise(Condition::ParametersDamaged);
        }
        if let Some(Some(parameters)) = archive.set().axes.get(axis)
            && let Ok(constants) = Axis::from_parameters(parameters)
            && let Ok(constants) = constants::put(constants)
            && servo_axis.carry_out(&Order::Install(constants, Some(Restored::of(parameters)))).is_ok()
        {
            drive.configure(axis, &parameters.config);
        }
    }
    archive.forget();
    axes
}
