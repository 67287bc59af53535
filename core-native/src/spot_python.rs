//! What Python sees of spots.

use numpy::{
    Ix1, Ix2, Ix3, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray2,
    PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same};
use crate::dense::Matrix;
use crate::spot_algebra::{Beside, Metric};
use crate::spot_fit::{Frame, Prior, Seen, Sheet};
use crate::spot_match::{self, Limits, Signatures};
use crate::spot_table::{DIRECTIONS, Grid, PARAMETERS, ROWS, Spot, Table};

/// A table of spots, and where they may be.
#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct SpotTable {
    table: Table,
    sheet: Sheet,
    prior: Prior,
}

/// A table as whitened data see it.
#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct SeenTable(Seen);

/// Spots, and what they do: arrays by rows, as Python has them.
type Found<'py> = (
    [Bound<'py, PyArray2<f64>>; 5],
    [Bound<'py, PyArray1<f64>>; 3],
    (f64, f64, f64, bool),
);

#[pymethods]
impl SpotTable {
    /// `grids` (n, 5): origin, step, shape; `prior` (2, 4): middle and weight.
    #[new]
    #[expect(clippy::too_many_arguments, reason = "a table has as many parts")]
    fn new(
        log_radii: &Any<'_>,
        grids: &Any<'_>,
        nodes: &Any<'_>,
        values: &Any<'_>,
        filling: f64,
        sheet: &Any<'_>,
        prior: &Any<'_>,
        log_range: [f64; 2],
    ) -> PyResult<Self> {
        let values = array::<f64, Ix3>("values", values)?;
        let nodes = array::<f64, Ix1>("nodes", nodes)?;
        same(
            "planes of values",
            nodes.shape()[0] + DIRECTIONS,
            values.shape()[1],
        )?;
        let sheet = array::<f64, Ix2>("sheet", sheet)?;
        same("columns of sheet", 3, sheet.shape()[1])?;
        let prior = array::<f64, Ix2>("prior", prior)?;
        same("entries of prior", 2 * PARAMETERS, prior.len())?;
        let (sheet, prior) = (sheet.as_array(), prior.as_array());
        let row = |number: usize| -> Spot { std::array::from_fn(|i| prior[(number, i)]) };
        let table = Table {
            log_radii: array::<f64, Ix1>("log_radii", log_radii)?
                .as_array()
                .to_vec(),
            grids: grids_of(grids)?,
            nodes: nodes.as_array().to_vec(),
            rank: values.shape()[2],
            values: contiguous("values", &values)?.to_vec(),
            filling,
        };
        if sheet.is_empty() {
            return Err(invalid("sheet: a cell at least"));
        }
        Ok(Self {
            table: table.checked().map_err(invalid)?,
            sheet: Sheet {
                centroids: sheet.outer_iter().map(|cell| [cell[0], cell[1]]).collect(),
                margin: sheet.outer_iter().map(|cell| cell[2]).collect(),
            },
            prior: Prior {
                middle: row(0),
                weight: row(1),
                log_radii: log_range,
                filling,
            },
        })
    }

    /// (k, ROWS, rank) of spots (k, 4).
    fn expanded<'py>(&self, spots: &Any<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (py, spots) = (spots.py(), spots_of(spots)?);
        let size = ROWS * self.table.rank;
        let out = PyArray3::<f64>::zeros(py, [spots.len(), ROWS, self.table.rank], false);
        {
            let mut writable = out.readwrite();
            let parts = writable.as_slice_mut()?.chunks_exact_mut(size.max(1));
            for (spot, part) in spots.iter().zip(parts) {
                self.table.expand(spot, ROWS, part);
            }
        }
        Ok(out)
    }

    /// The minimum near `spots` (k, 4), after at most so many steps; none: at the spots.
    #[expect(clippy::too_many_arguments, reason = "a frame has as many parts")]
    fn settled<'py>(
        &self,
        seen: &SeenTable,
        data: &Any<'py>,
        rest: f64,
        left: &Any<'py>,
        offset: &Any<'py>,
        spots: &Any<'py>,
        deviations: [f64; 4],
        depths: [f64; 2],
        most: usize,
    ) -> PyResult<Found<'py>> {
        let py = data.py();
        let data = array::<f64, Ix1>("data", data)?;
        let left = array::<f64, Ix2>("left", left)?;
        let offset = array::<f64, Ix1>("offset", offset)?;
        same("length of data", seen.0.rows, data.len())?;
        same("columns of left", seen.0.rows, left.shape()[1])?;
        same("length of offset", self.table.rank, offset.len())?;
        same(
            "entries of the table seen",
            self.table.rank * seen.0.rows,
            seen.0.timed.len(),
        )?;
        let spots = spots_of(spots)?;
        let frame = Frame {
            table: &self.table,
            seen: &seen.0,
            sheet: &self.sheet,
            prior: &self.prior,
            data: contiguous("data", &data)?,
            rest,
            left: contiguous("left", &left)?,
            offset: contiguous("offset", &offset)?,
            deviations,
            depths,
        };
        let fit = py.detach(|| frame.settled(&spots, most));
        let fit = fit.ok_or_else(|| invalid("spots: not comparable with the data"))?;
        let k = fit.spots.len();
        let spots = Matrix {
            values: fit.spots.concat(),
            height: PARAMETERS,
        };
        debug_assert_eq!(spots.width(), k);
        let matrices = [
            spots,
            fit.each,
            fit.jacobian,
            fit.metric.unknown,
            fit.normal,
        ];
        let vectors = [fit.predicted, fit.residual, fit.gradient];
        Ok((
            matrices.map(|matrix| by_rows(py, matrix)),
            vectors.map(|vector| PyArray1::from_vec(py, vector)),
            (fit.misfit, fit.metric.log_size, fit.cost, fit.settled),
        ))
    }
}

#[pymethods]
impl SeenTable {
    #[new]
    fn new(direct: &Any<'_>, timed: &Any<'_>) -> PyResult<Self> {
        let direct = array::<f64, Ix2>("direct", direct)?;
        let timed = array::<f64, Ix2>("timed", timed)?;
        same("columns of timed", direct.shape()[1], timed.shape()[1])?;
        if direct.shape()[0] > timed.shape()[0] {
            return Err(invalid("direct: no more rows than timed"));
        }
        Ok(Self(Seen {
            rows: timed.shape()[0],
            narrow: direct.shape()[0],
            direct: direct.as_array().t().iter().copied().collect(),
            timed: timed.as_array().t().iter().copied().collect(),
        }))
    }
}

/// Unknown, free and columns, each (…, rows) one after the other; see the module.
#[pyfunction]
pub(crate) fn projected<'py>(
    unknown: &Any<'py>,
    free: &Any<'py>,
    columns: &Any<'py>,
    ridge: f64,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let py = columns.py();
    let [unknown, free, columns] =
        directions([("unknown", unknown), ("free", free), ("columns", columns)])?;
    let rows = columns.shape()[1];
    let parts = [
        contiguous("unknown", &unknown)?,
        contiguous("free", &free)?,
        contiguous("columns", &columns)?,
    ];
    let [unknown, free, columns] = parts;
    let out = py.detach(|| {
        let beside = Beside::of(unknown, free, rows, ridge)?;
        Some(beside.projected(columns, rows))
    });
    let out = out.ok_or_else(|| invalid("free: directions in proportion"))?;
    Ok(by_rows(py, out))
}

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
/// residual (rows) with unknown and free directions (…, rows); `limits`: see the module.
#[pyfunction]
pub(crate) fn standing_out<'py>(
    signatures: &Any<'py>,
    squares: &Any<'py>,
    unknown: &Any<'py>,
    free: &Any<'py>,
    residual: &Any<'py>,
    limits: (f64, f64, f64, f64, f64),
) -> PyResult<[Bound<'py, PyArray1<f64>>; 2]> {
    let py = residual.py();
    let signatures = array::<f64, Ix2>("signatures", signatures)?;
    let squares = array::<f64, Ix1>("squares", squares)?;
    let residual = array::<f64, Ix1>("residual", residual)?;
    let [unknown, free] = directions([("unknown", unknown), ("free", free)])?;
    same("signatures", squares.len(), signatures.shape()[0])?;
    same("length of unknown", residual.len(), unknown.shape()[1])?;
    if signatures.shape()[1] == 0 || signatures.shape()[1] > residual.len() {
        return Err(invalid("signatures: as many columns as rows at most"));
    }
    let parts = [
        contiguous("unknown", &unknown)?,
        contiguous("free", &free)?,
        contiguous("residual", &residual)?,
    ];
    let seen = Signatures {
        values: contiguous("signatures", &signatures)?,
        narrow: signatures.shape()[1],
        squares: contiguous("squares", &squares)?,
    };
    let (low, high, least, useful, ridge) = limits;
    let limits = Limits {
        content: [low, high],
        least,
        useful,
        ridge,
    };
    let out = py.detach(|| spot_match::standing_out(seen, parts, limits));
    let out = out.ok_or_else(|| invalid("free: directions in proportion"))?;
    Ok(out.map(|values| PyArray1::from_vec(py, values)))
}

/// Arrays of as many columns, which are there.
fn directions<'py, const N: usize>(
    named: [(&'static str, &Any<'py>); N],
) -> PyResult<[PyReadonlyArray2<'py, f64>; N]> {
    let arrays: Vec<_> = named
        .iter()
        .map(|(name, value)| array::<f64, Ix2>(name, value))
        .collect::<PyResult<_>>()?;
    let rows = arrays.first().map_or(0, |first| first.shape()[1]);
    for (found, (name, _)) in arrays.iter().zip(&named) {
        same(&format!("length of {name}"), rows, found.shape()[1])?;
    }
    if rows == 0 {
        return Err(invalid("directions: expected entries"));
    }
    arrays.try_into().map_err(|_| invalid("directions"))
}

/// A matrix by columns as the rows of an array.
fn by_rows(py: Python<'_>, matrix: Matrix<f64>) -> Bound<'_, PyArray2<f64>> {
    let shape = [matrix.width(), matrix.height];
    let out = PyArray2::<f64>::zeros(py, shape, false);
    if let Ok(values) = out.readwrite().as_slice_mut() {
        values.copy_from_slice(&matrix.values);
    }
    out
}

fn spots_of(spots: &Any<'_>) -> PyResult<Vec<Spot>> {
    let spots = array::<f64, Ix2>("spots", spots)?;
    same("columns of spots", PARAMETERS, spots.shape()[1])?;
    let spots = spots.as_array();
    let row = |spot: ndarray::ArrayView1<'_, f64>| std::array::from_fn(|i| spot[i]);
    Ok(spots.outer_iter().map(row).collect())
}

fn grids_of(grids: &Any<'_>) -> PyResult<Vec<Grid>> {
    let grids = array::<f64, Ix2>("grids", grids)?;
    same("columns of grids", 5, grids.shape()[1])?;
    let mut start = 0;
    let mut next = |row: ndarray::ArrayView1<'_, f64>| {
        let grid = Grid {
            origin: [row[0], row[1]],
            step: row[2],
            shape: [row[3] as usize, row[4] as usize],
            start,
        };
        start += grid.shape[0] * grid.shape[1];
        grid
    };
    Ok(grids.as_array().outer_iter().map(&mut next).collect())
}
