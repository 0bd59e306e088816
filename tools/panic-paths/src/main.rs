//! `cargo xtask panics` runs this: the image, the list of what is accepted, and the functions where a walk begins. Fails on
//! anything else.

use anyhow::{Context, Result, bail};
use panic_paths::accepted;
use panic_paths::walk::{self, Walk};
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, list, roots @ ..] = &arguments[..] else {
        bail!("usage: panic-paths IMAGE.elf ACCEPTED.txt ROOT-FUNCTION …");
    };
    let text = std::fs::read_to_string(list).with_context(|| format!("cannot read {list}"))?;
    let accepted = accepted::parse(&text)?;
    let walks: Vec<Walk> =
        roots.iter().map(|root| walk::walk(Path::new(image), root)).collect::<Result<_>>()?;
    let mut unlisted = 0;
    for (root, walk) in roots.iter().zip(&walks) {
        println!(
            "{root}: {} functions, {} ways to a panic or to a call by register",
            walk.functions,
            walk.findings.len()
        );
        for (finding, places) in &walk.findings {
            let reason = accepted.iter().find(|line| line.covers(finding));
            unlisted += u32::from(reason.is_none());
            let reason = reason.map_or("NOT LISTED", |line| &line.reason);
            let places = places.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
            println!("{} | {} | {reason} ({places})", finding.function, finding.panic);
        }
    }
    for line in &accepted {
        if !walks.iter().any(|walk| walk.findings.keys().any(|finding| line.covers(finding))) {
            println!("no longer there, take it off the list: {}", line.text());
        }
    }
    if unlisted > 0 {
        bail!("{unlisted} ways to a panic are not listed in {list}: remove them, or list them with a reason");
    }
    Ok(())
}
