//! Layout of a factor: which panels it has, and how each adds to its parent.

use crate::kernel::Shape;
use crate::ordering::analyse;
use crate::panels::{Panels, inverse};

/// What the structure of a symmetric matrix fixes for each of its factors.
#[derive(Debug)]
pub struct Symbolic {
    /// Where each column of the matrix begins.
    column_starts: Vec<u32>,
    /// Rows of the matrix's entries.
    rows: Vec<u32>,
    order: Vec<u32>,
    /// For each row of the matrix, that of the factor.
    place: Vec<u32>,
    /// First column of each panel, then the size.
    starts: Vec<u32>,
    /// Where each panel's `below` begins.
    below_starts: Vec<usize>,
    below: Vec<u32>,
    /// For each entry of `below`, the row of the parent's front, padding counted.
    in_parent: Vec<u32>,
    /// Where each panel's values begin.
    value_starts: Vec<usize>,
    /// For each panel, its children: `children[child_starts[p]..child_starts[p + 1]]`.
    child_starts: Vec<u32>,
    children: Vec<u32>,
    /// (position in the front's columns, position in the matrix) of each value of the lower
    /// triangle, panel by panel.
    scatter: Vec<(u32, u32)>,
    /// Where each panel's entries of `scatter` begin.
    scatter_starts: Vec<u32>,
    /// What the columns of the largest front take, and all squares that there are at a time.
    workspace: [usize; 2],
}

type Scatter = (Vec<(u32, u32)>, Vec<u32>);

/// Adjacent columns of the factor that share one pattern below their diagonal block.
#[derive(Clone, Copy, Debug)]
pub struct Panel<'a> {
    /// First column.
    pub start: usize,
    /// Number of columns.
    pub width: usize,
    /// Rows below the diagonal block.
    pub below: &'a [u32],
    /// For each row below, the row of the parent's front that it adds to, padding counted.
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

    /// The size of its front.
    #[inline(always)]
    pub(crate) fn shape(&self) -> Shape {
        Shape {
            width: self.width,
            below: self.below.len(),
        }
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
        Self::ending(size, column_starts, rows, &[])
    }

    /// The same, with the rows `last` eliminated after all others.
    ///
    /// # Errors
    /// As above.
    pub fn ending(
        size: usize,
        column_starts: &[u32],
        rows: &[u32],
        last: &[u32],
    ) -> Result<Self, String> {
        let mut symbolic = Self::of_panels(analyse(size, column_starts, rows, last)?);
        (symbolic.column_starts, symbolic.rows) = (column_starts.to_vec(), rows.to_vec());
        symbolic.link_panels();
        (symbolic.scatter, symbolic.scatter_starts) = symbolic.scatter_of()?;
        symbolic.workspace = symbolic.workspace_of();
        Ok(symbolic)
    }

    fn of_panels(panels: Panels) -> Self {
        let mut value_starts = vec![0];
        let ends = panels.starts.windows(2).zip(panels.below_starts.windows(2));
        for (number, (columns, below)) in ends.enumerate() {
            let (width, below) = ((columns[1] - columns[0]) as usize, below[1] - below[0]);
            value_starts.push(value_starts[number] + width * (width + below));
        }
        Self {
            column_starts: Vec::new(),
            rows: Vec::new(),
            place: inverse(&panels.order),
            order: panels.order,
            starts: panels.starts,
            below_starts: panels.below_starts,
            below: panels.below,
            in_parent: Vec::new(),
            value_starts,
            child_starts: Vec::new(),
            children: Vec::new(),
            scatter: Vec::new(),
            scatter_starts: Vec::new(),
            workspace: [0; 2],
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
            let top = self.panel(parent).shape().top();
            let mut at = 0;
            for entry in self.below_starts[number]..self.below_starts[number + 1] {
                let row = self.below[entry];
                self.in_parent[entry] = if row < end {
                    row - start
                } else {
                    at += theirs[at..].partition_point(|&other| other < row);
                    top as u32 + at as u32
                };
            }
        }
    }

    fn scatter_of(&self) -> Result<Scatter, String> {
        let mut row_in_front = vec![0; self.size()];
        let mut scatter = Vec::with_capacity((self.rows.len() + self.size()) / 2);
        let mut starts = vec![0];
        for number in 0..self.n_panels() {
            let panel = self.panel(number);
            let shape = panel.shape();
            if u32::try_from(shape.columns_len()).is_err() {
                return Err("the factor has too many values to index".into());
            }
            for (i, &row) in panel.below.iter().enumerate() {
                row_in_front[row as usize] = shape.top() + i;
            }
            for j in 0..panel.width {
                row_in_front[panel.start + j] = j;
            }
            for j in 0..panel.width {
                let done = scatter.len();
                for (row, from) in self.row(panel.start + j) {
                    if row >= panel.start + j {
                        let to = j * shape.stride() + row_in_front[row];
                        scatter.push((to as u32, from as u32));
                    }
                }
                scatter[done..].sort_unstable();
            }
            starts.push(scatter.len() as u32);
        }
        Ok((scatter, starts))
    }

    /// See `workspace`. Squares lie one after the other; a panel's takes the place of its children's
    /// when it is done.
    fn workspace_of(&self) -> [usize; 2] {
        let (mut columns, mut squares, mut end) = (0, 0, 0);
        for number in 0..self.n_panels() {
            let panel = self.panel(number);
            let square = panel.shape().square_len();
            columns = columns.max(panel.shape().columns_len());
            squares = squares.max(end + square);
            end = end + square - self.children_len(panel);
        }
        [columns, squares]
    }

    /// What the squares of a panel's children take.
    pub(crate) fn children_len(&self, panel: Panel<'_>) -> usize {
        let squares = panel
            .children
            .iter()
            .map(|&child| self.panel(child as usize));
        squares.map(|child| child.shape().square_len()).sum()
    }

    /// Number of rows and columns.
    #[must_use]
    pub fn size(&self) -> usize {
        self.order.len()
    }

    /// Number of values that a matrix of this structure has.
    #[must_use]
    pub fn n_values(&self) -> usize {
        self.rows.len()
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

    /// For each row of the matrix, that of the factor.
    pub(crate) fn place(&self) -> &[u32] {
        &self.place
    }

    /// Columns, as the factor counts them, of the values in a row of the factor's; and where in the
    /// matrix they stand.
    #[inline(always)]
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (usize, usize)> {
        let row = self.order[row] as usize;
        let entries = self.column_starts[row] as usize..self.column_starts[row + 1] as usize;
        let columns = self.rows[entries.clone()].iter();
        columns
            .map(|&column| self.place[column as usize] as usize)
            .zip(entries)
    }

    /// (position in the front's columns, position in the matrix) of each value that a panel has of
    /// the matrix.
    #[inline(always)]
    pub(crate) fn scatter(&self, number: usize) -> &[(u32, u32)] {
        let starts = &self.scatter_starts[number..number + 2];
        &self.scatter[starts[0] as usize..starts[1] as usize]
    }

    /// What the columns of the largest front take, and all squares that there are at a time.
    pub(crate) fn workspace(&self) -> [usize; 2] {
        self.workspace
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
