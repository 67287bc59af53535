//! A square grid's Laplacian, whose solution and products are easy to check.

use std::sync::Arc;

use ndarray::{Array2, ArrayView2};
use tomoskin_core::factor::Factor;
use tomoskin_core::jacobian::{Fields, Table, jacobian};
use tomoskin_core::product::{Rows, transposed_product};
use tomoskin_core::scalar::{Scalar, c64};
use tomoskin_core::solve::solve;
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

fn largest_residual<T: Scalar>(side: usize, k: usize, scale: T, magnitude: fn(T) -> f64) -> f64 {
    let (starts, rows, values) = grid(side, 0.1);
    let n = side * side;
    let symbolic = Arc::new(Symbolic::new(n, &starts, &rows).unwrap());
    let values: Vec<T> = values.iter().map(|&value| scale * value).collect();
    let factor = Factor::new(symbolic, &values).unwrap();
    let rhs = Array2::from_shape_fn((n, k), |(i, j)| T::ONE * ((i * 7 + j * 3) % 11) as f64);
    let mut x = vec![T::ZERO; n * k];
    solve(&factor, rhs.view(), &mut x);
    let x = ArrayView2::from_shape((n, k), &x).unwrap();
    let mut residual = rhs.clone();
    for column in 0..n {
        for at in starts[column] as usize..starts[column + 1] as usize {
            for j in 0..k {
                residual[[rows[at] as usize, j]] -= values[at] * x[[column, j]];
            }
        }
    }
    residual
        .iter()
        .map(|&value| magnitude(value))
        .fold(0.0, f64::max)
}

#[test]
fn solves_to_rounding() {
    for side in [1, 2, 5, 40] {
        for k in [0, 1, 3, 8, 15, 16, 17, 40] {
            assert!(largest_residual(side, k, 1.0, f64::abs) < 1e-10);
            assert!(largest_residual(side, k, c64::new(1.0, 0.7), c64::norm) < 1e-10);
        }
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
