//! Layout of a factor: which panels it has, and how each adds to its parent.

use std::ops::Range;

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
    /// For each panel, how many rows below are columns of the parent.
    inner: Vec<u32>,
    /// Where each panel's values begin.
    value_starts: Vec<usize>,
    /// For each panel, its children: `children[child_starts[p]..child_starts[p + 1]]`.
    child_starts: Vec<u32>,
    children: Vec<u32>,
    /// Position in the matrix of each value of the lower triangle, panel by panel.
    lower: Vec<u32>,
    /// Position in the front's columns of each of these.
    targets: Vec<u32>,
    /// Where each panel's begin.
    lower_starts: Vec<u32>,
    /// For each panel, on which of two stacks its square lies, and where.
    squares: Vec<(bool, usize)>,
    /// What the columns of the largest front take, and each of the stacks.
    workspace: [usize; 3],
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
    /// For each row below, the row of the parent's front that it adds to, padding counted.
    pub in_parent: &'a [u32],
    /// How many of these are columns of the parent.
    pub inner: usize,
    /// Panels whose rows below begin in these columns.
    pub children: &'a [u32],
    /// Whether its square lies on the second of two stacks; its children's lie on the other.
    pub odd: bool,
    /// Where its square begins there.
    pub square: usize,
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
        symbolic.scatter()?;
        symbolic.stack();
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
            inner: Vec::new(),
            value_starts,
            child_starts: Vec::new(),
            children: Vec::new(),
            lower: Vec::new(),
            targets: Vec::new(),
            lower_starts: vec![0],
            squares: Vec::new(),
            workspace: [0; 3],
        }
    }

    /// Finds each panel's parent, the panel of its first row below, and where its rows lie there.
    fn link_panels(&mut self) {
        let n_panels = self.n_panels();
        self.inner = vec![0; n_panels];
        self.squares = vec![(false, 0); n_panels];
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
                    self.inner[number] += 1;
                    row - start
                } else {
                    at += theirs[at..].partition_point(|&other| other < row);
                    top as u32 + at as u32
                };
            }
        }
    }

    /// Finds where in the fronts the values of the lower triangle belong.
    fn scatter(&mut self) -> Result<(), String> {
        let mut row_in_front = vec![0; self.size()];
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
            let mut scatter = Vec::new();
            for j in 0..panel.width {
                for (row, from) in self.row(panel.start + j) {
                    if row >= panel.start + j {
                        let to = j * shape.stride() + row_in_front[row];
                        scatter.push((to as u32, from as u32));
                    }
                }
            }
            scatter.sort_unstable();
            self.targets.extend(scatter.iter().map(|&(to, _)| to));
            self.lower.extend(scatter.iter().map(|&(_, from)| from));
            self.lower_starts.push(self.lower.len() as u32);
        }
        Ok(())
    }

    /// Finds places for the squares. Each is taken from the top of one stack when its parent, whose
    /// square lies on the other, is done.
    fn stack(&mut self) {
        let n_panels = self.n_panels();
        for number in (0..n_panels).rev() {
            let odd = !self.squares[number].0;
            for at in self.child_starts[number]..self.child_starts[number + 1] {
                self.squares[self.children[at as usize] as usize].0 = odd;
            }
        }
        let mut ends = [0; 2];
        for number in 0..n_panels {
            let panel = self.panel(number);
            let (own, shape) = (usize::from(panel.odd), panel.shape());
            if let Some(&first) = panel.children.first() {
                ends[1 - own] = self.squares[first as usize].1;
            }
            self.squares[number].1 = ends[own];
            ends[own] += shape.square_len();
            self.workspace[0] = self.workspace[0].max(shape.columns_len());
            self.workspace[1 + own] = self.workspace[1 + own].max(ends[own]);
        }
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

    /// The values of the lower triangle, panel by panel, of a matrix with these values.
    ///
    /// # Panics
    /// When there are fewer values than the structure has.
    pub(crate) fn lower<T: Copy>(&self, values: &[T]) -> Vec<T> {
        let positions = self.lower.iter();
        positions.map(|&at| values[at as usize]).collect()
    }

    /// Which values of the lower triangle are in a panel.
    #[inline(always)]
    pub(crate) fn lower_of(&self, number: usize) -> Range<usize> {
        self.lower_starts[number] as usize..self.lower_starts[number + 1] as usize
    }

    /// Positions in a front's columns of values of the lower triangle.
    #[inline(always)]
    pub(crate) fn targets(&self, values: Range<usize>) -> &[u32] {
        &self.targets[values]
    }

    /// What the columns of the largest front take, and each of the two stacks of squares.
    pub(crate) fn workspace(&self) -> [usize; 3] {
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
            inner: self.inner[number] as usize,
            odd: self.squares[number].0,
            square: self.squares[number].1,
            children: &self.children[children],
            first_value: self.value_starts[number],
        }
    }
}
