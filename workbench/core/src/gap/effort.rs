//! How much work a search is: simulations, inner steps and passes, counted exactly. Counts do not depend on the number of threads or
//! on the machine's load, so they are what a budget can hold; see `truing bench`.
//!
//! A simulated run is added once, at its end. The counters belong to the process: of two searches at once they tell the sum.

use derive_more::{Add, Sub};
use std::sync::{LazyLock, Mutex, MutexGuard, OnceLock, PoisonError};

/// What the searches of this process computed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Add, Sub, serde::Serialize)]
pub struct Work {
    /// Sets of parameters that were simulated, each run of a record for itself.
    pub simulations: u64,
    /// Steps of the plant of one set.
    pub inner_steps: u64,
    /// Steps of a pack of sets that advance together. A pack of one set makes as many passes as inner steps.
    pub passes: u64,
}

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
#[derive(Clone, Copy, Debug, Default, Add, Sub, serde::Serialize)]
pub struct Spent {
    /// What was computed.
    #[serde(flatten)]
    pub work: Work,
    /// CPU time of all threads, s.
    pub cpu_s: f64,
    /// Time that passed, s.
    pub wall_s: f64,
}

/// The phase that a search is in, and what each has cost.
#[derive(Default)]
struct Counters {
    present: usize,
    phases: [Spent; Phase::ALL.len()],
    /// When the phase last changed; `None` before the first time.
    changed: Option<Time>,
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

static COUNTERS: LazyLock<Mutex<Counters>> = LazyLock::new(Mutex::default);

fn counters() -> MutexGuard<'static, Counters> {
    COUNTERS.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Adds a pack of sets that advanced together by so many steps.
pub fn simulated(sets: usize, steps: u64) {
    counters().add(sets as u64, steps);
}

/// Does something and counts it as this phase. Inside of another phase it counts as that one.
pub fn during<T>(phase: Phase, work: impl FnOnce() -> T) -> T {
    let began = counters().begin(phase);
    let made = work();
    if began {
        counters().end();
    }
    made
}

/// What each phase cost so far.
pub fn spent() -> [Spent; Phase::ALL.len()] {
    let mut counters = counters();
    counters.charge();
    counters.phases
}

impl Counters {
    fn add(&mut self, sets: u64, steps: u64) {
        let work = &mut self.phases[self.present].work;
        *work = *work + Work { simulations: sets, inner_steps: sets * steps, passes: steps };
    }

    fn begin(&mut self, phase: Phase) -> bool {
        self.charge();
        let base = self.present == Phase::Base as usize;
        if base {
            self.present = phase as usize;
        }
        base
    }

    fn end(&mut self) {
        self.charge();
        self.present = Phase::Base as usize;
    }

    /// Adds the time since the last change to the present phase.
    fn charge(&mut self) {
        let now = now();
        let then = self.changed.replace(now).unwrap_or(Time { wall_us: now.wall_us, cpu_us: 0 });
        let spent = &mut self.phases[self.present];
        spent.cpu_s += 1e-6 * now.cpu_us.saturating_sub(then.cpu_us) as f64;
        spent.wall_s += 1e-6 * now.wall_us.saturating_sub(then.wall_us) as f64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pack_of_sets_is_one_pass_a_step_and_the_outer_phase_counts() {
        assert!(Phase::ALL.iter().enumerate().all(|(place, phase)| *phase as usize == place));
        let mut counters = Counters::default();
        assert!(counters.begin(Phase::Settled));
        counters.add(4, 100);
        assert!(!counters.begin(Phase::Conclude));
        counters.add(1, 7);
        counters.end();
        counters.add(2, 5);
        let spent = counters.phases;
        let of = |phase: Phase| spent[phase as usize].work;
        assert_eq!(of(Phase::Settled), Work { simulations: 5, inner_steps: 407, passes: 107 });
        assert_eq!(of(Phase::Base), Work { simulations: 2, inner_steps: 10, passes: 5 });
        assert_eq!(of(Phase::Conclude), Work::default());
    }
}
