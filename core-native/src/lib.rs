//! Sparse Cholesky factors and Jacobian rows for tomoskin.

mod dense;
pub mod factor;
pub mod jacobian;
mod kernel;
mod ordering;
pub mod patch;
mod patches;
pub mod product;
mod python;
pub mod reference;
pub mod residual;
pub mod scalar;
pub mod solve;
pub mod symbolic;
pub mod threads;
