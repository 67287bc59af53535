//! A sparse matrix times several vectors, each result in its own row.

use std::ops::Range;

use numpy::ndarray::ArrayView2;
use pulp::{Arch, Simd, WithSimd};

use crate::scalar::Scalar;
use crate::threads::{Shared, split};

/// Vectors that one pass over the matrix serves.
pub const ABREAST: usize = 16;
/// Results that are gathered before they are written out.
const TILE: usize = 64;
/// Fewer rows than this are not worth a thread.
const GRAIN: usize = 16 * 1024;

/// A matrix by rows.
#[derive(Clone, Copy)]
pub struct Rows<'a, V = f64> {
    starts: &'a [i32],
    columns: &'a [i32],
    values: &'a [V],
    n_columns: usize,
}

impl<'a, V: Copy> Rows<'a, V> {
    /// Checks the three arrays of a compressed-row matrix.
    ///
    /// # Errors
    /// When they are none.
    pub fn new(starts: &'a [i32], columns: &'a [i32], values: &'a [V]) -> Result<Self, String> {
        let ascending = starts.windows(2).all(|ends| ends[0] <= ends[1]);
        let (Some(&0), Some(&end), true) = (starts.first(), starts.last(), ascending) else {
            return Err("indptr: expected ascending entries from 0".into());
        };
        if end as usize != columns.len() || columns.len() != values.len() {
            return Err(format!(
                "expected {end} indices and data, got {} and {}",
                columns.len(),
                values.len()
            ));
        }
        if columns.iter().any(|&column| column < 0) {
            return Err("indices: a negative entry".into());
        }
        let n_columns = columns.iter().max().map_or(0, |&last| last as usize + 1);
        Ok(Self {
            starts,
            columns,
            values,
            n_columns,
        })
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.starts.len() - 1
    }

    /// Least number of columns.
    #[must_use]
    pub fn n_columns(&self) -> usize {
        self.n_columns
    }

    /// Columns and values of one row.
    #[inline(always)]
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, V)> {
        let entries = self.starts[row] as usize..self.starts[row + 1] as usize;
        let columns = self.columns[entries.clone()].iter();
        let pairs = columns.zip(&self.values[entries]);
        pairs.map(|(&column, &value)| (column as usize, value))
    }
}

/// Up to sixteen columns from `first` on of a matrix, side by side, zero beyond its last.
pub fn abreast<T: Scalar>(vectors: ArrayView2<'_, T>, first: usize) -> Vec<[T; ABREAST]> {
    let count = ABREAST.min(vectors.ncols() - first);
    if let Some(values) = vectors.as_slice() {
        let rows = values.chunks_exact(vectors.ncols());
        let padded = rows.map(|row| {
            let mut padded = [T::ZERO; ABREAST];
            padded[..count].copy_from_slice(&row[first..first + count]);
            padded
        });
        return padded.collect();
    }
    let lane = |row, i| {
        if i < count {
            vectors[[row, first + i]]
        } else {
            T::ZERO
        }
    };
    (0..vectors.nrows())
        .map(|row| std::array::from_fn(|i| lane(row, i)))
        .collect()
}

/// Writes (A V)ᵀ, row-major (k, rows of A), for V of any layout, (columns of A, k).
///
/// # Panics
/// When a size does not fit.
pub fn transposed_product<T: Scalar>(
    matrix: Rows<'_>,
    vectors: ArrayView2<'_, T>,
    out: &mut [T],
    threads: usize,
) {
    let n = matrix.n_rows();
    let k = vectors.ncols();
    assert!(out.len() == n * k && vectors.nrows() >= matrix.n_columns());
    let out = Shared::new(out);
    for first in (0..k).step_by(ABREAST) {
        let count = ABREAST.min(k - first);
        let abreast = abreast(vectors, first);
        split(n, GRAIN, threads, |rows| {
            let rows = Tiles {
                matrix,
                abreast: &abreast,
                rows,
                out: &out,
                vectors: first..first + count,
            };
            Arch::new().dispatch(rows);
        });
    }
}

struct Tiles<'a, T> {
    matrix: Rows<'a>,
    abreast: &'a [[T; ABREAST]],
    rows: Range<usize>,
    vectors: Range<usize>,
    out: &'a Shared<T>,
}

impl<T: Scalar> WithSimd for Tiles<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let n = self.matrix.n_rows();
        let mut tile = [[T::ZERO; ABREAST]; TILE];
        for begin in self.rows.clone().step_by(TILE) {
            let end = self.rows.end.min(begin + TILE);
            for (sum, row) in tile.iter_mut().zip(begin..end) {
                *sum = row_product(self.matrix, row, self.abreast);
            }
            for (lane, vector) in self.vectors.clone().enumerate() {
                // SAFETY: each thread has rows of its own.
                let target = unsafe { self.out.part(vector * n + begin..vector * n + end) };
                for (value, sum) in target.iter_mut().zip(&tile) {
                    *value = sum[lane];
                }
            }
        }
    }
}

#[inline(always)]
fn row_product<T: Scalar>(matrix: Rows<'_>, row: usize, vectors: &[[T; ABREAST]]) -> [T; ABREAST] {
    let mut sum = [T::ZERO; ABREAST];
    for (column, value) in matrix.row(row) {
        for (s, &v) in sum.iter_mut().zip(&vectors[column]) {
            *s += v * value;
        }
    }
    sum
}
