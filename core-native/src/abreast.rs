//! Numbers of many cells, as many abreast as a register holds.

use std::ops::{Add, Div, Mul, Sub};
use std::slice::from_raw_parts_mut;

use pulp::Simd;

use crate::scalar::Scalar;

/// As many numbers as a register of `S` holds.
#[derive(Clone, Copy)]
pub(crate) struct Reals<S: Simd> {
    simd: S,
    values: S::f64s,
}

impl<S: Simd> Reals<S> {
    /// One number, as often as there are others.
    #[inline(always)]
    pub fn all(self, value: f64) -> Self {
        self.made(self.simd.splat_f64s(value))
    }

    /// These times the factor, and what is added.
    #[inline(always)]
    pub fn times_plus(self, factor: Self, added: Self) -> Self {
        let (values, factor) = (self.values, factor.values);
        self.made(f64::plus_product(self.simd, values, factor, added.values))
    }

    /// The polynomial of these numbers, its highest factor first.
    #[inline(always)]
    pub fn series(self, factors: &[f64]) -> Self {
        let sum = |sum: Self, &factor| sum.times_plus(self, self.all(factor));
        factors.iter().fold(self.all(0.0), sum)
    }

    /// Whether all are below.
    #[inline(always)]
    pub fn below(self, limit: f64) -> bool {
        let most = self.simd.reduce_max_f64s(self.values);
        most < limit
    }

    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.made(self.simd.max_f64s(self.values, other.values))
    }

    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.made(self.simd.min_f64s(self.values, other.values))
    }

    /// These, at most that large in size.
    #[inline(always)]
    pub fn bounded(self, most: Self) -> Self {
        self.max(self.all(0.0) - most).min(most)
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.made(self.simd.sqrt_f64s(self.values))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        self.made(self.simd.abs_f64s(self.values))
    }

    #[inline(always)]
    fn made(self, values: S::f64s) -> Self {
        Self {
            simd: self.simd,
            values,
        }
    }
}

impl<S: Simd> Add for Reals<S> {
    type Output = Self;

    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.made(self.simd.add_f64s(self.values, other.values))
    }
}

impl<S: Simd> Sub for Reals<S> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.made(self.simd.sub_f64s(self.values, other.values))
    }
}

impl<S: Simd> Mul for Reals<S> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.made(self.simd.mul_f64s(self.values, other.values))
    }
}

impl<S: Simd> Div for Reals<S> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.made(self.simd.div_f64s(self.values, other.values))
    }
}

/// eˣ for sizes of x up to 700, to the last digit but one: 2ᵏ eʳ with a small r, by Taylor's series.
#[inline(always)]
pub(crate) fn exp<S: Simd>(x: Reals<S>) -> Reals<S> {
    /// So large that adding it rounds to whole numbers, which are then its last digits.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    /// ln 2 in two parts, of which k times the first is exact.
    const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];
    const SERIES: [f64; 12] = [
        1.0 / 6_227_020_800.0,
        1.0 / 479_001_600.0,
        1.0 / 39_916_800.0,
        1.0 / 3_628_800.0,
        1.0 / 362_880.0,
        1.0 / 40_320.0,
        1.0 / 5_040.0,
        1.0 / 720.0,
        1.0 / 120.0,
        1.0 / 24.0,
        1.0 / 6.0,
        0.5,
    ];
    let shifted = x * x.all(std::f64::consts::LOG2_E) + x.all(WHOLE);
    let k = shifted - x.all(WHOLE);
    let r = k.times_plus(x.all(-LN_2[1]), k.times_plus(x.all(-LN_2[0]), x));
    let series = r.series(&SERIES);
    let mut scale = shifted.values;
    // SAFETY: a register of these numbers is nothing but so many times eight bytes.
    let bits = unsafe { from_raw_parts_mut((&raw mut scale).cast::<u64>(), S::F64_LANES) };
    for bits in bits {
        *bits = bits.wrapping_add(1023) << 52;
    }
    x.made(scale) * (x.all(1.0) + (r * r).times_plus(series, r))
}

/// Rows of `n` numbers each, of which blocks are taken: whole ones, or the part at the end.
#[derive(Clone, Copy)]
pub(crate) struct Abreast<S: Simd, const WHOLE: bool> {
    pub simd: S,
    pub n: usize,
}

impl<S: Simd, const WHOLE: bool> Abreast<S, WHOLE> {
    /// One number, for all cells of a block.
    #[inline(always)]
    pub fn all(self, value: f64) -> Reals<S> {
        self.made(self.simd.splat_f64s(value))
    }

    /// A block of a row, from `at` on; zero beyond its end.
    #[inline(always)]
    pub fn read(self, values: &[f64], row: usize, at: usize) -> Reals<S> {
        let block = &values[row * self.n + at..];
        if WHOLE {
            return self.made(S::as_simd_f64s(&block[..S::F64_LANES]).0[0]);
        }
        self.made(self.simd.partial_load_f64s(&block[..self.n - at]))
    }

    /// A block of four rows from `first` on.
    #[inline(always)]
    pub fn four(self, values: &[f64], first: usize, at: usize) -> [Reals<S>; 4] {
        [
            self.read(values, first, at),
            self.read(values, first + 1, at),
            self.read(values, first + 2, at),
            self.read(values, first + 3, at),
        ]
    }

    /// Writes a block of a row.
    #[inline(always)]
    pub fn write(self, values: &mut [f64], row: usize, at: usize, block: Reals<S>) {
        let target = &mut values[row * self.n + at..];
        if WHOLE {
            S::as_mut_simd_f64s(&mut target[..S::F64_LANES]).0[0] = block.values;
        } else {
            let target = &mut target[..self.n - at];
            self.simd.partial_store_f64s(target, block.values);
        }
    }

    #[inline(always)]
    fn made(self, values: S::f64s) -> Reals<S> {
        Reals {
            simd: self.simd,
            values,
        }
    }
}
