//! `modelDescription.xml`.

use crate::LIBRARY;
use crate::units::{BASE, exponents};
use crate::variables::{Role, Variable};
use jiff::Timestamp;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::io;
use uuid::Uuid;

/// Version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    Two,
    /// FMI 3.0.
    Three,
}

/// Communication step that is proposed, s: a row.
const STEP: &str = "0.001";
/// Namespace of the tokens.
const TRUING: Uuid = Uuid::from_u128(0x7472_7569_6e67_4d66_8a6d_755f_746f_6b6e);
/// The category of what is logged.
pub const CATEGORY: &str = "logStatusError";

type Xml = Writer<Vec<u8>>;

/// What ties `modelDescription.xml` to the model and to the version of the library that reads it.
pub fn token(model: &str) -> String {
    let text = [env!("CARGO_PKG_VERSION"), model].join("\n");
    format!("{{{}}}", Uuid::new_v5(&TRUING, text.as_bytes()))
}

/// The file, of now. `model`: the text of the model file; `about`: what the model is.
pub fn xml(version: Version, model: &str, about: &str, variables: &[Variable]) -> io::Result<Vec<u8>> {
    let mut out = Writer::new_with_indent(Vec::new(), b' ', 2);
    out.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let (number, token_key, state) = match version {
        Version::Two => ("2.0", "guid", "canGetAndSetFMUstate"),
        Version::Three => ("3.0", "instantiationToken", "canGetAndSetFMUState"),
    };
    let made = Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string();
    let steps = "canHandleVariableCommunicationStepSize";
    let head = [
        ("fmiVersion", number),
        ("modelName", LIBRARY),
        (token_key, &token(model)),
        ("description", about),
        ("generationTool", concat!("Truing ", env!("CARGO_PKG_VERSION"))),
        ("generationDateAndTime", &made),
        ("variableNamingConvention", "structured"),
    ];
    out.create_element("fmiModelDescription").with_attributes(head).write_inner_content(|out| {
        empty(out, "CoSimulation", &[("modelIdentifier", LIBRARY), (steps, "true"), (state, "true")])?;
        units(out, variables)?;
        let category = [("name", CATEGORY), ("description", "Why a call cannot be done")];
        nested(out, "LogCategories", |out| empty(out, "Category", &category))?;
        empty(out, "DefaultExperiment", &[("startTime", "0"), ("stopTime", "5"), ("stepSize", STEP)])?;
        nested(out, "ModelVariables", |out| listed(out, version, variables))?;
        nested(out, "ModelStructure", |out| structure(out, version, variables))
    })?;
    Ok(out.into_inner())
}

fn empty(out: &mut Xml, name: &str, with: &[(&str, &str)]) -> io::Result<()> {
    out.create_element(name).with_attributes(with.iter().copied()).write_empty().map(|_| ())
}

fn nested(out: &mut Xml, name: &str, inside: impl FnOnce(&mut Xml) -> io::Result<()>) -> io::Result<()> {
    out.create_element(name).write_inner_content(inside).map(|_| ())
}

fn units(out: &mut Xml, variables: &[Variable]) -> io::Result<()> {
    let mut names: Vec<&str> =
        variables.iter().map(|it| it.unit.as_str()).filter(|it| !it.is_empty()).collect();
    names.sort_unstable();
    names.dedup();
    nested(out, "UnitDefinitions", |out| {
        names.into_iter().try_for_each(|name| {
            let of = exponents(name).unwrap_or_default().map(|power| power.to_string());
            let powers =
                BASE.into_iter().zip(of.iter().map(String::as_str)).filter(|(_, power)| *power != "0");
            let powers: Vec<(&str, &str)> = powers.collect();
            let unit = out.create_element("Unit").with_attribute(("name", name));
            unit.write_inner_content(|out| empty(out, "BaseUnit", &powers)).map(|_| ())
        })
    })
}

fn listed(out: &mut Xml, version: Version, variables: &[Variable]) -> io::Result<()> {
    for (reference, variable) in variables.iter().enumerate() {
        let (reference, start) = (reference.to_string(), variable.start.to_string());
        let (causality, variability, initial, given) = match variable.role {
            Role::Time => ("independent", "continuous", None, false),
            Role::Parameter(_) => ("parameter", "fixed", Some("exact"), true),
            Role::Input(_) => ("input", "continuous", None, true),
            Role::Output(_) => ("output", "continuous", Some("calculated"), false),
        };
        let mut kept = vec![
            ("name", variable.name.as_str()),
            ("valueReference", &reference),
            ("description", &variable.about),
            ("causality", causality),
            ("variability", variability),
        ];
        kept.extend(initial.map(|initial| ("initial", initial)));
        let mut typed = vec![("unit", variable.unit.as_str()), ("start", &start)];
        typed.retain(|(key, value)| if *key == "unit" { !value.is_empty() } else { given });
        if version == Version::Three {
            empty(out, "Float64", &[kept, typed].concat())?;
            continue;
        }
        let scalar = out.create_element("ScalarVariable").with_attributes(kept);
        scalar.write_inner_content(|out| empty(out, "Real", &typed))?;
    }
    Ok(())
}

/// No output depends on an input at the same moment, not even at the start.
fn structure(out: &mut Xml, version: Version, variables: &[Variable]) -> io::Result<()> {
    let outputs = variables.iter().enumerate().filter(|(_, it)| matches!(it.role, Role::Output(_)));
    let outputs: Vec<usize> = outputs.map(|(reference, _)| reference).collect();
    let unknown =
        |out: &mut Xml, name: &str, which: (&str, &str)| empty(out, name, &[which, ("dependencies", "")]);
    match version {
        Version::Three => ["Output", "InitialUnknown"].into_iter().try_for_each(|element| {
            outputs.iter().try_for_each(|at| unknown(out, element, ("valueReference", &at.to_string())))
        }),
        // Indices count from 1.
        Version::Two => ["Outputs", "InitialUnknowns"].into_iter().try_for_each(|list| {
            nested(out, list, |out| {
                outputs.iter().try_for_each(|at| unknown(out, "Unknown", ("index", &(at + 1).to_string())))
            })
        }),
    }
}
