//! The loop below all interrupts: the board's own business, and the stored parameters.

use super::board::{AXES, Board, Idle};
use heapless::spsc::{Consumer, Producer};
use servo::drivers::saving::{Archive, Job, Report};

/// What the loop owns.
pub struct IdleTask<B: Board> {
    idle: B::Idle,
    archive: Archive<B::Flash, AXES>,
    jobs: Consumer<'static, Job>,
    reports: Producer<'static, Report>,
}

impl<B: Board> IdleTask<B> {
    /// Puts the parts together.
    pub fn new(
        idle: B::Idle,
        archive: Archive<B::Flash, AXES>,
        jobs: Consumer<'static, Job>,
        reports: Producer<'static, Report>,
    ) -> Self {
        IdleTask { idle, archive, jobs, reports }
    }

    /// Runs for ever.
    pub fn run(&mut self) -> ! {
        loop {
            self.idle.turn();
            self.store();
        }
    }

    /// A job holds the parameters of an axis: it is done where it lies.
    #[inline(always)]
    fn store(&mut self) {
        let Some(job) = self.jobs.peek() else { return };
        let report = self.idle.while_storing(|| self.archive.handle(job));
        let _ = self.jobs.dequeue();
        // One job is answered before the next one comes.
        report.map(|report| self.reports.enqueue(report));
    }
}
