//! The first power-up, as the pages of the boards have it: a resistor in place of the motor, then a motor under a low current limit.
//! Through the board's own code and its registers.

use super::chip::Drive;
use super::chip::stm32f405::board::{Board, SCALE};
use super::chip::stm32f405::stage::Outputs;
use super::rig::{Rig, order};
use super::{AXES, ROWS};
use crate::board_model::motor::Motor;
use crate::board_model::wires::Wires;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use servo::axis::servo_axis::{Order, ServoAxis};
use servo::axis::{Command, Output};
use servo::commission::CommissionReport;
use servo::drivers::sense::CurrentKind;
use servo::config::Config;
use servo::identify::estimate::Reason;
use servo::optional::Optional;
use servo::protect::Fault;
use servo::record::Activity;

/// A gear motor of 12 V that the own board's carrier can measure, too: 0.8 to 2 A of stall current, a friction of a tenth to a fifth of that.
fn random_motor(rng: &mut ChaCha8Rng) -> Motor {
    let (ohm, tau_s): (f64, f64) = (rng.random_range(6.0..15.0), rng.random_range(0.03..0.09));
    let constant: f64 = rng.random_range(0.04..0.1);
    let stall_nm = constant * Motor::SUPPLY_V / ohm;
    let sliding = rng.random_range(0.08..0.18) * stall_nm;
    Motor {
        ohm,
        henry: ohm * rng.random_range(1e-4..1.5e-3),
        constant,
        inertia: tau_s * constant * constant / ohm,
        friction: [sliding, sliding * rng.random_range(1.0..1.4)],
        ..Motor::default()
    }
}

fn config(board: &Board, motor: &Motor, limit_a: f64) -> Config {
    Config {
        supply_nominal_v: 12.0,
        counts_per_rev: 4000,
        // A resistor has none; the axis file then says what the motor's plate does.
        rated_speed_rad_s: (Motor::SUPPLY_V / motor.constant.max(0.04)) as f32,
        tick_hz: 10_000,
        pwm_full_scale: 4200,
        vbus_v_per_lsb: SCALE.supply_volt_per_lsb(board.supply.divider),
        current_a_per_lsb: SCALE.ampere_per_lsb(board.stage.volt_per_ampere),
        current_limit_a: Optional::new(limit_a as f32),
        ..Config::EXAMPLE
    }
}

/// The board with a motor on each axis, and a current limit on each.
struct PowerUp {
    rig: Rig<AXES>,
    axes: [ServoAxis; AXES],
    limits_a: [f64; AXES],
    /// Largest currents of all, shares of their limits.
    peak: f64,
}

impl PowerUp {
    fn new(board: &'static Board, wires: Wires, motors: &[Motor; AXES], limits_a: [f64; AXES]) -> Self {
        let rig = Rig::<AXES>::prepared(board, wires, false, |chip| chip.motors = motors.to_vec());
        let mut up = Self { rig, axes: [(); AXES].map(|()| ServoAxis::new()), limits_a, peak: 0.0 };
        for (number, motor) in motors.iter().enumerate() {
            up.limit(board, motor, number);
        }
        // The zero of the current sensor takes 1,040 ticks.
        (0..1_100).for_each(|_| _ = up.tick());
        up
    }

    fn limit(&mut self, board: &Board, motor: &Motor, number: usize) {
        let config = config(board, motor, self.limits_a[number]);
        self.axes[number].execute(&Order::configure(&config).expect("a good one")).expect("open");
        self.rig.drive.configure(number, &config);
    }

    fn tick(&mut self) -> [Output; AXES] {
        let outputs = self.rig.image_tick(&mut self.axes);
        for (number, limit) in self.limits_a.iter().enumerate() {
            let ampere = self.rig.bench.chip(|chip| chip.motors[number].ampere.abs());
            self.peak = self.peak.max(ampere / limit);
        }
        outputs
    }

    /// Commissions these axes at once: what each of them reports.
    fn commission(&mut self, these: &[usize], budget_ms: u32) -> Vec<CommissionReport> {
        for &number in these {
            self.rig.concluded[number] = None;
            order(&mut self.axes[number], Command::Stop);
            order(&mut self.axes[number], Command::Arm);
            order(&mut self.axes[number], Command::Commission { budget_ms, seed: number as u32 });
        }
        for _ in 0..100_000 {
            let outputs = self.tick();
            let busy = |number: &usize| outputs[*number].record.activity == Activity::Commissioning;
            assert!(outputs.iter().all(|output| output.record.fault == Fault::None), "{outputs:?}");
            if self.rig.concluded[these[0]].is_some() && !these.iter().any(busy) {
                break;
            }
        }
        let report = |&number: &usize| {
            let scale = self.axes[number].scale().expect("it is configured");
            self.rig.concluded[number].expect("it has ended").report(scale)
        };
        these.iter().map(report).collect()
    }
}

/// Steps 7 of the pages, at 12 V: VESC's limit of 1.5 A, which 12 Ω at 45 % of 12 V (0.45 A) do not reach; on ODrive
/// 0.3 A, which they do. A count of VESC's is 81 mA: what stands may look like what turns unseen.
#[test]
fn a_resistor_in_series_with_a_held_motor_is_told_as_what_does_not_move() {
    // The own board's steps have no resistor.
    for (name, board, wires) in ROWS.into_iter().take(1).filter(|row| row.0 != "stm32f405") {
        let limit = if name == "vesc-6" { 1.5 } else { 0.3 };
        let mut up = PowerUp::new(board, wires(), &[(); AXES].map(|()| Motor::resistor()), [limit; AXES]);
        for report in up.commission(&[0], 1_000) {
            let told = report.refused.expect("nothing moves");
            let expected = match name {
                "vesc-6" => &[Reason::Stalled, Reason::EncoderUnplugged, Reason::MotorDisconnected][..],
                _ => &[Reason::CurrentLimited],
            };
            assert!(expected.contains(&told), "{name}: {told:?}");
        }
        assert!(up.peak < 1.2, "{name}: {}", up.peak);
    }
}

/// The share of the stall current that a page's recipe begins with. A mirror gives no sign: of a motor that brakes it says that it drives,
/// and so the page of wiring A asks for more than braking draws. `soon`: VESC's recipe, with the refusals of ODrive's, begins where it has
/// been raised twice.
fn first_limit(name: &str, board: &Board, soon: bool) -> f64 {
    match board.stage.current {
        CurrentKind::Magnitude => 0.7,
        _ if soon && name == "vesc-6" => 0.1 * 1.5 * 1.5,
        _ => 0.1,
    }
}

/// The recipe's first limit, then half as much again until the shaft turns, on one drawn motor, or on so many as the variable `POWER_UPS`
/// says: a run takes half a minute here.
#[test]
fn a_motor_is_commissioned_by_the_recipe_of_the_page() {
    let asked = std::env::var("POWER_UPS").ok();
    let motors = asked.as_ref().map_or(1, |number| number.parse().expect("a number"));
    for (name, board, wires) in ROWS.into_iter().take(1) {
        let mut worked = 0;
        for seed in 0..motors {
            let rng = &mut ChaCha8Rng::seed_from_u64(seed);
            let drawn = [(); AXES].map(|()| random_motor(rng));
            let stall = Motor::SUPPLY_V / drawn[0].ohm;
            let mut up = PowerUp::new(board, wires(), &drawn, [first_limit(name, board, asked.is_none()) * stall; AXES]);
            worked += u64::from(follow(name, board, &mut up, &drawn[0]));
        }
        println!("{name}: works on {worked} of {motors}");
        assert_eq!(worked, motors, "{name}");
    }
}

/// What a dead time takes of the voltage at 20 kHz and 12 V: a dead zone like that of friction.
fn dead_time_v(board: &Board) -> f64 {
    match board.stage.outputs {
        Outputs::Complementary { dead_time_ns } => f64::from(dead_time_ns) * 1e-9 * 20e3 * Motor::SUPPLY_V,
        Outputs::SingleEnded => 0.0,
    }
}

/// The recipe on axis 0.
fn follow(name: &str, board: &Board, up: &mut PowerUp, motor: &Motor) -> bool {
    loop {
        let report = up.commission(&[0], 5_000)[0];
        let found = &report.estimates;
        let limit = up.limits_a[0];
        println!("{name}: {limit:.3} A, peak {:.2}, {:?}, {found:?}", up.peak, report.refused);
        if report.refused.is_none() && found.dead_zone_pos_v.trusted && found.gain_rad_s_per_v.trusted {
            let friction_v = motor.friction[0] * motor.ohm / motor.constant + dead_time_v(board);
            let near = |value: Option<f32>, truth: f64, share: f64| {
                value.is_some_and(|value| (f64::from(value) - truth).abs() < share * truth)
            };
            println!("{name}: in truth {friction_v:.3} V, {:.2} rad/s per V", 1.0 / motor.constant);
            // What the sensor cannot tell the limit cannot keep: VESC's count is 81 mA.
            let count = f64::from(SCALE.ampere_per_lsb(board.stage.volt_per_ampere));
            return up.peak * limit < (1.3 * limit).max(limit + count)
                && near(found.dead_zone_pos_v.value, friction_v, 0.1)
                && near(found.gain_rad_s_per_v.value, 1.0 / motor.constant, 0.1);
        }
        let told = report.refused.or(found.dead_zone_pos_v.reason).or(found.gain_rad_s_per_v.reason);
        if told != Some(Reason::CurrentLimited) || limit > Motor::SUPPLY_V / motor.ohm {
            return false;
        }
        up.limits_a[0] *= 1.5;
        up.peak = 0.0;
        order(&mut up.axes[0], Command::Stop);
        up.limit(board, motor, 0);
        (0..5_000).for_each(|_| _ = up.tick());
    }
}

