//! How deep the stack can get: the frames along the deepest chain of direct calls from a function of the image.
//!
//! An upper bound for everything that is called directly: a frame is all that a function ever takes off the stack pointer,
//! and a branch that leaves a function counts as a call. What ends in a panic is left out, for it ends the program with the
//! bridge off. A call by register cannot be followed; those that the walk met are counted.

use crate::image::{Function, Image};
use crate::walk::panics;
use anyhow::{Result, anyhow, bail};
use std::collections::{BTreeMap, BTreeSet};

/// What the core puts on the stack when it enters an interrupt: 26 words with the floating-point registers (ARMv7-M
/// Architecture Reference Manual, B1.5.7), and one more to align it.
pub const EXCEPTION_FRAME: u32 = 27 * 4;

/// The deepest chain of calls.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Depth {
    /// Bytes.
    pub bytes: u32,
    /// Functions with their frames, outermost first.
    pub chain: Vec<(String, u32)>,
}

/// Depths of an image.
pub struct Depths<'a> {
    image: &'a Image,
    known: BTreeMap<u32, Depth>,
    open: BTreeSet<u32>,
    /// Places of calls that could not be followed.
    pub by_register: BTreeSet<u32>,
}

impl<'a> Depths<'a> {
    /// Nothing looked at yet.
    #[must_use]
    pub fn new(image: &'a Image) -> Self {
        Depths { image, known: BTreeMap::new(), open: BTreeSet::new(), by_register: BTreeSet::new() }
    }

    /// The deepest chain from the function with this name.
    pub fn from(&mut self, name: &str) -> Result<Depth> {
        let function = self.image.named(name).ok_or_else(|| anyhow!("the image has no function {name}"))?;
        self.of(function)
    }

    fn of(&mut self, function: &Function) -> Result<Depth> {
        if let Some(depth) = self.known.get(&function.start) {
            return Ok(depth.clone());
        }
        if !self.open.insert(function.start) {
            bail!("{} calls itself: its stack has no bound", function.name);
        }
        let mut deepest = Depth::default();
        for branch in self.image.branches(function) {
            let Some(to) = branch.to else {
                self.by_register.insert(branch.at);
                continue;
            };
            if let Some(callee) = self.image.at(to).filter(|callee| !panics(callee)) {
                let depth = self.of(callee)?;
                if depth.bytes > deepest.bytes {
                    deepest = depth;
                }
            }
        }
        self.open.remove(&function.start);
        let frame = self.image.frame(function);
        deepest.bytes += frame;
        deepest.chain.insert(0, (function.name.clone(), frame));
        self.known.insert(function.start, deepest.clone());
        Ok(deepest)
    }
}
