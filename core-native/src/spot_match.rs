//! How far spots stand out of the noise, and candidates out of what spots leave.

use crate::dense::Matrix;
use crate::small::{dots, product, squares as squares_of};
use crate::spot_algebra::{Beside, Metric, backward, eliminated, forward};
use crate::spot_table::PARAMETERS;

/// Candidates as whitened data see them.
#[derive(Clone, Copy, Debug)]
pub struct Signatures<'a> {
    /// (narrow, n) by columns.
    pub values: &'a [f64],
    /// Rows of whitened data that they show in, the first ones.
    pub narrow: usize,
    /// (n) squares of the columns.
    pub squares: &'a [f64],
}

/// What counts of candidates.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(feature = "python", derive(pyo3::FromPyObject))]
pub struct Limits {
    /// Least content, by sign.
    pub low: f64,
    /// Largest content, by sign.
    pub high: f64,
    /// Deviations below which a candidate is none.
    pub least: f64,
    /// Part of a candidate's square that must be its own.
    pub useful: f64,
    /// Part of a square that keeps the equations solvable.
    pub ridge: f64,
}

/// Likelihood ratio of each candidate, and its most likely content.
///
/// `unknown` and `free` directions take up what they can of the residual and of the candidates;
/// `None` where the free ones are not apart.
pub fn standing_out(
    signatures: Signatures<'_>,
    [unknown, free, residual]: [&[f64]; 3],
    limits: Limits,
) -> Option<[Vec<f64>; 2]> {
    let (rows, narrow) = (residual.len(), signatures.narrow);
    let n = signatures.squares.len();
    let beside = Beside::of(unknown, free, rows, limits.ridge)?;
    let clean = beside.projected(residual, rows);
    let onto = dots(signatures.values, &clean.values[..narrow], narrow).values;
    let held = |value: &f64| value.clamp(limits.low, limits.high);
    let onto: Vec<f64> = onto.iter().map(held).collect();
    let likely: Vec<usize> = (0..n)
        .filter(|&i| onto[i] * onto[i] > limits.least * limits.least * signatures.squares[i])
        .collect();
    let column = |&i: &usize| &signatures.values[i * narrow..(i + 1) * narrow];
    let columns: Vec<f64> = likely.iter().flat_map(column).copied().collect();
    let squares: Vec<f64> = likely.iter().map(|&i| signatures.squares[i]).collect();
    let left = beside.left(&columns, narrow, rows, &squares);
    let [mut ratio, mut content] = [vec![0.0; n], vec![0.0; n]];
    for (&i, left) in likely.iter().zip(left) {
        if left > limits.useful * signatures.squares[i] {
            content[i] = onto[i] / left;
            ratio[i] = onto[i].abs() / left.sqrt();
        }
    }
    Some([ratio, content])
}

/// Square of what each spot changes that the slopes of the others could not take up.
///
/// `slopes` (rows, 4k) and `each` (rows, k), by the metric of some unknown directions.
pub fn standing(metric: &Metric, [slopes, each]: [&[f64]; 2], ridge: f64) -> Option<Vec<f64>> {
    let k = each.len() / metric.unknown.height.max(1);
    let own = metric.products(&[slopes, each].concat());
    (0..k)
        .map(|spot| {
            let mine = k * PARAMETERS + spot;
            let others = (0..k * PARAMETERS).filter(|column| column / PARAMETERS != spot);
            let others: Vec<usize> = others.collect();
            let scale: Vec<f64> = others
                .iter()
                .map(|&i| 1.0 / own[(i, i)].max(1e-300).sqrt())
                .collect();
            let n = others.len();
            let mut root = Matrix::from_fn(n, n, |i, j| {
                let even = own[(others[i], others[j])] * scale[i] * scale[j];
                if i == j { even + ridge } else { even }
            });
            eliminated(&mut root, n)?;
            let across = others.iter().zip(&scale);
            let mut across: Vec<f64> = across.map(|(&i, s)| own[(i, mine)] * s).collect();
            forward(&root, &mut across);
            let taken: f64 = across.iter().map(|value| value * value).sum();
            Some((own[(mine, mine)] - taken).max(0.0))
        })
        .collect()
}

/// What is seen of each measurement of its own.
#[derive(Clone, Copy, Debug)]
pub struct Measurements<'a> {
    /// (n_meas, rows) by columns: from data to whitened data.
    pub matrix: &'a [f64],
    /// (n_meas) squares of what each measurement alone is, all whitened data counted.
    pub squares: &'a [f64],
    /// (n_meas) what all spots change.
    pub change: &'a [f64],
}

/// How well a fit explains its frame.
#[derive(Clone, Copy, Debug)]
pub struct Quality {
    /// residualᵀ C⁻¹ residual.
    pub misfit: f64,
    /// Degrees of freedom of the residual.
    pub degrees: f64,
    /// Part by which each measurement answers a spot otherwise than the model's, at the least.
    pub uneven: f64,
}

/// Covariance of all parameters (4k, 4k): the curvature's, scaled where the data scatter more than
/// they should, and the part of measurements that answer otherwise than the model's.
///
/// `onto` (rows, 4k): slopes times C⁻¹. `None` where the normal matrix is not positive.
pub fn covariance(
    normal: &Matrix<f64>,
    onto: &Matrix<f64>,
    seen: Measurements<'_>,
    quality: Quality,
) -> Option<Matrix<f64>> {
    let (n, n_meas) = (normal.height, seen.change.len());
    let own = inverse(normal)?;
    let mut answers = product(seen.matrix, n_meas, &onto.values);
    for column in answers.values.chunks_exact_mut(n_meas) {
        let both = column.iter_mut().zip(seen.change);
        both.for_each(|(value, change)| *value *= change);
    }
    let square = squares_of(&answers.values, n_meas);
    let moved = dots(&own.values, &square.values, n);
    let taken: f64 = (0..n).map(|i| moved[(i, i)]).sum();
    let all = seen.squares.iter().zip(seen.change);
    let unexplained = all.map(|(s, c)| s * c * c).sum::<f64>() - taken;
    let Quality {
        misfit,
        degrees,
        uneven,
    } = quality;
    let beyond = if unexplained > 0.0 {
        (misfit - degrees).max(0.0) / unexplained
    } else {
        0.0
    };
    let part = beyond.max(uneven * uneven);
    let scatter = (misfit / degrees).max(1.0);
    // own is symmetric: own · square · own
    let turned = Matrix::from_fn(n, n, |i, j| moved[(j, i)]);
    let considered = dots(&turned.values, &own.values, n);
    Some(Matrix::from_fn(n, n, |i, j| {
        scatter * own[(i, j)] + part * considered[(i, j)]
    }))
}

/// Of a symmetric positive matrix whose columns differ in size.
fn inverse(matrix: &Matrix<f64>) -> Option<Matrix<f64>> {
    let n = matrix.height;
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / matrix[(i, i)].sqrt()).collect();
    let mut root = Matrix::from_fn(n, n, |i, j| matrix[(i, j)] * scale[i] * scale[j]);
    eliminated(&mut root, n)?;
    let mut out = Matrix::from_fn(n, n, |i, j| if i == j { scale[i] } else { 0.0 });
    for column in out.values.chunks_exact_mut(n.max(1)) {
        forward(&root, column);
        backward(&root, column);
        let both = column.iter_mut().zip(&scale);
        both.for_each(|(value, scale)| *value *= scale);
    }
    Some(out)
}
