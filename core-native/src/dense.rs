//! A small dense system, solved by short loops.

use faer::MatMut;
use pulp::{Simd, WithSimd};

use crate::scalar::Scalar;

/// Gaussian elimination with row exchanges; NaN where the system is singular.
pub struct Small<'a, T> {
    /// (m, m); read only.
    pub system: MatMut<'a, T>,
    /// (m, k) right-hand sides; the solution afterwards.
    pub current: MatMut<'a, T>,
}

impl<T: Scalar> WithSimd for Small<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (m, width) = self.current.shape();
        let row = m + width;
        let mut joined = vec![T::ZERO; m * row];
        for (i, joined) in joined.chunks_exact_mut(row).enumerate() {
            for (j, value) in joined.iter_mut().enumerate() {
                *value = if j < m {
                    self.system[(i, j)]
                } else {
                    self.current[(i, j - m)]
                };
            }
        }
        for k in 0..m {
            let size = |&i: &usize| joined[i * row + k].norm_sqr();
            let largest = |a: &usize, b: &usize| size(a).total_cmp(&size(b));
            let pivot = (k..m).max_by(largest).unwrap_or(k);
            let (above, below) = joined.split_at_mut((k + 1) * row);
            let top = &mut above[k * row..];
            if pivot > k {
                top.swap_with_slice(&mut below[(pivot - k - 1) * row..][..row]);
            }
            let inverse = T::ONE / top[k];
            for other in below.chunks_exact_mut(row) {
                let factor = other[k] * inverse;
                reduce(&mut other[k + 1..], factor, &top[k + 1..]);
            }
        }
        for k in (0..m).rev() {
            let (above, below) = joined.split_at_mut(k * row);
            let inverse = T::ONE / below[k];
            let known = &mut below[m..row];
            for value in known.iter_mut() {
                *value *= inverse;
            }
            for other in above.chunks_exact_mut(row) {
                let factor = other[k];
                reduce(&mut other[m..], factor, known);
            }
        }
        let mut current = self.current;
        for (i, joined) in joined.chunks_exact(row).enumerate() {
            for (j, &value) in joined[m..].iter().enumerate() {
                current[(i, j)] = value;
            }
        }
    }
}

#[inline(always)]
fn reduce<T: Scalar>(row: &mut [T], factor: T, by: &[T]) {
    for (value, &other) in row.iter_mut().zip(by) {
        *value -= factor * other;
    }
}
