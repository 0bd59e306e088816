//! Reading a model from TOML. Every defect names section, key, line and remedy.

use super::file::File;
use super::keys::{self, KINDS, SPEEDS, UNNAMED};
use super::section::Section;
use super::unnamed::Unnamed;
use super::{DEFAULT_TOLERANCE, Encoder, Kind, Known, Model, Sensors, Side, SpeedSensor};
use crate::console::input_error::{InputError, nearest};
use crate::system::effects::{self, LIBRARY};
use std::path::Path;
use toml::{Table, Value};

/// Reads a model from a file.
pub fn read(path: &Path) -> Result<Model, InputError> {
    let source = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|e| InputError::file(&source, format!("cannot be read ({e}); check the path")))?;
    parse(&source, &text)
}

/// Reads a model from a text; `source` names it in messages.
pub fn parse(source: &str, text: &str) -> Result<Model, InputError> {
    let file = File { source, text };
    let root: Table = text.parse().map_err(|e: toml::de::Error| file.syntax(&e))?;
    file.schema(&root)?;
    file.sections(&root)?;
    let model = file.section(&root, "model")?;
    let (kind, gear_ratio) = file.kind(&root, &model)?;
    let (default_tolerance, tolerances) = file.tolerances(&root, &kind)?;
    let supply = file.section(&root, "supply")?;
    Ok(Model {
        source: source.to_owned(),
        source_text: text.to_owned(),
        kind,
        gear_ratio,
        default_tolerance,
        tolerances,
        supply_nominal_v: supply.positive_or_none("nominal_v")?,
        supply_limit_v: supply.positive_or_none("limit_v")?,
        encoder: file.encoder(&root)?,
        sensors: file.sensors(&root)?,
        sample_hz: sample_hz(&root),
        known: file.known(&root, matches!(kind, Kind::Inertia { linear: true, .. }))?,
        unnamed: file.all_unnamed(&root)?,
        fitted_to_log: model.flag("fitted_to_log")?.or(file.root_flag(&root)).unwrap_or(false),
        texts: texts(&root),
    })
}

impl<'a> File<'a> {
    fn section(&'a self, root: &Table, name: &str) -> Result<Section<'a>, InputError> {
        let table = match root.get(name) {
            None => Table::new(),
            Some(Value::Table(table)) => table.clone(),
            Some(_) => return Err(self.wrong("", name, &format!("must be a section: write [{name}]"))),
        };
        Ok(Section { file: self, name: name.to_owned(), table })
    }

    fn root_flag(&self, root: &Table) -> Option<bool> {
        root.get("fitted_to_log").and_then(Value::as_bool)
    }

    /// The base and the gear ratio. `first_order` and `inertia` may have their numbers under [model] or [motor].
    fn kind(&'a self, root: &Table, model: &Section<'a>) -> Result<(Kind, f64), InputError> {
        let mut motor = self.section(root, "motor")?;
        for (key, value) in model.table.iter().filter(|(_, value)| !value.is_str()) {
            motor.table.entry(key.clone()).or_insert(value.clone());
        }
        let gear_ratio = motor.positive_or_none("gear_ratio")?.unwrap_or(1.0);
        let kind = match model.text("kind")?.as_deref().unwrap_or("dc_motor") {
            "dc_motor" => self.dc_motor(&motor)?,
            "first_order" => Kind::FirstOrder {
                gain_rad_s_per_v: motor.positive("gain_rad_s_per_v")?,
                time_constant_s: motor.positive("time_constant_s")?,
            },
            "inertia" => self.inertia(&motor)?,
            other => {
                let near = nearest(other, KINDS).unwrap_or("dc_motor");
                return Err(self.wrong(
                    "model",
                    "kind",
                    &format!("\"{other}\" is unknown; the nearest is \"{near}\""),
                ));
            }
        };
        Ok((kind, gear_ratio))
    }

    fn dc_motor(&self, motor: &Section) -> Result<Kind, InputError> {
        let (kt, ke) =
            match (motor.positive_or_none("Kt_nm_per_a")?, motor.positive_or_none("Ke_vs_per_rad")?) {
                (None, None) => return motor.positive("Kt_nm_per_a").map(|_| unreachable!("absent")),
                // In SI units the two constants of a brushed motor are the same number.
                (Some(k), None) | (None, Some(k)) => (k, k),
                (Some(kt), Some(ke)) => (kt, ke),
            };
        Ok(Kind::DcMotor {
            r_ohm: motor.positive("R_ohm")?,
            l_h: motor.not_negative("L_h")?.unwrap_or(0.0),
            kt_nm_per_a: kt,
            ke_vs_per_rad: ke,
            j_kgm2: motor.positive("J_kgm2")?,
            b_nms_per_rad: motor.not_negative("b_nms_per_rad")?.unwrap_or(0.0),
        })
    }

    fn inertia(&self, motor: &Section) -> Result<Kind, InputError> {
        let (inertia, linear) =
            match (motor.positive_or_none("inertia_kgm2")?, motor.positive_or_none("mass_kg")?) {
                (Some(_), Some(_)) => {
                    return Err(self.wrong(
                        &motor.name,
                        "mass_kg",
                        "stands beside inertia_kgm2; keep one of them",
                    ));
                }
                (None, Some(mass)) => (mass, true),
                (Some(inertia), None) => (inertia, false),
                (None, None) => {
                    return Err(self.wrong(&motor.name, "inertia_kgm2", "(or mass_kg) is missing"));
                }
            };
        let drive_gain = motor.positive_or_none("drive_gain")?.unwrap_or(1.0);
        Ok(Kind::Inertia {
            inertia,
            viscous: motor.not_negative("viscous")?.unwrap_or(0.0),
            drive_gain,
            linear,
        })
    }

    fn tolerances(
        &'a self,
        root: &Table,
        _: &Kind,
    ) -> Result<(f64, std::collections::BTreeMap<String, f64>), InputError> {
        let section = self.section(root, "tolerance")?;
        let mut by_key = std::collections::BTreeMap::new();
        for key in section.table.iter().filter(|(_, value)| !value.is_str()).map(|(key, _)| key) {
            let value = section.not_negative(key)?.expect("the key is there");
            by_key.insert(key.clone(), value);
        }
        let default = by_key.remove("default").unwrap_or(DEFAULT_TOLERANCE);
        Ok((default, by_key))
    }

    fn encoder(&'a self, root: &Table) -> Result<Option<Encoder>, InputError> {
        let section = self.section(root, "encoder")?;
        let side = match section.text("side")?.as_deref() {
            None | Some("motor") => Side::Motor,
            Some("load" | "output") => Side::Load,
            Some(other) => {
                return Err(self.wrong(
                    "encoder",
                    "side",
                    &format!("\"{other}\" is unknown; write \"motor\" or \"load\""),
                ));
            }
        };
        Ok(section.positive_or_none("counts_per_rev")?.map(|counts_per_rev| Encoder { counts_per_rev, side }))
    }

    fn sensors(&'a self, root: &Table) -> Result<Sensors, InputError> {
        let section = self.section(root, "sensors")?;
        let speed = match section.text("speed")?.as_deref() {
            Some("encoder_difference_centred") => SpeedSensor::EncoderDifferenceCentred,
            Some("encoder_difference_causal") => SpeedSensor::EncoderDifferenceCausal,
            Some("analog_tacho") => SpeedSensor::AnalogTacho,
            Some(other) => self.described(other)?,
            None => SpeedSensor::Unknown,
        };
        Ok(Sensors {
            speed,
            speed_window_s: section.not_negative("speed_window_s")?.unwrap_or(0.0),
            current_logged: section.flag("current_logged")?,
            vbus_logged: section.flag("vbus_logged")?,
        })
    }

    /// A speed sensor in the user's own words, of which no window is known.
    fn described(&self, words: &str) -> Result<SpeedSensor, InputError> {
        let Some(near) = keys::speed_meant(words) else {
            return Ok(SpeedSensor::Unknown);
        };
        let known = SPEEDS.map(|name| format!("\"{name}\"")).join(", ");
        let what = format!(
            "\"{words}\" is unknown; the nearest is \"{near}\"; write one of {known}, or a description in other words"
        );
        Err(self.wrong("sensors", "speed", &what))
    }

    fn known(&'a self, root: &Table, linear: bool) -> Result<Vec<Known>, InputError> {
        let section = self.section(root, "known")?;
        section
            .table
            .iter()
            .filter(|(name, value)| !value.is_str() && !name.starts_with(UNNAMED))
            .map(|(name, value)| self.one_known(name, value, linear))
            .collect()
    }

    fn all_unnamed(&'a self, root: &Table) -> Result<Vec<Unnamed>, InputError> {
        let section = self.section(root, "known")?;
        let terms = section.table.iter().filter(|(name, _)| name.starts_with(UNNAMED));
        terms
            .map(|(name, value)| match value {
                Value::Table(table) => self.unnamed(name, table),
                _ => Err(self.wrong("known", name, &format!("must be a section: write [known.{name}]"))),
            })
            .collect()
    }

    fn one_known(&'a self, name: &str, value: &Value, linear: bool) -> Result<Known, InputError> {
        let place = format!("known.{name}");
        let effect = effects::find(name).ok_or_else(|| {
            let near = nearest(name, LIBRARY.iter().map(|effect| effect.name))
                .unwrap_or(effects::COULOMB_FRICTION.name);
            self.wrong(&place, "", &format!("is no known effect; the nearest is [known.{near}]"))
        })?;
        let Value::Table(table) = value else {
            return Err(self.wrong("known", name, &format!("must be a section: write [known.{name}]")));
        };
        let section = Section { file: self, name: place, table: table.clone() };
        section.known(effect, linear)
    }
}

/// Informative: whatever is written there, it never stops a run.
fn sample_hz(root: &Table) -> Option<f64> {
    let value = root.get("log")?.get("sample_hz")?;
    let number = value.as_float().or(value.as_integer().map(|hz| hz as f64));
    number.filter(|hz| hz.is_finite() && *hz > 0.0)
}

/// Every text of the file with its section.
fn texts(root: &Table) -> Vec<(String, String, String)> {
    let mut found = Vec::new();
    collect_texts("", root, &mut found);
    found
}

fn collect_texts(section: &str, table: &Table, found: &mut Vec<(String, String, String)>) {
    for (key, value) in table {
        match value {
            Value::String(text) => found.push((section.to_owned(), key.clone(), text.clone())),
            Value::Table(inner) => {
                let name = if section.is_empty() { key.clone() } else { format!("{section}.{key}") };
                collect_texts(&name, inner, found);
            }
            _ => {}
        }
    }
}
