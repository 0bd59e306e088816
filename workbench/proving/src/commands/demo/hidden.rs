//! Draws a servo whose nonlinearity nobody downstream may see: the motor that answers the firmware, what the firmware
//! may know of it (`axis.toml`) and what a data sheet would claim (`model.toml`).

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Supply of the drawn servo, V. A common voltage of small gear motors.
const SUPPLY_V: f64 = 12.0;
/// Relative standard deviation of data-sheet values against the real motor.
const DATASHEET_TOLERANCE: f64 = 0.05;

/// A linear brushed DC motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Winding resistance, Ω.
    pub resistance_ohm: f64,
    /// Winding inductance, H.
    pub inductance_h: f64,
    /// Torque constant, N m/A, equal to the back-EMF constant, V s/rad.
    pub motor_constant: f64,
    /// Inertia, kg m².
    pub inertia_kgm2: f64,
    /// Viscous friction, N m s/rad.
    pub viscous_nms: f64,
}

impl Motor {
    /// Steady speed per volt, rad/s/V: Kt/(R b + Kt Ke).
    pub fn gain(&self) -> f64 {
        self.motor_constant / self.damping()
    }

    /// Sum of the time constants of speed, s: (R J + L b)/(R b + Kt Ke), the linear term of the characteristic
    /// polynomial L J s² + (R J + L b) s + (R b + Kt Ke).
    pub fn time_constant(&self) -> f64 {
        (self.resistance_ohm * self.inertia_kgm2 + self.inductance_h * self.viscous_nms) / self.damping()
    }

    fn damping(&self) -> f64 {
        self.resistance_ohm * self.viscous_nms + self.motor_constant * self.motor_constant
    }

    /// The same motor as a data sheet has it: every value off by its tolerance, cut at two of them.
    fn as_claimed(&self, random: &mut impl Rng) -> Motor {
        let error = Normal::new(0.0, DATASHEET_TOLERANCE).expect("tolerance is positive");
        let mut off = |value: f64| {
            value * (1.0 + error.sample(random).clamp(-2.0 * DATASHEET_TOLERANCE, 2.0 * DATASHEET_TOLERANCE))
        };
        Motor {
            resistance_ohm: off(self.resistance_ohm),
            inductance_h: off(self.inductance_h),
            motor_constant: off(self.motor_constant),
            inertia_kgm2: off(self.inertia_kgm2),
            viscous_nms: off(self.viscous_nms),
        }
    }

    fn table(&self) -> String {
        let Motor { resistance_ohm: r, inductance_h: l, motor_constant: k, inertia_kgm2: j, viscous_nms: b } =
            self;
        format!(
            "[motor]\nR_ohm = {r:.6}\nL_h = {l:.9}\nKt_nm_per_a = {k:.8}\nKe_vs_per_rad = {k:.8}\nJ_kgm2 = {j:.9}\nb_nms_per_rad = {b:.9}\n"
        )
    }
}

/// A servo with a hidden dead zone and saturation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HiddenServo {
    /// What really turns.
    pub motor: Motor,
    /// What the data sheet says.
    pub claimed: Motor,
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
        let motor = draw_motor(random);
        let mean = random.random_range(0.6..2.0);
        let asymmetry = random.random_range(-0.3..0.3);
        Self {
            motor,
            claimed: motor.as_claimed(random),
            dead_zone_pos_v: mean * (1.0 + 0.5 * asymmetry),
            dead_zone_neg_v: mean * (1.0 - 0.5 * asymmetry),
            limit_v: random.random_range(8.8..10.8) - mean,
            counts_per_rev: [1024, 2048, 4096][random.random_range(0..3)],
            rated_speed_rad_s: motor.gain() * SUPPLY_V * random.random_range(0.8..1.2),
        }
    }

    /// Terminal voltage beyond which more command brings no more speed, positive direction, V.
    pub fn saturation_pos_v(&self) -> f64 {
        self.limit_v + self.dead_zone_pos_v
    }

    /// Command at which the limit acts in the negative direction, a positive magnitude, V.
    pub fn saturation_neg_v(&self) -> f64 {
        self.limit_v + self.dead_zone_neg_v
    }

    /// The motor that answers the firmware, with its hidden effects.
    pub fn motor_toml(&self) -> String {
        let Self { dead_zone_pos_v: positive, dead_zone_neg_v: negative, limit_v, .. } = self;
        let model = self.model_toml(&self.motor, "the motor behind the servo");
        format!(
            "{model}\n[known.dead_zone_asymmetric]\npos_v = {positive:.6}\nneg_v = {negative:.6}\n\n[known.voltage_saturation]\nlimit_v = {limit_v:.6}\n"
        )
    }

    /// The linear model from which the gap workflow starts.
    pub fn datasheet_toml(&self) -> String {
        self.model_toml(&self.claimed, "linear model from the data sheet")
    }

    /// What the firmware may know.
    pub fn axis_toml(&self) -> String {
        format!(
            "[supply]\nnominal_v = {SUPPLY_V:.1}\n\n[encoder]\ncounts_per_rev = {}\n\n[axis]\nrated_speed_rad_s = {:.3}\ntick_hz = 10000\n",
            self.counts_per_rev, self.rated_speed_rad_s
        )
    }

    fn model_toml(&self, motor: &Motor, description: &str) -> String {
        format!(
            "schema = \"truing-model/1\"\n\n[model]\nkind = \"dc_motor\"\ndescription = \"{description}\"\n\n{}\n\
             [tolerance]\ndefault = {DATASHEET_TOLERANCE}\n\n[supply]\nnominal_v = {SUPPLY_V:.1}\nlimit_v = {SUPPLY_V:.1}\n\n\
             [encoder]\ncounts_per_rev = {}\nside = \"motor\"\n\n[sensors]\ncurrent_logged = false\nvbus_logged = true\n",
            motor.table(),
            self.counts_per_rev
        )
    }
}

fn draw_motor(random: &mut impl Rng) -> Motor {
    let no_load_speed = random.random_range(60.0..200.0);
    let time_constant = random.random_range(0.04..0.12);
    let resistance_ohm = random.random_range(1.5..5.0);
    // Share of the viscous loss: R b / K². Small gear motors lose a tenth or two of their speed to it.
    let viscous_share = random.random_range(0.03..0.25);
    let motor_constant = SUPPLY_V / no_load_speed / (1.0 + viscous_share);
    let square = motor_constant * motor_constant;
    Motor {
        resistance_ohm,
        inductance_h: random.random_range(0.2e-3..1.2e-3) * resistance_ohm,
        motor_constant,
        inertia_kgm2: time_constant * square * (1.0 + viscous_share) / resistance_ohm,
        viscous_nms: viscous_share * square / resistance_ohm,
    }
}
