//! Touches that are expected, as Python says them.

use numpy::{Ix3, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Any, array, invalid, same};
use crate::spot_fit::{CONTENT, Expected};
use crate::spot_python::spots_of;
use crate::spot_table::Spot;

/// Spots (m, 4), covariances (m, 3, 3), and the logarithm of the volume of a content's prior.
pub(crate) type ExpectedArrays<'py> = (Any<'py>, Any<'py>, f64);

/// Of spots (m, 4), covariances (m, 3, 3) and what contents take up of a volume.
pub(crate) fn expected_of(
    (spots, spreads, content): &ExpectedArrays<'_>,
) -> PyResult<Vec<Expected>> {
    let spots = spots_of(spots)?;
    let spreads = array::<f64, Ix3>("covariances", spreads)?;
    let entries = spots.len() * CONTENT * CONTENT;
    same("entries of covariances", entries, spreads.len())?;
    let spreads = spreads.as_array();
    let one = |(number, &middle): (usize, &Spot)| {
        let spread = std::array::from_fn(|i| std::array::from_fn(|j| spreads[(number, i, j)]));
        Expected::of(middle, &spread, *content).ok_or_else(|| invalid("covariances: not positive"))
    };
    spots.iter().enumerate().map(one).collect()
}
