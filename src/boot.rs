//! From the stored parameters to joints that are ready to be armed.

use crate::board::{self, AXES};
use core::mem::MaybeUninit;
use servo::drivers::flash::ParameterFlash;
use servo::joint::{Joint, Order};
use servo::protect::Notice;
use servo::protocol::ResetCause;
use servo::saving::Archive;
use servo::store::{Found, Loaded, StoredParameters};

/// What the flash holds.
pub struct Restored {
    /// In short, for the host.
    pub found: Found,
    set: StoredParameters,
}

/// Reads the store. A set that this board cannot run counts as unreadable: it is reported, not mended.
#[inline(never)]
pub fn restore() -> (Archive<board::Flash>, Restored) {
    let mut flash = ParameterFlash::new(board::flash(), board::PARAMETERS);
    let loaded = flash.load();
    let found = Found::from(&loaded);
    let restored = match loaded {
        Loaded::Set { parameters, .. } if suits(&parameters) => Restored {
            found,
            set: parameters,
        },
        Loaded::Set { layout, .. } => Restored {
            found: Found::Unreadable { layout },
            set: StoredParameters::default(),
        },
        _ => Restored {
            found,
            set: StoredParameters::default(),
        },
    };
    // Words by hand: `Debug` would bring 5 KiB of formatting into the image.
    match restored.found {
        Found::Set { layout } => defmt::info!("stored parameters: layout {=u16}", layout),
        Found::Blank => defmt::info!("stored parameters: none"),
        Found::Unreadable { layout } => defmt::info!("stored parameters: unreadable, layout {=u16}", layout),
        Found::Damaged => defmt::info!("stored parameters: damaged"),
    }
    (Archive::new(flash), restored)
}

fn suits(set: &StoredParameters) -> bool {
    let mut configs = set.axes.iter().flatten().map(|axis| &axis.config);
    set.axes.iter().skip(AXES).all(Option::is_none) && configs.all(|config| board::supports(config).is_ok())
}

/// One joint an axis: as it was stored, or never configured. In the place where they stay: they are kilobytes, and
/// copies would make this the deepest point of the stack.
#[inline(never)]
pub fn joints<'a>(
    place: &'a mut MaybeUninit<[Joint; AXES]>,
    restored: &Restored,
    cause: ResetCause,
    drive: &mut board::Drive,
) -> &'a mut [Joint; AXES] {
    let joints = place.write(core::array::from_fn(|_| Joint::new()));
    for (axis, joint) in joints.iter_mut().enumerate() {
        if cause == ResetCause::Watchdog {
            joint.heed(Notice::WatchdogReset);
        }
        if restored.found == Found::Damaged {
            joint.heed(Notice::ParametersDamaged);
        }
        if let Some(Some(parameters)) = restored.set.axes.get(axis)
            && let Ok(order) = Order::restore(parameters)
            && joint.execute(&order).is_ok()
        {
            drive.configure(axis, &parameters.config);
        }
    }
    joints
}
