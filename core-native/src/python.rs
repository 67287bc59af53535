//! What Python sees: arrays checked, the interpreter free while the work runs.

use std::sync::Arc;

use numpy::{
    Element, Ix1, Ix2, Ix3, PyArray2, PyArrayMethods, PyReadwriteArray2, PyUntypedArrayMethods,
};
use pulp::Arch;
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, is_complex, same, unsigned};
use crate::instructions::name;
use crate::jacobian::{Fields, Table};
use crate::patches::Patches;
use crate::product::Rows;
use crate::scalar::{Scalar, c64};
use crate::spot_match_python::{standing, standing_out};
use crate::spot_python::SpotTable;
use crate::spot_reduced_python::Reduced;
use crate::spot_seen_python::SeenTable;
use crate::twin_python::{Terminals, conducted, converted, dented, lines};
use crate::{factor, jacobian, product, solve, symbolic, threads};

#[pyclass(frozen, module = "tomoskin_core")]
struct Symbolic(Arc<symbolic::Symbolic>);

#[pymethods]
impl Symbolic {
    #[new]
    fn new(py: Python<'_>, n: usize, indptr: &Any<'_>, indices: &Any<'_>) -> PyResult<Self> {
        let (starts, rows) = (unsigned("indptr", indptr)?, unsigned("indices", indices)?);
        py.detach(|| symbolic::Symbolic::new(n, &starts, &rows))
            .map(|symbolic| Self(Arc::new(symbolic)))
            .map_err(invalid)
    }

    /// Number of values in a factor.
    #[getter]
    fn factor_len(&self) -> usize {
        self.0.factor_len()
    }

    fn factor(&self, py: Python<'_>, values: &Any<'_>) -> PyResult<Factor> {
        if is_complex(values) {
            return numeric(py, &self.0, values).map(|factor| Factor(Number::Complex(factor)));
        }
        numeric(py, &self.0, values).map(|factor| Factor(Number::Real(factor)))
    }
}

fn numeric<T: Scalar + Element>(
    py: Python<'_>,
    symbolic: &Arc<symbolic::Symbolic>,
    values: &Any<'_>,
) -> PyResult<factor::Factor<T>> {
    let values = array::<T, Ix1>("values", values)?;
    let values = contiguous("values", &values)?;
    py.detach(|| factor::Factor::new(Arc::clone(symbolic), values))
        .map_err(invalid)
}

#[pyclass(frozen, module = "tomoskin_core")]
struct Factor(Number);

enum Number {
    Real(factor::Factor<f64>),
    Complex(factor::Factor<c64>),
}

#[pymethods]
impl Factor {
    fn columns<'py>(&self, rows: &Any<'py>) -> PyResult<Any<'py>> {
        Ok(match &self.0 {
            Number::Real(factor) => columns(factor, rows)?.into_any(),
            Number::Complex(factor) => columns(factor, rows)?.into_any(),
        })
    }

    fn checked_columns<'py>(&self, values: &Any<'py>, rows: &Any<'py>) -> PyResult<Checked<'py>> {
        match &self.0 {
            Number::Real(factor) => checked_columns(factor, values, rows),
            Number::Complex(factor) => checked_columns(factor, values, rows),
        }
    }
}

/// Columns, what they may be off, and their largest residual.
type Checked<'py> = (Any<'py>, Any<'py>, f64);

fn columns<'py, T: Scalar + Element>(
    factor: &factor::Factor<T>,
    rows: &Any<'py>,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let (py, rows) = (rows.py(), rows_of(factor, rows)?);
    // SAFETY: `columns` writes all of it before anything reads it.
    let out = unsafe { PyArray2::<T>::new(py, [factor.symbolic().size(), rows.len()], false) };
    {
        let mut writable = out.readwrite();
        let x = writable.as_slice_mut()?;
        py.detach(|| solve::columns(factor, &rows, x));
    }
    Ok(out)
}

fn checked_columns<'py, T: Scalar + Element>(
    factor: &factor::Factor<T>,
    values: &Any<'py>,
    rows: &Any<'py>,
) -> PyResult<Checked<'py>> {
    let (py, rows) = (rows.py(), rows_of(factor, rows)?);
    let values = array::<T, Ix1>("values", values)?;
    let values = contiguous("values", &values)?;
    same(
        "length of values",
        factor.symbolic().n_values(),
        values.len(),
    )?;
    // SAFETY: `checked_columns` writes all of it before anything reads it.
    let out = unsafe { PyArray2::<T>::new(py, [factor.symbolic().size(), rows.len()], false) };
    let lost = PyArray2::<T>::zeros(py, [rows.len(), rows.len()], false);
    let largest = {
        let (mut out, mut lost) = (out.readwrite(), lost.readwrite());
        let (x, lost) = (out.as_slice_mut()?, lost.as_slice_mut()?);
        py.detach(|| solve::checked_columns(factor, values, &rows, x, lost))
    };
    Ok((out.into_any(), lost.into_any(), largest))
}

/// Rows of the factorised matrix.
fn rows_of<T: Scalar>(factor: &factor::Factor<T>, rows: &Any<'_>) -> PyResult<Vec<u32>> {
    let size = factor.symbolic().size();
    let rows = array::<i64, Ix1>("rows", rows)?;
    let rows = rows.as_array();
    let within = |&row: &i64| u32::try_from(row).ok().filter(|&row| (row as usize) < size);
    let found: Option<Vec<u32>> = rows.iter().map(within).collect();
    found.ok_or_else(|| invalid(format!("rows: expected numbers from 0 to {}", size - 1)))
}

#[pyfunction]
#[pyo3(signature = (indptr, indices, data, vectors, out, threads=None))]
fn transposed_product(
    indptr: &Any<'_>,
    indices: &Any<'_>,
    data: &Any<'_>,
    vectors: &Any<'_>,
    out: &Any<'_>,
    threads: Option<usize>,
) -> PyResult<()> {
    let starts = array::<i32, Ix1>("indptr", indptr)?;
    let columns = array::<i32, Ix1>("indices", indices)?;
    let values = array::<f64, Ix1>("data", data)?;
    let matrix = Rows::new(
        contiguous("indptr", &starts)?,
        contiguous("indices", &columns)?,
        contiguous("data", &values)?,
    )
    .map_err(invalid)?;
    let threads = threads::count(threads);
    if is_complex(vectors) {
        return product_into::<c64>(matrix, vectors, out, threads);
    }
    product_into::<f64>(matrix, vectors, out, threads)
}

fn product_into<T: Scalar + Element>(
    matrix: Rows<'_>,
    vectors: &Any<'_>,
    out: &Any<'_>,
    threads: usize,
) -> PyResult<()> {
    let vectors = array::<T, Ix2>("vectors", vectors)?;
    let mut out: PyReadwriteArray2<'_, T> = out
        .extract()
        .map_err(|_| invalid("out: expected a writable array of the type of vectors"))?;
    if matrix.n_columns() > vectors.shape()[0] {
        return Err(invalid("indices: a column beyond the rows of vectors"));
    }
    same("rows of out", vectors.shape()[1], out.shape()[0])?;
    same("columns of out", matrix.n_rows(), out.shape()[1])?;
    let (py, vectors) = (vectors.py(), vectors.as_array());
    let out = out
        .as_slice_mut()
        .map_err(|_| invalid("out: expected a C-contiguous array"))?;
    py.detach(|| product::transposed_product(matrix, vectors, out, threads));
    Ok(())
}

#[pyfunction]
#[pyo3(name = "jacobian", signature = (gradient, drives, current, drive_index, measure, threads=None))]
fn jacobian_rows<'py>(
    gradient: &Any<'py>,
    drives: &Any<'_>,
    current: &Any<'_>,
    drive_index: &Any<'_>,
    measure: &Any<'_>,
    threads: Option<usize>,
) -> PyResult<Any<'py>> {
    let drives = pairs("drives", drives)?;
    let measure = pairs("measure", measure)?;
    let current = array::<f64, Ix1>("current", current)?;
    let drive_index = array::<i64, Ix1>("drive_index", drive_index)?;
    same("length of current", drives.len(), current.len())?;
    same("length of drive_index", measure.len(), drive_index.len())?;
    let current = current.as_array();
    let index: Vec<usize> = drive_index.as_array().iter().map(|&i| i as usize).collect();
    let table = Table::new(&drives, |drive| current[drive], &index, &measure).map_err(invalid)?;
    let threads = threads::count(threads);
    if is_complex(gradient) {
        return Ok(rows::<c64>(gradient, &table, threads)?.into_any());
    }
    Ok(rows::<f64>(gradient, &table, threads)?.into_any())
}

/// Pairs of electrodes; a negative number becomes one that is too large.
pub(crate) fn pairs(name: &str, value: &Any<'_>) -> PyResult<Vec<[usize; 2]>> {
    let table = array::<i64, Ix2>(name, value)?;
    same(&format!("columns of {name}"), 2, table.shape()[1])?;
    let table = table.as_array();
    let rows = table.outer_iter();
    Ok(rows.map(|row| [row[0] as usize, row[1] as usize]).collect())
}

fn rows<'py, T: Scalar + Element>(
    gradient: &Any<'py>,
    table: &Table,
    threads: usize,
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let gradient = array::<T, Ix3>("gradient", gradient)?;
    let (py, shape) = (gradient.py(), gradient.shape());
    let values = contiguous("gradient", &gradient)?;
    let fields = Fields {
        values,
        shape: [shape[0], shape[1], shape[2]],
    };
    if table.n_electrodes() > shape[0] {
        return Err(invalid(format!(
            "an electrode beyond the {} of gradient",
            shape[0]
        )));
    }
    // SAFETY: `jacobian` writes all rows before anything reads them.
    let out = unsafe { PyArray2::<T>::new(py, [table.n_rows(), shape[2]], false) };
    {
        let mut writable = out.readwrite();
        let values = writable.as_slice_mut()?;
        py.detach(|| jacobian::jacobian(fields, table, values, threads));
    }
    Ok(out)
}

/// Lets the process keep the memory of arrays up to 32 MB when they are freed.
///
/// glibc gives back the end of its heap beyond twice the largest block that was ever freed to the
/// system, 128 kB at first; arrays that come and go are then mapped anew, page by page, which took
/// half of a forward solve. One large block, never touched, raises that bound.
fn keep_freed_memory() {
    const LARGEST: usize = 31 << 20;
    drop(std::hint::black_box(Vec::<u8>::with_capacity(LARGEST)));
}

/// Number of what `tomoskin_core.pyi` says: raised with each change of it, so that tomoskin does
/// not call an engine that was built for other arguments.
const INTERFACE: u32 = 8;

#[pymodule]
fn tomoskin_core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    keep_freed_memory();
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("interface", INTERFACE)?;
    module.add("vector_code", name(Arch::new()))?;
    module.add_class::<Symbolic>()?;
    module.add_class::<Factor>()?;
    module.add_class::<Patches>()?;
    module.add_class::<Reduced>()?;
    module.add_class::<SpotTable>()?;
    module.add_class::<Terminals>()?;
    module.add_class::<SeenTable>()?;
    #[cfg(feature = "reference")]
    module.add_class::<crate::reference::Reference>()?;
    module.add_function(wrap_pyfunction!(jacobian_rows, module)?)?;
    module.add_function(wrap_pyfunction!(converted, module)?)?;
    module.add_function(wrap_pyfunction!(dented, module)?)?;
    module.add_function(wrap_pyfunction!(conducted, module)?)?;
    module.add_function(wrap_pyfunction!(lines, module)?)?;
    module.add_function(wrap_pyfunction!(standing, module)?)?;
    module.add_function(wrap_pyfunction!(standing_out, module)?)?;
    module.add_function(wrap_pyfunction!(transposed_product, module)?)
}
