//! The two number types of a system matrix.

use pulp::bytemuck::{Pod, cast};
use pulp::{Scalar128b, Simd};
use std::any::TypeId;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A complex number.
pub use num_complex::Complex64 as c64;

/// A real or complex number of double precision.
pub trait Scalar:
    Pod
    + Debug
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Div<Output = Self>
    + MulAssign
    + Mul<Output = Self>
    + Mul<f64, Output = Self>
    + Neg<Output = Self>
    + SubAssign
    + Sub<Output = Self>
    + Send
    + Sync
    + 'static
{
    /// Zero.
    const ZERO: Self;
    /// One.
    const ONE: Self;
    /// How many real numbers it is.
    const REALS: usize;

    /// The diagonal entry of the factor for this pivot.
    ///
    /// `None` where the real part is not positive: each pivot's is, when that of the matrix is
    /// positive definite.
    fn pivot(self) -> Option<Self>;

    /// Whether it is finite, with a positive real part.
    fn conducts(self) -> bool;

    /// Square of its absolute value.
    fn norm_sqr(self) -> f64;

    /// The number times the imaginary unit; a real number, itself.
    fn turned(self) -> Self;

    /// As many as a register of `S` holds.
    type Vector<S: Simd>: Copy;
    /// One number, ready to be multiplied with vectors.
    type Factor<S: Simd>: Copy;

    /// The whole vectors of a slice from its begin on.
    fn vectors<S: Simd>(values: &[Self]) -> &[Self::Vector<S>];

    /// The whole vectors of a slice from its begin on.
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [Self::Vector<S>];

    /// Zeros.
    fn zeros<S: Simd>(simd: S) -> Self::Vector<S>;

    /// A number as a factor.
    fn factor<S: Simd>(simd: S, value: Self) -> Self::Factor<S>;

    /// a b + c, rounded once where the processor does so.
    fn plus_product<S: Simd>(
        simd: S,
        a: Self::Vector<S>,
        b: Self::Factor<S>,
        c: Self::Vector<S>,
    ) -> Self::Vector<S>;

    /// a b.
    fn times<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Factor<S>) -> Self::Vector<S>;

    /// a − b.
    fn less<S: Simd>(simd: S, a: Self::Vector<S>, b: Self::Vector<S>) -> Self::Vector<S>;

    /// Writes x b₀ + y b₁ to the first and x c₀ + y c₁ to the second, entry by entry.
    #[inline(always)]
    fn two_sums<S: Simd>(
        _: S,
        [first, second]: [&mut [Self]; 2],
        [x, y]: [&[Self]; 2],
        [b0, b1, c0, c1]: [&[Self]; 4],
    ) {
        let n = first.len();
        let (second, x, y) = (&mut second[..n], &x[..n], &y[..n]);
        let (b0, b1, c0, c1) = (&b0[..n], &b1[..n], &c0[..n], &c1[..n]);
        for i in 0..n {
            let (x, y) = (x[i], y[i]);
            first[i] = x * b0[i] + y * b1[i];
            second[i] = x * c0[i] + y * c1[i];
        }
    }
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;
    const REALS: usize = 1;

    #[inline(always)]
    fn pivot(self) -> Option<Self> {
        self.conducts().then(|| self.sqrt())
    }

    #[inline(always)]
    fn conducts(self) -> bool {
        self > 0.0 && self.is_finite()
    }

    #[inline(always)]
    fn norm_sqr(self) -> f64 {
        self * self
    }

    #[inline(always)]
    fn turned(self) -> Self {
        self
    }

    type Vector<S: Simd> = S::f64s;
    type Factor<S: Simd> = S::f64s;

    #[inline(always)]
    fn vectors<S: Simd>(values: &[Self]) -> &[S::f64s] {
        S::as_simd_f64s(values).0
    }

    #[inline(always)]
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::f64s] {
        S::as_mut_simd_f64s(values).0
    }

    #[inline(always)]
    fn zeros<S: Simd>(simd: S) -> S::f64s {
        simd.splat_f64s(Self::ZERO)
    }

    #[inline(always)]
    fn less<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.sub_f64s(a, b)
    }

    #[inline(always)]
    fn factor<S: Simd>(simd: S, value: Self) -> S::f64s {
        simd.splat_f64s(value)
    }

    #[inline(always)]
    fn plus_product<S: Simd>(simd: S, a: S::f64s, b: S::f64s, c: S::f64s) -> S::f64s {
        if TypeId::of::<S>() == TypeId::of::<Scalar128b>() {
            return simd.add_f64s(simd.mul_f64s(a, b), c); // a fused one would be a call
        }
        simd.mul_add_e_f64s(a, b, c)
    }

    #[inline(always)]
    fn times<S: Simd>(simd: S, a: S::f64s, b: S::f64s) -> S::f64s {
        simd.mul_f64s(a, b)
    }

    /// By hand: the compiler works out anew in each turn how many there are.
    #[inline(always)]
    fn two_sums<S: Simd>(
        simd: S,
        [first, second]: [&mut [Self]; 2],
        [x, y]: [&[Self]; 2],
        [b0, b1, c0, c1]: [&[Self]; 4],
    ) {
        let n = first.len();
        let (x, xs) = S::as_simd_f64s(&x[..n]);
        let (y, ys) = S::as_simd_f64s(&y[..n]);
        let (b0, b0s) = S::as_simd_f64s(&b0[..n]);
        let (b1, b1s) = S::as_simd_f64s(&b1[..n]);
        let (c0, c0s) = S::as_simd_f64s(&c0[..n]);
        let (c1, c1s) = S::as_simd_f64s(&c1[..n]);
        let (first, firsts) = S::as_mut_simd_f64s(first);
        let (second, seconds) = S::as_mut_simd_f64s(&mut second[..n]);
        let known = x
            .iter()
            .zip(y)
            .zip(b0.iter().zip(b1))
            .zip(c0.iter().zip(c1));
        let targets = first.iter_mut().zip(second);
        for ((first, second), (((&x, &y), (&b0, &b1)), (&c0, &c1))) in targets.zip(known) {
            *first = simd.add_f64s(simd.mul_f64s(x, b0), simd.mul_f64s(y, b1));
            *second = simd.add_f64s(simd.mul_f64s(x, c0), simd.mul_f64s(y, c1));
        }
        for i in 0..firsts.len() {
            firsts[i] = xs[i] * b0s[i] + ys[i] * b1s[i];
            seconds[i] = xs[i] * c0s[i] + ys[i] * c1s[i];
        }
    }
}

impl Scalar for c64 {
    const ZERO: Self = Self { re: 0.0, im: 0.0 };
    const ONE: Self = Self { re: 1.0, im: 0.0 };
    const REALS: usize = 2;

    #[inline(always)]
    fn pivot(self) -> Option<Self> {
        self.conducts().then(|| self.sqrt())
    }

    #[inline(always)]
    fn conducts(self) -> bool {
        self.re > 0.0 && self.is_finite()
    }

    #[inline(always)]
    fn norm_sqr(self) -> f64 {
        self.re * self.re + self.im * self.im
    }

    #[inline(always)]
    fn turned(self) -> Self {
        Self::new(-self.im, self.re)
    }

    type Vector<S: Simd> = S::c64s;
    type Factor<S: Simd> = [S::f64s; 2];

    #[inline(always)]
    fn vectors<S: Simd>(values: &[Self]) -> &[S::c64s] {
        S::as_simd_c64s(values).0
    }

    #[inline(always)]
    fn vectors_mut<S: Simd>(values: &mut [Self]) -> &mut [S::c64s] {
        S::as_mut_simd_c64s(values).0
    }

    #[inline(always)]
    fn zeros<S: Simd>(simd: S) -> S::c64s {
        simd.splat_c64s(Self::ZERO)
    }

    #[inline(always)]
    fn less<S: Simd>(simd: S, a: S::c64s, b: S::c64s) -> S::c64s {
        simd.sub_c64s(a, b)
    }

    /// (re b, re b, …) and (−im b, im b, …): a b is a times the one and a with its parts exchanged
    /// times the other.
    #[inline(always)]
    fn factor<S: Simd>(simd: S, value: Self) -> [S::f64s; 2] {
        [
            simd.splat_f64s(value.re),
            cast(simd.splat_c64s(Self::new(-value.im, value.im))),
        ]
    }

    #[inline(always)]
    fn plus_product<S: Simd>(simd: S, a: S::c64s, b: [S::f64s; 2], c: S::c64s) -> S::c64s {
        let sum = f64::plus_product(simd, cast(a), b[0], cast(c));
        let exchanged = cast(simd.swap_re_im_c64s(a));
        cast(f64::plus_product(simd, exchanged, b[1], sum))
    }

    #[inline(always)]
    fn times<S: Simd>(simd: S, a: S::c64s, b: [S::f64s; 2]) -> S::c64s {
        let exchanged = cast(simd.swap_re_im_c64s(a));
        let product = simd.mul_f64s(cast(a), b[0]);
        cast(f64::plus_product(simd, exchanged, b[1], product))
    }
}
