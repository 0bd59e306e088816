//! What the winding current tells: whether a shaft that is not seen to move turns nevertheless.
//!
//! ```text
//! ∫v dt = R·∫i dt + L·Δi + K·Δθ
//! ```
//!
//! holds over any stretch of time, whatever friction and load do (`K·Δθ`: integral of the back-EMF; `v`: what an input
//! dead zone of the drive leaves of the terminal voltage). While the encoder follows, all of it is measured, and the
//! three constants are learned by least squares ([`super::balance`]). When it does not follow, the same equation tells the
//! travel that the encoder withholds: none in a stall, all that is expected if it is unplugged. Without current at all,
//! the motor is disconnected.

mod standing;

use super::balance::{self, Constants};
use super::fault::Fault;
use super::gather::Averages;
use super::looks::looks;
use super::motion::{Fresh, Missing};
use crate::config::Scale;
use crate::identify::gate::LINEAR_LIMIT;
use crate::units::{VOLTAGE_BITS, Voltage, mul_shift};
use standing::Standing;

/// The equation is integrated over 1/16 s: shorter stretches would drown the rise of the current, by which the
/// inductance is found, in the noise of its two ends; longer ones see too little of a short commissioning.
const BLOCKS_PER_S: f32 = 16.0;
/// A missing current shows in a quarter of that.
const GLANCES_PER_BLOCK: u32 = 4;
/// Fraction bits of voltages here, nominal supply.
const WINDING_BITS: u32 = 14;
/// Voltage above which a drive may have reached its limit, Q14: as the identifier's gate has it.
const MOST_VOLTAGE: i32 = LINEAR_LIMIT;
const _: () = assert!(WINDING_BITS == 14, "the gate's limit is Q14");
/// Counts that a block must see: an encoder that says nothing teaches nothing.
const LEAST_COUNTS: i32 = 2;
/// Blocks in a row in which current and counter must disagree: 0.4 s.
const LASTING_BLOCKS: u32 = 6;
/// Glances in a row in which the current must be missing: 47 ms.
const LASTING_GLANCES: u32 = 3;
/// Voltage that must drive a current, Q14: 1/16 of nominal.
const LEAST_VOLTAGE: i32 = 1 << (WINDING_BITS - 4);
/// Relative uncertainty of R and L as a shift where the motor must move in any case: 1/32.
const UNCERTAIN_SHIFT: u32 = 5;
/// The same where friction may hold it, sixteenths: 3/16. A winding that warms up by 45 K gains so much, and a stalled one must not
/// look like one that turns.
const DOUBTFUL_SIXTEENTHS: i32 = 3;
/// Both as shares, Q16: the resistance of this very moment is taken where it is less uncertain.
const UNCERTAIN: i32 = 1 << (16 - UNCERTAIN_SHIFT);
const DOUBTFUL: i32 = DOUBTFUL_SIXTEENTHS << (16 - 4);
/// Relative uncertainty of what an input dead zone takes, as a shift: 1/8.
const SWALLOWED_SHIFT: u32 = 3;
/// Share of what an input dead zone takes that a block must have left to teach, as a shift: 1/2. What is not known of the dead
/// zone is then a quarter of it at most. In slow motion it was all of it: K came out four times too large, and a current was
/// missed that must not flow.
const LEFT_SHIFT: u32 = 1;
/// Counts of the likely model from which on a motion is looked for whose resistance is not known of this very moment.
const LEAST_LIKELY: i32 = 8;
/// Looks over which the unrest of the current is averaged, as a shift.
const UNREST_BITS: u32 = 5;
/// Half of the divisor, for rounding: cut off, a converter count of noise in four would go unseen.
const UNREST_HALF: i32 = 1 << (UNREST_BITS - 1);
/// Variance of the difference of two normal readings over the square of its mean magnitude, π/2, Q16; the unrest is Q4.
const VARIANCE_OF_UNREST: i32 = 102_944 >> 8;
/// Counts that show, together with a back-EMF, that the counter runs backwards.
const BACKWARDS_COUNTS: i32 = -2;
/// Longest L/R, share of a block as a shift: 1/4, 16 ms.
const SLOW_SHARE: u32 = 2;
/// Ticks between two looks, as a shift, from which on the second of them takes over what else makes the next look long. Others
/// need those that are left: the identification does nothing else in either of the two.
const SPREAD_BITS: u32 = 2;
/// Share of the current of a shaft at standstill that a connected motor draws in any case, as a shift: 1/16.
const NO_CURRENT_SHIFT: u32 = 4;

/// Lengths of the stretches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Params {
    /// Ticks of a look, as a shift.
    look_bits: u32,
    /// Looks of a glance.
    glance: u32,
}

/// What a stretch of time sums up.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Stretch {
    /// Q14 of nominal · ticks.
    voltage: i32,
    /// What the drive's dead zone has swallowed, the same unit.
    swallowed: i32,
    /// Converter counts · ticks.
    current: i32,
    /// Current and counter when it began.
    first: (i32, i32),
    ticks: u32,
}

/// The two sides of the equation. What a stretch sums up stays within 31 bits and so do the constants: products shifted by 8 or more
/// leave 9 bits for their sums, which therefore need not saturate.
#[derive(Clone, Copy, Debug)]
struct Balance {
    /// Integral of the voltage behind the drive.
    offered: i64,
    /// What resistance and inductance take of it.
    resistive: i64,
    inductive: i64,
    /// What noise of the current's two ends makes of it, 1.6 standard deviations.
    ends: i64,
    /// That, and what is not known of the drive's dead zone.
    unsure: i64,
}

impl Stretch {
    #[inline]
    fn begin(current: i32, count: i32) -> Self {
        Self { first: (current, count), ..Self::default() }
    }

    #[inline]
    fn add(&mut self, other: &Self) {
        self.voltage = self.voltage.saturating_add(other.voltage);
        self.swallowed = self.swallowed.saturating_add(other.swallowed);
        self.current = self.current.saturating_add(other.current);
        self.ticks = self.ticks.wrapping_add(other.ticks);
    }

    #[inline]
    fn turned(&self, count: i32) -> i32 {
        count.wrapping_sub(self.first.1)
    }

    /// Is its voltage known well enough?
    #[inline]
    fn teaches(&self) -> bool {
        self.voltage.saturating_abs() >= self.swallowed >> LEFT_SHIFT
    }
}

impl Balance {
    #[inline]
    fn taken(&self) -> i64 {
        self.resistive.wrapping_add(self.inductive)
    }

    /// Back-EMF that is left.
    #[inline]
    fn emf(&self) -> i64 {
        self.offered.wrapping_sub(self.taken())
    }

    /// A share of the larger part: each constant errs by itself.
    #[inline]
    fn share(&self, shift: u32) -> i64 {
        self.resistive.wrapping_abs().max(self.inductive.wrapping_abs()) >> (shift & 63)
    }

    /// As seen from the other direction.
    #[inline]
    fn towards(self, direction: i32) -> Self {
        let sign = i64::from(direction);
        Self {
            offered: self.offered.wrapping_mul(sign),
            resistive: self.resistive.wrapping_mul(sign),
            inductive: self.inductive.wrapping_mul(sign),
            ..self
        }
    }

    /// May the current be missing that must balance `lacking`? What it changes by may be noise.
    #[inline]
    fn silent(&self, lacking: i64) -> bool {
        let least = lacking >> NO_CURRENT_SHIFT;
        self.resistive.wrapping_abs() < least
            && self.inductive.wrapping_abs() <= least.max(self.ends.wrapping_mul(2))
    }

    /// Is it missing? The current of a large winding passes through zero so slowly that, for a while, noise hides its
    /// rise: the stretch must be so long that it cannot.
    #[inline]
    fn without_current(&self, lacking: i64) -> bool {
        self.silent(lacking) && self.ends.wrapping_mul(2) <= lacking >> NO_CURRENT_SHIFT
    }
}

/// What is remembered between looks.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct State {
    glance: Stretch,
    block: Stretch,
    /// Since the last proof that the encoder follows: since the likely model travels, and since the sure one does. What
    /// is not known of R grows with time, and before the sure one starts nothing is demanded.
    doubts: [Stretch; 2],
    standing: Standing,
    /// Current of the last look, and how much it differs from look to look, Q4: noise, and more while it rises.
    last: i32,
    unrest: i32,
    /// The bridge was open in this glance.
    open: bool,
    /// The block is not to be learned from.
    spoilt: bool,
    /// Current and counter at the end of a block that is to be learned from.
    ended: Option<(i32, i32)>,
    /// A tick between this look and the next one may go on with what takes long.
    due: bool,
    looks: u32,
    /// Counter at the end of a glance that is to be heeded.
    glanced: Option<i32>,
    glances: u32,
    /// Glances in a row without current, what they sum up, and whether that is beyond its noise.
    silent: u32,
    silence: Stretch,
    certain: bool,
    /// What the last blocks looked like, and how many of them in a row.
    doubted: Fault,
    odd: u32,
    balance: balance::State,
    known: Option<Winding>,
}

/// The learned winding.
#[derive(Clone, Copy, Debug)]
struct Winding {
    constants: Constants,
    /// Its current needs so long for a change ([`SLOW_SHARE`]) that noise at the ends of a block decides what L is: it
    /// shows whether there is a current, not the back-EMF.
    slow: bool,
}

impl State {
    /// What current and counter have looked like for some time.
    #[inline]
    pub fn lasting(&self) -> Fault {
        if self.certain && self.silent >= LASTING_GLANCES {
            Fault::MotorDisconnected
        } else if self.odd >= LASTING_BLOCKS {
            self.doubted
        } else {
            Fault::None
        }
    }

    /// Forgets what only looked like a fault.
    pub fn clear(&mut self) {
        (self.odd, self.silent, self.certain) = (0, 0, false);
    }

    /// The bridge is open, and nobody looks for a while: of what goes on now nothing is learned.
    #[inline]
    pub fn rest(&mut self) {
        (self.open, self.spoilt) = (true, true);
    }

    /// Begins anew: the voltage means something else from now on.
    #[inline]
    pub fn forget(&mut self) {
        // Without `..`, so that no new field is forgotten.
        let Self {
            glance,
            block,
            doubts,
            standing,
            last,
            unrest,
            open,
            spoilt,
            ended,
            due,
            looks,
            glanced,
            glances,
            silent,
            silence,
            certain,
            doubted,
            odd,
            balance,
            known,
        } = self;
        let [likely, sure] = doubts;
        for stretch in [glance, block, likely, sure, silence] {
            *stretch = Stretch::default();
        }
        (*last, *unrest, *looks, *glances, *silent, *odd) = (0, 0, 0, 0, 0, 0);
        (*open, *spoilt, *due, *certain) = (false, false, false, false);
        (*ended, *glanced, *doubted, *known) = (None, None, Fault::None, None);
        *standing = Standing::default();
        balance.forget();
    }

    /// Tells stall, unplugged encoder and disconnected motor apart. `None`: not yet.
    #[inline]
    pub fn judge(&self, missing: &Missing, current: i16, count: i32) -> Option<Fault> {
        let overdue = missing.sure > 0;
        let Some(winding) = &self.known else {
            return match (overdue, missing.reversed) {
                (_, true) => Some(Fault::WrongDirection),
                (true, false) => Some(Fault::NoMotion),
                (false, false) => None,
            };
        };
        let verdict = winding.judge(self, missing, (i32::from(current), count));
        verdict.or((missing.sure >= missing.enough).then_some(Fault::NoMotion))
    }
}

impl Params {
    pub fn new(scale: &Scale) -> Self {
        let (look_hz, look_bits) = looks(scale);
        Self { look_bits, glance: ((look_hz / (BLOCKS_PER_S * GLANCES_PER_BLOCK as f32)) as u32).max(1) }
    }

    #[inline]
    fn winding(&self, constants: Constants) -> Winding {
        let block = self.glance.wrapping_mul(GLANCES_PER_BLOCK) << (self.look_bits & 15);
        // L is Q8, R is Q16.
        let lag = i64::from(constants.inductance) << (16 - 8 + SLOW_SHARE);
        Winding { constants, slow: lag > product(constants.resistance, block as i32) }
    }

    /// One look: `voltage` acted at the winding (`None`: bridge open), the current was `averages` and is `current`, the
    /// counter reads `count`.
    #[inline]
    pub fn step(
        &self,
        state: &mut State,
        averages: &Averages,
        voltage: Option<Voltage>,
        current: i16,
        count: i32,
        fresh: Fresh,
    ) {
        let current = i32::from(current);
        let q14 = |voltage: Voltage| voltage.0 >> (VOLTAGE_BITS - WINDING_BITS);
        let acting = voltage.map_or(0, q14);
        let terminal = averages.voltage.map_or(0, q14);
        let look = Stretch {
            voltage: acting << (self.look_bits & 15),
            swallowed: terminal.saturating_sub(acting).saturating_abs() << (self.look_bits & 15),
            current: averages.current,
            first: (0, 0),
            ticks: 1 << (self.look_bits & 15),
        };
        // With an open bridge the voltage is not known, and beyond its limit the drive does not deliver what is asked.
        state.open |= voltage.is_none();
        state.spoilt |= acting.saturating_abs() > MOST_VOLTAGE;
        let change = current.saturating_sub(state.last).saturating_abs();
        state.unrest = state.unrest.saturating_add(
            (change << 4).saturating_sub(state.unrest).saturating_add(UNREST_HALF) >> UNREST_BITS,
        );
        state.last = current;
        state.glance.add(&look);
        for (doubt, fresh) in state.doubts.iter_mut().zip([fresh.likely, fresh.sure]) {
            if fresh {
                *doubt = Stretch::begin(current, count);
            } else {
                doubt.add(&look);
            }
        }
        if fresh.stood && state.standing.heeds(&look) {
            state.standing.step(&look, (current, count), fresh);
        }
        state.looks = state.looks.wrapping_add(1);
        if state.looks >= self.glance {
            state.looks = 0;
            state.glanced = Some(count);
        }
        if !self.spreads() {
            self.go_on(state);
        }
        state.due = self.spreads()
            && (state.glanced.is_some()
                || state.ended.is_some()
                || state.balance.works()
                || state.standing.is_over());
    }

    /// Are there ticks enough between two looks for what takes long?
    #[inline]
    pub fn spreads(&self) -> bool {
        self.look_bits >= SPREAD_BITS
    }

    /// A tick between two looks: what would otherwise make the next one long.
    #[cold]
    #[inline]
    pub fn between(&self, state: &mut State) {
        state.due = false;
        self.go_on(state);
    }

    /// Heeds the last glance, weighs the resistance of a shaft that stood, learns from the last block, or takes the solution a step
    /// further.
    #[cold]
    #[inline]
    fn go_on(&self, state: &mut State) {
        if let Some(count) = state.glanced.take() {
            state.glance(state.last, count);
        } else if state.standing.is_over() {
            let [likely, _] = &state.doubts;
            state.standing.weigh(state.known.as_ref(), likely.first.0, state.unrest);
        } else if let Some((current, count)) = state.ended.take() {
            state.learn(current, count);
        } else if let Some(constants) = state.balance.step() {
            state.known = Some(self.winding(constants));
        }
    }
}

impl State {
    /// Has the last look left something to the ticks before the next one?
    #[inline]
    pub fn is_due(&self) -> bool {
        self.due
    }

    #[cold]
    #[inline(never)]
    fn glance(&mut self, current: i32, count: i32) {
        let glance = core::mem::replace(&mut self.glance, Stretch::begin(current, count));
        self.listen(&glance, current, count);
        self.spoilt |= core::mem::take(&mut self.open);
        if self.glances == 0 {
            self.block = glance;
        } else {
            self.block.add(&glance);
        }
        self.glances = self.glances.wrapping_add(1);
        if self.glances >= GLANCES_PER_BLOCK {
            self.glances = 0;
            let spoilt = core::mem::take(&mut self.spoilt);
            self.ended = (!spoilt).then_some((current, count));
        }
    }

    /// Is there silence, and does it last? Each glance must be silent, and all of them together.
    #[inline]
    fn listen(&mut self, glance: &Stretch, current: i32, count: i32) {
        let Some(winding) = &self.known else { return };
        if self.silent == 0 {
            self.silence = *glance;
        } else {
            self.silence.add(glance);
        }
        let quiet = |stretch| winding.draws_nothing(stretch, current, count, self.unrest);
        let hushed = if self.open { None } else { quiet(glance) };
        match hushed.and(quiet(&self.silence)) {
            Some(certain) => (self.silent, self.certain) = (self.silent.saturating_add(1), certain),
            None => (self.silent, self.certain) = (0, false),
        }
    }

    #[cold]
    #[inline]
    fn learn(&mut self, current: i32, count: i32) {
        let block = &self.block;
        let turned = block.turned(count);
        if let Some(winding) = &self.known {
            let found = winding.compare(block, count, current, self.unrest);
            self.odd = if found == self.doubted { self.odd.saturating_add(1) } else { 1 };
            self.doubted = found;
        }
        if turned.saturating_abs() >= LEAST_COUNTS && block.teaches() {
            let rise = current.saturating_sub(block.first.0);
            self.balance.add([block.current, turned, rise, block.voltage], noise(self.unrest));
        }
    }
}

impl Winding {
    #[inline]
    fn balance(&self, stretch: &Stretch, current: i32, unrest: i32) -> Balance {
        let rise = current.saturating_sub(stretch.first.0);
        // The ends of the stretch are single readings: twice the mean difference of two is 1.6 standard deviations.
        let ends = product(unrest, self.constants.inductance) >> (8 + 4 - 1);
        Balance {
            offered: i64::from(stretch.voltage),
            resistive: product(stretch.current, self.constants.resistance) >> 16,
            inductive: product(rise, self.constants.inductance) >> 8,
            ends,
            unsure: ends.wrapping_add(i64::from(stretch.swallowed >> SWALLOWED_SHIFT)),
        }
    }

    /// Back-EMF of so many counts.
    #[inline]
    fn shown(&self, turned: i32) -> i64 {
        product(turned, self.constants.emf) >> 8
    }

    /// Back-EMF of two counts: edges are not where they should be.
    #[inline]
    fn jitter(&self) -> i64 {
        i64::from(self.constants.emf >> 7)
    }

    /// Should a current flow, and does none? `Some(true)`: beyond noise.
    #[inline]
    fn draws_nothing(&self, stretch: &Stretch, current: i32, count: i32, unrest: i32) -> Option<bool> {
        let balance = self.balance(stretch, current, unrest);
        let lacking = self.driven(stretch, &balance, count)?;
        balance.silent(lacking).then(|| balance.without_current(lacking))
    }

    /// Voltage that must drive a current, because no back-EMF balances it; `None`: there is none to speak of.
    #[inline]
    fn driven(&self, stretch: &Stretch, balance: &Balance, count: i32) -> Option<i64> {
        let emf = self.shown(stretch.turned(count));
        let lacking = balance.offered.wrapping_sub(emf).wrapping_abs();
        let least = i64::from(LEAST_VOLTAGE).wrapping_mul(i64::from(stretch.ticks));
        (lacking > least.wrapping_add(self.jitter())).then_some(lacking)
    }

    /// A block: does the counter show the speed that the current shows, within a quarter of the voltage and two counts?
    /// A counter that stands is for [`State::judge`].
    #[inline]
    fn compare(&self, block: &Stretch, count: i32, current: i32, unrest: i32) -> Fault {
        let balance = self.balance(block, current, unrest);
        let driven = self.driven(block, &balance, count);
        if driven.is_some_and(|lacking| balance.without_current(lacking)) {
            return Fault::MotorDisconnected;
        }
        if self.slow {
            return Fault::None;
        }
        let turned = block.turned(count);
        let emf = self.shown(turned);
        let allowed =
            (balance.offered.wrapping_abs().max(emf.wrapping_abs()).max(balance.inductive.wrapping_abs())
                >> 2)
                .wrapping_add(self.jitter())
                .wrapping_add(balance.unsure);
        let lack = balance.emf().wrapping_sub(emf);
        if lack.wrapping_abs() <= allowed || turned.saturating_abs() < LEAST_COUNTS {
            return Fault::None;
        }
        if balance.emf().signum() == -emf.signum() { Fault::WrongDirection } else { Fault::SlippingCounts }
    }

    /// Where the sure model has not travelled yet, only evidence counts: a back-EMF, or motion backwards.
    #[cold]
    #[inline(never)]
    fn judge(&self, state: &State, missing: &Missing, end: (i32, i32)) -> Option<Fault> {
        let overdue = missing.sure > 0;
        let (current, count) = end;
        let unrest = state.unrest;
        let [likely, sure] = &state.doubts;
        let doubt = if overdue { sure } else { likely };
        let mut balance = self.balance(doubt, current, unrest);
        // What the encoder has shown of the motion is not missing.
        balance.offered = balance.offered.wrapping_sub(self.shown(doubt.turned(count)));
        let mut balance = balance.towards(missing.direction);
        let expected = self.shown(if overdue { missing.sure } else { missing.likely });
        let most = if overdue { UNCERTAIN } else { DOUBTFUL };
        let present = state.standing.present(count).filter(|present| missing.stood && present.slack < most);
        let uncertain = match present {
            Some(present) => present.applied(&mut balance),
            None if overdue => balance.share(UNCERTAIN_SHIFT),
            None => balance.share(4).wrapping_mul(i64::from(DOUBTFUL_SIXTEENTHS)),
        };
        let uncertain = uncertain.wrapping_add(balance.unsure);
        let (most, least) = (balance.emf().wrapping_add(uncertain), balance.emf().wrapping_sub(uncertain));
        // Shifted: an image that is small divides 64 bits by calling for 900 bytes more.
        let half = expected >> 1;
        // So soon only this very moment's resistance can tell.
        let soon = !overdue && missing.likely < LEAST_LIKELY;
        if soon && (present.is_none() || missing.followed < 0) {
            None
        } else if balance.without_current(balance.offered) && least > expected.wrapping_mul(2) {
            Some(Fault::MotorDisconnected)
        } else if missing.reversed {
            Some(Fault::WrongDirection)
        } else if self.slow {
            None
        } else if least > half && missing.followed <= BACKWARDS_COUNTS {
            Some(Fault::WrongDirection)
        } else if overdue && most < half {
            Some(Fault::Stalled)
        } else if missing.sure >= missing.enough && most < expected - (expected >> 3) {
            // It does not get better: a shaft that turns has made as many counts at least.
            Some(Fault::Stalled)
        } else if least > half {
            Some(Fault::EncoderUnplugged)
        } else {
            None
        }
    }
}

/// Variance of the difference of two readings.
#[inline]
fn noise(unrest: i32) -> i32 {
    mul_shift(unrest.saturating_mul(unrest), VARIANCE_OF_UNREST, 16)
}

#[inline]
fn product(a: i32, b: i32) -> i64 {
    i64::from(a).wrapping_mul(i64::from(b))
}
