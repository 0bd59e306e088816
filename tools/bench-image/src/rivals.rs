//! Published crates on a signal of the same kind: a motor's speed, voltage and sign of motion.

use crate::tally::Tally;
use core::hint::black_box;
use flight_solver::rls::{CovarianceGuards, InverseQrRls, RlsParallel};
use nalgebra::{SMatrix, SVector};

const UPDATES: i32 = 1_000;

/// A slow triangle between −1 and 1.
fn triangle(k: i32, period: i32) -> f32 {
    let phase = k.rem_euclid(period) as f32 / period as f32;
    4.0 * (phase - 0.5).abs() - 1.0
}

/// A row of N regressors that are not multiples of one another.
fn row<const N: usize>(k: i32) -> SVector<f32, N> {
    SVector::from_fn(|i, _| triangle(k + 7 * i as i32, 50 + 31 * i as i32))
}

pub fn run() {
    covariance::<4>("flight-solver RlsParallel, 4 parameters");
    covariance::<6>("flight-solver RlsParallel, 6 parameters");
    inverse_qr::<4>("flight-solver InverseQrRls, 4 parameters");
    inverse_qr::<6>("flight-solver InverseQrRls, 6 parameters");
    pid_f32();
    biquad_i32();
}

fn covariance<const N: usize>(name: &str) {
    let mut solver = RlsParallel::<N, 1>::new(1e2, 0.999, CovarianceGuards::default());
    let mut tally = Tally::default();
    for k in 0..UPDATES {
        let (row, y) = (row::<N>(k), SMatrix::<f32, 1, 1>::new(triangle(k, 90)));
        tally.count(|| solver.update(black_box(&row), black_box(&y)));
    }
    black_box(solver.params());
    tally.print(name, 0);
}

fn inverse_qr<const N: usize>(name: &str) {
    let mut solver = InverseQrRls::<N, 1>::new(1e2, 0.999);
    let mut tally = Tally::default();
    for k in 0..UPDATES {
        let (row, y) = (row::<N>(k), SMatrix::<f32, 1, 1>::new(triangle(k, 90)));
        tally.count(|| solver.update(black_box(&row), black_box(&y)));
    }
    black_box(solver.params());
    tally.print(name, 0);
}

fn pid_f32() {
    let mut controller = pid::Pid::<f32>::new(0.5, 1.0);
    controller.p(2.0, 1.0).i(0.1, 1.0).d(0.5, 1.0);
    let mut tally = Tally::default();
    for k in 0..UPDATES {
        let measured = triangle(k, 90);
        tally.count(|| controller.next_control_output(black_box(measured)).output);
    }
    tally.print("pid", 0);
}

fn biquad_i32() {
    // A PID as a biquad: kp·(y₀ − y₁) + ki·y₀ + kd·(…), Q30.
    let mut biquad = idsp::iir::Biquad::<i32>::from([1 << 29, -(3 << 28), 1 << 28, 1 << 30, 0]);
    biquad.set_min(-(1 << 28));
    biquad.set_max(1 << 28);
    let mut state = [0i32; 4];
    let mut tally = Tally::default();
    for k in 0..UPDATES {
        let measured = (triangle(k, 90) * 1e8) as i32;
        tally.count(|| biquad.update(&mut state, black_box(measured)));
    }
    tally.print("idsp Biquad<i32>", 0);
}
