//! Panels of a factor for a given order of the unknowns: which columns, and which rows below them.

use crate::amalgamation::amalgamated;

/// No column.
const NONE: u32 = u32::MAX;

/// The structure of a symmetric matrix given in full, by columns.
#[derive(Clone, Copy, Debug)]
pub struct Structure<'a> {
    /// Where each column begins, then the number of entries.
    pub starts: &'a [u32],
    /// Rows of the entries.
    pub rows: &'a [u32],
}

impl Structure<'_> {
    /// Number of rows and columns.
    pub fn size(&self) -> usize {
        self.starts.len() - 1
    }

    /// Rows of a column's entries.
    pub fn column(&self, number: u32) -> &[u32] {
        let number = number as usize;
        &self.rows[self.starts[number] as usize..self.starts[number + 1] as usize]
    }
}

/// The structure of a factor.
#[derive(Debug)]
pub struct Panels {
    /// For each row of the factor, the row of the matrix.
    pub order: Vec<u32>,
    /// First column of each panel, then the size.
    pub starts: Vec<u32>,
    /// Where each panel's `below` begins, then its length.
    pub below_starts: Vec<usize>,
    /// Rows below the diagonal blocks, ascending in each panel.
    pub below: Vec<u32>,
}

impl Panels {
    /// The panels of the factor in this order of the rows, or in one that fills in the same, where an
    /// entry takes the time of so many multiplications beside its own.
    pub fn new(matrix: Structure<'_>, order: &[u32], entry: f64) -> Self {
        let tree = elimination_tree(matrix, order);
        let post = postorder(&tree);
        let place = inverse(&post);
        let moved = |&old: &u32| match tree[old as usize] {
            NONE => NONE,
            parent => place[parent as usize],
        };
        let tree: Vec<u32> = post.iter().map(moved).collect();
        let order: Vec<u32> = post.iter().map(|&old| order[old as usize]).collect();
        let (column_starts, rows) = lower(matrix, &order);
        let lower = Structure {
            starts: &column_starts,
            rows: &rows,
        };
        let (merged, starts) = amalgamated(&tree, &column_counts(lower, &tree), entry);
        let order: Vec<u32> = merged.iter().map(|&old| order[old as usize]).collect();
        let (column_starts, rows) = self::lower(matrix, &order);
        let lower = Structure {
            starts: &column_starts,
            rows: &rows,
        };
        let (below_starts, below) = rows_below(lower, &starts);
        Self {
            order,
            starts,
            below_starts,
            below,
        }
    }

    /// Multiplications that a factorisation takes.
    pub fn multiplications(&self) -> f64 {
        let ends = self.starts.windows(2).zip(self.below_starts.windows(2));
        ends.map(|(columns, below)| {
            let width = f64::from(columns[1] - columns[0]);
            let below = (below[1] - below[0]) as f64;
            // Σ (below + j)² / 2 over the columns j, as an integral
            ((below + width).powi(3) - below.powi(3)) / 6.0
        })
        .sum()
    }
}

/// The inverse of a permutation.
pub fn inverse(order: &[u32]) -> Vec<u32> {
    let mut place = vec![0; order.len()];
    for (new, &old) in (0..).zip(order) {
        place[old as usize] = new;
    }
    place
}

/// The structure below the diagonal, in this order; rows of a column in any.
fn lower(matrix: Structure<'_>, order: &[u32]) -> (Vec<u32>, Vec<u32>) {
    let place = inverse(order);
    let mut starts = vec![0];
    let mut rows = Vec::with_capacity(matrix.rows.len() / 2);
    for (column, &old) in (0..).zip(order) {
        let places = matrix.column(old).iter().map(|&row| place[row as usize]);
        rows.extend(places.filter(|&row| row > column));
        starts.push(rows.len() as u32);
    }
    (starts, rows)
}

/// For each column, the first row below its diagonal in the factor, by way of shortened paths
/// (Liu 1986).
fn elimination_tree(matrix: Structure<'_>, order: &[u32]) -> Vec<u32> {
    let place = inverse(order);
    let mut parent = vec![NONE; order.len()];
    let mut ancestor = parent.clone();
    for (row, &old) in (0..).zip(order) {
        for &other in matrix.column(old) {
            let mut at = place[other as usize];
            while at < row {
                let next = std::mem::replace(&mut ancestor[at as usize], row);
                if next == NONE {
                    parent[at as usize] = row;
                }
                at = next;
            }
        }
    }
    parent
}

/// The columns, each after its children and these in ascending order.
fn postorder(parent: &[u32]) -> Vec<u32> {
    let mut child = vec![NONE; parent.len()];
    let mut sibling = child.clone();
    for (node, &parent) in (0..parent.len()).zip(parent).rev() {
        if parent != NONE {
            sibling[node] = std::mem::replace(&mut child[parent as usize], node as u32);
        }
    }
    let mut post = Vec::with_capacity(parent.len());
    let mut path = Vec::new();
    for root in (0..)
        .zip(parent)
        .filter(|(_, up)| **up == NONE)
        .map(|(node, _)| node)
    {
        path.push(root);
        while let Some(&node) = path.last() {
            match child[node as usize] {
                NONE => post.extend(path.pop()),
                next => {
                    child[node as usize] = sibling[next as usize];
                    path.push(next);
                }
            }
        }
    }
    post
}

/// Entries of each column of the factor, for a postordered tree (Gilbert, Ng & Peyton 1994).
///
/// A row of the factor is the subtree whose leaves are among the row's entries in the matrix; paths
/// from two leaves that follow each other meet at their lowest common ancestor.
fn column_counts(lower: Structure<'_>, parent: &[u32]) -> Vec<u32> {
    let size = parent.len();
    let mut first: Vec<u32> = (0..size as u32).collect();
    let mut change = vec![1_i32; size];
    for (node, &up) in parent.iter().enumerate() {
        if up != NONE {
            first[up as usize] = first[up as usize].min(first[node]);
            change[up as usize] = 0;
        }
    }
    let mut ancestor: Vec<u32> = (0..size as u32).collect();
    let mut leaf = vec![NONE; size];
    for (node, &up) in (0..).zip(parent) {
        if up != NONE {
            change[up as usize] -= 1;
        }
        for &row in lower.column(node) {
            let last = std::mem::replace(&mut leaf[row as usize], node);
            if last != NONE && last >= first[node as usize] {
                continue; // an ancestor of the last one, no leaf
            }
            change[node as usize] += 1;
            if last != NONE {
                change[root(&mut ancestor, last) as usize] -= 1;
            }
        }
        if up != NONE {
            ancestor[node as usize] = up;
        }
    }
    for (node, &up) in parent.iter().enumerate() {
        if up != NONE {
            change[up as usize] += change[node];
        }
    }
    change.into_iter().map(i32::cast_unsigned).collect()
}

/// The last ancestor so far; the path to it is shortened.
fn root(ancestor: &mut [u32], node: u32) -> u32 {
    let mut top = node;
    while ancestor[top as usize] != top {
        top = ancestor[top as usize];
    }
    let mut at = node;
    while at != top {
        at = std::mem::replace(&mut ancestor[at as usize], top);
    }
    top
}

/// Rows below each panel: those of its columns and of its children.
fn rows_below(lower: Structure<'_>, starts: &[u32]) -> (Vec<usize>, Vec<u32>) {
    let n_panels = starts.len() - 1;
    let mut panel_of = vec![0; lower.size()];
    let mut seen = vec![NONE; lower.size()];
    let (mut child, mut sibling) = (vec![NONE; n_panels], vec![NONE; n_panels]);
    let (mut below_starts, mut below) = (vec![0], Vec::new());
    for (number, columns) in (0..).zip(starts.windows(2)) {
        panel_of[columns[0] as usize..columns[1] as usize].fill(number);
    }
    for (number, columns) in (0_u32..).zip(starts.windows(2)) {
        let first = below.len();
        let mut add = |below: &mut Vec<u32>, row: u32| {
            if row >= columns[1] && std::mem::replace(&mut seen[row as usize], number) != number {
                below.push(row);
            }
        };
        for column in columns[0]..columns[1] {
            for &row in lower.column(column) {
                add(&mut below, row);
            }
        }
        let mut next = child[number as usize];
        while next != NONE {
            for at in below_starts[next as usize]..below_starts[next as usize + 1] {
                let row = below[at];
                add(&mut below, row);
            }
            next = sibling[next as usize];
        }
        below[first..].sort_unstable();
        below_starts.push(below.len());
        if let Some(&row) = below.get(first) {
            let parent = panel_of[row as usize] as usize;
            sibling[number as usize] = std::mem::replace(&mut child[parent], number);
        }
    }
    (below_starts, below)
}
