//! The phases of one time step.
//!
//! | file | what it holds |
//! |---|---|
//! | [`time_step`] | the bound on the step |
//! | [`p2g`] | particles to nodes, over all bins |
//! | [`node_update`] | velocities of nodes; conditions on faces |
//! | [`g2p`] | nodes to particles, over all leaves |
//! | `look` | gather for the particles of a leaf, without an advance |
//! | `mean_dilation` | F-bar: dilation as the mean over cells |
//! | `fill` | fluids keep their volume |
//! | `exchange` | sums and particles between ranks |
//! | `flip_xpic` | velocities that FLIP and XPIC need |
//! | [`colliders`] | colliders: reactions and motion |
//! | `surfaces` | volumes and their gradients at nodes near surfaces |
//! | `walls` | gaps at faces and colliders; conditions of colliders on nodes |
//! | `contact` | contact of particles with colliders |
//! | [`between`] | contact between bodies |
//! | `saturation` | pores fill with water: masses of particles |
//! | [`relax`] | kinetic damping, on the way to equilibrium |
//! | `failed` | particles whose material has failed |
//! | `sources` | material that enters during the run |
//! | `ties` | surface nodes that move with the material beside them |
//! | [`loads`] | loads: their effect on nodes, impulse and work |
//! | [`carried`] | loads that particles carry: their impulse and work; areas follow the deformation |
pub mod between;
pub mod carried;
pub mod colliders;
mod contact;
pub mod exchange;
mod failed;
mod fill;
mod flip_xpic;
pub mod g2p;
pub mod loads;
pub(in crate::solver) mod look;
pub(in crate::solver) mod mean_dilation;
pub mod node_update;
pub mod p2g;
pub mod relax;
mod saturation;
mod sources;
mod surfaces;
mod ties;
pub mod time_step;
mod walls;
