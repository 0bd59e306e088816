//! The checked-in figures of docs/cost.toml, and the check that none of them grew without its entry.

use crate::process::root;
use anyhow::{Context, Result, bail};
use std::collections::BTreeMap;
use std::path::PathBuf;

/// Growth that passes, in per cent.
const TOLERANCE: u64 = 3;

/// Name → figure.
pub type Figures = BTreeMap<String, u64>;

/// Compares `measured` with its part of the file; `accept` writes it there instead.
pub fn settle(part: &str, measured: &Figures, accept: bool) -> Result<()> {
    let (text, mut file) = read()?;
    if accept {
        file.insert(part.into(), measured.clone());
        let head: String = text
            .lines()
            .take_while(|line| line.starts_with('#'))
            .map(|line| line.to_string() + "\n")
            .collect();
        std::fs::write(path(), head + &toml::to_string(&file)?)?;
        println!("docs/cost.toml now holds these figures; say why in CHANGELOG.md");
        return Ok(());
    }
    let grown = grown(file.get(part).unwrap_or(&Figures::new()), measured);
    if !grown.is_empty() {
        bail!(
            "grown by more than {TOLERANCE} % since docs/cost.toml: {}; if that is meant, add `--accept` and a line to CHANGELOG.md",
            grown.join(", ")
        );
    }
    println!("no figure grew by more than {TOLERANCE} % since docs/cost.toml");
    Ok(())
}

/// What grew, or has no entry.
fn grown(entries: &Figures, measured: &Figures) -> Vec<String> {
    let exceeds =
        |name: &String, now: u64| entries.get(name).is_none_or(|then| now * 100 > then * (100 + TOLERANCE));
    measured
        .iter()
        .filter(|(name, now)| exceeds(name, **now))
        .map(|(name, now)| match entries.get(name) {
            Some(then) => format!("{name} from {then} to {now}"),
            None => format!("{name} has no entry ({now})"),
        })
        .collect()
}

/// The entries of a part.
#[cfg(test)]
pub fn entered(part: &str) -> Result<Figures> {
    read()?.1.remove(part).with_context(|| format!("docs/cost.toml has no part {part}"))
}

/// The file, as text and as entries.
fn read() -> Result<(String, BTreeMap<String, Figures>)> {
    let path = path();
    let text = std::fs::read_to_string(&path).with_context(|| format!("cannot read {}", path.display()))?;
    let file = toml::from_str(&text).context("docs/cost.toml is damaged")?;
    Ok((text, file))
}

fn path() -> PathBuf {
    root().join("docs/cost.toml")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figures(entries: &[(&str, u64)]) -> Figures {
        entries.iter().map(|(name, figure)| (name.to_string(), *figure)).collect()
    }

    #[test]
    fn three_per_cent_pass_and_more_or_something_new_does_not() {
        let entries = figures(&[("flash", 1000), ("ram", 200)]);
        assert!(grown(&entries, &figures(&[("flash", 1030), ("ram", 10)])).is_empty());
        assert_eq!(grown(&entries, &figures(&[("flash", 1031)])), ["flash from 1000 to 1031"]);
        assert_eq!(grown(&entries, &figures(&[("stack", 7)])), ["stack has no entry (7)"]);
    }
}
