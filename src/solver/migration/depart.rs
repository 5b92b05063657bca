//! Removal of particles from leaves that they have left.
//!
//! The last particles of a leaf fill the gaps of those that left. Particles that enter a finer leaf are split
//! apart from the others: room for their children in the chunk would require a copy of the leaf.
use super::crossings::{Crossed, Crossing, FaceRules, face_name, farthest_beyond};
use super::error::MigrateError;
use super::gone::Gone;
use super::records::{push_record, record_words};
use crate::adaptivity::resample::cell_fit::{Resampling, Splits};
use crate::grid::leaf_geometry::{leaf_box, position_key};
use crate::grid::{GridPlan, KnownTree};
use crate::kernel::g2p::leavers;
use crate::material::HISTORIES;
use crate::material::eigen::determinant;
use crate::particle::chunk::{Chunk, Layout};
use crate::particle::lanes::{list_lanes, positions};
use crate::simd::{Lanes, Vector, VectorMask};

/// Where a particle goes.
#[derive(Clone, Copy)]
pub(in crate::solver) enum Destination {
    /// Nowhere: it is in the leaf.
    Stay,
    /// To a known leaf.
    Leaf(u32),
    /// Out of the domain, and is deleted.
    Deleted,
    /// Out of the domain through an outflow face, and is removed.
    Left,
    /// Nowhere: it has failed, and is deleted.
    Failed,
    /// Nowhere itself; its children have destinations of their own.
    Split,
}

/// The boxes of the own leaves, and the rules for particles outside them.
pub struct Borders<const D: usize> {
    boxes: Vec<([f64; D], [f64; D])>,
    rules: FaceRules<D>,
    /// Edges of the domain, m.
    extent: [f64; D],
    root_edge: f64,
    /// Columns of what particles carry for loads.
    carried: usize,
}

/// Particles taken out of one leaf.
#[derive(Debug, Default)]
pub(in crate::solver) struct Departed {
    /// Records of the particles that go to other leaves, in their order.
    pub records: Vec<u64>,
    /// Particles that crossed a face of the domain.
    pub crossed: Crossed,
    /// Why nothing was taken out.
    pub error: Option<MigrateError>,
    /// Splits of those that enter finer leaves.
    pub splits: Option<Splits>,
}

impl Departed {
    /// Whether anything departed or failed.
    pub(crate) fn is_any(&self) -> bool {
        !self.records.is_empty() || self.crossed.is_any() || self.error.is_some() || self.splits.is_some()
    }
}

impl<const D: usize> Borders<D> {
    /// Of the own leaves of a plan.
    pub(in crate::solver) fn new(plan: &GridPlan<D>, rules: FaceRules<D>, carried: usize) -> Self {
        let own = plan.tree.first_own()..plan.tree.first_own() + plan.leaf_start.len() - 1;
        let boxes = plan.tree.leaves()[own].iter().map(|leaf| leaf_box(leaf, plan.root_edge)).collect();
        let extent = plan.tree.brick().roots.map(|roots| f64::from(roots) * plan.root_edge);
        Self { boxes, rules, extent, root_edge: plan.root_edge, carried }
    }

    /// Lower and upper corner of an own leaf, m.
    pub(in crate::solver) fn of_leaf(&self, leaf: usize) -> &([f64; D], [f64; D]) {
        &self.boxes[leaf]
    }

    /// Words of the record of a particle.
    pub(super) fn record_words(&self) -> usize {
        record_words::<D>(self.carried)
    }

    /// Takes particles, ascending, out of a chunk.
    pub(in crate::solver) fn take(&self, chunk: &mut Chunk<D>, leavers: &[(u32, Destination)]) -> Departed {
        let mut departed = Departed::default();
        if leavers.is_empty() {
            return departed;
        }
        departed.records.reserve_exact(leavers.len() * self.record_words());
        leavers.iter().for_each(|&(p, destination)| self.note(&mut departed, chunk, p as usize, destination));
        let gone: Vec<u32> = leavers.iter().map(|&(p, _)| p).collect();
        chunk.remove(&gone);
        departed
    }

    /// Enters a particle that leaves: in the records of its new leaf, or in the counts of those that cross a
    /// face.
    fn note(&self, departed: &mut Departed, chunk: &Chunk<D>, p: usize, destination: Destination) {
        match destination {
            Destination::Leaf(to) => {
                push_record(&mut departed.records, u64::from(to), chunk, p, self.carried);
            }
            Destination::Deleted => departed.crossed.deleted.push(self.gone(chunk, p)),
            Destination::Left => departed.crossed.left.push(self.gone(chunk, p)),
            Destination::Failed => {
                let face = None;
                departed.crossed.failed.push(Gone { face, ..self.gone(chunk, p) });
            }
            Destination::Stay | Destination::Split => {}
        }
    }

    /// A particle as it leaves the domain.
    fn gone(&self, chunk: &Chunk<D>, p: usize) -> Gone {
        let position = chunk.position(p);
        let mut place = [0.0; 3];
        place[..D].copy_from_slice(&position);
        let (face, _) = farthest_beyond(&position, &self.extent);
        Gone { mass: chunk.column(Layout::<D>::MASS)[p], place, face: Some(face) }
    }

    /// Where a position is, if it is in another leaf than own leaf `leaf`.
    pub(in crate::solver) fn elsewhere(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        position: [f64; D],
    ) -> Option<Destination> {
        let to = tree.locate(position_key(position, tree.brick().roots, self.root_edge))?;
        (to != tree.first_own() + leaf).then_some(Destination::Leaf(to as u32))
    }

    /// Not collective. Takes out of an own leaf the particles `outside` its box (ascending) that belong to
    /// another or to none, and those that have `failed` (ascending). With `resampling`, particles that enter
    /// a leaf finer than they were made for become their children, each with a destination of its own;
    /// children that stay come last in the leaf.
    pub(in crate::solver) fn depart(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        (outside, failed): (&[u32], &[u32]),
        resampling: Option<&Resampling<'_, D>>,
    ) -> Departed {
        if outside.is_empty() && failed.is_empty() {
            return Departed::default();
        }
        let leaf = tree.first_own() + leaf;
        let departed = self.take_out(tree, leaf, chunk, (outside, failed), resampling);
        departed.unwrap_or_else(|error| Departed { error: Some(error), ..Departed::default() })
    }

    /// [`Borders::depart`] for a known leaf.
    fn take_out(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        (outside, failed): (&[u32], &[u32]),
        resampling: Option<&Resampling<'_, D>>,
    ) -> Result<Departed, MigrateError> {
        let mut put_back = 0;
        let whole = outside.iter().copied().filter(|p| failed.binary_search(p).is_err());
        let mut leavers = self.destinations(tree, leaf, chunk, whole, &mut put_back)?;
        leavers.retain(|(_, destination)| !matches!(destination, Destination::Stay));
        if !failed.is_empty() {
            leavers.extend(failed.iter().map(|&p| (p, Destination::Failed)));
            leavers.sort_unstable_by_key(|&(p, _)| p);
        }
        let parents = resampling.map(|resampling| too_coarse(tree, chunk, resampling, &mut leavers));
        let parents = parents.unwrap_or_default();
        let mut children = chunk.gathered(&parents);
        let mut departed = self.take(chunk, &leavers);
        departed.crossed.put_back = put_back;
        let Some(resampling) = resampling else { return Ok(departed) };
        if parents.is_empty() {
            return Ok(departed);
        }
        let mut splits = Splits::default();
        let mut which: Vec<u32> = (0..children.len() as u32).collect();
        let level = tree.leaves()[leaf].level;
        while !which.is_empty() {
            resampling.split(&mut children, &which, level, &mut splits);
            let all = 0..children.len() as u32;
            let put_back = &mut departed.crossed.put_back;
            leavers = self.destinations(tree, leaf, &mut children, all, put_back)?;
            which = too_coarse(tree, &children, resampling, &mut leavers);
        }
        for (p, destination) in leavers {
            self.note(&mut departed, &children, p as usize, destination);
            if let Destination::Stay = destination {
                chunk.push_from(&children, p as usize);
            }
        }
        departed.splits = Some(splits);
        Ok(departed)
    }

    /// Where the listed particles of a leaf go; those that are put back into the domain are counted.
    fn destinations(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        particles: impl Iterator<Item = u32>,
        put_back: &mut u64,
    ) -> Result<Vec<(u32, Destination)>, MigrateError> {
        particles.map(|p| Ok((p, self.destination(tree, leaf, chunk, p as usize, put_back)?))).collect()
    }

    fn destination(
        &self,
        tree: &KnownTree<D>,
        leaf: usize,
        chunk: &mut Chunk<D>,
        p: usize,
        put_back: &mut u64,
    ) -> Result<Destination, MigrateError> {
        let mut position = chunk.position(p);
        if position.iter().any(|x| !x.is_finite()) {
            return Err(self.too_far(chunk, p));
        }
        let roots = tree.brick().roots;
        let extent = self.extent;
        match self.rules.of(&position, &extent) {
            None => {}
            Some(Crossing::Deleted) => return Ok(Destination::Deleted),
            Some(Crossing::Left) => return Ok(Destination::Left),
            Some(Crossing::Refused) => {
                let (face, beyond) = farthest_beyond(&position, &extent);
                let (position, face) = (self.rules.in_job(&position), face_name(face));
                return Err(MigrateError::Left { id: chunk.ids()[p], position, face, beyond });
            }
            Some(Crossing::PutBack) => {
                *put_back += 1;
                for axis in 0..D {
                    position[axis] = position[axis].clamp(0.0, extent[axis].next_down());
                    chunk.column_mut(Layout::<D>::POSITION + axis)[p] = position[axis];
                }
            }
        }
        let key = position_key(position, roots, self.root_edge);
        match tree.locate(key) {
            Some(to) if to == leaf => Ok(Destination::Stay),
            Some(to) => Ok(Destination::Leaf(to as u32)),
            None => Err(self.too_far(chunk, p)),
        }
    }

    fn too_far(&self, chunk: &Chunk<D>, p: usize) -> MigrateError {
        MigrateError::TooFar { id: chunk.ids()[p], position: self.rules.in_job(&chunk.position(p)) }
    }

    /// The error of a particle whose new leaf belongs to a rank that is no neighbour.
    pub(super) fn stray(&self, record: &[u64]) -> MigrateError {
        let column = |column: usize| f64::from_bits(record[1 + column]);
        let position: [f64; D] = std::array::from_fn(|axis| column(Layout::<D>::POSITION + axis));
        let position = self.rules.in_job(&position);
        MigrateError::TooFar { id: record[1 + Layout::<D>::REALS], position }
    }

    /// The first particle of a leaf in a state that material cannot have, where G2P has found that one
    /// exists.
    pub(in crate::solver) fn unsound(&self, chunk: &Chunk<D>) -> Option<MigrateError> {
        (0..chunk.len()).find_map(|p| {
            let (quantity, value) = unsound_quantity(chunk, p)?;
            let position = self.rules.in_job(&chunk.position(p));
            Some(MigrateError::Unsound { id: chunk.ids()[p], position, quantity, value })
        })
    }
}

/// Quantity of a particle that material cannot have, with its value.
fn unsound_quantity<const D: usize>(chunk: &Chunk<D>, p: usize) -> Option<(&'static str, f64)> {
    let value = |column: usize| chunk.column(column)[p];
    let symmetric = |first: usize| first..first + Layout::<D>::SYMMETRIC;
    let columns = [
        ("position", Layout::<D>::POSITION..Layout::<D>::POSITION + D),
        ("velocity", Layout::<D>::VELOCITY..Layout::<D>::VELOCITY + D),
        ("left Cauchy-Green tensor", symmetric(Layout::<D>::LEFT_CAUCHY_GREEN)),
        ("stress", symmetric(Layout::<D>::STRESS)),
        ("history variable", Layout::<D>::HISTORY..Layout::<D>::HISTORY + HISTORIES),
        ("plastic work", Layout::<D>::WORK..Layout::<D>::WORK + 1),
    ];
    for (quantity, mut columns) in columns {
        if let Some(found) = columns.find(|&column| !value(column).is_finite()) {
            return Some((quantity, value(found)));
        }
    }
    let mut elastic = [Lanes::splat(0.0); 6];
    for (c, elastic) in elastic.iter_mut().enumerate().take(Layout::<D>::SYMMETRIC) {
        *elastic = Lanes::splat(value(Layout::<D>::LEFT_CAUCHY_GREEN + c));
    }
    let ratio = determinant(&elastic).to_array()[0];
    let is_sound = ratio > 0.0 && ratio.is_finite();
    (!is_sound).then_some(("squared elastic volume ratio", ratio))
}

/// Those that enter a leaf finer than they were made for; their destination is [`Destination::Split`] then.
fn too_coarse<const D: usize>(
    tree: &KnownTree<D>,
    chunk: &Chunk<D>,
    resampling: &Resampling<'_, D>,
    leavers: &mut [(u32, Destination)],
) -> Vec<u32> {
    let mut found = Vec::new();
    for (p, destination) in leavers {
        if let Destination::Leaf(to) = *destination
            && resampling.splits_in(chunk, *p as usize, tree.leaves()[to as usize].level)
        {
            *destination = Destination::Split;
            found.push(*p);
        }
    }
    found
}

/// Particles that are not in a box, in order; one whose position is not a number is in none.
pub(in crate::solver) fn outside<const D: usize>(
    chunk: &Chunk<D>,
    bounds: &([f64; D], [f64; D]),
) -> Vec<u32> {
    let mut leavers = leavers::Leavers::default();
    leavers.begin(bounds);
    let mut found = Vec::new();
    list_lanes(0..chunk.len(), &mut found, |first| !leavers.inside(&positions(chunk, first)).bits());
    found
}
