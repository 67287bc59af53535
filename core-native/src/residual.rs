//! What a solve leaves over, and what that may cost, in one pass over the matrix.

use numpy::ndarray::ArrayView2;
use pulp::{Arch, Simd, WithSimd};

use crate::product::{ABREAST, Rows, abreast};
use crate::scalar::Scalar;

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
    let mut largest = 0.0_f64;
    for first in (0..k).step_by(ABREAST) {
        let known = abreast(x, first);
        let mut sums = vec![[T::ZERO; ABREAST]; k];
        let found = Arch::new().dispatch(Pass {
            matrix,
            rhs,
            x,
            known: &known,
            first,
            sums: &mut sums,
        });
        largest = if largest > found { largest } else { found };
        let count = ABREAST.min(k - first);
        for (sum, target) in sums.iter().zip(lost.chunks_exact_mut(k)) {
            target[first..first + count].copy_from_slice(&sum[..count]);
        }
        if largest.is_nan() {
            break;
        }
    }
    largest.sqrt()
}

struct Pass<'a, T> {
    matrix: Rows<'a, T>,
    rhs: ArrayView2<'a, T>,
    x: ArrayView2<'a, T>,
    /// Columns of X from `first` on, side by side.
    known: &'a [[T; ABREAST]],
    first: usize,
    sums: &'a mut [[T; ABREAST]],
}

impl<T: Scalar> WithSimd for Pass<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> f64 {
        let columns = self.first..self.x.ncols().min(self.first + ABREAST);
        let mut largest = [0.0_f64; ABREAST];
        let mut poison = 0.0_f64;
        for row in 0..self.matrix.n_rows() {
            let mut left = [T::ZERO; ABREAST];
            for (value, &given) in left
                .iter_mut()
                .zip(self.rhs.row(row).iter().skip(columns.start))
            {
                *value = given;
            }
            for (column, value) in self.matrix.row(row) {
                for (sum, &x) in left.iter_mut().zip(&self.known[column]) {
                    *sum -= value * x;
                }
            }
            for (most, value) in largest.iter_mut().zip(left) {
                let size = value.norm_sqr();
                *most = if size > *most { size } else { *most };
                poison += size * 0.0; // NaN from now on where a number is not finite
            }
            let own = &self.known[row];
            for (sum, &by) in self.sums[columns.clone()].iter_mut().zip(own) {
                for (sum, &value) in sum.iter_mut().zip(&left) {
                    *sum += value * by;
                }
            }
            for column in (0..columns.start).chain(columns.end..self.x.ncols()) {
                let by = self.x[[row, column]];
                for (sum, &value) in self.sums[column].iter_mut().zip(&left) {
                    *sum += value * by;
                }
            }
        }
        largest
            .into_iter()
            .fold(poison, |a, b| if a > b || a.is_nan() { a } else { b })
    }
}
