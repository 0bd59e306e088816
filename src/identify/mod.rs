//! Dead zone, saturation, gain and time constant from count and voltage alone, learned incrementally in integers.

pub mod estimate;
