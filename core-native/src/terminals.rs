//! The resistance between terminals, and nothing else: what is solved for again and again.
//!
//! The terminals' unknowns are eliminated last. What the rest of the network leaves between them is
//! then the end of the factor, so that no column of the inverse is computed. The matrix is made of
//! what each cell conducts between each two of its nodes; a constant drives no current, so the
//! diagonal follows.

use std::sync::Arc;

use pulp::{Arch, Simd, WithSimd};

use crate::factor::eliminated;
use crate::instructions::narrow;
use crate::symbolic::Symbolic;

/// A pivot that is this part of the diagonal has lost so many digits.
const LEAST: f64 = 1e-9;

/// Cells between terminals, of any conductivity.
#[derive(Debug)]
pub struct Terminals {
    symbolic: Arc<Symbolic>,
    cells: Cells,
    /// What is in the matrix beside the cells.
    others: Vec<f64>,
    /// For each value of the lower triangle: where it stands in the matrix, and where its parts end.
    rows: Vec<(u32, u32)>,
    /// Cells' entries that are added, value after value.
    parts: Vec<u32>,
    /// Where each of the last columns of the factor is among the terminals.
    order: Vec<usize>,
    /// The diagonal's value in the matrix of each of these.
    diagonal: Vec<u32>,
    /// The first panel with one of them.
    first: usize,
}

/// What the cells conduct between their nodes, for each component of a conductivity of one.
#[derive(Debug)]
pub struct Cells {
    /// Component after component, in each pair after pair of nodes, in each all cells; of a tensor's
    /// components those on and above the diagonal, row by row.
    pub forms: Vec<f64>,
    /// Axes of a tensor; 1 for conductivities that are numbers.
    pub axes: usize,
    /// Number of cells.
    pub count: usize,
    /// Nodes of a cell.
    pub nodes: usize,
    /// Cell by cell, which value of the matrix each pair of its nodes adds to, row by row.
    pub position: Vec<u32>,
}

impl Cells {
    fn pairs(&self) -> usize {
        self.nodes * (self.nodes - 1) / 2
    }

    /// Where each component of `forms` is among all of a tensor.
    fn components(&self) -> impl Iterator<Item = usize> + use<> {
        let axes = self.axes;
        (0..axes).flat_map(move |a| (a..axes).map(move |b| a * axes + b))
    }

    fn check(&self, n_values: usize) -> Result<(), String> {
        let squares = self.count * self.nodes * self.nodes;
        if self.position.len() != squares {
            return Err(format!("position: expected {squares} entries"));
        }
        if self.forms.len() != self.components().count() * self.pairs() * self.count {
            return Err("forms: expected one for each component, pair and cell".into());
        }
        if self.position.iter().any(|&at| at as usize >= n_values) {
            return Err("position: a value that is not there".into());
        }
        Ok(())
    }

    /// (value of the matrix, cells' entry) of all that is added in the lower triangle: pairs once.
    fn entries(&self) -> impl Iterator<Item = (u32, u32)> {
        let (k, n) = (self.nodes, self.count);
        let pair = move |i: usize, j: usize| i * (2 * k - i - 1) / 2 + j - i - 1;
        (0..n).flat_map(move |cell| {
            let position = &self.position[cell * k * k..][..k * k];
            (0..k * k).map(move |at| {
                let (i, j) = (at / k, at % k);
                let number = if i == j {
                    self.pairs() + i
                } else {
                    pair(i.min(j), i.max(j))
                };
                (position[at], (number * n + cell) as u32)
            })
        })
    }
}

impl Terminals {
    /// Lays out a network, whose last rows are those of the terminals `last`.
    ///
    /// # Errors
    /// When the sizes do not fit, or the terminals are not the last rows of the factor.
    pub fn new(
        symbolic: Arc<Symbolic>,
        cells: Cells,
        others: Vec<f64>,
        last: &[u32],
    ) -> Result<Self, String> {
        cells.check(symbolic.n_values())?;
        if others.len() != symbolic.n_values() {
            return Err("contacts: expected one for each value".into());
        }
        let begin = symbolic.size() - last.len().min(symbolic.size());
        let found = symbolic.order()[begin..].iter();
        let order: Option<Vec<usize>> = found
            .map(|row| last.iter().position(|other| other == row))
            .collect();
        let order = order.ok_or("last: expected the last rows of the factor")?;
        let panels = 0..symbolic.n_panels();
        let within = |number: &usize| symbolic.panel(*number).start <= begin;
        let first = panels.rev().find(within).unwrap_or(0);
        let mut lower: Vec<u32> = (0..symbolic.n_panels())
            .flat_map(|number| symbolic.scatter(number).iter().map(|&(_, from)| from))
            .collect();
        lower.sort_unstable();
        let diagonal = (begin..symbolic.size()).map(|row| {
            let mut entries = symbolic.row(row);
            entries.find_map(|(column, at)| (column == row).then_some(at as u32))
        });
        let diagonal = diagonal.collect::<Option<_>>();
        let (rows, parts) = gathered(&lower, &cells, symbolic.n_values());
        Ok(Self {
            diagonal: diagonal.ok_or("a row without a diagonal")?,
            symbolic,
            cells,
            others,
            rows,
            parts,
            order,
            first,
        })
    }

    /// Number of terminals.
    #[must_use]
    pub fn count(&self) -> usize {
        self.order.len()
    }

    /// Writes the transfer resistance between all terminals and one more, which is at zero and comes
    /// last: row-major, its rows and columns sum to zero.
    ///
    /// `conductivity` has all cells of a component, then those of the next; of a tensor's, all
    /// components, of which those below the diagonal are not read.
    ///
    /// # Errors
    /// When a pivot is not positive, or too few digits are left; or for another size.
    pub fn resistance(
        &self,
        arch: Arch,
        conductivity: &[f64],
        out: &mut [f64],
    ) -> Result<(), String> {
        let expected = self.cells.axes * self.cells.axes * self.cells.count;
        let size = self.count() + 1;
        if conductivity.len() != expected || out.len() != size * size {
            return Err(format!("conductivity: expected {expected} values"));
        }
        let mut values = vec![0.0; self.symbolic.n_values()];
        narrow(Assembly {
            network: self,
            conductivity,
            values: &mut values,
        });
        let factor = eliminated(arch, &self.symbolic, &values, self.first)?;
        self.invert(&self.corner(&factor), &values, out)?;
        centre(out, size);
        Ok(())
    }

    /// The factor's last rows and columns, column after column; inverse on the diagonal.
    fn corner(&self, factor: &[f64]) -> Vec<f64> {
        let (n, size) = (self.count(), self.symbolic.size());
        let (begin, omitted) = (size - n, self.symbolic.panel(self.first).first_value);
        let mut corner = vec![0.0; n * n];
        for number in self.first..self.symbolic.n_panels() {
            let panel = self.symbolic.panel(number);
            let values = &factor[panel.first_value - omitted..];
            for j in begin.saturating_sub(panel.start)..panel.width {
                let column = &mut corner[(panel.start + j - begin) * n..][..n];
                let values = &values[j * panel.height()..][..panel.height()];
                for i in j..panel.width {
                    column[panel.start + i - begin] = values[i];
                }
                for (&row, &value) in panel.below.iter().zip(&values[panel.width..]) {
                    column[row as usize - begin] = value;
                }
            }
        }
        corner
    }

    /// Writes (L Lᵀ)⁻¹ in the order of the terminals, with room for one more.
    fn invert(&self, corner: &[f64], values: &[f64], out: &mut [f64]) -> Result<(), String> {
        let n = self.count();
        for (j, &at) in self.diagonal.iter().enumerate() {
            let inverse = corner[j * n + j];
            if LEAST * values[at as usize] * inverse * inverse > 1.0 {
                return Err("the matrix is singular to working precision".into());
            }
        }
        let mut inverse = vec![0.0; n * n]; // L⁻¹, column after column
        for j in 0..n {
            let column = &mut inverse[j * n..][..n];
            column[j] = 1.0;
            for i in j..n {
                let value = column[i] * corner[i * n + i];
                column[i] = value;
                for (target, factor) in column[i + 1..].iter_mut().zip(&corner[i * n + i + 1..]) {
                    *target -= factor * value;
                }
            }
        }
        for (i, &row) in self.order.iter().enumerate() {
            for (j, &column) in self.order.iter().enumerate().take(i + 1) {
                let both = inverse[i * n..][i..n].iter().zip(&inverse[j * n..][i..n]);
                let value: f64 = both.map(|(a, b)| a * b).sum();
                out[row * (n + 1) + column] = value;
                out[column * (n + 1) + row] = value;
            }
        }
        Ok(())
    }
}

/// Takes the means of all rows and columns from a symmetric matrix.
fn centre(values: &mut [f64], size: usize) {
    let part = 1.0 / size as f64;
    let means: Vec<f64> = values
        .chunks_exact(size)
        .map(|row| row.iter().sum::<f64>() * part)
        .collect();
    let mean = means.iter().sum::<f64>() * part;
    for (row, own) in values.chunks_exact_mut(size).zip(&means) {
        for (value, other) in row.iter_mut().zip(&means) {
            *value -= own + other - mean;
        }
    }
}

/// The rows of `lower`, each with the end of its parts, and the parts.
fn gathered(lower: &[u32], cells: &Cells, n_values: usize) -> (Vec<(u32, u32)>, Vec<u32>) {
    let mut wanted = vec![false; n_values];
    for &value in lower {
        wanted[value as usize] = true;
    }
    let mut entries: Vec<_> = cells
        .entries()
        .filter(|&(value, _)| wanted[value as usize])
        .collect();
    entries.sort_unstable();
    let ends = lower
        .iter()
        .map(|&value| entries.partition_point(|&(other, _)| other <= value));
    let rows = lower.iter().copied().zip(ends.map(|end| end as u32));
    (
        rows.collect(),
        entries.iter().map(|&(_, part)| part).collect(),
    )
}

struct Assembly<'a> {
    network: &'a Terminals,
    conductivity: &'a [f64],
    values: &'a mut [f64],
}

impl WithSimd for Assembly<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let cells = &self.network.cells;
        let (n, pairs) = (cells.count, cells.pairs());
        let mut entries = vec![0.0; (pairs + cells.nodes) * n];
        let (edges, corners) = entries.split_at_mut(pairs * n);
        let each = cells.forms.chunks_exact(pairs * n);
        for (forms, component) in each.zip(cells.components()) {
            let sigma = &self.conductivity[component * n..][..n];
            for (edges, forms) in edges.chunks_exact_mut(n).zip(forms.chunks_exact(n)) {
                for ((edge, form), sigma) in edges.iter_mut().zip(forms).zip(sigma) {
                    *edge += form * sigma;
                }
            }
        }
        let nodes = 0..cells.nodes;
        let ends = nodes.flat_map(|i| (i + 1..cells.nodes).map(move |j| [i, j]));
        for (edges, ends) in edges.chunks_exact(n).zip(ends) {
            for end in ends {
                for (corner, edge) in corners[end * n..][..n].iter_mut().zip(edges) {
                    *corner -= edge;
                }
            }
        }
        let mut begin = 0;
        for &(value, end) in &self.network.rows {
            let parts = &self.network.parts[begin..end as usize];
            let sum: f64 = parts.iter().map(|&part| entries[part as usize]).sum();
            self.values[value as usize] = self.network.others[value as usize] + sum;
            begin = end as usize;
        }
    }
}
