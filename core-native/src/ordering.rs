//! Ordering of the unknowns and symbolic analysis: once per mesh.
//!
//! Minimum degree (faer's AMD) is quick, and as good as nested dissection on small sheets. Large
//! sheets and volumes fill in more: there nested dissection saves half of the work or more.

use faer::Side;
use faer::perm::PermRef;
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::linalg::{SupernodalThreshold, SymbolicSupernodalParams};
use feral_metis::metis_order;
use feral_ordering_core::CscPattern;

/// Adjacent panels are merged up to this many columns with up to this part of zeros.
const MERGE: &[(usize, f64)] = &[(2, 1.0), (8, 0.5), (32, 0.1), (usize::MAX, 0.02)];

/// Multiplications per unknown in a factorisation from which nested dissection is tried: sheets of
/// 50 000 triangles have some 3000. It takes 10 µs per unknown, which 20 solves on such a sheet, or
/// 10 on a million triangles, win back.
const COSTLY: f64 = 2000.0;

/// Orders and analyses the structure of a symmetric matrix given in full, by columns.
///
/// # Errors
/// When the arrays are no such structure, or the factor is too large to index.
pub fn analyse(
    size: usize,
    column_starts: &[u32],
    rows: &[u32],
) -> Result<SymbolicCholesky<u32>, String> {
    check(size, column_starts, rows)?;
    let matrix =
        SymbolicSparseColMatRef::new_unsorted_checked(size, size, column_starts, None, rows);
    let analysis = with_ordering(matrix, SymmetricOrdering::Amd)?;
    if multiplications(&analysis) < COSTLY * size as f64 {
        return Ok(analysis);
    }
    let Some(order) = dissect(size, column_starts, rows) else {
        return Ok(analysis);
    };
    let mut place = vec![0; size];
    for (new, &old) in order.iter().enumerate() {
        place[old as usize] = new as u32;
    }
    let order = PermRef::new_checked(&order, &place, size);
    let dissected = with_ordering(matrix, SymmetricOrdering::Custom(order))?;
    let pays = multiplications(&dissected) < multiplications(&analysis);
    Ok(if pays { dissected } else { analysis })
}

fn with_ordering(
    matrix: SymbolicSparseColMatRef<'_, u32>,
    ordering: SymmetricOrdering<'_, u32>,
) -> Result<SymbolicCholesky<u32>, String> {
    let params = CholeskySymbolicParams {
        // below zero: a diagonal matrix, too, gets panels
        supernodal_flop_ratio_threshold: SupernodalThreshold(-1.0),
        supernodal_params: SymbolicSupernodalParams { relax: Some(MERGE) },
        ..Default::default()
    };
    factorize_symbolic_cholesky(matrix, Side::Lower, ordering, params)
        .map_err(|error| format!("the symbolic analysis failed: {error:?}"))
}

fn multiplications(analysis: &SymbolicCholesky<u32>) -> f64 {
    let SymbolicCholeskyRaw::Supernodal(panels) = analysis.raw() else {
        return 0.0;
    };
    let ends = panels.supernode_begin().iter().zip(panels.supernode_end());
    let panels = ends.enumerate().map(|(number, (&begin, &end))| {
        let below = panels.supernode(number).pattern().len() as f64;
        let width = f64::from(end - begin);
        // Σ (below + j)² / 2 over the columns j, as an integral
        ((below + width).powi(3) - below.powi(3)) / 6.0
    });
    panels.sum()
}

/// Nested dissection; `None` where it finds no order of all unknowns.
fn dissect(size: usize, column_starts: &[u32], rows: &[u32]) -> Option<Vec<u32>> {
    let signed = |part: &[u32]| {
        part.iter()
            .map(|&v| i32::try_from(v).ok())
            .collect::<Option<_>>()
    };
    let (starts, rows): (Vec<i32>, Vec<i32>) = (signed(column_starts)?, signed(rows)?);
    let order = metis_order(&CscPattern::new(size, &starts, &rows)?).ok()?;
    let mut seen = vec![false; size];
    for &old in &order {
        *seen.get_mut(usize::try_from(old).ok()?)? = true;
    }
    let whole = order.len() == size && seen.iter().all(|&seen| seen);
    whole.then(|| order.iter().map(|&old| old as u32).collect())
}

/// Checks that the arrays hold the whole structure of a symmetric matrix, rows ascending.
pub(crate) fn check(size: usize, column_starts: &[u32], rows: &[u32]) -> Result<(), String> {
    if size == 0 || column_starts.len() != size + 1 {
        return Err(format!(
            "expected indptr of length n + 1 with n > 0, got n = {size} and length {}",
            column_starts.len()
        ));
    }
    if column_starts[0] != 0 || column_starts[size] as usize != rows.len() {
        return Err(format!(
            "expected indptr from 0 to {}, got {} to {}",
            rows.len(),
            column_starts[0],
            column_starts[size]
        ));
    }
    if let Some(column) = column_starts.windows(2).position(|ends| ends[0] > ends[1]) {
        return Err(format!("indptr decreases at column {column}"));
    }
    for (column, ends) in column_starts.windows(2).enumerate() {
        let within = &rows[ends[0] as usize..ends[1] as usize];
        if !within.windows(2).all(|pair| pair[0] < pair[1]) {
            return Err(format!(
                "row indices of column {column} are not in ascending order"
            ));
        }
        if within.last().is_some_and(|&row| row as usize >= size) {
            return Err(format!(
                "a row index beyond {} in column {column}",
                size - 1
            ));
        }
        if within.binary_search(&(column as u32)).is_err() {
            return Err(format!("column {column} has no diagonal entry"));
        }
    }
    // columns ascend, and so do the rows of each: its next row is the column that names it
    let mut next = column_starts.to_vec();
    for column in 0..size {
        for &row in &rows[column_starts[column] as usize..column_starts[column + 1] as usize] {
            let at = &mut next[row as usize];
            if rows.get(*at as usize) != Some(&(column as u32)) {
                return Err(format!("row {row} and column {column} are not symmetric"));
            }
            *at += 1;
        }
    }
    Ok(())
}
