//! The full table of power cuts; docs/results/README.md has its sums.

use evaluation::{Page, Results};
use rayon::prelude::*;
use trials::power_cut::suite::{Situation, Tally, cut_everywhere, life, operations};
use trials::power_cut::{library, suite};

/// Cuts the power at every flash operation of save, update and erase, and counts what is read afterwards.
#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Times each operation is cut in each of the eight ways.
    #[arg(long, default_value_t = 40)]
    seeds: u64,
    /// Random lives of 40 sessions each.
    #[arg(long, default_value_t = 2000)]
    lives: u64,
    /// Also cut sectors of the real 128 KiB: every n-th operation, once in each way. 0: do not.
    #[arg(long, default_value_t = 7)]
    real_stride: usize,
    #[command(flatten)]
    results: Results,
}

const SMALL: usize = 4096;
const REAL: usize = 128 * 1024;

pub fn run(arguments: Arguments) {
    let mut page = arguments.results.page();
    heading(&mut page);
    let mut total = Tally::default();
    for situation in Situation::ALL {
        let tally = cut_everywhere::<SMALL>(situation, 1, arguments.seeds);
        row(&mut page, situation.name(), operations::<SMALL>(situation), tally);
        total = total.plus(tally);
    }
    if arguments.real_stride > 0 {
        for situation in [Situation::AfterPowerUp, Situation::SectorChangeBack] {
            let tally = cut_everywhere::<REAL>(situation, arguments.real_stride, 1);
            let name = format!("128 KiB sectors: {}", situation.name());
            row(&mut page, &name, operations::<REAL>(situation), tally);
            total = total.plus(tally);
        }
    }
    let erase = suite::cut_erase::<SMALL>(50 * arguments.seeds);
    row(&mut page, "the erase alone", 1, erase);
    let lives = (0..arguments.lives)
        .into_par_iter()
        .map(|seed| life::<SMALL>(seed, 40))
        .reduce(Tally::default, Tally::plus);
    row(&mut page, "random lives, cuts in a row", 0, lives);
    total = total.plus(erase).plus(lives);
    row(&mut page, "**all**", 0, total);
    page.line("\nThe library's own map over both sectors, nothing added:\n");
    heading(&mut page);
    for (name, with_erase) in [("save", false), ("save that erases", true)] {
        row(&mut page, name, 0, library::cut_everywhere::<SMALL>(with_erase, arguments.seeds));
    }
    row(&mut page, "the erase alone", 1, library::cut_erase::<SMALL>(50 * arguments.seeds));
    let (seeds, lives) = (arguments.seeds, arguments.lives);
    page.close(&format!(
        "0 to {} of every cut, 0 to {} of the lives",
        seeds.saturating_sub(1),
        lives.saturating_sub(1)
    ));
    if total.losses() > 0 {
        eprintln!("error: the store lost {} sets", total.losses());
        std::process::exit(1);
    }
}

fn heading(page: &mut Page) {
    page.line("| situation | operations | cuts | old | new | neither | third | changed later | stuck |");
    page.line("|---|---|---|---|---|---|---|---|---|");
}

fn row(page: &mut Page, name: &str, operations: u64, tally: Tally) {
    let Tally { cuts, old, new, neither, third, changed, stuck } = tally;
    let operations = if operations == 0 { "".into() } else { operations.to_string() };
    page.line(format_args!(
        "| {name} | {operations} | {cuts} | {old} | {new} | {neither} | {third} | {changed} | {stuck} |"
    ));
}
