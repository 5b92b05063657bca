//! Strength: parts of it that laws share.
//!
//! | file or folder | content |
//! |---|---|
//! | `angle.rs` | angles of friction and dilation that may soften |
//! | `coulomb.rs` | return to the Mohr-Coulomb pyramid in principal stresses |
//! | `hardening/` | strength as a function of plastic strain, rate and temperature |
//! | `reduction.rs` | strength over a factor of safety |
pub(super) mod angle;
pub(super) mod coulomb;
pub(super) mod hardening;
mod reduction;

pub use reduction::Weakened;
