//! `cargo xtask panics` runs this: the image, its root and the list of what is accepted. Fails on anything else.

use anyhow::{Context, Result, bail};
use panic_paths::accepted;
use panic_paths::walk;
use std::path::Path;

fn main() -> Result<()> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [image, root, list] = &arguments[..] else {
        bail!("usage: panic-paths IMAGE.elf ROOT-FUNCTION ACCEPTED.txt");
    };
    let text = std::fs::read_to_string(list).with_context(|| format!("cannot read {list}"))?;
    let accepted = accepted::parse(&text)?;
    let walk = walk::walk(Path::new(image), root)?;
    println!(
        "{root}: {} functions, {} ways to a panic or to a call by register",
        walk.functions,
        walk.findings.len()
    );
    let mut unlisted = 0;
    for (finding, places) in &walk.findings {
        let reason = accepted.iter().find(|line| line.covers(finding));
        unlisted += u32::from(reason.is_none());
        let reason = reason.map_or("NOT LISTED", |line| &line.reason);
        let places = places.iter().map(String::as_str).collect::<Vec<_>>().join(", ");
        println!("{} | {} | {reason} ({places})", finding.function, finding.panic);
    }
    for line in &accepted {
        if !walk.findings.keys().any(|finding| line.covers(finding)) {
            println!("no longer there, take it off the list: {}", line.text());
        }
    }
    if unlisted > 0 {
        bail!("{unlisted} ways to a panic are not listed in {list}: remove them, or list them with a reason");
    }
    Ok(())
}
