//! What the bridge does on a fault: a table *fault × action*.
//!
//! | action | allowed for |
//! |---|---|
//! | [`Action::Open`] | every fault; the default |
//! | [`Action::Brake`] | all but over-current, a fault of the bridge and an open enable contact: a shorted winding feeds the very current, or needs the very switches, that have failed, and who opens the contact wants no switch closed |
//! | [`Action::Hold`] | a command timeout alone: holding needs everything else to be healthy |
//!
//! While a fault is latched the other conditions are still watched: one that asks for more ([`Action`]'s order) gets
//! it, and the reason that was latched first stays.

use super::fault::Fault;
use serde::{Deserialize, Serialize};

/// What the bridge does on a fault, the mildest first.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[repr(u8)]
pub enum Action {
    /// Slow down to a stop within the limits and stay there, the loops closed.
    Hold = 0,
    /// Tie both terminals together: the motor brakes by itself.
    Brake = 1,
    /// All switches off: the motor coasts.
    #[default]
    Open = 2,
}

impl Action {
    /// The word, as `axis.toml` spells it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Hold => "hold",
            Self::Brake => "brake",
            Self::Open => "open",
        }
    }

    /// May this be the answer to that fault?
    #[must_use]
    pub const fn suits(self, fault: Fault) -> bool {
        match self {
            Self::Open => true,
            Self::Brake => {
                !matches!(fault, Fault::None | Fault::OverCurrent | Fault::BridgeFault | Fault::Disabled)
            }
            Self::Hold => matches!(fault, Fault::CommandTimeout),
        }
    }
}

/// A pair of fault and action that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Forbidden {
    /// The fault.
    pub fault: Fault,
    /// What was asked for.
    pub action: Action,
}

/// The table. Everything opens the bridge unless it says otherwise.
///
/// Bit n: fault number n brakes. Bit 0: a command timeout holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Actions(u32);

/// Bit 0 of [`Actions`]; fault number 0 is none.
const HOLDING: u32 = 1;

impl Actions {
    /// The table with one entry changed, or why it cannot be.
    pub const fn with(self, fault: Fault, action: Action) -> Result<Self, Forbidden> {
        if !action.suits(fault) {
            return Err(Forbidden { fault, action });
        }
        let own = match fault {
            Fault::CommandTimeout => 1 << fault as u32 | HOLDING,
            _ => 1 << fault as u32,
        };
        let others = self.0 & !own;
        Ok(Self(match action {
            Action::Open => others,
            Action::Brake => others | 1 << fault as u32,
            Action::Hold => others | HOLDING,
        }))
    }

    /// The answer to a fault.
    #[must_use]
    pub const fn of(&self, fault: Fault) -> Action {
        let braking = self.0 >> fault as u32 & 1 == 1;
        match fault {
            Fault::CommandTimeout if self.0 & HOLDING != 0 => Action::Hold,
            _ if braking && Action::Brake.suits(fault) => Action::Brake,
            _ => Action::Open,
        }
    }

    /// The first entry that cannot be, if there is one: a table from a link or a store may hold any bits.
    #[must_use]
    pub fn forbidden(&self) -> Option<Forbidden> {
        let foreign = |fault: &Fault| self.0 >> *fault as u32 & 1 == 1 && !Action::Brake.suits(*fault);
        let fault = Fault::ALL.into_iter().find(foreign)?;
        Some(Forbidden { fault, action: Action::Brake })
    }
}
