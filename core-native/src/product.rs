//! A sparse matrix times several vectors, each result in its own row.

use std::ops::Range;

use ndarray::ArrayView2;
use pulp::{Simd, WithSimd};

use crate::instructions::narrow;
use crate::lanes::{ABREAST, Lanes};
use crate::scalar::Scalar;
use crate::threads::{Shared, split};

/// Results that are gathered before they are written out.
const TILE: usize = 64;
/// Fewer rows than this are not worth a thread.
const GRAIN: usize = 16 * 1024;

/// A matrix by rows.
#[derive(Clone, Copy)]
pub struct Rows<'a> {
    starts: &'a [i32],
    columns: &'a [i32],
    values: &'a [f64],
    n_columns: usize,
}

impl<'a> Rows<'a> {
    /// Checks the three arrays of a compressed-row matrix.
    ///
    /// # Errors
    /// When they are none.
    pub fn new(starts: &'a [i32], columns: &'a [i32], values: &'a [f64]) -> Result<Self, String> {
        // without early ends: these loops run for every product, and several entries at a time
        let ascending = starts
            .windows(2)
            .fold(true, |so_far, ends| so_far & (ends[0] <= ends[1]));
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
        let last = columns
            .iter()
            .fold(0, |last, &column| last.max(column as u32));
        if last > i32::MAX as u32 {
            return Err("indices: a negative entry".into());
        }
        let n_columns = if columns.is_empty() {
            0
        } else {
            last as usize + 1
        };
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
    pub fn row(&self, row: usize) -> impl Iterator<Item = (usize, f64)> {
        let entries = self.starts[row] as usize..self.starts[row + 1] as usize;
        let columns = self.columns[entries.clone()].iter();
        let pairs = columns.zip(&self.values[entries]);
        pairs.map(|(&column, &value)| (column as usize, value))
    }
}

/// Up to sixteen columns from `first` on of a matrix, side by side, zero beyond its last.
#[inline(always)]
fn abreast<T: Scalar>(vectors: ArrayView2<'_, T>, first: usize) -> Vec<Lanes<T>> {
    let (n, k) = vectors.dim();
    let count = ABREAST.min(k - first);
    let within = |i, value| if i < count { value } else { T::ZERO };
    let one = |row| {
        let entry = |i| {
            if i < count {
                vectors[[row, first + i]]
            } else {
                T::ZERO
            }
        };
        Lanes(std::array::from_fn(entry))
    };
    let Some(values) = vectors.as_slice() else {
        return (0..n).map(one).collect();
    };
    // reads sixteen wherever that many follow, whosever they are, since a constant length is quick
    let row = |row| match values[row * k + first..].first_chunk::<ABREAST>() {
        Some(all) => Lanes(std::array::from_fn(|i| within(i, all[i]))),
        None => one(row),
    };
    (0..n).map(row).collect()
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
            narrow(rows);
        });
    }
}

struct Tiles<'a, T> {
    matrix: Rows<'a>,
    abreast: &'a [Lanes<T>],
    rows: Range<usize>,
    vectors: Range<usize>,
    out: &'a Shared<T>,
}

impl<T: Scalar> WithSimd for Tiles<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let n = self.matrix.n_rows();
        let mut tile = [Lanes::ZERO; TILE];
        for begin in self.rows.clone().step_by(TILE) {
            let end = self.rows.end.min(begin + TILE);
            for (sum, row) in tile.iter_mut().zip(begin..end) {
                *sum = row_product(self.matrix, row, self.abreast);
            }
            for (lane, vector) in self.vectors.clone().enumerate() {
                // SAFETY: each thread has rows of its own.
                let target = unsafe { self.out.part(vector * n + begin..vector * n + end) };
                for (value, sum) in target.iter_mut().zip(&tile) {
                    *value = sum.0[lane];
                }
            }
        }
    }
}

#[inline(always)]
fn row_product<T: Scalar>(matrix: Rows<'_>, row: usize, vectors: &[Lanes<T>]) -> Lanes<T> {
    let mut sum = Lanes::ZERO;
    for (column, value) in matrix.row(row) {
        for (s, &v) in sum.0.iter_mut().zip(&vectors[column].0) {
            *s += v * value;
        }
    }
    sum
}
