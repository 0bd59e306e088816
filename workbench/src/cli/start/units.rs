//! Numbers as they are printed on motors: with their unit, or in the unit that the flag states.

/// What a number measures: its SI unit, and the units in which people print it, each with what one of it is in SI units.
pub struct Measure {
    /// Where no unit is given.
    pub si: &'static str,
    others: &'static [(&'static str, f64)],
}

/// Standard gravity, m/s²: kgf cm.
const GRAVITY: f64 = 9.806_65;
/// One ounce-force inch, N m.
const OUNCE_INCH: f64 = 7.061_552e-3;
/// One revolution a minute, rad/s.
const RPM: f64 = std::f64::consts::TAU / 60.0;

/// A number without a unit.
pub const PLAIN: Measure = Measure { si: "", others: &[] };
pub const VOLTAGE: Measure = Measure { si: "V", others: &[("mv", 1e-3)] };
pub const CURRENT: Measure = Measure { si: "A", others: &[("ma", 1e-3)] };
pub const RESISTANCE: Measure = Measure { si: "ohm", others: &[("ω", 1.0), ("mohm", 1e-3), ("mω", 1e-3)] };
pub const SECONDS: Measure = Measure { si: "s", others: &[("ms", 1e-3), ("us", 1e-6)] };
pub const TORQUE: Measure = Measure {
    si: "Nm",
    others: &[
        ("mnm", 1e-3),
        ("ncm", 1e-2),
        ("kgcm", GRAVITY * 1e-2),
        ("kgfcm", GRAVITY * 1e-2),
        ("gcm", GRAVITY * 1e-5),
        ("ozin", OUNCE_INCH),
    ],
};
pub const INERTIA: Measure =
    Measure { si: "kgm2", others: &[("gcm2", 1e-7), ("kgcm2", 1e-4), ("gm2", 1e-3), ("kgmm2", 1e-6)] };
pub const TORQUE_CONSTANT: Measure = Measure {
    si: "Nm/A",
    others: &[("mnm/a", 1e-3), ("ncm/a", 1e-2), ("kgcm/a", GRAVITY * 1e-2), ("ozin/a", OUNCE_INCH)],
};
pub const BACK_EMF: Measure = Measure {
    si: "Vs/rad",
    others: &[
        ("v/(rad/s)", 1.0),
        ("mvs/rad", 1e-3),
        ("v/rpm", 1.0 / RPM),
        ("mv/rpm", 1e-3 / RPM),
        ("v/krpm", 1e-3 / RPM),
        ("v/1000rpm", 1e-3 / RPM),
    ],
};
pub const SPEED: Measure =
    Measure { si: "rpm", others: &[("rpm", RPM), ("1/min", RPM), ("r/min", RPM), ("rad/s", 1.0)] };

impl Measure {
    /// A number greater than 0 with or without one of the units; a speed without a unit is in revolutions a minute.
    pub fn read(&self, text: &str) -> Result<f64, String> {
        let text = text.trim();
        let digits = |c: char| c.is_ascii_digit() || ".,+-".contains(c);
        // An `e` belongs to the number only if digits follow it.
        let exponent = text
            .find(['e', 'E'])
            .filter(|at| text[at + 1..].starts_with(|c: char| c.is_ascii_digit() || c == '-' || c == '+'));
        let end = match exponent {
            Some(at) if text[..at].chars().all(digits) => {
                let tail = &text[at + 1..];
                at + 1 + tail.find(|c: char| !digits(c)).unwrap_or(tail.len())
            }
            _ => text.find(|c: char| !digits(c)).unwrap_or(text.len()),
        };
        let (number, unit) = text.split_at(end);
        let number: f64 = number.replace(',', ".").parse().map_err(|_| {
            format!("\"{text}\" does not begin with a number; write for example 2.2 or \"2.2 {}\"", self.si)
        })?;
        if !(number > 0.0 && number.is_finite()) {
            return Err(format!("\"{text}\" must be greater than 0"));
        }
        let per_volt = unit.to_lowercase().replace(' ', "");
        match matches!(per_volt.as_str(), "rpm/v" | "kv" | "1/min/v") && ["Vs/rad", "Nm/A"].contains(&self.si)
        {
            // KV, the speed per volt: Kt = Ke = 1/KV in SI units.
            true => Ok(1.0 / (number * RPM)),
            false => Ok(number * self.factor(unit)?),
        }
    }

    fn factor(&self, unit: &str) -> Result<f64, String> {
        let plain: String = unit.to_lowercase().chars().filter(|c| !" ·*^.-_".contains(*c)).collect();
        let plain = plain.replace('²', "2");
        let of_si = || (plain.is_empty() || plain == self.si.to_lowercase()).then_some(1.0);
        let named = |name: &str| self.others.iter().find(|other| other.0 == name).map(|other| other.1);
        // The first unit of a speed is what is meant without one.
        let without = || named(self.si).filter(|_| plain.is_empty());
        named(&plain).or_else(without).or_else(of_si).ok_or_else(|| {
            let known = self.others.iter().map(|other| other.0).collect::<Vec<&str>>().join(", ");
            format!("the unit \"{}\" is not known; write {} or one of {known}", unit.trim(), self.si)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn near(text: &str, measure: &Measure, si: f64) {
        let read = measure.read(text).unwrap();
        assert!((read / si - 1.0).abs() < 1e-6, "{text}: {read} and {si}");
    }

    #[test]
    fn numbers_are_read_in_the_units_in_which_they_are_printed() {
        near("2.2", &RESISTANCE, 2.2);
        near("0,0062 kg m²", &INERTIA, 0.0062);
        near("10.5 gcm^2", &INERTIA, 1.05e-6);
        near("23.5mNm/A", &TORQUE_CONSTANT, 0.0235);
        near("6.283185307 V/krpm", &BACK_EMF, 0.06);
        near("1.2 kg·cm", &TORQUE, 0.117_679_8);
        near("3000", &SPEED, 100.0 * std::f64::consts::PI);
        near("314.159265 rad/s", &SPEED, 100.0 * std::f64::consts::PI);
        near("6.2e-5", &INERTIA, 6.2e-5);
        near("180 mA", &CURRENT, 0.18);
        near("20ms", &SECONDS, 0.02);
        near("900rpm/V", &BACK_EMF, 60.0 / (std::f64::consts::TAU * 900.0));
        near("900 KV", &TORQUE_CONSTANT, 60.0 / (std::f64::consts::TAU * 900.0));
    }

    #[test]
    fn what_is_no_number_in_a_known_unit_is_told() {
        for (text, word) in [
            ("fast", "begin with a number"),
            ("-3 A", "greater than 0"),
            ("3 furlong", "not known"),
            ("", "number"),
        ] {
            let said = CURRENT.read(text).unwrap_err();
            assert!(said.contains(word), "{text}: {said}");
        }
    }
}
