//! The checked-in list: `function | panic | reason`, one a line; `#` begins a comment. A `*` at the end of a function or a
//! panic stands for anything.

use crate::walk::Finding;
use anyhow::{Result, bail};

/// One line of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Accepted {
    function: String,
    panic: String,
    /// Why it is accepted.
    pub reason: String,
}

impl Accepted {
    /// Does it speak of this finding?
    #[must_use]
    pub fn covers(&self, finding: &Finding) -> bool {
        matches(&self.function, &finding.function) && matches(&self.panic, &finding.panic)
    }

    /// For messages.
    #[must_use]
    pub fn text(&self) -> String {
        format!("{} | {}", self.function, self.panic)
    }
}

/// Reads the list.
pub fn parse(text: &str) -> Result<Vec<Accepted>> {
    let mut list = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.trim();
        if line.is_empty() || line.starts_with('#') {
            continue;
        }
        let [function, panic, reason] = line.split(" | ").collect::<Vec<_>>()[..] else {
            bail!("line {number} is not `function | panic | reason`: {line}");
        };
        list.push(Accepted {
            function: function.trim().into(),
            panic: panic.trim().into(),
            reason: reason.trim().into(),
        });
    }
    Ok(list)
}

fn matches(pattern: &str, name: &str) -> bool {
    match pattern.strip_suffix('*') {
        Some(start) => name.starts_with(start),
        None => pattern == name,
    }
}
