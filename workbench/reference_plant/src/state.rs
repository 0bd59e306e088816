//! Where each physical quantity stands in the state vector.

/// Winding current, A.
pub const CURRENT: usize = 0;
/// Speed of the rotor, rad/s.
pub const SPEED: usize = 1;
/// Angle of the rotor, rad.
pub const ANGLE: usize = 2;
/// Speed of the load behind a coupling or a play, rad/s at the rotor's shaft.
pub const LOAD_SPEED: usize = 3;
/// Angle of the load, rad at the rotor's shaft.
pub const LOAD_ANGLE: usize = 4;
/// Deflection of the bristles, rad.
pub const BRISTLE: usize = 5;
/// Heating power smoothed by the thermal time constant, W.
pub const HEAT: usize = 6;
/// Voltage across the bridge, V.
pub const BUS: usize = 7;
/// Output of the drive's lag, V.
pub const LAG: usize = 8;
/// Output of the speed sensor's lag, rad/s.
pub const SENSED: usize = 9;
/// Integral of what the speed sensor sees, rad.
pub const SENSED_ANGLE: usize = 10;
