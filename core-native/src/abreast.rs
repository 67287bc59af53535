//! Numbers of many cells, as many abreast as a register holds.

use std::ops::{Add, Deref, Div, Mul, Sub};
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

    /// The polynomial of these numbers, its highest factor first, with an even number of factors.
    ///
    /// Even and odd powers apart, so that fewer steps wait for each other.
    #[inline(always)]
    pub fn series<const N: usize>(self, factors: &[f64; N]) -> Self {
        const { assert!(N.is_multiple_of(2)) }
        let square = self * self;
        let next = |sum: Self, factor: f64| sum.times_plus(square, self.all(factor));
        let (mut odd, mut even) = (self.all(0.0), self.all(0.0));
        for [one, other] in factors.as_chunks::<2>().0 {
            (odd, even) = (next(odd, *one), next(even, *other));
        }
        odd.times_plus(self, even)
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

/// Rows of as many numbers each.
pub(crate) struct Rows<V> {
    values: V,
    count: usize,
    n: usize,
}

impl<V: Deref<Target = [f64]>> Rows<V> {
    /// So many rows of `n` numbers.
    ///
    /// # Panics
    /// When there are fewer values.
    #[inline(always)]
    pub fn new(values: V, count: usize, n: usize) -> Self {
        assert!(count.checked_mul(n).is_some_and(|all| all <= values.len()));
        Self { values, count, n }
    }

    /// Whether there are none.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }
}

/// A block of each row, from `at` on: a whole one, or the part at the end.
#[derive(Clone, Copy)]
pub(crate) struct Block<S: Simd, const WHOLE: bool> {
    pub simd: S,
    pub at: usize,
}

impl<S: Simd, const WHOLE: bool> Block<S, WHOLE> {
    /// One number, for all cells.
    #[inline(always)]
    pub fn all(self, value: f64) -> Reals<S> {
        self.made(self.simd.splat_f64s(value))
    }

    /// The block of a row; zero beyond its end.
    #[inline(always)]
    pub fn read<V: Deref<Target = [f64]>>(self, rows: &Rows<V>, row: usize) -> Reals<S> {
        let begin = self.begin(rows, row);
        if WHOLE {
            // SAFETY: `begin` has seen that so many numbers follow.
            let block = unsafe {
                rows.values
                    .as_ptr()
                    .add(begin)
                    .cast::<S::f64s>()
                    .read_unaligned()
            };
            return self.made(block);
        }
        let rest = &rows.values[begin..][..rows.n - self.at];
        self.made(self.simd.partial_load_f64s(rest))
    }

    /// The block of four rows from `first` on.
    #[inline(always)]
    pub fn four<V: Deref<Target = [f64]>>(self, rows: &Rows<V>, first: usize) -> [Reals<S>; 4] {
        [0, 1, 2, 3].map(|row| self.read(rows, first + row))
    }

    /// Writes the block of a row.
    #[inline(always)]
    pub fn write(self, rows: &mut Rows<&mut [f64]>, row: usize, block: Reals<S>) {
        let begin = self.begin(rows, row);
        if WHOLE {
            let target = rows.values.as_mut_ptr();
            // SAFETY: `begin` has seen that so many numbers follow.
            unsafe {
                target
                    .add(begin)
                    .cast::<S::f64s>()
                    .write_unaligned(block.values)
            };
            return;
        }
        let rest = &mut rows.values[begin..][..rows.n - self.at];
        self.simd.partial_store_f64s(rest, block.values);
    }

    /// Where the block begins among the values of all rows, as far as it is there.
    #[inline(always)]
    fn begin<V>(self, rows: &Rows<V>, row: usize) -> usize {
        assert!(row < rows.count && self.at < rows.n);
        assert!(!WHOLE || rows.n - self.at >= S::F64_LANES);
        row * rows.n + self.at
    }

    #[inline(always)]
    fn made(self, values: S::f64s) -> Reals<S> {
        Reals {
            simd: self.simd,
            values,
        }
    }
}
