//! Splitting and merging of particles, so that their size follows that of the cells.
//!
//! Pure functions on the chunk of one leaf: they use neither tree nor ranks, and the result depends on the
//! content of the chunk alone. After either, particles may lie in another leaf (children do where a box
//! crosses a face), so the caller sorts them into leaves afterwards. `docs/design/resampling.md` derives
//! which quantities are conserved.
//!
//! | file | what it holds |
//! |---|---|
//! | `setting` `limits` | input of splitting and merging; how much particles that merge may differ |
//! | [`cell_fit`] | particles follow the size of the cells of their leaf |
//! | `split/` | one particle becomes several |
//! | `merge` `mixture` | several become one; the particle that stands for a group |
//! | [`family`] [`merge_backoff`] | siblings that wait for each other; when a failed merge is tried again |
//! | `halve` | elastic particles that are stretched become two, and one again |
//! | `affine` [`ids`] | affine matrices; identifiers by descent |
//! | [`ledger`] | counts and energies |
mod affine;
pub mod cell_fit;
pub mod family;
pub(crate) mod halve;
pub mod ids;
pub mod ledger;
mod limits;
mod merge;
pub mod merge_backoff;
mod mixture;
mod setting;
mod split;
#[cfg(test)]
mod tests;

pub use limits::Limits;
pub use merge::{Merged, merge};
pub use setting::Setting;
pub use split::{Gap, Split, split};
