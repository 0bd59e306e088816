//! A small simulator of a motor with something that no library holds. It shares no code with the workbench's plant nor with the
//! reference plant: one fixed fine step, semi-implicit, for everything.

use super::kinds::{Kind, Oddity};
use super::motor::{Motor, ROWS_PER_TAU, State};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use servo::axis::Bridge;
use std::f64::consts::TAU;
use std::fmt::Write;
use truing::synthetic::cases::base::log_range;
use truing::synthetic::cases::protocol;

/// Steps of the simulator a row. A row is a 50th of the time constant.
const STEPS: usize = 100;
/// Rows of a record.
const ROWS: usize = 3000;

/// A record as text, with what the true speed was.
pub struct Case {
    pub model: String,
    pub log: String,
    pub holdout: String,
}

/// Draws a case of a kind.
pub fn draw(kind: &Kind, seed: u64) -> Case {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    loop {
        let motor = Motor::draw(&mut rng);
        let oddity = (kind.draw)(&mut rng, &motor);
        let sigma = log_range(&mut rng, 0.001, 0.005) * motor.speed;
        let coast = rng.random_bool(0.8);
        let records = [(); 2].map(|()| protocol::draw(&mut rng, ROWS, ROWS_PER_TAU, coast));
        let noise: [u64; 2] = [rng.random(), rng.random()];
        let made = [0, 1].map(|k| simulated(&motor, &oddity, &records[k], noise[k]));
        let plain = [0, 1].map(|k| simulated(&motor, &Oddity::None, &records[k], noise[k]));
        // Plainly visible, and not a brake that holds the motor.
        let visible = |k: usize| difference(&made[k], &plain[k]) > 5.0 * sigma;
        let moving = |k: usize| made[k].iter().map(|row| row.1.abs()).fold(0.0, f64::max) > 0.2 * motor.speed;
        if (0..2).all(|k| visible(k) && moving(k)) {
            let [log, holdout] = [0, 1].map(|k| written(&motor, &records[k], &made[k], sigma, noise[k]));
            return Case { model: model(&motor, &mut rng), log, holdout };
        }
    }
}

fn difference(a: &[(f64, f64)], b: &[(f64, f64)]) -> f64 {
    let sum: f64 = a.iter().zip(b).map(|(a, b)| (a.1 - b.1).powi(2)).sum();
    (sum / a.len() as f64).sqrt()
}

/// Position and speed as the sensor sees them, at each row.
fn simulated(motor: &Motor, oddity: &Oddity, rows: &[protocol::Row], seed: u64) -> Vec<(f64, f64)> {
    let h = motor.row_s() / STEPS as f64;
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ 0x0dd);
    let mut state = State::default();
    let mut seen = Vec::with_capacity(rows.len());
    for (share, bridge) in rows {
        seen.push(oddity.seen(&state));
        // A wandering torque changes once a row.
        let kick: f64 = StandardNormal.sample(&mut rng);
        oddity.wander(&mut state, kick, motor.row_s());
        for _ in 0..STEPS {
            step(motor, oddity, &mut state, share * motor.volts, *bridge, h);
        }
    }
    seen
}

fn step(m: &Motor, oddity: &Oddity, s: &mut State, volts: f64, bridge: Bridge, h: f64) {
    let volts = volts + oddity.volts(s);
    let decay = (-h * m.resistance / m.inductance).exp();
    let settled = (volts - m.constant * s.omega) / m.resistance;
    s.current = if bridge == Bridge::Open { 0.0 } else { settled + (s.current - settled) * decay };
    let push = m.constant * s.current - m.viscous * s.omega;
    let (torque, inertia) = oddity.acts(s, m, push, h);
    let free = s.omega + h * (push + torque) / inertia;
    let grip = h * oddity.friction(s) / inertia;
    s.omega = if free > 0.0 { (free - grip).max(0.0) } else { (free + grip).min(0.0) };
    s.theta += h * s.omega;
    s.time += h;
    oddity.remember(s, h);
}

fn written(m: &Motor, rows: &[protocol::Row], seen: &[(f64, f64)], sigma: f64, seed: u64) -> String {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let count = TAU / 4096.0;
    let mut text = "t_s,u_v,bridge,theta_rad,omega_rad_s\n".to_owned();
    for (k, ((share, bridge), (theta, omega))) in rows.iter().zip(seen).enumerate() {
        let noise: f64 = StandardNormal.sample(&mut rng);
        let (theta, omega) = ((theta / count).floor() * count, omega + sigma * noise);
        let t = k as f64 * m.row_s();
        let _ = writeln!(text, "{t:.9},{:.6},{},{theta:.7},{omega:.7}", share * m.volts, *bridge as u8);
    }
    text
}

/// A model file whose numbers are off by up to two tolerances.
fn model(m: &Motor, rng: &mut ChaCha8Rng) -> String {
    let tolerance = [0.01, 0.03, 0.05][rng.random_range(0..3)];
    let mut off = |value: f64| {
        let z: f64 = StandardNormal.sample(rng);
        value * (1.0 + tolerance * z.clamp(-2.0, 2.0))
    };
    let (r, l, k) = (off(m.resistance), off(m.inductance), off(m.constant));
    let (j, b) = (off(m.inertia), off(m.viscous));
    format!(
        "schema = \"truing-model/1\"\n[model]\nkind = \"dc_motor\"\n[motor]\nR_ohm = {r}\nL_h = {l}\nKt_nm_per_a = {k}\n\
         Ke_vs_per_rad = {k}\nJ_kgm2 = {j}\nb_nms_per_rad = {b}\ngear_ratio = {:.1}\n[tolerance]\ndefault = {tolerance}\n\
         [supply]\nnominal_v = {:.1}\n[encoder]\ncounts_per_rev = 4096\n[sensors]\nspeed = \"analog_tacho\"\n",
        m.gear_ratio, m.volts
    )
}
