//! Where the fits of an effect start.

/// Where the fits of an effect start, in units of the parameters' scales.
#[derive(Clone, Copy, Debug)]
pub enum Starts {
    /// These.
    Grid(&'static [&'static [f64]]),
    /// These, where the cost is so rugged between them that no derivative leads on: the most promising one is where an
    /// evolution begins, with these relative standard deviations of the parameters.
    Rugged(&'static [&'static [f64]], &'static [f64]),
    /// The first parameter at quantiles of a signal of the simulation (a threshold has no gradient where it is not
    /// reached); the others at these values.
    Quantiles(Signal, &'static [f64]),
    /// One sine per turn of the load, fitted to the missing torque, gives amplitude and phase.
    GravityScan,
    /// One scan of the missing torque over periods per turn finds period, amplitude and phase.
    PositionScan,
    /// One scan of the missing torque over frequency finds frequency, amplitude and phase.
    TimeScan,
}

impl Starts {
    /// The starts that do not depend on the log.
    pub fn rows(&self) -> &'static [&'static [f64]] {
        match *self {
            Self::Grid(rows) | Self::Rugged(rows, _) => rows,
            _ => &[],
        }
    }

    /// True if a period is looked for among dozens: one of them always explains something.
    pub fn scans(&self) -> bool {
        matches!(self, Self::PositionScan | Self::TimeScan)
    }
}

/// A signal of the simulation whose quantiles start a threshold.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// |input|.
    Input,
    /// |speed|.
    Speed,
    /// |current|.
    Current,
}
