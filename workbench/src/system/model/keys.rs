//! The keys of a model file. A number or a switch must be one of them; a text may have any name that is not a typing error
//! of one of them.

use crate::console::input_error::mistyped;

/// Sections and the keys whose values are numbers or switches.
pub const SECTIONS: &[(&str, &[&str])] = &[
    (
        "model",
        &[
            "fitted_to_log",
            "gain_rad_s_per_v",
            "time_constant_s",
            "inertia_kgm2",
            "mass_kg",
            "viscous",
            "drive_gain",
            "gear_ratio",
        ],
    ),
    (
        "motor",
        &[
            "R_ohm",
            "L_h",
            "Kt_nm_per_a",
            "Ke_vs_per_rad",
            "J_kgm2",
            "b_nms_per_rad",
            "gear_ratio",
            "gain_rad_s_per_v",
            "time_constant_s",
            "inertia_kgm2",
            "mass_kg",
            "viscous",
            "drive_gain",
        ],
    ),
    (
        "tolerance",
        &[
            "default",
            "R_ohm",
            "L_h",
            "Kt_nm_per_a",
            "Ke_vs_per_rad",
            "J_kgm2",
            "b_nms_per_rad",
            "gain_rad_s_per_v",
            "time_constant_s",
            "inertia_kgm2",
            "mass_kg",
            "viscous",
            "drive_gain",
        ],
    ),
    ("supply", &["nominal_v", "limit_v"]),
    ("encoder", &["counts_per_rev"]),
    ("sensors", &["speed_window_s", "current_logged", "vbus_logged"]),
    ("log", &["sample_hz"]),
];

/// Keys whose values are texts that mean something, by section; the empty one is the file outside of sections.
const TEXTS: &[(&str, &[&str])] = &[
    ("", &["schema", "id", "description", "fitted_to_log"]),
    ("model", &["kind", "equation", "source", "id", "description", "drive_gain_unit"]),
    ("motor", &["drive_gain_unit"]),
    ("encoder", &["side"]),
    ("sensors", &["speed"]),
];

/// Values of `[model] kind`.
pub const KINDS: [&str; 3] = ["dc_motor", "first_order", "inertia"];

/// Values of `[sensors] speed` that the program knows; others are a description.
pub const SPEEDS: [&str; 3] = ["encoder_difference_centred", "encoder_difference_causal", "analog_tacho"];

/// Key of a known effect: how sure the gap workflow was of its name.
pub const STANDING: &str = "standing";
/// Its value where no other name explains the data and nothing else is left.
pub const NAMED: &str = "named";

/// How the sections of terms without a name begin.
pub const UNNAMED: &str = "unnamed_";
/// Key of their variables.
pub const OVER: &str = "over";
/// Key of what a term acts on.
pub const ACTS: &str = "acts";
/// Key of the speed below which no direction is certain.
pub const STANDSTILL: &str = "standstill_speed";
/// Key of their values.
pub const VALUES: &str = "values";
/// Key of the standard deviations of those.
pub const VALUES_STD: &str = "values_std";

/// Letters of a part of a known value that is more than a word of a description.
const PART: usize = 8;

/// Keys of a section that are known besides `numbers`.
pub fn texts(section: &str) -> &'static [&'static str] {
    if section.starts_with("known.unnamed_") {
        return &["origin", STANDING, ACTS];
    }
    if section.starts_with("known.") {
        return &["origin", STANDING];
    }
    let found = TEXTS.iter().find(|(name, _)| *name == section);
    found.map_or(&[], |(_, keys)| keys)
}

/// The known key of which the name of a text is a typing error.
pub fn meant<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> Option<&'a str> {
    match known.clone().any(|key| key == name) {
        true => None,
        false => known.into_iter().find(|key| mistyped(name, key)),
    }
}

/// The known value that `text` was probably to be: a part of it, or mistyped. A description in words is none.
pub fn speed_meant(text: &str) -> Option<&'static str> {
    let almost = |known: &&str| {
        let begin: String = known.chars().take(text.chars().count()).collect();
        (text.len() >= PART && known.contains(text)) || mistyped(text, known) || mistyped(text, &begin)
    };
    match text.is_empty() || SPEEDS.contains(&text) {
        true => None,
        false => SPEEDS.into_iter().find(almost),
    }
}
