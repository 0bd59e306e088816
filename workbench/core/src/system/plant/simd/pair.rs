//! Two of a kind side by side: while one waits for its results, the other is computed.

use super::{Apart, Lanes, Mask};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// Twice as many sets.
#[derive(Clone, Copy, Debug)]
pub struct Pair<L>(pub L, pub L);

impl<L: Lanes> Lanes for Pair<L> {
    type Mask = Pair<L::Mask>;
    const COUNT: usize = 2 * L::COUNT;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self(self.0.like(value), self.1.like(value))
    }

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        Pair(self.0.gt(other.0), self.1.gt(other.1))
    }

    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        Pair(self.0.ge(other.0), self.1.ge(other.1))
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        Self(L::select(mask.0, yes.0, no.0), L::select(mask.1, yes.1, no.1))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0), self.1.copysign(sign.1))
    }

    #[inline(always)]
    fn map(self, function: impl Fn(f64) -> f64) -> Self {
        Self(self.0.map(&function), self.1.map(&function))
    }

    #[inline(always)]
    fn of(self, number: impl Fn(usize) -> f64) -> Self {
        Self(self.0.of(&number), self.1.of(|set| number(L::COUNT + set)))
    }

    #[inline(always)]
    fn lane(self, set: usize) -> f64 {
        if set < L::COUNT { self.0.lane(set) } else { self.1.lane(set - L::COUNT) }
    }

    #[inline(always)]
    fn load(self, from: &[f64]) -> Self {
        Self(self.0.load(from), self.1.load(&from[L::COUNT..]))
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        self.0.store(to);
        self.1.store(&mut to[L::COUNT..]);
    }

    #[inline(always)]
    fn push_to(self, to: &mut Vec<f64>) {
        self.0.push_to(to);
        self.1.push_to(to);
    }

    #[inline(always)]
    fn apart<A: Apart>(self, part: A) -> A::Output {
        self.0.apart(part)
    }
}

macro_rules! operator {
    ($trait:ident, $function:ident, $bound:ident) => {
        impl<L: $bound> $trait for Pair<L> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                Self(self.0.$function(other.0), self.1.$function(other.1))
            }
        }
    };
}

macro_rules! with_one_number {
    ($trait:ident, $function:ident) => {
        impl<L: Lanes> $trait<f64> for Pair<L> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: f64) -> Self {
                Self(self.0.$function(other), self.1.$function(other))
            }
        }
    };
}

operator!(Add, add, Lanes);
operator!(Sub, sub, Lanes);
operator!(Mul, mul, Lanes);
operator!(Div, div, Lanes);
operator!(BitAnd, bitand, Mask);
operator!(BitOr, bitor, Mask);
with_one_number!(Add, add);
with_one_number!(Sub, sub);
with_one_number!(Mul, mul);

impl<L: Lanes> Neg for Pair<L> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl<M: Mask> Not for Pair<M> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn any(self) -> bool {
        self.0.any() | self.1.any()
    }

    #[inline(always)]
    fn all(self) -> bool {
        self.0.all() & self.1.all()
    }
}
