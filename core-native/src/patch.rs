//! The local update: a patch of cells changes, and only its rim is seen from outside.
//!
//! Nodes inside the patch are eliminated, from the cells as they were and as they are, side by
//! side, in the order of least degree. The difference of what is left on the rim changes the
//! system there (Woodbury), with the inverse of the base system between the nodes of the rim.

use pulp::bytemuck::fill_zeroes;
use pulp::{Simd, WithSimd};

use crate::dense::{Matrix, Target, add_product};
use crate::instructions::narrow;
use crate::linear::solve;
use crate::scalar::{Scalar, c64};

/// A number of a base state as one of a changed state, which may be complex where the base is not.
pub trait Lift<T>: Scalar {
    /// The same number.
    fn lift(self) -> T;
}

impl<T: Scalar> Lift<T> for T {
    #[inline(always)]
    fn lift(self) -> T {
        self
    }
}

impl Lift<c64> for f64 {
    #[inline(always)]
    fn lift(self) -> c64 {
        c64::new(self, 0.0)
    }
}

/// The cells of a mesh.
#[derive(Debug)]
pub struct Cells {
    /// Nodes of each cell.
    nodes: Vec<u32>,
    /// Nodes of one cell.
    per_cell: usize,
    /// The matrix of each cell for a unit conductivity, row-major.
    matrices: Vec<f64>,
    /// Cells at each node; of a node that must stay, more than there are.
    valence: Vec<u32>,
}

impl Cells {
    /// Lays out the cells; nodes that are `held` (on electrodes) are never eliminated.
    ///
    /// # Errors
    /// When a size does not fit or a node is not there.
    pub fn new(
        nodes: Vec<u32>,
        per_cell: usize,
        matrices: Vec<f64>,
        held: &[bool],
    ) -> Result<Self, String> {
        if per_cell == 0 || nodes.len() * per_cell != matrices.len() {
            return Err("local: expected a matrix for each cell".into());
        }
        let mut valence: Vec<u32> = held.iter().map(|&held| u32::from(held) << 31).collect();
        for &node in &nodes {
            let count = valence.get_mut(node as usize);
            *count.ok_or_else(|| format!("cells: there is no node {node}"))? += 1;
        }
        Ok(Self {
            nodes,
            per_cell,
            matrices,
            valence,
        })
    }

    /// Number of cells.
    #[must_use]
    pub fn len(&self) -> usize {
        self.nodes.len() / self.per_cell
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Number of nodes.
    #[must_use]
    pub fn n_nodes(&self) -> usize {
        self.valence.len()
    }

    fn nodes_of(&self, cell: usize) -> &[u32] {
        &self.nodes[cell * self.per_cell..][..self.per_cell]
    }
}

/// What is known of the base state.
#[derive(Debug)]
pub struct Base<B> {
    /// Conductivity of each cell.
    pub conductivity: Vec<B>,
    /// Fields of 1 A into each electrode but the last, `width` to a node.
    pub fields: Vec<B>,
    /// Number of those fields.
    pub width: usize,
    /// Their potentials at these electrodes, row-major.
    pub grounded: Vec<B>,
    /// Columns of the inverse, of those nodes that have been asked for.
    pub columns: Vec<Option<Box<[B]>>>,
}

/// Cells and what they change to.
#[derive(Clone, Copy, Debug)]
pub struct Touch<'a, T> {
    /// The cells.
    pub cells: &'a [i64],
    /// Conductivity of each.
    pub conductivity: &'a [T],
}

/// Why there is no result.
#[derive(Debug)]
pub enum Refusal {
    /// A cell that is not there or stands twice, or a conductivity that is not positive.
    Impossible,
    /// A pivot was not positive.
    Singular,
    /// The columns of these nodes are needed first.
    Missing(Vec<u32>),
}

/// Results of a touch, row-major, one row and column for each field.
#[derive(Debug)]
pub struct Changed<'a, T> {
    /// Transfer resistance against the ground electrode.
    pub grounded: &'a mut [T],
    /// How far rounding may have shifted it.
    pub lost: &'a mut [T],
}

/// A touch that is tried in several depths.
#[derive(Clone, Copy, Debug)]
pub struct Shape<'a> {
    /// The cells.
    pub cells: &'a [i64],
    /// What changes of the logarithm of each one's conductivity, in a depth of one.
    pub height: &'a [f64],
    /// The depths, fewer than the workspace has lanes.
    pub depths: &'a [f64],
}

/// Memory that touches share, one after the other: matrices of `L` conductivities side by side, the
/// first of which is as it was.
#[derive(Debug)]
pub struct Workspace<T, const L: usize = 2> {
    seen: Vec<bool>,
    place: Vec<u32>,
    patch: Patch<T, L>,
    lanes: Vec<[T; L]>,
}

/// A touched patch, its nodes numbered as they were found.
#[derive(Debug)]
struct Patch<T, const L: usize> {
    nodes: Vec<u32>,
    touched: Vec<u32>,
    rim: Vec<u32>,
    inside: Vec<u32>,
    /// Nodes of the cells in the patch's numbers.
    corners: Vec<u32>,
    /// Neighbours of each node, a bit for each.
    graph: Vec<u64>,
    degree: Vec<u32>,
    /// Matrix before and after, row-major; of use is the lower triangle only.
    matrix: Vec<[T; L]>,
    list: Vec<u32>,
    column: Vec<[T; L]>,
}

impl<T: Scalar, const L: usize> Workspace<T, L> {
    /// Memory for touches of these cells.
    #[must_use]
    pub fn new(cells: &Cells) -> Self {
        Self {
            seen: vec![false; cells.len()],
            place: vec![0; cells.n_nodes()],
            patch: Patch {
                nodes: Vec::new(),
                touched: Vec::new(),
                rim: Vec::new(),
                inside: Vec::new(),
                corners: Vec::new(),
                graph: Vec::new(),
                degree: Vec::new(),
                matrix: Vec::new(),
                list: Vec::new(),
                column: Vec::new(),
            },
            lanes: Vec::new(),
        }
    }

    /// The nodes of the numbered patch's rim, whose columns are there; none where no two are.
    fn rim<B>(&self, base: &Base<B>) -> Result<Vec<u32>, Refusal> {
        let node = |&local: &u32| self.patch.nodes[local as usize];
        let mut nodes: Vec<u32> = self.patch.rim.iter().map(node).collect();
        let absent = |&node: &u32| base.columns[node as usize].is_none();
        let missing: Vec<u32> = nodes.iter().copied().filter(absent).collect();
        if !missing.is_empty() {
            return Err(Refusal::Missing(missing));
        }
        if nodes.len() < 2 {
            nodes.clear();
        }
        Ok(nodes)
    }

    /// Eliminates the nodes inside the numbered patch, whose cells have these lanes.
    fn condense(&mut self, cells: &Cells, index: &[i64]) -> Result<(), Refusal> {
        self.patch.assemble(cells, index, &self.lanes);
        let condense = Condense {
            patch: &mut self.patch,
        };
        narrow(condense).ok_or(Refusal::Singular)
    }

    /// Refuses cells that are not there or stand twice, or numbers that are `wrong`.
    fn check(&mut self, n_cells: usize, index: &[i64], wrong: bool) -> Result<(), Refusal> {
        let mut marked = 0;
        for &cell in index {
            let cell = usize::try_from(cell).unwrap_or(usize::MAX);
            if cell >= n_cells || self.seen[cell] {
                break;
            }
            self.seen[cell] = true;
            marked += 1;
        }
        for &cell in &index[..marked] {
            self.seen[cell as usize] = false;
        }
        if !wrong && marked == index.len() {
            return Ok(());
        }
        Err(Refusal::Impossible)
    }

    /// Numbers the nodes of the patch; inside are those all of whose cells are touched.
    fn number(&mut self, cells: &Cells, index: &[i64]) {
        let patch = &mut self.patch;
        patch.nodes.clear();
        patch.touched.clear();
        patch.corners.clear();
        for &cell in index {
            for &node in cells.nodes_of(cell as usize) {
                let place = &mut self.place[node as usize];
                if *place == 0 {
                    patch.nodes.push(node);
                    patch.touched.push(0);
                    *place = patch.nodes.len() as u32;
                }
                patch.touched[*place as usize - 1] += 1;
                patch.corners.push(*place - 1);
            }
        }
        patch.rim.clear();
        patch.inside.clear();
        for (local, (&node, &touched)) in (0_u32..).zip(patch.nodes.iter().zip(&patch.touched)) {
            self.place[node as usize] = 0;
            if cells.valence[node as usize] == touched {
                patch.inside.push(local);
            } else {
                patch.rim.push(local);
            }
        }
    }
}

impl<T: Scalar> Workspace<T> {
    /// Computes what one touch changes.
    ///
    /// # Errors
    /// See [`Refusal`].
    pub fn update<B: Lift<T>>(
        &mut self,
        cells: &Cells,
        base: &Base<B>,
        touch: Touch<'_, T>,
        out: Changed<'_, T>,
    ) -> Result<(), Refusal> {
        for (to, from) in out.grounded.iter_mut().zip(&base.grounded) {
            *to = from.lift();
        }
        out.lost.fill(T::ZERO);
        let positive = touch.conductivity.iter().all(|value| value.conducts());
        let fits = touch.cells.len() == touch.conductivity.len();
        self.check(cells.len(), touch.cells, !(positive && fits))?;
        self.number(cells, touch.cells);
        let nodes = self.rim(base)?;
        if nodes.is_empty() {
            return Ok(());
        }
        let touched = touch.cells.iter().zip(touch.conductivity);
        self.lanes.clear();
        self.lanes.extend(
            touched.map(|(&cell, &after)| [base.conductivity[cell as usize].lift(), after]),
        );
        self.condense(cells, touch.cells)?;
        woodbury(&self.patch, &nodes, base, out);
        Ok(())
    }
}

impl<const L: usize> Workspace<f64, L> {
    /// Computes what a touch takes away in each of its depths, `width` by `width` numbers each.
    ///
    /// # Errors
    /// See [`Refusal`].
    pub fn scaled(
        &mut self,
        cells: &Cells,
        base: &Base<f64>,
        shape: Shape<'_>,
        out: &mut [f64],
    ) -> Result<(), Refusal> {
        out.fill(0.0);
        let finite = shape.height.iter().all(|value| value.is_finite());
        let fits = shape.cells.len() == shape.height.len() && shape.depths.len() < L;
        self.check(cells.len(), shape.cells, !(finite && fits))?;
        self.number(cells, shape.cells);
        let nodes = self.rim(base)?;
        if nodes.is_empty() {
            return Ok(());
        }
        self.lanes.clear();
        for (&cell, &height) in shape.cells.iter().zip(shape.height) {
            let mut lanes = [base.conductivity[cell as usize]; L];
            for (lane, &depth) in lanes[1..].iter_mut().zip(shape.depths) {
                *lane *= (depth * height).exp();
            }
            self.lanes.push(lanes);
        }
        self.condense(cells, shape.cells)?;
        let rim = Rim::new(&nodes, base);
        let places = out.chunks_exact_mut(base.width * base.width);
        for (lane, out) in (1..=shape.depths.len()).zip(places) {
            let (change, _) = self.patch.change(lane);
            rim.lessen(&change, out);
        }
        Ok(())
    }
}

/// The base system as the rim of a patch sees it, against its first node.
struct Rim {
    between: Matrix<f64>,
    fields: Matrix<f64>,
}

impl Rim {
    fn new(nodes: &[u32], base: &Base<f64>) -> Self {
        let width = base.width;
        let field = |row: usize, k: usize| base.fields[nodes[row] as usize * width + k];
        Self {
            between: between(nodes, base),
            fields: Matrix::from_fn(nodes.len() - 1, width, |row, k| {
                field(row + 1, k) - field(0, k)
            }),
        }
    }

    /// Writes Uᵀ (I + A C)⁻¹ A U of a `change` A.
    fn lessen(&self, change: &Matrix<f64>, out: &mut [f64]) {
        let (m, width) = (self.fields.height, self.fields.width());
        let mut system = Matrix::from_fn(m, m, |i, j| if i == j { 1.0 } else { 0.0 });
        system.add(1.0, self.between.view(), change.view(), m);
        let mut current = Matrix::zeros(m, width);
        current.add(1.0, change.view(), self.fields.view(), m);
        solve(&system, &mut current);
        let target = Target::full(out, width);
        let fields = self.fields.view().transposed();
        add_product(target, 1.0, fields, current.view(), [width, width, m]);
    }
}

impl<T: Scalar, const L: usize> Patch<T, L> {
    fn words(&self) -> usize {
        self.nodes.len().div_ceil(64)
    }

    /// Fills matrix and graph from cells, each with the conductivities of its lanes.
    fn assemble(&mut self, cells: &Cells, index: &[i64], lanes: &[[T; L]]) {
        let (n, words, k) = (self.nodes.len(), self.words(), cells.per_cell);
        let long_enough = self.matrix.len().max(n * n);
        self.matrix.resize(long_enough, [T::ZERO; L]);
        for (i, row) in self.matrix.chunks_exact_mut(n).take(n).enumerate() {
            fill_zeroes(row[..=i].as_flattened_mut());
        }
        self.graph.clear();
        self.graph.resize(n * words, 0);
        for ((&cell, lanes), corners) in index.iter().zip(lanes).zip(self.corners.chunks_exact(k)) {
            let unit = &cells.matrices[cell as usize * k * k..][..k * k];
            for (&i, row) in corners.iter().zip(unit.chunks_exact(k)) {
                for (&j, &value) in corners.iter().zip(row) {
                    self.graph[i as usize * words + j as usize / 64] |= 1 << (j % 64);
                    if j <= i {
                        let sums = &mut self.matrix[i as usize * n + j as usize];
                        for (sum, &lane) in sums.iter_mut().zip(lanes) {
                            *sum += lane * value;
                        }
                    }
                }
            }
        }
    }

    /// Takes the node inside that has the fewest neighbours.
    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        let degree = |&(_, &local): &(usize, &u32)| self.degree[local as usize];
        let (at, _) = self.inside.iter().enumerate().min_by_key(degree)?;
        Some(self.inside.swap_remove(at) as usize)
    }

    /// Lists the neighbours of a node, makes them neighbours of each other, and drops the node.
    #[inline(always)]
    fn unlink(&mut self, node: usize) {
        let words = self.words();
        self.graph[node * words + node / 64] &= !(1 << (node % 64));
        self.list.clear();
        for word in 0..words {
            let mut bits = self.graph[node * words + word];
            while bits != 0 {
                self.list.push((word * 64) as u32 + bits.trailing_zeros());
                bits &= bits - 1;
            }
        }
        for &other in &self.list {
            let other = other as usize;
            let mut degree = 0;
            for word in 0..words {
                let own = self.graph[node * words + word];
                let theirs = &mut self.graph[other * words + word];
                *theirs |= own;
                if word == node / 64 {
                    *theirs &= !(1 << (node % 64));
                }
                degree += theirs.count_ones();
            }
            self.degree[other] = degree;
        }
    }

    /// Subtracts from the listed nodes what the eliminated one contributes.
    #[inline(always)]
    fn subtract(&mut self, node: usize) -> Option<()> {
        let n = self.nodes.len();
        let mut scale = self.matrix[node * n + node];
        for pivot in &mut scale {
            *pivot = T::ONE / pivot.pivot()?;
        }
        self.column.clear();
        for &other in &self.list {
            let (low, high) = (node.min(other as usize), node.max(other as usize));
            let mut values = self.matrix[high * n + low];
            for (value, &scale) in values.iter_mut().zip(&scale) {
                *value *= scale;
            }
            self.column.push(values);
        }
        for (at, (&i, by)) in self.list.iter().zip(&self.column).enumerate() {
            let row = &mut self.matrix[i as usize * n..][..n];
            for (&j, value) in self.list[..=at].iter().zip(&self.column) {
                for ((entry, &by), &value) in row[j as usize].iter_mut().zip(by).zip(value) {
                    *entry -= by * value;
                }
            }
        }
        Some(())
    }
}

impl<T: Scalar, const L: usize> Patch<T, L> {
    /// The change of the system on the rim without its first node, in a lane, and the current that
    /// leaks from each of the others.
    fn change(&self, lane: usize) -> (Matrix<T>, Vec<T>) {
        let (n, m) = (self.nodes.len(), self.rim.len() - 1);
        let mut change = Matrix::zeros(m, m);
        let mut leak = vec![T::ZERO; m + 1];
        for (i, &row) in self.rim.iter().enumerate() {
            // The rim's numbers ascend, so that this is the lower triangle.
            let row = &self.matrix[row as usize * n..][..n];
            for (j, &column) in self.rim[..=i].iter().enumerate() {
                let lanes = row[column as usize];
                let value = lanes[lane] - lanes[0];
                leak[i] += value;
                if j < i {
                    leak[j] += value;
                }
                if j > 0 {
                    change[(i - 1, j - 1)] = value;
                    change[(j - 1, i - 1)] = value;
                }
            }
        }
        leak.remove(0);
        (change, leak)
    }
}

struct Condense<'a, T, const L: usize> {
    patch: &'a mut Patch<T, L>,
}

impl<T: Scalar, const L: usize> WithSimd for Condense<'_, T, L> {
    type Output = Option<()>;

    /// Eliminates all nodes inside; nothing where a pivot is not positive.
    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Self::Output {
        let patch = self.patch;
        let rows = patch.graph.chunks_exact(patch.words());
        let degree = |row: &[u64]| row.iter().map(|word| word.count_ones()).sum::<u32>();
        patch.degree.clear();
        patch.degree.extend(rows.map(degree));
        while let Some(node) = patch.next() {
            patch.unlink(node);
            patch.subtract(node)?;
        }
        Some(())
    }
}

/// R' = R − Uᵀ (I + A C)⁻¹ A U on the rim, against its first node; see `update.py`.
///
/// Rounding shows in what the solve leaves over, and in the current that leaks from a rim at one
/// potential, where none should flow.
fn woodbury<T: Scalar, B: Lift<T>>(
    patch: &Patch<T, 2>,
    nodes: &[u32],
    base: &Base<B>,
    out: Changed<'_, T>,
) {
    let (m, width) = (nodes.len() - 1, base.width);
    let (change, leak) = patch.change(1);
    let between = between(nodes, base);
    let field = |row: usize, k: usize| -> T { base.fields[nodes[row] as usize * width + k].lift() };
    let fields = Matrix::from_fn(m, width, |row, k| field(row + 1, k) - field(0, k));

    // by rows: both are symmetric, so that (I + A C)ᵀ = I + C A
    let mut system = Matrix::from_fn(m, m, |i, j| if i == j { T::ONE } else { T::ZERO });
    system.add(1.0, between.view(), change.view(), m);
    let mut current = Matrix::zeros(m, width);
    current.add(1.0, change.view(), fields.view(), m);
    solve(&system, &mut current);
    let mut changed = fields.clone();
    changed.add(-1.0, between.view(), current.view(), m);
    let mut residual =
        Matrix::from_fn(m, width, |i, k| leak[i] * changed[(i, k)] - current[(i, k)]);
    residual.add(1.0, change.view(), changed.view(), m);

    let mut result = Matrix::zeros(width, width);
    result.add(1.0, fields.view().transposed(), current.view(), m);
    let mut lost = Matrix::zeros(width, width);
    lost.add(1.0, changed.view().transposed(), residual.view(), m);
    for i in 0..width {
        for j in 0..width {
            out.grounded[i * width + j] -= result[(i, j)];
            out.lost[i * width + j] = lost[(i, j)];
        }
    }
}

/// The inverse of the base system between the rim's nodes, against the first; it is symmetric.
fn between<T: Scalar, B: Lift<T>>(nodes: &[u32], base: &Base<B>) -> Matrix<T> {
    let m = nodes.len() - 1;
    let origin = base.columns[nodes[0] as usize]
        .as_deref()
        .unwrap_or_default();
    let origin: Vec<T> = nodes
        .iter()
        .map(|&row| origin[row as usize].lift())
        .collect();
    let mut out = Matrix::zeros(m, m);
    for (j, &node) in nodes[1..].iter().enumerate() {
        let column = base.columns[node as usize].as_deref().unwrap_or_default();
        let first = column[nodes[0] as usize].lift() - origin[0];
        for (i, &row) in nodes[1..].iter().enumerate().skip(j) {
            let value = column[row as usize].lift() - origin[i + 1] - first;
            out[(i, j)] = value;
            out[(j, i)] = value;
        }
    }
    out
}
