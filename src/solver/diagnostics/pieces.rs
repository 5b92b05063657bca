//! In how many pieces elastic bodies are: whether they have torn.
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

use crate::adaptivity::resample::halve::half_widths;
use crate::particle::Chunk;
use crate::particle::chunk::Tag;
use crate::solver::state::Solver;

/// Most elastic particles of a run in which pieces are counted: one rank has to know of all.
const MOST: u64 = 4_000_000;

/// A square (3D: cube) of half a cell that a box of a body reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Pod, Zeroable)]
#[repr(C)]
struct Site {
    body: u32,
    place: [u32; 3],
}

impl<const D: usize> Solver<D> {
    /// Collective. Number of pieces of each body, more than half a cell apart; 0 for bodies that flow. `None`
    /// where there are too many particles.
    pub fn pieces(&self) -> Option<Vec<u64>> {
        let cohesion = self.physics.cohesion.as_ref()?;
        let is_elastic: Vec<bool> = self.physics.materials.iter().map(|m| !m.is_plastic()).collect();
        let elastic = |tag: u64| {
            let tag = Tag::unpack(tag);
            is_elastic[usize::from(tag.material)].then_some(tag)
        };
        let all = self.chunks.iter().flat_map(Chunk::tags).filter_map(|&tag| elastic(tag));
        let (own, coarsest) =
            all.fold((0, u64::MAX), |(n, level), tag| (n + 1, level.min(u64::from(tag.level))));
        let (mut number, mut coarsest) = ([own], [coarsest]);
        self.comm.sum_u64(&mut number);
        self.comm.min_u64(&mut coarsest);
        if number[0] == 0 || number[0] > MOST {
            return None;
        }
        let edge = self.physics.root_edge / f64::from(8_u32 << coarsest[0].min(28));
        let sites = self.chunks.par_iter().with_min_len(16).flat_map_iter(|chunk| {
            let particles = (0..chunk.len()).filter_map(|p| Some((p, elastic(chunk.tags()[p])?)));
            let mut sites = Vec::new();
            particles.for_each(|(p, tag)| reach(chunk, p, tag, edge, &mut sites));
            sites
        });
        let mut sites: Vec<Site> = sites.collect();
        sites.par_sort_unstable();
        sites.dedup();
        let gathered = self.comm.gather_bytes(bytemuck::cast_slice(&sites));
        let mut pieces = gathered.map_or_else(Vec::new, |parts| {
            let parts = parts.iter().flat_map(|part| part.chunks_exact(size_of::<Site>()));
            let mut sites: Vec<Site> = parts.map(bytemuck::pod_read_unaligned).collect();
            sites.sort_unstable();
            sites.dedup();
            bytemuck::cast_slice(&count(&sites, cohesion.nominal.len())).to_vec()
        });
        self.comm.broadcast_bytes(0, &mut pieces);
        Some(pieces.chunks_exact(size_of::<u64>()).map(bytemuck::pod_read_unaligned).collect())
    }
}

/// Sites that the box of a particle reaches.
fn reach<const D: usize>(chunk: &Chunk<D>, p: usize, tag: Tag, edge: f64, sites: &mut Vec<Site>) {
    let (x, half) = (chunk.position(p), half_widths(chunk, p));
    // Fragments may be stretched without bound.
    let half = half.map(|half: f64| half.min(2.0 * edge));
    let site = |y: f64| (y / edge).max(0.0) as u32;
    let range = |a: usize| if a < D { (site(x[a] - half[a]), site(x[a] + half[a])) } else { (0, 0) };
    let [(x0, x1), (y0, y1), (z0, z1)] = [0, 1, 2].map(range);
    for z in z0..=z1 {
        for y in y0..=y1 {
            sites.extend((x0..=x1).map(|x| Site { body: u32::from(tag.body), place: [x, y, z] }));
        }
    }
}

/// Connected parts of each body; sites without others between are neighbours.
fn count(sites: &[Site], bodies: usize) -> Vec<u64> {
    let numbers: FxHashMap<Site, u32> = sites.iter().copied().zip(0..).collect();
    let mut parent: Vec<u32> = (0..sites.len() as u32).collect();
    let find = |parent: &mut Vec<u32>, mut site: u32| {
        while parent[site as usize] != site {
            let above = parent[parent[site as usize] as usize];
            parent[site as usize] = above;
            site = above;
        }
        site
    };
    for (own, site) in (0..).zip(sites) {
        for neighbour in 0..27_u32 {
            let step = [neighbour % 3, neighbour / 3 % 3, neighbour / 9];
            let place: [u32; 3] = std::array::from_fn(|a| (site.place[a] + step[a]).wrapping_sub(1));
            if let Some(&other) = numbers.get(&Site { place, ..*site }) {
                let [a, b] = [own, other].map(|site| find(&mut parent, site));
                parent[a.max(b) as usize] = a.min(b);
            }
        }
    }
    let mut pieces = vec![0; bodies];
    for (own, site) in (0..).zip(sites) {
        pieces[site.body as usize] += u64::from(parent[own as usize] == own);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sites_that_touch_are_one_piece() {
        let site = |body, x, y, z| Site { body, place: [x, y, z] };
        // Two that touch at a corner, one apart from them; another body beside them.
        let sites = [site(0, 0, 0, 0), site(0, 1, 1, 1), site(0, 3, 1, 1), site(2, 2, 1, 1)];
        assert_eq!(count(&sites, 3), [2, 0, 1]);
    }
}
