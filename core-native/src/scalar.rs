//! The two number types of a system matrix.

use faer::traits::ComplexField;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real or complex number of double precision.
pub trait Scalar:
    ComplexField
    + Copy
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

    /// The diagonal entry of the factor for this pivot.
    ///
    /// `None` where the real part is not positive: each pivot's is, when that of the matrix is
    /// positive definite.
    fn pivot(self) -> Option<Self>;

    /// Whether it is finite, with a positive real part.
    fn conducts(self) -> bool;

    /// Square of its absolute value.
    fn norm_sqr(self) -> f64;
}

impl Scalar for f64 {
    const ZERO: Self = 0.0;
    const ONE: Self = 1.0;

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
}

impl Scalar for faer::c64 {
    const ZERO: Self = Self { re: 0.0, im: 0.0 };
    const ONE: Self = Self { re: 1.0, im: 0.0 };

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
}
