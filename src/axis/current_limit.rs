//! The current limit: the voltage is lowered where the winding would draw more.
//!
//! The voltage that acted around the last sample is what the measured current `i` has followed from, back-EMF included. Whatever that
//! is, so much more or less brings the current to the limit `I`:
//!
//! ```text
//! acted − c·R·(I + i)  ≤  v  ≤  acted + c·R·(I − i)        c ≤ 1
//! ```
//!
//! With `c = 1` a winding without inductance is at its limit in one step. One whose current lags would be driven beyond, so `c`
//! is chosen for [`LAG_HZ`]: the voltage then changes as fast as the current of such a winding follows. Beyond the limit it is lowered
//! faster. The law needs the voltage that acts and not the one that was wanted, so delay of the PWM and clips elsewhere cannot wind it up.
//!
//! `R·I` is not known before a current has flowed. Until then little is believed, the voltage rises slowly, and more is believed as long as
//! hardly any current follows. It is measured whenever the voltage acts almost without back-EMF: at every start from rest. Half
//! or twice of the true one does no harm.

use crate::config::Scale;
use crate::units::{Voltage, mul_shift};

/// Rate at which the voltage follows, Hz: a winding that lags by 2 ms overshoots by a quarter of the limit, one of 8 ms by a third to a half
/// for 4 ms (simulated, 1 to 20 kHz, delays of one to three ticks, limits of 10 to 200 % of the stall current).
const LAG_HZ: u32 = 625;
/// Beyond the limit it follows faster by this shift, but no faster than by half.
const FASTER: u32 = 2;
/// Fraction bits of currents, in units of the limit.
const BITS: u32 = 12;
const ONE: i32 = 1 << BITS;
/// `R·I` that is believed before it is measured, Q20 of nominal: 1/32. Full voltage is then reached in 0.1 s.
const FIRST_DROP: i32 = Voltage::NOMINAL.0 / 32;
/// The least and the most that is ever believed.
const LEAST_DROP: i32 = FIRST_DROP / 4;
const MOST_DROP: i32 = Voltage::NOMINAL.0 * 4;
/// Ticks over which it is averaged, as a shift.
const DROP_SHIFT: u32 = 4;
/// Converter counts from which on a current tells something, and so many ticks with such a current until it has.
const LEAST_COUNTS: u16 = 4;
const ENOUGH: u8 = 2 << DROP_SHIFT;
/// Share of the limit that a voltage which is held back must drive, or more is believed: a quarter.
const LITTLE: i32 = ONE / 4;
/// Time in which what is believed grows by the factor e, over that in which the voltage follows, as a shift.
const GROWTH_SHIFT: u32 = 2;
/// Back-EMF that may be there meanwhile, share of the voltage as a shift: a quarter. Rated speed is right within 30 %.
const MOST_EMF: u32 = 2;

/// A limit that is in force.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Params {
    /// One converter count in units of the limit, Q20.
    per_count: i32,
    /// Half of the limit, converter counts.
    half: u16,
    /// `c` below the limit, as a shift.
    shift: u32,
}

/// What is remembered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct State {
    /// `R·I`, Q20 of nominal.
    drop: i32,
    /// Change of the voltage that a current of at most half the limit allows in any case, Q20 of nominal.
    free: u32,
    /// Ticks in which `R·I` was measured, until they are enough.
    measured: u8,
}

impl Default for State {
    fn default() -> Self {
        Self { drop: FIRST_DROP, free: 0, measured: 0 }
    }
}

impl Params {
    /// `None`: the current is not limited.
    #[cold]
    #[inline(never)]
    pub fn new(scale: &Scale) -> Option<Self> {
        let config = &scale.config;
        let limit = (config.current_limit_a.get()? / config.current_a_per_lsb).max(1.0);
        let fits = |shift: &u32| config.tick_hz >> shift <= LAG_HZ * 3 / 2;
        Some(Self {
            per_count: ((1u32 << 20) as f32 / limit) as i32,
            half: (limit / 2.0) as u16,
            shift: (1..5).find(fits).unwrap_or(5),
        })
    }

    /// Is nothing to be done? The current is at most half of the limit, and what is wanted takes it no further than the rest. `acts`: from
    /// now to the next tick.
    #[inline]
    pub fn allows(&self, state: &State, current_raw: i16, acts: Option<Voltage>, wanted: Voltage) -> bool {
        let change = wanted.0.wrapping_sub(acts.unwrap_or_default().0);
        current_raw.unsigned_abs() <= self.half && change.unsigned_abs() <= state.free
    }

    /// The voltage within the limit. `acted`: around this tick; `current`: raw, of this tick, `None`: there is none to be limited.
    pub fn bound(
        &self,
        state: &mut State,
        current: Option<i16>,
        acted: Voltage,
        emf: Voltage,
        wanted: Voltage,
    ) -> Voltage {
        let Some(current) = current else {
            state.free = 0;
            return wanted;
        };
        let share = mul_shift(i32::from(current), self.per_count, 20 - BITS);
        if current.unsigned_abs() >= LEAST_COUNTS {
            state.measure(share, acted, emf);
        }
        if state.measured >= ENOUGH {
            state.free = (state.drop / 2).unsigned_abs() >> (self.shift & 31);
        }
        let room = |left: i32| {
            let faster = if left < 0 { FASTER } else { 0 };
            let shift = self.shift.saturating_sub(faster).max(1);
            Voltage(mul_shift(state.drop >> (shift & 31), left, BITS))
        };
        let highest = acted.plus(room(ONE.saturating_sub(share)));
        let lowest = acted.minus(room(ONE.saturating_add(share)));
        // Between nothing and the back-EMF there is a voltage without current: more than that only a sensor asks for that reads
        // backwards, and it would ask for ever more.
        let idle = emf.plus(Voltage(emf.0 / 2));
        let least = wanted.min(Voltage::ZERO).min(idle);
        let most = wanted.max(Voltage::ZERO).max(idle);
        let held = wanted.min(highest).max(lowest).max(least).min(most);
        if held != wanted && share.saturating_abs() < LITTLE {
            state.believe((state.drop >> GROWTH_SHIFT) >> (self.shift & 31));
        }
        held
    }
}

impl State {
    /// Voltage and current of a winding that shows hardly any back-EMF.
    fn measure(&mut self, share: i32, acted: Voltage, emf: Voltage) {
        let sign = share.signum();
        let [acted, emf] = [acted, emf].map(|voltage| voltage.0.saturating_mul(sign));
        if emf.saturating_abs() > acted >> MOST_EMF {
            return;
        }
        let error =
            acted.saturating_sub(emf).saturating_sub(mul_shift(self.drop, share.saturating_abs(), BITS));
        self.measured = self.measured.saturating_add(1);
        self.believe(error >> DROP_SHIFT);
    }

    fn believe(&mut self, more: i32) {
        self.drop = self.drop.saturating_add(more).clamp(LEAST_DROP, MOST_DROP);
    }
}
