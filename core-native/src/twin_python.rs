//! What Python sees of a sheet under load: dents, conduction, and resistance between terminals.

use std::sync::Arc;

use numpy::{
    Ix1, Ix2, Ix3, IxDyn, PyArray1, PyArray2, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArrayMethods,
};
use pulp::Arch;
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same, unsigned};
use crate::circuit::{Circuit, Converter};
use crate::conduction::{self, GROUPS, LOADS, Load, Material, Memory};
use crate::dent::{self, Dent, PARTS};
use crate::python::pairs;
use crate::symbolic::Symbolic;
use crate::terminals;

#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct Terminals(terminals::Terminals);

#[pymethods]
impl Terminals {
    #[new]
    fn new(
        indptr: &Any<'_>,
        indices: &Any<'_>,
        contacts: &Any<'_>,
        position: &Any<'_>,
        forms: &Any<'_>,
        axes: usize,
        last: &Any<'_>,
    ) -> PyResult<Self> {
        let (starts, rows) = (unsigned("indptr", indptr)?, unsigned("indices", indices)?);
        let last = unsigned("last", last)?;
        let contacts = array::<f64, Ix1>("contacts", contacts)?;
        let position = array::<i32, Ix3>("position", position)?;
        let forms = array::<f64, Ix3>("forms", forms)?;
        let [count, nodes, other] = [0, 1, 2].map(|axis| position.shape()[axis]);
        same("columns of position", nodes, other)?;
        same("cells of forms", count, forms.shape()[2])?;
        let cells = terminals::Cells {
            forms: contiguous("forms", &forms)?.to_vec(),
            axes,
            count,
            nodes,
            position: position.as_array().iter().map(|&at| at as u32).collect(),
        };
        let symbolic = Symbolic::ending(starts.len().saturating_sub(1), &starts, &rows, &last);
        let others = contiguous("contacts", &contacts)?;
        symbolic
            .and_then(|symbolic| {
                terminals::Terminals::new(Arc::new(symbolic), cells, others, &last)
            })
            .map(Self)
            .map_err(invalid)
    }

    fn resistance<'py>(&self, conductivity: &Any<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let py = conductivity.py();
        let conductivity = array::<f64, Ix3>("conductivity", conductivity)?;
        let conductivity = contiguous("conductivity", &conductivity)?;
        let out = PyArray2::<f64>::zeros(py, [self.0.count() + 1; 2], false);
        {
            let mut writable = out.readwrite();
            let values = writable.as_slice_mut()?;
            py.detach(|| self.0.resistance(Arch::new(), conductivity, values))
                .map_err(invalid)?;
        }
        Ok(out)
    }
}

/// A table (n·n, 4), its n, step and reach, and place, cosine and sine of the turn of its probe.
type Placed<'py> = (Any<'py>, (usize, f64, f64), [f64; 4]);

/// Strain xx, yy, xy, and depth (4, m) of all dents together at points x, y (m,).
#[pyfunction]
pub(crate) fn dented<'py>(
    x: &Any<'py>,
    y: &Any<'py>,
    dents: Vec<Placed<'py>>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let py = x.py();
    let (x, y) = (array::<f64, Ix1>("x", x)?, array::<f64, Ix1>("y", y)?);
    same("length of y", x.len(), y.len())?;
    let (x, y) = (contiguous("x", &x)?, contiguous("y", &y)?);
    let tables: Vec<_> = dents
        .iter()
        .map(|(table, ..)| array::<f64, Ix2>("table", table))
        .collect::<PyResult<_>>()?;
    let mut placed = Vec::with_capacity(dents.len());
    for (table, &(_, (nodes, step, reach), [px, py, cosine, sine])) in tables.iter().zip(&dents) {
        same("values of table", PARTS * nodes * nodes, table.len())?;
        if nodes < 2 || step <= 0.0 || reach > step * (nodes / 2) as f64 {
            return Err(invalid("dents: expected a reach within two nodes or more"));
        }
        placed.push(Dent {
            table: contiguous("table", table)?,
            nodes,
            step,
            reach,
            place: [px, py],
            turn: [cosine, sine],
        });
    }
    // SAFETY: `add` writes all of it.
    let felt = unsafe { PyArray2::<f64>::new(py, [PARTS, x.len()], false) };
    dent::add(&placed, x, y, felt.readwrite().as_slice_mut()?);
    Ok(felt)
}

/// Conductivity of cells (1, n), or xx, xy, yx, yy (4, n) where directions differ, after a step under
/// a load.
///
/// `cells`: the load, the one before, conductivity without load; `memory`: lagging, late and broken
/// parts, and wear (or nothing), which are written over; `series`: parts and half widths of plays,
/// parts of creep and of breakdown with what they keep; `numbers`: thickness, gauge, across,
/// compression, wear, heat, most compression, most logarithm.
#[pyfunction]
pub(crate) fn conducted<'py>(
    cells: [Any<'py>; 3],
    memory: [Bound<'py, PyArrayDyn<f64>>; 4],
    series: [Vec<(f64, f64)>; 3],
    numbers: [f64; 8],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let py = cells[0].py();
    let n = array::<f64, Ix1>("unloaded", &cells[2])?.len();
    let names = ["load", "load before", "unloaded"];
    let cells = flat(names, &cells, [LOADS * n, LOADS * n, n])?;
    let [play, creep, breakdown] = &series;
    let worn = if memory[3].is_empty() { 0 } else { n };
    let sizes = [
        play.len() * LOADS * n,
        creep.len() * LOADS * n,
        breakdown.len() * GROUPS * n,
        worn,
    ];
    for ((name, part), size) in ["lagging", "late", "broken", "worn"]
        .iter()
        .zip(&memory)
        .zip(sizes)
    {
        same(name, size, part.len())?;
    }
    let [
        thickness,
        gauge,
        gauge_across,
        compression,
        wear,
        heat,
        most_compression,
        most_log,
    ] = numbers;
    let material = Material {
        play,
        creep,
        breakdown,
        thickness,
        gauge,
        gauge_across,
        compression,
        wear,
        heat,
        most_compression,
        most_log,
    };
    let load = Load {
        now: cells[0].as_slice()?,
        last: cells[1].as_slice()?,
    };
    let rows = if gauge_across == 0.0 { 1 } else { LOADS };
    // SAFETY: `advance` writes all of it.
    let out = unsafe { PyArray2::<f64>::new(py, [rows, n], false) };
    let [a, b, c, d] = memory.each_ref().map(|part| part.try_readwrite());
    let (mut a, mut b, mut c, mut d) = (a?, b?, c?, d?);
    {
        let memory = Memory {
            lagging: a.as_slice_mut()?,
            late: b.as_slice_mut()?,
            broken: c.as_slice_mut()?,
            worn: d.as_slice_mut()?,
        };
        let mut out = out.readwrite();
        let out = out.as_slice_mut()?;
        conduction::advance(material, load, memory, cells[2].as_slice()?, out);
    }
    Ok(out)
}

/// What the amplifiers see (n_drives, n) of a sheet with that resistance (n, n), with nothing broken.
///
/// `contact` (n,): what each contact has more; `numbers`: current, resistance and compliance of its
/// source, resistance of a switch, part of the common mode, part of a neighbour.
#[pyfunction]
pub(crate) fn lines<'py>(
    resistance: &Any<'py>,
    drives: &Any<'py>,
    contact: &Any<'py>,
    numbers: [f64; 6],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let py = resistance.py();
    let resistance = array::<f64, Ix2>("resistance", resistance)?;
    let contact = array::<f64, Ix1>("contact", contact)?;
    let drives = pairs("drives", drives)?;
    let n = contact.len();
    same("rows of resistance", n, resistance.shape()[0])?;
    same("columns of resistance", n, resistance.shape()[1])?;
    if drives.iter().flatten().any(|&electrode| electrode >= n) {
        return Err(invalid("drives: an electrode that is not there"));
    }
    let resistance = contiguous("resistance", &resistance)?;
    let contact = contiguous("contact", &contact)?;
    let [current, output, compliance, switch, common, neighbour] = numbers;
    let circuit = Circuit {
        current,
        output,
        compliance,
        switch,
        common,
        neighbour,
    };
    // SAFETY: `read` writes all of it.
    let out = unsafe { PyArray2::<f64>::new(py, [drives.len(), n], false) };
    circuit.read(
        resistance,
        contact,
        &drives,
        out.readwrite().as_slice_mut()?,
    );
    Ok(out)
}

/// Summed codes (m,) of potentials (m,), and others (m,) times (k, m), with standard normal numbers
/// (k, m).
///
/// `numbers`: gain, offset, low and high rail, codes per volt, number of codes, bow, noise.
#[pyfunction]
pub(crate) fn converted<'py>(
    volts: &Any<'py>,
    moving: Vec<(Any<'py>, Any<'py>)>,
    chance: &Any<'py>,
    numbers: [f64; 8],
) -> PyResult<Bound<'py, PyArray1<u16>>> {
    let py = volts.py();
    let (volts, chance) = (
        array::<f64, Ix1>("volts", volts)?,
        array::<f64, Ix2>("chance", chance)?,
    );
    let n = chance.shape()[1];
    same("number of volts", n, volts.len())?;
    let mut courses = Vec::with_capacity(moving.len());
    for (size, course) in &moving {
        let (size, course) = (
            array::<f64, Ix1>("size", size)?,
            array::<f64, Ix2>("course", course)?,
        );
        same("length of size", n, size.len())?;
        same("number of courses", chance.len(), course.len())?;
        courses.push((size, course));
    }
    let mut moving = Vec::with_capacity(courses.len());
    for (size, course) in &courses {
        moving.push([contiguous("size", size)?, contiguous("course", course)?]);
    }
    let [gain, offset, low, high, scale, levels, bow, noise] = numbers;
    let converter = Converter {
        gain,
        offset,
        rails: [low, high],
        scale,
        levels,
        bow,
        noise,
    };
    let out = PyArray1::<u16>::zeros(py, n, false);
    if n > 0 {
        let (volts, chance) = (contiguous("volts", &volts)?, contiguous("chance", &chance)?);
        converter.sums(volts, &moving, chance, out.readwrite().as_slice_mut()?);
    }
    Ok(out)
}

/// Arrays of these sizes.
fn flat<'py, const N: usize>(
    names: [&str; N],
    values: &[Any<'py>; N],
    sizes: [usize; N],
) -> PyResult<Vec<PyReadonlyArrayDyn<'py, f64>>> {
    let mut out = Vec::with_capacity(N);
    for ((name, value), size) in names.into_iter().zip(values).zip(sizes) {
        let value = array::<f64, IxDyn>(name, value)?;
        same(name, size, value.len())?;
        contiguous(name, &value)?;
        out.push(value);
    }
    Ok(out)
}
