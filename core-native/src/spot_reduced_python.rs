//! What Python sees of what stands for the exact model.

use numpy::{Ix1, Ix2, Ix3, PyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::arrays::{Any, array, contiguous, invalid, same};
use crate::spot_python::{by_rows, spots_of};
use crate::spot_reduced::{Certificate, Interaction, Profile};

/// What stands for the exact model on a sheet.
#[pyclass(frozen, module = "tomoskin_core")]
pub(crate) struct Reduced {
    interaction: Interaction,
    certificate: Certificate,
}

/// As tomoskin.sensing.fit.certificate.Interaction has it.
#[derive(FromPyObject)]
struct InteractionArrays<'py> {
    centres: Any<'py>,
    spread: f64,
    fields: Any<'py>,
    between: Any<'py>,
}

/// As tomoskin.sensing.fit.certificate.Certificate has it.
#[derive(FromPyObject)]
struct CertificateArrays<'py> {
    like: Any<'py>,
    parts: Any<'py>,
    margin: f64,
    moved: f64,
}

#[pymethods]
impl Reduced {
    /// `profile`: reach, filling, scales, and of the bell narrow, height and part; `rim`: points,
    /// and a median `radius`; `neighbours` that tell of a spot.
    #[new]
    fn new(
        profile: [f64; 6],
        interaction: InteractionArrays<'_>,
        certificate: CertificateArrays<'_>,
        rim: &Any<'_>,
        radius: f64,
        neighbours: usize,
    ) -> PyResult<Self> {
        let fields = array::<f32, Ix3>("fields", &interaction.fields)?;
        let between = array::<f32, Ix2>("between", &interaction.between)?;
        let centres = points_of("centres", &interaction.centres)?;
        let all = 2 * centres.len();
        same("patches of fields", centres.len(), fields.shape()[0])?;
        same("axes of fields", 2, fields.shape()[1])?;
        same("rows of between", all, between.shape()[0])?;
        same("columns of between", all, between.shape()[1])?;
        let (like, rim) = (
            points_of("like", &certificate.like)?,
            points_of("rim", rim)?,
        );
        let parts = array::<f64, Ix1>("parts", &certificate.parts)?;
        same("parts", like.len(), parts.len())?;
        if all == 0 || like.is_empty() || neighbours == 0 {
            return Err(invalid("patches, spots and neighbours: one at least"));
        }
        let [reach, filling, scales, narrow, height, part] = profile;
        Ok(Self {
            interaction: Interaction {
                profile: Profile {
                    reach,
                    filling,
                    scales,
                    bell: [narrow, height, part],
                },
                centres,
                spread: interaction.spread,
                fields: contiguous("fields", &fields)?.to_vec(),
                between: contiguous("between", &between)?.to_vec(),
            },
            certificate: Certificate {
                like,
                squares: parts.as_array().iter().map(|part| part * part).collect(),
                neighbours,
                margin: certificate.margin,
                moved: certificate.moved,
                rim,
                radius,
            },
        })
    }

    /// What the table lacks of each of `spots` (k, 4) alone, at the most, in the measure of the
    /// `sizes` (k) of what they change; and the change (n, n) of the transfer resistance by all of
    /// them beyond that by each alone.
    fn lacking<'py>(
        &self,
        spots: &Any<'py>,
        sizes: &Any<'py>,
    ) -> PyResult<(f64, Bound<'py, PyArray2<f64>>)> {
        let (py, spots) = (sizes.py(), spots_of(spots)?);
        let sizes = array::<f64, Ix1>("sizes", sizes)?;
        same("sizes", spots.len(), sizes.len())?;
        let error = self.certificate.error(&spots, contiguous("sizes", &sizes)?);
        Ok((error, by_rows(py, self.interaction.change(&spots))))
    }
}

fn points_of(name: &'static str, points: &Any<'_>) -> PyResult<Vec<[f64; 2]>> {
    let points = array::<f64, Ix2>(name, points)?;
    same(&format!("columns of {name}"), 2, points.shape()[1])?;
    let rows = points.as_array();
    Ok(rows.outer_iter().map(|row| [row[0], row[1]]).collect())
}
