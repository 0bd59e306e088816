//! How much work the search for names is: simulations' steps of a fixed set, counted by `truing bench`.

use crate::figures::{self, Figures};
use crate::process::text;
use crate::programs::Program;
use anyhow::{Context, Result, bail};
use serde::Deserialize;

/// The set: six drawn cases with nothing to three hidden effects and a rig. A few seconds of computing.
const SET: &[&str] = &["--drawn", "6", "--only", "780", "frc501_drive"];

/// What of `truing-bench/1` is looked at.
#[derive(Deserialize)]
struct Bench {
    total: Work,
}

#[derive(Deserialize)]
struct Work {
    inner_steps: u64,
    passes: u64,
}

/// Has `truing bench` count, and checks or enters the sums.
pub fn print(accept: bool) -> Result<()> {
    let mut truing = Program::Truing.run();
    truing.arg("bench").args(SET).args(["--json", "-"]);
    let output = truing.stderr(std::process::Stdio::inherit()).output()?;
    if !output.status.success() {
        bail!("`{}` failed ({})", text(&truing), output.status);
    }
    let figures = figures(&String::from_utf8(output.stdout).context("the figures are not text")?)?;
    for (name, count) in &figures {
        println!("{name}: {count}");
    }
    figures::settle("search", &figures, accept)
        .context("the search for names does more work; `truing bench` tells in which case")
}

fn figures(json: &str) -> Result<Figures> {
    let Work { inner_steps, passes } =
        serde_json::from_str::<Bench>(json).context("`truing bench` did not answer as it used to")?.total;
    Ok(Figures::from([("inner steps".into(), inner_steps), ("passes".into(), passes)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The entries of the project, and what would be said of more work than they allow.
    #[test]
    fn a_search_that_grew_fails_and_says_which_figure() {
        let mut now = figures::entered("search").unwrap();
        assert_eq!(now.keys().collect::<Vec<_>>(), ["inner steps", "passes"]);
        figures::settle("search", &now, false).unwrap();
        now.entry("passes".into()).and_modify(|count| *count += *count / 20);
        let error = figures::settle("search", &now, false).unwrap_err().to_string();
        assert!(error.contains("passes from") && !error.contains("inner steps"), "{error}");
    }

    #[test]
    fn the_sums_of_the_bench_are_two_figures() {
        let json = r#"{"schema": "truing-bench/1", "total": {"simulations": 3, "inner_steps": 700, "passes": 100, "cpu_s": 0.1}}"#;
        let figures = figures(json).unwrap();
        assert_eq!((figures["inner steps"], figures["passes"], figures.len()), (700, 100, 2));
        assert!(super::figures("{}").is_err());
    }
}
