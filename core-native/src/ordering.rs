//! Ordering of the unknowns and symbolic analysis: once per mesh.
//!
//! Minimum degree (AMD) is quick, and as good as nested dissection on small sheets. Large
//! sheets and volumes fill in more: there nested dissection saves half of the work or more.

use feral_amd::amd_order;
use feral_metis::metis_order;
use feral_ordering_core::{CscPattern, OrderingError};

use crate::amalgamation::{ENTRY, PASSING};
use crate::panels::{Panels, Structure};

/// Multiplications per unknown in a factorisation from which nested dissection is tried: sheets of
/// 50 000 triangles have some 3000. It takes 10 µs per unknown, which 20 solves on such a sheet, or
/// 10 on a million triangles, win back.
const COSTLY: f64 = 2000.0;

/// Orders and analyses the structure of a symmetric matrix given in full, by columns; the unknowns
/// `last` come at the end. Where there are some, the matrix is factorised again and again for these
/// alone, and nested dissection is tried at any size: a sheet of 3,000 triangles takes a tenth less.
///
/// # Errors
/// When the arrays are no such structure, or the factor is too large to index.
pub fn analyse(
    size: usize,
    column_starts: &[u32],
    rows: &[u32],
    last: &[u32],
) -> Result<Panels, String> {
    check(size, column_starts, rows)?;
    let matrix = Structure {
        starts: column_starts,
        rows,
    };
    let order = ordered(matrix, last, amd_order)
        .ok_or_else(|| "the structure has too many entries to order".to_owned())?;
    let whole = last.is_empty();
    let entry = if whole { ENTRY } else { PASSING };
    let panels = Panels::new(matrix, &order, entry);
    if whole && panels.multiplications() < COSTLY * size as f64 {
        return Ok(panels);
    }
    let Some(order) = ordered(matrix, last, metis_order) else {
        return Ok(panels);
    };
    let dissected = Panels::new(matrix, &order, entry);
    let pays = dissected.multiplications() < panels.multiplications();
    Ok(if pays { dissected } else { panels })
}

/// The order that `method` finds, the unknowns `last` at its end; `None` where it is not one of all
/// unknowns.
fn ordered(
    matrix: Structure<'_>,
    last: &[u32],
    method: impl Fn(&CscPattern<'_>) -> Result<Vec<i32>, OrderingError>,
) -> Option<Vec<u32>> {
    let size = matrix.size();
    let mut place = vec![Some(0); size];
    for &row in last {
        *place.get_mut(row as usize)? = None;
    }
    let mut first = Vec::with_capacity(size);
    for (row, place) in (0..).zip(&mut place) {
        if let Some(place) = place {
            *place = i32::try_from(first.len()).ok()?;
            first.push(row);
        }
    }
    let (mut starts, mut rows) = (vec![0], Vec::with_capacity(matrix.rows.len()));
    for &column in &first {
        let kept = matrix.column(column).iter();
        rows.extend(kept.filter_map(|&row| place[row as usize]));
        starts.push(i32::try_from(rows.len()).ok()?);
    }
    let found = method(&CscPattern::new(first.len(), &starts, &rows)?).ok()?;
    let mut order = Vec::with_capacity(size);
    for number in found {
        order.push(*first.get(usize::try_from(number).ok()?)?);
    }
    order.extend(last);
    let mut seen = vec![false; size];
    for &old in &order {
        seen[old as usize] = true;
    }
    let whole = order.len() == size && seen.iter().all(|&seen| seen);
    whole.then_some(order)
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
