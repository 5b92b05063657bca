//! Particles that come with a stage.
//!
//! | file | what it holds |
//! |---|---|
//! | this | the particles of all leaves, numbered and under their stress |
//! | [`seed`](mod@seed), `lattice` | particles of one leaf; places of a body's lattice |
//! | `parts` | particles at surfaces of fitted bodies |
//! | `carried` | columns for loads at the start: surfaces, and shares of point forces |
use partition::Forest;
use partition::comm::{Comm, Disagreement};
use rayon::prelude::*;

use self::seed::{SeedError, check_finite, fill_leaf};
use super::initial_stress::{Which, put_under_stress};
use super::materials::material_of;
use crate::job::Problem;
use crate::particle::chunk::{Chunk, Tag};
use crate::solver::Physics;

pub(super) mod carried;
mod lattice;
mod parts;
pub mod seed;

/// Collective. The particles that come with the stage of this physics, in the own leaves and under their
/// stress, numbered from `first` on along the curve, so that no number depends on the partition.
pub(super) fn new_particles<const D: usize>(
    comm: &Comm,
    problem: &Problem<D>,
    forest: &Forest<D>,
    physics: &Physics<D>,
    first: u64,
) -> Result<Vec<Chunk<D>>, Disagreement> {
    let stage = physics.stage();
    let mut chunks = comm.agree(seed(forest, problem, stage))?;
    let mut id = first + comm.exclusive_sum_u64(chunks.iter().map(|chunk| chunk.len() as u64).sum());
    for chunk in &mut chunks {
        for p in 0..chunk.len() {
            chunk.ids_mut()[p] = id;
            id += 1;
            let tag = Tag::unpack(chunk.tags()[p]);
            let material = material_of(problem, usize::from(tag.body), stage) as u16;
            chunk.tags_mut()[p] = Tag { material, ..tag }.pack();
            if problem.bodies[usize::from(tag.body)].given.is_none() {
                physics.begin_history(chunk, p);
            }
        }
    }
    let stressed = forest.leaves().par_iter().zip(&mut chunks);
    let stressed = stressed
        .map(|(leaf, chunk)| put_under_stress(problem, &physics.materials, leaf, chunk, Which::WithoutHeads));
    let stressed: Result<(), SeedError> = stressed.collect();
    comm.agree(check_finite(problem).and(stressed))?;
    Ok(chunks)
}

/// Not collective. The particles of the own leaves that come with a stage, ids not yet given.
fn seed<const D: usize>(
    forest: &Forest<D>,
    problem: &Problem<D>,
    stage: usize,
) -> Result<Vec<Chunk<D>>, SeedError> {
    forest
        .leaves()
        .par_iter()
        .map(|leaf| {
            let mut chunk = Chunk::new();
            fill_leaf(problem, leaf, stage, &mut chunk)?;
            Ok(chunk)
        })
        .collect::<Result<_, SeedError>>()
        .and_then(|chunks| check_finite(problem).map(|()| chunks))
}
