//! One particle becomes several.
//!
//! | file | what it holds |
//! |---|---|
//! | `whole` | `2^D` of one |
//! | `pair` | two of one |
//! | `drift` | two of each that has drifted apart from its neighbours |
//! | `rings` | the same in axisymmetry |
//! | `child` | identifier, level and shares of a part |
//! | `displacement` | displacements of parts |
//! | `moments` | second moments of weights, for the affine matrix |
//! | `offsets` | places on both sides of a number, to the last bit |
mod child;
pub(super) mod displacement;
mod drift;
pub(super) mod moments;
mod offsets;
pub(super) mod pair;
mod rings;
mod whole;

pub use drift::Gap;
pub(super) use drift::close_gaps;
pub use whole::{Split, split};
