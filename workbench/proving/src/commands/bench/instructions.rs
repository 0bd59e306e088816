//! Instructions of this process, where processor and system count them.

#[cfg(target_os = "linux")]
use perf_event::{Builder, Counter, events::Hardware};

/// A counter of user instructions of all threads that begin after it.
pub struct Instructions {
    #[cfg(target_os = "linux")]
    counter: Option<std::cell::RefCell<Counter>>,
}

impl Instructions {
    /// Begins to count, or finds that nothing counts here: a virtual machine without counters, a system that forbids it.
    #[cfg(target_os = "linux")]
    pub fn begin() -> Self {
        let counter = Builder::new(Hardware::INSTRUCTIONS).inherit(true).build().ok();
        let enabled = counter.and_then(|mut counter| counter.enable().ok().map(|()| counter));
        Self { counter: enabled.map(std::cell::RefCell::new) }
    }

    /// So far.
    #[cfg(target_os = "linux")]
    pub fn read(&self) -> Option<u64> {
        self.counter.as_ref()?.borrow_mut().read().ok()
    }

    /// Other systems are not asked.
    #[cfg(not(target_os = "linux"))]
    pub fn begin() -> Self {
        Self {}
    }

    /// Not counted.
    #[cfg(not(target_os = "linux"))]
    pub fn read(&self) -> Option<u64> {
        None
    }
}
