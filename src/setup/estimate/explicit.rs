//! The tree of a job leaf by leaf, split by split: the reference for counting by arithmetic.
use crate::grid::mask::{offset, offset_count};
use crate::job::Problem;
use partition::Octant;
use rustc_hash::FxHashSet;

/// Not collective. All leaves of the tree that the job asks for, along the curve.
pub(crate) fn leaves<const D: usize>(problem: &Problem<D>) -> Vec<Octant<D>> {
    // The octants that are split, by level; everything else follows from them.
    let mut split = vec![FxHashSet::default(); usize::from(problem.finest_level()) + 1];
    let mut pending = roots(problem);
    while let Some(octant) = pending.pop() {
        if problem.wants_refinement(&octant) {
            split[usize::from(octant.level)].insert(octant);
            pending.extend((0..1 << D).map(|i| octant.child(i)));
        }
    }
    if problem.tree.graded {
        balance(problem, &mut split);
    }
    let mut leaves = Vec::new();
    let mut pending = roots(problem);
    while let Some(octant) = pending.pop() {
        if split[usize::from(octant.level)].contains(&octant) {
            pending.extend((0..1 << D).map(|i| octant.child(i)));
        } else {
            leaves.push(octant);
        }
    }
    leaves.sort_unstable();
    leaves
}

/// An octant that is split has children next to all its neighbours, so those must exist: their parents
/// are split too. Finest level first; each level only adds to the coarser ones.
fn balance<const D: usize>(problem: &Problem<D>, split: &mut [FxHashSet<Octant<D>>]) {
    for level in (1..split.len()).rev() {
        let octants: Vec<Octant<D>> = split[level].iter().copied().collect();
        for octant in octants {
            for index in 0..offset_count(D) {
                let Some(neighbour) = octant.neighbour(offset(index), &problem.brick) else { continue };
                let mut parent = neighbour.parent();
                while let Some(ancestor) = parent {
                    if !split[usize::from(ancestor.level)].insert(ancestor) {
                        break;
                    }
                    parent = ancestor.parent();
                }
            }
        }
    }
}

fn roots<const D: usize>(problem: &Problem<D>) -> Vec<Octant<D>> {
    (0..problem.brick.root_count()).map(|i| problem.brick.root_on_curve(i)).collect()
}
