//! From the stored parameters to joints that are ready to be armed.

use crate::board::{self, AXES};
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
    defmt::info!("stored parameters: {}", defmt::Debug2Format(&restored.found));
    (Archive::new(flash), restored)
}

fn suits(set: &StoredParameters) -> bool {
    let mut configs = set.axes.iter().flatten().map(|axis| &axis.config);
    set.axes.iter().skip(AXES).all(Option::is_none) && configs.all(|config| board::supports(config).is_ok())
}

/// One joint an axis: as it was stored, or never configured.
pub fn joints(restored: &Restored, cause: ResetCause, drive: &mut board::Drive) -> [Joint; AXES] {
    core::array::from_fn(|axis| {
        let mut joint = Joint::new();
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
        joint
    })
}
