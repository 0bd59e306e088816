//! What is printed on a motor, and the numbers of a model that follow from it. The equations stand in `docs/model.md`.

use super::units::{self, Measure};
use clap::Args;

/// What a person knows of a motor, in SI units. Figures of the shaft belong to the output of the gear where `printed_at_output`
/// says so.
#[derive(Args, Clone, Debug, Default)]
pub struct Sheet {
    /// Supply or rated voltage, V.
    #[arg(long, value_parser = of(&units::VOLTAGE), allow_negative_numbers = true)]
    pub voltage: Option<f64>,
    /// No-load speed at that voltage, rpm.
    #[arg(long = "no-load-rpm", value_name = "NO_LOAD_RPM", value_parser = of(&units::SPEED), allow_negative_numbers = true)]
    pub no_load_rad_s: Option<f64>,
    /// No-load current, A.
    #[arg(long, value_parser = of(&units::CURRENT), allow_negative_numbers = true)]
    pub no_load_current: Option<f64>,
    /// Stall current at that voltage, A.
    #[arg(long, value_parser = of(&units::CURRENT), allow_negative_numbers = true)]
    pub stall_current: Option<f64>,
    /// Stall torque at that voltage, N m.
    #[arg(long, value_parser = of(&units::TORQUE), allow_negative_numbers = true)]
    pub stall_torque: Option<f64>,
    /// Resistance between the terminals, Ω.
    #[arg(long, value_parser = of(&units::RESISTANCE), allow_negative_numbers = true)]
    pub resistance: Option<f64>,
    /// Torque constant, N m/A.
    #[arg(long = "kt", value_name = "KT", value_parser = of(&units::TORQUE_CONSTANT), allow_negative_numbers = true)]
    pub torque_constant: Option<f64>,
    /// Back-EMF constant, V s/rad.
    #[arg(long = "ke", value_name = "KE", value_parser = of(&units::BACK_EMF), allow_negative_numbers = true)]
    pub back_emf: Option<f64>,
    /// Inertia of the rotor, kg m².
    #[arg(long, value_parser = of(&units::INERTIA), allow_negative_numbers = true)]
    pub inertia: Option<f64>,
    /// Turns of the motor per turn of the output of its gear.
    #[arg(long, value_parser = of(&units::PLAIN), allow_negative_numbers = true)]
    pub gear: Option<f64>,
    /// The printed speed, torque, constants and inertia are those of the output of the gear, not of the motor.
    #[arg(long, requires = "gear")]
    pub printed_at_output: bool,
    /// The encoder sits at the output of the gear, not at the motor.
    #[arg(long, requires = "gear")]
    pub encoder_at_output: bool,
    /// Counts of the encoder per turn of its shaft, after ×4 decoding.
    #[arg(long, value_parser = of(&units::PLAIN), allow_negative_numbers = true)]
    pub counts_per_rev: Option<f64>,
    /// Time over which the logged speed is a mean, s; found from the steps of the speed where it can be.
    #[arg(long = "speed-window", value_name = "SPEED_WINDOW", value_parser = of(&units::SECONDS), allow_negative_numbers = true)]
    pub speed_window_s: Option<f64>,
}

/// Reads the value of a flag.
fn of(measure: &'static Measure) -> impl Fn(&str) -> Result<f64, String> + Clone {
    |text| measure.read(text)
}

/// A number of the model, and where it comes from.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    pub key: &'static str,
    pub value: f64,
    /// For the comment behind it.
    pub origin: String,
    /// Relative tolerance, 1 σ.
    pub tolerance: f64,
}

/// The key of a back-EMF constant of its own.
pub const KE: &str = "Ke_vs_per_rad";
/// A label gives two digits, and motors of one type differ by a tenth.
const PRINTED: f64 = 0.1;
/// A stall current is measured on a cold winding with leads and bridge left out, or extrapolated.
const FROM_STALL: f64 = 0.2;
/// Without the no-load current the drop over the winding is left out: a few per cent of the supply for good motors, up to 15 % for
/// small ones with a gear.
const WITHOUT_DROP: f64 = 0.15;
/// The inertia that is printed is the rotor's; what it drives adds to it.
const ROTOR_ALONE: f64 = 1.0;

impl Sheet {
    /// True if nothing of the motor itself is known.
    pub fn is_empty(&self) -> bool {
        let shaft =
            [self.no_load_rad_s, self.stall_torque, self.torque_constant, self.back_emf, self.inertia];
        let winding = [self.stall_current, self.resistance, self.no_load_current];
        shaft.iter().chain(&winding).all(Option::is_none)
    }

    /// Figures that say nothing without another one, and figures that contradict each other; each with what to do.
    pub fn complaints(&self) -> Vec<String> {
        let (volts, constant) = (self.voltage.is_some(), self.torque_constant.or(self.back_emf).is_some());
        let torque = self.stall_current.is_some() || volts && (constant || self.no_load_rad_s.is_some());
        let idle = self.no_load_current.zip(self.stall_current).filter(|(idle, stall)| idle >= stall);
        let current = self.stall_current.is_some() && !volts && self.stall_torque.is_none();
        let lone = [
            (self.no_load_rad_s.is_some() && !volts, "no-load-rpm needs --voltage, at which it was measured"),
            (current, "stall-current needs --voltage, at which it was measured,"),
            (
                self.stall_torque.is_some() && !torque,
                "stall-torque needs --stall-current, or --voltage and --kt,",
            ),
        ];
        let lone =
            lone.into_iter().filter(|(given, _)| *given).map(|(_, needs)| format!("--{needs} beside it"));
        let exchanged = |(idle, stall)| {
            format!("--no-load-current {idle} A is not below --stall-current {stall} A; are they exchanged?")
        };
        lone.chain(idle.map(exchanged)).collect()
    }

    /// Resistance, motor constant and inertia as far as they are known, referred to the shaft with the encoder.
    pub fn numbers(&self) -> Vec<Number> {
        let constant = self.constant();
        let resistance = self.winding(constant.as_ref());
        [resistance, constant, self.rotor(), self.back_emf_beside_kt()].into_iter().flatten().collect()
    }

    /// Turns of the shaft that the figures belong to per turn of the encoder's shaft.
    fn turns(&self) -> f64 {
        let gear = self.gear.unwrap_or(1.0);
        match (self.printed_at_output, self.encoder_at_output) {
            (true, false) => 1.0 / gear,
            (false, true) => gear,
            _ => 1.0,
        }
    }

    /// Speed per volt that the encoder's shaft should reach without load, rad/s/V.
    pub fn expected_gain(&self) -> Option<f64> {
        Some(self.no_load_rad_s? / self.turns() / self.voltage?)
    }

    /// R = U/I_stall, or U·Kt/M_stall.
    fn winding(&self, constant: Option<&Number>) -> Option<Number> {
        let number = |value: f64, origin: &str, tolerance: f64| {
            Some(Number { key: "R_ohm", value, origin: origin.into(), tolerance })
        };
        if let Some(resistance) = self.resistance {
            return number(resistance, "printed on the motor, or measured", PRINTED);
        }
        let volts = self.voltage?;
        if let Some(current) = self.stall_current {
            return number(volts / current, "voltage over stall current: U/I_stall", FROM_STALL);
        }
        // At the shaft of the figures: constant and torque are referred alike.
        let (constant, torque) = (constant?.value / self.turns(), self.stall_torque?);
        number(volts * constant / torque, "voltage times Kt over stall torque: U Kt/M_stall", FROM_STALL)
    }

    /// Kt = Ke: printed, from the no-load speed (U − R I0)/ω0, or from the stall torque M_stall/(I_stall − I0).
    fn constant(&self) -> Option<Number> {
        let referred = |value: f64, origin: &str, tolerance: f64| {
            let origin = format!("{origin}{}", self.at_the_encoder());
            Some(Number { key: "Kt_nm_per_a", value: value * self.turns(), origin, tolerance })
        };
        if let Some(constant) = self.torque_constant {
            return referred(constant, "printed on the motor", PRINTED);
        }
        if let Some(constant) = self.back_emf {
            return referred(constant, "Kt = Ke, printed on the motor", PRINTED);
        }
        if let (Some(speed), Some(volts)) = (self.no_load_rad_s, self.voltage) {
            let resistance = self.resistance.or(self.stall_current.map(|current| volts / current));
            return match (self.no_load_current, resistance) {
                (Some(idle), Some(resistance)) if resistance * idle < volts => referred(
                    (volts - resistance * idle) / speed,
                    "voltage and no-load speed: Kt = Ke = (U − R I0)/ω0",
                    PRINTED,
                ),
                _ => referred(
                    volts / speed,
                    "voltage over no-load speed: Kt = Ke = U/ω0, a few per cent too large without R and I0",
                    WITHOUT_DROP,
                ),
            };
        }
        let current = self.stall_current? - self.no_load_current.unwrap_or(0.0);
        if current <= 0.0 {
            return None;
        }
        referred(
            self.stall_torque? / current,
            "stall torque over stall current: M_stall/(I_stall − I0)",
            FROM_STALL,
        )
    }

    /// A back-EMF constant that is printed beside a torque constant.
    fn back_emf_beside_kt(&self) -> Option<Number> {
        let value = self.torque_constant.and(self.back_emf)? * self.turns();
        let origin = format!("printed on the motor{}", self.at_the_encoder());
        Some(Number { key: KE, value, origin, tolerance: PRINTED })
    }

    /// What is stated is the rotor's inertia: the load is on no label.
    fn rotor(&self) -> Option<Number> {
        let value = self.inertia? * self.turns() * self.turns();
        let origin = format!("printed on the motor{}; the load adds to it", self.at_the_encoder());
        Some(Number { key: "J_kgm2", value, origin, tolerance: ROTOR_ALONE })
    }

    fn at_the_encoder(&self) -> &'static str {
        if self.turns() == 1.0 { "" } else { ", referred to the shaft with the encoder" }
    }

    /// Friction that the no-load current holds, as a voltage: R I0.
    pub fn friction_v(&self) -> Option<f64> {
        let resistance = self.numbers().into_iter().find(|number| number.key == "R_ohm")?.value;
        Some(resistance * self.no_load_current?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(sheet: &Sheet, key: &str) -> f64 {
        sheet.numbers().into_iter().find(|number| number.key == key).unwrap_or_else(|| panic!("{key}")).value
    }

    /// A 12 V motor with R = 2 Ω, K = 0.06 V s/rad and a friction of 0.012 N m: I0 = 0.2 A, ω0 = (12 − 0.4)/0.06 rad/s.
    fn printed() -> Sheet {
        Sheet {
            voltage: Some(12.0),
            no_load_rad_s: Some(11.6 / 0.06),
            no_load_current: Some(0.2),
            stall_current: Some(6.0),
            ..Sheet::default()
        }
    }

    #[test]
    fn a_label_gives_resistance_and_constant() {
        let sheet = printed();
        assert!(
            (value(&sheet, "R_ohm") - 2.0).abs() < 1e-9 && (value(&sheet, "Kt_nm_per_a") - 0.06).abs() < 1e-9
        );
        assert!((sheet.friction_v().unwrap() - 0.4).abs() < 1e-9);
        let torque = Sheet { no_load_rad_s: None, stall_torque: Some(0.06 * 5.8), ..printed() };
        assert!((value(&torque, "Kt_nm_per_a") - 0.06).abs() < 1e-9);
        let without = Sheet { no_load_current: None, stall_current: None, ..printed() };
        assert!((value(&without, "Kt_nm_per_a") / 0.06 - 12.0 / 11.6).abs() < 1e-9, "the drop is left out");
        assert!(without.numbers().iter().all(|number| number.key != "R_ohm"));
    }

    #[test]
    fn figures_are_referred_to_the_shaft_with_the_encoder() {
        // The same motor with a gear of 20: at the output it is 20 times slower and 20 times stronger.
        let output = Sheet {
            no_load_rad_s: Some(11.6 / 0.06 / 20.0),
            inertia: Some(400.0 * 1e-6),
            gear: Some(20.0),
            printed_at_output: true,
            ..printed()
        };
        assert!((value(&output, "Kt_nm_per_a") - 0.06).abs() < 1e-9);
        assert!((value(&output, "J_kgm2") / 1e-6 - 1.0).abs() < 1e-9);
        let both = Sheet { encoder_at_output: true, ..output.clone() };
        assert!((value(&both, "Kt_nm_per_a") - 1.2).abs() < 1e-9);
        let motor =
            Sheet { printed_at_output: false, encoder_at_output: true, gear: Some(20.0), ..printed() };
        assert!((value(&motor, "Kt_nm_per_a") - 1.2).abs() < 1e-9);
        assert!((motor.expected_gain().unwrap() - 11.6 / 0.06 / 20.0 / 12.0).abs() < 1e-9);
    }
}
