//! What columns of an inverse leave over, and what that may cost, in one pass over the matrix.

use pulp::{Arch, Simd, WithSimd};

use crate::instructions::run;
use crate::kernel::tile;
use crate::lanes::{ABREAST, GROUP, Lanes, flat};
use crate::scalar::Scalar;
use crate::symbolic::Symbolic;

/// Rows whose residuals stay in the first cache while they are multiplied with the solution.
const TILE: usize = 64;
/// Columns of the solution in a tile of products.
const WIDE: usize = 4;

/// A matrix, and columns of what should be its inverse.
pub(crate) struct Columns<'a, T> {
    /// The matrix's structure, whose order of rows all of this is in.
    pub symbolic: &'a Symbolic,
    /// The matrix's values.
    pub values: &'a [T],
    /// In which row the unit of each column stands.
    pub units: &'a [u32],
    /// The columns X, sixteen at a time.
    pub x: &'a [Vec<Lanes<T>>],
}

impl<T: Scalar> Columns<'_, T> {
    /// Writes Xᵀ (E − A X), E the units, row-major (k, k), and gives the largest entry of E − A X in
    /// size; NaN where a number of it is.
    pub fn residual(&self, arch: Arch, lost: &mut [T]) -> f64 {
        let k = self.units.len();
        let mut largest = 0.0_f64;
        for (group, units) in self.units.chunks(ABREAST).enumerate() {
            let mut sums = vec![Lanes::ZERO; ABREAST * self.x.len()];
            let found = run(
                arch,
                Pass {
                    columns: self,
                    own: &self.x[group],
                    units,
                    sums: &mut sums,
                },
            );
            largest = if largest > found { largest } else { found };
            if largest.is_nan() {
                break;
            }
            for (sum, target) in sums.iter().zip(lost.chunks_exact_mut(k)) {
                target[group * ABREAST..][..units.len()].copy_from_slice(&sum.0[..units.len()]);
            }
        }
        largest.sqrt()
    }
}

/// A pass over the matrix for some of the columns.
struct Pass<'a, T> {
    columns: &'a Columns<'a, T>,
    own: &'a [Lanes<T>],
    units: &'a [u32],
    /// The products of each column of the solution with the residuals.
    sums: &'a mut [Lanes<T>],
}

impl<T: Scalar> WithSimd for Pass<'_, T> {
    type Output = f64;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> f64 {
        let mut sizes = Sizes([[0.0; ABREAST]; 2]);
        let n = self.own.len();
        let group = GROUP * size_of::<T::Vector<S>>() / size_of::<T>();
        let mut left = [Lanes::<T>::ZERO; TILE]; // and so are columns beyond the last
        for begin in (0..n).step_by(TILE) {
            let rows = begin..n.min(begin + TILE);
            for (left, row) in left.iter_mut().zip(rows.clone()) {
                for at in (0..self.units.len()).step_by(group) {
                    self.product(simd, left, at, row);
                }
            }
            for (column, &unit) in self.units.iter().enumerate() {
                if rows.contains(&(unit as usize)) {
                    left[unit as usize - begin].0[column] += T::ONE;
                }
            }
            let left = &left[..rows.len()];
            left.iter().for_each(|left| sizes.add(left));
            for (sums, x) in self.sums.chunks_exact_mut(ABREAST).zip(self.columns.x) {
                for at in (0..self.units.len()).step_by(group) {
                    add_products::<S, T>(simd, sums, at, &x[rows.clone()], left);
                }
            }
        }
        sizes.largest()
    }
}

impl<T: Scalar> Pass<'_, T> {
    /// Writes a group of vectors from `at` on of a row of − A X.
    #[inline(always)]
    fn product<S: Simd>(&self, simd: S, left: &mut Lanes<T>, at: usize, row: usize) {
        let zero = T::zeros(simd);
        let mut sums = [zero; GROUP];
        for (column, from) in self.columns.symbolic.row(row) {
            let value = T::factor(simd, self.columns.values[from]);
            let known = &T::vectors::<S>(&self.own[column].0[at..])[..GROUP];
            for (sum, &known) in sums.iter_mut().zip(known) {
                *sum = T::plus_product(simd, known, value, *sum);
            }
        }
        let left = T::vectors_mut::<S>(&mut left.0[at..]);
        for (value, sum) in left.iter_mut().zip(sums) {
            *value = T::less(simd, zero, sum);
        }
    }
}

/// The largest squares of absolute values in each column, and NaN where a number is not finite.
struct Sizes([[f64; ABREAST]; 2]);

impl Sizes {
    #[inline(always)]
    fn add<T: Scalar>(&mut self, row: &Lanes<T>) {
        let [largest, poison] = &mut self.0;
        for i in 0..ABREAST {
            let size = row.0[i].norm_sqr();
            largest[i] = if size > largest[i] { size } else { largest[i] };
            poison[i] += size * 0.0;
        }
    }

    fn largest(self) -> f64 {
        let all = self.0.into_iter().flatten();
        all.fold(0.0, |a, b| if a > b || a.is_nan() { a } else { b })
    }
}

/// Adds Xᵀ R over some rows, a group of vectors of R from `at` on.
#[inline(always)]
fn add_products<S: Simd, T: Scalar>(
    simd: S,
    sums: &mut [Lanes<T>],
    at: usize,
    x: &[Lanes<T>],
    left: &[Lanes<T>],
) {
    let one = T::factor(simd, T::ONE);
    let (x, left, depth) = (flat(x), flat(left), x.len());
    for column in (0..ABREAST).step_by(WIDE) {
        let products = tile::<S, T, GROUP, WIDE>(simd, &left[at..], &x[column..], ABREAST, depth);
        for (sum, products) in sums[column..].iter_mut().zip(products) {
            let sum = T::vectors_mut::<S>(&mut sum.0[at..]);
            for (sum, product) in sum.iter_mut().zip(products) {
                *sum = T::plus_product(simd, product, one, *sum);
            }
        }
    }
}
