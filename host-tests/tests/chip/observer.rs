//! The observer beside motors in double precision: its speed is that of the moment, also while the motor accelerates and lags.

use servo::encoder::{Motor, Params, State};
use servo::units::{LAG_FRAC, Voltage};

const MOTOR: Motor = Motor { full_speed: 50.0, tau_ticks: 100.0 };
const FINE: usize = 200;

/// Mean and rms of estimated minus true speed, counts per tick, behind the first 300 ticks. `lag`: of the motor, ticks; `told`: of the
/// observer.
fn errors(lag: f64, told: f64, voltage: impl Fn(f64) -> f64) -> [f64; 2] {
    let mut params = Params::default().of(&MOTOR);
    params.lag((told * f64::from(1 << LAG_FRAC)).round() as u32);
    let mut state = State::at_rest(0);
    let (mut position, mut speed, mut lack, h) = (0.5, 0.0, 0.0, 1.0 / FINE as f64);
    let errors: Vec<f64> = (0..1_200)
        .map(|tick| {
            let v = voltage(f64::from(tick));
            for _ in 0..FINE {
                let all = f64::from(MOTOR.full_speed) * v - speed;
                lack = if lag > 0.0 { lack + h / lag * (all - lack) } else { all };
                speed += h * lack / f64::from(MOTOR.tau_ticks);
                position += h * speed;
            }
            let acted = Voltage((v * f64::from(Voltage::NOMINAL.0)).round() as i32);
            params.step(&mut state, position.floor() as i32, Some(acted));
            f64::from(state.speed().0) / f64::from(1 << servo::units::SPEED_BITS) - speed
        })
        .skip(300)
        .collect();
    let mean = |of: &dyn Fn(f64) -> f64| errors.iter().map(|e| of(*e)).sum::<f64>() / errors.len() as f64;
    [mean(&|e| e), mean(&|e| e * e).sqrt()]
}

/// 0.03 counts per tick more in each tick: the speed of half a tick later would be 0.015 more.
#[test]
fn its_speed_is_not_ahead_while_the_motor_accelerates() {
    let ramp = |tick: f64| 0.03 * (tick + f64::from(MOTOR.tau_ticks)) / f64::from(MOTOR.full_speed);
    let [mean, _] = errors(0.0, 0.0, ramp);
    assert!(mean.abs() < 0.003, "{mean}");
}

#[test]
fn a_lag_that_it_is_told_no_longer_makes_it_wrong() {
    let sine = |tick: f64| 0.6 * (tick / 60.0).sin();
    for lag in [2.0, 7.0] {
        let [[_, without], [_, with]] = [errors(lag, 0.0, sine), errors(lag, lag, sine)];
        assert!(with < 0.4 * without, "{lag} ticks: {with} instead of {without}");
    }
}
