//! The phases of one time step.
//!
//! | file | what it holds |
//! |---|---|
//! | [`time_step`] | the bound on the step |
//! | [`transfer`] | P2G and G2P over all bins |
//! | [`update`] | velocities of nodes; conditions on faces |
//! | `increment` | velocities that FLIP and XPIC need |
//! | [`contact`] | colliders |
//! | [`loads`] | loads: their effect on nodes, impulse and work |
//! | [`grid`] | the grid of a step: plan, arenas, fields |
//! | `survey` | extrema per leaf for criteria |
//! | [`phases`] | timers of phases |
//! | [`parts`] | timers of a regrid |
pub mod contact;
pub mod grid;
mod increment;
pub mod loads;
pub mod parts;
pub mod phases;
pub(super) mod survey;
pub mod time_step;
pub mod transfer;
pub mod update;
