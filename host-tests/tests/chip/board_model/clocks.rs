//! The clock tree (RM0090 section 7), the wait states of the flash, and TIM11 as far as it measures the crystal (section 19). Time
//! counts clocks of the internal oscillator; every access of the program takes some of them.

pub const RCC: u32 = 0x4002_3800;
pub const FLASH: u32 = 0x4002_3C00;
pub const TIM11: u32 = 0x4001_4800;
pub const DBGMCU: u32 = 0xE004_2000;

/// Clocks that an access and what is around it take.
const ACCESS: u64 = 6;
/// A crystal starts within 2 ms (DS8626).
const START: u64 = 32_000;
const INTERNAL_HZ: f64 = 16e6;

const HSI_READY: u32 = 1 << 1;
const HSE_ON: u32 = 1 << 16;
const HSE_READY: u32 = 1 << 17;
const CSS_ON: u32 = 1 << 19;
const PLL_ON: u32 = 1 << 24;
const PLL_READY: u32 = 1 << 25;
/// RMVF of RCC_CSR.
const CLEARS_CAUSES: u32 = 1 << 24;

/// What runs, and around what crystal.
pub struct Clocks {
    /// Hz; 0: none.
    crystal: f64,
    /// True frequency of the internal oscillator over its nominal one.
    internal: f64,
    now: u64,
    started: Option<u64>,
    cr: u32,
    pllcfgr: u32,
    cfgr: u32,
    apb2enr: u32,
    /// Ports A to D with a clock, one bit each.
    pub ports: u32,
    acr: u32,
    /// Causes of the last reset, in the bits of RCC_CSR (RM0090 section 7.3.21).
    pub causes: u32,
    timer: [u32; 32],
    /// When TIM11 began to count, and the last capture that was read.
    counting: Option<u64>,
    seen: u64,
    overtaken: bool,
    pub revision: u32,
}

impl Clocks {
    /// After reset: the internal oscillator.
    pub fn new(crystal: f64, internal: f64) -> Self {
        Self {
            crystal,
            internal,
            now: 0,
            started: None,
            cr: 1 | HSI_READY,
            pllcfgr: 0x2400_3010,
            cfgr: 0,
            apb2enr: 0,
            ports: 0,
            acr: 0,
            causes: 0,
            timer: [0; 32],
            counting: None,
            seen: 0,
            overtaken: false,
            revision: 0x1007,
        }
    }

    /// As a boot loader leaves them: the PLL runs from the internal oscillator at 60 MHz and clocks the core.
    pub fn behind_a_boot_loader(crystal: f64) -> Self {
        let pllcfgr = 16 | 120 << 6 | 5 << 24;
        let (cr, cfgr) = (1 | HSI_READY | PLL_ON | PLL_READY, 0b10);
        Self { pllcfgr, cr, cfgr, acr: 3, ..Self::new(crystal, 1.0) }
    }

    /// Hz of the core, of APB1 and of APB2.
    pub fn hertz(&self) -> [f64; 3] {
        let core = match self.cfgr & 3 {
            0 => INTERNAL_HZ * self.internal,
            1 => self.crystal,
            _ => self.multiplied(),
        };
        let divided = |code: u32| core / [1.0, 1.0, 1.0, 1.0, 2.0, 4.0, 8.0, 16.0][(code & 7) as usize];
        assert_eq!(self.cfgr >> 4 & 0xF, 0, "HPRE");
        [core, divided(self.cfgr >> 10), divided(self.cfgr >> 13)]
    }

    pub fn watches_the_crystal(&self) -> bool {
        self.cr & CSS_ON != 0
    }

    pub fn prefetches(&self) -> bool {
        self.acr >> 8 & 1 != 0
    }

    /// M, N, P and the source of PLLCFGR, within their ranges.
    fn multiplied(&self) -> f64 {
        let (m, n) = (f64::from(self.pllcfgr & 0x3F), f64::from(self.pllcfgr >> 6 & 0x1FF));
        let p = f64::from(2 * (self.pllcfgr >> 16 & 3) + 2);
        let source = if self.pllcfgr >> 22 & 1 != 0 { self.crystal } else { INTERNAL_HZ * self.internal };
        let comparison = source / m;
        assert!((0.9e6..=2.2e6).contains(&comparison), "comparison at {comparison} Hz");
        comparison * n / p
    }

    /// Clocks of the internal oscillator between two captures: a crystal that is divided, and by eight.
    fn interval(&self) -> f64 {
        let divider = f64::from(self.cfgr >> 16 & 31);
        divider * 8.0 * INTERNAL_HZ * self.internal / self.crystal
    }

    /// Captures until now, if everything is set up for them.
    fn captures(&self) -> u64 {
        const OR: usize = 20;
        let [ccmr, ccer] = [self.timer[6], self.timer[8]];
        // CC1S 01, IC1PSC 11; CC1E; TI1_RMP 10; the timer's clock; a crystal that runs.
        let set = ccmr & 0b1111 == 0b1101 && ccer & 1 != 0 && self.timer[OR] & 3 == 2;
        let runs = self.cr & HSE_ON != 0 && self.crystal > 0.0 && self.apb2enr >> 18 & 1 != 0;
        match self.counting {
            Some(since) if set && runs => ((self.now - since) as f64 / self.interval()) as u64,
            _ => 0,
        }
    }

    fn control(&mut self) -> u32 {
        if self.started.is_some_and(|since| self.now - since > START) && self.crystal > 0.0 {
            self.cr |= HSE_READY;
        }
        self.cr = self.cr & !PLL_READY | (self.cr & PLL_ON) << 1;
        self.cr
    }

    pub fn read(&mut self, address: u32) -> u32 {
        self.now += ACCESS;
        let (base, offset) = (address & !0x3FF, address & 0x3FF);
        match (base, offset) {
            (RCC, 0x00) => self.control(),
            (RCC, 0x04) => self.pllcfgr,
            // SWS follows SW.
            (RCC, 0x08) => self.cfgr & !0b1100 | (self.cfgr & 3) << 2,
            (RCC, 0x44) => self.apb2enr,
            (RCC, 0x74) => self.causes,
            (RCC, _) => 0,
            (FLASH, _) => self.acr,
            (DBGMCU, _) => self.revision << 16 | 0x6413,
            (TIM11, 0x10) => {
                let captures = self.captures();
                self.overtaken |= captures > self.seen + 1 && self.seen > 0;
                u32::from(captures > self.seen) << 1 | u32::from(self.overtaken) << 9
            }
            (TIM11, 0x34) => {
                self.seen = self.captures();
                (self.seen as f64 * self.interval()) as u32 & 0xFFFF
            }
            (TIM11, _) => self.timer[(offset / 4) as usize],
            _ => panic!("{address:#x} is not modelled"),
        }
    }

    pub fn write(&mut self, address: u32, value: u32) {
        self.now += ACCESS;
        let (base, offset) = (address & !0x3FF, address & 0x3FF);
        match (base, offset) {
            (RCC, 0x00) => {
                const READY: u32 = HSI_READY | HSE_READY | PLL_READY;
                assert!(value & 1 != 0, "the internal oscillator stays on");
                self.cr = value & !READY | self.cr & READY;
                self.started = (value & HSE_ON != 0).then(|| self.started.unwrap_or(self.now));
            }
            // Locked while the PLL is on (section 7.3.2).
            (RCC, 0x04) if self.cr & PLL_ON == 0 => self.pllcfgr = value,
            (RCC, 0x08) => self.switch(value),
            (RCC, 0x30) => self.ports = value & 0xF,
            (RCC, 0x44) => self.apb2enr = value,
            (RCC, 0x74) if value & CLEARS_CAUSES != 0 => self.causes = 0,
            (RCC, _) => {}
            (FLASH, _) => self.acr = value,
            (TIM11, 0x00) => {
                self.counting = (value & 1 != 0).then_some(self.now);
                self.timer[0] = value;
            }
            (TIM11, _) => self.timer[(offset / 4) as usize] = value,
            _ => panic!("{address:#x} is not modelled"),
        }
    }

    /// The core never runs faster than its flash allows, nor a bus faster than it may: RM0090 table 10, section 7.2.
    fn switch(&mut self, value: u32) {
        self.cfgr = value;
        if value & 3 == 2 {
            assert!(self.cr & PLL_ON != 0, "the PLL runs before the switch");
        }
        let [core, apb1, apb2] = self.hertz();
        assert!(core <= 168e6 * 1.1 && apb1 <= 42e6 * 1.1 && apb2 <= 84e6 * 1.1, "{core} {apb1} {apb2}");
        assert!(
            core <= 30e6 * 1.1 * f64::from((self.acr & 7) + 1),
            "{core} Hz with {} wait states",
            self.acr & 7
        );
    }
}
