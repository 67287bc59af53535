//! Dense systems of linear equations.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::dense::{Matrix, Target, View, add_product};
use crate::instructions::narrow;
use crate::scalar::Scalar;

/// Columns that are eliminated before a product updates the rest.
const BLOCK: usize = 12;
/// Up to this size the short loops are faster than products.
const SMALL: usize = 48;

/// Gaussian elimination with row exchanges: replaces B by A⁻¹ B, given Aᵀ; NaN where A is singular.
pub fn solve<T: Scalar>(transposed: &Matrix<T>, rhs: &mut Matrix<T>) {
    let (m, width) = (rhs.height, rhs.width());
    let row = m + width;
    let mut joined = Vec::with_capacity(m * row);
    for i in 0..m {
        joined.extend_from_slice(&transposed.values[i * m..(i + 1) * m]);
        joined.extend((0..width).map(|j| rhs[(i, j)]));
    }
    let block = if m <= SMALL { m } else { BLOCK };
    let blocks = (0..m).step_by(block.max(1)).map(|k| k..m.min(k + block));
    for columns in blocks.clone() {
        narrow(Eliminate {
            joined: &mut joined,
            row,
            columns: columns.clone(),
        });
        subtract(
            &mut joined,
            row,
            columns.clone(),
            columns.end..m,
            columns.end,
        );
    }
    for columns in blocks.rev() {
        narrow(Substitute {
            joined: &mut joined,
            row,
            columns: columns.clone(),
        });
        subtract(&mut joined, row, columns.clone(), 0..columns.start, m);
    }
    for (i, joined) in joined.chunks_exact(row).enumerate() {
        for (j, &value) in joined[m..].iter().enumerate() {
            rhs[(i, j)] = value;
        }
    }
}

/// Subtracts from rows above or below a block, from column `from` on, what they have in the columns
/// of the block times its rows.
fn subtract<T: Scalar>(
    joined: &mut [T],
    row: usize,
    block: Range<usize>,
    rows: Range<usize>,
    from: usize,
) {
    if rows.is_empty() {
        return;
    }
    let mut factors = Vec::with_capacity(rows.len() * block.len());
    for other in joined[rows.start * row..rows.end * row].chunks_exact(row) {
        factors.extend_from_slice(&other[block.clone()]);
    }
    let (above, below) = joined.split_at_mut(rows.start.max(block.start) * row);
    let (block_rows, others) = if rows.start < block.start {
        (&below[from..], &mut above[rows.start * row..])
    } else {
        (&above[block.start * row + from..], below)
    };
    // by columns, these rows are their transposes
    let target = Target::full(&mut others[from..], row);
    let left = View {
        values: block_rows,
        strides: [1, row],
    };
    let right = View {
        values: &factors,
        strides: [1, block.len()],
    };
    add_product(
        target,
        -1.0,
        left,
        right,
        [row - from, rows.len(), block.len()],
    );
}

/// Eliminates some columns: of their own rows all is done, of those below these columns only.
///
/// An entry below the diagonal is replaced by what its row lost of the pivot's.
struct Eliminate<'a, T> {
    /// The system and its right-hand sides, by rows.
    joined: &'a mut [T],
    row: usize,
    columns: Range<usize>,
}

impl<T: Scalar> WithSimd for Eliminate<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (joined, row, columns) = (self.joined, self.row, self.columns);
        let m = joined.len() / row;
        let end = if columns.end == m { row } else { columns.end };
        for k in columns.clone() {
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
                other[k] = factor;
                reduce(&mut other[k + 1..end], factor, &top[k + 1..end]);
            }
        }
        if end == row {
            return;
        }
        for i in columns.clone() {
            let (above, own) = joined.split_at_mut(i * row);
            let (factors, own) = own[columns.start..row].split_at_mut(end - columns.start);
            for (k, &factor) in (columns.start..i).zip(factors.iter()) {
                reduce(own, factor, &above[k * row + end..][..row - end]);
            }
        }
    }
}

/// Solves a block of the upper triangle that is left.
struct Substitute<'a, T> {
    /// The system and its right-hand sides, by rows.
    joined: &'a mut [T],
    row: usize,
    columns: Range<usize>,
}

impl<T: Scalar> WithSimd for Substitute<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (joined, row) = (self.joined, self.row);
        let m = joined.len() / row;
        for k in self.columns.clone().rev() {
            let (above, below) = joined.split_at_mut(k * row);
            let inverse = T::ONE / below[k];
            let known = &mut below[m..row];
            for value in known.iter_mut() {
                *value *= inverse;
            }
            for other in above[self.columns.start * row..].chunks_exact_mut(row) {
                let factor = other[k];
                reduce(&mut other[m..], factor, known);
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
