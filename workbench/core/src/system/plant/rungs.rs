//! How finely a plant is simulated: its places on the ladders of step lengths.

/// How motor and load hang together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Coupling {
    /// They are one body.
    Rigid,
    /// The load has no inertia and follows within a gap.
    Play,
    /// A spring.
    Spring,
    /// A gap with compliant teeth.
    Contact,
    /// A gap with hard teeth.
    Gap,
}

/// The places of a plant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rungs {
    /// How motor and load hang together: another coupling has another ladder.
    pub coupling: Coupling,
    /// Place of the time constant.
    pub time: i32,
    /// Place of the rate of spring or teeth.
    pub rate: i32,
}

impl Rungs {
    /// As fine as each of two needs to be.
    pub fn finer(self, other: Self) -> Self {
        if self.coupling != other.coupling {
            return self;
        }
        Self { time: self.time.min(other.time), rate: self.rate.max(other.rate), ..self }
    }
}
