//! Reading a model from TOML. Every defect is told with section, key, line and remedy, all of them together.

use super::complaints::File;
use super::draft::{Draft, Unknown};
use super::file::is_unknown;
use super::keys::UNNAMED;
use super::section::Section;
use super::table::{self, KINDS};
use super::unnamed::Unnamed;
use super::{Encoder, KE, KT, Kind, Known, Model, Sensors, Side, SpeedSensor, VISCOUS_V};
use crate::system::effects::{self, LIBRARY};
use crate::text::input_error::{InputError, nearest};
use std::collections::BTreeMap;
use toml::{Table, Value};

/// Reads a model from a text; `source` names it in messages.
pub fn parse(source: &str, text: &str) -> Result<Model, InputError> {
    parse_draft(source, text)?.complete()
}

/// Reads a model of which numbers may be unknown from a text.
pub fn parse_draft(source: &str, text: &str) -> Result<Draft, InputError> {
    let file = File::new(source, text);
    let root = file.table()?;
    let kind = file.kind(&root);
    file.check(&root, kind);
    let base = Base::of(&file, &root);
    let (kind, unknown) = base.kind(kind.unwrap_or("dc_motor"));
    let linear = matches!(kind, Kind::Inertia { linear: true, .. });
    let stated = file.section(&root, "tolerance");
    let number = |key: &String| Some((key.clone(), stated.number(key)?));
    let mut tolerances: BTreeMap<String, f64> = stated.table.keys().filter_map(number).collect();
    let constant = base.constant();
    if let (Some(KE), Some(own)) = (constant, tolerances.get(KE).copied()) {
        tolerances.entry(KT.into()).or_insert(own);
    }
    let supply = file.section(&root, "supply");
    let model = Model {
        source: source.to_owned(),
        source_text: text.to_owned(),
        kind,
        constant,
        gear_ratio: base.number("gear_ratio").unwrap_or(1.0),
        tolerances,
        supply_nominal_v: supply.number("nominal_v"),
        supply_limit_v: supply.number("limit_v"),
        encoder: file.encoder(&root),
        sensors: file.sensors(&root),
        sample_hz: file.section(&root, "log").number("sample_hz").filter(|hz| *hz > 0.0),
        known: file.known(&root, linear),
        unnamed: file.all_unnamed(&root),
        fitted_to_log: fitted_to_log(&file, &root),
        by_shares: fitted_to_log(&file, &root),
        texts: texts("", &root),
        notes: Vec::new(),
    };
    file.judged()?;
    Ok(Draft { model: Model { notes: file.noted(), ..model }, unknown })
}

/// The numbers of the base, which may stand under [motor] or under [model].
struct Base<'a> {
    file: &'a File<'a>,
    motor: Table,
}

impl<'a> Base<'a> {
    fn of(file: &'a File<'a>, root: &Table) -> Self {
        let mut motor = file.section(root, "motor").table;
        for (key, value) in file.section(root, "model").table {
            motor.entry(key).or_insert(value);
        }
        Self { file, motor }
    }

    fn number(&self, key: &str) -> Option<f64> {
        self.motor.get(key).and_then(super::file::number)
    }

    fn is_unknown(&self, key: &str) -> bool {
        self.motor.get(key).and_then(Value::as_str).is_some_and(is_unknown)
    }

    /// A number that the kind needs; not a number where it is not known.
    fn needed(&self, key: &'static str, unknown: &mut Vec<Unknown>) -> f64 {
        self.number(key).unwrap_or_else(|| {
            unknown.push(self.unknown(key));
            f64::NAN
        })
    }

    /// A number that is this where it is absent, and not a number where it is stated as unknown.
    fn or(&self, key: &'static str, absent: f64, unknown: &mut Vec<Unknown>) -> f64 {
        if self.is_unknown(key) { self.needed(key, unknown) } else { self.number(key).unwrap_or(absent) }
    }

    /// The constant of a motor that is stated without the other.
    fn constant(&self) -> Option<&'static str> {
        match (self.number(KT), self.number(KE)) {
            (Some(_), Some(_)) => None,
            (None, Some(_)) => Some(KE),
            _ => Some(KT),
        }
    }

    fn unknown(&self, key: &'static str) -> Unknown {
        let stated = self.is_unknown(key);
        let name = if stated { key } else { "" };
        let lines = table::BASE.iter().map(|section| self.file.line_of(section, name));
        let line = lines.into_iter().find(|line| *line > 0).unwrap_or(0);
        Unknown { key, line, stated }
    }

    /// The equations with their numbers, and those of them that are not known.
    fn kind(&self, name: &str) -> (Kind, Vec<Unknown>) {
        let mut unknown = Vec::new();
        let kind = match name {
            "first_order" => Kind::FirstOrder {
                gain_rad_s_per_v: self.needed("gain_rad_s_per_v", &mut unknown),
                time_constant_s: self.needed("time_constant_s", &mut unknown),
                viscous_vs_per_rad: self.or(VISCOUS_V, 0.0, &mut unknown),
                electrical_s: self.or(super::ELECTRICAL, 0.0, &mut unknown),
            },
            "inertia" => self.inertia(&mut unknown),
            _ => self.dc_motor(&mut unknown),
        };
        (kind, unknown)
    }

    fn dc_motor(&self, unknown: &mut Vec<Unknown>) -> Kind {
        let r_ohm = self.needed("R_ohm", unknown);
        let l_h = self.or("L_h", 0.0, unknown);
        // In SI units the two constants of a brushed motor are the same number.
        let (kt, ke) = (self.number(KT), self.number(KE));
        let either = kt.or(ke).unwrap_or_else(|| self.needed(KT, unknown));
        Kind::DcMotor {
            r_ohm,
            l_h,
            kt_nm_per_a: kt.unwrap_or(either),
            ke_vs_per_rad: ke.unwrap_or(either),
            j_kgm2: self.needed("J_kgm2", unknown),
            b_nms_per_rad: self.or("b_nms_per_rad", 0.0, unknown),
        }
    }

    fn inertia(&self, unknown: &mut Vec<Unknown>) -> Kind {
        if let (Some(_), Some(_)) = (self.motor.get("inertia_kgm2"), self.motor.get("mass_kg")) {
            let section = if self.file.line_of("motor", "mass_kg") > 0 { "motor" } else { "model" };
            self.file.wrong(section, "mass_kg", "stands beside inertia_kgm2; keep one of them");
        }
        let linear = self.motor.contains_key("mass_kg");
        let key = if linear { "mass_kg" } else { "inertia_kgm2" };
        Kind::Inertia {
            inertia: self.needed(key, unknown),
            viscous: self.or("viscous", 0.0, unknown),
            drive_gain: self.or("drive_gain", 1.0, unknown),
            linear,
        }
    }
}

impl<'a> File<'a> {
    fn section(&'a self, root: &Table, name: &str) -> Section<'a> {
        let table = root.get(name).and_then(Value::as_table).cloned().unwrap_or_default();
        Section { file: self, name: name.to_owned(), table }
    }

    /// The kind of the model; `None`: it cannot be known, which is told.
    fn kind(&self, root: &Table) -> Option<&'static str> {
        let model = root.get("model").and_then(Value::as_table);
        match model.and_then(|model| model.get("kind")) {
            Some(Value::String(text)) => KINDS.into_iter().find(|kind| kind == text),
            Some(_) => None,
            None => self.kind_of_keys(root),
        }
    }

    /// Without `kind` a model is a motor, unless all of its numbers belong to another kind.
    fn kind_of_keys(&self, root: &Table) -> Option<&'static str> {
        let sections = table::BASE.iter().filter_map(|name| root.get(*name).and_then(Value::as_table));
        let keys: Vec<&String> = sections.flat_map(Table::keys).collect();
        let rows = || {
            keys.iter()
                .filter_map(|key| table::KEYS.iter().find(|row| row.name == *key && row.has_tolerance()))
        };
        let other = rows().find(|row| !row.read_by("dc_motor"));
        let Some(row) = other.filter(|_| !rows().any(|row| row.read_by("dc_motor"))) else {
            return Some("dc_motor");
        };
        let what = format!("{} belongs to kind = \"{}\": write it under [model]", row.name, row.kinds[0]);
        self.missing("model", "kind", &what);
        None
    }

    fn encoder(&'a self, root: &Table) -> Option<Encoder> {
        let section = self.section(root, "encoder");
        let side = match section.text("side").as_deref() {
            Some("load" | "output") => Side::Load,
            _ => Side::Motor,
        };
        let counts_per_rev = section.number("counts_per_rev");
        let told = counts_per_rev.is_some() || side == Side::Load;
        told.then_some(Encoder { counts_per_rev: counts_per_rev.unwrap_or(f64::INFINITY), side })
    }

    fn sensors(&'a self, root: &Table) -> Sensors {
        let section = self.section(root, "sensors");
        let speed = match section.text("speed").as_deref() {
            Some("encoder_difference_centred") => SpeedSensor::EncoderDifferenceCentred,
            Some("encoder_difference_causal") => SpeedSensor::EncoderDifferenceCausal,
            Some("analog_tacho") => SpeedSensor::AnalogTacho,
            _ => SpeedSensor::Unknown,
        };
        let speed_window_s = section.number("speed_window_s").unwrap_or(0.0);
        if speed_window_s > 0.0 && speed == SpeedSensor::Unknown {
            let remedy = "is not used, because [sensors] speed does not say where the window lies: write speed = \"encoder_difference_centred\" or \"encoder_difference_causal\"";
            self.note("sensors", "speed_window_s", remedy);
        }
        let (current_logged, vbus_logged) = (section.flag("current_logged"), section.flag("vbus_logged"));
        Sensors { speed, speed_window_s, current_logged, vbus_logged }
    }

    fn known(&'a self, root: &Table, linear: bool) -> Vec<Known> {
        let section = self.section(root, "known");
        let effects = section.table.iter();
        let effects = effects.filter(|(name, value)| !value.is_str() && !name.starts_with(UNNAMED));
        effects.filter_map(|(name, value)| self.one_known(name, value, linear)).collect()
    }

    fn all_unnamed(&'a self, root: &Table) -> Vec<Unnamed> {
        let section = self.section(root, "known");
        let terms = section.table.iter().filter(|(name, _)| name.starts_with(UNNAMED));
        terms.filter_map(|(name, value)| self.unnamed(name, self.table_of(name, value)?)).collect()
    }

    /// What stands under `[known]` must be a section.
    fn table_of<'v>(&self, name: &str, value: &'v Value) -> Option<&'v Table> {
        if !value.is_table() {
            self.wrong("known", name, &format!("must be a section: write [known.{name}]"));
        }
        value.as_table()
    }

    fn one_known(&'a self, name: &str, value: &Value, linear: bool) -> Option<Known> {
        let place = format!("known.{name}");
        let Some(effect) = effects::find(name) else {
            let near = nearest(name, LIBRARY.iter().map(|effect| effect.name));
            let remedy = match near {
                Some(near) => format!("the nearest is [known.{near}]"),
                None => "`truing effects` lists them".into(),
            };
            self.wrong(&place, "", &format!("is no known effect; {remedy}"));
            return None;
        };
        let table = self.table_of(name, value)?.clone();
        Some(Section { file: self, name: place, table }.known(effect, linear))
    }
}

fn fitted_to_log(file: &File, root: &Table) -> bool {
    let outside = root.get("fitted_to_log").and_then(Value::as_bool);
    file.section(root, "model").flag("fitted_to_log").or(outside).unwrap_or(false)
}

/// Every text of a table and of those in it, each with its section.
fn texts(section: &str, table: &Table) -> Vec<(String, String, String)> {
    let of_key = |(key, value): (&String, &Value)| match value {
        Value::String(text) => vec![(section.to_owned(), key.clone(), text.clone())],
        Value::Table(inner) if section.is_empty() => texts(key, inner),
        Value::Table(inner) => texts(&format!("{section}.{key}"), inner),
        _ => Vec::new(),
    };
    table.iter().flat_map(of_key).collect()
}
