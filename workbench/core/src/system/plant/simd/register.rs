//! The sets of one vector register, as wide as the processor has them (crate `pulp`, chosen at run time).
//!
//! Only those operations of `pulp` are used that each processor's own type has. What the trait provides for all of them (`select_f64s`,
//! `abs_f64s`, `neg_f64s`) is compiled without the processor's registers, and calls of it went through memory: two fifths of a
//! simulation of two bodies.

use super::{Apart, Lanes, Mask};
use pulp::{Simd, WithSimd, bytemuck};
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// One register of numbers. It carries the proof that the processor has such registers; that proof takes no room.
#[derive(Clone, Copy, Debug)]
pub struct Register<S: Simd> {
    simd: S,
    numbers: S::f64s,
}

/// One register of yes or no.
#[derive(Clone, Copy, Debug)]
pub struct RegisterMask<S: Simd> {
    simd: S,
    bits: S::m64s,
}

impl<S: Simd> Register<S> {
    /// The same number in every place.
    #[inline(always)]
    pub fn splat(simd: S, value: f64) -> Self {
        Self { simd, numbers: simd.splat_f64s(value) }
    }

    #[inline(always)]
    fn with(self, numbers: S::f64s) -> Self {
        Self { numbers, ..self }
    }

    #[inline(always)]
    fn slice(&self) -> &[f64] {
        bytemuck::cast_slice(std::slice::from_ref(&self.numbers))
    }

    #[inline(always)]
    fn slice_mut(&mut self) -> &mut [f64] {
        bytemuck::cast_slice_mut(std::slice::from_mut(&mut self.numbers))
    }

    #[inline(always)]
    fn mask(self, bits: S::m64s) -> RegisterMask<S> {
        RegisterMask { simd: self.simd, bits }
    }
}

impl<S: Simd> Lanes for Register<S> {
    type Mask = RegisterMask<S>;
    const COUNT: usize = S::F64_LANES;

    #[inline(always)]
    fn like(self, value: f64) -> Self {
        Self::splat(self.simd, value)
    }

    #[inline(always)]
    fn gt(self, other: Self) -> Self::Mask {
        self.mask(self.simd.greater_than_f64s(self.numbers, other.numbers))
    }

    #[inline(always)]
    fn ge(self, other: Self) -> Self::Mask {
        self.mask(self.simd.greater_than_or_equal_f64s(self.numbers, other.numbers))
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        let simd = yes.simd;
        let [yes_bits, no_bits] = [yes, no].map(|it| bytemuck::cast(it.numbers));
        yes.with(bytemuck::cast(simd.select_u64s(mask.bits, yes_bits, no_bits)))
    }

    #[inline(always)]
    fn abs(self) -> Self {
        let all_but_sign = self.simd.splat_f64s(f64::from_bits(!(1 << 63)));
        self.with(self.simd.and_f64s(self.numbers, all_but_sign))
    }

    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = self.simd.splat_f64s(-0.0);
        let sign = self.simd.and_f64s(bit, sign.numbers);
        self.with(self.simd.or_f64s(self.abs().numbers, sign))
    }

    #[inline(always)]
    fn map(mut self, function: impl Fn(f64) -> f64) -> Self {
        for number in self.slice_mut() {
            *number = function(*number);
        }
        self
    }

    #[inline(always)]
    fn of(mut self, number: impl Fn(usize) -> f64) -> Self {
        for (set, place) in self.slice_mut().iter_mut().enumerate() {
            *place = number(set);
        }
        self
    }

    #[inline(always)]
    fn lane(self, set: usize) -> f64 {
        self.slice()[set]
    }

    #[inline(always)]
    fn load(self, from: &[f64]) -> Self {
        self.with(bytemuck::pod_read_unaligned(bytemuck::cast_slice(&from[..Self::COUNT])))
    }

    #[inline(always)]
    fn store(self, to: &mut [f64]) {
        to[..Self::COUNT].copy_from_slice(self.slice());
    }

    #[inline(always)]
    fn push_to(self, to: &mut Vec<f64>) {
        to.extend_from_slice(self.slice());
    }

    #[inline(always)]
    fn apart<A: Apart>(self, part: A) -> A::Output {
        self.simd.vectorize(Vectorized(part))
    }
}

struct Vectorized<A>(A);

impl<A: Apart> WithSimd for Vectorized<A> {
    type Output = A::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> A::Output {
        self.0.run()
    }
}

macro_rules! operator {
    ($trait:ident, $function:ident, $intrinsic:ident) => {
        impl<S: Simd> $trait for Register<S> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: Self) -> Self {
                self.with(self.simd.$intrinsic(self.numbers, other.numbers))
            }
        }

        impl<S: Simd> $trait<f64> for Register<S> {
            type Output = Self;

            #[inline(always)]
            fn $function(self, other: f64) -> Self {
                self.with(self.simd.$intrinsic(self.numbers, self.simd.splat_f64s(other)))
            }
        }
    };
}

operator!(Add, add, add_f64s);
operator!(Sub, sub, sub_f64s);
operator!(Mul, mul, mul_f64s);
operator!(Div, div, div_f64s);

impl<S: Simd> Neg for Register<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.with(self.simd.xor_f64s(self.numbers, self.simd.splat_f64s(-0.0)))
    }
}

impl<S: Simd> BitAnd for RegisterMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self { bits: self.simd.and_m64s(self.bits, other.bits), ..self }
    }
}

impl<S: Simd> BitOr for RegisterMask<S> {
    type Output = Self;

    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self { bits: self.simd.or_m64s(self.bits, other.bits), ..self }
    }
}

impl<S: Simd> Not for RegisterMask<S> {
    type Output = Self;

    #[inline(always)]
    fn not(self) -> Self {
        Self { bits: self.simd.not_m64s(self.bits), ..self }
    }
}

impl<S: Simd> Mask for RegisterMask<S> {
    #[inline(always)]
    fn any(self) -> bool {
        if const { size_of::<S::m64s>() != size_of::<S::f64s>() } {
            return self.simd.first_true_m64s(self.bits) < S::F64_LANES;
        }
        // The compiler makes one instruction of it; asking place by place would be a loop.
        let words: &[u64] = bytemuck::cast_slice(std::slice::from_ref(&self.bits));
        let mut any = 0;
        for word in words {
            any |= word;
        }
        any != 0
    }

    #[inline(always)]
    fn all(self) -> bool {
        !(!self).any()
    }
}
