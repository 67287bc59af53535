//! Which vector instructions run.
//!
//! Factors and solves, whose tiles stay in registers, use the widest that the processor has. All
//! else makes streams or short rows, which lose by vectors wider than 256 bits.

use pulp::{Arch, Scalar128b, Simd, WithSimd};

/// Runs with these instructions; without any, with pairs of numbers, which every compiler knows how
/// to keep together.
#[inline]
pub(crate) fn run<Op: WithSimd>(arch: Arch, op: Op) -> Op::Output {
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V4(simd) => Simd::vectorize(simd, op),
        #[cfg(target_arch = "x86_64")]
        Arch::V3(simd) => Simd::vectorize(simd, op),
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(simd) => Simd::vectorize(simd, op),
        _ => Simd::vectorize(Scalar128b, op),
    }
}

/// Runs with vectors of 256 bits where the processor has them.
pub(crate) fn narrow<Op: WithSimd>(op: Op) -> Op::Output {
    #[cfg(target_arch = "x86_64")]
    {
        if let Some(simd) = pulp::x86::V3::try_new() {
            return Simd::vectorize(simd, op);
        }
        Simd::vectorize(pulp::Scalar::new(), op)
    }
    #[cfg(not(target_arch = "x86_64"))]
    Arch::new().dispatch(op)
}

/// The name of these instructions.
#[must_use]
pub fn name(arch: Arch) -> &'static str {
    match arch {
        #[cfg(target_arch = "x86_64")]
        Arch::V3(_) => "AVX2",
        #[cfg(target_arch = "x86_64")]
        Arch::V4(_) => "AVX-512",
        #[cfg(target_arch = "aarch64")]
        Arch::Neon(_) => "NEON",
        _ => "none",
    }
}
