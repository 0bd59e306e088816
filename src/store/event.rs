//! What becomes of a save.

use serde::{Deserialize, Serialize};

/// What the host is told about a save.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum StoreEvent {
    /// The servo is about to fall silent for at most this time; bytes sent to it meanwhile are lost.
    Erasing {
        /// ms.
        longest_ms: u32,
    },
    /// What was in force at the command is stored.
    Saved,
    /// It is not; what was stored before is untouched.
    Failed(SaveError),
}

/// Why a set was not saved. The one stored before is untouched.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum SaveError {
    /// No slot is left: announce the pause, call [`crate::drivers::flash::ParameterFlash::erase`], then save again.
    EraseNeeded,
    /// The set does not fit into a record.
    TooLarge,
    /// The flash reported an error, or does not hold what was programmed.
    Flash,
}
