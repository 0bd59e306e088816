//! Functions and code of a linked image.

use crate::constants::Constants;
use crate::thumb::{self, Flow};
use anyhow::{Context, Result};
use object::{Object, ObjectSection, ObjectSymbol, SectionKind, SymbolKind};
use std::collections::BTreeMap;
use std::path::Path;

/// One function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Demangled, without the hash.
    pub name: String,
    /// First address.
    pub start: u32,
    /// First address behind it.
    pub end: u32,
}

/// One branch that leaves its function.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Address of the instruction.
    pub at: u32,
    /// Where to; `None`: a register says.
    pub to: Option<u32>,
}

/// The code of an image.
pub struct Image {
    functions: BTreeMap<u32, Function>,
    /// Start → is it code? From the mapping symbols `$t` and `$d`.
    kinds: BTreeMap<u32, bool>,
    /// Start and bytes of every section with code.
    sections: Vec<(u32, Vec<u8>)>,
}

impl Image {
    /// Reads an ELF.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).with_context(|| format!("cannot read {}", path.display()))?;
        let file =
            object::File::parse(&*bytes).with_context(|| format!("{} is not an ELF", path.display()))?;
        let mut image = Image { functions: BTreeMap::new(), kinds: BTreeMap::new(), sections: Vec::new() };
        for section in file.sections().filter(|section| section.kind() == SectionKind::Text) {
            image.sections.push((section.address() as u32, section.data()?.to_vec()));
        }
        for symbol in file.symbols() {
            let name = symbol.name().unwrap_or_default();
            let address = symbol.address() as u32;
            match name.get(..2) {
                Some("$t") => drop(image.kinds.insert(address & !1, true)),
                Some("$d") => drop(image.kinds.insert(address & !1, false)),
                _ if symbol.kind() == SymbolKind::Text && symbol.size() > 0 => {
                    image.add(name, address & !1, symbol.size() as u32);
                }
                _ => {}
            }
        }
        Ok(image)
    }

    fn add(&mut self, name: &str, start: u32, size: u32) {
        let name = format!("{:#}", rustc_demangle::demangle(name));
        let end = start + size;
        self.functions.insert(start, Function { name, start, end });
    }

    /// The function with this name.
    pub fn named(&self, name: &str) -> Option<&Function> {
        self.functions.values().find(|function| function.name == name)
    }

    /// The function that holds this address.
    pub fn at(&self, address: u32) -> Option<&Function> {
        let (_, function) = self.functions.range(..=address).next_back()?;
        (address < function.end).then_some(function)
    }

    /// What leaves a function, in the order of addresses.
    pub fn branches(&self, function: &Function) -> Vec<Branch> {
        let inside = |to: u32| (function.start..function.end).contains(&to);
        let mut constants = Constants::default();
        let leaving = |(at, first, second)| {
            constants.follow(at, first, second, |address| self.word(address));
            match thumb::flow(at, first, second) {
                Flow::To(to) if !inside(to) => Some(Branch { at, to: Some(to) }),
                Flow::Register => {
                    // Lowest bit: Thumb code. Only where a function begins.
                    let constant = constants.get(first >> 3).map(|to| to & !1);
                    Some(Branch { at, to: constant.filter(|to| self.functions.contains_key(to)) })
                }
                Flow::To(_) | Flow::On => None,
            }
        };
        self.instructions(function).filter_map(leaving).collect()
    }

    /// Bytes of stack that a function takes at most.
    pub fn frame(&self, function: &Function) -> u32 {
        self.instructions(function).map(|(_, first, second)| thumb::pushed(first, second)).sum()
    }

    /// Address and halfwords of every instruction; the second is 0 for instructions of 2 bytes.
    fn instructions(&self, function: &Function) -> impl Iterator<Item = (u32, u16, u16)> {
        let (mut at, end) = (function.start, function.end);
        std::iter::from_fn(move || {
            while at < end && !self.is_code(at) {
                at += 2;
            }
            let (here, first) = (at, self.half(at));
            let length = thumb::length(first);
            let second = if length == 4 { self.half(here + 2) } else { 0 };
            at += length;
            (here < end).then_some((here, first, second))
        })
    }

    fn is_code(&self, address: u32) -> bool {
        self.kinds.range(..=address).next_back().is_none_or(|(_, code)| *code)
    }

    fn word(&self, address: u32) -> u32 {
        u32::from(self.half(address)) | u32::from(self.half(address + 2)) << 16
    }

    fn half(&self, address: u32) -> u16 {
        let byte = |address: u32| {
            self.sections.iter().find_map(|(start, bytes)| {
                address.checked_sub(*start).and_then(|offset| bytes.get(offset as usize).copied())
            })
        };
        u16::from_le_bytes([byte(address).unwrap_or(0), byte(address + 1).unwrap_or(0)])
    }
}
