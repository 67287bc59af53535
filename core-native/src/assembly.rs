//! Products of dense matrices by ready kernels in assembly, where the processor has AVX2 or AVX-512.
//!
//! They are faer's; the rest of that library takes minutes to build.

use std::any::TypeId;
use std::arch::is_x86_feature_detected;
use std::ptr::null;

use private_gemm_x86::{Accum, DType, DstKind, IType, InstrSet, gemm};

use crate::dense::Product;
use crate::scalar::Scalar;

/// Adds the product; gives it back where the processor has too old instructions.
pub fn add<T: Scalar>(product: Product<'_, T>) -> Option<Product<'_, T>> {
    let instructions = if is_x86_feature_detected!("avx512f") {
        InstrSet::Avx512
    } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
        InstrSet::Avx256
    } else {
        return Some(product);
    };
    let Product {
        target,
        scale,
        left,
        right,
        size: [m, n, inner],
    } = product;
    let scale = T::ONE * scale;
    let real = TypeId::of::<T>() == TypeId::of::<f64>();
    // SAFETY: the sizes have been checked, the numbers are of that type, and the target is
    // borrowed mutably; no row or column is renumbered and no diagonal given, hence the nulls.
    unsafe {
        gemm(
            if real { DType::F64 } else { DType::C64 },
            IType::U64,
            instructions,
            m,
            n,
            inner,
            target.values.as_mut_ptr().cast(),
            1,
            target.column as isize,
            null(),
            null(),
            if target.lower {
                DstKind::Lower
            } else {
                DstKind::Full
            },
            Accum::Add,
            left.values.as_ptr().cast(),
            left.strides[0] as isize,
            left.strides[1] as isize,
            false,
            null(),
            0,
            right.values.as_ptr().cast(),
            right.strides[0] as isize,
            right.strides[1] as isize,
            false,
            (&raw const scale).cast(),
            1,
        );
    }
    None
}
