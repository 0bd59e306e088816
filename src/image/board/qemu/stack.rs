//! How deep the stack was: the start-up code has painted it, what was used is painted no more.

use cortex_m_rt::STACK_PAINT_VALUE;

unsafe extern "C" {
    /// The linker's: first word above the stack, and its lowest one.
    static _stack_start: u32;
    static _stack_end: u32;
}

/// Bytes that were ever used.
pub fn used() -> usize {
    let (mut lowest, top) = (&raw const _stack_end, &raw const _stack_start);
    // SAFETY: aligned words between two symbols of the linker, all of them RAM; nothing is written.
    while lowest < top && unsafe { lowest.read_volatile() } == STACK_PAINT_VALUE {
        lowest = lowest.wrapping_add(1);
    }
    top as usize - lowest as usize
}
