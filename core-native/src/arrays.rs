//! Arguments from Python as arrays, checked.

use ndarray::Dimension;
use numpy::{Element, Ix1, PyReadonlyArray, dtype};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

pub(crate) type Any<'py> = Bound<'py, PyAny>;

pub(crate) fn invalid(message: impl Into<String>) -> PyErr {
    PyValueError::new_err(message.into())
}

/// An argument as an array of this type and number of axes.
pub(crate) fn array<'py, T: Element, D: Dimension>(
    name: &str,
    value: &Any<'py>,
) -> PyResult<PyReadonlyArray<'py, T, D>> {
    value.extract().map_err(|_| {
        let axes = D::NDIM.unwrap_or(0);
        let kind = dtype::<T>(value.py());
        invalid(format!(
            "{name}: expected an array of {kind} with {axes} axes"
        ))
    })
}

pub(crate) fn contiguous<'a, T: Element, D: Dimension>(
    name: &str,
    value: &'a PyReadonlyArray<'_, T, D>,
) -> PyResult<&'a [T]> {
    value
        .as_slice()
        .map_err(|_| invalid(format!("{name}: expected a C-contiguous array")))
}

pub(crate) fn same(what: &str, expected: usize, got: usize) -> PyResult<()> {
    if expected == got {
        return Ok(());
    }
    Err(invalid(format!("{what}: expected {expected}, got {got}")))
}

pub(crate) fn unsigned(name: &str, value: &Any<'_>) -> PyResult<Vec<u32>> {
    array::<i32, Ix1>(name, value)?
        .as_array()
        .iter()
        .map(|&entry| u32::try_from(entry))
        .collect::<Result<_, _>>()
        .map_err(|_| invalid(format!("{name}: a negative entry")))
}

pub(crate) fn is_complex(value: &Any<'_>) -> bool {
    let name = value.getattr("dtype").and_then(|kind| kind.getattr("kind"));
    name.is_ok_and(|kind| kind.eq("c").unwrap_or(false))
}
