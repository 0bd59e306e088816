//! The dead zone's model and inverse are one another's inverse, and the compensator keeps its promises.

use proptest::prelude::*;
use servo::compensate::modelled::{DryFriction, LoadFriction, OverSpeed, Told};
use servo::compensate::{Compensator, DeadZone, KAPPA_FRICTION, KAPPA_INPUT, SignSource, Smoothing};
use servo::units::Voltage;

/// 12 V nominal.
fn volts(v: f64) -> Voltage {
    Voltage((v / 12.0 * f64::from(Voltage::NOMINAL.0)).round() as i32)
}

fn in_volts(v: Voltage) -> f64 {
    f64::from(v.0) / f64::from(Voltage::NOMINAL.0) * 12.0
}

/// The equations of the module in floating point.
fn inverse(v: f64, positive: f64, negative: f64) -> f64 {
    let width = if v < 0.0 { negative } else { positive };
    v + width * (v / in_volts(Smoothing::WIDEST.width())).clamp(-1.0, 1.0)
}

proptest! {
    #[test]
    fn forward_undoes_inverse(positive in 0..400_000i32, negative in 0..400_000i32, v in -2_000_000..2_000_000i32, epsilon in 1e-4..0.02f32) {
        let zone = DeadZone::new(Voltage(positive), Voltage(negative), Smoothing::within(epsilon));
        let back = zone.forward(zone.inverse(Voltage(v)));
        prop_assert!((back.0 - v).abs() <= 1, "{} after the round trip of {v}", back.0);
    }

    #[test]
    fn inverse_undoes_forward(positive in 0..400_000i32, negative in 0..400_000i32, u in -2_000_000..2_000_000i32, epsilon in 1e-4..0.02f32) {
        let zone = DeadZone::new(Voltage(positive), Voltage(negative), Smoothing::within(epsilon));
        let back = zone.inverse(zone.forward(Voltage(u)));
        let slope = positive.max(negative) / Smoothing::within(epsilon).width().0;
        prop_assert!((back.0 - u).abs() <= 2 + slope, "{} after the round trip of {u}", back.0);
    }

    #[test]
    fn inverse_is_the_equation(positive in 0.0..3.0f64, negative in 0.0..3.0f64, v in -12.0..12.0f64) {
        let zone = DeadZone::new(volts(positive), volts(negative), Smoothing::WIDEST);
        let expected = inverse(v, positive, negative);
        // Half an LSB of v is amplified by the slope inside ε, up to 1 + 3 V / 0.094 V.
        prop_assert!((in_volts(zone.inverse(volts(v))) - expected).abs() < 35.0 * 12.0 / 2f64.powi(20));
    }

    #[test]
    fn both_directions_are_monotone(positive in 0..400_000i32, negative in 0..400_000i32, u in -2_000_000..2_000_000i32, epsilon in 1e-4..0.02f32) {
        let zone = DeadZone::new(Voltage(positive), Voltage(negative), Smoothing::within(epsilon));
        prop_assert!(zone.inverse(Voltage(u + 1)) > zone.inverse(Voltage(u)));
        prop_assert!(zone.forward(Voltage(u + 1)) >= zone.forward(Voltage(u)));
    }

    #[test]
    fn nothing_overflows(width in any::<i32>(), v in any::<i32>(), z in any::<i32>()) {
        let compensator = Compensator::new(Voltage(width), Voltage(width), SignSource::Reference, Smoothing::WIDEST);
        let _ = (compensator.apply(Voltage(v), Some(Voltage(z)), false), compensator.apply(Voltage(v), Some(Voltage(z)), true));
    }
}

/// In motion all of the dead zone is compensated, at rest a share.
fn shares(kappa: f32) -> [(bool, f64); 2] {
    [(false, 1.0), (true, f64::from(kappa))]
}

#[test]
fn friction_is_pushed_with_the_sign_of_the_reference_speed_and_at_rest_only_to_kappa() {
    let compensator = Compensator::new(volts(1.2), volts(1.5), SignSource::Reference, Smoothing::WIDEST);
    for (rests, share) in shares(KAPPA_FRICTION) {
        let braking = compensator.apply(volts(-0.5), Some(volts(3.0)), rests);
        assert!((in_volts(braking) - (-0.5 + share * 1.2)).abs() < 1e-3);
        let backward = compensator.apply(volts(0.5), Some(volts(-3.0)), rests);
        assert!((in_volts(backward) - (0.5 - share * 1.5)).abs() < 1e-3);
    }
}

#[test]
fn an_input_dead_zone_is_pushed_with_the_sign_of_the_command() {
    let compensator = Compensator::new(volts(1.2), volts(1.5), SignSource::Command, Smoothing::WIDEST);
    for (rests, share) in shares(KAPPA_INPUT) {
        let braking = compensator.apply(volts(-0.5), Some(volts(3.0)), rests);
        assert!((in_volts(braking) - (-0.5 - share * 1.5)).abs() < 1e-3);
    }
}

/// The motor turns at 3 V of back-EMF. Of a command of 2 V the current flows backwards and the drive adds its drop; of 4 V it takes it.
#[test]
fn a_voltage_drop_is_pushed_with_the_sign_of_the_current() {
    let compensator = Compensator::new(volts(1.2), volts(1.5), SignSource::Current, Smoothing::WIDEST);
    for (wanted, expected) in [(2.0, 2.0 - 1.5), (4.0, 4.0 + 1.2), (3.0, 3.0)] {
        let terminal = in_volts(compensator.apply(volts(wanted), Some(volts(3.0)), false));
        assert!((terminal - expected).abs() < 1e-3, "{terminal} V for {wanted} V");
    }
    let at_rest = in_volts(compensator.apply(volts(0.5), Some(Voltage::ZERO), true));
    assert!((at_rest - (0.5 + f64::from(KAPPA_INPUT) * 1.2)).abs() < 1e-3, "{at_rest} V at rest");
}

/// Forward, by hand: of the torque voltage T, a·|T| acts against the motion.
#[test]
fn friction_that_grows_with_the_torque_is_made_up_for() {
    for share in [0.05, 0.16, 0.25] {
        let geared = LoadFriction::new((share * 65_536.0) as u16);
        for (v, forward) in [(2.0, true), (2.0, false), (-0.7, true), (-0.7, false)] {
            let torque = v + in_volts(geared.push(volts(v), forward));
            let against = if forward { -share * torque.abs() } else { share * torque.abs() };
            assert!((torque + against - v).abs() < 1e-3, "{share}: {v} V becomes {torque} V");
        }
    }
    assert_eq!(LoadFriction::new(u16::MAX).share(), LoadFriction::MOST);
    assert_eq!(LoadFriction::default().push(volts(2.0), true), Voltage::ZERO);
}

/// By hand: |e|·(skew + drag·e), never more than half of e.
#[test]
fn what_speed_takes_is_added_with_its_sign() {
    let over_speed = OverSpeed { skew: -6_554, drag: (0.02 * 12.0 * 32_768.0) as u16 };
    for e in [-9.0f64, -2.0, -0.01, 0.0, 0.5, 3.0, 11.0] {
        let expected = e.abs() * (-0.1 + 0.02 * e).clamp(-0.5, 0.5);
        let added = in_volts(over_speed.beyond(volts(e)));
        assert!((added - expected).abs() < 1e-3, "{e}: {added} V, {expected} V");
    }
    for wildest in
        [OverSpeed { skew: i16::MAX, drag: u16::MAX }, OverSpeed { skew: i16::MIN, drag: u16::MAX }]
    {
        for e in [-30.0, -4.0, 4.0, 30.0] {
            assert!(in_volts(wildest.beyond(volts(e))).abs() <= 0.5 * f64::abs(e) + 1e-3);
        }
    }
    assert_eq!(OverSpeed::default().beyond(volts(7.0)), Voltage::ZERO);
}

/// By hand, 1.2 V of which 0.4 are friction: beside an input dead zone, beside a voltage drop, and alone.
#[test]
fn friction_beside_another_part_is_pushed_with_the_sign_of_the_motion() {
    let told = Told { dry: DryFriction { share: 21_845, ..DryFriction::default() }, ..Told::default() };
    let compensator = |sign| Compensator::new(volts(1.2), volts(1.2), sign, Smoothing::NARROWEST);
    let terminal = |sign, wanted: f64, towards: f64, rests| {
        in_volts(compensator(sign).apply_told(&told, volts(wanted), volts(towards), rests))
    };
    // Braking forward: friction helps forward, the drive swallows what is negative, and the current is.
    for (sign, wanted, towards, expected) in [
        (SignSource::Command, -0.9, 3.0, -0.9 + 0.4 - 0.8),
        (SignSource::Command, -0.1, 3.0, -0.1 + 0.4 + 0.8),
        (SignSource::Current, 2.0, 3.0, 2.0 + 0.4 - 0.8),
        (SignSource::Current, 2.9, 3.0, 2.9 + 0.4 + 0.8),
        (SignSource::Reference, -0.9, 3.0, -0.9 + 1.2),
    ] {
        let got = terminal(sign, wanted, towards, false);
        assert!((got - expected).abs() < 2e-3, "{sign:?}, {wanted} V: {got} V, {expected} V");
    }
    let at_rest = 0.5 + f64::from(KAPPA_FRICTION) * 0.4 + f64::from(KAPPA_INPUT) * 0.8;
    assert!((terminal(SignSource::Command, 0.5, 12.0, true) - at_rest).abs() < 2e-3);
}

/// What a model tells of nothing changes nothing.
#[test]
fn nothing_told_is_the_plain_compensator() {
    for sign in [SignSource::Reference, SignSource::Command, SignSource::Current] {
        let compensator = Compensator::new(volts(1.2), volts(0.8), sign, Smoothing::WIDEST);
        for (wanted, towards, rests) in
            [(2.0, 1.5, false), (-0.3, 1.5, false), (0.05, -2.0, false), (0.4, 12.0, true)]
        {
            let (wanted, towards) = (volts(wanted), volts(towards));
            let plain = compensator.apply(wanted, Some(towards), rests);
            assert_eq!(compensator.apply_told(&Told::default(), wanted, towards, rests), plain, "{sign:?}");
        }
    }
}

/// The bell of the module against the exponential function of the source; at rest, which is far away, there is none.
#[test]
fn friction_near_standstill_follows_stribecks_curve() {
    let dry = DryFriction { share: 0, breakaway: 3_000, stribeck: 1_000 };
    let (more, half) = (3_000.0 / 4_096.0, 12.0 * 1_000.0 / 65_536.0);
    for e in [0.0f64, 0.02, -0.05, 0.1, 0.18, -0.3, 0.5, 0.72, 0.8, -3.0] {
        let expected = more * (-(e / half) * (e / half)).exp();
        let got = f64::from(dry.excess(volts(e))) / 65_536.0;
        assert!((got - expected).abs() < 0.02 * more, "{e} V: {got}, {expected}");
    }
    let wildest = DryFriction { share: u16::MAX, breakaway: u16::MAX, stribeck: u16::MAX };
    let widths: Vec<i32> = (-30..=30).map(|e| wildest.excess(volts(f64::from(e)))).collect();
    assert!(widths.iter().all(|width| (0..=98_304).contains(width)), "{widths:?}");
}

#[test]
fn without_a_dead_zone_it_is_transparent() {
    for v in [-900_000, -1, 0, 1, 4_000, 900_000] {
        assert_eq!(Compensator::default().apply(Voltage(v), None, false), Voltage(v));
    }
}
