//! The most likely spots near a start: Levenberg–Marquardt, with unknown directions integrated out.

use crate::dense::Matrix;
use crate::small::product;
use crate::spot_algebra::{Metric, solved};
use crate::spot_prior::{CONTENT, Expected, Prior, Sheet};
use crate::spot_table::{PARAMETERS, ROWS, SLOPES, Spot, Table};

/// Squared Newton decrement at which a step is too small to matter.
const SETTLED: f64 = 0.05;
const LEAST_DAMPING: f64 = 1e-6;
const MOST_DAMPING: f64 = 1e3;

/// Which of the touches that are expected a spot is; `None`: a newcomer.
pub type Known = Option<usize>;

/// The table as whitened data see it.
#[derive(Debug)]
pub struct Seen {
    /// Whitened rows.
    pub rows: usize,
    /// The first ones: changes show in no others.
    pub narrow: usize,
    /// (narrow, rank) by columns: from a change to whitened data.
    pub direct: Vec<f64>,
    /// (rows, rank), the same where each measurement counts as it is after the middle of the scan.
    pub timed: Vec<f64>,
}

impl Seen {
    /// (rows, n) of n changes in the basis.
    pub fn whitened(&self, changes: &[f64]) -> Matrix<f64> {
        let (rows, narrow) = (self.rows, self.narrow);
        let seen = product(&self.direct, narrow, changes);
        let mut out = Matrix::zeros(rows, seen.width());
        let columns = out.values.chunks_exact_mut(rows);
        for (target, column) in columns.zip(seen.values.chunks_exact(narrow)) {
            target[..narrow].copy_from_slice(column);
        }
        out
    }
}

/// Whitened data of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The table, and how it is seen.
    pub table: Table<'a>,
    /// See there.
    pub seen: &'a Seen,
    /// See there.
    pub sheet: &'a Sheet,
    /// See there.
    pub prior: &'a Prior,
    /// (rows).
    pub data: &'a [f64],
    /// Square of what of the data is in no row.
    pub rest: f64,
    /// (left, rows), one direction after the other.
    pub left: &'a [f64],
    /// (rows) what the table lacks, whitened.
    pub offset: &'a [f64],
    /// Deviation of a spot's way within the scan, m.
    pub reach: f64,
    /// Deviation of its growth within the scan, in parts of it.
    pub grows: f64,
    /// Least and largest depth.
    pub depths: [f64; 2],
    /// Touches that go on from the frame before.
    pub expected: &'a [Expected],
}

/// Spots that explain a frame; matrices by columns.
#[derive(Clone, Debug)]
pub struct Fit {
    /// See [`Spot`].
    pub spots: Vec<Spot>,
    /// (k).
    pub known: Vec<Known>,
    /// (rank) what all change by the table.
    pub change: Vec<f64>,
    /// (rows, k).
    pub each: Matrix<f64>,
    /// (rows).
    pub predicted: Vec<f64>,
    /// (rows).
    pub residual: Vec<f64>,
    /// (rows, 4k).
    pub jacobian: Matrix<f64>,
    /// Of the directions whose amplitudes are not known.
    pub metric: Metric,
    /// (4k, 4k).
    pub normal: Matrix<f64>,
    /// (4k), without the prior's.
    pub gradient: Vec<f64>,
    /// residualᵀ C⁻¹ residual.
    pub misfit: f64,
    /// Half the misfit and the prior's squares.
    pub cost: f64,
    /// Whether the steps came to an end.
    pub settled: bool,
}

/// The cost of some spots, and how it bends.
struct Slope {
    spots: Vec<Spot>,
    /// (4k, 4k).
    normal: Matrix<f64>,
    /// (4k), downhill.
    gradient: Vec<f64>,
    cost: f64,
}

/// Where steps have led.
struct Descent {
    spots: Vec<Spot>,
    /// How many were tried.
    steps: usize,
    /// Whether there is nothing to gain.
    settled: bool,
}

impl Frame<'_> {
    /// The frame with these spots, as they are; `None` where they cannot be compared with it.
    pub fn at(&self, spots: Vec<Spot>, known: &[Known]) -> Option<Fit> {
        let (rank, rows, k) = (self.table.layout.rank, self.seen.rows, spots.len());
        let parts = self.expanded(&spots, ROWS);
        let seen = self.seen.whitened(&parts);
        let pick = |first: usize, count: usize| picked(&seen, ROWS, first, count);
        let (each, jacobian) = (pick(0, 1), pick(1, PARAMETERS));
        let unknown = self.unknown(&spots, &parts, [pick(SLOPES, 1), pick(SLOPES + 1, 1)]);
        debug_assert_eq!(parts.len(), k * ROWS * rank);
        let predicted = self.predicted(&each);
        let residual = self.residual(&predicted);
        let metric = Metric::of(unknown)?;
        let own = metric.products(&[&jacobian.values[..], &residual].concat());
        let n = k * PARAMETERS;
        let misfit = self.rest + own[(n, n)];
        let cost = (misfit + self.prior_squares(&spots, known)) / 2.0;
        debug_assert_eq!(residual.len(), rows);
        cost.is_finite().then(|| Fit {
            change: summed(&parts, rank),
            normal: self.normal(&own, known),
            gradient: (0..n).map(|j| own[(n, j)]).collect(),
            spots,
            known: known.to_vec(),
            each,
            predicted,
            residual,
            jacobian,
            metric,
            misfit,
            cost,
            settled: false,
        })
    }

    /// The minimum of the cost near spots, after at most so many steps.
    ///
    /// What is unknown of the spots is taken as it is at the first ones, and anew where steps with
    /// that end.
    pub fn settled(&self, spots: &[Spot], known: &[Known], most: usize) -> Option<Fit> {
        let mut best = self.at(self.held(spots), known)?;
        let mut left = most;
        while left > 0 {
            let descent = self.descended(&best, left);
            best.settled = descent.settled;
            if descent.spots == best.spots {
                break;
            }
            left -= descent.steps;
            let Some(next) = self.at(descent.spots, known) else {
                break;
            };
            best = next;
            best.settled = self.is_settled(&best);
        }
        Some(best)
    }

    /// Whether a step by the fit's own metric would be too small to matter.
    fn is_settled(&self, fit: &Fit) -> bool {
        let gradient = self.pulled(&fit.spots, &fit.known, fit.gradient.iter().copied());
        solved(&fit.normal, &gradient, LEAST_DAMPING)
            .is_some_and(|step| dot(&gradient, &step) < SETTLED)
    }

    /// Steps from a fit down to where its metric sees nothing to gain.
    fn descended(&self, fit: &Fit, most: usize) -> Descent {
        let mut best = Slope {
            spots: fit.spots.clone(),
            normal: fit.normal.clone(),
            gradient: self.pulled(&fit.spots, &fit.known, fit.gradient.iter().copied()),
            cost: fit.cost,
        };
        let mut damping = LEAST_DAMPING;
        for steps in 0..most {
            let step = solved(&best.normal, &best.gradient, damping);
            let far = |step: &Vec<f64>| dot(&best.gradient, step) >= SETTLED;
            let Some(step) = step.filter(far) else {
                return Descent {
                    spots: best.spots,
                    steps,
                    settled: true,
                };
            };
            let tried = self.slope(fit, self.moved(&best.spots, &step));
            if tried.cost < best.cost {
                best = tried;
                damping = (damping / 10.0).max(LEAST_DAMPING);
            } else if damping > MOST_DAMPING {
                return Descent {
                    spots: best.spots,
                    steps,
                    settled: true,
                };
            } else {
                damping = (damping * 30.0).max(1e-2);
            }
        }
        Descent {
            spots: best.spots,
            steps: most,
            settled: false,
        }
    }

    /// The cost of spots by the metric of a fit that they began from.
    fn slope(&self, fit: &Fit, spots: Vec<Spot>) -> Slope {
        let (known, n) = (&fit.known, spots.len() * PARAMETERS);
        let seen = self.seen.whitened(&self.expanded(&spots, SLOPES));
        let each = picked(&seen, SLOPES, 0, 1);
        let mut columns = picked(&seen, SLOPES, 1, PARAMETERS).values;
        columns.extend(self.residual(&self.predicted(&each)));
        let own = fit.metric.products(&columns);
        let misfit = self.rest + own[(n, n)];
        Slope {
            normal: self.normal(&own, known),
            gradient: self.pulled(&spots, known, (0..n).map(|j| own[(n, j)])),
            cost: (misfit + self.prior_squares(&spots, known)) / 2.0,
            spots,
        }
    }

    /// (k, rows, rank) of spots.
    fn expanded(&self, spots: &[Spot], rows: usize) -> Vec<f64> {
        let size = rows * self.table.layout.rank;
        let mut parts = vec![0.0; spots.len() * size];
        for (spot, part) in spots.iter().zip(parts.chunks_exact_mut(size.max(1))) {
            self.table.expand(spot, rows, part);
        }
        parts
    }

    fn predicted(&self, each: &Matrix<f64>) -> Vec<f64> {
        let mut predicted = self.offset.to_vec();
        for column in each.values.chunks_exact(self.seen.rows) {
            predicted.iter_mut().zip(column).for_each(|(p, c)| *p += c);
        }
        predicted
    }

    fn residual(&self, predicted: &[f64]) -> Vec<f64> {
        let both = self.data.iter().zip(predicted);
        both.map(|(data, predicted)| data - predicted).collect()
    }

    /// The prior's part of the normal matrix added to that of the data.
    fn normal(&self, own: &Matrix<f64>, known: &[Known]) -> Matrix<f64> {
        let n = known.len() * PARAMETERS;
        let mut normal = Matrix::from_fn(n, n, |i, j| own[(i.max(j), i.min(j))]);
        for (spot, known) in known.iter().enumerate() {
            let first = spot * PARAMETERS;
            let (mut even, expected) = (0, known.map(|number| &self.expected[number]));
            if let Some(expected) = expected {
                even = CONTENT;
                for (i, row) in expected.weight.iter().enumerate() {
                    for (j, weight) in row.iter().enumerate() {
                        normal[(first + i, first + j)] += weight;
                    }
                }
            }
            for column in even..PARAMETERS {
                let weight = self.prior.weight[column];
                normal[(first + column, first + column)] += weight * weight;
            }
        }
        normal
    }

    /// What is held to be likely of a spot draws it back by.
    fn force(&self, spot: &Spot, known: Known) -> Spot {
        let away = self.prior.away(spot);
        let mut force: Spot = std::array::from_fn(|i| away[i] * self.prior.weight[i]);
        if let Some(expected) = known.map(|number| &self.expected[number]) {
            for (force, row) in force.iter_mut().zip(&expected.weight) {
                let pairs = row.iter().zip(spot).zip(&expected.middle);
                *force = pairs.map(|((w, here), there)| w * (here - there)).sum();
            }
        }
        force
    }

    fn prior_squares(&self, spots: &[Spot], known: &[Known]) -> f64 {
        let square = |(spot, known): (&Spot, &Known)| -> f64 {
            let mut middle = self.prior.middle;
            if let Some(number) = known {
                middle[..CONTENT].copy_from_slice(&self.expected[*number].middle[..CONTENT]);
            }
            let away = spot.iter().zip(&middle).map(|(here, there)| here - there);
            away.zip(self.force(spot, *known)).map(|(a, f)| a * f).sum()
        };
        spots.iter().zip(known).map(square).sum()
    }

    /// Spots where they may be.
    pub fn held(&self, spots: &[Spot]) -> Vec<Spot> {
        let hold = |spot: &Spot| {
            let mut held = *spot;
            self.sheet.hold(&mut held);
            self.prior.hold(&mut held, self.depths);
            held
        };
        spots.iter().map(hold).collect()
    }

    fn moved(&self, spots: &[Spot], step: &[f64]) -> Vec<Spot> {
        let mut moved = spots.to_vec();
        for (value, by) in moved.iter_mut().flatten().zip(step) {
            *value += by;
        }
        self.held(&moved)
    }

    /// The gradient with the prior's part.
    fn pulled(
        &self,
        spots: &[Spot],
        known: &[Known],
        gradient: impl Iterator<Item = f64>,
    ) -> Vec<f64> {
        let each = spots.iter().zip(known);
        let pull = each.flat_map(|(spot, known)| self.force(spot, *known));
        gradient.zip(pull).map(|(g, p)| g - p).collect()
    }

    /// Directions whose amplitudes are unknown: what is left, each spot's direction, its way and
    /// growth within the scan.
    fn unknown(&self, spots: &[Spot], parts: &[f64], own: [Matrix<f64>; 2]) -> Matrix<f64> {
        let (rows, rank) = (self.seen.rows, self.table.layout.rank);
        let Prior {
            directed, reshaped, ..
        } = *self.prior;
        let (reach, grows) = (self.reach, self.grows);
        let mut values = self.left.to_vec();
        for (size, directions) in [directed, reshaped].into_iter().zip(&own) {
            values.extend(directions.values.iter().map(|value| size * value));
        }
        if reach != 0.0 {
            let spread = PARAMETERS * rank;
            let timed: Vec<_> = parts
                .chunks_exact((ROWS * rank).max(1))
                .map(|part| product(&self.seen.timed, rows, &part[rank..rank + spread]))
                .collect();
            for (column, size) in [(0, Some(reach)), (1, Some(reach)), (3, None)] {
                for (spot, slopes) in spots.iter().zip(&timed) {
                    let size = size.unwrap_or(grows * spot[3]);
                    let slope = &slopes.values[column * rows..][..rows];
                    values.extend(slope.iter().map(|value| size * value));
                }
            }
        }
        Matrix {
            values,
            height: rows,
        }
    }
}

/// (rank) the changes of expansions (k, ROWS, rank) together.
fn summed(parts: &[f64], rank: usize) -> Vec<f64> {
    let mut sum = vec![0.0; rank];
    for part in parts.chunks_exact((ROWS * rank).max(1)) {
        let both = sum.iter_mut().zip(part);
        both.for_each(|(sum, value)| *sum += value);
    }
    sum
}

fn dot(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(a, b)| a * b).sum()
}

/// Of expansions of so many columns each, (rows, …): `count` from the `first` on.
fn picked(seen: &Matrix<f64>, columns: usize, first: usize, count: usize) -> Matrix<f64> {
    let rows = seen.height;
    let each = seen.values.chunks_exact(columns * rows);
    let wanted = each.flat_map(|part| &part[first * rows..(first + count) * rows]);
    Matrix {
        values: wanted.copied().collect(),
        height: rows,
    }
}
