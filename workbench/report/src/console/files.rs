//! The files of one command line: nothing that is written may replace what is read, or what the same command writes.

use same_file::is_same_file;
use std::path::{Path, PathBuf};
use truing_core::text::input_error::InputError;

/// A file and the option that names it.
struct File {
    option: &'static str,
    path: PathBuf,
}

/// What a command reads and what it writes.
#[derive(Default)]
pub struct Files {
    read: Vec<File>,
    written: Vec<File>,
}

impl Files {
    /// Files that the command reads; standard input is none.
    #[must_use]
    pub fn reads(mut self, option: &'static str, paths: impl IntoIterator<Item: AsRef<Path>>) -> Self {
        self.read.extend(listed(option, paths).filter(|file| file.path != Path::new("-")));
        self
    }

    /// Files that the command writes. Two places of one option may be the same: they get the same content.
    #[must_use]
    pub fn writes(mut self, option: &'static str, paths: impl IntoIterator<Item: AsRef<Path>>) -> Self {
        self.written.extend(listed(option, paths));
        self
    }

    /// Refuses a command that would replace a file of its own. To be asked before any work is done.
    pub fn check(&self) -> Result<(), InputError> {
        for (place, output) in self.written.iter().enumerate() {
            if let Some(input) = self.read.iter().find(|input| output.is(input)) {
                return Err(output.refused(&format!("would replace the input of {}", input.option)));
            }
            let mut earlier = self.written[..place].iter();
            if let Some(other) = earlier.find(|other| other.option != output.option && output.is(other)) {
                return Err(output.refused(&format!("is written by {} too", other.option)));
            }
        }
        Ok(())
    }

    /// The same for a command that moves a motor: besides, every output can be written, so that nothing is lost at the end.
    pub fn check_ready(&self) -> Result<(), InputError> {
        self.check()?;
        self.written.iter().try_for_each(File::ready)
    }
}

fn listed(option: &'static str, paths: impl IntoIterator<Item: AsRef<Path>>) -> impl Iterator<Item = File> {
    paths.into_iter().map(move |path| File { option, path: path.as_ref().to_owned() })
}

impl File {
    /// Links of both kinds lead to the same file. One that does not exist yet is known by its folder and its name.
    fn is(&self, other: &File) -> bool {
        is_same_file(&self.path, &other.path)
            .unwrap_or_else(|_| place(&self.path).is_some_and(|own| Some(own) == place(&other.path)))
    }

    /// The folder exists and takes a file, and nothing but a file is replaced.
    fn ready(&self) -> Result<(), InputError> {
        if self.path == Path::new("-") {
            return Ok(());
        }
        let refused = |what: String| {
            let named = format!("{} {}", self.option, self.path.display());
            Err(InputError::file(named, what))
        };
        let folder = folder_of(&self.path);
        if !folder.is_dir() {
            return refused(format!("the folder {} does not exist; make it first", folder.display()));
        }
        if self.path.exists() && !self.path.is_file() {
            return refused("is no file that can be replaced; name another one".into());
        }
        if let Err(error) = tempfile::tempfile_in(folder) {
            return refused(format!("cannot be written ({error}); check the folder's permissions and space"));
        }
        Ok(())
    }

    fn refused(&self, why: &str) -> InputError {
        let remedy = format!("{why}; name another place for {}", self.option);
        InputError::file(self.path.display(), remedy)
    }
}

/// The folder of a file.
pub fn folder_of(path: &Path) -> &Path {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    folder.unwrap_or(Path::new("."))
}

/// Folder without links, and name. `None`: there is no such folder.
fn place(path: &Path) -> Option<PathBuf> {
    Some(folder_of(path).canonicalize().ok()?.join(path.file_name()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn clash(read: &Path, written: &Path) -> Option<String> {
        let files = Files::default().reads("--model", [read]);
        let checked = files.writes("--json", [written]).check();
        checked.err().map(|error| error.to_string())
    }

    #[test]
    fn an_output_that_is_an_input_is_refused_by_whatever_way_it_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("model.toml"), "").unwrap();
        std::fs::create_dir(at("sub")).unwrap();
        std::fs::hard_link(at("model.toml"), at("hard.toml")).unwrap();
        std::os::unix::fs::symlink(at("model.toml"), at("soft.toml")).unwrap();
        for name in ["model.toml", "sub/../model.toml", "hard.toml", "soft.toml"] {
            let said = clash(&at("model.toml"), &at(name)).expect(name);
            assert!(said.contains(name) && said.contains("--model"), "{said}");
            assert!(said.contains("name another place for --json"), "{said}");
        }
        assert_eq!(clash(&at("model.toml"), &at("gap.json")), None);
        assert_eq!(clash(&at("model.toml"), &at("none/model.toml")), None);
    }

    #[test]
    fn two_outputs_in_one_place_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let (near, far) = (folder.path().join("a.txt"), folder.path().join("./a.txt"));
        let files = Files::default().writes("--json", [near]).writes("--report", [far]);
        let said = files.check().unwrap_err().to_string();
        assert!(said.contains("is written by --json too"), "{said}");
    }
}
