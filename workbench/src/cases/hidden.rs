//! What can be hidden: every effect of the library, drawn from barely visible to large, put into the truth.
//!
//! Nothing here touches the library's own code or bounds: names and parameter conventions alone are shared, because the
//! answer has to be compared. Sizes are relative to the motor's natural scales.

use super::base::{Natural, log_range};
use crate::truth::{Bristle, Friction, Knee, Motor, Split, Tacho, Thermal, Train};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// The motor with its sensor, under construction.
#[derive(Clone, Debug)]
pub struct Subject {
    /// The truth.
    pub motor: Motor,
    /// Scale of everything that is read from the encoder or tacho.
    pub reading_scale: f64,
    /// Added to the speed reading, rad/s.
    pub reading_offset: f64,
    /// The encoder sits at the load.
    pub encoder_at_load: bool,
}

impl Subject {
    fn tacho(&mut self) -> &mut Tacho {
        self.motor.tacho.get_or_insert_with(Tacho::default)
    }
}

/// One kind of effect.
#[derive(Debug)]
pub struct Kind {
    /// Published name.
    pub name: &'static str,
    /// Names of its parameters, in the order of the values.
    pub parameters: &'static [&'static str],
    /// Two of the same group never hide together: they exclude each other, or no data could part them.
    pub group: &'static str,
    /// Whether it lives in a tacho, so that the speed cannot come from encoder differences.
    pub needs_tacho: bool,
    /// Whether the truth can take a form that resembles the library's but is not it.
    pub has_other_form: bool,
    /// Draws the values.
    pub draw: fn(&mut ChaCha8Rng, &Natural) -> Vec<f64>,
    /// Puts them into the subject. `shape` 0 … 1: in a form that resembles the library's but is not it; `None`: exactly
    /// the library's form.
    pub put: fn(&[f64], Option<f64>, &Natural, &mut Subject),
}

/// A hidden effect.
#[derive(Clone, Debug)]
pub struct Hidden {
    /// What.
    pub kind: &'static Kind,
    /// Its parameters.
    pub values: Vec<f64>,
    /// See [`Kind::put`].
    pub shape: Option<f64>,
}

impl Hidden {
    /// Puts the effect into the subject.
    pub fn put_into(&self, natural: &Natural, subject: &mut Subject) {
        (self.kind.put)(&self.values, self.shape, natural, subject);
    }

    /// Whether the truth has the library's form.
    pub fn form_in_library(&self) -> bool {
        self.shape.is_none()
    }
}

fn sign(rng: &mut ChaCha8Rng) -> f64 {
    if rng.random_bool(0.5) { 1.0 } else { -1.0 }
}

/// A ratio that no tolerance covers: beyond 4.5 of them, up to a factor of 2.
fn wrong_ratio(rng: &mut ChaCha8Rng, natural: &Natural) -> Vec<f64> {
    let size = rng.random_range((4.5 * natural.tolerance).ln_1p()..2.0_f64.ln());
    vec![(sign(rng) * size).exp()]
}

/// Two magnitudes that differ by 25 to 60 %.
fn unequal(rng: &mut ChaCha8Rng, value: f64) -> Vec<f64> {
    let other = value * rng.random_range(0.4..0.75);
    if rng.random_bool(0.5) {
        vec![value, other]
    } else {
        vec![other, value]
    }
}

/// Elastic asperities: 0.02 to 0.2 % of the way in one time constant, lightly damped.
fn bristle(shape: f64, natural: &Natural, level: f64, inertia: f64) -> Bristle {
    let deflection_rad = 2e-4 * 10f64.powf(shape) * natural.speed * natural.tau;
    Bristle {
        deflection_rad,
        damping: 0.3 * (level / deflection_rad * inertia).sqrt(),
    }
}

fn dry_friction(motor: &mut Motor, friction: Friction, shape: Option<f64>, natural: &Natural) {
    let level = 0.5 * (friction.kinetic_nm[0] + friction.kinetic_nm[1]);
    let bristle = shape.map(|shape| bristle(shape, natural, level, motor.inertia));
    motor.friction = Friction { bristle, ..friction };
}

fn dead_zone(widths: [f64; 2], shape: Option<f64>, subject: &mut Subject) {
    let drive = &mut subject.motor.drive;
    drive.dead_zone_v = widths;
    if let Some(shape) = shape {
        drive.dead_zone_knee = Knee::Logistic((0.02 + 0.08 * shape) * widths[0].min(widths[1]));
    }
}

/// Every effect that can hide.
pub static KINDS: &[Kind] = &[
    Kind {
        name: "dead_zone",
        parameters: &["half_width_v"],
        group: "dead zone",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| vec![log_range(rng, 0.005, 0.25) * n.volts],
        put: |v, shape, _, subject| dead_zone([v[0]; 2], shape, subject),
    },
    Kind {
        name: "dead_zone_asymmetric",
        parameters: &["pos_v", "neg_v"],
        group: "dead zone",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| {
            let width = log_range(rng, 0.01, 0.25) * n.volts;
            unequal(rng, width)
        },
        put: |v, shape, _, subject| dead_zone([v[0], v[1]], shape, subject),
    },
    Kind {
        name: "voltage_saturation",
        parameters: &["limit_v", "softness"],
        group: "limit",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| {
            let softness = if rng.random_bool(0.3) {
                rng.random_range(0.1..0.4)
            } else {
                0.0
            };
            vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.volts, softness]
        },
        put: |v, shape, n, subject| {
            let drive = &mut subject.motor.drive;
            drive.limit_v = [v[0]; 2];
            drive.limit_knee = match shape {
                Some(shape) => Knee::Logistic((0.02 + 0.06 * shape) * n.volts),
                None if v[1] > 0.0 => Knee::Compression(v[1]),
                None => Knee::Hard,
            };
        },
    },
    Kind {
        name: "drive_gain",
        parameters: &["ratio"],
        group: "scale",
        needs_tacho: false,
        has_other_form: false,
        draw: wrong_ratio,
        put: |v, _, _, subject| subject.motor.drive.gain = [v[0]; 2],
    },
    Kind {
        name: "voltage_offset",
        parameters: &["offset_v"],
        group: "constant",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.12) * n.volts],
        put: |v, _, _, subject| subject.motor.drive.offset_v = v[0],
    },
    Kind {
        name: "transport_delay",
        parameters: &["seconds"],
        group: "delay",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.005, 0.5) * n.tau],
        put: |v, _, _, subject| subject.motor.drive.delay_s = v[0],
    },
    Kind {
        name: "actuator_lag",
        parameters: &["time_constant_s"],
        group: "delay",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
        put: |v, _, _, subject| subject.motor.drive.lag_s = v[0],
    },
    Kind {
        name: "voltage_drop",
        parameters: &["drop_v"],
        group: "drop",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.005, 0.15) * n.volts],
        put: |v, _, _, subject| subject.motor.drive.drop_v = v[0],
    },
    Kind {
        name: "supply_sag",
        parameters: &["source_ohm"],
        group: "sag",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| vec![log_range(rng, 0.02, 0.6) * n.resistance],
        put: |v, shape, n, subject| {
            subject.motor.drive.source_ohm = v[0];
            // A capacitor across the bridge in place of a rail without memory.
            subject.motor.drive.bus_farad = shape.map_or(0.0, |shape| (0.005 + 0.03 * shape) * n.tau / v[0]);
        },
    },
    Kind {
        name: "current_limit",
        parameters: &["limit_a"],
        group: "current limit",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.15, 1.2) * n.current],
        put: |v, _, _, subject| subject.motor.drive.current_limit_a = v[0],
    },
    Kind {
        name: "resistance",
        parameters: &["ratio"],
        group: "base",
        needs_tacho: false,
        has_other_form: false,
        draw: wrong_ratio,
        put: |v, _, _, subject| subject.motor.resistance_ohm *= v[0],
    },
    Kind {
        name: "motor_gain",
        parameters: &["ratio"],
        group: "base",
        needs_tacho: false,
        has_other_form: false,
        draw: wrong_ratio,
        put: |v, _, _, subject| {
            subject.motor.torque_constant *= v[0];
            subject.motor.emf_constant *= v[0];
        },
    },
    Kind {
        name: "inertia",
        parameters: &["ratio"],
        group: "base",
        needs_tacho: false,
        has_other_form: false,
        draw: wrong_ratio,
        put: |v, _, _, subject| subject.motor.inertia *= v[0],
    },
    Kind {
        name: "viscous_friction",
        parameters: &["ratio"],
        group: "base",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            // b is often wrong by a factor.
            let size = rng.random_range((4.5 * n.tolerance).ln_1p()..5.0_f64.ln());
            vec![(if rng.random_bool(0.7) { size } else { -size }).exp()]
        },
        put: |v, _, _, subject| subject.motor.viscous = subject.motor.viscous.map(|b| b * v[0]),
    },
    Kind {
        name: "thermal_resistance",
        parameters: &["rise_per_w", "time_constant_s"],
        group: "thermal",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let power = 0.1 * n.volts * n.current;
            vec![
                log_range(rng, 0.05, 1.0) / power,
                log_range(rng, 5.0, 150.0) * n.tau,
            ]
        },
        put: |v, _, _, subject| {
            subject.motor.thermal = Some(Thermal {
                rise_per_w: v[0],
                time_constant_s: v[1],
            });
        },
    },
    Kind {
        name: "kt_saturation",
        parameters: &["knee_a"],
        group: "kt",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| vec![log_range(rng, 0.5, 5.0) * n.current],
        put: |v, shape, _, subject| {
            subject.motor.torque_knee_a = v[0];
            subject.motor.torque_knee_order = shape.map_or(1.0, |shape| 0.4 + 0.4 * shape);
        },
    },
    Kind {
        name: "coulomb_friction",
        parameters: &["level_nm"],
        group: "dry friction",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| vec![log_range(rng, 0.003, 0.2) * n.torque],
        put: |v, shape, n, subject| dry_friction(&mut subject.motor, Friction::coulomb(v[0]), shape, n),
    },
    Kind {
        name: "coulomb_asymmetric",
        parameters: &["pos_nm", "neg_nm"],
        group: "dry friction",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| {
            let level = log_range(rng, 0.01, 0.2) * n.torque;
            unequal(rng, level)
        },
        put: |v, shape, n, subject| {
            let friction = Friction {
                kinetic_nm: [v[0], v[1]],
                ..Friction::default()
            };
            dry_friction(&mut subject.motor, friction, shape, n);
        },
    },
    Kind {
        name: "stribeck_friction",
        parameters: &["level_nm", "breakaway_nm", "stribeck_rad_s"],
        group: "dry friction",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| {
            let level = log_range(rng, 0.005, 0.15) * n.torque;
            vec![
                level,
                level * rng.random_range(1.3..2.0),
                log_range(rng, 0.01, 0.1) * n.speed,
            ]
        },
        put: |v, shape, n, subject| {
            let friction = Friction {
                breakaway_ratio: v[1] / v[0],
                stribeck_rad_s: v[2],
                ..Friction::coulomb(v[0])
            };
            dry_friction(&mut subject.motor, friction, shape, n);
        },
    },
    Kind {
        name: "load_dependent_friction",
        parameters: &["level_nm", "per_motor_torque", "per_load_torque"],
        group: "dry friction",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            vec![
                log_range(rng, 0.01, 0.08) * n.torque,
                log_range(rng, 0.03, 0.35),
                0.0,
            ]
        },
        put: |v, _, _, subject| {
            subject.motor.friction = Friction {
                per_motor_torque: v[1],
                per_load_torque: v[2],
                ..Friction::coulomb(v[0])
            };
        },
    },
    Kind {
        name: "viscous_asymmetric",
        parameters: &["pos_nms", "neg_nms"],
        group: "base",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let more = log_range(rng, 0.02, 0.6) * n.torque / n.speed;
            unequal(rng, more)
        },
        put: |v, _, _, subject| {
            let [forward, backward] = subject.motor.viscous;
            subject.motor.viscous = [forward + v[0], backward + v[1]];
        },
    },
    Kind {
        name: "quadratic_drag",
        parameters: &["drag_nms2"],
        group: "drag",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.01, 0.6) * n.torque / n.speed.powi(2)],
        put: |v, _, _, subject| subject.motor.drag = v[0],
    },
    Kind {
        name: "constant_load",
        parameters: &["torque_nm"],
        group: "constant",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.15) * n.torque],
        put: |v, _, _, subject| subject.motor.load.constant_nm = v[0],
    },
    Kind {
        name: "gravity",
        parameters: &["mgl_nm", "phase_rad"],
        group: "gravity",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let torque = log_range(rng, 0.005, 0.25) * n.torque * n.gear_ratio;
            vec![
                torque,
                rng.random_range(-std::f64::consts::PI..std::f64::consts::PI),
            ]
        },
        put: |v, _, _, subject| {
            subject.motor.load.mgl_nm = v[0];
            subject.motor.load.gravity_phase = v[1];
        },
    },
    Kind {
        name: "cogging",
        parameters: &["amplitude_nm", "periods_per_rev", "phase_rad"],
        group: "cogging",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let periods = f64::from(rng.random_range(2..=40));
            vec![
                log_range(rng, 0.01, 0.2) * n.torque,
                periods,
                rng.random_range(-3.0..3.0),
            ]
        },
        put: |v, _, _, subject| {
            let load = &mut subject.motor.load;
            (load.cogging_nm, load.cogging_periods, load.cogging_phase) = (v[0], v[1], v[2]);
        },
    },
    Kind {
        name: "periodic_load",
        parameters: &["amplitude_nm", "frequency_hz", "phase_rad"],
        group: "periodic",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let frequency = log_range(rng, 0.1, 3.0) / n.tau;
            vec![
                log_range(rng, 0.005, 0.15) * n.torque,
                frequency,
                rng.random_range(-3.0..3.0),
            ]
        },
        put: |v, _, _, subject| {
            let load = &mut subject.motor.load;
            (load.periodic_nm, load.periodic_hz, load.periodic_phase) = (v[0], v[1], v[2]);
        },
    },
    Kind {
        name: "backlash",
        parameters: &["gap_rad", "load_share"],
        group: "train",
        needs_tacho: false,
        has_other_form: true,
        draw: |rng, n| {
            vec![
                log_range(rng, 0.005, 0.8) * n.speed * n.tau,
                rng.random_range(0.15..0.6),
            ]
        },
        put: |v, shape, n, subject| {
            // Teeth far stiffer than the motor: they catch the load without a rebound, or, in the other form, throw it back.
            // Friction acts on the motor's side, as in the library.
            let split = Split {
                inertia: v[1],
                viscous: 0.0,
            };
            let damping_ratio = shape.map_or(1.0, |shape| 0.8 - 0.4 * shape);
            let (reduced, rate) = (subject.motor.inertia * v[1] * (1.0 - v[1]), 150.0 / n.tau);
            let stiffness = reduced * rate.powi(2);
            subject.motor.train = Train::Play {
                split,
                gap_rad: v[0],
                stiffness,
                damping: 2.0 * damping_ratio * reduced * rate,
            };
            // Referred to the shaft of the encoder, an encoder at the load means a gear ratio of 1.
            subject.encoder_at_load = n.gear_ratio == 1.0;
        },
    },
    Kind {
        name: "flexible_coupling",
        parameters: &["stiffness_nm_per_rad", "damping", "load_share"],
        group: "train",
        needs_tacho: false,
        has_other_form: false,
        draw: |rng, n| {
            let share = rng.random_range(0.2..0.7);
            let inertia = n.inertia * share * (1.0 - share);
            let frequency = log_range(rng, 3.0, 30.0) / n.tau;
            let damping = 2.0 * rng.random_range(0.02..0.2) * frequency * inertia;
            vec![inertia * frequency.powi(2), damping, share]
        },
        put: |v, _, _, subject| {
            let split = Split {
                inertia: v[2],
                viscous: 0.0,
            };
            subject.motor.train = Train::Flexible {
                split,
                stiffness: v[0],
                damping: v[1],
            };
        },
    },
    Kind {
        name: "encoder_scale",
        parameters: &["ratio"],
        group: "scale",
        needs_tacho: false,
        has_other_form: false,
        draw: wrong_ratio,
        put: |v, _, _, subject| subject.reading_scale = v[0],
    },
    Kind {
        name: "speed_saturation",
        parameters: &["limit_rad_s"],
        group: "clamp",
        needs_tacho: true,
        has_other_form: false,
        draw: |rng, n| vec![(1.0 - log_range(rng, 0.01, 0.6)) * n.speed],
        put: |v, _, _, subject| subject.tacho().limit_rad_s = v[0],
    },
    Kind {
        name: "sensor_lag",
        parameters: &["time_constant_s"],
        group: "delay",
        needs_tacho: true,
        has_other_form: false,
        draw: |rng, n| vec![log_range(rng, 0.01, 0.6) * n.tau],
        put: |v, _, _, subject| subject.tacho().lag_s = v[0],
    },
    Kind {
        name: "sensor_rectified",
        parameters: &[],
        group: "rectified",
        needs_tacho: true,
        has_other_form: false,
        draw: |_, _| vec![],
        put: |_, _, _, subject| subject.tacho().rectified = true,
    },
    Kind {
        name: "sensor_offset",
        parameters: &["offset"],
        group: "constant",
        needs_tacho: true,
        has_other_form: false,
        draw: |rng, n| vec![sign(rng) * log_range(rng, 0.003, 0.1) * n.speed],
        put: |v, _, _, subject| subject.reading_offset = v[0],
    },
];
