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
    /// What is in the lower triangle beside the cells, panel by panel; all else counts so, too.
    others: Vec<f64>,
    /// Pair after pair of nodes, in each all cells: which edge they are.
    edge: Vec<u32>,
    /// Each edge's value, and the diagonal's at its ends.
    edges: Vec<[u32; 3]>,
    /// Where each of the last columns of the factor is among the terminals.
    order: Vec<usize>,
    /// The diagonal's value of each of these.
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

    /// Each pair of nodes of a cell.
    fn ends(&self) -> impl Iterator<Item = [usize; 2]> + use<> {
        let nodes = self.nodes;
        (0..nodes).flat_map(move |i| (i + 1..nodes).map(move |j| [i, j]))
    }

    /// Which edge each pair is, and the edges, in the order of their values: `place` has that of
    /// each value of the matrix in the lower triangle, or more than there are.
    fn edges(&self, place: &[u32]) -> (Vec<u32>, Vec<[u32; 3]>) {
        let k = self.nodes;
        let found = self.ends().flat_map(|[i, j]| {
            self.position.chunks_exact(k * k).map(move |position| {
                let at = |i: usize, j: usize| place[position[i * k + j] as usize];
                [at(i, j).min(at(j, i)), at(i, i), at(j, j)]
            })
        });
        let found: Vec<_> = found.collect();
        let mut edges = found.clone();
        edges.sort_unstable();
        edges.dedup_by_key(|edge| edge[0]);
        let number = |edge: &[u32; 3]| edges.partition_point(|other| other[0] < edge[0]) as u32;
        (found.iter().map(number).collect(), edges)
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
        others: &[f64],
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
        let mut place = vec![u32::MAX; symbolic.n_values()];
        let all: Vec<u32> = (0..).take(place.len()).collect();
        for (at, value) in (0..).zip(symbolic.lower(&all)) {
            place[value as usize] = at;
        }
        let diagonal = (begin..symbolic.size()).map(|row| {
            let mut entries = symbolic.row(row);
            entries.find_map(|(column, at)| (column == row).then_some(place[at]))
        });
        let diagonal = diagonal.collect::<Option<_>>();
        let (edge, edges) = cells.edges(&place);
        Ok(Self {
            diagonal: diagonal.ok_or("a row without a diagonal")?,
            others: symbolic.lower(others),
            symbolic,
            cells,
            edge,
            edges,
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
        let mut values = self.others.clone();
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

struct Assembly<'a> {
    network: &'a Terminals,
    conductivity: &'a [f64],
    /// What is added to.
    values: &'a mut [f64],
}

impl WithSimd for Assembly<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let cells = &self.network.cells;
        let (n, pairs) = (cells.count, cells.pairs());
        let mut conducted = vec![0.0; pairs * n];
        let each = cells.forms.chunks_exact(pairs * n);
        for (forms, component) in each.zip(cells.components()) {
            let sigma = &self.conductivity[component * n..][..n];
            for (pair, forms) in conducted.chunks_exact_mut(n).zip(forms.chunks_exact(n)) {
                for ((value, form), sigma) in pair.iter_mut().zip(forms).zip(sigma) {
                    *value += form * sigma;
                }
            }
        }
        let mut sums = vec![0.0; self.network.edges.len()];
        for (&edge, value) in self.network.edge.iter().zip(&conducted) {
            sums[edge as usize] += value;
        }
        for (&[at, first, second], sum) in self.network.edges.iter().zip(&sums) {
            self.values[at as usize] += sum;
            self.values[first as usize] -= sum;
            self.values[second as usize] -= sum;
        }
    }
}
