//! The paths that a file names, each from the root of its package.

use crate::code::is_test;
use crate::source::Source;
use proc_macro2::TokenStream;
use std::collections::BTreeSet;
use syn::parse::Parser;
use syn::punctuated::Punctuated;
use syn::visit::{self, Visit};
use syn::{Expr, Token, UseTree};

/// Names from the root of the package, e.g. `["gap", "samples", "Samples"]`.
pub type Names = Vec<String>;

/// Every path of the file that leads into its own package. `module` is the file's own place in there; `package` is the
/// name under which a second package of the same folder (the image) knows the first (the library), or the package's own.
pub fn of(source: &Source, module: &[String], package: &str) -> BTreeSet<Names> {
    let mut finder =
        Finder { module: module.to_vec(), package, children: children(&source.tree), found: BTreeSet::new() };
    finder.visit_file(&source.tree);
    finder.found
}

/// Modules that a file declares: a path may begin with one of them.
fn children(tree: &syn::File) -> BTreeSet<String> {
    let modules = tree.items.iter().filter_map(|item| match item {
        syn::Item::Mod(module) => Some(module.ident.to_string()),
        _ => None,
    });
    modules.collect()
}

struct Finder<'p> {
    module: Names,
    package: &'p str,
    children: BTreeSet<String>,
    found: BTreeSet<Names>,
}

impl Finder<'_> {
    /// Adds a path as it is written, if it leads into the package.
    fn add(&mut self, written: &[String]) {
        let supers = written.iter().take_while(|name| *name == "super").count();
        let rest = written[supers..].to_vec();
        let base = match written.first().map(String::as_str) {
            Some("crate") => return self.insert(&[], &rest[1..]),
            Some("self") => return self.insert(&self.module.clone(), &rest[1..]),
            Some("super") => self.module[..self.module.len().saturating_sub(supers)].to_vec(),
            Some(first) if first == self.package => return self.insert(&[], &rest[1..]),
            Some(first) if self.children.contains(first) => self.module.clone(),
            _ => return,
        };
        self.insert(&base, &rest);
    }

    fn insert(&mut self, base: &[String], rest: &[String]) {
        self.found.insert([base, rest].concat());
    }

    fn import(&mut self, before: &[String], tree: &UseTree) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        match tree {
            UseTree::Path(path) => self.import(&with(&path.ident), &path.tree),
            UseTree::Name(name) if name.ident == "self" => self.add(before),
            UseTree::Name(name) => self.add(&with(&name.ident)),
            UseTree::Rename(rename) => self.add(&with(&rename.ident)),
            UseTree::Glob(_) => self.add(before),
            UseTree::Group(group) => group.items.iter().for_each(|item| self.import(before, item)),
        }
    }

    /// Arguments of a macro that are expressions, as those of `format!` and `assert!` are.
    fn arguments(&mut self, tokens: TokenStream) {
        let list = Punctuated::<Expr, Token![,]>::parse_terminated;
        if let Ok(arguments) = list.parse2(tokens) {
            arguments.iter().for_each(|argument| self.visit_expr(argument));
        }
    }
}

impl<'a> Visit<'a> for Finder<'_> {
    fn visit_item(&mut self, item: &'a syn::Item) {
        if !is_test(item) {
            visit::visit_item(self, item);
        }
    }

    /// A module within the file.
    fn visit_item_mod(&mut self, module: &'a syn::ItemMod) {
        self.module.push(module.ident.to_string());
        visit::visit_item_mod(self, module);
        self.module.pop();
    }

    fn visit_item_use(&mut self, item: &'a syn::ItemUse) {
        self.import(&[], &item.tree);
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        let names: Names = path.segments.iter().map(|part| part.ident.to_string()).collect();
        if names.len() > 1 {
            self.add(&names);
        }
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'a syn::Macro) {
        self.arguments(call.tokens.clone());
        visit::visit_macro(self, call);
    }
}
