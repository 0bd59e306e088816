//! What the winding current tells: whether a shaft that is not seen to move turns nevertheless.
//!
//! ```text
//! ∫v dt = R·∫i dt + L·Δi + K·Δθ
//! ```
//!
//! holds over any stretch of time, whatever friction and load do (`K·Δθ`: integral of the back-EMF; `v`: what an input
//! dead zone of the drive leaves of the terminal voltage). While the encoder follows, all of it is measured, and the
//! three constants are learned by least squares. When it does not follow, the same equation tells the travel that the encoder withholds:
//! none in a stall, all that is expected if it is unplugged. Without current at all, the motor is disconnected.

use super::fault::Fault;
use super::motion::Missing;

/// The equation is integrated over 1/16 s: shorter stretches would drown the rise of the current, by which the
/// inductance is found, in the noise of its two ends; longer ones see too little of a short commissioning.
const BLOCKS_PER_S: u32 = 16;
/// Number of constants: R, K, L.
const N: usize = 3;
/// Fraction bits of voltages here, nominal supply.
const VOLTAGE_BITS: u32 = 14;
/// Blocks after which the sums are halved: what was learned long ago fades.
const LIFE: u32 = 1024;
/// Blocks needed before the constants are solved for.
const ENOUGH: u32 = 24;
/// Share of its own size that must be left of a column after those before it, or it is not told apart from them.
const LEAST_PIVOT: f32 = 1e-3;
/// Share of the squared voltage that the equation may leave unexplained: 5 % rms.
const MOST_RESIDUAL: f32 = 2.5e-3;
/// Relative variance of R and K with which they are believed: 2 %, one standard deviation.
const MOST_VARIANCE: f32 = 4e-4;
/// Voltage above which a drive may have reached its limit, Q14: 0.66 of nominal, as the identifier's gate has it.
const MOST_VOLTAGE: i32 = 10_813;
/// Counts that a block must see: an encoder that says nothing teaches nothing.
const LEAST_COUNTS: i32 = 2;
/// Blocks in a row in which current and counter must disagree: 0.4 s.
const LASTING_BLOCKS: u32 = 6;
/// Voltage that must drive a current, Q14: 1/16 of nominal.
const LEAST_VOLTAGE: i32 = 1 << (VOLTAGE_BITS - 4);
/// Relative uncertainty of R and L as a shift: 1/32.
const UNCERTAIN_SHIFT: u32 = 5;
/// Ticks over which the unrest of the current is averaged, as a shift.
const UNREST_BITS: u32 = 6;
/// Counts from which on an undecided case is given up.
const GIVE_UP_COUNTS: i32 = 20;
/// Share of the current of a shaft at standstill that a connected motor draws in any case, as a shift: 1/16.
const NO_CURRENT_SHIFT: u32 = 4;

/// The learned constants, in voltages Q14, converter counts and ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Winding {
    /// R: voltage per converter count, Q16.
    resistance: i32,
    /// K: voltage · ticks per count, Q8.
    emf: i32,
    /// L: voltage · ticks per converter count, Q8.
    inductance: i32,
}

/// What one tick, or a stretch of them, adds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Stretch {
    voltage: i32,
    current: i32,
    /// Current and counter when it began.
    first: (i32, i32),
    ticks: u32,
}

impl Stretch {
    fn begin(current: i16, count: i32) -> Self {
        Self {
            first: (i32::from(current), count),
            ..Self::default()
        }
    }

    fn add(&mut self, voltage: i32, current: i16) {
        self.voltage = self.voltage.saturating_add(voltage);
        self.current = self.current.saturating_add(i32::from(current));
        self.ticks = self.ticks.wrapping_add(1);
    }
}

/// What is remembered between ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct State {
    block: Stretch,
    /// Since the last proof that the encoder follows.
    doubt: Stretch,
    /// Current of the last tick, and how much it differs from tick to tick, Q4: noise, and more while it rises.
    last: i16,
    unrest: i32,
    /// The block is not to be learned from.
    spoilt: bool,
    /// What the last blocks looked like, and how many of them in a row.
    doubted: Fault,
    odd: u32,
    blocks: u32,
    /// Upper triangle of the normal matrix, row by row, and the right-hand side.
    normal: [i64; N * (N + 1) / 2],
    right: [i64; N],
    /// Σ of the squared left-hand side.
    square: i64,
    known: Option<Winding>,
}

impl State {
    /// One tick: `voltage` acted (Q14; `None`: bridge open), `current` flowed, the counter reads `count`. `fresh`: the
    /// encoder has just proved that it follows, or nothing is demanded of it.
    pub fn step(&mut self, block_ticks: u32, voltage: Option<i32>, current: i16, count: i32, fresh: bool) {
        let acting = voltage.unwrap_or(0);
        // With an open bridge the voltage is not known, and beyond its limit the drive does not deliver what is asked.
        self.spoilt |= voltage.is_none_or(|voltage| voltage.saturating_abs() > MOST_VOLTAGE);
        let change = i32::from(current)
            .saturating_sub(i32::from(self.last))
            .saturating_abs();
        self.unrest = self
            .unrest
            .saturating_add((change << 4).saturating_sub(self.unrest) >> UNREST_BITS);
        self.last = current;
        self.block.add(acting, current);
        self.doubt.add(acting, current);
        if fresh {
            self.doubt = Stretch::begin(current, count);
        }
        if self.block.ticks >= block_ticks {
            self.learn(current, count);
            self.block = Stretch::begin(current, count);
            self.spoilt = false;
        }
    }

    fn learn(&mut self, current: i16, count: i32) {
        let block = &self.block;
        let turned = count.wrapping_sub(block.first.1);
        if self.spoilt {
            return;
        }
        if let Some(winding) = &self.known {
            let found = winding.compare(block, turned, current);
            self.odd = if found == self.doubted {
                self.odd.saturating_add(1)
            } else {
                1
            };
            self.doubted = found;
        }
        if turned.saturating_abs() < LEAST_COUNTS {
            return;
        }
        let rise = i32::from(current).saturating_sub(block.first.0);
        let row = [block.current, turned, rise];
        let mut places = self.normal.iter_mut();
        for (k, (&a, right)) in (0..N).zip(row.iter().zip(&mut self.right)) {
            *right = right.saturating_add(product(a, block.voltage));
            for (&b, place) in row.iter().skip(k).zip(&mut places) {
                *place = place.saturating_add(product(a, b));
            }
        }
        self.square = self.square.saturating_add(product(block.voltage, block.voltage));
        self.blocks = self.blocks.saturating_add(1);
        if self.blocks >= LIFE {
            self.blocks /= 2;
            self.square /= 2;
            self.normal
                .iter_mut()
                .chain(&mut self.right)
                .for_each(|sum| *sum /= 2);
        }
    }

    /// What current and counter have looked like for some time.
    pub fn lasting(&self) -> Fault {
        if self.odd >= LASTING_BLOCKS {
            self.doubted
        } else {
            Fault::None
        }
    }

    /// Forgets what only looked like a fault.
    pub fn clear(&mut self) {
        self.odd = 0;
        self.doubt = Stretch::default();
    }

    /// Begins anew: the voltage means something else from now on.
    pub fn forget(&mut self) {
        *self = Self::default();
    }

    /// Solves for the constants, if there is enough to solve. In single precision: not in every tick.
    pub fn solve(&mut self) {
        if self.blocks < ENOUGH {
            return;
        }
        // Twice, so that R and K each stand last once: only there the elimination tells how well a number is known.
        let (found, of_emf) = solve(&self.normal, &self.right, [0, 2, 1]);
        let (_, of_resistance) = solve(&self.normal, &self.right, [1, 2, 0]);
        let explained = found
            .iter()
            .zip(&self.right)
            .fold(0.0, |sum, (x, &right)| sum + x * right as f32);
        let whole = self.square as f32;
        let left = (whole - explained).max(0.0);
        let variance = left / (self.blocks as f32 - N as f32);
        let [resistance, emf, inductance] = found;
        let known = |value: f32, information: f32| {
            value > 0.0 && variance < MOST_VARIANCE * value * value * information
        };
        // A reversed encoder, or one that is not the motor's, gives no winding; nor does a drive with a law of its own.
        if known(resistance, of_resistance) && known(emf, of_emf) && left < MOST_RESIDUAL * whole {
            let fixed = |value: f32, bits: u32| crate::units::to_fixed(value, bits);
            self.known = Some(Winding {
                resistance: fixed(resistance, 16),
                emf: fixed(emf, 8),
                inductance: fixed(inductance.max(0.0), 8),
            });
        }
    }

    /// Tells stall, unplugged encoder and disconnected motor apart. `None`: not yet.
    pub fn judge(&self, missing: &Missing, current: i16) -> Option<Fault> {
        let Some(winding) = &self.known else {
            return Some(Fault::NoMotion);
        };
        let verdict = winding.judge(&self.doubt, missing, current, self.unrest);
        verdict.or((missing.expected >= GIVE_UP_COUNTS).then_some(Fault::NoMotion))
    }
}

impl Winding {
    /// Integral of the voltage behind the drive, and the part of it that resistance and inductance take.
    fn balance(&self, stretch: &Stretch, current: i16) -> (i64, i64) {
        let offered = i64::from(stretch.voltage);
        let rise = i32::from(current).saturating_sub(stretch.first.0);
        let resistive = product(stretch.current, self.resistance) >> 16;
        let inductive = product(rise, self.inductance) >> 8;
        (offered, resistive.saturating_add(inductive))
    }

    /// A block: does the counter show the speed that the current shows, within a quarter of the voltage and two counts?
    /// A counter that stands is for [`State::judge`].
    fn compare(&self, block: &Stretch, turned: i32, current: i16) -> Fault {
        let (offered, taken) = self.balance(block, current);
        let emf = product(turned, self.emf) >> 8;
        let jitter = i64::from(self.emf >> 7);
        let lack = offered.saturating_sub(taken).saturating_sub(emf);
        let allowed = (offered.abs().max(emf.abs()) >> 2).saturating_add(jitter);
        let lacking = offered.saturating_sub(emf).saturating_abs();
        let driven = i64::from(LEAST_VOLTAGE).wrapping_mul(i64::from(block.ticks));
        if lacking > driven.saturating_add(jitter) && taken.saturating_abs() < lacking >> NO_CURRENT_SHIFT {
            return Fault::MotorDisconnected;
        }
        if lack.saturating_abs() <= allowed || turned.saturating_abs() < LEAST_COUNTS {
            return Fault::None;
        }
        let backwards = offered.saturating_sub(taken).signum() == -emf.signum();
        if backwards {
            Fault::WrongDirection
        } else {
            Fault::SlippingCounts
        }
    }

    fn judge(&self, doubt: &Stretch, missing: &Missing, current: i16, unrest: i32) -> Option<Fault> {
        let direction = i64::from(missing.direction);
        let (offered, taken) = self.balance(doubt, current);
        let (offered, taken) = (direction * offered, direction * taken);
        let emf = offered.saturating_sub(taken);
        let expected = product(missing.expected, self.emf) >> 8;
        // The ends of the stretch are single readings: twice the mean difference of two is 1.6 standard deviations.
        let ends = product(unrest, self.inductance) >> (8 + 4 - 1);
        let doubtful = (taken.abs() >> UNCERTAIN_SHIFT).saturating_add(ends);
        match () {
            () if taken.abs() < offered >> NO_CURRENT_SHIFT
                && emf.saturating_sub(doubtful) > expected.saturating_mul(2) =>
            {
                Some(Fault::MotorDisconnected)
            }
            () if emf.saturating_add(doubtful) < expected / 2 => Some(Fault::Stalled),
            () if emf.saturating_sub(doubtful) > expected / 2 => Some(Fault::EncoderUnplugged),
            () => None,
        }
    }
}

fn product(a: i32, b: i32) -> i64 {
    i64::from(a).wrapping_mul(i64::from(b))
}

/// Solves the normal equations by elimination in this order. A column that those before it explain gives zero. Second:
/// what is left of the last column's square, its information.
fn solve(normal: &[i64; N * (N + 1) / 2], right: &[i64; N], order: [usize; N]) -> ([f32; N], f32) {
    let element = |a: usize, b: usize| {
        let (low, high) = (a.min(b), a.max(b));
        normal
            .get((low.wrapping_mul((2 * N - 1).wrapping_sub(low)) / 2).wrapping_add(high))
            .map_or(0.0, |&sum| sum as f32)
    };
    let mut rows: [[f32; N + 1]; N] = core::array::from_fn(|k| {
        core::array::from_fn(|j| match order.get(j) {
            Some(&column) => element(order[k], column),
            None => right.get(order[k]).map_or(0.0, |&sum| sum as f32),
        })
    });
    for k in 0..N {
        let pivot = rows[k];
        if pivot[k] <= LEAST_PIVOT * element(order[k], order[k]) {
            rows[k] = [0.0; N + 1];
            continue;
        }
        for row in rows.iter_mut().skip(k + 1) {
            let factor = row[k] / pivot[k];
            row.iter_mut()
                .zip(&pivot)
                .for_each(|(to, from)| *to -= factor * from);
        }
    }
    let mut found = [0.0; N];
    for k in (0..N).rev() {
        let row = rows[k];
        let rest = (k + 1..N).fold(row[N], |rest, j| rest - row[j] * found[order[j] % N]);
        found[order[k] % N] = if row[k] > 0.0 { rest / row[k] } else { 0.0 };
    }
    (found, rows[N - 1][N - 1])
}

/// Ticks of one stretch.
pub(crate) fn block_ticks(scale: &crate::config::Scale) -> u32 {
    (scale.config.tick_hz / BLOCKS_PER_S).max(1)
}

/// Voltage in the unit of this module.
pub(crate) const fn q14(voltage: crate::units::Voltage) -> i32 {
    voltage.0 >> (crate::units::VOLTAGE_BITS - VOLTAGE_BITS)
}
