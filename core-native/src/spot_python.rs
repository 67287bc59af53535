//! What Python sees of spots.

use numpy::{
    Ix1, Ix2, Ix3, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1,
    PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods,
};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::{Any, array, contiguous, invalid, same};
use crate::dense::Matrix;
use crate::spot_algebra::Metric;
use crate::spot_fit::{Fit, Frame, Known};
use crate::spot_match::{Limits, Signatures};
use crate::spot_prior::{CONTENT, Expected, Prior, Sheet};
use crate::spot_search::{Policy, Search};
use crate::spot_seen_python::SeenTable;
use crate::spot_table::{DIRECTIONS, Grid, Layout, PARAMETERS, ROWS, Spot, Table};

/// A table of spots, whose values stay Python's, and where they may be.
#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct SpotTable {
    layout: Layout,
    values: Py<PyArray3<f32>>,
    sheet: Sheet,
    prior: Prior,
}

/// Spots, and what they do, by name, as tomoskin.sensing.fit.problem.Fit has them.
#[derive(IntoPyObject)]
struct Fitted<'py> {
    spots: Bound<'py, PyArray2<f64>>,
    each: Bound<'py, PyArray2<f64>>,
    slopes: Bound<'py, PyArray2<f64>>,
    unknown: Bound<'py, PyArray2<f64>>,
    normal: Bound<'py, PyArray2<f64>>,
    change: Bound<'py, PyArray1<f64>>,
    predicted: Bound<'py, PyArray1<f64>>,
    residual: Bound<'py, PyArray1<f64>>,
    gradient: Bound<'py, PyArray1<f64>>,
    misfit: f64,
    log_size: f64,
    cost: f64,
    settled: bool,
    known: Bound<'py, PyTuple>,
}

/// What is likely of a spot, as tomoskin.sensing.fit.spot_fit.SpotPrior has it.
#[derive(FromPyObject)]
struct PriorArrays<'py> {
    middle: Any<'py>,
    weights: Any<'py>,
    log_radii: [f64; 2],
    log_volume: f64,
    log_content: f64,
    directed: f64,
    reshaped: f64,
}

#[pymethods]
impl SpotTable {
    /// `grids` (n, 5): origin, step, shape.
    #[new]
    fn new(
        log_radii: &Any<'_>,
        grids: &Any<'_>,
        nodes: &Any<'_>,
        values: &Any<'_>,
        filling: f64,
        sheet: &Any<'_>,
        prior: PriorArrays<'_>,
    ) -> PyResult<Self> {
        let values = array::<f32, Ix3>("values", values)?;
        let nodes = array::<f64, Ix1>("nodes", nodes)?;
        same(
            "planes of values",
            nodes.shape()[0] + DIRECTIONS,
            values.shape()[1],
        )?;
        let sheet = array::<f64, Ix2>("sheet", sheet)?;
        same("columns of sheet", 3, sheet.shape()[1])?;
        let sheet = sheet.as_array();
        let layout = Layout {
            log_radii: array::<f64, Ix1>("log_radii", log_radii)?
                .as_array()
                .to_vec(),
            grids: grids_of(grids)?,
            nodes: nodes.as_array().to_vec(),
            rank: values.shape()[2],
            filling,
        };
        let count = contiguous("values", &values)?.len();
        if sheet.is_empty() {
            return Err(invalid("sheet: a cell at least"));
        }
        Ok(Self {
            layout: layout.checked(count).map_err(invalid)?,
            values: (*values).clone().unbind(),
            sheet: Sheet::of(
                sheet
                    .outer_iter()
                    .map(|row| [row[0], row[1], row[2]])
                    .collect(),
            ),
            prior: Prior {
                middle: columns_of("middle", &prior.middle)?,
                weight: columns_of("weights", &prior.weights)?,
                log_radii: prior.log_radii,
                filling,
                log_volume: prior.log_volume,
                log_content: prior.log_content,
                directed: prior.directed,
                reshaped: prior.reshaped,
            },
        })
    }

    /// (k, ROWS, rank) of spots (k, 4).
    fn expanded<'py>(&self, spots: &Any<'py>) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (py, spots, rank) = (spots.py(), spots_of(spots)?, self.layout.rank);
        let values = self.values.bind(py).try_readonly()?;
        let table = self.table(&values)?;
        let size = ROWS * rank;
        let out = PyArray3::<f64>::zeros(py, [spots.len(), ROWS, rank], false);
        {
            let mut writable = out.readwrite();
            let parts = writable.as_slice_mut()?.chunks_exact_mut(size.max(1));
            for (spot, part) in spots.iter().zip(parts) {
                table.expand(spot, ROWS, part);
            }
        }
        Ok(out)
    }

    /// The minimum near `spots` (k, 4), after at most so many steps; none: at the spots. `known`
    /// (k) which of the expected touches each is, or None.
    fn settled<'py>(
        &self,
        seen: &SeenTable,
        frame: FrameArrays<'py>,
        offset: &Any<'py>,
        spots: &Any<'py>,
        known: Vec<Known>,
        most: usize,
    ) -> PyResult<Fitted<'py>> {
        let (py, spots) = (offset.py(), spots_of(spots)?);
        let arrays = Arrays::of(self, seen, &frame, offset)?;
        same("length of known", spots.len(), known.len())?;
        if known
            .iter()
            .flatten()
            .any(|&number| number >= arrays.expected.len())
        {
            return Err(invalid("known: numbers of expected touches, or None"));
        }
        let frame = arrays.frame(self, seen, &frame)?;
        let fit = py.detach(|| frame.settled(&spots, &known, most));
        let fit = fit.ok_or_else(|| invalid("spots: not comparable with the data"))?;
        fitted(py, fit)
    }

    /// Touches of a frame that before held `spots` (k, 4); `candidates` of content 1.
    #[expect(clippy::too_many_arguments, reason = "a search has as many parts")]
    fn searched<'py>(
        &self,
        seen: &SeenTable,
        frame: FrameArrays<'py>,
        offset: &Any<'py>,
        spots: &Any<'py>,
        candidates: CandidateArrays<'py>,
        limits: Limits,
        policy: Policy,
    ) -> PyResult<Searched<'py>> {
        let (py, spots) = (offset.py(), spots_of(spots)?);
        let arrays = Arrays::of(self, seen, &frame, offset)?;
        let frame = arrays.frame(self, seen, &frame)?;
        let places = array::<f64, Ix2>("candidates", &candidates.spots)?;
        let signatures = array::<f64, Ix2>("signatures", &candidates.signatures)?;
        let squares = array::<f64, Ix1>("squares", &candidates.squares)?;
        same("columns of candidates", PARAMETERS, places.shape()[1])?;
        same("candidates", squares.len(), places.shape()[0])?;
        let nothing = vec![0.0; seen.seen.rows];
        let bare = Frame {
            offset: &nothing,
            ..frame
        };
        let left = Matrix {
            values: frame.left.to_vec(),
            height: seen.seen.rows,
        };
        let left = Metric::of(left).ok_or_else(|| invalid("left: expected finite directions"))?;
        let search = Search {
            frames: [frame, bare],
            left: &left,
            candidates: contiguous("candidates", &places)?.as_chunks().0,
            signatures: signatures_of(&signatures, &squares, seen.seen.rows)?,
            limits,
            policy,
        };
        let found = py.detach(|| search.found(&spots));
        let found = found.ok_or_else(|| invalid("spots: not comparable with the data"))?;
        let others = found.others;
        let others = others.map(|both| both.map(|values| PyArray1::from_vec(py, values)));
        let turned_down = found.turned_down.map(|fit| fitted(py, fit)).transpose()?;
        Ok((fitted(py, found.fit)?, found.bare, others, turned_down))
    }
}

impl SpotTable {
    fn table<'a>(&'a self, values: &'a PyReadonlyArray3<'_, f32>) -> PyResult<Table<'a>> {
        Ok(Table {
            layout: &self.layout,
            values: contiguous("values", values)?,
        })
    }
}

/// A fit, whether it is without the frame's offset, candidates beside it, and one spot more.
type Searched<'py> = (Fitted<'py>, bool, Option<Others<'py>>, Option<Fitted<'py>>);

/// Likelihood ratios and contents of candidates.
type Others<'py> = [Bound<'py, PyArray1<f64>>; 2];

/// Candidates, as tomoskin.sensing.fit.candidates.Matched has them.
#[derive(FromPyObject)]
struct CandidateArrays<'py> {
    spots: Any<'py>,
    signatures: Any<'py>,
    squares: Any<'py>,
}

/// Whitened data of a frame, as tomoskin.sensing.fit.problem.Problem has them; see `Frame`.
#[derive(FromPyObject)]
struct FrameArrays<'py> {
    data: Any<'py>,
    rest: f64,
    left: Any<'py>,
    reach: f64,
    grows: f64,
    depths: [f64; 2],
    expected: ExpectedArrays<'py>,
}

/// Touches that are expected, as tomoskin.sensing.fit.expectation.Expectation has them.
#[derive(FromPyObject)]
struct ExpectedArrays<'py> {
    spots: Any<'py>,
    covariances: Any<'py>,
}

impl ExpectedArrays<'_> {
    /// Of spots (m, 4), covariances (m, 3, 3), and what contents take up of a volume.
    fn expected(&self, content: f64) -> PyResult<Vec<Expected>> {
        let spots = spots_of(&self.spots)?;
        let spreads = array::<f64, Ix3>("covariances", &self.covariances)?;
        let entries = spots.len() * CONTENT * CONTENT;
        same("entries of covariances", entries, spreads.len())?;
        let spreads = spreads.as_array();
        let one = |(number, &middle): (usize, &Spot)| {
            let spread = std::array::from_fn(|i| std::array::from_fn(|j| spreads[(number, i, j)]));
            let expected = Expected::of(middle, &spread, content);
            expected.ok_or_else(|| invalid("covariances: not positive"))
        };
        spots.iter().enumerate().map(one).collect()
    }
}

/// A frame's arrays, checked.
struct Arrays<'py> {
    data: PyReadonlyArray1<'py, f64>,
    left: PyReadonlyArray2<'py, f64>,
    offset: Vec<f64>,
    values: PyReadonlyArray3<'py, f32>,
    expected: Vec<Expected>,
}

impl<'py> Arrays<'py> {
    fn of(
        table: &SpotTable,
        seen: &SeenTable,
        frame: &FrameArrays<'py>,
        offset: &Any<'py>,
    ) -> PyResult<Self> {
        let data = array::<f64, Ix1>("data", &frame.data)?;
        let left = array::<f64, Ix2>("left", &frame.left)?;
        let offset = array::<f64, Ix1>("offset", offset)?;
        same("length of data", seen.seen.rows, data.len())?;
        same("columns of left", seen.seen.rows, left.shape()[1])?;
        same("length of offset", table.layout.rank, offset.len())?;
        same(
            "entries of the table seen",
            table.layout.rank * seen.seen.rows,
            seen.seen.timed.len(),
        )?;
        let values = table.values.bind(data.py()).try_readonly()?;
        Ok(Self {
            data,
            left,
            offset: seen.seen.whitened(contiguous("offset", &offset)?).values,
            values,
            expected: frame.expected.expected(table.prior.log_content)?,
        })
    }

    fn frame<'a>(
        &'a self,
        table: &'a SpotTable,
        seen: &'a SeenTable,
        frame: &FrameArrays<'py>,
    ) -> PyResult<Frame<'a>> {
        Ok(Frame {
            table: table.table(&self.values)?,
            seen: &seen.seen,
            sheet: &table.sheet,
            prior: &table.prior,
            data: contiguous("data", &self.data)?,
            rest: frame.rest,
            left: contiguous("left", &self.left)?,
            offset: &self.offset,
            reach: frame.reach,
            grows: frame.grows,
            depths: frame.depths,
            expected: &self.expected,
        })
    }
}

fn fitted(py: Python<'_>, fit: Fit) -> PyResult<Fitted<'_>> {
    let spots = Matrix {
        values: fit.spots.concat(),
        height: PARAMETERS,
    };
    Ok(Fitted {
        spots: by_rows(py, spots),
        each: by_rows(py, fit.each),
        slopes: by_rows(py, fit.jacobian),
        unknown: by_rows(py, fit.metric.unknown),
        normal: by_rows(py, fit.normal),
        change: PyArray1::from_vec(py, fit.change),
        predicted: PyArray1::from_vec(py, fit.predicted),
        residual: PyArray1::from_vec(py, fit.residual),
        gradient: PyArray1::from_vec(py, fit.gradient),
        misfit: fit.misfit,
        log_size: fit.metric.log_size,
        cost: fit.cost,
        settled: fit.settled,
        known: PyTuple::new(py, fit.known)?,
    })
}

/// One number for each column of a spot.
fn columns_of(name: &str, value: &Any<'_>) -> PyResult<Spot> {
    let value = array::<f64, Ix1>(name, value)?;
    same(name, PARAMETERS, value.len())?;
    Ok(std::array::from_fn(|i| value.as_array()[i]))
}

pub(crate) fn signatures_of<'a>(
    signatures: &'a PyReadonlyArray2<'_, f64>,
    squares: &'a PyReadonlyArray1<'_, f64>,
    rows: usize,
) -> PyResult<Signatures<'a>> {
    same("signatures", squares.len(), signatures.shape()[0])?;
    if signatures.shape()[1] == 0 || signatures.shape()[1] > rows {
        return Err(invalid("signatures: as many columns as rows at most"));
    }
    Ok(Signatures {
        values: contiguous("signatures", signatures)?,
        narrow: signatures.shape()[1],
        squares: contiguous("squares", squares)?,
    })
}

/// Arrays of as many columns, which are there.
pub(crate) fn directions<'py, const N: usize>(
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
pub(crate) fn by_rows(py: Python<'_>, matrix: Matrix<f64>) -> Bound<'_, PyArray2<f64>> {
    let shape = [matrix.width(), matrix.height];
    let out = PyArray2::<f64>::zeros(py, shape, false);
    if let Ok(values) = out.readwrite().as_slice_mut() {
        values.copy_from_slice(&matrix.values);
    }
    out
}

pub(crate) fn spots_of(spots: &Any<'_>) -> PyResult<Vec<Spot>> {
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
