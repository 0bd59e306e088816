//! What is handed to people who build nothing: a program that stands alone, its library for FMUs, and the Python package.

use crate::process::{root, run};
use crate::programs::{self, Program};
use crate::wheel;
use anyhow::{Context, Result, bail};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Links the C library into the program: it runs on any Linux of its processor. Symbols are left out here, for the profile's `strip` does
/// not reach a package with an override of its own.
const STATIC: &str = "-C target-feature=+crt-static -C strip=symbols";

/// Packs the program and the wheel into `target/dist`, with their checksums.
pub fn dist() -> Result<()> {
    let out = root().join("target").join("dist");
    let _ = fs::remove_dir_all(&out);
    let packed = packed(&[program()?, programs::stripped_fmu_library()?], &out)?;
    let wheel = wheel::build()?;
    let copied = out.join(wheel.file_name().context("a wheel has a name")?);
    fs::copy(&wheel, &copied).with_context(|| format!("cannot write {}", copied.display()))?;
    let names = [&packed, &copied].map(|path| path.file_name().unwrap_or_default());
    let sums = Command::new("sha256sum").args(names).current_dir(&out).output().context("sha256sum")?;
    fs::write(out.join("SHA256SUMS"), &sums.stdout)?;
    print!("{}", String::from_utf8_lossy(&sums.stdout));
    Ok(())
}

/// Builds the program without what it would ask of a system.
fn program() -> Result<PathBuf> {
    let host = programs::host()?;
    let variable = format!("CARGO_TARGET_{}_RUSTFLAGS", host.to_uppercase().replace('-', "_"));
    let mut build = Program::Truing.cargo("build");
    build.args(["--release", "--locked", "--target", &host]);
    run(build.env(variable, STATIC))?;
    let program = root().join("target").join(&host).join("release").join("truing");
    let needs = Command::new("ldd").arg(&program).output().context("ldd")?;
    let needs = [needs.stdout, needs.stderr].concat();
    if !["statically linked", "not a dynamic executable"]
        .iter()
        .any(|says| String::from_utf8_lossy(&needs).contains(says))
    {
        bail!("the program still needs libraries: {}", String::from_utf8_lossy(&needs));
    }
    run(Command::new(&program).arg("--version")).map(|()| program)
}

/// The program and what lies beside it with its licence, in an archive that carries its name.
fn packed(built: &[PathBuf], out: &Path) -> Result<PathBuf> {
    let name = format!("truing-{}-{}", env!("CARGO_PKG_VERSION"), programs::host()?);
    let folder = out.join(&name);
    fs::create_dir_all(&folder).with_context(|| format!("cannot make {}", folder.display()))?;
    for file in built.iter().chain(&[root().join("LICENSE"), root().join("README.md")]) {
        fs::copy(file, folder.join(file.file_name().unwrap_or_default()))?;
    }
    let archive = out.join(format!("{name}.tar.gz"));
    run(Command::new("tar").arg("-czf").arg(&archive).arg("-C").arg(out).arg(&name))?;
    fs::remove_dir_all(folder)?;
    Ok(archive)
}

/// Does the command line install itself from a checkout?
pub fn install() -> Result<()> {
    let folder = root().join("target").join("installed");
    run(&mut programs::install(&folder))?;
    run(Command::new(folder.join("bin").join("truing")).arg("--version"))
}

/// Can the crates that others build on be packed, each with all that it needs?
pub fn packages() -> Result<()> {
    run(&mut programs::packing())
}
