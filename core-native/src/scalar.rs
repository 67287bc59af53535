//! The two number types of a system matrix.

use pulp::Simd;
use pulp::bytemuck::Pod;
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
}
