//! What Python sees of a table that whitened data see.

use numpy::{Ix1, Ix2, PyArray1, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same};
use crate::dense::Matrix;
use crate::small::product;
use crate::spot_algebra::{Beside, Metric};
use crate::spot_fit::Seen;
use crate::spot_match::{self, Measurements, Quality};
use crate::spot_python::{by_rows, directions};
use crate::spot_table::PARAMETERS;

/// A table as whitened data see it.
#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct SeenTable {
    pub(crate) seen: Seen,
    /// (n_meas, rows) and (n_meas, rank) by columns, and (n_meas).
    matrix: Vec<f64>,
    basis: Vec<f64>,
    squares: Vec<f64>,
}

/// A fit, as tomoskin.sensing.fit.problem.Fit has it.
#[derive(FromPyObject)]
struct FitArrays<'py> {
    each: Any<'py>,
    slopes: Any<'py>,
    unknown: Any<'py>,
    normal: Any<'py>,
    misfit: f64,
    degrees: f64,
}

/// Squares of what spots change, and a covariance.
type Judged<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

#[pymethods]
impl SeenTable {
    #[new]
    fn new(
        direct: &Any<'_>,
        timed: &Any<'_>,
        matrix: &Any<'_>,
        basis: &Any<'_>,
        squares: &Any<'_>,
    ) -> PyResult<Self> {
        let direct = array::<f64, Ix2>("direct", direct)?;
        let timed = array::<f64, Ix2>("timed", timed)?;
        same("columns of timed", direct.shape()[1], timed.shape()[1])?;
        if direct.shape()[0] > timed.shape()[0] {
            return Err(invalid("direct: no more rows than timed"));
        }
        let seen = Seen {
            rows: timed.shape()[0],
            narrow: direct.shape()[0],
            direct: direct.as_array().t().iter().copied().collect(),
            timed: timed.as_array().t().iter().copied().collect(),
        };
        let matrix = array::<f64, Ix2>("matrix", matrix)?;
        let basis = array::<f64, Ix2>("basis", basis)?;
        let squares = array::<f64, Ix1>("squares", squares)?;
        same("rows of matrix", seen.rows, matrix.shape()[0])?;
        same("rows of basis", direct.shape()[1], basis.shape()[0])?;
        same("columns of matrix", squares.len(), matrix.shape()[1])?;
        same("columns of basis", squares.len(), basis.shape()[1])?;
        Ok(Self {
            seen,
            matrix: matrix.as_array().iter().copied().collect(),
            basis: basis.as_array().iter().copied().collect(),
            squares: squares.as_array().to_vec(),
        })
    }

    /// Squares of what each spot of a fit changes beside the others, and the covariance (4k, 4k);
    /// `change` (rank) what all spots change.
    fn judged<'py>(
        &self,
        fit: FitArrays<'py>,
        change: &Any<'py>,
        uneven: f64,
        ridge: f64,
    ) -> PyResult<Judged<'py>> {
        let py = change.py();
        let [each, slopes, unknown] = directions([
            ("each", &fit.each),
            ("slopes", &fit.slopes),
            ("unknown", &fit.unknown),
        ])?;
        let normal = array::<f64, Ix2>("normal", &fit.normal)?;
        let change = array::<f64, Ix1>("change", change)?;
        let n = PARAMETERS * each.shape()[0];
        same("length of each", self.seen.rows, each.shape()[1])?;
        same("rows of slopes", n, slopes.shape()[0])?;
        same("rows of normal", n, normal.shape()[0])?;
        same("columns of normal", n, normal.shape()[1])?;
        let n_meas = self.squares.len();
        same("length of change", self.basis.len(), change.len() * n_meas)?;
        let (each, slopes) = (contiguous("each", &each)?, contiguous("slopes", &slopes)?);
        let unknown = contiguous("unknown", &unknown)?;
        let change = contiguous("change", &change)?;
        let normal = Matrix {
            values: contiguous("normal", &normal)?.to_vec(),
            height: n,
        };
        let quality = Quality {
            misfit: fit.misfit,
            degrees: fit.degrees,
            uneven,
        };
        let out = py.detach(|| {
            let alone = Metric::of(Matrix::zeros(self.seen.rows, 0))?;
            let squares = spot_match::standing(&alone, [slopes, each], ridge)?;
            let onto = Beside::of(unknown, &[], self.seen.rows, ridge)?;
            let onto = onto.projected(slopes, self.seen.rows);
            let change = product(&self.basis, n_meas, change).values;
            let measurements = Measurements {
                matrix: &self.matrix,
                squares: &self.squares,
                change: &change,
            };
            let covariance = spot_match::covariance(&normal, &onto, measurements, quality)?;
            Some((squares, covariance))
        });
        let (squares, covariance) = out.ok_or_else(|| invalid("normal: not positive"))?;
        Ok((PyArray1::from_vec(py, squares), by_rows(py, covariance)))
    }
}
