//! What Python sees of the local update.

use std::sync::{Mutex, PoisonError, RwLock};

use numpy::{
    Element, Ix1, Ix2, Ix3, PyArray1, PyArray3, PyArray4, PyArrayMethods, PyUntypedArrayMethods,
};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, is_complex, same};
use crate::patch::{Base, Cells, Changed, Lift, Refusal, Shape, Touch, Workspace};
use crate::scalar::{Scalar, c64};
use crate::threads::{self, Shared, split};

/// Fewer touches than this are not worth a thread.
const GRAIN: usize = 8;

#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct Patches {
    cells: Cells,
    base: Number,
    real: Mutex<Vec<Workspace<f64>>>,
    complex: Mutex<Vec<Workspace<c64>>>,
}

enum Number {
    Real(RwLock<Base<f64>>),
    Complex(RwLock<Base<c64>>),
}

/// Transfer resistances, what rounding may have shifted them by, and nodes that are needed first.
type Results<'py> = (Any<'py>, Any<'py>, Bound<'py, PyArray1<i64>>);

#[pymethods]
impl Patches {
    #[new]
    fn new(
        cells: &Any<'_>,
        local: &Any<'_>,
        held: &Any<'_>,
        conductivity: &Any<'_>,
        fields: &Any<'_>,
        grounded: &Any<'_>,
    ) -> PyResult<Self> {
        let nodes = array::<i64, Ix2>("cells", cells)?;
        let matrices = array::<f64, Ix3>("local", local)?;
        let held = array::<bool, Ix1>("held", held)?;
        let n_cells = nodes.shape()[0];
        same("cells of local", n_cells, matrices.shape()[0])?;
        let numbered: Result<_, _> = nodes.as_array().iter().map(|&n| u32::try_from(n)).collect();
        let cells = Cells::new(
            numbered.map_err(|_| invalid("cells: a node that is not there"))?,
            nodes.shape()[1],
            matrices.as_array().iter().copied().collect(),
            contiguous("held", &held)?,
        )
        .map_err(invalid)?;
        let state = (conductivity, fields, grounded);
        Ok(Self {
            base: if is_complex(fields) {
                Number::Complex(base(&cells, state)?)
            } else {
                Number::Real(base(&cells, state)?)
            },
            cells,
            real: Mutex::default(),
            complex: Mutex::default(),
        })
    }

    fn keep(&self, nodes: &Any<'_>, columns: &Any<'_>) -> PyResult<()> {
        match &self.base {
            Number::Real(base) => keep(base, nodes, columns),
            Number::Complex(base) => keep(base, nodes, columns),
        }
    }

    fn forget(&self) {
        match &self.base {
            Number::Real(base) => forget(base),
            Number::Complex(base) => forget(base),
        }
    }

    #[pyo3(signature = (starts, cells, conductivity, threads=None))]
    fn change<'py>(
        &self,
        starts: &Any<'py>,
        cells: &Any<'py>,
        conductivity: &Any<'py>,
        threads: Option<usize>,
    ) -> PyResult<Results<'py>> {
        let touches = (starts, cells, conductivity);
        let threads = threads::count(threads);
        match (&self.base, is_complex(conductivity)) {
            (Number::Real(base), false) => {
                change::<f64, f64>(&self.cells, base, &self.real, touches, threads)
            }
            (Number::Real(base), true) => {
                change::<f64, c64>(&self.cells, base, &self.complex, touches, threads)
            }
            (Number::Complex(base), true) => {
                change::<c64, c64>(&self.cells, base, &self.complex, touches, threads)
            }
            (Number::Complex(_), false) => Err(invalid("conductivity: expected complex128")),
        }
    }

    #[pyo3(signature = (starts, cells, height, depths, threads=None))]
    fn scaled<'py>(
        &self,
        starts: &Any<'py>,
        cells: &Any<'py>,
        height: &Any<'py>,
        depths: &Any<'py>,
        threads: Option<usize>,
    ) -> PyResult<(Any<'py>, Bound<'py, PyArray1<i64>>)> {
        let Number::Real(base) = &self.base else {
            return Err(invalid("expected a real state"));
        };
        let depths = array::<f64, Ix1>("depths", depths)?;
        let depths = contiguous("depths", &depths)?;
        let (shapes, threads) = ((starts, cells, height), threads::count(threads));
        match depths.len() {
            0 | 1 => scaled::<2>(&self.cells, base, shapes, depths, threads),
            2 | 3 => scaled::<4>(&self.cells, base, shapes, depths, threads),
            4..8 => scaled::<8>(&self.cells, base, shapes, depths, threads),
            _ => Err(invalid("depths: expected at most 7")),
        }
    }
}

/// Changes by touches, one after the other, in several depths, with `L` conductivities abreast.
fn scaled<'py, const L: usize>(
    mesh: &Cells,
    base: &RwLock<Base<f64>>,
    (starts, cells, height): (&Any<'py>, &Any<'py>, &Any<'py>),
    depths: &[f64],
    threads: usize,
) -> PyResult<(Any<'py>, Bound<'py, PyArray1<i64>>)> {
    let py = starts.py();
    let starts = array::<i64, Ix1>("starts", starts)?;
    let cells = array::<i64, Ix1>("cells", cells)?;
    let height = array::<f64, Ix1>("height", height)?;
    let (starts, cells) = (contiguous("starts", &starts)?, contiguous("cells", &cells)?);
    let height = contiguous("height", &height)?;
    check_starts(starts, cells.len())?;
    same("length of height", cells.len(), height.len())?;

    let count = starts.len() - 1;
    let width = base.read().unwrap_or_else(PoisonError::into_inner).width;
    let less = PyArray4::<f64>::zeros(py, [count, depths.len(), width, width], false);
    let result = {
        let mut less = less.readwrite();
        let out = Shared::new(less.as_slice_mut()?);
        let size = depths.len() * width * width;
        let work = |touches, refused: &Mutex<Refused>| {
            let base = base.read().unwrap_or_else(PoisonError::into_inner);
            let mut workspace = Workspace::<f64, L>::new(mesh);
            for number in touches {
                let within = starts[number] as usize..starts[number + 1] as usize;
                let shape = Shape {
                    cells: &cells[within.clone()],
                    height: &height[within],
                    depths,
                };
                // SAFETY: each touch has a place of its own.
                let out = unsafe { out.part(number * size..(number + 1) * size) };
                if let Err(refusal) = workspace.scaled(mesh, &base, shape, out) {
                    refused
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .note(number, refusal);
                }
            }
        };
        py.detach(|| {
            let refused = Mutex::default();
            split(count, GRAIN, threads, |touches| work(touches, &refused));
            refused.into_inner().unwrap_or_else(PoisonError::into_inner)
        })
    };
    Ok((less.into_any(), result.missing(py)?))
}

fn check_starts(starts: &[i64], n_cells: usize) -> PyResult<()> {
    let ends = (starts.first(), starts.last());
    let ascending = starts.windows(2).all(|ends| ends[0] <= ends[1]);
    if !ascending || ends != (Some(&0), Some(&(n_cells as i64))) {
        return Err(invalid(
            "starts: expected ascending entries from 0 to the number of cells",
        ));
    }
    Ok(())
}

fn base<T: Scalar + Element>(
    cells: &Cells,
    (conductivity, fields, grounded): (&Any<'_>, &Any<'_>, &Any<'_>),
) -> PyResult<RwLock<Base<T>>> {
    let conductivity = array::<T, Ix1>("conductivity", conductivity)?;
    let fields = array::<T, Ix2>("fields", fields)?;
    let grounded = array::<T, Ix2>("grounded", grounded)?;
    let width = fields.shape()[1];
    same("length of conductivity", cells.len(), conductivity.len())?;
    same("rows of fields", cells.n_nodes(), fields.shape()[0])?;
    same("rows of grounded", width, grounded.shape()[0])?;
    same("columns of grounded", width, grounded.shape()[1])?;
    Ok(RwLock::new(Base {
        conductivity: conductivity.as_array().iter().copied().collect(),
        fields: fields.as_array().iter().copied().collect(),
        width,
        grounded: grounded.as_array().iter().copied().collect(),
        columns: vec![None; cells.n_nodes()],
    }))
}

fn keep<T: Scalar + Element>(
    base: &RwLock<Base<T>>,
    nodes: &Any<'_>,
    columns: &Any<'_>,
) -> PyResult<()> {
    let nodes = array::<i64, Ix1>("nodes", nodes)?;
    let columns = array::<T, Ix2>("columns", columns)?;
    let mut base = base.write().unwrap_or_else(PoisonError::into_inner);
    same("columns", nodes.len(), columns.shape()[1])?;
    same("rows of columns", base.columns.len(), columns.shape()[0])?;
    let columns = columns.as_array();
    for (&node, column) in nodes.as_array().iter().zip(columns.columns()) {
        let place = usize::try_from(node)
            .ok()
            .and_then(|node| base.columns.get_mut(node));
        *place.ok_or_else(|| invalid("nodes: a node that is not there"))? =
            Some(column.iter().copied().collect());
    }
    Ok(())
}

fn forget<T: Scalar>(base: &RwLock<Base<T>>) {
    let mut base = base.write().unwrap_or_else(PoisonError::into_inner);
    base.columns.fill(None);
}

fn change<'py, B: Lift<T>, T: Scalar + Element>(
    mesh: &Cells,
    base: &RwLock<Base<B>>,
    spare: &Mutex<Vec<Workspace<T>>>,
    (starts, cells, conductivity): (&Any<'py>, &Any<'py>, &Any<'py>),
    threads: usize,
) -> PyResult<Results<'py>> {
    let py = starts.py();
    let starts = array::<i64, Ix1>("starts", starts)?;
    let cells = array::<i64, Ix1>("cells", cells)?;
    let conductivity = array::<T, Ix1>("conductivity", conductivity)?;
    let (starts, cells) = (contiguous("starts", &starts)?, contiguous("cells", &cells)?);
    let conductivity = contiguous("conductivity", &conductivity)?;
    check_starts(starts, cells.len())?;
    same("length of conductivity", cells.len(), conductivity.len())?;

    let count = starts.len() - 1;
    let width = base.read().unwrap_or_else(PoisonError::into_inner).width;
    let shape = [count, width, width];
    let grounded = PyArray3::<T>::zeros(py, shape, false);
    let lost = PyArray3::<T>::zeros(py, shape, false);
    let result = {
        let (mut grounded, mut lost) = (grounded.readwrite(), lost.readwrite());
        let out = (
            Shared::new(grounded.as_slice_mut()?),
            Shared::new(lost.as_slice_mut()?),
        );
        let work = |touches, refused: &Mutex<Refused>| {
            let base = base.read().unwrap_or_else(PoisonError::into_inner);
            let mut workspace = taken(spare).unwrap_or_else(|| Workspace::new(mesh));
            for number in touches {
                let within = starts[number] as usize..starts[number + 1] as usize;
                let touch = Touch {
                    cells: &cells[within.clone()],
                    conductivity: &conductivity[within],
                };
                let place = number * width * width..(number + 1) * width * width;
                // SAFETY: each touch has a place of its own.
                let (grounded, lost) = unsafe { (out.0.part(place.clone()), out.1.part(place)) };
                let done = workspace.update(mesh, &base, touch, Changed { grounded, lost });
                if let Err(refusal) = done {
                    refused
                        .lock()
                        .unwrap_or_else(PoisonError::into_inner)
                        .note(number, refusal);
                }
            }
            spare
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(workspace);
        };
        py.detach(|| {
            let refused = Mutex::default();
            split(count, GRAIN, threads, |touches| work(touches, &refused));
            refused.into_inner().unwrap_or_else(PoisonError::into_inner)
        })
    };
    Ok((grounded.into_any(), lost.into_any(), result.missing(py)?))
}

fn taken<T>(spare: &Mutex<Vec<T>>) -> Option<T> {
    spare.lock().unwrap_or_else(PoisonError::into_inner).pop()
}

/// What went wrong, in all touches.
#[derive(Default)]
struct Refused {
    first: Option<(usize, &'static str)>,
    missing: Vec<i64>,
}

impl Refused {
    /// Nodes that are needed first; what went wrong as an error.
    fn missing(self, py: Python<'_>) -> PyResult<Bound<'_, PyArray1<i64>>> {
        if let Some((number, why)) = self.first {
            return Err(invalid(format!("touch {number}: {why}")));
        }
        let mut missing = self.missing;
        missing.sort_unstable();
        missing.dedup();
        Ok(PyArray1::from_vec(py, missing))
    }

    fn note(&mut self, number: usize, refusal: Refusal) {
        let why = match refusal {
            Refusal::Missing(nodes) => {
                return self.missing.extend(nodes.into_iter().map(i64::from));
            }
            Refusal::Impossible => "a cell or conductivity that cannot be",
            Refusal::Singular => "the system is singular",
        };
        if self.first.is_none_or(|(first, _)| number < first) {
            self.first = Some((number, why));
        }
    }
}
