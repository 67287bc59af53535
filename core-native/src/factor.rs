//! Numeric factorisation, once per conductivity: multifrontal, from the leaves to the root.
//!
//! A panel's front holds its columns and the square of the rows below them. The front gathers the
//! matrix's values and what the children's fronts left over, loses its columns to the factor, and
//! leaves the square to its parent (Duff & Reid 1983).

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::kernel::{eliminate, subtract_square};
use crate::scalar::Scalar;
use crate::symbolic::{Panel, Symbolic};

/// L of A = L Lᵀ, panel by panel, in the order of its symbolic part.
#[derive(Debug)]
pub struct Factor<T> {
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
        if values.len() != symbolic.n_values() {
            let expected = symbolic.n_values();
            return Err(format!("expected {expected} values, got {}", values.len()));
        }
        let mut factor = vec![T::ZERO; symbolic.factor_len()];
        for &(to, from) in symbolic.scatter() {
            factor[to as usize] = values[from as usize];
        }
        let elimination = Elimination {
            symbolic: &symbolic,
            factor: &mut factor,
        };
        Arch::new().dispatch(elimination).map_err(|column| {
            let row = symbolic.order()[column];
            format!("the matrix is not positive definite: pivot of row {row}")
        })?;
        Ok(Self {
            symbolic,
            values: factor,
        })
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

struct Elimination<'a, T> {
    symbolic: &'a Symbolic,
    factor: &'a mut [T],
}

impl<T: Scalar> WithSimd for Elimination<'_, T> {
    type Output = Result<(), usize>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let n_panels = self.symbolic.n_panels();
        let mut left_over: Vec<Vec<T>> = vec![Vec::new(); n_panels];
        let mut spare: Vec<Vec<T>> = Vec::new();
        for number in 0..n_panels {
            let panel = self.symbolic.panel(number);
            let values = &mut self.factor[panel.values()];
            let mut square = spare.pop().unwrap_or_default();
            square.clear();
            square.resize(panel.below.len().pow(2), T::ZERO);
            for &child in panel.children {
                let update = std::mem::take(&mut left_over[child as usize]);
                let rows = self.symbolic.panel(child as usize).in_parent;
                add_child(&update, rows, panel, values, &mut square);
                spare.push(update);
            }
            eliminate(values, panel.height(), panel.width).map_err(|j| panel.start + j)?;
            subtract_square(&mut square, values, panel.height(), panel.width);
            left_over[number] = square;
        }
        Ok(())
    }
}

/// Adds a child's square to the front: the columns into `values`, the rest into `square`.
#[inline(always)]
fn add_child<T: Scalar>(
    update: &[T],
    rows: &[u32],
    panel: Panel<'_>,
    values: &mut [T],
    square: &mut [T],
) {
    let (size, width, height) = (rows.len(), panel.width, panel.height());
    let n_columns = rows.partition_point(|&row| (row as usize) < width);
    for j in 0..n_columns {
        let target = &mut values[rows[j] as usize * height..][..height];
        for (&row, &value) in rows[j..].iter().zip(&update[j * size + j..(j + 1) * size]) {
            target[row as usize] += value;
        }
    }
    let n_below = panel.below.len();
    for j in n_columns..size {
        let target = &mut square[(rows[j] as usize - width) * n_below..][..n_below];
        for (&row, &value) in rows[j..].iter().zip(&update[j * size + j..(j + 1) * size]) {
            target[row as usize - width] += value;
        }
    }
}
