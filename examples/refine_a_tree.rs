//! A distributed octree without particles: refine it round a sphere, balance it, partition it, and count.
//!
//!     cargo run --example refine_a_tree
//!     mpirun -n 3 target/debug/examples/refine_a_tree
use partition::{Brick, CutAt, Forest, Octant, World};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let world = World::init()?;
    let comm = world.comm();
    // Two root octants side by side, each cut into 4 x 4 x 4 leaves.
    let mut forest = Forest::<3>::uniform(comm, Brick { roots: [2, 1, 1] }, 2);

    // Leaves that the sphere's surface crosses become finer, down to level 5.
    forest.refine_where(comm, |leaf| leaf.level < 5 && is_crossed(leaf));
    forest.balance(comm);
    assert!(forest.is_balanced(comm));

    // The same work for each leaf. Families stay together, so that they may be coarsened again.
    let weights = vec![1; forest.leaves().len()];
    forest.partition(comm, &weights, CutAt::Families);

    let mut per_level = [0; 6];
    forest.leaves().iter().for_each(|leaf| per_level[usize::from(leaf.level)] += 1);
    comm.sum_u64(&mut per_level);
    // The checksum does not depend on the number of ranks.
    let checksum = forest.checksum(comm);
    if comm.rank() == 0 {
        println!("{} leaves on {} ranks, checksum {checksum:016x}", forest.global_len(), comm.size());
        per_level.iter().enumerate().for_each(|(level, leaves)| println!("level {level}: {leaves}"));
    }
    Ok(())
}

/// Whether the surface of a sphere of radius 0.4 round (1, 0.5, 0.5), in edges of a root, crosses the octant.
fn is_crossed(leaf: &Octant<3>) -> bool {
    let edge = 1.0 / f64::from(1_u32 << leaf.level);
    let (mut nearest, mut farthest) = (0.0_f64, 0.0_f64);
    for (axis, centre) in [1.0, 0.5, 0.5].into_iter().enumerate() {
        let low = f64::from(leaf.coord[axis]) * edge - centre;
        let high = low + edge;
        nearest += low.max(-high).max(0.0).powi(2);
        farthest += low.abs().max(high.abs()).powi(2);
    }
    nearest < 0.16 && 0.16 < farthest
}
