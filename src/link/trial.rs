//! What is in force on an axis may be on trial: its host is to be heard as long as it is.

/// A dead man's switch for one axis. Without a trial it does nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Trial {
    /// Number of the axis on this chip.
    axis: u8,
    /// Longest silence, control ticks; 0: nothing is on trial.
    ticks: u32,
    /// Ticks until it is over.
    left: u32,
}

impl Trial {
    /// The host is heard now, and then at least once in so many control ticks; 0: the trial is over.
    #[must_use]
    pub const fn new(axis: u8, ticks: u32) -> Self {
        Trial { axis, ticks, left: ticks }
    }

    /// The host has said something.
    pub const fn heard(&mut self) {
        self.left = self.ticks;
    }

    /// A control tick, also that of a command: the axis whose host is silent for too long, in every tick until it is heard again.
    #[inline]
    pub const fn silent(&mut self) -> Option<u8> {
        if self.ticks == 0 {
            return None;
        }
        self.left = self.left.saturating_sub(1);
        if self.left == 0 { Some(self.axis) } else { None }
    }
}
