//! Products of dense matrices on every processor.
//!
//! A product is the sum of tiles that stay in registers, from operands laid out for them (Goto &
//! van de Geijn 2008). A complex matrix counts as a real one with two rows for each of its own, so
//! that one tile does for both.

use std::ops::Range;

use pulp::bytemuck::{cast_slice, cast_slice_mut};
use pulp::{Simd, WithSimd};

use crate::dense::{Product, View};
use crate::scalar::Scalar;

/// Numbers of the inner index that are multiplied at a time: so much of a tile's operands stays in
/// the first cache.
const DEPTH: usize = 256;
/// Rows of the left operand, as reals, that are laid out at a time: they stay in the second cache.
const ROWS: usize = 192;
/// Vectors in a column of a tile.
const TALL: usize = 2;

/// A product that is added tile by tile.
pub struct Tiled<'a, T>(pub Product<'a, T>);

impl<T: Scalar> WithSimd for Tiled<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if S::REGISTER_COUNT >= 32 {
            self.run::<S, 8>(simd);
        } else {
            self.run::<S, 6>(simd);
        }
    }
}

impl<T: Scalar> Tiled<'_, T> {
    /// All of it, in tiles of `N` columns.
    #[inline(always)]
    fn run<S: Simd, const N: usize>(mut self, simd: S) {
        let ([m, n, inner], tall) = (self.0.size, TALL * S::F64_LANES);
        let m = m * T::REALS;
        let most = DEPTH.min(inner) * T::REALS;
        let mut left = vec![0.0; ROWS.min(m).next_multiple_of(tall) * most];
        let mut right = vec![0.0; n.next_multiple_of(N) * most];
        for first in (0..inner).step_by(DEPTH) {
            let inner = first..inner.min(first + DEPTH);
            let depth = inner.len() * T::REALS;
            let strips = right.chunks_exact_mut(N * depth);
            for (j, strip) in (0..n).step_by(N).zip(strips) {
                let columns = j..n.min(j + N);
                lay_right::<T, N>(strip, self.0.right, inner.clone(), columns, self.0.scale);
            }
            for top in (0..m).step_by(ROWS) {
                let bottom = m.min(top + ROWS);
                let strips = left.chunks_exact_mut(tall * depth);
                for (i, strip) in (top..bottom).step_by(tall).zip(strips) {
                    let rows = i / T::REALS..bottom.min(i + tall) / T::REALS;
                    lay_left(strip, tall, self.0.left, rows, inner.clone());
                }
                self.tiles::<S, N>(simd, top..bottom, &left, &right, depth);
            }
        }
    }

    /// The tiles in these rows, from what has been laid out.
    #[inline(always)]
    fn tiles<S: Simd, const N: usize>(
        &mut self,
        simd: S,
        rows: Range<usize>,
        left: &[f64],
        right: &[f64],
        depth: usize,
    ) {
        let (n, tall) = (self.0.size[1], TALL * S::F64_LANES);
        let (step, lower) = (self.0.target.column * T::REALS, self.0.target.lower);
        let target: &mut [f64] = cast_slice_mut(self.0.target.values);
        for (j, right) in (0..n).step_by(N).zip(right.chunks_exact(N * depth)) {
            let lefts = left.chunks_exact(tall * depth);
            for (i, left) in rows.clone().step_by(tall).zip(lefts) {
                let height = tall.min(rows.end - i);
                if lower && i + height <= j * T::REALS {
                    continue;
                }
                let tile = tile::<S, N>(simd, left, right);
                let target = &mut target[i + j * step..];
                let columns = target.chunks_mut(step).take(n - j);
                for (column, tile) in columns.zip(&tile) {
                    add_column(simd, &mut column[..height], tile);
                }
            }
        }
    }
}

/// Lays out rows of the left operand, padded to `tall` reals, one inner index after the other.
///
/// a · b is (re a, im a) · re b + (−im a, re a) · im b: a complex number counts as two of them.
#[inline(always)]
fn lay_left<T: Scalar>(
    strip: &mut [f64],
    tall: usize,
    view: View<'_, T>,
    rows: Range<usize>,
    inner: Range<usize>,
) {
    let height = rows.len() * T::REALS;
    for (parts, inner) in strip.chunks_exact_mut(tall * T::REALS).zip(inner) {
        let column = &view.values[rows.start * view.strides[0] + inner * view.strides[1]..];
        let (first, second) = parts.split_at_mut(tall);
        let (own, padding) = first.split_at_mut(height);
        let own: &mut [T] = cast_slice_mut(own);
        if view.strides[0] == 1 {
            own.copy_from_slice(&column[..own.len()]);
        } else {
            for (i, value) in own.iter_mut().enumerate() {
                *value = column[i * view.strides[0]];
            }
        }
        padding.fill(0.0);
        if T::REALS == 2 {
            let (turned, padding) = second.split_at_mut(height);
            for (value, own) in cast_slice_mut::<f64, T>(turned).iter_mut().zip(own) {
                *value = own.turned();
            }
            padding.fill(0.0);
        }
    }
}

/// Lays out `scale` times columns of the right operand, padded to `N`, in the same order.
#[inline(always)]
fn lay_right<T: Scalar, const N: usize>(
    strip: &mut [f64],
    view: View<'_, T>,
    inner: Range<usize>,
    columns: Range<usize>,
    scale: f64,
) {
    for (parts, inner) in strip.chunks_exact_mut(N * T::REALS).zip(inner) {
        let row = &view.values[inner * view.strides[0] + columns.start * view.strides[1]..];
        for (part, values) in parts.chunks_exact_mut(N).enumerate() {
            let (own, padding) = values.split_at_mut(columns.len());
            let reals: &[f64] = cast_slice(row);
            for (j, value) in own.iter_mut().enumerate() {
                *value = scale * reals[j * view.strides[1] * T::REALS + part];
            }
            padding.fill(0.0);
        }
    }
}

/// The product of two operands that are laid out, `TALL` vectors by `N` columns.
#[inline(always)]
fn tile<S: Simd, const N: usize>(simd: S, left: &[f64], right: &[f64]) -> [[S::f64s; TALL]; N] {
    let mut sums = [[simd.splat_f64s(0.0); TALL]; N];
    let (left, _) = S::as_simd_f64s(left).0.as_chunks::<TALL>();
    for (left, right) in left.iter().zip(right.as_chunks::<N>().0) {
        for (sums, &right) in sums.iter_mut().zip(right) {
            let right = simd.splat_f64s(right);
            for (sum, &left) in sums.iter_mut().zip(left) {
                *sum = simd.mul_add_e_f64s(left, right, *sum);
            }
        }
    }
    sums
}

#[inline(always)]
fn add_column<S: Simd>(simd: S, column: &mut [f64], sums: &[S::f64s; TALL]) {
    let (whole, rest) = S::as_mut_simd_f64s(column);
    for (value, &sum) in whole.iter_mut().zip(sums) {
        *value = simd.add_f64s(*value, sum);
    }
    if !rest.is_empty() {
        let sum = simd.add_f64s(simd.partial_load_f64s(rest), sums[whole.len()]);
        simd.partial_store_f64s(rest, sum);
    }
}
