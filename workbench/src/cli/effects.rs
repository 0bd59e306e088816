//! `truing effects`: the library with equations.

use clap::Args;
use truing_core::system::effects::{self, Effect, LIBRARY};
use truing_report::report::terminal::beside;

/// Column at which the text beside a heading starts, behind the margin of two.
const INDENT: usize = 14;

/// Arguments of `truing effects`.
#[derive(Args, Debug)]
pub struct Arguments {
    /// Show these effects only.
    pub names: Vec<String>,
}

/// Prints the library.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    for name in &arguments.names {
        effects::known(name).map_err(anyhow::Error::msg)?;
    }
    let wanted = |effect: &&Effect| {
        arguments.names.is_empty() || arguments.names.iter().any(|name| name == effect.name)
    };
    LIBRARY.iter().copied().filter(wanted).for_each(|effect| out!("{}", described(effect)));
    Ok(())
}

/// One effect in a few lines.
fn described(effect: &Effect) -> String {
    let parameter = |p: &effects::Parameter| {
        let optional = p.default.map_or(String::new(), |value| format!(" (optional, {value})"));
        format!("{} [{}]{optional}", p.name, p.unit)
    };
    let parameters: Vec<String> = effect.parameters.iter().map(parameter).collect();
    let confusable: Vec<&str> = effect.confusable_with.iter().map(|other| other.name).collect();
    let rows = [
        ("equation", effect.equation),
        ("parameters", &parameters.join(", ")),
        ("trace", effect.signature),
        ("confused with", &confusable.join(", ")),
        ("separated by", effect.separated_by),
        ("source", effect.source),
    ];
    let rows = rows.map(|(head, body)| beside(&format!("  {head:INDENT$}"), body));
    format!("{}\n{}{}\n", effect.name, beside("  ", effect.summary), rows.concat())
}
