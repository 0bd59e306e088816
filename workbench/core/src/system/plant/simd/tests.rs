use super::{Lanes, Mask, Pair, Register};
use pulp::{Arch, Simd, WithSimd};

/// Numbers among which every comparison and every sign occurs.
const SOME: [f64; 8] = [-2.5, -0.0, 0.0, 1e-300, 1.0, -1.0, 7.25, 3.0];

/// What every operation gives, set by set, as bits.
fn answers<L: Lanes>(like: L) -> Vec<u64> {
    let a = like.of(|set| SOME[set % SOME.len()]);
    let b = like.of(|set| SOME[(3 * set + 1) % SOME.len()]);
    let numbers = [
        a + b,
        a - b,
        a * b,
        a / b,
        -a,
        a + 0.1,
        a - 0.1,
        a * 0.1,
        a.abs(),
        a.copysign(b),
        a.max(b),
        a.min(b),
        a.within(b.abs()),
        a.map(f64::exp),
        a.sin(),
        L::select(a.gt(b), a, b),
        L::select(a.ge(b), a, b),
        L::select(a.lt(b) | a.gt(b), a, b),
        L::select(a.le(b) & !a.ge(b), a, b),
    ];
    let mut bits = Vec::new();
    for set in 0..L::COUNT {
        bits.extend(numbers.iter().map(|number| number.lane(set).to_bits()));
    }
    bits
}

/// The same of numbers one by one.
fn one_by_one(sets: usize) -> Vec<u64> {
    let mut bits = Vec::new();
    for set in 0..sets {
        let (a, b) = (SOME[set % SOME.len()], SOME[(3 * set + 1) % SOME.len()]);
        let below = if b.abs() > a { a } else { b.abs() };
        let numbers = [
            a + b,
            a - b,
            a * b,
            a / b,
            -a,
            a + 0.1,
            a - 0.1,
            a * 0.1,
            a.abs(),
            a.copysign(b),
            if a > b { a } else { b },
            if b > a { a } else { b },
            if below > -b.abs() { below } else { -b.abs() },
            a.exp(),
            Lanes::sin(a),
            if a > b { a } else { b },
            if a >= b { a } else { b },
            if a != b { a } else { b },
            if a < b { a } else { b },
        ];
        bits.extend(numbers.iter().map(|number| number.to_bits()));
    }
    bits
}

struct Compare;

impl WithSimd for Compare {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let one = Register::splat(simd, 0.0);
        assert_eq!(answers(one), one_by_one(Register::<S>::COUNT));
        assert_eq!(answers(Pair(one, one)), one_by_one(2 * Register::<S>::COUNT));
        stored(Pair(one, one));
        masks(Pair(one, one));
    }
}

fn stored<L: Lanes>(like: L) {
    let mut kept = [0.0; 16];
    like.load(&SOME).store(&mut kept);
    assert_eq!(kept[..L::COUNT.min(8)], SOME[..L::COUNT.min(8)]);
}

fn masks<L: Lanes>(like: L) {
    let last = like.of(|set| if set + 1 == L::COUNT { 1.0 } else { 0.0 });
    let mask = last.gt(like.like(0.5));
    assert!(mask.any() && !(!mask).all() && (mask | !mask).all());
    assert_eq!(mask.all(), L::COUNT == 1);
}

#[test]
fn every_width_gives_the_bits_of_single_numbers() {
    assert_eq!(answers(0.0), one_by_one(1));
    Arch::new().dispatch(Compare);
    pulp::Scalar::new().vectorize(Compare);
}

#[test]
fn the_sine_is_right_to_its_last_digits() {
    for k in -200_000..200_000 {
        let angle = f64::from(k) * 0.31;
        let error = (Lanes::sin(angle) - angle.sin()).abs();
        assert!(error < 4e-16 * (1.0 + angle.abs() * 1e-3), "sin {angle}: {error:e}");
    }
}
