//! Products and dense systems, against the sums that define them.

use pulp::Arch;
use tomoskin_core::dense::{Matrix, Product, Target, View, add_product};
use tomoskin_core::linear::solve;
use tomoskin_core::scalar::{Scalar, c64};
use tomoskin_core::tiles::Tiled;

const SIZES: [[usize; 3]; 7] = [
    [1, 1, 1],
    [3, 5, 2],
    [17, 9, 33],
    [48, 8, 16],
    [50, 50, 7],
    [40, 23, 300],
    [401, 13, 5],
];

/// Numbers that look random and are the same every time.
fn numbers<T: Scalar>(count: usize, unit: T) -> Vec<T> {
    let mut state = 12_345_u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(1 << 23) - 1.0
    };
    (0..count)
        .map(|_| T::ONE * next() + unit * next())
        .collect()
}

/// How far `add` is off, at most, in what it writes; it must leave the rest alone.
fn off<T: Scalar>(unit: T, lower: bool, turned: bool, add: fn(Product<'_, T>)) -> f64 {
    let mut worst: f64 = 0.0;
    for [m, n, inner] in SIZES {
        let (left, right) = (numbers(m * inner, unit), numbers(inner * n, unit));
        let strides = |rows, columns| if turned { [columns, 1] } else { [1, rows] };
        let (down, across) = (strides(m, inner), strides(inner, n));
        let before = numbers((m + 3) * n, unit);
        let mut after = before.clone();
        let target = Target {
            values: &mut after,
            column: m + 3,
            lower,
        };
        add(Product {
            target,
            scale: -0.5,
            left: View {
                values: &left,
                strides: down,
            },
            right: View {
                values: &right,
                strides: across,
            },
            size: [m, n, inner],
        });
        for j in 0..n {
            for i in 0..m + 3 {
                let (was, is) = (before[j * (m + 3) + i], after[j * (m + 3) + i]);
                if i >= m {
                    assert!(is == was);
                } else if i >= j || !lower {
                    let mut sum = was;
                    for p in 0..inner {
                        let product =
                            left[i * down[0] + p * down[1]] * right[p * across[0] + j * across[1]];
                        sum += product * -0.5;
                    }
                    worst = worst.max((is - sum).norm_sqr().sqrt());
                }
            }
        }
    }
    worst
}

fn as_it_comes<T: Scalar>(product: Product<'_, T>) {
    let Product {
        target,
        scale,
        left,
        right,
        size,
    } = product;
    add_product(target, scale, left, right, size);
}

fn by_tiles<T: Scalar>(product: Product<'_, T>) {
    Arch::new().dispatch(Tiled(product));
}

fn by_plain_tiles<T: Scalar>(product: Product<'_, T>) {
    Arch::Scalar.dispatch(Tiled(product));
}

#[test]
fn products_are_sums_of_products() {
    for (lower, turned) in [(false, false), (false, true), (true, false), (true, true)] {
        for add in [as_it_comes, by_tiles, by_plain_tiles] {
            assert!(off(0.0, lower, turned, add) < 1e-12);
        }
        for add in [as_it_comes, by_tiles, by_plain_tiles] {
            assert!(off(c64::new(0.0, 1.0), lower, turned, add) < 1e-12);
        }
    }
}

#[test]
#[should_panic(expected = "len")]
fn a_target_that_is_too_small_is_refused() {
    let left = Matrix::<f64>::zeros(4, 4);
    let mut values = [0.0; 15];
    add_product(
        Target::full(&mut values, 4),
        1.0,
        left.view(),
        left.view(),
        [4, 4, 4],
    );
}

fn left_over<T: Scalar>(m: usize, unit: T) -> f64 {
    let transposed = Matrix {
        values: numbers(m * m, unit),
        height: m,
    };
    let rhs = Matrix {
        values: numbers(m * 3, unit),
        height: m,
    };
    let mut x = rhs.clone();
    solve(&transposed, &mut x);
    let mut rest = rhs;
    rest.add(-1.0, transposed.view().transposed(), x.view(), m);
    let size = |values: &[T]| {
        values
            .iter()
            .map(|value| value.norm_sqr().sqrt())
            .fold(0.0, f64::max)
    };
    size(&rest.values) / size(&x.values)
}

#[test]
fn systems_are_solved_to_rounding() {
    for m in [1, 2, 12, 47, 48, 49, 60, 97, 131] {
        assert!(left_over(m, 0.0) < 1e-12 * m as f64);
        assert!(left_over(m, c64::new(0.0, 1.0)) < 1e-12 * m as f64);
    }
}

#[test]
fn rows_are_exchanged_and_a_singular_system_gives_no_number() {
    for m in [6, 60] {
        // ones beside the diagonal in pairs of rows: each pivot stands in another row
        let swapped = Matrix::from_fn(m, m, |i, j| if i ^ 1 == j { 1.0 } else { 0.0 });
        let mut x = Matrix::from_fn(m, 1, |i, _| i as f64);
        solve(&swapped, &mut x);
        assert!((0..m).all(|i| x[(i, 0)] == (i ^ 1) as f64));
        let mut x = Matrix::from_fn(m, 1, |_, _| 1.0);
        solve(&Matrix::zeros(m, m), &mut x);
        assert!(x.values.iter().all(|value| value.is_nan()));
    }
}
