//! What a solve leaves over, and what that may cost, in one pass over the matrix.

use ndarray::{ArrayView2, s};
use pulp::{Arch, Simd, WithSimd};

use crate::product::{ABREAST, Lanes, Rows, abreast};
use crate::scalar::Scalar;

/// Rows whose residuals stay in the first cache while they are multiplied with the solution.
const TILE: usize = 64;

/// Writes Xᵀ (B − A X), row-major (k, k), and gives the largest entry of B − A X in size.
///
/// The matrix is symmetric, so that its columns are as good as its rows. B and X are (n, k); the
/// result is NaN where one of their numbers is.
///
/// # Panics
/// When a size does not fit.
pub fn residual<T: Scalar>(
    matrix: Rows<'_, T>,
    rhs: ArrayView2<'_, T>,
    x: ArrayView2<'_, T>,
    lost: &mut [T],
) -> f64 {
    let (n, k) = x.dim();
    assert!(matrix.n_rows() == n && matrix.n_columns() <= n);
    assert!(rhs.dim() == x.dim() && lost.len() == k * k);
    let groups = (0..k).step_by(ABREAST);
    let known: Vec<_> = groups.clone().map(|first| abreast(x, first)).collect();
    let mut largest = 0.0_f64;
    for (group, first) in groups.enumerate() {
        let mut sums = vec![[Lanes::ZERO; ABREAST]; known.len()];
        let found = Arch::new().dispatch(Pass {
            matrix,
            rhs,
            known: &known,
            group,
            sums: &mut sums,
        });
        largest = if largest > found { largest } else { found };
        if largest.is_nan() {
            break;
        }
        let count = ABREAST.min(k - first);
        for (sum, target) in sums.as_flattened().iter().zip(lost.chunks_exact_mut(k)) {
            target[first..first + count].copy_from_slice(&sum.0[..count]);
        }
    }
    largest.sqrt()
}

struct Pass<'a, T> {
    matrix: Rows<'a, T>,
    rhs: ArrayView2<'a, T>,
    /// The solution, by groups of columns.
    known: &'a [Vec<Lanes<T>>],
    /// Which of them this pass is for.
    group: usize,
    /// For each group, its products with the residual.
    sums: &'a mut [[Lanes<T>; ABREAST]],
}

impl<T: Scalar> WithSimd for Pass<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let mut largest = [0.0_f64; ABREAST];
        let mut poison = 0.0_f64;
        let (n, own) = (self.matrix.n_rows(), &self.known[self.group]);
        for begin in (0..n).step_by(TILE) {
            let rows = begin..n.min(begin + TILE);
            let given = self.rhs.slice(s![rows.clone(), ..]);
            let mut tile = abreast(given, self.group * ABREAST);
            for (left, row) in tile.iter_mut().zip(rows.clone()) {
                subtract_row(left, self.matrix, row, own);
                for (most, value) in largest.iter_mut().zip(left.0) {
                    let size = value.norm_sqr();
                    *most = if size > *most { size } else { *most };
                    poison += size * 0.0; // NaN from now on where a number is not finite
                }
            }
            for (sums, known) in self.sums.iter_mut().zip(self.known) {
                add_products(sums, &known[rows.clone()], &tile);
            }
        }
        largest
            .into_iter()
            .fold(poison, |a, b| if a > b || a.is_nan() { a } else { b })
    }
}

#[inline(always)]
fn subtract_row<T: Scalar>(
    left: &mut Lanes<T>,
    matrix: Rows<'_, T>,
    row: usize,
    known: &[Lanes<T>],
) {
    let mut sums = *left;
    for (column, value) in matrix.row(row) {
        for (sum, &x) in sums.0.iter_mut().zip(&known[column].0) {
            *sum -= value * x;
        }
    }
    *left = sums;
}

/// Adds Xᵀ R over some rows: two columns of X a time, so that the sums stay in registers.
#[inline(always)]
fn add_products<T: Scalar>(sums: &mut [Lanes<T>; ABREAST], x: &[Lanes<T>], left: &[Lanes<T>]) {
    for (at, pair) in sums.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        let [mut first, mut second] = *pair;
        for (x, left) in x.iter().zip(left) {
            let (p, q) = (x.0[2 * at], x.0[2 * at + 1]);
            for i in 0..ABREAST {
                first.0[i] += left.0[i] * p;
                second.0[i] += left.0[i] * q;
            }
        }
        *pair = [first, second];
    }
}
