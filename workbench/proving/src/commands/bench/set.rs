//! The fixed set: drawn cases with their seeds, the paper's table, rigs.

use crate::commands::rig::Rig;
use crate::commands::{judge, paper};
use crate::synthetic::cases::Set::{self, Nothing, Outside, Pair, Single, Triple};
use crate::synthetic::cases::{self, Spec, draw};
use clap::ValueEnum;
use std::path::Path;
use truing_core::gap::{Options, tables};
use truing_core::outcome::Outcome;
use truing_core::system::log::{self, Columns, Log};
use truing_core::system::model::{self, Model};
use truing_report::console::watched::watched;

/// Drawn cases without `--drawn`.
pub const USUAL: u32 = 15;
/// Drawn cases at most.
pub const MOST: i64 = 60;
/// The first seed of each set: design seeds.
const FIRST: u32 = 7801;
/// What is drawn, again and again: the first cases are a sample of all of them.
const MIX: [Set; 10] = [Single, Nothing, Pair, Single, Triple, Single, Pair, Outside, Single, Single];
/// Rigs whose data are in the repository and whose searches are short.
const SHORT: [&str; 4] = ["angel_drive", "frc501_drive", "spectrum_shooter", "un_map"];
/// Where they lie, from the project's folder.
const RIGS: &str = "data/rigs";

/// A case of the bench.
pub enum Case {
    /// Drawn, with its seed.
    Drawn(Set, u32),
    /// The paper's motor and its table of speeds.
    Paper,
    /// A measured rig.
    Rig(Box<Rig>),
}

/// A case before its search.
pub enum Ready<'c> {
    /// Model, log and held-out record.
    Record(Box<(Model, Log, Log)>),
    /// The paper's.
    Paper,
    /// A rig is read when it is answered.
    Rig(&'c Rig),
}

/// So many drawn cases, the paper's table, the short rigs of the repository and those of a folder.
pub fn cases(drawn: u32, data: Option<&Path>) -> anyhow::Result<Vec<Case>> {
    let seed = |place: usize| {
        let set = MIX[place % MIX.len()];
        let earlier = (0..place).filter(|earlier| MIX[earlier % MIX.len()] == set).count();
        Case::Drawn(set, FIRST + earlier as u32)
    };
    let mut cases: Vec<Case> = (0..drawn as usize).map(seed).collect();
    cases.push(Case::Paper);
    let shipped = Path::new(RIGS);
    match shipped.is_dir() {
        true => cases.extend(short(shipped)?),
        false => errln!("{RIGS} is not here: the rigs of the project are left out"),
    }
    if let Some(data) = data {
        let own = Rig::with_models(data)?;
        let known = |rig: &Rig| cases.iter().any(|case| case.name() == rig.name);
        let more: Vec<Rig> = own.into_iter().filter(|rig| !known(rig)).collect();
        cases.extend(more.into_iter().map(|rig| Case::Rig(Box::new(rig))));
    }
    Ok(cases)
}

fn short(folder: &Path) -> anyhow::Result<impl Iterator<Item = Case>> {
    let rigs = Rig::all(folder)?.into_iter();
    Ok(rigs.filter(|rig| SHORT.contains(&rig.name.as_str())).map(|rig| Case::Rig(Box::new(rig))))
}

impl Case {
    /// For the table.
    pub fn name(&self) -> String {
        match self {
            Self::Drawn(set, seed) => {
                let name = set.to_possible_value().expect("a set has a name");
                format!("{}-{seed}", name.get_name())
            }
            Self::Paper => "paper-table".into(),
            Self::Rig(rig) => rig.name.clone(),
        }
    }

    /// Draws it, if it is one that is drawn.
    pub fn made_ready(&self) -> anyhow::Result<Ready<'_>> {
        Ok(match self {
            Self::Drawn(set, seed) => Ready::Record(Box::new(opened(&draw(&Spec::new(*set), *seed))?)),
            Self::Paper => Ready::Paper,
            Self::Rig(rig) => Ready::Rig(rig),
        })
    }
}

/// A drawn case, read as a user's files.
fn opened(case: &cases::Case) -> anyhow::Result<(Model, Log, Log)> {
    let read =
        |name: &str, sheet: &cases::sheet::Sheet| log::parse(name, &sheet.to_csv(), &Columns::default());
    let model = model::parse("model.toml", &case.model)?;
    Ok((model, read("log.csv", &case.log)?, read("holdout.csv", &case.holdout)?))
}

impl Ready<'_> {
    /// The answer of the gap workflow; `None` if the data are absent.
    pub fn answer(&self, data: Option<&Path>) -> anyhow::Result<Option<Outcome>> {
        let options = Options::default();
        Ok(match self {
            Self::Record(files) => {
                let (model, log, holdout) = &**files;
                Some(watched(model, log, std::slice::from_ref(holdout), &options)?)
            }
            Self::Paper => Some(tables::run(&paper::motor(), &paper::table(), &[], &[])),
            // What an expect.toml names lies beside the folder of rigs.
            Self::Rig(rig) => judge::answer(rig, data.and_then(Path::parent), &options)?,
        })
    }
}
