//! Lines of code: those on which a token begins that is neither documentation nor part of a test module.

use proc_macro2::{Span, TokenStream, TokenTree};
use std::collections::BTreeSet;
use std::ops::RangeInclusive;
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Numbers of the lines of code, from 1. `tree` tells where the tests are.
pub fn lines(tokens: TokenStream, tree: &syn::File) -> BTreeSet<usize> {
    let mut tests = Tests(Vec::new());
    tests.visit_file(tree);
    let mut lines = of_tokens(tokens);
    lines.retain(|line| !tests.0.iter().any(|range| range.contains(line)));
    lines
}

/// Lines on which a token begins, without documentation. A text over several lines counts where it begins.
pub fn of_tokens(tokens: TokenStream) -> BTreeSet<usize> {
    let mut lines = BTreeSet::new();
    collect(tokens, &mut lines);
    lines
}

fn collect(tokens: TokenStream, lines: &mut BTreeSet<usize>) {
    let mut tokens = tokens.into_iter().peekable();
    while let Some(token) = tokens.next() {
        if is_hash(&token) {
            let inner =
                tokens.next_if(|next| matches!(next, TokenTree::Punct(mark) if mark.as_char() == '!'));
            if tokens.next_if(is_documentation).is_some() {
                continue;
            }
            lines.extend(inner.map(|mark| first(mark.span())));
        }
        lines.insert(first(token.span()));
        if let TokenTree::Group(group) = token {
            collect(group.stream(), lines);
            lines.insert(group.span_close().start().line);
        }
    }
}

fn first(span: Span) -> usize {
    span.start().line
}

fn is_hash(token: &TokenTree) -> bool {
    matches!(token, TokenTree::Punct(mark) if mark.as_char() == '#')
}

/// The brackets of `#[doc = "…"]`, which is what a documentation comment becomes.
fn is_documentation(token: &TokenTree) -> bool {
    let TokenTree::Group(group) = token else {
        return false;
    };
    let mut inside = group.stream().into_iter();
    matches!(inside.next(), Some(TokenTree::Ident(name)) if name == "doc")
        && matches!(inside.next(), Some(TokenTree::Punct(mark)) if mark.as_char() == '=')
}

/// Line ranges of what is built for tests alone.
struct Tests(Vec<RangeInclusive<usize>>);

impl<'a> Visit<'a> for Tests {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if is_test(item) {
            let span = item.span();
            self.0.push(span.start().line..=span.end().line);
        } else {
            visit::visit_item(self, item);
        }
    }
}

/// Whether an item is built for tests alone.
pub fn is_test(item: &syn::Item) -> bool {
    let attributes = match item {
        syn::Item::Mod(item) => &item.attrs,
        syn::Item::Fn(item) => &item.attrs,
        syn::Item::Impl(item) => &item.attrs,
        syn::Item::Use(item) => &item.attrs,
        syn::Item::Const(item) => &item.attrs,
        syn::Item::Static(item) => &item.attrs,
        _ => return false,
    };
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg")
            && attribute.parse_args::<syn::Path>().is_ok_and(|condition| condition.is_ident("test"))
    })
}

#[cfg(test)]
mod tests {
    fn count(text: &str) -> usize {
        super::lines(text.parse().unwrap(), &syn::parse_file(text).unwrap()).len()
    }

    #[test]
    fn comments_documentation_blank_lines_and_tests_are_no_code() {
        let text = "//! A file.\n\n/// One.\n#[inline]\nfn one() -> u8 {\n    // Why.\n    1\n}\n\n\
                    #[cfg(test)]\nmod tests {\n    #[test]\n    fn two() {}\n}\n";
        assert_eq!(count(text), 4);
    }

    #[test]
    fn a_text_over_lines_counts_where_it_begins_and_what_follows_it() {
        assert_eq!(count("const A: &str = \"a\nb\nc\";\n"), 2);
    }
}
