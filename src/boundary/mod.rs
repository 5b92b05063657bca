//! Boundary conditions on the velocities of real nodes, contact at particles, and the treatment of particles
//! that leave.
//!
//! | file or folder | what it holds |
//! |---|---|
//! | [`contact`], [`gap`] | conditions on the velocity at a surface; the gap between material and surface |
//! | [`absorbing`] | faces that absorb waves |
//! | [`collider`], [`motion`] | colliders, and their motion |
//! | [`rigid`] | rotation and contact of free bodies |
//! | [`touching`], [`bodies`] | contact at particles, and between bodies |
//! | `vector` | products of vectors that are rounded once |
pub mod absorbing;
pub mod bodies;
pub mod collider;
pub mod contact;
pub mod gap;
pub mod motion;
pub mod rigid;
pub mod touching;
pub(crate) mod vector;

pub use absorbing::Absorbing;
pub use bodies::BodyContacts;
pub use collider::{ActsOn, Collider, ColliderState};
pub use contact::Contact;
pub use gap::{Bounds, Gap, Meets};
pub use touching::{Touching, meets};

/// Treatment of particles that leave the domain.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Leaving {
    /// The run ends with an error that names them.
    #[default]
    Error,
    /// They are removed and counted.
    Delete,
    /// They are put back on the face they crossed.
    Clamp,
}
