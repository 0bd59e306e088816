//! Packages of the workspace with their programs and tests, as Cargo knows them.

use crate::process::{cargo, text};
use anyhow::{Context, Result, bail};
use serde::Deserialize;
use std::path::PathBuf;

/// What of `cargo metadata` is looked at.
#[derive(Deserialize)]
pub struct Targets {
    packages: Vec<Package>,
}

#[derive(Deserialize)]
struct Package {
    name: String,
    targets: Vec<Target>,
}

#[derive(Deserialize)]
struct Target {
    name: String,
    kind: Vec<String>,
    src_path: PathBuf,
}

impl Targets {
    /// Asks Cargo.
    pub fn read() -> Result<Self> {
        let mut command = cargo(&["metadata", "--no-deps", "--format-version", "1"]);
        let output = command.output()?;
        if !output.status.success() {
            bail!("`{}` failed: {}", text(&command), String::from_utf8_lossy(&output.stderr));
        }
        serde_json::from_slice(&output.stdout).context("`cargo metadata` did not answer as it used to")
    }

    /// Fails when the workspace lacks the package, or the package lacks a target of this kind and name.
    pub fn find(&self, package: &str, target: Option<(&str, &str)>) -> Result<()> {
        let found = self.package(package)?;
        match target {
            Some((kind, name)) => found.target(kind, name).map(|_| ()),
            None => Ok(()),
        }
    }

    /// Fails when a test of a package has no file `module` beside its `main.rs`.
    pub fn find_module(&self, package: &str, test: &str, module: &str) -> Result<()> {
        let main = &self.package(package)?.target("test", test)?.src_path;
        let files = [format!("{module}.rs"), format!("{module}/mod.rs")];
        if !files.iter().any(|file| main.with_file_name(file).is_file()) {
            bail!("the test {test} of {package} has no module {module}");
        }
        Ok(())
    }

    fn package(&self, name: &str) -> Result<&Package> {
        let found = self.packages.iter().find(|found| found.name == name);
        found.with_context(|| format!("the workspace has no package {name}"))
    }
}

impl Package {
    fn target(&self, kind: &str, name: &str) -> Result<&Target> {
        let fits = |target: &&Target| target.name == name && target.kind.iter().any(|of| of == kind);
        let found = self.targets.iter().find(fits);
        found.with_context(|| format!("the package {} has no {kind} {name}", self.name))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_workspace_lacks_is_told() {
        let targets = Targets::read().unwrap();
        targets.find("xtask", Some(("bin", "xtask"))).unwrap();
        let error = |package, target| targets.find(package, target).unwrap_err().to_string();
        assert_eq!(error("xtsak", None), "the workspace has no package xtsak");
        assert_eq!(
            error("host-tests", Some(("bin", "flash-dry-run"))),
            "the package host-tests has no bin flash-dry-run"
        );
        targets.find_module("host-tests", "chip", "drivers").unwrap();
        targets.find_module("host-tests", "chip", "board_model").unwrap();
        assert!(targets.find_module("host-tests", "chip", "qemu").is_err());
    }
}
