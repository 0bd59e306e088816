//! How much work a search is: simulations, inner steps and passes, counted exactly. Counts do not depend on the number of threads or
//! on the machine's load, so they are what a budget can hold; see `truing bench`.
//!
//! A simulated run is added once, at its end. The counters belong to the process: of two searches at once they tell the sum.

use std::ops::{Add, Sub};
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering::Relaxed};
use std::sync::{LazyLock, Mutex, OnceLock};

/// What the searches of this process computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Work {
    /// Sets of parameters that were simulated, each run of a record for itself.
    pub simulations: u64,
    /// Steps of the plant of one set.
    pub inner_steps: u64,
    /// Steps of a pack of sets that advance together. A pack of one set makes as many passes as inner steps.
    pub passes: u64,
}

/// Sums and differences, field by field.
macro_rules! field_by_field {
    ($type:ident: $($field:ident),+) => {
        impl Add for $type {
            type Output = Self;

            fn add(self, other: Self) -> Self {
                Self { $($field: self.$field + other.$field),+ }
            }
        }

        impl Sub for $type {
            type Output = Self;

            fn sub(self, earlier: Self) -> Self {
                Self { $($field: self.$field - earlier.$field),+ }
            }
        }
    };
}

field_by_field!(Work: simulations, inner_steps, passes);
field_by_field!(Spent: work, cpu_s, wall_s);

worded! {
    /// Part of a search.
    #[derive(Clone, Copy, Debug, PartialEq, Eq)]
    pub enum Phase: words {
        /// Reading, noise, the base's fit and whatever stands in no other phase.
        Base = "reading, noise, base",
        /// Promises of all candidates.
        Screen = "screen",
        /// The first, short fits of the candidates that promise most.
        FirstFits = "first fits",
        /// The longer fits of those that came furthest.
        LaterFits = "second and third fits",
        /// Evolution of a candidate with a rugged cost.
        Evolution = "evolution",
        /// Does a set pay for itself?
        Accept = "accept",
        /// Evolution of an accepted set.
        Settled = "settled",
        /// Richer and poorer forms.
        Forms = "forms",
        /// One name for another.
        Exchange = "exchange",
        /// Elimination and rivals, on the fine grid.
        Rivals = "elimination, rivals",
        /// Ties, steps, covariance, what the rest depends on, plots.
        Conclude = "conclude",
    }
}

/// What a phase, a search or several of them cost.
#[derive(Clone, Copy, Debug, Default, serde::Serialize)]
pub struct Spent {
    /// What was computed.
    #[serde(flatten)]
    pub work: Work,
    /// CPU time of all threads, s.
    pub cpu_s: f64,
    /// Time that passed, s.
    pub wall_s: f64,
}

/// What was counted in one phase.
#[derive(Default)]
struct Tally {
    simulations: AtomicU64,
    inner_steps: AtomicU64,
    passes: AtomicU64,
    cpu_us: AtomicU64,
    wall_us: AtomicU64,
}

/// The phase that a search is in, and what was counted in each.
#[derive(Default)]
struct Counters {
    present: AtomicUsize,
    tallies: [Tally; Phase::ALL.len()],
    /// When the phase last changed; `None` before the first time.
    changed: Mutex<Option<Time>>,
}

/// What a clock shows, µs.
#[derive(Clone, Copy, Debug, Default)]
pub struct Time {
    /// Since some moment.
    pub wall_us: u64,
    /// CPU time of this process, all threads.
    pub cpu_us: u64,
}

static CLOCK: OnceLock<fn() -> Time> = OnceLock::new();

/// Gives the engine a clock; it has none of its own. The first one counts.
pub fn time_by(clock: fn() -> Time) {
    CLOCK.get_or_init(|| clock);
}

/// What the clock shows; nothing without one.
pub(super) fn now() -> Time {
    CLOCK.get().map_or(Time::default(), |clock| clock())
}

static COUNTERS: LazyLock<Counters> = LazyLock::new(Counters::default);

/// Adds a pack of sets that advanced together by so many steps.
pub fn simulated(sets: usize, steps: u64) {
    COUNTERS.add(sets, steps);
}

/// Does something and counts it as this phase. Inside of another phase it counts as that one.
pub fn during<T>(phase: Phase, work: impl FnOnce() -> T) -> T {
    COUNTERS.during(phase, work)
}

/// What each phase cost so far.
pub fn spent() -> [Spent; Phase::ALL.len()] {
    COUNTERS.spent()
}

impl Counters {
    fn add(&self, sets: usize, steps: u64) {
        let tally = &self.tallies[self.present.load(Relaxed)];
        tally.simulations.fetch_add(sets as u64, Relaxed);
        tally.inner_steps.fetch_add(sets as u64 * steps, Relaxed);
        tally.passes.fetch_add(steps, Relaxed);
    }

    fn during<T>(&self, phase: Phase, work: impl FnOnce() -> T) -> T {
        self.charge();
        let base = Phase::Base as usize;
        let began = self.present.compare_exchange(base, phase as usize, Relaxed, Relaxed).is_ok();
        let made = work();
        if began {
            self.charge();
            self.present.store(base, Relaxed);
        }
        made
    }

    fn spent(&self) -> [Spent; Phase::ALL.len()] {
        self.charge();
        self.tallies.each_ref().map(|tally| {
            let work = Work {
                simulations: tally.simulations.load(Relaxed),
                inner_steps: tally.inner_steps.load(Relaxed),
                passes: tally.passes.load(Relaxed),
            };
            let [cpu_s, wall_s] = [&tally.cpu_us, &tally.wall_us].map(|us| 1e-6 * us.load(Relaxed) as f64);
            Spent { work, cpu_s, wall_s }
        })
    }

    /// Adds the time since the last change to the present phase.
    fn charge(&self) {
        let Ok(mut changed) = self.changed.lock() else { return };
        let now = now();
        let then = changed.unwrap_or(Time { wall_us: now.wall_us, cpu_us: 0 });
        let tally = &self.tallies[self.present.load(Relaxed)];
        tally.cpu_us.fetch_add(now.cpu_us.saturating_sub(then.cpu_us), Relaxed);
        tally.wall_us.fetch_add(now.wall_us.saturating_sub(then.wall_us), Relaxed);
        *changed = Some(now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pack_of_sets_is_one_pass_a_step_and_the_outer_phase_counts() {
        assert!(Phase::ALL.iter().enumerate().all(|(place, phase)| *phase as usize == place));
        let counters = Counters::default();
        counters.during(Phase::Settled, || {
            counters.add(4, 100);
            counters.during(Phase::Conclude, || counters.add(1, 7));
        });
        counters.add(2, 5);
        let spent = counters.spent();
        let of = |phase: Phase| spent[phase as usize].work;
        assert_eq!(of(Phase::Settled), Work { simulations: 5, inner_steps: 407, passes: 107 });
        assert_eq!(of(Phase::Base), Work { simulations: 2, inner_steps: 10, passes: 5 });
        assert_eq!(of(Phase::Conclude), Work::default());
    }
}
