//! TIM1 and TIM8, as far as the board uses them (RM0090 section 17): centre-aligned PWM with preloaded registers, repetition counter,
//! complementary outputs with dead time, break.

/// One of the two.
pub struct PwmTimer {
    cr1: u32,
    cr2: u32,
    ccmr: [u32; 2],
    ccer: u32,
    bdtr: u32,
    broken: bool,
    /// The break input is active: low, with BKP 0.
    active: bool,
    /// As written; and as they act since the last update.
    written: Preloaded,
    acting: Preloaded,
    repetitions: u32,
    /// When the present half period began; `None`: stopped.
    turned: Option<u64>,
    down: bool,
    late: bool,
    /// Reference level of the channels, and since when.
    reference: [(bool, u64); 4],
}

#[derive(Clone, Copy, Default)]
struct Preloaded {
    arr: u32,
    rcr: u32,
    ccr: [u32; 4],
}

const MOE: u32 = 1 << 15;
const BKE: u32 = 1 << 12;
const OSSI: u32 = 1 << 10;
/// Of TIM_SR.
const BIF: u32 = 1 << 7;

impl PwmTimer {
    pub fn new(late: bool) -> Self {
        Self {
            cr1: 0,
            cr2: 0,
            ccmr: [0; 2],
            ccer: 0,
            bdtr: 0,
            broken: false,
            active: false,
            written: Preloaded::default(),
            acting: Preloaded::default(),
            repetitions: 0,
            turned: None,
            down: false,
            late,
            reference: [(false, 0); 4],
        }
    }

    /// The break input becomes active or not. An active one clears MOE without a clock (section 17.3.12).
    pub fn break_input(&mut self, active: bool) {
        self.active = active;
        if active && self.bdtr & BKE != 0 {
            self.bdtr &= !MOE;
            self.broken = true;
        }
    }

    /// MMS 010: the update is the trigger output.
    pub fn triggers_on_update(&self) -> bool {
        self.cr2 >> 4 & 7 == 0b010
    }

    /// DTG, in clocks (section 17.4.18).
    fn dead_time(&self) -> u64 {
        let code = u64::from(self.bdtr & 0xFF);
        match code >> 5 {
            0..4 => code,
            4 | 5 => (64 + (code & 0x3F)) * 2,
            6 => (32 + (code & 0x1F)) * 8,
            _ => (32 + (code & 0x1F)) * 16,
        }
    }

    /// Clocks from the turning point to the change of a channel's level in this half period, if there is one.
    fn crossing(&self, channel: usize) -> Option<u64> {
        let (full, compare) = (self.acting.arr, self.acting.ccr[channel]);
        let at = if self.down { full.saturating_sub(compare) } else { compare };
        (compare > 0 && compare < full).then_some(at.into())
    }

    /// PWM mode 1 (110) is high below the compare value, mode 2 (111) from there on (section 17.4.7).
    fn level(&self, channel: usize, now: u64) -> bool {
        let Some(turned) = self.turned else { return false };
        let (full, compare) = (self.acting.arr, self.acting.ccr[channel]);
        let since = (now - turned) as u32;
        let below = match (compare, self.down) {
            (0, _) => false,
            _ if compare >= full => true,
            (_, false) => since < compare,
            (_, true) => since >= full - compare,
        };
        match self.ccmr[channel / 2] >> (8 * (channel % 2) + 4) & 7 {
            0b110 => below,
            0b111 => !below,
            mode => panic!("output mode {mode:#b} of channel {channel}"),
        }
    }

    /// The next moment at which something changes.
    pub fn next_event(&self, now: u64) -> Option<u64> {
        let turned = self.turned?;
        let dead = self.dead_time();
        let crossings = (0..4).filter_map(|channel| self.crossing(channel)).map(|at| turned + at);
        let edges = self.reference.iter().map(|(_, since)| since + dead);
        let turn = turned + u64::from(self.acting.arr);
        crossings.chain(edges).chain([turn]).filter(|at| *at > now).min()
    }

    /// Does what is due now; true: an update.
    pub fn event(&mut self, now: u64) -> bool {
        let mut updates = false;
        if let Some(turned) = self.turned
            && now >= turned + u64::from(self.acting.arr)
        {
            (self.turned, self.down) = (Some(now), !self.down);
            updates = self.repetitions == 0;
            match updates {
                true => self.update(),
                false => self.repetitions -= 1,
            }
        }
        self.refer(now);
        updates
    }

    fn refer(&mut self, now: u64) {
        for channel in 0..4 {
            let level = self.level(channel, now);
            if self.reference[channel].0 != level {
                self.reference[channel] = (level, now);
            }
        }
    }

    /// Preloaded registers act from an update on.
    fn update(&mut self) {
        self.acting = self.written;
        self.repetitions = self.acting.rcr;
    }

    /// Output and complementary output of a channel.
    pub fn output(&self, channel: usize, now: u64) -> (bool, bool) {
        if self.bdtr & MOE == 0 {
            // OSSI: driven to the idle level, low.
            assert!(self.bdtr & OSSI != 0 || self.bdtr == 0);
            return (false, false);
        }
        let (level, since) = self.reference[channel];
        let enables = self.ccer >> (4 * channel);
        let settled = enables & 0b100 == 0 || now >= since + self.dead_time();
        (level && enables & 1 != 0 && settled, !level && enables & 0b100 != 0 && settled)
    }

    pub fn read(&self, offset: u32, now: u64) -> u32 {
        match offset {
            0x00 => self.cr1 | u32::from(self.down) << 4,
            0x10 => u32::from(self.broken) << 7,
            0x20 => self.ccer,
            0x24 => {
                let since = self.turned.map_or(0, |turned| (now - turned) as u32);
                if self.down { self.acting.arr - since } else { since }
            }
            0x44 => self.bdtr,
            _ => 0,
        }
    }

    pub fn write(&mut self, offset: u32, value: u32, now: u64) {
        match offset {
            0x00 => self.control(value, now),
            0x04 => self.cr2 = value,
            0x10 => self.broken &= value & BIF != 0 || self.active,
            // UG.
            0x14 => self.update(),
            0x18 => self.ccmr[0] = value,
            0x1C => self.ccmr[1] = value,
            0x20 => self.ccer = value,
            0x2C => self.written.arr = value,
            0x30 => self.written.rcr = value,
            0x34..0x44 => self.written.ccr[((offset - 0x34) / 4) as usize] = value,
            0x44 => self.set_break(value),
            other => panic!("TIM register {other:#x} is not modelled"),
        }
        self.refer(now);
    }

    fn control(&mut self, value: u32, now: u64) {
        assert!(value >> 5 & 3 == 1 && value >> 7 & 1 == 1, "centre-aligned mode 1, ARR preloaded");
        self.cr1 = value & !(1 << 4);
        if value & 1 != 0 && self.turned.is_none() {
            self.turned = Some(now);
            self.repetitions = self.repetitions.saturating_sub(u32::from(self.late));
        }
    }

    /// LOCK level 1 protects dead time and break; an active break input keeps MOE clear (section 17.4.18).
    fn set_break(&mut self, value: u32) {
        const KEPT: u32 = 0xFF | BKE | 1 << 13 | 1 << 14;
        let kept = if self.bdtr >> 8 & 3 == 0 { 0 } else { KEPT };
        let lock = self.bdtr & 3 << 8;
        self.bdtr = self.bdtr & kept | value & !kept | lock;
        for mode in self.ccmr {
            assert_eq!(mode & 0x0808, 0x0808, "compare registers are preloaded");
        }
        if self.active && self.bdtr & BKE != 0 {
            self.bdtr &= !MOE;
        }
    }
}
