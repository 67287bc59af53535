//! Several vectors side by side.

use crate::scalar::Scalar;

/// Vectors side by side: what one pass over a matrix or a factor serves.
pub const ABREAST: usize = 16;

/// Registers of a row that are worked on at a time: those of four rows leave room for factors.
pub const GROUP: usize = 2;

/// One row of several vectors, in cache lines of its own.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub struct Lanes<T>(pub [T; ABREAST]);

impl<T: Scalar> Lanes<T> {
    /// Zeros.
    pub const ZERO: Self = Self([T::ZERO; ABREAST]);

    /// Whether all of it is zero.
    #[inline(always)]
    pub fn is_zero(&self) -> bool {
        // without an early end, so that several are compared at a time
        self.0
            .iter()
            .fold(true, |zero, &value| zero & (value == T::ZERO))
    }
}

/// All numbers of these rows, one row after the other.
#[inline(always)]
pub fn flat<T: Scalar>(rows: &[Lanes<T>]) -> &[T] {
    const { assert!(size_of::<Lanes<T>>() == ABREAST * size_of::<T>()) };
    // SAFETY: `Lanes` is an array without padding, as the line above has the compiler check.
    unsafe { std::slice::from_raw_parts(rows.as_ptr().cast(), rows.len() * ABREAST) }
}
