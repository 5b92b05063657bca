//! Data kept from one regrid to the next.
use crate::adaptivity::surroundings::Surroundings;
use partition::Mark;

/// Levels that the criteria ask for in a leaf and around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(in crate::solver) struct Wish<const D: usize> {
    /// Levels, a bit each; each has its own width of buffer.
    pub(in crate::solver) levels: u32,
    /// Way that the material can go down and up along each axis until the tree changes next, in edges of the
    /// finest leaves that the job can have. Fractions would not change which leaves it reaches.
    pub(in crate::solver) way: [[u32; D]; 2],
}

impl<const D: usize> Wish<D> {
    pub(in crate::solver) const NONE: Self = Self { levels: 0, way: [[0; D]; 2] };
}

/// Data kept from one regrid to the next. It saves work and changes no bit.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct RegridCache<const D: usize> {
    /// Surroundings of leaves, as criteria use them.
    pub surroundings: Surroundings,
    /// The last requests, if the tree has stayed as it was.
    pub(in crate::solver) settled: Option<SettledTree<D>>,
}

/// Requests at the last regrid, which left the tree as it is.
#[derive(Clone, Debug)]
pub(in crate::solver) struct SettledTree<const D: usize> {
    /// Revision of the forest.
    pub(in crate::solver) revision: u64,
    /// Wishes of own leaves.
    pub(in crate::solver) wishes: Vec<Wish<D>>,
    /// Marks of own leaves from the requests of all ranks.
    pub(in crate::solver) marks: Vec<Mark>,
}
