//! Draws a servo whose nonlinearity nobody downstream may see: the motor that answers the firmware, what the firmware
//! may know of it (`axis.toml`) and what a data sheet would claim (`model.toml`).

use crate::synthetic::cases::base::Claim;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Supply of the drawn servo, V. A common voltage of small gear motors.
const SUPPLY_V: f64 = 12.0;
/// Relative standard deviation of data-sheet values against the real motor.
const DATASHEET_TOLERANCE: f64 = 0.05;
/// Hidden cogging of the last act: its amplitude as a share of the dead zone, and its periods per turn, those of a rotor with three slots
/// and four poles. Chosen by judgement; not studied.
const COGGING_SHARE: f64 = 0.2;
const COGGING_PERIODS: u32 = 12;

/// A servo with a hidden dead zone and saturation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HiddenServo {
    /// What really turns.
    pub motor: Claim,
    /// What the data sheet says.
    pub claimed: Claim,
    /// Dead zone for positive voltage, V.
    pub dead_zone_pos_v: f64,
    /// Dead zone for negative voltage, V, a positive magnitude.
    pub dead_zone_neg_v: f64,
    /// Limit behind the dead zone, V.
    pub limit_v: f64,
    /// Counts per revolution after ×4 decoding.
    pub counts_per_rev: u32,
    /// Rated speed as the user would type it, rad/s.
    pub rated_speed_rad_s: f64,
}

impl HiddenServo {
    /// Draws one. The ranges are those of small gear motors at 12 V: time constant 40–120 ms, 60–200 rad/s, dead zone
    /// 0.6–2 V with ±30 % between the directions, full effect of the voltage reached at 8.5–11 V.
    pub fn draw(seed: u64) -> Self {
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let (motor, no_load_speed) = draw_motor(random);
        let mean = random.random_range(0.6..2.0);
        let asymmetry = random.random_range(-0.3..0.3);
        Self {
            motor,
            claimed: motor.with_errors(random, DATASHEET_TOLERANCE, &[]),
            dead_zone_pos_v: mean * (1.0 + 0.5 * asymmetry),
            dead_zone_neg_v: mean * (1.0 - 0.5 * asymmetry),
            limit_v: random.random_range(8.8..10.8) - mean,
            counts_per_rev: [1024, 2048, 4096][random.random_range(0..3)],
            rated_speed_rad_s: no_load_speed * random.random_range(0.8..1.2),
        }
    }

    /// The motor that answers the firmware, with its hidden effects.
    pub fn motor_toml(&self) -> String {
        let Self { dead_zone_pos_v: positive, dead_zone_neg_v: negative, limit_v, .. } = self;
        let model = self.model_toml(&self.motor, "the motor behind the servo");
        format!(
            "{model}\n[known.dead_zone_asymmetric]\npos_v = {positive:.6}\nneg_v = {negative:.6}\n\n[known.voltage_saturation]\nlimit_v = {limit_v:.6}\n"
        )
    }

    /// The same with teeth in the magnets.
    pub fn cogging_motor_toml(&self) -> String {
        let volts = COGGING_SHARE * (self.dead_zone_pos_v + self.dead_zone_neg_v) / 2.0;
        let torque = volts * self.motor.K_nm_per_a / self.motor.R_ohm;
        format!(
            "{}\n[known.cogging]\namplitude_nm = {torque:.6}\nperiods_per_rev = {COGGING_PERIODS}\nphase_rad = 0.0\n",
            self.motor_toml()
        )
    }

    /// The linear model from which the gap workflow starts.
    pub fn datasheet_toml(&self) -> String {
        self.model_toml(&self.claimed, "linear model from the data sheet")
    }

    /// What the firmware may know.
    pub fn axis_toml(&self) -> String {
        format!(
            "[supply]\nnominal_v = {SUPPLY_V:.1}\n\n[encoder]\ncounts_per_rev = {}\n\n[axis]\nrated_speed_rad_s = {:.3}\ntick_hz = 5000\n",
            self.counts_per_rev, self.rated_speed_rad_s
        )
    }

    fn model_toml(&self, motor: &Claim, description: &str) -> String {
        format!(
            "schema = \"truing-model/1\"\n\n[model]\nkind = \"dc_motor\"\ndescription = \"{description}\"\n\n{}\n\
             [tolerance]\ndefault = {DATASHEET_TOLERANCE}\n\n[supply]\nnominal_v = {SUPPLY_V:.1}\nlimit_v = {SUPPLY_V:.1}\n\n\
             [encoder]\ncounts_per_rev = {}\nside = \"motor\"\n\n[sensors]\ncurrent_logged = false\nvbus_logged = true\n",
            motor.table(),
            self.counts_per_rev
        )
    }
}

/// A linear motor, and its speed at full voltage without load, rad/s.
fn draw_motor(random: &mut ChaCha8Rng) -> (Claim, f64) {
    let no_load_speed = random.random_range(60.0..200.0);
    let time_constant = random.random_range(0.04..0.12);
    let resistance = random.random_range(1.5..5.0);
    // Share of the viscous loss: R b / K². Small gear motors lose a tenth or two of their speed to it.
    let viscous_share = random.random_range(0.03..0.25);
    let constant = SUPPLY_V / no_load_speed / (1.0 + viscous_share);
    let square = constant * constant;
    let motor = Claim {
        R_ohm: resistance,
        L_h: random.random_range(0.2e-3..1.2e-3) * resistance,
        K_nm_per_a: constant,
        J_kgm2: time_constant * square * (1.0 + viscous_share) / resistance,
        b_nms_per_rad: viscous_share * square / resistance,
    };
    (motor, no_load_speed)
}
