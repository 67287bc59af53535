//! faer's own sparse Cholesky, for benchmarks: what a bare call of the library takes.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};

use crate::ordering::check;

/// A structure as faer analyses it by itself: minimum degree, simplicial or by panels as it finds
/// better, one thread; with the memory that its calls need.
pub struct Reference {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    memory: MemBuffer,
    n_rhs: usize,
}

impl Reference {
    /// Analyses the structure of a symmetric matrix given in full, for `n_rhs` right-hand sides.
    ///
    /// # Errors
    /// When the arrays are no such structure, or the factor is too large to index.
    pub fn new(
        size: usize,
        column_starts: Vec<u32>,
        rows: Vec<u32>,
        n_rhs: usize,
    ) -> Result<Self, String> {
        check(size, &column_starts, &rows)?;
        let matrix =
            SymbolicSparseColMatRef::new_unsorted_checked(size, size, &column_starts, None, &rows);
        let params = CholeskySymbolicParams::default();
        let symbolic =
            factorize_symbolic_cholesky(matrix, Side::Lower, SymmetricOrdering::Amd, params)
                .map_err(|error| format!("the symbolic analysis failed: {error:?}"))?;
        let factor = symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Spec::default());
        let solve = symbolic.solve_in_place_scratch::<f64>(n_rhs, Par::Seq);
        Ok(Self {
            values: vec![0.0; symbolic.len_val()],
            memory: MemBuffer::new(factor.or(solve)),
            column_starts,
            rows,
            symbolic,
            n_rhs,
        })
    }

    /// Number of right-hand sides.
    #[must_use]
    pub fn n_rhs(&self) -> usize {
        self.n_rhs
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.symbolic.nrows()
    }

    /// Number of values in faer's factor.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.values.len()
    }

    /// Factorises the matrix with these values, and solves for column-major `x` in its place.
    ///
    /// # Errors
    /// When a size is not the structure's, or the matrix is not positive definite.
    pub fn solve(&mut self, values: &[f64], x: &mut [f64]) -> Result<(), String> {
        let size = self.size();
        if values.len() != self.rows.len() || x.len() != size * self.n_rhs {
            return Err("expected values and right-hand sides of the structure".into());
        }
        let (starts, rows) = (&self.column_starts, &self.rows);
        // SAFETY: `new` has checked them; a second time would be counted in what is measured.
        let structure =
            unsafe { SymbolicSparseColMatRef::new_unchecked(size, size, starts, None, rows) };
        let stack = MemStack::new(&mut self.memory);
        let factor = self
            .symbolic
            .factorize_numeric_llt(
                &mut self.values,
                SparseColMatRef::new(structure, values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                stack,
                Spec::default(),
            )
            .map_err(|error| format!("the matrix is not positive definite: {error:?}"))?;
        let x = MatMut::from_column_major_slice_mut(x, size, self.n_rhs);
        factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
        Ok(())
    }
}
