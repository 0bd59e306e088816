//! What an export is made of, before anything is written.

use crate::held::{self, Format};
use crate::{constants, cost, helper, mjcf, numbers, plan, ranges, urdf};
use anyhow::{Context, bail};
use std::path::Path;
use truing_core::system::log::Dynamic;
use truing_core::system::model::Model;
use truing_fmu::{Version, package};

/// What decides over an export, beside its model.
#[derive(Clone, Copy, Debug)]
pub struct Request<'a> {
    /// The format.
    pub to: Format,
    /// Ranges for domain randomisation go beside it.
    pub ranges: bool,
    /// On its input it is told what the loss of an effect costs.
    pub log: Option<&'a Dynamic>,
    /// The library that an FMU carries.
    pub fmu_library: Option<&'a Path>,
}

/// Files beside one: what is added to the stem of its name, and the text.
pub type Beside = Vec<(&'static str, String)>;

/// The files of an export, and what they do not hold.
#[derive(Clone, Debug)]
pub struct Made {
    /// The file itself.
    pub file: Vec<u8>,
    /// Those beside it.
    pub beside: Beside,
    /// A line for each effect and each table that the format does not hold.
    pub lost: Vec<String>,
}

impl Made {
    /// That of a model.
    pub fn of(model: &Model, request: &Request) -> anyhow::Result<Self> {
        let head = head(model);
        let (file, mut beside) = match request.to {
            Format::SysidConstants => (constants::written(model, &head).into_bytes(), Vec::new()),
            Format::Urdf => (urdf::written(model, &head).into_bytes(), Vec::new()),
            Format::Mjcf => in_mjcf(model, &head)?,
            Format::Fmu3 => (fmu(model, Version::Three, request.fmu_library)?, Vec::new()),
            Format::Fmu2 => (fmu(model, Version::Two, request.fmu_library)?, Vec::new()),
        };
        if request.ranges {
            beside.push(("_ranges.py", ranges::written(model, &head)));
        }
        let mut lost = cost::told(model, &held::lost(model, request.to), request.log)?;
        if !request.to.is_fmu() {
            let told = |name: &String| format!("not held: {name}, a table without a name");
            lost.extend(model.unnamed.iter().map(|term| told(&term.name)));
        }
        Ok(Self { file, beside, lost })
    }

    /// What the file is as a text, if it is one.
    pub fn text(&self) -> anyhow::Result<&str> {
        std::str::from_utf8(&self.file).context("an FMU is an archive, not a text")
    }
}

/// The file, and the helper if it needs one.
fn in_mjcf(model: &Model, head: &[String]) -> anyhow::Result<(Vec<u8>, Beside)> {
    let plant = model.physics();
    if plant.source_ohm > 0.0 && !plant.supply_v.is_finite() {
        bail!("{}: a supply that sags needs its voltage; write nominal_v under [supply]", model.source);
    }
    let needs = plan::Plan::of(&plant).helper();
    let beside = needs.then(|| ("_helper.py", helper::written(&plant, head)));
    Ok((mjcf::written(model, head).into_bytes(), beside.into_iter().collect()))
}

fn fmu(model: &Model, version: Version, library: Option<&Path>) -> anyhow::Result<Vec<u8>> {
    Ok(package::packed(model, version, &package::library(library)?)?)
}

/// Origin, units, date, and every number with its deviation.
pub fn head(model: &Model) -> Vec<String> {
    let now = jiff::Timestamp::now().to_string();
    let source = Path::new(&model.source)
        .file_name()
        .map_or(model.source.clone(), |name| name.to_string_lossy().into_owned());
    let mut lines = vec![
        format!("Written by truing {} from {source}, {}.", env!("CARGO_PKG_VERSION"), &now[..10]),
        "SI units; ± is one standard deviation. The numbers of the model:".into(),
    ];
    lines.extend(numbers::stated(model).iter().map(numbers::Number::told));
    lines
}
