//! The phases of one time step.
//!
//! | file | what it holds |
//! |---|---|
//! | [`time_step`] | the bound on the step |
//! | [`p2g`] | particles to nodes, over all bins |
//! | [`update`] | velocities of nodes; conditions on faces |
//! | [`g2p`] | nodes to particles, over all leaves |
//! | `exchange` | sums and particles between ranks |
//! | `increment` | velocities that FLIP and XPIC need |
//! | [`contact`] | colliders |
//! | [`loads`] | loads: their effect on nodes, impulse and work |
pub mod contact;
pub mod exchange;
pub mod g2p;
mod increment;
pub mod loads;
pub mod p2g;
pub mod time_step;
pub mod update;
