//! Forward and back substitution, several right-hand sides abreast.
//!
//! A row of the unknown holds sixteen right-hand sides side by side, so that one pass over the factor
//! serves them all. Panels whose part of the right-hand side is still zero are left out: a current
//! into one electrode reaches only the columns on its path to the root of the elimination tree.

use std::array::from_fn;

use pulp::{Simd, WithSimd};

use crate::factor::Factor;
use crate::instructions::run;
use crate::lanes::{ABREAST, GROUP, Lanes};
use crate::residual::Columns;
use crate::scalar::Scalar;
use crate::symbolic::Panel;

/// Writes columns of A⁻¹, those of these rows of A, row-major (n, k).
///
/// # Panics
/// When a row does not exist, or the size is another.
pub fn columns<T: Scalar>(factor: &Factor<T>, rows: &[u32], out: &mut [T]) {
    assert!(out.len() == factor.symbolic().size() * rows.len());
    blocks(factor, rows, out, drop);
}

/// The same, with a check: `values` are the matrix's, and the rest is as [`Columns::residual`] says.
///
/// # Panics
/// When a row does not exist, or a size is another.
pub fn checked_columns<T: Scalar>(
    factor: &Factor<T>,
    values: &[T],
    rows: &[u32],
    out: &mut [T],
    lost: &mut [T],
) -> f64 {
    assert!(out.len() == factor.symbolic().size() * rows.len());
    assert!(lost.len() == rows.len() * rows.len() && values.len() == factor.symbolic().n_values());
    let symbolic = factor.symbolic();
    let mut x = Vec::with_capacity(rows.len().div_ceil(ABREAST));
    blocks(factor, rows, out, |block| x.push(block));
    let units: Vec<u32> = rows
        .iter()
        .map(|&row| symbolic.place()[row as usize])
        .collect();
    let columns = Columns {
        symbolic,
        values,
        units: &units,
        x: &x,
    };
    columns.residual(factor.arch(), lost)
}

/// Solves for sixteen columns at a time, which `keep` gets in the factor's order of rows.
fn blocks<T: Scalar>(
    factor: &Factor<T>,
    rows: &[u32],
    out: &mut [T],
    mut keep: impl FnMut(Vec<Lanes<T>>),
) {
    for (number, part) in rows.chunks(ABREAST).enumerate() {
        keep(run(
            factor.arch(),
            Substitution {
                factor,
                rows: part,
                out: &mut out[number * ABREAST..],
                columns: rows.len(),
            },
        ));
    }
}

struct Substitution<'a, T> {
    factor: &'a Factor<T>,
    rows: &'a [u32],
    /// From the first column on.
    out: &'a mut [T],
    /// Numbers from row to row.
    columns: usize,
}

impl<T: Scalar> WithSimd for Substitution<'_, T> {
    type Output = Vec<Lanes<T>>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let symbolic = self.factor.symbolic();
        let mut x = vec![Lanes::ZERO; symbolic.size()];
        for (column, &row) in self.rows.iter().enumerate() {
            x[symbolic.place()[row as usize] as usize].0[column] = T::ONE;
        }
        substitute(simd, self.factor, self.rows.len(), &mut x);
        let count = self.rows.len();
        for (row, &place) in symbolic.place().iter().enumerate() {
            let from = &x[place as usize].0;
            let target = &mut self.out[row * self.columns..][..count];
            // parts of constant length and a few more, since a copy of any length is a call
            let (most, few) = target.as_chunks_mut::<4>();
            for (target, part) in most.iter_mut().zip(from.as_chunks::<4>().0) {
                *target = *part;
            }
            for (value, &last) in few.iter_mut().zip(&from[count - count % 4..]) {
                *value = last;
            }
        }
        x
    }
}

/// Forward and back substitution, in place, of the first `count` of the right-hand sides.
#[inline(always)]
fn substitute<S: Simd, T: Scalar>(simd: S, factor: &Factor<T>, count: usize, x: &mut [Lanes<T>]) {
    let (symbolic, values) = (factor.symbolic(), factor.values());
    for number in 0..symbolic.n_panels() {
        let panel = symbolic.panel(number);
        let (done, below) = x.split_at_mut(panel.start + panel.width);
        let top = &mut done[panel.start..];
        if top.iter().all(Lanes::is_zero) {
            continue;
        }
        let part = Part {
            simd,
            panel,
            values: &values[panel.values()],
            count,
        };
        for at in part.groups() {
            part.forward(at, top, below);
        }
    }
    for number in (0..symbolic.n_panels()).rev() {
        let panel = symbolic.panel(number);
        let (done, below) = x.split_at_mut(panel.start + panel.width);
        let top = &mut done[panel.start..];
        let part = Part {
            simd,
            panel,
            values: &values[panel.values()],
            count,
        };
        for at in part.groups() {
            part.backward(at, top, below);
        }
    }
}

/// One panel's part in a substitution, a group of vectors of each row of the unknown at a time.
struct Part<'a, S, T> {
    simd: S,
    panel: Panel<'a>,
    /// The panel's values.
    values: &'a [T],
    /// Number of right-hand sides.
    count: usize,
}

impl<'a, S: Simd, T: Scalar> Part<'a, S, T> {
    /// Where each group of vectors begins in a row.
    #[inline(always)]
    fn groups(&self) -> impl Iterator<Item = usize> + use<S, T> {
        (0..self.count).step_by(GROUP * size_of::<T::Vector<S>>() / size_of::<T>())
    }

    #[inline(always)]
    fn load(row: &Lanes<T>, at: usize) -> [T::Vector<S>; GROUP] {
        let vectors = T::vectors::<S>(&row.0[at..]);
        from_fn(|g| vectors[g])
    }

    #[inline(always)]
    fn store(row: &mut Lanes<T>, at: usize, values: [T::Vector<S>; GROUP]) {
        let vectors = T::vectors_mut::<S>(&mut row.0[at..]);
        vectors[..GROUP].copy_from_slice(&values);
    }

    /// `sums` + `factor` · `row`.
    #[inline(always)]
    fn added(
        &self,
        sums: [T::Vector<S>; GROUP],
        factor: T,
        row: [T::Vector<S>; GROUP],
    ) -> [T::Vector<S>; GROUP] {
        let factor = T::factor(self.simd, factor);
        from_fn(|g| T::plus_product(self.simd, row[g], factor, sums[g]))
    }

    /// (`row` − `sums`) · `factor`.
    #[inline(always)]
    fn scaled(
        &self,
        row: [T::Vector<S>; GROUP],
        sums: [T::Vector<S>; GROUP],
        factor: T,
    ) -> [T::Vector<S>; GROUP] {
        let factor = T::factor(self.simd, factor);
        from_fn(|g| T::times(self.simd, T::less(self.simd, row[g], sums[g]), factor))
    }

    #[inline(always)]
    fn zero(&self) -> [T::Vector<S>; GROUP] {
        [T::zeros(self.simd); GROUP]
    }

    /// Solves for the panel's unknowns, and subtracts what they contribute to the rows below.
    #[inline(always)]
    fn forward(&self, at: usize, top: &mut [Lanes<T>], below: &mut [Lanes<T>]) {
        let (width, height) = (self.panel.width, self.panel.height());
        for i in 0..width {
            let (known, own) = top.split_at_mut(i);
            let mut sums = self.zero();
            for (j, known) in known.iter().enumerate() {
                sums = self.added(sums, self.values[j * height + i], Self::load(known, at));
            }
            let inverse = self.values[i * height + i];
            let row = self.scaled(Self::load(&own[0], at), sums, inverse);
            Self::store(&mut own[0], at, row);
        }
        let mut rows = self.panel.below;
        let mut values = &self.values[width..];
        while let Some((four, rest)) = rows.split_first_chunk::<4>() {
            self.eliminated(at, top, below, four, values);
            (rows, values) = (rest, &values[4..]);
        }
        for row in rows.as_chunks::<1>().0 {
            self.eliminated(at, top, below, row, values);
            values = &values[1..];
        }
    }

    /// Subtracts from some rows what the panel's unknowns contribute; `values` begins at the first.
    #[inline(always)]
    fn eliminated<const R: usize>(
        &self,
        at: usize,
        top: &[Lanes<T>],
        below: &mut [Lanes<T>],
        rows: &[u32; R],
        values: &[T],
    ) {
        let mut sums = [self.zero(); R];
        let height = self.panel.height();
        for (j, known) in top.iter().enumerate() {
            let (known, column) = (Self::load(known, at), &values[j * height..][..R]);
            for (sums, &factor) in sums.iter_mut().zip(column) {
                *sums = self.added(*sums, factor, known);
            }
        }
        for (&row, sums) in rows.iter().zip(sums) {
            let row = &mut below[row as usize - self.panel.start - self.panel.width];
            let values = Self::load(row, at);
            let left = from_fn(|g| T::less(self.simd, values[g], sums[g]));
            Self::store(row, at, left);
        }
    }

    /// Solves for the panel's unknowns, those of the rows below being known.
    #[inline(always)]
    fn backward(&self, at: usize, top: &mut [Lanes<T>], below: &[Lanes<T>]) {
        let mut end = self.panel.width;
        while end >= 4 {
            end -= 4;
            self.substituted::<4>(at, top, below, end);
        }
        if end >= 2 {
            end -= 2;
            self.substituted::<2>(at, top, below, end);
        }
        if end > 0 {
            self.substituted::<1>(at, top, below, 0);
        }
    }

    /// Solves for the `N` unknowns from `first` on.
    #[inline(always)]
    fn substituted<const N: usize>(
        &self,
        at: usize,
        top: &mut [Lanes<T>],
        below: &[Lanes<T>],
        first: usize,
    ) {
        let (width, height) = (self.panel.width, self.panel.height());
        let (own, known) = top[first..].split_at_mut(N);
        let columns: [&[T]; N] = from_fn(|c| &self.values[(first + c) * height..][..height]);
        let mut sums = [self.zero(); N];
        for (i, known) in (first + N..width).zip(known.iter()) {
            let known = Self::load(known, at);
            sums = from_fn(|c| self.added(sums[c], columns[c][i], known));
        }
        let offset = self.panel.start + width;
        for (i, &row) in (width..height).zip(self.panel.below) {
            let known = Self::load(&below[row as usize - offset], at);
            sums = from_fn(|c| self.added(sums[c], columns[c][i], known));
        }
        for c in (0..N).rev() {
            let row = self.scaled(Self::load(&own[c], at), sums[c], columns[c][first + c]);
            Self::store(&mut own[c], at, row);
            for d in 0..c {
                sums[d] = self.added(sums[d], columns[d][first + c], row);
            }
        }
    }
}
