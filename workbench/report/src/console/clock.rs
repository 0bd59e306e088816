//! The clock that the engine's searches are timed by.

use nix::sys::resource::{UsageWho, getrusage};
use std::sync::LazyLock;
use std::time::Instant;
use truing_core::gap::effort::{self, Time};

static STARTED: LazyLock<Instant> = LazyLock::new(Instant::now);

/// From now on results tell how long they took.
pub fn install() {
    LazyLock::force(&STARTED);
    effort::time_by(|| Time { wall_us: STARTED.elapsed().as_micros() as u64, cpu_us: cpu_us() });
}

/// CPU time of this process so far, user and system, all threads, µs; 0 where the system does not tell.
fn cpu_us() -> u64 {
    getrusage(UsageWho::RUSAGE_SELF).map_or(0, |usage| {
        let [user, system] = [usage.user_time(), usage.system_time()];
        let micros = (user.tv_sec() + system.tv_sec()) * 1_000_000 + (user.tv_usec() + system.tv_usec());
        micros.unsigned_abs()
    })
}
