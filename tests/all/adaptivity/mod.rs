//! Dynamic refinement, through the program and the library: same bits however a run is carried out,
//! conservation through many changes of the tree, bodies that stay whole and free of stress, and criteria
//! that refine where they should.

mod criteria;
mod crossing;
mod same_bits;
mod state;
mod sweeps;
