//! A square grid's Laplacian, whose solution and products are easy to check.

use std::sync::Arc;

use ndarray::Array2;
use pulp::Arch;
use tomoskin_core::factor::Factor;
use tomoskin_core::jacobian::{Fields, Table, jacobian};
use tomoskin_core::product::{Rows, transposed_product};
use tomoskin_core::scalar::{Scalar, c64};
use tomoskin_core::solve::{checked_columns, columns};
use tomoskin_core::symbolic::Symbolic;

/// Columns of the Laplacian of a `side` × `side` grid: starts, rows, values.
fn grid(side: usize, shift: f64) -> (Vec<u32>, Vec<u32>, Vec<f64>) {
    let (mut starts, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for column in 0..side * side {
        let (i, j) = (column / side, column % side);
        let mut entries = vec![(column, 4.0 + shift)];
        entries.extend((i > 0).then(|| (column - side, -1.0)));
        entries.extend((i + 1 < side).then(|| (column + side, -1.0)));
        entries.extend((j > 0).then(|| (column - 1, -1.0)));
        entries.extend((j + 1 < side).then(|| (column + 1, -1.0)));
        entries.sort_by_key(|entry| entry.0);
        for (row, value) in entries {
            rows.push(row as u32);
            values.push(value);
        }
        starts.push(rows.len() as u32);
    }
    (starts, rows, values)
}

/// All vector instructions that this processor has.
fn instructions() -> Vec<Arch> {
    let mut all = vec![Arch::Scalar];
    #[cfg(target_arch = "x86_64")]
    all.extend(pulp::x86::V3::try_new().map(Arch::V3));
    #[cfg(target_arch = "x86_64")]
    all.extend(pulp::x86::V4::try_new().map(Arch::V4));
    if !all
        .iter()
        .any(|arch| format!("{arch:?}") == format!("{:?}", Arch::new()))
    {
        all.push(Arch::new());
    }
    all
}

/// A grid's factor, its values, and `k` of its rows.
fn case<T: Scalar>(arch: Arch, side: usize, k: usize, scale: T) -> (Factor<T>, Vec<T>, Vec<u32>) {
    let (starts, rows, values) = grid(side, 0.1);
    let n = side * side;
    let symbolic = Arc::new(Symbolic::new(n, &starts, &rows).unwrap());
    let values: Vec<T> = values.iter().map(|&value| scale * value).collect();
    let chosen = (0..k).map(|j| (j * 7 % n) as u32).collect();
    let factor = Factor::by(arch, symbolic, &values).unwrap();
    (factor, values, chosen)
}

/// What columns of the inverse leave over of the identity, row-major (n, k), the slow way.
fn left_over<T: Scalar>(side: usize, values: &[T], chosen: &[u32], x: &[T]) -> Vec<T> {
    let ((starts, rows, _), k) = (grid(side, 0.1), chosen.len());
    let mut residual = vec![T::ZERO; x.len()];
    for (j, &row) in chosen.iter().enumerate() {
        residual[row as usize * k + j] += T::ONE;
    }
    for column in 0..side * side {
        for at in starts[column] as usize..starts[column + 1] as usize {
            for j in 0..k {
                residual[rows[at] as usize * k + j] -= values[at] * x[column * k + j];
            }
        }
    }
    residual
}

fn check_columns<T: Scalar>(arch: Arch, side: usize, k: usize, scale: T) {
    let (factor, values, chosen) = case(arch, side, k, scale);
    let size = side * side * k;
    let mut x = vec![T::ZERO; size];
    columns(&factor, &chosen, &mut x);
    let largest = |all: &[T]| all.iter().map(|v| v.norm_sqr()).fold(0.0, f64::max).sqrt();
    let residual = largest(&left_over(side, &values, &chosen, &x));
    assert!(residual < 1e-13, "{arch:?} {side} {k}: {residual}");

    // against another matrix much is left over, and what that costs are the sums that say so
    let other: Vec<T> = values.iter().map(|&value| value * 0.75).collect();
    let (mut again, mut lost) = (vec![T::ONE; size], vec![T::ZERO; k * k]);
    let found = checked_columns(&factor, &other, &chosen, &mut again, &mut lost);
    assert!(again == x);
    let left = left_over(side, &other, &chosen, &x);
    assert!((found - largest(&left)).abs() < 1e-13);
    for (at, &lost) in lost.iter().enumerate() {
        let rows = (0..side * side).map(|row| x[row * k + at / k] * left[row * k + at % k]);
        let sum = rows.fold(T::ZERO, |sum, product| sum + product);
        assert!(largest(&[sum - lost]) < 1e-12, "{arch:?} {side} {k}");
    }
}

#[test]
fn columns_of_the_inverse_are_right_to_rounding() {
    for arch in instructions() {
        for side in [1, 2, 5, 40] {
            for k in [0, 1, 3, 8, 9, 15, 16, 17, 40] {
                check_columns(arch, side, k, 1.0);
                check_columns(arch, side, k, c64::new(1.0, 0.7));
            }
        }
    }
}

#[test]
fn wide_panels_are_right_to_rounding() {
    // a full matrix is one panel, eliminated in parts and by products
    for arch in instructions() {
        for n in [31_u32, 32, 33, 100, 201] {
            let starts: Vec<u32> = (0..=n).map(|column| column * n).collect();
            let rows: Vec<u32> = (0..n * n).map(|at| at % n).collect();
            let entry = |at: u32| 1.0 + f64::from(2 * n) * f64::from(u32::from(at % n == at / n));
            let values: Vec<f64> = (0..n * n).map(entry).collect();
            let symbolic = Arc::new(Symbolic::new(n as usize, &starts, &rows).unwrap());
            let factor = Factor::by(arch, symbolic, &values).unwrap();
            let chosen: Vec<u32> = (0..n).collect();
            let (mut x, mut lost) = (vec![0.0; values.len()], vec![0.0; values.len()]);
            let found = checked_columns(&factor, &values, &chosen, &mut x, &mut lost);
            assert!(found < 1e-13, "{arch:?} {n}: {found}");
        }
    }
}

#[test]
fn a_residual_that_is_no_number_stays_none() {
    for arch in instructions() {
        let (factor, mut values, chosen) = case(arch, 12, 3, 1.0);
        values[100] = f64::NAN;
        let (mut x, mut lost) = (vec![0.0; 144 * 3], vec![0.0; 9]);
        assert!(checked_columns(&factor, &values, &chosen, &mut x, &mut lost).is_nan());
    }
}

#[test]
fn refuses_what_is_not_positive_definite() {
    let (starts, rows, mut values) = grid(12, -8.1);
    let symbolic = Arc::new(Symbolic::new(144, &starts, &rows).unwrap());
    assert!(Factor::new(Arc::clone(&symbolic), &values).is_err());
    values.fill(f64::NAN);
    assert!(Factor::new(Arc::clone(&symbolic), &values).is_err());
    assert!(Factor::new(symbolic, &values[1..]).is_err());
}

#[test]
fn refuses_what_is_no_structure() {
    let (starts, rows, _) = grid(3, 0.0);
    assert!(Symbolic::new(8, &starts, &rows).is_err());
    assert!(Symbolic::new(9, &starts, &rows[1..]).is_err());
    assert!(Symbolic::new(0, &[0], &[]).is_err());
    assert!(Symbolic::new(2, &[0, 1, 2], &[0, 2]).is_err());
    assert!(Symbolic::new(2, &[0, 2, 3], &[1, 0, 1]).is_err());
    assert!(Symbolic::new(2, &[0, 2, 3], &[0, 1, 1]).is_err());
    assert!(Symbolic::new(2, &[0, 1, 3], &[0, 0, 1]).is_err());
    assert!(Symbolic::new(2, &[0, 1, 2], &[0, 0]).is_err());
    assert!(Symbolic::new(2, &[0, 3, 2], &[0, 1]).is_err());
}

#[test]
fn products_and_rows_do_not_depend_on_threads() {
    let n = 50_000;
    let starts: Vec<i32> = (0..=n).collect();
    let columns: Vec<i32> = (0..n).map(|row| row % 5).collect();
    let values = vec![2.0; n as usize];
    let rows = Rows::new(&starts, &columns, &values).unwrap();
    let vectors = Array2::from_shape_fn((5, 18), |(i, j)| (i * 18 + j) as f64);
    let mut out = vec![0.0; 18 * n as usize];
    transposed_product(rows, vectors.view(), &mut out, 3);
    for (at, &value) in out.iter().enumerate() {
        let (vector, row) = (at / n as usize, at % n as usize);
        assert!(value == 2.0 * vectors[[row % 5, vector]]);
    }

    let fields = Fields {
        values: &out,
        shape: [6, 3, n as usize],
    };
    let table = Table::new(
        &[[0, 1], [2, 3]],
        |_| 3.0,
        &[1, 0, 1],
        &[[4, 5], [1, 4], [0, 5]],
    );
    let table = table.unwrap();
    let (mut one, mut four) = (vec![0.0; 3 * n as usize], vec![1.0; 3 * n as usize]);
    jacobian(fields, &table, &mut one, 1);
    jacobian(fields, &table, &mut four, 4);
    assert!(one == four);
    let field = |electrode: usize, axis: usize, cell: usize| {
        out[(electrode * 3 + axis) * n as usize + cell]
    };
    let cell = 41_234;
    let expected: f64 = (0..3)
        .map(|a| {
            -3.0 * (field(0, a, cell) - field(1, a, cell)) * (field(1, a, cell) - field(4, a, cell))
        })
        .sum();
    assert!((one[n as usize + cell] - expected).abs() <= 1e-12 * expected.abs());
}
