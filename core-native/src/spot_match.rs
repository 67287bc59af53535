//! How far spots stand out of the noise, and candidates out of what spots leave.

use crate::dense::Matrix;
use crate::small::dots;
use crate::spot_algebra::{Beside, Metric, eliminated, forward};
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
pub struct Limits {
    /// Least and largest content, by sign.
    pub content: [f64; 2],
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
    let [low, high] = limits.content;
    let onto: Vec<f64> = onto.iter().map(|value| value.clamp(low, high)).collect();
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
