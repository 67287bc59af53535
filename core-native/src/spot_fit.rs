//! The most likely spots near a start: Levenberg–Marquardt, with unknown directions integrated out.

use crate::dense::Matrix;
use crate::small::{add_sums, dots, product};
use crate::spot_table::{PARAMETERS, ROWS, Spot, Table};

/// Squared Newton decrement at which a step is too small to matter.
const SETTLED: f64 = 0.02;
const LEAST_DAMPING: f64 = 1e-6;
const MOST_DAMPING: f64 = 1e3;

/// Where a spot may be.
#[derive(Debug)]
pub struct Sheet {
    /// Of its cells, m.
    pub centroids: Vec<[f64; 2]>,
    /// How far each reaches from there, m.
    pub margin: Vec<f64>,
}

impl Sheet {
    /// Brings a spot that is off the sheet back to its nearest cell.
    fn hold(&self, spot: &mut Spot) {
        let (mut nearest, mut least) = (0, f64::INFINITY);
        for (number, [x, y]) in self.centroids.iter().enumerate() {
            let square = (x - spot[0]).powi(2) + (y - spot[1]).powi(2);
            if square < least {
                (nearest, least) = (number, square);
            }
        }
        if least.sqrt() > self.margin[nearest] {
            spot[..2].copy_from_slice(&self.centroids[nearest]);
        }
    }
}

/// What is likely of a spot.
#[derive(Clone, Copy, Debug)]
pub struct Prior {
    /// Middle of each column; positions have none.
    pub middle: Spot,
    /// One over the deviation of each column; away from its middle counts as much.
    pub weight: Spot,
    /// Of the logarithm of the radius: least and largest.
    pub log_radii: [f64; 2],
    /// Content of a spot of radius and depth one.
    pub filling: f64,
}

impl Prior {
    /// Deviations from the middle.
    fn away(&self, spot: &Spot) -> Spot {
        [
            0.0,
            0.0,
            (spot[2] - self.middle[2]) * self.weight[2],
            (spot[3] - self.middle[3]) * self.weight[3],
        ]
    }

    fn hold(&self, spot: &mut Spot, depths: [f64; 2]) {
        spot[2] = spot[2].clamp(self.log_radii[0], self.log_radii[1]);
        let filling = self.filling * (2.0 * spot[2]).exp();
        let [low, high] = depths.map(|depth| depth * filling);
        spot[3] = spot[3].clamp(low, high);
    }
}

/// The table as whitened data see it.
#[derive(Debug)]
pub struct Seen {
    /// Whitened rows.
    pub rows: usize,
    /// (rows, rank) by columns: from a change to whitened data.
    pub direct: Vec<f64>,
    /// The same where each measurement counts as it is after the middle of the scan.
    pub timed: Vec<f64>,
}

/// Whitened data of one frame.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// The table, and how it is seen.
    pub table: &'a Table,
    /// See there.
    pub seen: &'a Seen,
    /// See there.
    pub sheet: &'a Sheet,
    /// See there.
    pub prior: &'a Prior,
    /// (rows).
    pub data: &'a [f64],
    /// (left, rows), one direction after the other.
    pub left: &'a [f64],
    /// (rank) what the table lacks.
    pub offset: &'a [f64],
    /// Deviation of a spot's direction, of its shape, of its way within the scan, m, and of its
    /// growth.
    pub deviations: [f64; 4],
    /// Least and largest depth.
    pub depths: [f64; 2],
}

/// Spots that explain a frame; matrices by columns.
#[derive(Clone, Debug)]
pub struct Fit {
    /// See [`Spot`].
    pub spots: Vec<Spot>,
    /// (rows, k).
    pub each: Matrix<f64>,
    /// (rows).
    pub predicted: Vec<f64>,
    /// (rows).
    pub residual: Vec<f64>,
    /// (rows, 4k).
    pub jacobian: Matrix<f64>,
    /// (rows, q).
    pub unknown: Matrix<f64>,
    /// (4k, 4k).
    pub normal: Matrix<f64>,
    /// (4k), without the prior's.
    pub gradient: Vec<f64>,
    /// residualᵀ C⁻¹ residual.
    pub misfit: f64,
    /// Half the logarithm of the determinant of C.
    pub log_size: f64,
    /// Half the misfit and the prior's squares.
    pub cost: f64,
    /// Whether the steps came to an end.
    pub settled: bool,
}

impl Frame<'_> {
    /// The frame with these spots, as they are; `None` where they cannot be compared with it.
    pub fn at(&self, spots: Vec<Spot>) -> Option<Fit> {
        let (rank, rows, k) = (self.table.rank, self.seen.rows, spots.len());
        let mut parts = vec![0.0; k * ROWS * rank];
        for (spot, part) in spots
            .iter()
            .zip(parts.chunks_exact_mut((ROWS * rank).max(1)))
        {
            self.table.expand(spot, part);
        }
        let offset = self.whitened(&self.seen.direct, self.offset);
        let seen = self.whitened(&self.seen.direct, &parts);
        let pick = |wanted: &[usize]| -> Matrix<f64> {
            let columns = (0..k).flat_map(|spot| wanted.iter().map(move |row| spot * ROWS + row));
            let values = columns.flat_map(|column| &seen.values[column * rows..][..rows]);
            Matrix {
                values: values.copied().collect(),
                height: rows,
            }
        };
        let (each, jacobian) = (pick(&[0]), pick(&[1, 2, 3, 4]));
        let unknown = self.unknown(&spots, &parts, [pick(&[5]), pick(&[6])]);
        let mut predicted = offset.values;
        for column in each.values.chunks_exact(rows) {
            predicted.iter_mut().zip(column).for_each(|(p, c)| *p += c);
        }
        let residual: Vec<f64> = self
            .data
            .iter()
            .zip(&predicted)
            .map(|(d, p)| d - p)
            .collect();
        let (own, log_size) = integrated(&unknown, &jacobian, &residual)?;
        let n = k * PARAMETERS;
        let mut normal = Matrix::from_fn(n, n, |i, j| own[(i.max(j), i.min(j))]);
        let mut prior = 0.0;
        for (number, spot) in spots.iter().enumerate() {
            prior += self.prior.away(spot).iter().map(|a| a * a).sum::<f64>();
            for (column, weight) in self.prior.weight.iter().enumerate() {
                let place = number * PARAMETERS + column;
                normal[(place, place)] += weight * weight;
            }
        }
        let (gradient, misfit) = ((0..n).map(|j| own[(n, j)]).collect(), own[(n, n)]);
        Some(Fit {
            spots,
            each,
            predicted,
            residual,
            jacobian,
            unknown,
            normal,
            gradient,
            misfit,
            log_size,
            cost: (misfit + prior) / 2.0,
            settled: true,
        })
    }

    /// The minimum of the cost near a fit, after at most so many steps.
    pub fn settled(&self, mut best: Fit, most: usize) -> Fit {
        let mut damping = LEAST_DAMPING;
        best.settled = false;
        for _ in 0..most {
            let gradient = self.gradient(&best);
            let Some(step) = solved(&best.normal, &gradient, damping) else {
                break;
            };
            let decrement: f64 = gradient.iter().zip(&step).map(|(g, s)| g * s).sum();
            if decrement < SETTLED {
                best.settled = true;
                break;
            }
            let tried = self.at(self.moved(&best.spots, &step));
            match tried.filter(|tried| tried.cost < best.cost) {
                Some(better) => {
                    best = Fit {
                        settled: false,
                        ..better
                    };
                    damping = (damping / 10.0).max(LEAST_DAMPING);
                }
                None if damping > MOST_DAMPING => {
                    best.settled = true;
                    break;
                }
                None => damping = (damping * 30.0).max(1e-2),
            }
        }
        best
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

    fn gradient(&self, fit: &Fit) -> Vec<f64> {
        let pull = fit.spots.iter().flat_map(|spot| {
            let away = self.prior.away(spot);
            (0..PARAMETERS).map(move |column| away[column] * self.prior.weight[column])
        });
        fit.gradient.iter().zip(pull).map(|(g, p)| g - p).collect()
    }

    /// Directions whose amplitudes are unknown: what is left, each spot's direction, its way and
    /// growth within the scan.
    fn unknown(&self, spots: &[Spot], parts: &[f64], own: [Matrix<f64>; 2]) -> Matrix<f64> {
        let (rows, rank) = (self.seen.rows, self.table.rank);
        let [directed, reshaped, reach, grows] = self.deviations;
        let mut values = self.left.to_vec();
        for (size, directions) in [directed, reshaped].into_iter().zip(&own) {
            values.extend(directions.values.iter().map(|value| size * value));
        }
        if reach != 0.0 {
            let spread = PARAMETERS * rank;
            let timed: Vec<_> = parts
                .chunks_exact((ROWS * rank).max(1))
                .map(|part| self.whitened(&self.seen.timed, &part[rank..rank + spread]))
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

    /// (rows, n) of n changes in the basis.
    fn whitened(&self, matrix: &[f64], changes: &[f64]) -> Matrix<f64> {
        product(matrix, self.seen.rows, changes)
    }
}

/// [J r]ᵀ C⁻¹ [J r], its lower half, and half the logarithm of C's determinant.
///
/// C = 1 + DDᵀ, and its inverse 1 − D(1 + DᵀD)⁻¹Dᵀ (Woodbury 1950); D is what is unknown.
fn integrated(
    unknown: &Matrix<f64>,
    jacobian: &Matrix<f64>,
    residual: &[f64],
) -> Option<(Matrix<f64>, f64)> {
    let (rows, q) = (residual.len(), unknown.width());
    let columns = [&unknown.values, &jacobian.values, residual].concat();
    let mut gram = dots(&columns, &columns, rows);
    let n = gram.height;
    for i in 0..q {
        gram[(i, i)] += 1.0;
    }
    let log_size = eliminated(&mut gram, q)?;
    let own = Matrix::from_fn(n - q, n - q, |i, j| gram[(q + i, q + j)]);
    Some((own, log_size))
}

/// Eliminates the first q unknowns of a symmetric matrix, of which the lower half counts, and
/// gives half the logarithm of their determinant; `None` where it is not positive.
fn eliminated(matrix: &mut Matrix<f64>, q: usize) -> Option<f64> {
    let (n, mut log_size) = (matrix.height, 0.0);
    for pivot in 0..q {
        let square = matrix[(pivot, pivot)];
        if !(square > 0.0 && square.is_finite()) {
            return None;
        }
        let root = square.sqrt();
        log_size += root.ln();
        let (done, rest) = matrix.values.split_at_mut((pivot + 1) * n);
        let column = &mut done[pivot * n..];
        column[pivot] = root;
        column[pivot + 1..]
            .iter_mut()
            .for_each(|value| *value /= root);
        for (number, other) in rest.chunks_exact_mut(n).enumerate() {
            let j = pivot + 1 + number;
            let scale = column[j];
            for (value, below) in other[j..].iter_mut().zip(&column[j..]) {
                *value -= scale * below;
            }
        }
    }
    Some(log_size)
}

/// Solution of a symmetric positive system whose scaled diagonal is damped.
fn solved(normal: &Matrix<f64>, gradient: &[f64], damping: f64) -> Option<Vec<f64>> {
    let n = gradient.len();
    let scale: Vec<f64> = (0..n).map(|i| 1.0 / normal[(i, i)].sqrt()).collect();
    let mut root = Matrix::from_fn(n, n, |i, j| {
        let even = normal[(i, j)] * scale[i] * scale[j];
        if i == j { even * (1.0 + damping) } else { even }
    });
    eliminated(&mut root, n)?;
    let mut x: Vec<f64> = gradient.iter().zip(&scale).map(|(g, s)| g * s).collect();
    forward(&root, &mut x);
    backward(&root, &mut x);
    Some(x.iter().zip(&scale).map(|(x, s)| x * s).collect())
}

/// Solves with the lower root of a matrix, in place.
fn forward(root: &Matrix<f64>, x: &mut [f64]) {
    for (i, column) in root.values.chunks_exact(root.height.max(1)).enumerate() {
        x[i] /= column[i];
        let value = x[i];
        for (entry, below) in x[i + 1..].iter_mut().zip(&column[i + 1..]) {
            *entry -= below * value;
        }
    }
}

/// Solves with the transposed lower root of a matrix, in place.
fn backward(root: &Matrix<f64>, x: &mut [f64]) {
    for (i, column) in root
        .values
        .chunks_exact(root.height.max(1))
        .enumerate()
        .rev()
    {
        let below = column[i + 1..].iter().zip(&x[i + 1..]);
        let sum: f64 = below.map(|(a, b)| a * b).sum();
        x[i] = (x[i] - sum) / column[i];
    }
}

/// Rows times P: C⁻¹ less what C⁻¹ keeps of the span of `free`; C = 1 + unknown unknownᵀ.
///
/// All are (rows, …) by columns; `None` where the span is not one.
pub fn projected(
    [unknown, free, columns]: [&[f64]; 3],
    rows: usize,
    ridge: f64,
) -> Option<Matrix<f64>> {
    let [q, p] = [unknown, free].map(|part| part.len() / rows);
    let both = [unknown, free].concat();
    let mut square = dots(&both, &both, rows);
    for i in 0..q {
        square[(i, i)] += 1.0;
    }
    let scale: Vec<f64> = (0..q + p)
        .map(|i| 1.0 / square[(i, i)].max(1e-300).sqrt())
        .collect();
    let mut root = Matrix::from_fn(q + p, q + p, |i, j| square[(i, j)] * scale[i] * scale[j]);
    for i in 0..q + p {
        root[(i, i)] += ridge;
    }
    eliminated(&mut root, q + p)?;
    let mut taken = dots(&both, columns, rows);
    for column in taken.values.chunks_exact_mut((q + p).max(1)) {
        column
            .iter_mut()
            .zip(&scale)
            .for_each(|(value, s)| *value *= s);
        forward(&root, column);
        backward(&root, column);
        column
            .iter_mut()
            .zip(&scale)
            .for_each(|(value, s)| *value *= s);
    }
    let mut values = columns.to_vec();
    for (target, factors) in values
        .chunks_exact_mut(rows)
        .zip(taken.values.chunks_exact((q + p).max(1)))
    {
        add_sums(target, -1.0, both.chunks_exact(rows), factors);
    }
    Some(Matrix {
        values,
        height: rows,
    })
}
