//! Panels of a factor, against elimination by sets.

use std::collections::BTreeSet;

use tomoskin_core::panels::{Panels, Structure};

/// Structure of a square grid with both diagonals in each square, and one node that stands alone.
fn grid(side: usize) -> (Vec<u32>, Vec<u32>) {
    let (mut starts, mut rows) = (vec![0], Vec::new());
    for column in 0..side * side {
        let (i, j) = (column / side, column % side);
        for near in 0..9 {
            let (k, l) = (
                (i + near / 3).wrapping_sub(1),
                (j + near % 3).wrapping_sub(1),
            );
            if k < side && l < side {
                rows.push((k * side + l) as u32);
            }
        }
        starts.push(rows.len() as u32);
    }
    rows.push((side * side) as u32);
    starts.push(rows.len() as u32);
    (starts, rows)
}

/// Rows below the diagonal of each column of the factor.
fn filled(matrix: Structure<'_>, order: &[u32]) -> Vec<BTreeSet<u32>> {
    let place = |old: u32| order.iter().position(|&other| other == old).unwrap() as u32;
    let below = |(column, &old): (u32, &u32)| {
        let rows = matrix.column(old).iter().map(|&row| place(row));
        rows.filter(|&row| row > column).collect()
    };
    let mut columns: Vec<BTreeSet<u32>> = (0..).zip(order).map(below).collect();
    for number in 0..columns.len() {
        let rows = columns[number].clone();
        if let Some(&parent) = rows.first() {
            columns[parent as usize].extend(rows.range(parent + 1..));
        }
    }
    columns
}

#[test]
fn panels_hold_the_factor_and_few_zeros() {
    for side in [1, 2, 7, 16] {
        let (starts, rows) = grid(side);
        let matrix = Structure {
            starts: &starts,
            rows: &rows,
        };
        let n = matrix.size() as u32;
        let natural: Vec<u32> = (0..n).collect();
        let scattered: Vec<u32> = (0..n).map(|k| (k * 101) % n).collect();
        for order in [
            natural.clone(),
            natural.iter().rev().copied().collect(),
            scattered,
        ] {
            let mut distinct = order.clone();
            distinct.sort_unstable();
            if distinct != natural {
                continue; // 101 divides the size
            }
            check(matrix, &order, side);
        }
    }
}

fn check(matrix: Structure<'_>, order: &[u32], side: usize) {
    let panels = Panels::new(matrix, order, 80.0);
    let mut sorted = panels.order.clone();
    sorted.sort_unstable();
    assert!(sorted.iter().copied().eq(0..matrix.size() as u32));
    let columns = filled(matrix, &panels.order);
    let asked = filled(matrix, order);
    let entries = |columns: &[BTreeSet<u32>]| columns.iter().map(BTreeSet::len).sum::<usize>();
    assert_eq!(entries(&columns), entries(&asked)); // it fills in the same
    let mut held = 0;
    for (ends, below) in panels.starts.windows(2).zip(panels.below_starts.windows(2)) {
        let below = &panels.below[below[0]..below[1]];
        assert!(below.windows(2).all(|pair| pair[0] < pair[1]));
        let last = &columns[ends[1] as usize - 1];
        assert!(last.iter().eq(below)); // merging adds no rows below the last column
        for column in ends[0]..ends[1] {
            let rows = &columns[column as usize];
            let inside = |row: &u32| *row < ends[1] || below.binary_search(row).is_ok();
            assert!(rows.iter().all(inside));
            held += (ends[1] - column) as usize - 1 + below.len();
        }
    }
    let ratio = held as f64 / entries(&columns).max(1) as f64;
    assert!(ratio <= 2.0, "{side}: {held}, {ratio}");
}
