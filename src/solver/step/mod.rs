//! The phases of one time step.
//!
//! | file | what it holds |
//! |---|---|
//! | [`time_step`] | the bound on the step |
//! | [`transfer`] | P2G and G2P over all bins |
//! | [`update`] | velocities of nodes; conditions on faces |
//! | `exchange` | sums and particles between ranks |
//! | `increment` | velocities that FLIP and XPIC need |
//! | [`contact`] | colliders |
//! | [`loads`] | loads: their effect on nodes, impulse and work |
pub mod contact;
pub mod exchange;
mod increment;
pub mod loads;
pub mod time_step;
pub mod transfer;
pub mod update;
