//! Dense matrices and their products.

use std::ops::{Index, IndexMut};

use crate::instructions::narrow;
use crate::scalar::Scalar;
use crate::tiles::Tiled;

/// A matrix by columns.
#[derive(Clone, Debug)]
pub struct Matrix<T> {
    /// Column after column.
    pub values: Vec<T>,
    /// Number of rows.
    pub height: usize,
}

impl<T: Scalar> Matrix<T> {
    /// All zero.
    pub fn zeros(height: usize, width: usize) -> Self {
        let values = vec![T::ZERO; height * width];
        Self { values, height }
    }

    /// Entry (i, j) is `entry(i, j)`.
    pub fn from_fn(height: usize, width: usize, entry: impl Fn(usize, usize) -> T) -> Self {
        let mut made = Self::zeros(height, width);
        for (j, column) in made.values.chunks_exact_mut(height.max(1)).enumerate() {
            for (i, value) in column.iter_mut().enumerate() {
                *value = entry(i, j);
            }
        }
        made
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.values.len() / self.height.max(1)
    }

    /// Its entries as an operand.
    pub fn view(&self) -> View<'_, T> {
        View {
            values: &self.values,
            strides: [1, self.height],
        }
    }

    /// Adds `scale` · left · right, `inner` the index that both share.
    pub fn add(&mut self, scale: f64, left: View<'_, T>, right: View<'_, T>, inner: usize) {
        let size = [self.height, self.width(), inner];
        let target = Target::full(&mut self.values, self.height);
        add_product(target, scale, left, right, size);
    }
}

impl<T> Index<(usize, usize)> for Matrix<T> {
    type Output = T;

    #[inline(always)]
    fn index(&self, (i, j): (usize, usize)) -> &T {
        &self.values[j * self.height + i]
    }
}

impl<T> IndexMut<(usize, usize)> for Matrix<T> {
    #[inline(always)]
    fn index_mut(&mut self, (i, j): (usize, usize)) -> &mut T {
        &mut self.values[j * self.height + i]
    }
}

/// An operand: entry (i, j) stands at i · strides[0] + j · strides[1].
#[derive(Clone, Copy, Debug)]
pub struct View<'a, T> {
    /// From its first entry on.
    pub values: &'a [T],
    /// From row to row, from column to column.
    pub strides: [usize; 2],
}

impl<T> View<'_, T> {
    /// The same entries, rows for columns.
    pub fn transposed(self) -> Self {
        let [row, column] = self.strides;
        Self {
            values: self.values,
            strides: [column, row],
        }
    }
}

/// What a product is added to: entry (i, j) stands at i + j · column.
pub struct Target<'a, T> {
    /// From its first entry on.
    pub values: &'a mut [T],
    /// From column to column.
    pub column: usize,
    /// Whether entries above the diagonal are of no use: most of them stay as they are.
    pub lower: bool,
}

impl<'a, T> Target<'a, T> {
    /// Of which only the lower triangle is of use.
    pub fn lower(values: &'a mut [T], column: usize) -> Self {
        Self {
            values,
            column,
            lower: true,
        }
    }

    /// All of which is of use.
    pub fn full(values: &'a mut [T], column: usize) -> Self {
        Self {
            values,
            column,
            lower: false,
        }
    }
}

/// A product to be added, `scale` · left · right, whose sizes have been checked.
pub struct Product<'a, T> {
    /// What it is added to.
    pub target: Target<'a, T>,
    /// A factor.
    pub scale: f64,
    /// Rows by the inner index.
    pub left: View<'a, T>,
    /// The inner index by columns.
    pub right: View<'a, T>,
    /// Rows, columns, inner index; none is zero.
    pub size: [usize; 3],
}

/// Adds `scale` · left · right, of `size` rows, columns and inner index.
///
/// # Panics
/// When an operand or the target is smaller than that.
pub fn add_product<T: Scalar>(
    target: Target<'_, T>,
    scale: f64,
    left: View<'_, T>,
    right: View<'_, T>,
    [m, n, inner]: [usize; 3],
) {
    if m * n * inner == 0 {
        return;
    }
    let reach =
        |[i, j]: [usize; 2], strides: [usize; 2]| (i - 1) * strides[0] + (j - 1) * strides[1];
    assert!(reach([m, inner], left.strides) < left.values.len());
    assert!(reach([inner, n], right.strides) < right.values.len());
    assert!(reach([m, n], [1, target.column]) < target.values.len() && m <= target.column);
    let product = Product {
        target,
        scale,
        left,
        right,
        size: [m, n, inner],
    };
    #[cfg(target_arch = "x86_64")]
    let product = match crate::assembly::add(product) {
        None => return,
        Some(left_over) => left_over,
    };
    narrow(Tiled(product));
}
