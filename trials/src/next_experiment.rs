//! Is the suggested next experiment worth doing? A tie of a short noisy log is taken to the rig again: once with the
//! suggestion, once with a random protocol of equal length.

use crate::case_files::{Opened, opened, recorded};
use crate::naming::{group, quantile, share};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::error::Error;
use truing::gap::fit::hypothesis::Hypothesis;
use truing::gap::search::{HELD_OUT, Scored, chi2, search, tied};
use truing::gap::{self, Options, made_ready};
use truing::outcome::{Outcome, Verdict};
use truing::synthetic::cases::{Set, Spec, draw};
use truing::system::log::{Dynamic, Run};

/// A difference in χ² from which two rivals can be told apart: the workbench's own limit for "not separable".
const SEPARABLE: f64 = 20.0;

/// Short noisy cases, in which ties are common.
pub fn spec(evaluation: bool) -> Spec {
    Spec { rows: 600, dirty: Some(false), noise: Some(0.02), evaluation, ..Spec::new(Set::Single) }
}

/// One tie taken to the rig.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Trial {
    /// Seed of the case.
    pub seed: u32,
    /// The hidden effect.
    pub truth: Vec<String>,
    /// The rival that is to be ruled out.
    pub rival: Vec<String>,
    /// χ² of the rival minus that of the truth on the suggested experiment, both as fitted to the first log.
    pub suggested_chi2: f64,
    /// … on a random protocol of equal length.
    pub random_chi2: f64,
    /// After the suggested experiment the workflow names the truth and no longer ties it with the rival.
    pub suggested_resolves: bool,
    /// … after the random one.
    pub random_resolves: bool,
}

impl Trial {
    /// True if one of the two experiments shows a difference.
    pub fn separable(&self) -> bool {
        self.suggested_chi2.max(self.random_chi2) > SEPARABLE
    }
}

/// What became of a case.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Found {
    /// No tie that holds the truth beside another explanation.
    NoTie,
    /// A tie.
    Tie(Trial),
}

/// Runs one case.
pub fn examine(spec: &Spec, seed: u32) -> Result<Found, Box<dyn Error>> {
    let case = draw(spec, seed);
    let files = opened(&case)?;
    let outcome = analysed(&files, &files.log)?;
    let truth: Vec<String> = case.answer.hidden.iter().map(|h| h.name.to_owned()).collect();
    let Some((rival, profile)) = contested(&outcome, &truth) else {
        return Ok(Found::NoTie);
    };
    let folder = tempfile::tempdir()?;
    let suggested = recorded(&case.rig.follow(&profile, u64::from(seed)), &folder.path().join("next.csv"))?;
    let rows = suggested.rows();
    let random = recorded(&case.rig.excite(rows, u64::from(seed)), &folder.path().join("random.csv"))?;
    let apart = |record: &Dynamic| difference(&files, record, &truth, &rival);
    let resolves = |record: Dynamic| resolved(&files, record, &truth, &rival);
    Ok(Found::Tie(Trial {
        seed,
        suggested_chi2: apart(&suggested)?,
        random_chi2: apart(&random)?,
        suggested_resolves: resolves(suggested)?,
        random_resolves: resolves(random)?,
        truth,
        rival,
    }))
}

fn analysed(files: &Opened, log: &Dynamic) -> Result<Outcome, Box<dyn Error>> {
    let holdouts = std::slice::from_ref(&files.holdout);
    Ok(gap::run(&files.model, log, holdouts, &Options::default(), &|_| {})?)
}

/// The other rival of the tie that holds the truth, and the experiment that is suggested.
fn contested(outcome: &Outcome, truth: &[String]) -> Option<(Vec<String>, Vec<truing::outcome::Segment>)> {
    if outcome.verdict != Verdict::Tie {
        return None;
    }
    let sets = &outcome.ties.first()?.rivals;
    let rival = match sets.iter().position(|set| same(set, truth))? {
        0 => sets.get(1)?,
        _ => &sets[0],
    };
    let experiment = outcome.next_experiment.as_ref()?;
    Some((rival.clone(), experiment.profile.clone()))
}

fn same(a: &[String], b: &[String]) -> bool {
    let names = |set: &[String]| set.iter().cloned().collect::<BTreeSet<String>>();
    names(a) == names(b)
}

/// χ² of the rival minus that of the truth on a record that neither was fitted to.
fn difference(
    files: &Opened,
    record: &Dynamic,
    truth: &[String],
    rival: &[String],
) -> Result<f64, Box<dyn Error>> {
    let bench = made_ready(&files.model, &files.log, std::slice::from_ref(record))?;
    let found = search(&bench, &files.model, &Options::default(), &|_| {});
    let rivals = tied(&found.best, &found.others);
    let all: Vec<&Scored> = std::iter::once(&found.best).chain(rivals).collect();
    let on_record = |names: &[String]| -> Option<f64> {
        let set = all.iter().find(|set| same(&set.hypothesis.names(), names))?;
        let hypothesis: &Hypothesis = &set.hypothesis;
        Some(chi2(hypothesis, &set.fit.x, &HELD_OUT).0)
    };
    let pair = on_record(rival).zip(on_record(truth));
    let (rival, truth) = pair.ok_or("the tie did not come back")?;
    Ok(rival - truth)
}

/// Whether log and new record together name the truth, and the rival is out.
fn resolved(
    files: &Opened,
    record: Dynamic,
    truth: &[String],
    rival: &[String],
) -> Result<bool, Box<dyn Error>> {
    let mut log = files.log.clone();
    log.runs.extend(record.runs.into_iter().map(|run| Run { id: 1, ..run }));
    let outcome = analysed(files, &log)?;
    let named: BTreeSet<&str> = outcome.effects.iter().map(|effect| group(&effect.name)).collect();
    let hidden: BTreeSet<&str> = truth.iter().map(|name| group(name)).collect();
    let still = outcome.ties.iter().flat_map(|tie| &tie.rivals).any(|set| same(set, rival));
    Ok(named == hidden && !still)
}

/// The table of an evaluation.
pub fn report(cases: &[Found]) -> String {
    let ties: Vec<&Trial> = cases
        .iter()
        .filter_map(|found| match found {
            Found::Tie(trial) => Some(trial),
            Found::NoTie => None,
        })
        .collect();
    let separable: Vec<&&Trial> = ties.iter().filter(|trial| trial.separable()).collect();
    let count = |test: fn(&Trial) -> bool| {
        let hits = separable.iter().filter(|trial| test(trial)).count();
        share(hits, separable.len())
    };
    let ratios: Vec<f64> =
        separable.iter().map(|trial| trial.suggested_chi2 / trial.random_chi2.max(1.0)).collect();
    let quantiles = [0.25, 0.5, 0.75].map(|q| quantile(&ratios, q));
    format!(
        "| figure | measured [95 % interval] | to reach |\n|---|---|---|\n\
         | cases / ties of the truth with something else / separable ones | {} / {} / {} | |\n\
         | separable ties that the suggested experiment resolves | {} | ≥ 80 % |\n\
         | … that a random protocol of equal length resolves | {} | |\n\
         | discriminating χ², suggested over random: median (quartiles) | {:.1} ({:.1} … {:.1}) | ≥ 2 |\n",
        cases.len(),
        ties.len(),
        separable.len(),
        count(|trial| trial.suggested_resolves),
        count(|trial| trial.random_resolves),
        quantiles[1],
        quantiles[0],
        quantiles[2],
    )
}
