//! Small systems of directions whose amplitudes are not known.

use crate::dense::Matrix;
use crate::small::{add_sums, dots, squares};

/// C = 1 + DDᵀ of unknown directions D: C⁻¹ = 1 − D(1 + DᵀD)⁻¹Dᵀ (Woodbury 1950).
#[derive(Clone, Debug)]
pub struct Metric {
    /// D, (rows, q).
    pub unknown: Matrix<f64>,
    /// Half the logarithm of the determinant of C.
    pub log_size: f64,
    /// Lower root of 1 + DᵀD.
    root: Matrix<f64>,
}

impl Metric {
    /// Of unknown directions; `None` where they are not finite.
    pub fn of(unknown: Matrix<f64>) -> Option<Self> {
        let q = unknown.width();
        let mut root = squares(&unknown.values, unknown.height);
        for i in 0..q {
            root[(i, i)] += 1.0;
        }
        let log_size = eliminated(&mut root, q)?;
        Some(Self {
            unknown,
            log_size,
            root,
        })
    }

    /// The products of columns (rows, n) with C⁻¹ between them, (n, n).
    pub fn products(&self, columns: &[f64]) -> Matrix<f64> {
        let rows = self.unknown.height;
        let mut own = squares(columns, rows);
        if self.unknown.values.is_empty() {
            return own;
        }
        let mut across = dots(&self.unknown.values, columns, rows);
        let q = across.height;
        for column in across.values.chunks_exact_mut(q) {
            forward(&self.root, column);
        }
        let taken = squares(&across.values, q);
        for (value, taken) in own.values.iter_mut().zip(&taken.values) {
            *value -= taken;
        }
        own
    }
}

/// Eliminates the first q unknowns of a symmetric matrix, of which the lower half counts, and
/// gives half the logarithm of their determinant; `None` where it is not positive.
pub fn eliminated(matrix: &mut Matrix<f64>, q: usize) -> Option<f64> {
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
pub fn solved(normal: &Matrix<f64>, gradient: &[f64], damping: f64) -> Option<Vec<f64>> {
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
pub fn forward(root: &Matrix<f64>, x: &mut [f64]) {
    for (i, column) in root.values.chunks_exact(root.height.max(1)).enumerate() {
        x[i] /= column[i];
        let value = x[i];
        for (entry, below) in x[i + 1..].iter_mut().zip(&column[i + 1..]) {
            *entry -= below * value;
        }
    }
}

/// Solves with the transposed lower root of a matrix, in place.
pub fn backward(root: &Matrix<f64>, x: &mut [f64]) {
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

/// What C⁻¹ leaves of a column beside directions of which any amount may be there.
///
/// P = C⁻¹ less what C⁻¹ keeps of the span of `free`; C = 1 + unknown unknownᵀ.
pub struct Beside {
    /// Unknown and free, (rows, n).
    both: Vec<f64>,
    scale: Vec<f64>,
    root: Matrix<f64>,
}

impl Beside {
    /// Of (rows, …) by columns; `None` where the span is not one.
    pub fn of(unknown: &[f64], free: &[f64], rows: usize, ridge: f64) -> Option<Self> {
        let q = unknown.len() / rows;
        let both = [unknown, free].concat();
        let mut root = squares(&both, rows);
        let n = root.height;
        for i in 0..q {
            root[(i, i)] += 1.0;
        }
        let scale: Vec<f64> = (0..n)
            .map(|i| 1.0 / root[(i, i)].max(1e-300).sqrt())
            .collect();
        for (j, column) in root.values.chunks_exact_mut(n.max(1)).enumerate() {
            for (value, by) in column.iter_mut().zip(&scale) {
                *value *= by * scale[j];
            }
            column[j] += ridge;
        }
        eliminated(&mut root, n)?;
        Some(Self { both, scale, root })
    }

    /// Columns (rows, …) times P.
    pub fn projected(&self, columns: &[f64], rows: usize) -> Matrix<f64> {
        let n = self.scale.len().max(1);
        let mut taken = dots(&self.both, columns, rows);
        for column in taken.values.chunks_exact_mut(n) {
            self.weigh(column);
            forward(&self.root, column);
            backward(&self.root, column);
            self.weigh(column);
        }
        let mut values = columns.to_vec();
        let targets = values.chunks_exact_mut(rows);
        for (target, factors) in targets.zip(taken.values.chunks_exact(n)) {
            add_sums(target, -1.0, self.both.chunks_exact(rows), factors);
        }
        Matrix {
            values,
            height: rows,
        }
    }

    /// xᵀPx of columns x whose first `narrow` rows are given, the others none; `squares` xᵀx.
    pub fn left(&self, columns: &[f64], narrow: usize, rows: usize, squares: &[f64]) -> Vec<f64> {
        let n = self.scale.len();
        if n == 0 {
            return squares.to_vec();
        }
        let rest = self.both.chunks_exact(rows);
        let both: Vec<f64> = rest.flat_map(|column| &column[..narrow]).copied().collect();
        let mut taken = dots(&both, columns, narrow);
        let each = taken.values.chunks_exact_mut(n).zip(squares);
        each.map(|(column, square)| {
            self.weigh(column);
            forward(&self.root, column);
            square - column.iter().map(|value| value * value).sum::<f64>()
        })
        .collect()
    }

    fn weigh(&self, column: &mut [f64]) {
        let both = column.iter_mut().zip(&self.scale);
        both.for_each(|(value, scale)| *value *= scale);
    }
}
