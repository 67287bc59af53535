//! How many threads, and who does which part.

use std::num::NonZero;
use std::ops::Range;
use std::sync::OnceLock;
use std::thread;

/// The number asked for, else `RAYON_NUM_THREADS`, else that of the machine.
#[must_use]
pub fn count(asked: Option<usize>) -> usize {
    static MACHINE: OnceLock<usize> = OnceLock::new();
    asked
        .or_else(|| std::env::var("RAYON_NUM_THREADS").ok()?.parse().ok())
        .filter(|&n| n > 0)
        .unwrap_or_else(|| {
            *MACHINE.get_or_init(|| thread::available_parallelism().map_or(1, NonZero::get))
        })
}

/// Runs `work` on even parts of `0..n`, each a multiple of `grain` but the last, one per thread.
pub fn split(n: usize, grain: usize, threads: usize, work: impl Fn(Range<usize>) + Sync) {
    let size = n.div_ceil(threads.max(1)).next_multiple_of(grain.max(1));
    if size >= n {
        return work(0..n);
    }
    thread::scope(|scope| {
        for first in (size..n).step_by(size) {
            let work = &work;
            scope.spawn(move || work(first..n.min(first + size)));
        }
        work(0..size);
    });
}

/// A slice whose parts several threads write.
#[derive(Clone, Copy)]
pub struct Shared<T>(*mut T, usize);

// SAFETY: `part` demands that no element is in two parts.
unsafe impl<T: Send> Send for Shared<T> {}
// SAFETY: as above.
unsafe impl<T: Send> Sync for Shared<T> {}

impl<T> Shared<T> {
    /// Shares `slice`.
    pub fn new(slice: &mut [T]) -> Self {
        Self(slice.as_mut_ptr(), slice.len())
    }

    /// Has the lines of a part brought into the caches; it may do nothing.
    #[inline(always)]
    pub fn fetch(&self, range: Range<usize>) {
        #[cfg(target_arch = "x86_64")]
        for at in range.step_by((64 / size_of::<T>()).max(1)) {
            use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
            // SAFETY: a fetch has no effect but on speed, wherever it points.
            unsafe { _mm_prefetch::<_MM_HINT_T0>(self.0.wrapping_add(at).cast()) };
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = range;
    }

    /// A part of the slice.
    ///
    /// # Safety
    /// The slice must outlive the part, and no element may be in two live parts.
    #[allow(clippy::mut_from_ref)]
    pub unsafe fn part(&self, range: Range<usize>) -> &mut [T] {
        assert!(range.start <= range.end && range.end <= self.1);
        // SAFETY: inside the slice; the caller keeps parts apart.
        unsafe { std::slice::from_raw_parts_mut(self.0.add(range.start), range.len()) }
    }
}
