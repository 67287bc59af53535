//! Numeric factorisation, once per conductivity: multifrontal, from the leaves to the root.
//!
//! A panel's front holds its columns and the square of the rows below them. The front gathers the
//! matrix's values and what the children's fronts left over, loses its columns to the factor, and
//! leaves the square to its parent (Duff & Reid 1983).

use std::array::from_fn;
use std::ops::Range;
use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::instructions::run;
use crate::kernel::{ROWS, Shape, eliminate, write_square};
use crate::scalar::Scalar;
use crate::symbolic::{Panel, Symbolic};

/// Bytes of a line of the caches.
const LINE: usize = 64;

/// L of A = L Lᵀ, panel by panel, in the order of its symbolic part.
#[derive(Debug)]
pub struct Factor<T> {
    arch: Arch,
    symbolic: Arc<Symbolic>,
    values: Vec<T>,
}

impl<T: Scalar> Factor<T> {
    /// Factorises the symmetric matrix with these values.
    ///
    /// # Errors
    /// When the number of values is not the structure's, or the real part of the matrix is not
    /// positive definite.
    pub fn new(symbolic: Arc<Symbolic>, values: &[T]) -> Result<Self, String> {
        Self::by(Arch::new(), symbolic, values)
    }

    /// The same, all that is made of the factor included, by these vector instructions.
    ///
    /// # Errors
    /// As above.
    pub fn by(arch: Arch, symbolic: Arc<Symbolic>, values: &[T]) -> Result<Self, String> {
        if values.len() != symbolic.n_values() {
            let expected = symbolic.n_values();
            return Err(format!("expected {expected} values, got {}", values.len()));
        }
        let values = eliminated(arch, &symbolic, &symbolic.lower(values), 0)?;
        Ok(Self {
            arch,
            symbolic,
            values,
        })
    }

    /// The vector instructions.
    #[must_use]
    pub fn arch(&self) -> Arch {
        self.arch
    }

    /// The structure.
    #[must_use]
    pub fn symbolic(&self) -> &Symbolic {
        &self.symbolic
    }

    /// The values, panel after panel.
    #[must_use]
    pub fn values(&self) -> &[T] {
        &self.values
    }
}

/// The factor's values of the panels from `first` on, for the matrix with these [values of the lower
/// triangle](Symbolic::lower).
///
/// # Errors
/// When the real part of the matrix is not positive definite.
///
/// # Panics
/// When there are fewer values than the structure has.
pub(crate) fn eliminated<T: Scalar>(
    arch: Arch,
    symbolic: &Symbolic,
    values: &[T],
    first: usize,
) -> Result<Vec<T>, String> {
    let elimination = Elimination {
        symbolic,
        values,
        first,
    };
    run(arch, elimination).map_err(|column| {
        let row = symbolic.order()[column];
        format!("the matrix is not positive definite: pivot of row {row}")
    })
}

struct Elimination<'a, T> {
    symbolic: &'a Symbolic,
    /// Of the lower triangle, panel by panel.
    values: &'a [T],
    /// The first panel whose values are kept.
    first: usize,
}

impl<T: Scalar> WithSimd for Elimination<'_, T> {
    type Output = Result<Vec<T>, usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let symbolic = self.symbolic;
        let sizes = symbolic.workspace();
        let mut memory = vec![T::ZERO; sizes.iter().sum::<usize>() + LINE];
        let begin = memory.as_ptr().align_offset(LINE).min(LINE);
        let (columns, squares) = memory[begin..].split_at_mut(sizes[0]);
        let (even, odd) = squares.split_at_mut(sizes[1]);
        let omitted = symbolic.panel(self.first).first_value;
        let mut factor = Vec::with_capacity(symbolic.factor_len() - omitted + ROWS);
        for number in 0..symbolic.n_panels() {
            let panel = symbolic.panel(number);
            let shape = panel.shape();
            let (squares, others) = if panel.odd {
                (&mut *odd, &*even)
            } else {
                (&mut *even, &*odd)
            };
            let columns = &mut columns[..shape.columns_len()];
            columns.fill(T::ZERO);
            let scatter = symbolic.lower_of(number);
            for (&to, &value) in symbolic
                .targets(scatter.clone())
                .iter()
                .zip(&self.values[scatter])
            {
                columns[to as usize] = value;
            }
            for &child in panel.children {
                let child = symbolic.panel(child as usize);
                let begin = |row: u32| row as usize * shape.stride();
                add_child(
                    &others[child.square..],
                    child,
                    0..child.inner,
                    columns,
                    begin,
                );
            }
            eliminate(simd, columns, shape).map_err(|j| panel.start + j)?;
            let square = &mut squares[panel.square..][..shape.square_len()];
            write_square(simd, square, columns, shape);
            for &child in panel.children {
                let child = symbolic.panel(child as usize);
                let (top, rest) = (shape.top(), child.inner..child.below.len());
                let begin = |row: u32| ((row as usize - top) * shape.side()).wrapping_sub(top);
                add_child(&others[child.square..], child, rest, square, begin);
            }
            if number >= self.first {
                factor.resize(panel.values().end - omitted + ROWS, T::ZERO);
                pack(columns, shape, &mut factor[panel.first_value - omitted..]);
            }
        }
        factor.truncate(symbolic.factor_len() - omitted);
        Ok(factor)
    }
}

/// Adds some columns of a child's square to a part of its parent's front, in which the columns begin
/// at `begin` of their rows.
#[inline(always)]
fn add_child<T: Scalar>(
    update: &[T],
    child: Panel<'_>,
    columns: Range<usize>,
    target: &mut [T],
    begin: impl Fn(u32) -> usize + Copy,
) {
    let (rows, side) = (child.in_parent, child.shape().side());
    let Range { start: mut j, end } = columns;
    while j + 4 <= end {
        add_columns::<4, T>(target, begin, &rows[j..], &update[j * side + j..], side);
        j += 4;
    }
    while j < end {
        add_columns::<1, T>(target, begin, &rows[j..], &update[j * side + j..], side);
        j += 1;
    }
}

/// Adds the first `N` columns of a child's square, from the diagonal on, to those of the front that
/// begin at `begin` of their numbers.
///
/// Several at a time, since most are short.
#[inline(always)]
fn add_columns<const N: usize, T: Scalar>(
    target: &mut [T],
    begin: impl Fn(u32) -> usize,
    rows: &[u32],
    update: &[T],
    side: usize,
) {
    let begins: [usize; N] = from_fn(|c| begin(rows[c]));
    let (first, last) = (rows[0] as usize, rows[rows.len() - 1] as usize);
    for begin in begins {
        assert!(begin.wrapping_add(first) <= begin.wrapping_add(last));
        assert!(begin.wrapping_add(last) < target.len());
    }
    assert!(update.len() >= (N - 1) * side + rows.len());
    let mut add = |i: usize, row: u32, c: usize| {
        // SAFETY: rows ascend, and the first and the last are within what has been asserted.
        unsafe {
            *target.get_unchecked_mut(begins[c].wrapping_add(row as usize)) +=
                *update.get_unchecked(c * side + i);
        }
    };
    for (i, &row) in rows[..N].iter().enumerate() {
        (0..=i).for_each(|c| add(i, row, c));
    }
    for (i, &row) in rows.iter().enumerate().skip(N) {
        (0..N).for_each(|c| add(i, row, c));
    }
}

/// Writes a front's columns without their padding; what follows them is of no use.
#[inline(always)]
fn pack<T: Scalar>(columns: &[T], shape: Shape, packed: &mut [T]) {
    let (width, below, top) = (shape.width, shape.below, shape.top());
    for j in 0..width {
        let column = &columns[j * shape.stride()..][..shape.stride()];
        let target = &mut packed[j * (width + below)..];
        // whole vectors: what is written too much is written over by what follows
        for (part, first) in [(&column[..top], 0), (&column[top..], width)] {
            for (at, part) in part.as_chunks::<ROWS>().0.iter().enumerate() {
                target[first + at * ROWS..][..ROWS].copy_from_slice(part);
            }
        }
    }
}
