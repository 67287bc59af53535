//! Jacobian rows: products of the fields of driven and measured pairs, cell by cell.

use std::ops::Range;

use pulp::{Simd, WithSimd};

use crate::instructions::narrow;
use crate::scalar::Scalar;
use crate::threads::{Shared, split};

/// Least and most cells of a block.
const CELLS: [usize; 2] = [64, 512];
/// Bytes of all pairs' fields that stay in the first cache while the rows are written: of what is
/// there at the same time, lines of the result that were fetched ahead take the rest.
const CACHES: [usize; 2] = [24 * 1024, 16 * 1024];
/// The lines of a larger result are fetched ahead: it lies in no cache of one core.
const LARGE: usize = 8 << 20;
/// Numbers in a line of the caches, at least; parts that begin with one are read faster.
const LINE: usize = 8;
/// Fewer cells than this are not worth a thread.
const GRAIN: usize = 4096;

/// Scaled gradients of the fields of 1 A into each electrode.
#[derive(Clone, Copy)]
pub struct Fields<'a, T> {
    /// The values, row-major.
    pub values: &'a [T],
    /// Electrodes, components, cells.
    pub shape: [usize; 3],
}

impl<'a, T> Fields<'a, T> {
    #[inline(always)]
    fn component(&self, electrode: usize, component: usize, cells: &Range<usize>) -> &'a [T] {
        let first = (electrode * self.shape[1] + component) * self.shape[2];
        &self.values[first + cells.start..first + cells.end]
    }
}

/// The rows of a pattern, by the pairs of electrodes that they use.
#[derive(Debug)]
pub struct Table {
    /// Distinct pairs: first minus second.
    pairs: Vec<[usize; 2]>,
    drives: Vec<Drive>,
    n_rows: usize,
}

#[derive(Debug)]
struct Drive {
    /// Number of its pair, sink minus source: ∂V = −∫ ∇u · ∇w.
    pair: usize,
    current: f64,
    /// Row and the number of its pair.
    rows: Vec<(usize, usize)>,
}

impl Table {
    /// Sorts the rows by drive.
    ///
    /// # Errors
    /// When a row names a drive that is not there.
    pub fn new(
        drives: &[[usize; 2]],
        current: impl Fn(usize) -> f64,
        drive_index: &[usize],
        measure: &[[usize; 2]],
    ) -> Result<Self, String> {
        let driven = drives.iter().map(|&[source, sink]| [sink, source]);
        let mut pairs: Vec<[usize; 2]> = driven.clone().chain(measure.iter().copied()).collect();
        pairs.sort_unstable();
        pairs.dedup();
        let number = |pair: &[usize; 2]| pairs.partition_point(|other| other < pair);
        let drive = |(at, pair)| Drive {
            pair: number(&pair),
            current: current(at),
            rows: Vec::new(),
        };
        let mut drives: Vec<Drive> = driven.enumerate().map(drive).collect();
        for (row, (&drive, pair)) in drive_index.iter().zip(measure).enumerate() {
            let drive = drives.get_mut(drive);
            let drive = drive.ok_or_else(|| format!("drive_index: row {row} names no drive"))?;
            drive.rows.push((row, number(pair)));
        }
        Ok(Self {
            pairs,
            drives,
            n_rows: measure.len(),
        })
    }

    /// Number of rows.
    #[must_use]
    pub fn n_rows(&self) -> usize {
        self.n_rows
    }

    /// Least number of electrodes that the fields must have.
    #[must_use]
    pub fn n_electrodes(&self) -> usize {
        let last = self.pairs.as_flattened().iter().max();
        last.map_or(0, |&last| last.saturating_add(1))
    }
}

/// Writes all rows of the table, row-major (rows, cells).
///
/// # Panics
/// When a size does not fit.
pub fn jacobian<T: Scalar>(fields: Fields<'_, T>, table: &Table, out: &mut [T], threads: usize) {
    assert!(out.len() == table.n_rows * fields.shape[2]);
    assert!(table.n_electrodes() <= fields.shape[0]);
    if fields.shape[1] == 0 {
        return out.fill(T::ZERO);
    }
    let far = size_of_val(out) > LARGE;
    let out = Shared::new(out);
    split(fields.shape[2], GRAIN, threads, |cells| {
        narrow(Blocks {
            fields,
            table,
            cells,
            out: &out,
            far,
        });
    });
}

struct Blocks<'a, T> {
    fields: Fields<'a, T>,
    table: &'a Table,
    cells: Range<usize>,
    out: &'a Shared<T>,
    far: bool,
}

impl<T: Scalar> WithSimd for Blocks<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let per_cell = self.fields.shape[1] * self.table.pairs.len();
        let room = CACHES[usize::from(self.far)] / size_of::<T>();
        let size = (room / per_cell.max(1)).clamp(CELLS[0], CELLS[1]) & !(LINE - 1);
        let n_driven = self.fields.shape[1] * size;
        let mut scratch = vec![T::ZERO; per_cell * size + n_driven + LINE];
        let begin = scratch
            .as_ptr()
            .align_offset(LINE * size_of::<T>())
            .min(LINE);
        let (pairs, rest) = scratch[begin..].split_at_mut(per_cell * size);
        let driven = &mut rest[..n_driven];
        for begin in self.cells.clone().step_by(size) {
            let cells = begin..self.cells.end.min(begin + size);
            self.pair_fields(&cells, size, pairs);
            for drive in &self.table.drives {
                let unit = &pairs[drive.pair * driven.len()..][..driven.len()];
                for (value, &unit) in driven.iter_mut().zip(unit) {
                    *value = unit * drive.current;
                }
                self.rows(simd, drive, &cells, pairs, driven);
            }
        }
    }
}

impl<T: Scalar> Blocks<'_, T> {
    /// Fills (pair, component, cell) with the fields of a block of cells.
    #[inline(always)]
    fn pair_fields(&self, cells: &Range<usize>, size: usize, out: &mut [T]) {
        let n_components = self.fields.shape[1];
        for (target, at) in out.chunks_exact_mut(size).zip(0..) {
            let [first, second] = self.table.pairs[at / n_components];
            let first = self.fields.component(first, at % n_components, cells);
            let second = self.fields.component(second, at % n_components, cells);
            for (value, (&a, &b)) in target.iter_mut().zip(first.iter().zip(second)) {
                *value = a - b;
            }
        }
    }

    /// Writes one drive's rows of a block, two at a time, which share what they read of the drive.
    #[inline(always)]
    fn rows<S: Simd>(
        &self,
        simd: S,
        drive: &Drive,
        cells: &Range<usize>,
        pairs: &[T],
        driven: &[T],
    ) {
        let size = driven.len() / self.fields.shape[1];
        let field = |pair: usize| &pairs[pair * driven.len()..][..driven.len()];
        let (twos, last) = drive.rows.as_chunks::<2>();
        for &[(row, pair), (next, other)] in twos {
            let targets = [self.target(row, cells), self.target(next, cells)];
            two_products(simd, targets, driven, [field(pair), field(other)], size);
        }
        for &(row, pair) in last {
            scalar_product(self.target(row, cells), driven, field(pair), size);
        }
    }

    /// A row's part of a block, to be written.
    #[inline(always)]
    #[allow(clippy::mut_from_ref)]
    fn target(&self, row: usize, cells: &Range<usize>) -> &mut [T] {
        let at = row * self.fields.shape[2];
        if self.far {
            let next = cells.end..self.cells.end.min(cells.end + cells.len());
            self.out.fetch(at + next.start..at + next.end);
        }
        // SAFETY: each thread has cells of its own, and a row is written once.
        unsafe { self.out.part(at + cells.start..at + cells.end) }
    }
}

/// Two products at once; see [`scalar_product`].
#[inline(always)]
fn two_products<S: Simd, T: Scalar>(
    simd: S,
    [first, second]: [&mut [T]; 2],
    a: &[T],
    [b, c]: [&[T]; 2],
    size: usize,
) {
    if a.len() != 2 * size {
        scalar_product(first, a, b, size);
        return scalar_product(second, a, c, size);
    }
    let ((x, y), (b0, b1), (c0, c1)) = (a.split_at(size), b.split_at(size), c.split_at(size));
    T::two_sums(simd, [first, second], [x, y], [b0, b1, c0, c1]);
}

/// Sum over the components of products, cell by cell; each component has `size` cells.
#[inline(always)]
fn scalar_product<T: Scalar>(target: &mut [T], a: &[T], b: &[T], size: usize) {
    let n = target.len();
    let (mut a, mut b) = (a.chunks_exact(2 * size), b.chunks_exact(2 * size));
    match (a.next(), b.next()) {
        (Some(a), Some(b)) => {
            let ((a0, a1), (b0, b1)) = (halves(a, n), halves(b, n));
            for i in 0..n {
                target[i] = a0[i] * b0[i] + a1[i] * b1[i];
            }
        }
        _ => target.fill(T::ZERO),
    }
    for (a, b) in a.by_ref().zip(b.by_ref()) {
        let ((a0, a1), (b0, b1)) = (halves(a, n), halves(b, n));
        for i in 0..n {
            target[i] += a0[i] * b0[i] + a1[i] * b1[i];
        }
    }
    for (value, (&a, &b)) in target
        .iter_mut()
        .zip(a.remainder().iter().zip(b.remainder()))
    {
        *value += a * b;
    }
}

/// The first `n` cells of two components.
#[inline(always)]
fn halves<T>(both: &[T], n: usize) -> (&[T], &[T]) {
    let (first, second) = both.split_at(both.len() / 2);
    (&first[..n], &second[..n])
}
