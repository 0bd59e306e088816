//! Where the shaft is to go: profiles with limited speed, acceleration and jerk, streamed set points, excitations, and the
//! reference at the index pulse.

pub mod excitation;
pub mod referencing;
pub mod sine;
pub mod stream;
pub mod trajectory;
