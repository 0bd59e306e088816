//! Leave-one-rig-out study of the limits by which names are judged on rigs:
//! `cargo run -p evaluation -- leave-one-rig-out data/rigs --data DATA`.
//!
//! Every limit is halved towards doing nothing and widened, one at a time. For each rig the setting that answers most of the *other* rigs as
//! expected is taken, and the rig is judged with it. A figure near that of the default setting says that the limits are not fitted to
//! single rigs.

use evaluation::Results;
use std::path::PathBuf;
use truing::gap::Options;
use truing::gap::ShareLimits;
use truing::proving::commands::judge::answer;
use truing::proving::commands::rig::Rig;

#[derive(clap::Args, Debug)]
pub struct Arguments {
    /// Folders of rigs.
    #[arg(required = true)]
    folders: Vec<PathBuf>,
    /// Folder of measured data in which files that a rig's folder does not hold are looked for.
    #[arg(long)]
    data: Option<PathBuf>,
    #[command(flatten)]
    results: Results,
}

/// A setting of the limits.
struct Setting {
    name: String,
    limits: ShareLimits,
}

/// The default first, then each limit lower and higher.
fn settings() -> Vec<Setting> {
    let default = ShareLimits::default();
    let with =
        |name: &str, value: f64, limits: ShareLimits| Setting { name: format!("{name} {value}"), limits };
    let mut all = vec![Setting { name: "default".into(), limits: default }];
    all.extend([0.08, 0.25].map(|joins| with("joins", joins, ShareLimits { joins, ..default })));
    all.extend([0.12, 0.4].map(|stays| with("stays", stays, ShareLimits { stays, ..default })));
    all.extend([0.25, 1.0].map(|points| with("points", points, ShareLimits { points, ..default })));
    all.extend([0.7, 0.9].map(|richer| with("richer", richer, ShareLimits { richer, ..default })));
    let given =
        |against_given| with("against_given", against_given, ShareLimits { against_given, ..default });
    all.extend([0.5, 0.8].map(given));
    all
}

pub fn run(arguments: Arguments) -> anyhow::Result<()> {
    let mut rigs = Vec::new();
    for folder in &arguments.folders {
        rigs.extend(Rig::all(folder)?);
    }
    let settings = settings();
    let mut accepted: Vec<Vec<bool>> = Vec::new();
    let mut names = Vec::new();
    for rig in &rigs {
        let answers: anyhow::Result<Vec<Option<bool>>> =
            settings.iter().map(|setting| judged(rig, setting, &arguments)).collect();
        match answers?.into_iter().collect::<Option<Vec<bool>>>() {
            Some(row) => {
                eprintln!("{}: {} of {} settings", rig.name, count(&row), row.len());
                accepted.push(row);
                names.push(rig.name.as_str());
            }
            None => eprintln!("{} skipped: its data are absent", rig.name),
        }
    }
    let mut page = arguments.results.page();
    page.print(table(&settings, &accepted));
    page.print(left_out(&settings, &accepted, &names));
    page.close("none are drawn");
    Ok(())
}

/// Whether a rig is answered as expected; `None` if its data are absent.
fn judged(rig: &Rig, setting: &Setting, arguments: &Arguments) -> anyhow::Result<Option<bool>> {
    let options = Options { limits: setting.limits, ..Options::default() };
    let outcome = answer(rig, arguments.data.as_deref(), &options)?;
    Ok(outcome.map(|outcome| rig.expectation.faults(&outcome).is_empty()))
}

fn count(row: &[bool]) -> usize {
    row.iter().filter(|it| **it).count()
}

/// How many rigs each setting answers as expected.
fn table(settings: &[Setting], accepted: &[Vec<bool>]) -> String {
    let mut text = String::from("| setting | rigs answered as expected |\n|---|---|\n");
    for (k, setting) in settings.iter().enumerate() {
        let right = accepted.iter().filter(|row| row[k]).count();
        text.push_str(&format!("| {} | {right} of {} |\n", setting.name, accepted.len()));
    }
    text
}

/// Each rig judged with the setting that is best on the others.
fn left_out(settings: &[Setting], accepted: &[Vec<bool>], names: &[&str]) -> String {
    let mut right = 0;
    let mut missed = Vec::new();
    for rig in 0..accepted.len() {
        let others =
            |k: usize| (0..accepted.len()).filter(|other| *other != rig && accepted[*other][k]).count();
        let most = (0..settings.len()).map(others).max().unwrap_or(0);
        // Of equally good settings the first: the default before any other.
        let best = (0..settings.len()).find(|k| others(*k) == most).unwrap_or(0);
        match accepted[rig][best] {
            true => right += 1,
            false => missed.push(format!("{} (with {})", names[rig], settings[best].name)),
        }
    }
    let missed = if missed.is_empty() { "none".into() } else { missed.join(", ") };
    format!(
        "\nEach rig judged with the setting that answers most of the others: {right} of {} as expected; missed: {missed}.\n",
        accepted.len()
    )
}
