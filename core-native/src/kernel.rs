//! Dense work on one front: tiles that stay in registers for small ones, products for large ones.
//!
//! A front is what belongs to one panel while it is eliminated: its columns, and the square of the
//! rows below them. Rows and columns are padded with zeros to whole vectors, so that no loop has a
//! remainder; entries above the diagonal are of no use.

use std::array::from_fn;

use pulp::Simd;

use crate::dense::{Target, View, add_product};
use crate::scalar::Scalar;

/// Rows come in such numbers: whole vectors of every processor.
pub const ROWS: usize = 8;
/// Columns of a tile.
const WIDE: usize = 4;
/// Columns that are eliminated before the rest is updated as a whole.
const BLOCK: usize = 32;
/// From this many multiplications on, the product is the faster one.
const LARGE: usize = 64 * 1024;

/// Size of a front, and where its parts lie.
#[derive(Clone, Copy, Debug)]
pub struct Shape {
    /// Number of columns.
    pub width: usize,
    /// Number of rows below their diagonal block.
    pub below: usize,
}

impl Shape {
    /// Where the rows below begin in a column.
    #[inline(always)]
    pub fn top(self) -> usize {
        self.width.next_multiple_of(ROWS)
    }

    /// From column to column of the square.
    #[inline(always)]
    pub fn side(self) -> usize {
        self.below.next_multiple_of(ROWS)
    }

    /// From column to column.
    #[inline(always)]
    pub fn stride(self) -> usize {
        self.top() + self.side()
    }

    /// Number of values in the columns.
    #[inline(always)]
    pub fn columns_len(self) -> usize {
        self.stride() * self.width.next_multiple_of(WIDE)
    }

    /// Number of values in the square.
    #[inline(always)]
    pub fn square_len(self) -> usize {
        self.side() * self.below.next_multiple_of(WIDE)
    }
}

/// Cholesky factor, without conjugation, of the first rows of a front's columns, and the rows below
/// solved for it; the diagonal gets the inverse of its entries.
///
/// Gives the column whose pivot is not positive as an error.
#[inline(always)]
pub fn eliminate<S: Simd, T: Scalar>(
    simd: S,
    columns: &mut [T],
    shape: Shape,
) -> Result<(), usize> {
    let (width, stride) = (shape.width, shape.stride());
    for first in (0..width).step_by(BLOCK) {
        let end = width.min(first + BLOCK);
        for j in (first..end).step_by(WIDE) {
            let (done, rest) = columns.split_at_mut(j * stride);
            if j > first {
                let begin = j - j % ROWS;
                let source = Source {
                    rows: &done[first * stride + begin..],
                    factors: &done[first * stride + j..],
                    stride,
                    depth: j - first,
                };
                let less = |value: &mut _, sum| *value = T::less(simd, *value, sum);
                let size = [stride, stride - begin];
                tiles::<S, T>(simd, &mut rest[begin..], size, source, less);
            }
            eliminate_four(simd, rest, stride, j, WIDE.min(end - j))?;
        }
        if end < width {
            let (done, rest) = columns.split_at_mut(end * stride);
            let height = shape.top() + shape.below - end;
            let target = Target::lower(&mut rest[end..], stride);
            let rows = &done[first * stride + end..];
            subtract_lower(target, rows, stride, [height, width - end, end - first]);
        }
    }
    Ok(())
}

/// Writes the lower triangle of −L Lᵀ, L the rows below in the columns, to the square.
#[inline(always)]
pub fn write_square<S: Simd, T: Scalar>(simd: S, square: &mut [T], columns: &[T], shape: Shape) {
    let (below, side, stride) = (shape.below, shape.side(), shape.stride());
    let rows = &columns[shape.top()..];
    if below * below * shape.width >= LARGE {
        square.fill(T::ZERO);
        let target = Target::lower(square, side);
        subtract_lower(target, rows, stride, [below, below, shape.width]);
        return;
    }
    for j in (0..below).step_by(WIDE) {
        let begin = j - j % ROWS;
        let source = Source {
            rows: &rows[begin..],
            factors: &rows[j..],
            stride,
            depth: shape.width,
        };
        let target = &mut square[j * side + begin..];
        let written = |value: &mut _, sum| *value = T::less(simd, T::zeros(simd), sum);
        tiles::<S, T>(simd, target, [side, side - begin], source, written);
    }
}

/// Columns of which multiples are subtracted from others.
#[derive(Clone, Copy)]
struct Source<'a, T> {
    /// From the first row on that is subtracted.
    rows: &'a [T],
    /// From the row on in which the factors stand.
    factors: &'a [T],
    stride: usize,
    /// Number of columns.
    depth: usize,
}

impl<T> Source<'_, T> {
    /// The same from a later row on.
    #[inline(always)]
    fn from(self, row: usize) -> Self {
        let rows = &self.rows[row..];
        Self { rows, ..self }
    }
}

/// Gives `put` the values of four columns, `size[1]` rows of them and `size[0]` from column to column,
/// and the columns of the source times its factors.
#[inline(always)]
fn tiles<S: Simd, T: Scalar>(
    simd: S,
    target: &mut [T],
    size: [usize; 2],
    source: Source<'_, T>,
    put: impl Fn(&mut T::Vector<S>, T::Vector<S>),
) {
    let lanes = size_of::<T::Vector<S>>() / size_of::<T>();
    let ([column, height], mut row) = (size, 0);
    while row + 2 * lanes <= height {
        put_tile::<S, T, 2>(simd, &mut target[row..], column, source.from(row), &put);
        row += 2 * lanes;
    }
    if row < height {
        put_tile::<S, T, 1>(simd, &mut target[row..], column, source.from(row), &put);
    }
}

#[inline(always)]
fn put_tile<S: Simd, T: Scalar, const TALL: usize>(
    simd: S,
    target: &mut [T],
    column: usize,
    source: Source<'_, T>,
    put: &impl Fn(&mut T::Vector<S>, T::Vector<S>),
) {
    let Source {
        rows,
        factors,
        stride,
        depth,
    } = source;
    let sums = tile::<S, T, TALL, WIDE>(simd, rows, factors, stride, depth);
    for (c, sums) in sums.into_iter().enumerate() {
        let values = &mut T::vectors_mut::<S>(&mut target[c * column..])[..TALL];
        for (value, sum) in values.iter_mut().zip(sums) {
            put(value, sum);
        }
    }
}

/// Σ over `depth` columns, each `stride` after the last: its first `TALL` vectors in `rows` times
/// its first `N` numbers in `factors`.
#[inline(always)]
pub fn tile<S: Simd, T: Scalar, const TALL: usize, const N: usize>(
    simd: S,
    rows: &[T],
    factors: &[T],
    stride: usize,
    depth: usize,
) -> [[T::Vector<S>; TALL]; N] {
    let mut sums = [[T::zeros(simd); TALL]; N];
    let Some(last) = depth.checked_sub(1).map(|last| last * stride) else {
        return sums;
    };
    let tall = TALL * size_of::<T::Vector<S>>() / size_of::<T>();
    assert!(rows.len() >= last + tall && factors.len() >= last + N);
    for k in 0..depth {
        // SAFETY: both are within what has been asserted, for the last column and so for all.
        let (rows, factors) = unsafe {
            let rows = rows.as_ptr().add(k * stride);
            let factors = factors.as_ptr().add(k * stride);
            (
                rows.cast::<[T::Vector<S>; TALL]>().read_unaligned(),
                factors.cast::<[T; N]>().read_unaligned(),
            )
        };
        for (sums, factor) in sums.iter_mut().zip(factors) {
            let factor = T::factor(simd, factor);
            for (sum, row) in sums.iter_mut().zip(rows) {
                *sum = T::plus_product(simd, row, factor, *sum);
            }
        }
    }
    sums
}

/// Eliminates columns `j` to `j` + 4, of which `count` are real; `columns` begins with the first.
#[inline(always)]
fn eliminate_four<S: Simd, T: Scalar>(
    simd: S,
    columns: &mut [T],
    stride: usize,
    j: usize,
    count: usize,
) -> Result<(), usize> {
    let block: [&[T]; WIDE] = from_fn(|k| &columns[k * stride + j..][..WIDE]);
    let mut factor: [[T; WIDE]; WIDE] = block.map(|column| from_fn(|i| column[i]));
    let (mut inverse, mut scale) = ([T::ZERO; WIDE], [T::ZERO; WIDE]);
    let mut by = [[T::ZERO; WIDE]; WIDE];
    // no root is waited for: columns are scaled by it when all else is done
    for k in 0..WIDE {
        for d in 0..k {
            let done = factor[d];
            by[d][k] = -(done[k] * inverse[d]);
            for i in k..WIDE {
                factor[k][i] += done[i] * by[d][k];
            }
        }
        if k < count {
            inverse[k] = T::ONE / factor[k][k];
            scale[k] = inverse[k].pivot().ok_or(j + k)?;
        }
    }
    let begin = j - j % ROWS;
    let (first, rest) = columns.split_at_mut(stride);
    let (second, rest) = rest.split_at_mut(stride);
    let (third, rest) = rest.split_at_mut(stride);
    let fourth = &mut rest[..stride];
    let scales = scale.map(|value| T::factor(simd, value));
    let by = by.map(|column| column.map(|value| T::factor(simd, value)));
    let first = T::vectors_mut::<S>(&mut first[begin..]);
    let second = T::vectors_mut::<S>(&mut second[begin..]);
    let third = T::vectors_mut::<S>(&mut third[begin..]);
    let fourth = T::vectors_mut::<S>(&mut fourth[begin..]);
    for (((a, b), c), d) in first.iter_mut().zip(second).zip(third).zip(fourth) {
        *b = T::plus_product(simd, *a, by[0][1], *b);
        *c = T::plus_product(simd, *a, by[0][2], *c);
        *d = T::plus_product(simd, *a, by[0][3], *d);
        *c = T::plus_product(simd, *b, by[1][2], *c);
        *d = T::plus_product(simd, *b, by[1][3], *d);
        *d = T::plus_product(simd, *c, by[2][3], *d);
        *a = T::times(simd, *a, scales[0]);
        *b = T::times(simd, *b, scales[1]);
        *c = T::times(simd, *c, scales[2]);
        *d = T::times(simd, *d, scales[3]);
    }
    for k in 0..count {
        columns[k * stride + j + k] = scale[k];
    }
    Ok(())
}

/// Subtracts L (first rows of L)ᵀ below the diagonal; `size`: rows, columns, columns of L.
fn subtract_lower<T: Scalar>(target: Target<'_, T>, rows: &[T], stride: usize, size: [usize; 3]) {
    let rows = View {
        values: rows,
        strides: [1, stride],
    };
    add_product(target, -1.0, rows, rows.transposed(), size);
}
