//! faer's own sparse Cholesky, for benchmarks: what a bare call of the library takes.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymmetricOrdering, factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side, Spec};
use numpy::{Ix1, Ix2, PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same, unsigned};
use crate::ordering::check;

/// A structure as faer analyses it by itself: minimum degree, simplicial or by panels as it finds
/// better, one thread; with the memory that its calls need.
#[pyclass(module = "tomoskin_core")]
pub(crate) struct Reference {
    column_starts: Vec<u32>,
    rows: Vec<u32>,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<f64>,
    memory: MemBuffer,
    n_rhs: usize,
}

#[pymethods]
impl Reference {
    #[new]
    fn new(n: usize, indptr: &Any<'_>, indices: &Any<'_>, n_rhs: usize) -> PyResult<Self> {
        let (column_starts, rows) = (unsigned("indptr", indptr)?, unsigned("indices", indices)?);
        check(n, &column_starts, &rows).map_err(invalid)?;
        let matrix =
            SymbolicSparseColMatRef::new_unsorted_checked(n, n, &column_starts, None, &rows);
        let params = CholeskySymbolicParams::default();
        let symbolic =
            factorize_symbolic_cholesky(matrix, Side::Lower, SymmetricOrdering::Amd, params)
                .map_err(|error| invalid(format!("the symbolic analysis failed: {error:?}")))?;
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

    /// Number of values in faer's factor.
    #[getter]
    fn factor_len(&self) -> usize {
        self.values.len()
    }

    fn solve<'py>(
        &mut self,
        values: &Any<'py>,
        rhs: &Any<'py>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let values = array::<f64, Ix1>("values", values)?;
        let rhs = array::<f64, Ix2>("rhs", rhs)?;
        same("length of values", self.rows.len(), values.len())?;
        same("rows of rhs", self.n_rhs, rhs.shape()[0])?;
        same("columns of rhs", self.symbolic.nrows(), rhs.shape()[1])?;
        let x = PyArray2::<f64>::zeros(rhs.py(), [rhs.shape()[0], rhs.shape()[1]], false);
        let mut writable = x.readwrite();
        let solved = writable.as_slice_mut()?;
        solved.copy_from_slice(contiguous("rhs", &rhs)?);
        self.solve_in_place(contiguous("values", &values)?, solved)?;
        drop(writable);
        Ok(x)
    }
}

impl Reference {
    /// Factorises the matrix with these values, and solves for column-major `x` in its place.
    fn solve_in_place(&mut self, values: &[f64], x: &mut [f64]) -> PyResult<()> {
        let size = self.symbolic.nrows();
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
            .map_err(|error| invalid(format!("the matrix is not positive definite: {error:?}")))?;
        let x = MatMut::from_column_major_slice_mut(x, size, self.n_rhs);
        factor.solve_in_place_with_conj(Conj::No, x, Par::Seq, stack);
        Ok(())
    }
}
