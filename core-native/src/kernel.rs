//! Dense work on one panel: small sizes by short loops, large ones by products.

use crate::dense::{Target, View, add_product};
use crate::scalar::Scalar;

/// Columns that are eliminated by short loops before the rest is updated as a whole.
const BLOCK: usize = 32;
/// From this many multiplications on, the product is the faster one.
const LARGE: usize = 16 * 1024;

/// Cholesky factor, without conjugation, of a panel's first rows, and the rows below solved for it.
///
/// Gives the column whose pivot is not positive as an error.
#[inline(always)]
pub fn eliminate<T: Scalar>(panel: &mut [T], height: usize, width: usize) -> Result<(), usize> {
    for first in (0..width).step_by(BLOCK) {
        let end = width.min(first + BLOCK);
        eliminate_block(panel, height, first, end)?;
        if end < width {
            let (done, rest) = panel.split_at_mut(end * height);
            let size = [height - end, width - end, end - first];
            let target = Target::lower(&mut rest[end..], height);
            subtract_lower(target, &done[first * height + end..], height, size);
        }
    }
    Ok(())
}

#[inline(always)]
fn eliminate_block<T: Scalar>(
    panel: &mut [T],
    height: usize,
    first: usize,
    end: usize,
) -> Result<(), usize> {
    for j in first..end {
        let (done, rest) = panel[first * height..].split_at_mut((j - first) * height);
        let column = &mut rest[j..height];
        subtract_columns(column, done, height, j, j);
        let pivot = column[0].pivot().ok_or(j)?;
        column[0] = pivot;
        let inverse = T::ONE / pivot;
        for value in &mut column[1..] {
            *value *= inverse;
        }
    }
    Ok(())
}

/// Subtracts the lower triangle of L Lᵀ, L the panel's rows below, from the square `update`.
#[inline(always)]
pub fn subtract_square<T: Scalar>(update: &mut [T], panel: &[T], height: usize, width: usize) {
    let size = height - width;
    if size * size * width < LARGE {
        for j in 0..size {
            let column = &mut update[j * size + j..(j + 1) * size];
            subtract_columns(column, panel, height, width + j, width + j);
        }
        return;
    }
    let target = Target::lower(update, size);
    subtract_lower(target, &panel[width..], height, [size, size, width]);
}

/// Subtracts, from a target that begins at row `from`, the columns times their entries in `row`.
#[inline(always)]
fn subtract_columns<T: Scalar>(
    target: &mut [T],
    source: &[T],
    height: usize,
    from: usize,
    row: usize,
) {
    let mut fours = source.chunks_exact(4 * height);
    for four in fours.by_ref() {
        subtract_some::<4, T>(target, four, height, from, row);
    }
    for one in fours.remainder().chunks_exact(height) {
        subtract_some::<1, T>(target, one, height, from, row);
    }
}

#[inline(always)]
fn subtract_some<const K: usize, T: Scalar>(
    target: &mut [T],
    source: &[T],
    height: usize,
    from: usize,
    row: usize,
) {
    let n = target.len();
    let factors: [T; K] = std::array::from_fn(|k| source[k * height + row]);
    let rows: [&[T]; K] = std::array::from_fn(|k| &source[k * height + from..][..n]);
    for i in 0..n {
        let mut value = target[i];
        for k in 0..K {
            value -= rows[k][i] * factors[k];
        }
        target[i] = value;
    }
}

/// Subtracts L (first rows of L)ᵀ below the diagonal; `size`: rows, columns, columns of L.
fn subtract_lower<T: Scalar>(target: Target<'_, T>, rows: &[T], height: usize, size: [usize; 3]) {
    let rows = View {
        values: rows,
        strides: [1, height],
    };
    add_product(target, -1.0, rows, rows.transposed(), size);
}
