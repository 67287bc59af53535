//! Forward and back substitution, several right-hand sides abreast.
//!
//! A row of the unknown holds `W` right-hand sides side by side, so that one pass over the factor
//! serves them all. Panels whose part of the right-hand side is still zero are left out: a current
//! into one electrode reaches only the columns on its path to the root of the elimination tree.

use ndarray::ArrayView2;
use pulp::{Arch, Simd, WithSimd};

use crate::factor::Factor;
use crate::scalar::Scalar;
use crate::symbolic::Panel;

/// Solves A X = B for B of any layout, (n, k), and row-major X.
///
/// # Panics
/// When a size is not the factor's.
pub fn solve<T: Scalar>(factor: &Factor<T>, rhs: ArrayView2<'_, T>, out: &mut [T]) {
    assert!(rhs.nrows() == factor.symbolic().size() && rhs.len() == out.len());
    let mut first = 0;
    while first < rhs.ncols() {
        let step = match rhs.ncols() - first {
            1 => solve_block::<1, T>,
            2..=4 => solve_block::<4, T>,
            5..=8 => solve_block::<8, T>,
            _ => solve_block::<16, T>,
        };
        first += step(factor, rhs, first, out);
    }
}

/// Solves for up to `W` columns from `first` on; gives their number.
fn solve_block<const W: usize, T: Scalar>(
    factor: &Factor<T>,
    rhs: ArrayView2<'_, T>,
    first: usize,
    out: &mut [T],
) -> usize {
    let columns = rhs.ncols();
    let count = W.min(columns - first);
    let order = factor.symbolic().order();
    let mut x: Vec<[T; W]> = vec![[T::ZERO; W]; order.len()];
    for (row, &from) in x.iter_mut().zip(order) {
        for (offset, value) in row[..count].iter_mut().enumerate() {
            *value = rhs[[from as usize, first + offset]];
        }
    }
    Arch::new().dispatch(Substitution { factor, x: &mut x });
    for (row, &to) in x.iter().zip(order) {
        let begin = to as usize * columns + first;
        out[begin..begin + count].copy_from_slice(&row[..count]);
    }
    count
}

struct Substitution<'a, const W: usize, T> {
    factor: &'a Factor<T>,
    x: &'a mut [[T; W]],
}

impl<const W: usize, T: Scalar> WithSimd for Substitution<'_, W, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let (symbolic, values) = (self.factor.symbolic(), self.factor.values());
        for number in 0..symbolic.n_panels() {
            let panel = symbolic.panel(number);
            forward(panel, &values[panel.values()], self.x);
        }
        let mut below = Vec::new();
        for number in (0..symbolic.n_panels()).rev() {
            let panel = symbolic.panel(number);
            backward(panel, &values[panel.values()], self.x, &mut below);
        }
    }
}

#[inline(always)]
fn forward<const W: usize, T: Scalar>(panel: Panel<'_>, values: &[T], x: &mut [[T; W]]) {
    let (width, height) = (panel.width, panel.height());
    let (done, rest) = x.split_at_mut(panel.start + width);
    let top = &mut done[panel.start..];
    if top.as_flattened().iter().all(|&value| value == T::ZERO) {
        return;
    }
    for j in 0..width {
        let column = &values[j * height..][..height];
        let (head, tail) = top.split_at_mut(j + 1);
        divide(&mut head[j], column[j]);
        for (row, &l) in tail.iter_mut().zip(&column[j + 1..]) {
            subtract(row, l, &head[j]);
        }
    }
    let offset = panel.start + width;
    let mut pairs = panel.below.chunks_exact(2);
    for (i, pair) in pairs.by_ref().enumerate() {
        let rows = [pair[0] as usize - offset, pair[1] as usize - offset];
        eliminated::<2, W, T>(rest, rows, &values[width + 2 * i..], height, top);
    }
    for &row in pairs.remainder() {
        eliminated::<1, W, T>(
            rest,
            [row as usize - offset],
            &values[height - 1..],
            height,
            top,
        );
    }
}

/// Subtracts from some rows what the panel's unknowns contribute; `values` begins at the first.
#[inline(always)]
fn eliminated<const R: usize, const W: usize, T: Scalar>(
    x: &mut [[T; W]],
    rows: [usize; R],
    values: &[T],
    height: usize,
    top: &[[T; W]],
) {
    let mut sums: [[T; W]; R] = std::array::from_fn(|r| x[rows[r]]);
    for (column, known) in values.chunks(height).zip(top) {
        for (sum, &l) in sums.iter_mut().zip(column) {
            subtract(sum, l, known);
        }
    }
    for (row, sum) in rows.into_iter().zip(sums) {
        x[row] = sum;
    }
}

#[inline(always)]
fn backward<const W: usize, T: Scalar>(
    panel: Panel<'_>,
    values: &[T],
    x: &mut [[T; W]],
    known: &mut Vec<[T; W]>,
) {
    let (width, height) = (panel.width, panel.height());
    let (done, rest) = x.split_at_mut(panel.start + width);
    let top = &mut done[panel.start..];
    known.clear();
    known.extend(
        panel
            .below
            .iter()
            .map(|&row| rest[row as usize - panel.start - width]),
    );
    let mut j = width;
    while j >= 2 {
        j -= 2;
        let (first, second) = values[j * height..][..2 * height].split_at(height);
        let (mut a, mut b) = (top[j], top[j + 1]);
        for (rows, from, to) in [(&known[..], width, height), (&top[j + 2..], j + 2, width)] {
            for ((row, &p), &q) in rows.iter().zip(&first[from..to]).zip(&second[from..to]) {
                subtract(&mut a, p, row);
                subtract(&mut b, q, row);
            }
        }
        divide(&mut b, second[j + 1]);
        subtract(&mut a, first[j + 1], &b);
        divide(&mut a, first[j]);
        (top[j], top[j + 1]) = (a, b);
    }
    if j == 1 {
        let (mut a, column) = (top[0], &values[..height]);
        for (rows, from, to) in [(&known[..], width, height), (&top[1..], 1, width)] {
            for (row, &l) in rows.iter().zip(&column[from..to]) {
                subtract(&mut a, l, row);
            }
        }
        divide(&mut a, column[0]);
        top[0] = a;
    }
}

#[inline(always)]
fn subtract<const W: usize, T: Scalar>(row: &mut [T; W], factor: T, other: &[T; W]) {
    for (value, &by) in row.iter_mut().zip(other) {
        *value -= factor * by;
    }
}

#[inline(always)]
fn divide<const W: usize, T: Scalar>(row: &mut [T; W], by: T) {
    let inverse = T::ONE / by;
    for value in row {
        *value *= inverse;
    }
}
