//! Batches of particles of a chunk and their columns as lanes.
use super::{GivenColumn, Select};
use crate::particle::chunk::{Chunk, Layout, Place, TILE};
use crate::simd::{LANES, Vector, VectorMask, prefetch, prefetch_to_second_level};

/// Distance ahead at which tiles are prefetched, in particles; in the next chunk where this one ends.
const AHEAD: usize = 2 * TILE;

/// Tiles whose pages are translated at a time, as many tiles before they are used.
const GROUP: usize = 16;

/// Bytes of a page; larger ones are translated more often than needed.
const PAGE: usize = 4096;

/// Up to [`LANES`] particles. Lanes that are no members compute values that are never stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Batch {
    /// Of lanes that are no members, only the material is used.
    index: [u32; LANES],
    /// Bit i says whether lane i is a member.
    lanes: u32,
    /// The tile whose lanes are those of the batch; `None` if the batch is gathered from several.
    tile: Option<u32>,
    /// Data of a later batch, to be prefetched.
    ahead: Place,
}

/// All lanes are members.
const ALL: u32 = (1 << LANES) - 1;

/// The most components that particles have.
const MOST: usize = Layout::<3>::REALS;

/// Memory for particles gathered from several tiles.
#[derive(Clone, Debug)]
#[repr(align(64))]
pub(super) struct Tile([[f64; LANES]; MOST]);

impl Tile {
    pub(super) fn new() -> Self {
        Self([[0.0; LANES]; MOST])
    }
}

/// The batches of a selection, in order.
pub(super) struct Batches<'a, const D: usize> {
    select: Select<'a>,
    /// Particles of the chunk.
    len: usize,
    /// Members taken so far.
    taken: usize,
    place: Place,
    next: Place,
}

impl<'a, const D: usize> Batches<'a, D> {
    /// Batches of a selection from a chunk. `next` is the place of the chunk to be read after it.
    pub(super) fn new(select: Select<'a>, chunk: &Chunk<D>, next: Place) -> Self {
        Self { select, len: chunk.len(), taken: 0, place: chunk.place(), next }
    }

    /// The next particles of the chunk.
    #[inline(always)]
    fn whole(&self) -> Batch {
        let first = self.taken;
        let count = (self.len - first).min(LANES);
        let index = std::array::from_fn(|lane| (first + lane.min(count - 1)) as u32);
        let tile = Some((first / TILE) as u32);
        Batch { index, lanes: ALL >> (LANES - count), tile, ahead: self.ahead(first, AHEAD) }
    }

    /// Prefetches pages; to be called after each batch was taken. Tiles run through a page after every few of
    /// them. The processor translates several pages at the same time, but waits for each page of which a
    /// single line is requested. Inlined: with a call between batches, constants would not stay in registers.
    #[inline(always)]
    pub(super) fn look_up_pages(&self) {
        let is_due = self.taken % (GROUP * TILE) == TILE && self.len > GROUP * TILE;
        if is_due && matches!(self.select, Select::All) {
            let tiles = (GROUP..2 * GROUP).step_by(PAGE / (Layout::<D>::REALS * size_of::<[f64; TILE]>()));
            tiles.for_each(|tile| {
                prefetch_to_second_level(self.ahead(self.taken - TILE, tile * TILE).tiles);
            });
        }
    }

    /// Place to prefetch, so many particles ahead of those from `first` on.
    #[inline(always)]
    fn ahead(&self, first: usize, by: usize) -> Place {
        let rows = self.len.next_multiple_of(TILE);
        let (place, particle) = match first + by {
            particle if particle < rows => (self.place, particle),
            particle if self.next.tiles != 0 => (self.next, particle - rows),
            _ => (self.place, first),
        };
        place.of_particle::<D>(particle)
    }
}

impl<const D: usize> Iterator for Batches<'_, D> {
    type Item = Batch;

    #[inline(always)]
    fn next(&mut self) -> Option<Batch> {
        match self.select {
            Select::All => {
                let first = self.taken;
                if first >= self.len {
                    return None;
                }
                let batch = self.whole();
                self.taken += LANES;
                Some(batch)
            }
            Select::List(list) => {
                let rest = &list[self.taken..];
                if rest.is_empty() {
                    return None;
                }
                let (batch, count) = Batch::of_list(rest);
                self.taken += count;
                Some(Batch { ahead: self.ahead(rest[0] as usize, AHEAD), ..batch })
            }
        }
    }
}

impl Batch {
    /// Up to [`LANES`] particles, at least one, lane by lane.
    #[inline(always)]
    pub(super) fn of_particles(list: &[u32]) -> Self {
        match list.first_chunk() {
            Some(next) if is_tile(next) => Self::whole_tile(next),
            _ => Self::from_indices(list, |&p| p),
        }
    }

    /// All particles of a tile.
    #[inline(always)]
    fn whole_tile(index: &[u32; LANES]) -> Self {
        Self { index: *index, lanes: ALL, tile: Some(index[0] / TILE as u32), ahead: Place::default() }
    }

    /// The first particles of a list, and their number. Where at least a quarter of a tile is on the list, as
    /// is usual beside level jumps, it is read as a whole; elsewhere particles are gathered one by one.
    #[inline(always)]
    fn of_list(list: &[u32]) -> (Self, usize) {
        match list.first_chunk() {
            Some(next) if is_tile(next) => (Self::whole_tile(next), LANES),
            _ => Self::of_gaps(list),
        }
    }

    /// As [`Batch::of_list`], for lists with gaps.
    #[inline(never)]
    fn of_gaps(list: &[u32]) -> (Self, usize) {
        let tile = list[0] / TILE as u32;
        let (mut index, mut lanes, mut count, mut least) = ([list[0]; LANES], 0, 0, 0);
        for &p in list.iter().take(LANES) {
            if p < least || p / TILE as u32 != tile {
                break;
            }
            let lane = p % TILE as u32;
            index[lane as usize] = p;
            lanes |= 1 << lane;
            count += 1;
            least = p + 1;
        }
        if count >= LANES / 4 || count == list.len() {
            return (Self { index, lanes, tile: Some(tile), ahead: Place::default() }, count);
        }
        (Self::from_indices(list, |&p| p), list.len().min(LANES))
    }

    /// The first particles of a list whose entries name a particle each, some of them perhaps several times.
    #[inline(always)]
    pub(super) fn from_indices<T>(list: &[T], particle: impl Fn(&T) -> u32) -> Self {
        let count = list.len().min(LANES);
        let index: [u32; LANES] = std::array::from_fn(|lane| particle(&list[lane.min(count - 1)]));
        Self { index, lanes: ALL >> (LANES - count), tile: None, ahead: Place::default() }
    }

    /// The particles' tile; `columns` are those to gather in `spare` if it has no tile of its own.
    #[inline(always)]
    pub(super) fn tile<'a, const D: usize>(
        &self,
        tiles: &'a [[f64; LANES]],
        columns: impl Iterator<Item = usize>,
        spare: &'a mut Tile,
    ) -> &'a [[f64; LANES]] {
        let Some(tile) = self.tile else {
            self.bring_together::<D>(tiles, columns, spare);
            return &spare.0[..Layout::<D>::REALS];
        };
        &tiles[tile as usize * Layout::<D>::REALS..][..Layout::<D>::REALS]
    }

    /// The particles' tile, all columns, in `spare` if it has no tile of its own or columns are given.
    #[inline(always)]
    pub(super) fn tile_to_scatter<'a, const D: usize>(
        &self,
        tiles: &'a [[f64; LANES]],
        given: &[GivenColumn],
        spare: &'a mut Tile,
    ) -> &'a [[f64; LANES]] {
        if given.is_empty() {
            return self.tile::<D>(tiles, 0..Layout::<D>::REALS, spare);
        }
        self.bring_given::<D>(tiles, given, spare);
        &spare.0[..Layout::<D>::REALS]
    }

    #[inline(never)]
    fn bring_given<const D: usize>(&self, tiles: &[[f64; LANES]], given: &[GivenColumn], spare: &mut Tile) {
        match self.tile {
            None => self.bring_together::<D>(tiles, 0..Layout::<D>::REALS, spare),
            Some(tile) => {
                let own = &tiles[tile as usize * Layout::<D>::REALS..][..Layout::<D>::REALS];
                spare.0[..Layout::<D>::REALS].copy_from_slice(own);
            }
        }
        for GivenColumn { column, values } in given {
            spare.0[*column] = self.index.map(|p| values[p as usize]);
        }
    }

    /// The particles' tile, all columns, to be changed. A gathered one has to be put back.
    #[inline(always)]
    pub(super) fn tile_mut<'a, const D: usize>(
        &self,
        tiles: &'a mut [[f64; LANES]],
        spare: &'a mut Tile,
    ) -> &'a mut [[f64; LANES]] {
        let Some(tile) = self.tile else {
            self.bring_together::<D>(tiles, 0..Layout::<D>::REALS, spare);
            return &mut spare.0[..Layout::<D>::REALS];
        };
        &mut tiles[tile as usize * Layout::<D>::REALS..][..Layout::<D>::REALS]
    }

    #[inline(never)]
    fn bring_together<const D: usize>(
        &self,
        tiles: &[[f64; LANES]],
        columns: impl Iterator<Item = usize>,
        spare: &mut Tile,
    ) {
        let place = self.index.map(|p| (p as usize / TILE * Layout::<D>::REALS, p as usize % TILE));
        for column in columns {
            spare.0[column] = place.map(|(line, lane)| tiles[line + column][lane]);
        }
    }

    /// Writes members back that were gathered in `spare`.
    #[inline(always)]
    pub(super) fn put_back<const D: usize>(&self, tiles: &mut [[f64; LANES]], spare: &Tile) {
        if self.tile.is_none() {
            self.scatter_back::<D>(tiles, spare);
        }
    }

    #[inline(never)]
    fn scatter_back<const D: usize>(&self, tiles: &mut [[f64; LANES]], spare: &Tile) {
        for lane in self.members() {
            let p = self.particle(lane);
            let own = &mut tiles[p / TILE * Layout::<D>::REALS..][..Layout::<D>::REALS];
            own.iter_mut().zip(&spare.0).for_each(|(line, from)| line[p % TILE] = from[lane]);
        }
    }

    /// Lanes that are members, in order.
    #[inline(always)]
    pub(super) fn members(&self) -> impl Iterator<Item = usize> + use<> {
        lanes_in(self.lanes)
    }

    /// Which of some lanes, a bit each, are members.
    #[inline(always)]
    pub(super) fn members_among(&self, lanes: u32) -> u32 {
        self.lanes & lanes
    }

    /// `values` of members, 0 elsewhere.
    #[inline(always)]
    pub(super) fn of_members<V: Vector>(&self, values: V) -> V {
        self.merged(values, V::splat(0.0))
    }

    /// `values` of members, `others` elsewhere.
    #[inline(always)]
    fn merged<V: Vector>(&self, values: V, others: V) -> V {
        if self.lanes == ALL { values } else { V::Mask::from_bits(self.lanes).select(values, others) }
    }

    /// Particle of a lane.
    #[inline(always)]
    pub(super) fn particle(&self, lane: usize) -> usize {
        self.index[lane] as usize
    }

    /// Prefetches a column of a later batch.
    #[inline(always)]
    fn read_ahead(&self, column: usize) {
        prefetch(self.ahead.tiles.wrapping_add(column * size_of::<[f64; TILE]>()));
    }

    /// Reads a column of the particles' tile.
    #[inline(always)]
    pub(super) fn load<V: Vector>(&self, tile: &[[f64; LANES]], column: usize) -> V {
        self.read_ahead(column);
        V::load(&tile[column])
    }

    /// Writes a column of members in the particles' tile.
    #[inline(always)]
    pub(super) fn store<V: Vector>(&self, tile: &mut [[f64; LANES]], column: usize, values: V) {
        self.read_ahead(column);
        let line = &mut tile[column];
        self.merged(values, V::load(line)).store(line);
    }

    /// The members' values in a list with one for each particle of the chunk.
    #[inline(always)]
    pub(super) fn values<V: Vector>(&self, of: &[f64]) -> V {
        V::load(&std::array::from_fn(|lane| of.get(self.particle(lane)).copied().unwrap_or(0.0)))
    }

    /// Positions.
    #[inline(always)]
    pub(super) fn positions<V: Vector, const D: usize>(&self, tile: &[[f64; LANES]]) -> [V; D] {
        let mut position = [V::splat(0.0); D];
        for axis in 0..D {
            position[axis] = self.load(tile, Layout::<D>::POSITION + axis);
        }
        position
    }

    /// Material index of each lane.
    #[inline(always)]
    pub(super) fn materials(&self, tags: &[u64]) -> [u16; LANES] {
        prefetch(self.ahead.tags);
        // The material is the low half word of a packed tag.
        std::array::from_fn(|lane| tags[self.particle(lane)] as u16)
    }
}

/// Whether particles are those of a tile in order. All are compared: members of a family come in any order.
#[inline(always)]
fn is_tile(list: &[u32; LANES]) -> bool {
    let begins = list[0].is_multiple_of(TILE as u32);
    (0..LANES).fold(begins, |is_run, lane| is_run & (list[lane] == list[0].wrapping_add(lane as u32)))
}

/// The lanes of a set that has a bit for each.
#[inline(always)]
pub(super) fn lanes_in(mut set: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = set.trailing_zeros() as usize;
        set &= set.wrapping_sub(1);
        (lane < LANES).then_some(lane)
    })
}
