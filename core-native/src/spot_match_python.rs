//! What Python sees of how far spots and candidates stand out.

use numpy::{Ix1, Ix2, PyArray1, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same};
use crate::dense::Matrix;
use crate::spot_algebra::Metric;
use crate::spot_match::{self, Limits};
use crate::spot_python::{directions, signatures_of};
use crate::spot_table::PARAMETERS;

/// Squares of what each spot changes beside the others; left, slopes and each (…, rows).
#[pyfunction]
pub(crate) fn standing<'py>(
    left: &Any<'py>,
    slopes: &Any<'py>,
    each: &Any<'py>,
    ridge: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let py = each.py();
    let [left, slopes, each] = directions([("left", left), ("slopes", slopes), ("each", each)])?;
    same(
        "rows of slopes",
        PARAMETERS * each.shape()[0],
        slopes.shape()[0],
    )?;
    let unknown = Matrix {
        values: contiguous("left", &left)?.to_vec(),
        height: each.shape()[1],
    };
    let parts = [contiguous("slopes", &slopes)?, contiguous("each", &each)?];
    let out = py.detach(|| spot_match::standing(&Metric::of(unknown)?, parts, ridge));
    let out = out.ok_or_else(|| invalid("slopes: directions in proportion"))?;
    Ok(PyArray1::from_vec(py, out))
}

/// Likelihood ratios and contents of candidates, signatures (n, narrow) of squares (n), in a
/// residual (rows) with unknown and free directions (…, rows).
#[pyfunction]
pub(crate) fn standing_out<'py>(
    signatures: &Any<'py>,
    squares: &Any<'py>,
    unknown: &Any<'py>,
    free: &Any<'py>,
    residual: &Any<'py>,
    limits: Limits,
) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
    let py = residual.py();
    let signatures = array::<f64, Ix2>("signatures", signatures)?;
    let squares = array::<f64, Ix1>("squares", squares)?;
    let residual = array::<f64, Ix1>("residual", residual)?;
    let [unknown, free] = directions([("unknown", unknown), ("free", free)])?;
    same("length of unknown", residual.len(), unknown.shape()[1])?;
    let parts = [
        contiguous("unknown", &unknown)?,
        contiguous("free", &free)?,
        contiguous("residual", &residual)?,
    ];
    let seen = signatures_of(&signatures, &squares, residual.len())?;
    let out = py.detach(|| spot_match::standing_out(seen, parts, limits));
    let out = out.ok_or_else(|| invalid("free: directions in proportion"))?;
    Ok(out.map(|values| PyArray1::from_vec(py, values)))
}
