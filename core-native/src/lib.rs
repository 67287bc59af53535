//! Sparse Cholesky factors and Jacobian rows for tomoskin.

mod abreast;
mod amalgamation;
#[cfg(feature = "python")]
mod arrays;
#[cfg(target_arch = "x86_64")]
mod assembly;
pub mod circuit;
pub mod conduction;
pub mod dense;
pub mod dent;
pub mod factor;
pub mod instructions;
pub mod jacobian;
mod kernel;
mod lanes;
pub mod linear;
mod ordering;
pub mod panels;
pub mod patch;
#[cfg(feature = "python")]
mod patches;
pub mod product;
#[cfg(feature = "python")]
mod python;
#[cfg(feature = "reference")]
mod reference;
mod residual;
pub mod scalar;
pub mod small;
pub mod solve;
pub mod spot_algebra;
pub mod spot_fit;
pub mod spot_match;
#[cfg(feature = "python")]
mod spot_match_python;
pub mod spot_prior;
#[cfg(feature = "python")]
mod spot_python;
pub mod spot_reduced;
#[cfg(feature = "python")]
mod spot_reduced_python;
pub mod spot_search;
#[cfg(feature = "python")]
mod spot_seen_python;
pub mod spot_table;
pub mod symbolic;
pub mod terminals;
pub mod threads;
pub mod tiles;
#[cfg(feature = "python")]
mod twin_python;
