//! Products of small matrices, for which laying operands out costs more than the product.

use pulp::{Arch, Simd, WithSimd};

use crate::dense::Matrix;

/// Columns of the left side, and of the right one, that are multiplied at a time.
const BLOCK: [usize; 2] = [4, 2];

/// leftᵀ right, of columns of `length`.
///
/// # Panics
/// When the length is zero.
pub fn dots(left: &[f64], right: &[f64], length: usize) -> Matrix<f64> {
    let mut out = Matrix::zeros(left.len() / length, right.len() / length);
    if !out.values.is_empty() {
        Arch::new().dispatch(Dots {
            left,
            right,
            length,
            lower: false,
            out: &mut out,
        });
    }
    out
}

/// columnsᵀ columns, of columns of `length`: half of the products, as it is symmetric.
///
/// # Panics
/// When the length is zero.
pub fn squares(columns: &[f64], length: usize) -> Matrix<f64> {
    let n = columns.len() / length;
    let mut out = Matrix::zeros(n, n);
    if n > 0 {
        Arch::new().dispatch(Dots {
            left: columns,
            right: columns,
            length,
            lower: true,
            out: &mut out,
        });
    }
    for j in 0..n {
        for i in 0..j {
            out[(i, j)] = out[(j, i)];
        }
    }
    out
}

/// left · right, of a left side of `height` rows.
///
/// # Panics
/// When the height is zero, or the left side has no columns.
pub fn product(left: &[f64], height: usize, right: &[f64]) -> Matrix<f64> {
    let inner = left.len() / height;
    let mut out = Matrix::zeros(height, right.len() / inner);
    Arch::new().dispatch(Products {
        left,
        height,
        right,
        target: &mut out.values,
    });
    out
}

/// Columns of the right side that are multiplied at a time, with so many registers of rows.
const WIDE: usize = 4;
const HIGH: usize = 2;

struct Products<'a> {
    left: &'a [f64],
    height: usize,
    right: &'a [f64],
    target: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, simd: S) {
        let whole = self.height - self.height % S::F64_LANES;
        let step = HIGH * S::F64_LANES;
        let even = whole - whole % step;
        for first in (0..even).step_by(step) {
            self.rows::<S, HIGH>(simd, first);
        }
        for first in (even..whole).step_by(S::F64_LANES) {
            self.rows::<S, 1>(simd, first);
        }
        let (height, inner) = (self.height, self.left.len() / self.height);
        for row in whole..height {
            for (j, right) in self.right.chunks_exact(inner).enumerate() {
                let right = right.iter().enumerate();
                self.target[j * height + row] =
                    right.map(|(k, x)| self.left[k * height + row] * x).sum();
            }
        }
    }
}

impl Products<'_> {
    /// So many registers of rows from the `first` on, of all columns: the left side's stay in the
    /// first cache.
    #[inline(always)]
    fn rows<S: Simd, const N: usize>(&mut self, simd: S, first: usize) {
        let n = self.target.len() / self.height;
        for start in (0..n).step_by(WIDE) {
            match n - start {
                1 => self.block::<S, N, 1>(simd, first, start),
                2 => self.block::<S, N, 2>(simd, first, start),
                3 => self.block::<S, N, 3>(simd, first, start),
                _ => self.block::<S, N, WIDE>(simd, first, start),
            }
        }
    }

    /// The same of so many columns from the `start` on.
    #[inline(always)]
    fn block<S: Simd, const N: usize, const W: usize>(
        &mut self,
        simd: S,
        first: usize,
        start: usize,
    ) {
        let (height, inner) = (self.height, self.left.len() / self.height);
        let column = |j: usize| &self.right[(start + j) * inner..][..inner];
        let columns: [&[f64]; W] = std::array::from_fn(column);
        let (mut sums, end) = ([[simd.splat_f64s(0.0); N]; W], first + N * S::F64_LANES);
        for (k, row) in self.left.chunks_exact(height).enumerate() {
            let values = S::as_simd_f64s(&row[first..end]).0;
            for (sum, column) in sums.iter_mut().zip(columns) {
                let factor = simd.splat_f64s(column[k]);
                for (sum, &value) in sum.iter_mut().zip(values) {
                    *sum = simd.mul_add_e_f64s(value, factor, *sum);
                }
            }
        }
        let targets = self.target[start * height..].chunks_exact_mut(height);
        for (target, sum) in targets.zip(&sums) {
            let target = S::as_mut_simd_f64s(&mut target[first..end]).0;
            target.copy_from_slice(sum);
        }
    }
}

/// Adds Σ `scale` · factor · column to a target, over columns of as many entries.
pub fn add_sums<'a>(
    target: &mut [f64],
    scale: f64,
    columns: impl Iterator<Item = &'a [f64]>,
    factors: &[f64],
) {
    let columns = columns.zip(factors);
    Arch::new().dispatch(Sums {
        target,
        scale,
        columns,
    });
}

struct Dots<'a> {
    left: &'a [f64],
    right: &'a [f64],
    length: usize,
    /// Whether blocks above the diagonal are of no use.
    lower: bool,
    out: &'a mut Matrix<f64>,
}

impl WithSimd for Dots<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (height, width, length) = (self.out.height, self.out.width(), self.length);
        let left = |i: usize| &self.left[i.min(height - 1) * length..][..length];
        let right = |j: usize| &self.right[j.min(width - 1) * length..][..length];
        // the right side is the smaller one, as a rule, and stays in the first cache
        for i in (0..height).step_by(BLOCK[0]) {
            let end = if self.lower {
                width.min(i + BLOCK[0])
            } else {
                width
            };
            let own = std::array::from_fn(|row| left(i + row));
            for j in (0..end).step_by(BLOCK[1]) {
                let found = block(simd, own, std::array::from_fn(|column| right(j + column)));
                for (row, values) in found.iter().enumerate().take(height - i) {
                    for (column, value) in values.iter().enumerate().take(width - j) {
                        self.out[(i + row, j + column)] = *value;
                    }
                }
            }
        }
    }
}

/// Each of some columns times each of others, all of one length.
#[inline(always)]
fn block<S: Simd>(
    simd: S,
    left: [&[f64]; BLOCK[0]],
    right: [&[f64]; BLOCK[1]],
) -> [[f64; BLOCK[1]]; BLOCK[0]] {
    let length = left[0].len();
    let whole = length - length % S::F64_LANES;
    let one = left.map(|column| S::as_simd_f64s(&column[..whole]).0);
    let other = right.map(|column| S::as_simd_f64s(&column[..whole]).0);
    let mut sums = [[simd.splat_f64s(0.0); BLOCK[1]]; BLOCK[0]];
    for n in 0..whole / S::F64_LANES {
        for (sums, one) in sums.iter_mut().zip(one) {
            for (sum, other) in sums.iter_mut().zip(other) {
                *sum = simd.mul_add_e_f64s(one[n], other[n], *sum);
            }
        }
    }
    let mut out = sums.map(|row| row.map(|sum| simd.reduce_sum_f64s(sum)));
    for n in whole..length {
        for (sums, one) in out.iter_mut().zip(left) {
            for (sum, other) in sums.iter_mut().zip(right) {
                *sum += one[n] * other[n];
            }
        }
    }
    out
}

struct Sums<'t, I> {
    target: &'t mut [f64],
    scale: f64,
    columns: I,
}

impl<'a, 'f, I: Iterator<Item = (&'a [f64], &'f f64)>> WithSimd for Sums<'_, I> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (whole, rest) = S::as_mut_simd_f64s(self.target);
        for (column, entry) in self.columns {
            let (values, last) = S::as_simd_f64s(column);
            let factor = simd.splat_f64s(self.scale * entry);
            for (sum, &value) in whole.iter_mut().zip(values) {
                *sum = simd.mul_add_e_f64s(factor, value, *sum);
            }
            for (sum, value) in rest.iter_mut().zip(last) {
                *sum += self.scale * entry * value;
            }
        }
    }
}
