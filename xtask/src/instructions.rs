//! Instructions per control tick of the image as it is.

use crate::figures::{self, Figures};
use crate::image::Image;
use crate::process::text;
use crate::programs::Program;
use anyhow::{Context, Result, bail};
use boards::BOARDS;

/// Builds the image of the board that QEMU plays, has `truing instructions` count, and checks or enters the figures. The other
/// boards run the same tick around reads and writes of their own.
pub fn print(accept: bool) -> Result<()> {
    let played = BOARDS.into_iter().find(|board| board.machine.is_some());
    let image = Image::of(played.context("the table has no board that QEMU plays")?).build()?;
    let mut truing = Program::Truing.run();
    let output = truing
        .args(["instructions", "--image"])
        .arg(image)
        .stderr(std::process::Stdio::inherit())
        .output()?;
    if !output.status.success() {
        bail!("`{}` failed ({})", text(&truing), output.status);
    }
    let table = String::from_utf8(output.stdout).context("the table is not text")?;
    print!("{table}");
    figures::settle("instructions", &figures(&table), accept)
}

/// `| rate | activity | ticks | average | worst |`.
fn figures(table: &str) -> Figures {
    let mut figures = Figures::new();
    for line in table.lines() {
        let cells: Vec<&str> = line.trim_matches('|').split('|').map(str::trim).collect();
        if let [rate, activity, _, average, worst] = cells[..]
            && let (Ok(average), Ok(worst)) = (average.parse(), worst.parse())
        {
            figures.insert(format!("{rate} {activity}, average"), average);
            figures.insert(format!("{rate} {activity}, worst"), worst);
        }
    }
    figures
}

#[cfg(test)]
mod tests {
    #[test]
    fn a_row_of_the_table_is_two_figures() {
        let table = "| control rate | activity | ticks | average | worst |\n|---|---|---|---|---|\n| 1000 Hz | idle | 616 | 568 | 6628 |\n";
        let figures = super::figures(table);
        assert_eq!(figures["1000 Hz idle, average"], 568);
        assert_eq!(figures["1000 Hz idle, worst"], 6628);
        assert_eq!(figures.len(), 2);
    }
}
