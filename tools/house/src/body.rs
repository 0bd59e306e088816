//! Lengths of functions: lines of code between the braces, without tests.

use crate::code::is_test;
use crate::source::Source;
use syn::visit::{self, Visit};

/// One function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Function {
    /// Its name, and where it stands: `path:line`.
    pub name: String,
    /// Lines of code between its braces.
    pub length: usize,
}

/// The functions of a file.
pub fn functions(source: &Source) -> Vec<Function> {
    let mut finder = Finder { source, found: Vec::new() };
    finder.visit_file(&source.tree);
    finder.found
}

struct Finder<'s> {
    source: &'s Source,
    found: Vec<Function>,
}

impl Finder<'_> {
    fn add(&mut self, signature: &syn::Signature, body: &syn::Block) {
        let (open, close) = (body.brace_token.span.open(), body.brace_token.span.close());
        let (begin, end) = (open.start().line, close.start().line);
        let length = match begin == end {
            true => body.stmts.len().min(1),
            false => self.source.code.range(begin + 1..end).count(),
        };
        self.found.push(Function {
            name: format!("{} {}:{begin}", signature.ident, self.source.path.display()),
            length,
        });
    }
}

impl<'a> Visit<'a> for Finder<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if !is_test(item) {
            visit::visit_item(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'a syn::ItemFn) {
        self.add(&item.sig, &item.block);
        visit::visit_item_fn(self, item);
    }

    fn visit_impl_item_fn(&mut self, item: &'a syn::ImplItemFn) {
        self.add(&item.sig, &item.block);
        visit::visit_impl_item_fn(self, item);
    }

    fn visit_trait_item_fn(&mut self, item: &'a syn::TraitItemFn) {
        if let Some(body) = &item.default {
            self.add(&item.sig, body);
        }
        visit::visit_trait_item_fn(self, item);
    }
}

/// Median, 90 % and longest of the lengths; nothing without functions.
pub fn spread(functions: &[Function]) -> Option<[usize; 3]> {
    let mut lengths: Vec<usize> = functions.iter().map(|function| function.length).collect();
    lengths.sort_unstable();
    let at = |share: f64| lengths[(share * (lengths.len() - 1) as f64).round() as usize];
    (!lengths.is_empty()).then(|| [at(0.5), at(0.9), at(1.0)])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn median_and_tail_of_eleven_functions() {
        let functions: Vec<Function> =
            (0..11).map(|length| Function { name: String::new(), length }).collect();
        assert_eq!(spread(&functions), Some([5, 9, 10]));
        assert_eq!(spread(&[]), None);
    }
}
