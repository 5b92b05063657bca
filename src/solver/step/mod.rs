//! The phases of one time step.
//!
//! | file | what it holds |
//! |---|---|
//! | [`time_step`] | the bound on the step |
//! | [`transfer`] | particles to nodes and back; increments of FLIP and XPIC; F-bar |
//! | [`node_update`] | velocities of nodes; conditions on faces |
//! | `fill` | fluids keep their volume |
//! | `exchange` | sums and particles between ranks |
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
pub mod loads;
pub mod node_update;
pub mod relax;
mod saturation;
mod sources;
mod surfaces;
mod ties;
pub mod time_step;
pub mod transfer;
mod walls;
