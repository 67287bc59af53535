//! Layout of a factor: which panels it has, and how each adds to its parent.

use crate::ordering::analyse;
use crate::panels::{Panels, inverse};

/// What the structure of a symmetric matrix fixes for each of its factors.
#[derive(Debug)]
pub struct Symbolic {
    n_values: usize,
    order: Vec<u32>,
    /// First column of each panel, then the size.
    starts: Vec<u32>,
    /// Where each panel's `below` begins.
    below_starts: Vec<usize>,
    below: Vec<u32>,
    /// For each entry of `below`, the row of the parent's front.
    in_parent: Vec<u32>,
    /// Where each panel's values begin.
    value_starts: Vec<usize>,
    /// For each panel, its children: `children[child_starts[p]..child_starts[p + 1]]`.
    child_starts: Vec<u32>,
    children: Vec<u32>,
    /// (position in the factor, position in the matrix) of each value of the lower triangle.
    scatter: Vec<(u32, u32)>,
}

/// Adjacent columns of the factor that share one pattern below their diagonal block.
#[derive(Clone, Copy, Debug)]
pub struct Panel<'a> {
    /// First column.
    pub start: usize,
    /// Number of columns.
    pub width: usize,
    /// Rows below the diagonal block.
    pub below: &'a [u32],
    /// For each row below, the row of the parent's front that it adds to.
    pub in_parent: &'a [u32],
    /// Panels whose rows below begin in these columns.
    pub children: &'a [u32],
    /// First value: column-major, `height()` rows.
    pub first_value: usize,
}

impl Panel<'_> {
    /// Number of rows.
    #[inline(always)]
    #[must_use]
    pub fn height(&self) -> usize {
        self.width + self.below.len()
    }

    /// Its values among those of the factor.
    #[inline(always)]
    #[must_use]
    pub fn values(&self) -> std::ops::Range<usize> {
        self.first_value..self.first_value + self.width * self.height()
    }
}

impl Symbolic {
    /// Analyses the structure of a symmetric matrix given in full, by columns.
    ///
    /// # Errors
    /// When the arrays are no such structure, or the factor is too large to index.
    pub fn new(size: usize, column_starts: &[u32], rows: &[u32]) -> Result<Self, String> {
        let mut symbolic = Self::of_panels(analyse(size, column_starts, rows)?, rows.len());
        symbolic.link_panels();
        symbolic.scatter = symbolic.scatter_of(column_starts, rows)?;
        Ok(symbolic)
    }

    fn of_panels(panels: Panels, n_values: usize) -> Self {
        let mut value_starts = vec![0];
        let ends = panels.starts.windows(2).zip(panels.below_starts.windows(2));
        for (number, (columns, below)) in ends.enumerate() {
            let (width, below) = ((columns[1] - columns[0]) as usize, below[1] - below[0]);
            value_starts.push(value_starts[number] + width * (width + below));
        }
        Self {
            n_values,
            order: panels.order,
            starts: panels.starts,
            below_starts: panels.below_starts,
            below: panels.below,
            in_parent: Vec::new(),
            value_starts,
            child_starts: Vec::new(),
            children: Vec::new(),
            scatter: Vec::new(),
        }
    }

    /// Finds each panel's parent, the panel of its first row below, and where its rows lie there.
    fn link_panels(&mut self) {
        let n_panels = self.n_panels();
        let mut panel_of = vec![0_u32; self.size()];
        for (number, columns) in self.starts.windows(2).enumerate() {
            panel_of[columns[0] as usize..columns[1] as usize].fill(number as u32);
        }
        let parent: Vec<Option<u32>> = self
            .below_starts
            .windows(2)
            .map(|ends| {
                self.below[ends[0]..ends[1]]
                    .first()
                    .map(|&row| panel_of[row as usize])
            })
            .collect();
        self.child_starts = vec![0; n_panels + 1];
        for &number in parent.iter().flatten() {
            self.child_starts[number as usize + 1] += 1;
        }
        for number in 0..n_panels {
            self.child_starts[number + 1] += self.child_starts[number];
        }
        let mut next = self.child_starts.clone();
        self.children = vec![0; self.child_starts[n_panels] as usize];
        self.in_parent = vec![0; self.below.len()];
        for (number, &parent) in parent.iter().enumerate() {
            let Some(parent) = parent.map(|number| number as usize) else {
                continue;
            };
            self.children[next[parent] as usize] = number as u32;
            next[parent] += 1;
            let (start, end) = (self.starts[parent], self.starts[parent + 1]);
            let theirs = &self.below[self.below_starts[parent]..self.below_starts[parent + 1]];
            let mut at = 0;
            for entry in self.below_starts[number]..self.below_starts[number + 1] {
                let row = self.below[entry];
                self.in_parent[entry] = if row < end {
                    row - start
                } else {
                    at += theirs[at..].partition_point(|&other| other < row);
                    end - start + at as u32
                };
            }
        }
    }

    fn scatter_of(&self, column_starts: &[u32], rows: &[u32]) -> Result<Vec<(u32, u32)>, String> {
        if u32::try_from(self.factor_len()).is_err() {
            return Err("the factor has too many values to index".into());
        }
        let place = inverse(&self.order);
        let mut row_in_front = vec![0_u32; self.size()];
        let mut scatter = Vec::with_capacity((rows.len() + self.size()) / 2);
        for number in 0..self.n_panels() {
            let panel = self.panel(number);
            for (i, &row) in panel.below.iter().enumerate() {
                row_in_front[row as usize] = (panel.width + i) as u32;
            }
            for j in 0..panel.width {
                row_in_front[panel.start + j] = j as u32;
            }
            for j in 0..panel.width {
                let column = self.order[panel.start + j] as usize;
                let first = panel.first_value + j * panel.height();
                let done = scatter.len();
                for from in column_starts[column]..column_starts[column + 1] {
                    let row = place[rows[from as usize] as usize] as usize;
                    if row >= panel.start + j {
                        scatter.push((first as u32 + row_in_front[row], from));
                    }
                }
                scatter[done..].sort_unstable();
            }
        }
        Ok(scatter)
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// Number of values that a matrix of this structure has.
    #[must_use]
    pub fn n_values(&self) -> usize {
        self.n_values
    }

    /// Number of values in a factor.
    #[must_use]
    pub fn factor_len(&self) -> usize {
        self.value_starts[self.n_panels()]
    }

    /// For each row of the factor, the row of the matrix.
    #[must_use]
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// (position in the factor, position in the matrix) of each value of the lower triangle.
    pub(crate) fn scatter(&self) -> &[(u32, u32)] {
        &self.scatter
    }

    /// Number of panels.
    #[must_use]
    pub fn n_panels(&self) -> usize {
        self.starts.len() - 1
    }

    /// Panel `number`; its children have lower numbers.
    #[inline(always)]
    #[must_use]
    pub fn panel(&self, number: usize) -> Panel<'_> {
        let start = self.starts[number] as usize;
        let below = self.below_starts[number]..self.below_starts[number + 1];
        let children = self.child_starts[number] as usize..self.child_starts[number + 1] as usize;
        Panel {
            start,
            width: self.starts[number + 1] as usize - start,
            below: &self.below[below.clone()],
            in_parent: &self.in_parent[below],
            children: &self.children[children],
            first_value: self.value_starts[number],
        }
    }
}
