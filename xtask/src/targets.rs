//! Packages of the workspace with their programs and tests, as Cargo knows them.

use crate::process::{cargo, text};
use anyhow::{Context, Result, bail};
use serde::Deserialize;

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
}

impl Targets {
    /// Asks Cargo.
    pub fn read() -> Result<Self> {
        let mut command = cargo(&["metadata", "--no-deps", "--format-version", "1"]);
        let output = command.output()?;
        if !output.status.success() {
            bail!(
                "`{}` failed: {}",
                text(&command),
                String::from_utf8_lossy(&output.stderr)
            );
        }
        serde_json::from_slice(&output.stdout).context("`cargo metadata` did not answer as it used to")
    }

    /// Fails when the workspace lacks the package, or the package lacks a target of this kind and name.
    pub fn find(&self, package: &str, target: Option<(&str, &str)>) -> Result<()> {
        let found = self.packages.iter().find(|found| found.name == package);
        let found = found.with_context(|| format!("the workspace has no package {package}"))?;
        let Some((kind, name)) = target else {
            return Ok(());
        };
        let fits = |target: &Target| target.name == name && target.kind.iter().any(|of| of == kind);
        if !found.targets.iter().any(fits) {
            bail!("the package {package} has no {kind} {name}");
        }
        Ok(())
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
    }
}
