//! The constants of the axes: made by the link task in places of their own, and handed to the control interrupt by pointer.

use heapless::pool::arc::{Arc, ArcBlock};
use servo::axis::Axis;

#[allow(missing_docs, reason = "the macro leaves no room for a comment")]
mod pool {
    use servo::axis::Axis;

    heapless::arc_pool!(Pool: Axis);
}

/// The constants of an axis. Control and link both point to those in force.
pub type Constants = Arc<pool::Pool>;

/// Memory for the constants of one axis.
pub type Place = ArcBlock<Axis>;

/// Adds a place.
pub fn add(place: &'static mut Place) {
    pool::Pool.manage(place);
}

/// Puts constants into a place.
///
/// # Errors
/// No place is free.
pub fn put(axis: Axis) -> Result<Constants, NoPlace> {
    pool::Pool.alloc(axis).map_err(|_| NoPlace)
}

/// No place is free. It cannot be where there is one place more than axes, and whoever makes an order has taken note of how the
/// one before it ended.
#[derive(Clone, Copy, Debug)]
pub struct NoPlace;
