//! Rules of `docs/architecture.md` that are about sources: what a part must not contain, and what it must not reach.

use std::path::{Path, PathBuf};

/// Crates that exist on the chip alone, by the beginning of their names.
const CHIP: [&str; 7] = ["cortex-m", "critical-section", "defmt", "rtic", "semihosting", "stm32", "panic-"];

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the workspace")
}

/// Every Rust file below a folder, with its text.
pub fn sources(folder: &str) -> Vec<(PathBuf, String)> {
    let (mut folders, mut found) = (vec![root().join(folder)], vec![]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(&folder).expect("a folder of sources") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|ending| ending == "rs") {
                let text = std::fs::read_to_string(&path).expect("a source");
                found.push((path, text));
            }
        }
    }
    assert!(!found.is_empty(), "{folder} has no source");
    found
}

#[test]
fn the_library_forbids_unsafe_code_and_knows_no_chip() {
    let library = std::fs::read_to_string(root().join("src/lib.rs")).unwrap();
    for attribute in ["#![no_std]", "#![forbid(unsafe_code)]"] {
        assert!(library.lines().any(|line| line == attribute), "src/lib.rs lacks {attribute}");
    }
    let manifest = std::fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let dependencies = manifest["dependencies"].as_table().unwrap();
    assert!(dependencies.contains_key("heapless"), "the table of the library's dependencies");
    let chip = |name: &&String| CHIP.iter().any(|crates| name.starts_with(crates));
    assert_eq!(dependencies.keys().find(chip), None, "belongs to target_os = \"none\" alone");
}

#[test]
fn the_workbench_prints_in_one_place() {
    let workbench = house::floors::PACKAGES
        .iter()
        .map(|package| package.0)
        .filter(|folder| folder.starts_with("workbench"));
    for (path, text) in workbench.flat_map(sources) {
        let code = text.lines().map(str::trim).filter(|line| !line.starts_with("//"));
        let prints = |line: &&str| line.contains("println!") || line.contains("print!(");
        let screen = path.ends_with("console/screen.rs");
        assert!(screen || !code.clone().any(|line| prints(&line)), "{} prints", path.display());
        let writes = |line: &str| line.contains("io::stdout()") || line.contains("io::stderr()");
        let terminal = |line: &str| line.contains("is_terminal") || line.contains("IsTerminal");
        let found = code.clone().find(|line| writes(line) && !terminal(line));
        assert!(screen || found.is_none(), "{}: {found:?}", path.display());
    }
}

#[test]
fn the_core_opens_no_file() {
    for (path, text) in sources("workbench/core/src") {
        let opens =
            ["std::fs", "std::path", "std::env", "stdin"].into_iter().find(|word| text.contains(word));
        assert_eq!(opens, None, "{}", path.display());
        let pool = path.ends_with("system/threads/pool.rs");
        assert!(pool || !text.contains("rayon::"), "{} needs a pool of threads", path.display());
    }
}

#[test]
fn the_reference_plant_shares_no_code_with_the_plant_that_fits() {
    let manifest = std::fs::read_to_string(root().join("workbench/reference_plant/Cargo.toml")).unwrap();
    let manifest: toml::Table = manifest.parse().unwrap();
    let dependencies = manifest["dependencies"].as_table().unwrap();
    let names: Vec<&str> = dependencies.keys().map(String::as_str).collect();
    assert_eq!(names, ["rand", "rand_chacha", "rand_distr", "servo"]);
    // Of the servo it takes one word: how a bridge stands.
    for (path, text) in sources("workbench/reference_plant/src") {
        let code = text.lines().map(str::trim).filter(|line| !line.starts_with("//"));
        let other =
            code.into_iter().find(|line| line.contains("servo::") && *line != "use servo::axis::Bridge;");
        assert_eq!(other, None, "{}", path.display());
    }
}
