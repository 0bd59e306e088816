//! The encoder counter: a hardware counter of 16 or 32 bits becomes a 32-bit count.
//!
//! Model: the counter holds the true count modulo 2ᵇ. Between two reads the shaft moves by less than half that range,
//! so the difference of two readings, sign-extended from b bits, is the true motion, and its sum is the true count
//! modulo 2³². A 16-bit counter read every tick follows up to 32,767 counts a tick: 32.7 million counts a second at
//! 1 kHz, several times what an incremental encoder delivers.

/// A free-running up/down counter driven by the encoder.
pub trait Counter {
    /// Width b of the counter in bits, 1 … 32.
    fn bits(&self) -> u32;
    /// Present reading; bits above the width are ignored.
    fn count(&self) -> u32;
}

/// A counter with its extension to 32 bits.
pub struct Encoder<C> {
    counter: C,
    last: u32,
    total: i32,
}

impl<C: Counter> Encoder<C> {
    /// The count starts at zero wherever the counter stands.
    pub fn new(counter: C) -> Self {
        let last = counter.count();
        Self { counter, last, total: 0 }
    }

    /// Can the shaft move by half the counter's range while nobody reads it for seconds? Encoders deliver some millions of
    /// counts a second; 2³¹ of them take minutes.
    pub fn goes_round(&self) -> bool {
        self.counter.bits() < 32
    }

    /// Count since the start, wraps at 32 bits. To be called at least once per half range of the counter.
    pub fn read(&mut self) -> i32 {
        let now = self.counter.count();
        let moved = sign_extend(now.wrapping_sub(self.last), self.counter.bits());
        self.last = now;
        self.total = self.total.wrapping_add(moved);
        self.total
    }
}

/// The lowest `bits` of `word` as a signed number.
fn sign_extend(word: u32, bits: u32) -> i32 {
    let unused = 32u32.saturating_sub(bits).min(31);
    (word << unused).cast_signed() >> unused
}
