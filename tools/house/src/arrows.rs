//! Which file and which room uses which other.

use crate::parts::top_room;
use crate::paths::{self, Names};
use crate::source::Source;
use petgraph::algo::tarjan_scc;
use petgraph::graphmap::DiGraphMap;
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// From whom to whom.
pub type Arrow<'n> = (&'n str, &'n str);

/// A package below one folder, and who uses whom in it.
pub struct Package {
    /// Its rooms.
    pub rooms: BTreeSet<String>,
    /// From room to room: the files that make the arrow.
    pub arrows: BTreeMap<(String, String), BTreeSet<PathBuf>>,
    /// From file to file.
    files: BTreeSet<(String, String)>,
}

impl Package {
    /// Reads who uses whom in `folder`. `name`: what the package is called in its own programs; of a room, with its path behind.
    pub fn of(folder: &str, name: &str, sources: &[&Source]) -> Self {
        let folder = Path::new(folder);
        let (name, room) =
            name.split_once("::").map_or((name, None), |(name, room)| (name, Some(room.to_owned())));
        let modules: BTreeMap<Names, &Path> =
            sources.iter().map(|source| (module(&source.path, folder), source.path.as_path())).collect();
        let mut package = Self {
            rooms: sources.iter().filter_map(|source| top_room(&source.path, folder)).collect(),
            arrows: BTreeMap::new(),
            files: BTreeSet::new(),
        };
        for source in sources {
            let own = module(&source.path, folder);
            for path in paths::of(source, &own, name) {
                let inside = path.strip_prefix(room.as_slice()).unwrap_or(&path);
                package.add(source, &own, inside, &modules);
            }
        }
        package
    }

    fn add(&mut self, source: &Source, own: &[String], path: &[String], modules: &BTreeMap<Names, &Path>) {
        let (Some(from), Some(to)) = (own.first(), path.first()) else {
            return;
        };
        if !self.rooms.contains(to) {
            return;
        }
        if from != to {
            let arrow = (from.clone(), to.clone());
            let files = self.arrows.entry(arrow).or_default();
            files.insert(source.path.clone());
        }
        let Some((target, _)) = target(path, modules) else {
            return;
        };
        // A folder and what lies in it belong together.
        if !target.starts_with(own) && !own.starts_with(target) {
            self.files.insert((own.join("::"), target.join("::")));
        }
    }

    /// Rooms that reach one another.
    pub fn circles(&self) -> Vec<Vec<&str>> {
        circles(self.arrows.keys().map(|(from, to)| (from.as_str(), to.as_str())))
    }

    /// Files that reach one another, as modules; a folder's own file and the files in it do not count.
    pub fn file_circles(&self) -> Vec<Vec<&str>> {
        circles(self.files.iter().map(|(from, to)| (from.as_str(), to.as_str())))
    }
}

/// The module that a path leads into: the longest one that is a file.
fn target<'m>(path: &[String], modules: &'m BTreeMap<Names, &Path>) -> Option<(&'m Names, &'m Path)> {
    let lengths = (1..=path.len()).rev();
    let mut found = lengths.filter_map(|length| modules.get_key_value(&path[..length]));
    found.next().map(|(names, file)| (names, *file))
}

/// A file's place in the package: `gap/search/mod.rs` is `gap::search`.
fn module(path: &Path, folder: &Path) -> Names {
    let inside = path.strip_prefix(folder).unwrap_or(path).with_extension("");
    let names = inside.iter().map(|name| name.to_string_lossy().into_owned());
    names.filter(|name| !["mod", "lib", "main"].contains(&name.as_str())).collect()
}

/// Groups of two and more names that reach one another.
fn circles<'n>(arrows: impl Iterator<Item = Arrow<'n>>) -> Vec<Vec<&'n str>> {
    let graph: DiGraphMap<&str, ()> = arrows.map(|(from, to)| (from, to, ())).collect();
    let mut groups = tarjan_scc(&graph);
    groups.retain(|group| group.len() > 1);
    for group in &mut groups {
        group.sort_unstable();
    }
    groups.sort_unstable();
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_rooms_that_use_one_another_are_a_circle() {
        let arrows = [("a", "b"), ("b", "c"), ("c", "b"), ("d", "a")];
        assert_eq!(circles(arrows.into_iter()), [["b", "c"]]);
    }

    #[test]
    fn a_file_s_place_is_its_path() {
        let place = |path: &str| module(Path::new(path), Path::new("src")).join("::");
        assert_eq!(place("src/gap/search/mod.rs"), "gap::search");
        assert_eq!(place("src/lib.rs"), "");
        assert_eq!(place("src/units.rs"), "units");
    }
}
