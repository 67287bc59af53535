//! Products of small matrices, for which laying operands out costs more than the product.

use pulp::{Arch, Simd, WithSimd};

use crate::dense::Matrix;

/// Columns of each side that are multiplied at a time.
const BLOCK: usize = 2;

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
    for (target, right) in out
        .values
        .chunks_mut(WIDE * height)
        .zip(right.chunks(WIDE * inner))
    {
        Arch::new().dispatch(Products {
            left,
            height,
            right,
            target,
        });
    }
    out
}

/// Columns of the right side that are multiplied at a time.
const WIDE: usize = 4;

struct Products<'a> {
    left: &'a [f64],
    height: usize,
    right: &'a [f64],
    target: &'a mut [f64],
}

impl WithSimd for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let (height, inner) = (self.height, self.left.len() / self.height);
        let n = self.target.len() / height;
        // beyond the last column the last one is multiplied again, and dropped
        let column = |j: usize| &self.right[j.min(n - 1) * inner..][..inner];
        let (a, b, c, d) = (column(0), column(1), column(2), column(3));
        let lanes = S::F64_LANES;
        let whole = height - height % lanes;
        for first in (0..whole).step_by(lanes) {
            let zero = simd.splat_f64s(0.0);
            let (mut ra, mut rb, mut rc, mut rd) = (zero, zero, zero, zero);
            for k in 0..inner {
                let at = k * height + first;
                let value = S::as_simd_f64s(&self.left[at..at + lanes]).0[0];
                ra = simd.mul_add_e_f64s(value, simd.splat_f64s(a[k]), ra);
                rb = simd.mul_add_e_f64s(value, simd.splat_f64s(b[k]), rb);
                rc = simd.mul_add_e_f64s(value, simd.splat_f64s(c[k]), rc);
                rd = simd.mul_add_e_f64s(value, simd.splat_f64s(d[k]), rd);
            }
            for (j, sum) in [ra, rb, rc, rd].into_iter().enumerate().take(n) {
                let at = j * height + first;
                S::as_mut_simd_f64s(&mut self.target[at..at + lanes]).0[0] = sum;
            }
        }
        for row in whole..height {
            for j in 0..n {
                let right = column(j).iter().enumerate();
                self.target[j * height + row] =
                    right.map(|(k, x)| self.left[k * height + row] * x).sum();
            }
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
        for i in (0..height).step_by(BLOCK) {
            let end = if self.lower { i + 1 } else { width };
            for j in (0..end).step_by(BLOCK) {
                let found = block(simd, [left(i), left(i + 1)], [right(j), right(j + 1)]);
                for (row, values) in found.iter().enumerate().take(height - i) {
                    for (column, value) in values.iter().enumerate().take(width - j) {
                        self.out[(i + row, j + column)] = *value;
                    }
                }
            }
        }
    }
}

/// Each of two columns times each of two others.
#[inline(always)]
fn block<S: Simd>(simd: S, [a, b]: [&[f64]; 2], [c, d]: [&[f64]; 2]) -> [[f64; 2]; 2] {
    let zero = simd.splat_f64s(0.0);
    let (mut ac, mut ad, mut bc, mut bd) = (zero, zero, zero, zero);
    let whole = a.len() - a.len() % S::F64_LANES;
    let (u, v) = (S::as_simd_f64s(a).0, S::as_simd_f64s(b).0);
    let (x, y) = (S::as_simd_f64s(c).0, S::as_simd_f64s(d).0);
    let n = u.len();
    let (v, x, y) = (&v[..n], &x[..n], &y[..n]);
    for n in 0..n {
        ac = simd.mul_add_e_f64s(u[n], x[n], ac);
        ad = simd.mul_add_e_f64s(u[n], y[n], ad);
        bc = simd.mul_add_e_f64s(v[n], x[n], bc);
        bd = simd.mul_add_e_f64s(v[n], y[n], bd);
    }
    let mut out = [
        [simd.reduce_sum_f64s(ac), simd.reduce_sum_f64s(ad)],
        [simd.reduce_sum_f64s(bc), simd.reduce_sum_f64s(bd)],
    ];
    for n in whole..a.len() {
        out[0][0] += a[n] * c[n];
        out[0][1] += a[n] * d[n];
        out[1][0] += b[n] * c[n];
        out[1][1] += b[n] * d[n];
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
