//! DRV8301 as far as a board uses it, from TI's data sheet SLOS719: its SPI, its registers, what its enable line does, and its latched
//! fault. Time counts clocks of 168 MHz.

const MICROSECOND: u64 = 168;
/// From enable to the first answer: 5 to 10 ms.
const WAKES: u64 = 10_000 * MICROSECOND;
/// Least half period of the clock (100 ns a period) and least pause between frames.
const LEAST_HALF: u64 = 8;
const LEAST_PAUSE: u64 = 67;
/// Control register 1 after a full reset, as boards report it: a threshold of 0.403 V, current limiting.
const CONTROL_1: u16 = 0x0400;
/// FAULT of status register 1.
const FAULT: u16 = 1 << 10;
/// What status register 1 still tells of the start: the gate supply was low (GVDD_UV and FAULT). People have read 0 and
/// 0x600 by turns (TI's forum, thread 674106), and the firmware of ODrive reads after a start until the flags are gone.
pub const STARTED: u16 = FAULT | 1 << 9;

/// One driver.
pub struct Drv8301 {
    /// Status 1, status 2, control 1, control 2.
    pub registers: [u16; 4],
    /// Enabled since, and dead for its first 10 ms; `None`: the enable line is low.
    enabled: Option<u64>,
    low_since: u64,
    was_off: bool,
    /// It did not start, because a terminal stood above 8.5 V.
    pub stuck: bool,
    /// Its gate supply stays low.
    pub starved: bool,
    /// Times that its enable line has gone high.
    pub starts: u32,
    /// An over-current has latched it off, which reading does not end.
    latched: bool,
    /// Writes to control registers that it ignores after a start.
    pub deaf: u32,
    ignoring: u32,
    frame: Option<Frame>,
    released: u64,
    answer: u16,
    pub frames: u32,
}

/// The frame under way.
#[derive(Clone, Copy)]
struct Frame {
    bits: u32,
    received: u16,
    out: bool,
    last_edge: u64,
}

impl Drv8301 {
    pub fn new() -> Self {
        Self {
            registers: [0, 1, CONTROL_1, 0],
            enabled: None,
            low_since: 0,
            was_off: true,
            stuck: false,
            starved: false,
            starts: 0,
            latched: false,
            deaf: 0,
            ignoring: 0,
            frame: None,
            released: 0,
            answer: 0,
            frames: 0,
        }
    }

    /// The enable line. `terminal`: the highest terminal of the motor, V.
    pub fn enable(&mut self, high: bool, now: u64, terminal: f64) {
        match (self.enabled, high) {
            (None, true) => {
                self.starts += 1;
                let low = now - self.low_since;
                let full = self.was_off || low > 20 * MICROSECOND;
                assert!(full || low < 10 * MICROSECOND, "enable low for {low} clocks: neither reset");
                (self.registers[0], self.latched) = (0, false);
                if full {
                    (self.registers, self.ignoring, self.answer) = ([STARTED, 1, CONTROL_1, 0], self.deaf, 0);
                    self.stuck = terminal > 8.5;
                }
                (self.enabled, self.was_off) =
                    (Some(if full { now } else { now.saturating_sub(WAKES) }), false);
            }
            (Some(_), false) => (self.enabled, self.low_since) = (None, now),
            _ => {}
        }
    }

    fn awake(&self, now: u64) -> bool {
        !self.stuck && self.enabled.is_some_and(|since| now >= since + WAKES)
    }

    /// Do the gates follow their inputs?
    pub fn drives(&self, now: u64) -> bool {
        self.awake(now) && !self.latched && !self.starved
    }

    /// V/V of its amplifiers; `None`: they are off.
    pub fn gain(&self, now: u64) -> Option<f64> {
        self.awake(now).then(|| f64::from(10 << (self.registers[3] >> 2 & 3)))
    }

    /// The fault line is low.
    pub fn complains(&self, now: u64) -> bool {
        !self.drives(now)
    }

    /// An over-current of high side A: latched off only if it was set up so.
    pub fn overload(&mut self) {
        match self.registers[2] >> 4 & 3 {
            1 => (self.registers[0], self.latched) = (self.registers[0] | FAULT | 1 << 5, true),
            _ => self.registers[0] |= 1 << 5,
        }
    }

    /// Its supply dips: registers are lost, and no line says so.
    pub fn forget(&mut self) {
        self.registers = [0, 1, CONTROL_1, 0];
    }

    /// Levels of select line, clock and data after one of them has changed.
    pub fn lines(&mut self, selected: bool, clock: bool, data: bool, now: u64) {
        match (&mut self.frame, selected) {
            (None, true) => {
                assert!(!clock, "the clock is low between frames");
                assert!(now >= self.released + LEAST_PAUSE, "{} clocks between frames", now - self.released);
                self.frame = Some(Frame { bits: 0, received: 0, out: false, last_edge: now });
            }
            (Some(frame), false) => {
                let (bits, word) = (frame.bits, frame.received);
                (self.frame, self.released) = (None, now);
                if bits > 0 && self.awake(now) {
                    self.commit(bits, word);
                }
            }
            (Some(frame), true) => {
                let rose = clock && frame.bits.is_multiple_of(2);
                let fell = !clock && !frame.bits.is_multiple_of(2);
                if rose || fell {
                    assert!(now >= frame.last_edge + LEAST_HALF, "the clock is too fast");
                    frame.last_edge = now;
                    frame.bits += 1;
                }
                if rose {
                    frame.out = self.answer >> (15 - frame.bits / 2 % 16) & 1 != 0;
                }
                if fell {
                    frame.received = frame.received << 1 | u16::from(data);
                }
            }
            (None, false) => {}
        }
    }

    /// What it puts on the data line; `None`: nothing.
    pub fn out(&self, now: u64) -> Option<bool> {
        self.frame.map(|frame| frame.out && self.awake(now))
    }

    /// A frame has ended, and the next one brings its answer: bits count edges of the clock.
    fn commit(&mut self, edges: u32, word: u16) {
        self.frames += 1;
        let place = usize::from(word >> 11 & 0xF);
        if edges != 32 || place > 3 {
            self.answer = 1 << 15;
            return;
        }
        if word >> 15 != 0 {
            self.answer = word & 0x7800 | self.registers[place] & 0x7FF;
            // A status register is cleared by reading; what lasts is there again.
            if place == 0 {
                self.registers[0] = match (self.latched, self.starved) {
                    (_, true) => STARTED,
                    (true, _) => FAULT,
                    _ => 0,
                };
            }
            return;
        }
        self.answer = self.registers[0];
        match place {
            2 | 3 if self.ignoring > 0 => self.ignoring -= 1,
            2 | 3 => self.registers[place] = word & 0x7FF,
            _ => {}
        }
    }
}
