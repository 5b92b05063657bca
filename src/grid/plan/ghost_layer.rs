//! The part of the tree that one rank knows: its own leaves and its ghost layer.
use partition::{Brick, Forest, MAX_LEVEL, Octant};

use rustc_hash::FxHashSet;

use crate::csr::starts;
use crate::grid::mask::{offset, offset_count, shifted};
use crate::kernel::BLOCK;

/// Leaves that cover an octant, as far as this rank knows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cover {
    /// The octant lies outside the domain.
    Outside,
    /// One leaf (index into the known leaves) contains or equals the octant.
    Leaf(usize),
    /// The octant is subdivided; the index is that of the leaf at its lower corner.
    Finer(usize),
    /// This rank does not know.
    Unknown,
}

/// Own leaves and ghost leaves, sorted along the curve, with their owners.
#[derive(Clone, Debug)]
pub struct KnownTree<const D: usize> {
    brick: Brick<D>,
    rank: usize,
    leaves: Vec<Octant<D>>,
    keys: Vec<u64>,
    /// First leaf of each slice of the curve, and the number of leaves at the end.
    slices: Vec<u32>,
    slice_bits: u32,
    owners: Vec<u32>,
    first_own: usize,
    own_len: usize,
    reach: u32,
    graded: bool,
    halo: u32,
    /// Level of the finest known leaves.
    deepest: u8,
    /// By level, the octants in whose neighbourhood, themselves included, one holds smaller leaves.
    beside_finer: Vec<FxHashSet<[u32; D]>>,
}

/// Requirements on the ghost layer, the same on every rank.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Allowance {
    /// Half width of the widest boxes in cells of the leaf that holds them, rounded up, if any is wider
    /// than a cell; 0 otherwise. Any number is allowed; the ghost layer widens with it.
    pub reach: u32,
    /// Whether neighbouring leaves differ by one level at most.
    pub graded: bool,
    /// Blocks around those of its bins, counted along each axis, in which each rank needs all nodes.
    pub halo: u32,
}

impl<const D: usize> KnownTree<D> {
    /// Not collective. The own leaves of a rank, without a ghost layer.
    pub fn own(forest: &Forest<D>, rank: usize, allowance: Allowance) -> Self {
        let leaves = forest.leaves().to_vec();
        let mut tree = Self {
            brick: *forest.brick(),
            rank,
            owners: vec![rank as u32; leaves.len()],
            keys: Vec::new(),
            slices: Vec::new(),
            slice_bits: 0,
            first_own: 0,
            own_len: leaves.len(),
            reach: allowance.reach,
            graded: allowance.graded,
            halo: allowance.halo,
            deepest: 0,
            beside_finer: Vec::new(),
            leaves,
        };
        tree.index();
        tree
    }

    /// Adds leaves with their owners; those known already are ignored.
    pub fn add(&mut self, found: &[(Octant<D>, usize)]) {
        let mut all: Vec<(Octant<D>, u32)> =
            self.leaves.iter().copied().zip(self.owners.iter().copied()).collect();
        all.extend(found.iter().map(|&(leaf, owner)| (leaf, owner as u32)));
        all.sort_unstable_by_key(|(leaf, _)| leaf.key());
        all.dedup_by_key(|(leaf, _)| *leaf);
        (self.leaves, self.owners) = all.into_iter().unzip();
        self.index();
    }

    fn index(&mut self) {
        self.keys = self.leaves.iter().map(Octant::key).collect();
        self.deepest = self.leaves.iter().map(|leaf| leaf.level).max().unwrap_or(0);
        self.first_own = self.owners.iter().position(|&owner| owner as usize == self.rank).unwrap_or(0);
        self.slice();
        self.find_beside_finer();
    }

    fn find_beside_finer(&mut self) {
        self.beside_finer.clear();
        for level in 0..self.deepest {
            let mut beside = FxHashSet::default();
            let mut last = None;
            for leaf in self.leaves.iter().filter(|leaf| leaf.level > level) {
                let octant = leaf.ancestor(level);
                if last.replace(octant) != Some(octant) {
                    let offsets = (0..offset_count(D)).map(offset::<D>);
                    beside.extend(offsets.filter_map(|offset| shifted(octant.coord, offset)));
                }
            }
            self.beside_finer.push(beside);
        }
    }

    /// Whether an octant in the neighbourhood `coord + {-1, 0, 1}^D` is known to hold leaves of a finer
    /// level.
    pub fn is_beside_finer(&self, level: u8, coord: [u32; D]) -> bool {
        self.beside_finer.get(usize::from(level)).is_some_and(|beside| beside.contains(&coord))
    }

    /// Cuts the known part of the curve into about twice as many equal slices as there are leaves, so that
    /// [`KnownTree::locate`] searches a few leaves wherever leaves are of similar size.
    fn slice(&mut self) {
        let Some((&first, last)) = self.keys.first().zip(self.leaves.last()) else {
            self.slices.clear();
            return;
        };
        let wanted = (2 * self.keys.len() as u64).next_power_of_two().ilog2();
        self.slice_bits = (last.key_end() - first).max(1).ilog2().saturating_sub(wanted);
        let count = ((last.key_end() - 1 - first) >> self.slice_bits) as usize + 1;
        let slices = self.keys.iter().map(|key| ((key - first) >> self.slice_bits) as usize);
        starts(&mut self.slices, count, slices);
    }

    /// Number of known leaves with keys below `key`, `or_equal` to it.
    fn leaves_below(&self, key: u64, or_equal: bool) -> usize {
        let Some(&first) = self.keys.first() else { return 0 };
        let Some(from) = key.checked_sub(first) else { return 0 };
        let slice = (from >> self.slice_bits) as usize;
        let Some(&[start, end]) = self.slices.get(slice..).and_then(|rest| rest.first_chunk()) else {
            return self.keys.len();
        };
        let inside = &self.keys[start as usize..end as usize];
        start as usize + inside.partition_point(|&k| k < key || (or_equal && k == key))
    }

    /// Whether all leaves inside an octant are own leaves: these fill a segment of the curve.
    pub fn is_own(&self, octant: &Octant<D>) -> bool {
        let own = self.own_leaves();
        !own.is_empty()
            && octant.key() >= self.keys[own.start]
            && octant.key_end() <= self.leaves[own.end - 1].key_end()
    }

    /// The brick of root octants.
    pub fn brick(&self) -> &Brick<D> {
        &self.brick
    }

    /// All known leaves along the curve.
    pub fn leaves(&self) -> &[Octant<D>] {
        &self.leaves
    }

    /// Level of the finest known leaves.
    pub fn deepest(&self) -> u8 {
        self.deepest
    }

    /// Whether all leaves of the domain are known, as on a rank that is alone.
    pub fn is_whole(&self) -> bool {
        let roots = self.brick.roots.iter().map(|&roots| u64::from(roots)).product::<u64>();
        self.leaves.iter().map(Octant::volume).sum::<u64>() == roots << (D as u32 * u32::from(MAX_LEVEL))
    }

    /// Owner of a known leaf.
    pub fn owner(&self, known: usize) -> usize {
        self.owners[known] as usize
    }

    /// Own leaves: their number among the known leaves is `first_own() + local index`.
    pub fn first_own(&self) -> usize {
        self.first_own
    }

    /// Numbers of the own leaves among the known leaves.
    pub fn own_leaves(&self) -> std::ops::Range<usize> {
        self.first_own..self.first_own + self.own_len
    }

    /// Index of a known leaf among the rank's own leaves.
    pub fn local(&self, known: usize) -> Option<usize> {
        let local = known.wrapping_sub(self.first_own);
        (local < self.own_len).then_some(local)
    }

    /// Not collective. A whole tree in one place, as rank 0 of 1 knows it. `leaves` must fill the brick.
    pub fn whole(brick: Brick<D>, leaves: Vec<Octant<D>>) -> Self {
        let mut tree = Self {
            brick,
            rank: 0,
            owners: vec![0; leaves.len()],
            keys: Vec::new(),
            slices: Vec::new(),
            slice_bits: 0,
            first_own: 0,
            own_len: leaves.len(),
            reach: 0,
            graded: false,
            halo: 0,
            deepest: 0,
            beside_finer: Vec::new(),
            leaves,
        };
        tree.leaves.sort_unstable_by_key(Octant::key);
        tree.index();
        tree
    }

    /// See [`Allowance::reach`].
    pub fn reach(&self) -> u32 {
        self.reach
    }

    /// Whether neighbouring leaves differ by one level at most.
    pub fn is_graded(&self) -> bool {
        self.graded
    }

    /// See [`Allowance::halo`].
    pub fn halo(&self) -> u32 {
        self.halo
    }

    /// Whether all leaves that feed a bin lie within the block around it.
    pub fn sources_are_near(&self) -> bool {
        self.graded && self.reach <= 1
    }

    /// Distance in edges of a leaf within which all leaves lie that its boxes can reach.
    pub fn reach_in_leaves(&self) -> u32 {
        self.reach.div_ceil(BLOCK as u32).max(1)
    }

    /// Coarsest level of leaves whose boxes can have parts in a bin of `level`.
    ///
    /// In a graded tree leaves of all sizes between lie between a bin and a much coarser leaf: at a distance
    /// of `e (1 - 2^-k)` from a leaf of edge `e` the leaves are at most `k + 1` levels finer, and bins one
    /// level more. Parts of that leaf's boxes come as far as `e reach / 4`.
    pub fn coarsest_reaching(&self, level: u8) -> u8 {
        match self.reach {
            _ if !self.graded => 0,
            0..=2 => level.saturating_sub(2),
            3 => level.saturating_sub(3),
            _ => 0,
        }
    }

    /// Number of leaves of other ranks that are known.
    pub fn ghost_len(&self) -> usize {
        self.leaves.len() - self.own_len
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        self.leaves.capacity() * (size_of::<Octant<D>>() + 8 + 4)
    }

    /// The known leaf that contains the finest-level position `key`.
    pub fn locate(&self, key: u64) -> Option<usize> {
        let candidate = self.leaves_below(key, true).checked_sub(1)?;
        // Faster than `key_end`.
        (key - self.keys[candidate] < self.leaves[candidate].volume()).then_some(candidate)
    }

    /// Leaves that cover the octant of `level` at `coord`.
    pub fn cover(&self, level: u8, coord: [u32; D]) -> Cover {
        if !self.contains(level, coord) {
            return Cover::Outside;
        }
        match self.locate(Octant { level, coord }.key()) {
            None => Cover::Unknown,
            Some(leaf) if self.leaves[leaf].level > level => Cover::Finer(leaf),
            Some(leaf) => Cover::Leaf(leaf),
        }
    }

    /// True when the octant lies in the domain.
    pub fn contains(&self, level: u8, coord: [u32; D]) -> bool {
        (0..D).all(|axis| coord[axis] < self.brick.roots[axis] << level)
    }

    /// True when every position of the octant lies in a known leaf (or outside the domain).
    pub fn is_known(&self, level: u8, coord: [u32; D]) -> bool {
        if !self.contains(level, coord) {
            return true;
        }
        let octant = Octant { level, coord };
        if self.is_own(&octant) {
            return true;
        }
        let Some(first) = self.locate(octant.key()) else { return false };
        let end = octant.key_end();
        let mut reached = self.leaves[first].key_end();
        for next in first + 1..self.leaves.len() {
            if reached >= end {
                break;
            }
            if self.keys[next] != reached {
                return false;
            }
            reached = self.leaves[next].key_end();
        }
        reached >= end
    }

    /// Whether a leaf is known that lies inside the octant and is smaller.
    pub fn is_finer_within(&self, level: u8, coord: [u32; D]) -> bool {
        self.leaves_within(level, coord).any(|leaf| self.leaves[leaf].level > level)
    }

    /// Known leaves inside the octant, which must be subdivided.
    pub fn leaves_within(&self, level: u8, coord: [u32; D]) -> std::ops::Range<usize> {
        let octant = Octant { level, coord };
        self.leaves_below(octant.key(), false)..self.leaves_below(octant.key_end(), false)
    }
}
