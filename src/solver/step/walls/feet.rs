//! Feet: the places of a collider's surface at which it holds the nodes behind it.
use crate::boundary::{Contact, Gap, Touching, gap};
use crate::grid::GridPlan;
use crate::grid::leaf_geometry::leaf_box;
use crate::grid::mask::{block_nodes, node_of_bit, offset, offset_count, offset_index};
use crate::grid::plan::{NO_BLOCK, arena_index};
use crate::kernel::{ARENA_EDGE, BLOCK, Coordinates, Row};
use crate::leapfrog::Lengths;
use crate::solver::state::grid::inside::{Inside, Plane, SAME};

/// Corners of a cell, at most.
const CORNERS: usize = 8;

/// Share of the volume of cells round a foot above which material that does not end towards the surface is
/// all round it.
const FULL: f64 = 0.5;

/// A place on the surface of a collider, in a cell of a leaf.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foot<const D: usize> {
    /// Number of the collider.
    pub collider: usize,
    /// The place, m.
    pub at: [f64; D],
    /// Outward unit normal of the surface.
    pub normal: [f64; D],
    /// The node that it is the foot of: its number in the arena of the leaf, and that of its row.
    pub node: [usize; 2],
    /// Whether the node is so deep that its hat does not reach the foot.
    pub is_deep: bool,
    /// Edge of the cells, m.
    pub cell: f64,
    /// Of the corners of the cell: weights at the foot, and places from it, m.
    pub weights: [f64; CORNERS],
    arms: [[f64; D]; CORNERS],
    /// Number of the first corner in the arena.
    first: usize,
    /// Numbers of the rows of the corners.
    rows: [u32; CORNERS],
    /// Bits of the corners that are constrained.
    constrained: u8,
}

/// The feet in an own leaf.
#[derive(Clone, Debug)]
pub(super) struct LeafFeet<const D: usize> {
    /// Bin of the leaf's own level.
    pub bin: usize,
    pub feet: Vec<Foot<D>>,
    /// Condition at each foot; none at those of deep nodes.
    pub touching: Vec<Option<Touching<D>>>,
}

impl<const D: usize> LeafFeet<D> {
    /// Those in own leaf number `leaf` of colliders that act at feet, whose nodes `inside` says by block. A
    /// foot on a face between leaves is in the upper one. The node of each foot is at most two cells away, so
    /// the arena has it.
    pub(super) fn find<'a>(
        plan: &GridPlan<D>,
        leaf: usize,
        inside: impl Fn(usize) -> &'a [Option<Inside<D>>],
        has_mass: impl Fn(usize) -> bool,
        acts: impl Fn(usize) -> bool,
        acts_at_node: impl Fn(usize, &Plane<D>, f64) -> bool,
        normal: impl Fn(usize, &[f64; D]) -> [f64; D],
    ) -> Self {
        let number = plan.leaf_bins(leaf).start;
        let bin = &plan.bins[number];
        let mut found = Self { bin: number, feet: Vec::new(), touching: Vec::new() };
        for (index, &block) in bin.around.iter().take(offset_count(D)).enumerate() {
            if block == NO_BLOCK {
                continue;
            }
            let towards = offset::<D>(index);
            let in_arena = |bit: u32| {
                let node = node_of_bit::<D>(bit);
                (0..D).all(|a| (-1..=5).contains(&(4 * towards[a] + node[a] as i32)))
            };
            for (collider, inside) in inside(block as usize).iter().enumerate() {
                let Some(inside) = inside.as_ref().filter(|_| acts(collider)) else { continue };
                let cell = plan.cell(plan.blocks[block as usize].level);
                for plane in &inside.planes {
                    let row = block as usize * block_nodes(D) + usize::from(plane.bit);
                    let bit = plane.bit.into();
                    if in_arena(bit) && has_mass(row) && !acts_at_node(collider, plane, cell) {
                        let node = [arena_index::<D>(index, bit), row];
                        found.feet.extend(Foot::new(plan, leaf, collider, plane.foot, plane.normal, node));
                    }
                }
                for bit in crate::grid::mask::bits(inside.buried) {
                    let row = block as usize * block_nodes(D) + bit as usize;
                    if in_arena(bit) && has_mass(row) {
                        let x = plan.node_place(&plan.blocks[block as usize], bit as usize);
                        let node = [arena_index::<D>(index, bit), row];
                        found.feet.extend(Foot::new(plan, leaf, collider, x, normal(collider, &x), node));
                    }
                }
            }
        }
        found.touching.resize_with(found.feet.len(), || None);
        found
    }
}

impl<const D: usize> Foot<D> {
    /// A foot in an own leaf; `None` if it is in another.
    fn new(
        plan: &GridPlan<D>,
        leaf: usize,
        collider: usize,
        at: [f64; D],
        normal: [f64; D],
        node: [usize; 2],
    ) -> Option<Self> {
        let octant = &plan.tree.leaves()[plan.tree.first_own() + leaf];
        let (lower, upper) = leaf_box(octant, plan.root_edge);
        let extent = plan.extent();
        let at: [f64; D] = std::array::from_fn(|a| at[a].clamp(0.0, extent[a]));
        let is_here = (0..D).all(|a| lower[a] <= at[a] && (at[a] < upper[a] || upper[a] >= extent[a]));
        if !is_here {
            return None;
        }
        let cell = plan.cell(octant.level);
        let in_cells: [f64; D] = std::array::from_fn(|a| (at[a] - lower[a]) / cell);
        let lowest: [usize; D] = in_cells.map(|x| (x as usize).min(BLOCK - 1));
        let bin = &plan.bins[plan.leaf_bins(leaf).start];
        let mut foot = Self {
            collider,
            at,
            normal,
            node,
            is_deep: false,
            cell,
            weights: [0.0; CORNERS],
            arms: [[0.0; D]; CORNERS],
            first: (0..D).map(|a| (lowest[a] + 1) * ARENA_EDGE.pow(a as u32)).sum(),
            rows: [0; CORNERS],
            constrained: 0,
        };
        for corner in 0..1usize << D {
            let up = |a: usize| corner >> a & 1;
            let weight = (0..D).fold(1.0, |weight: f64, a| {
                let share = in_cells[a] - lowest[a] as f64;
                weight * if up(a) == 1 { share } else { 1.0 - share }
            });
            let place: [usize; D] = std::array::from_fn(|a| lowest[a] + up(a));
            let block = bin.around[offset_index::<D>(place.map(|x| i32::from(x == BLOCK)))];
            if block == NO_BLOCK {
                continue;
            }
            let bit = (0..D).map(|a| (place[a] % BLOCK) << (2 * a)).sum::<usize>();
            foot.weights[corner] = weight;
            foot.arms[corner] = std::array::from_fn(|a| (place[a] as f64 - in_cells[a]) * cell);
            foot.rows[corner] = (block as usize * block_nodes(D) + bit) as u32;
            foot.constrained |= ((plan.blocks[block as usize].constrained >> bit & 1) as u8) << corner;
        }
        let hat = (0..D).fold(1.0, |hat: f64, a| {
            let node = (node[0] / ARENA_EDGE.pow(a as u32) % ARENA_EDGE) as f64 - 1.0;
            hat * (1.0 - (node - in_cells[a]).abs()).max(0.0)
        });
        foot.is_deep = hat <= SAME;
        Some(foot)
    }

    /// `Σ N v` at the foot over the rows of its corners.
    pub(super) fn gather(&self, rows: &[Row]) -> [f64; 4] {
        let mut sum = [0.0; 4];
        for corner in 0..1usize << D {
            let row = &rows[self.rows[corner] as usize].0;
            (0..4).for_each(|lane| sum[lane] = self.weights[corner].mul_add(row[lane], sum[lane]));
        }
        sum
    }

    /// The rows of its corners.
    pub(super) fn at_corners(&self, rows: &[Row]) -> [[f64; 4]; CORNERS] {
        std::array::from_fn(
            |corner| if corner < 1 << D { rows[self.rows[corner] as usize].0 } else { [0.0; 4] },
        )
    }

    /// Adds a value to the corners of its cell in the arena of the leaf, by weights.
    pub(super) fn scatter(&self, value: &[f64; 4], arena: &mut [Row]) {
        for corner in 0..1usize << D {
            let node =
                self.first + (0..D).map(|a| (corner >> a & 1) * ARENA_EDGE.pow(a as u32)).sum::<usize>();
            let row = &mut arena[node].0;
            (0..4).for_each(|lane| row[lane] = self.weights[corner].mul_add(value[lane], row[lane]));
        }
    }

    /// Gap between the surface and the material: the mean over the corners of the cell by the parts of the
    /// material's surface that they have. `sizes` has `Σ V w / h` of the corners in its first lanes, `slopes`
    /// has `Σ V ∇w`. What has yielded touches. `None` where the material lies on the other side.
    pub(super) fn gap(
        &self,
        coordinates: Coordinates,
        sizes: &[[f64; 4]; CORNERS],
        slopes: &[[f64; 4]; CORNERS],
    ) -> Option<Gap> {
        let (mut sum, mut area, mut filled) = (0.0, 0.0, 0.0);
        let (mut size, mut steepness) = (0.0, 0.0);
        // Constrained nodes have what their parents have, in cells twice as wide.
        let cell =
            |corner: usize| if self.constrained >> corner & 1 == 1 { 2.0 * self.cell } else { self.cell };
        let above =
            |corner: usize| (0..D).fold(0.0, |sum, a| self.arms[corner][a].mul_add(self.normal[a], sum));
        for corner in 0..1usize << D {
            let slope = gap::slope(&slopes[corner], &self.normal);
            let cell = cell(corner);
            size += self.weights[corner] * sizes[corner][0];
            steepness += self.weights[corner] * slope.abs();
            filled += self.weights[corner] * sizes[corner][0] / cell.powi(D as i32 - 1);
            if slope > 0.0 && self.weights[corner] > 0.0 {
                let part = self.weights[corner] * slope;
                let bend = coordinates.bend(self.normal[0], cell, self.at[0] + self.arms[corner][0]);
                let height = gap::height(sizes[corner][0], slope, 1.0, bend);
                sum += part * height.mul_add(cell, above(corner));
                area += part;
            }
        }
        if gap::has_yielded(size, steepness) {
            return Some(Gap::CLOSED);
        }
        if area <= 0.0 {
            return (filled >= FULL).then_some(Gap { width: -self.cell, cover: 1.0 });
        }
        let width = sum / area;
        let full = (0..1usize << D).fold(0.0, |full, corner| {
            let cell = cell(corner);
            let face = coordinates.face_area::<D>(cell, self.at[0] + self.arms[corner][0]);
            full + self.weights[corner] * gap::full_slope(face, (width - above(corner)) / cell)
        });
        Some(Gap::new(width, area, full))
    }

    /// Greatest impulse along each axis of a foot with this law whose impulse along the normal is 1 kg m/s,
    /// kg m/s.
    pub(super) fn reach(&self, law: Contact) -> [f64; D] {
        let along = match law {
            Contact::Separating { friction, .. } if !law.acts_by_area() => friction.min(1.0),
            Contact::Slip => 0.0,
            _ => 1.0,
        };
        self.normal.map(|n| along.mul_add((1.0 - n * n).max(0.0).sqrt(), n.abs()))
    }

    /// The contact across a gap in a step of these lengths with a surface that moves so fast, m/s.
    pub(super) fn touching(
        &self,
        law: Contact,
        surface: [f64; D],
        gap: Gap,
        lengths: Lengths,
    ) -> Touching<D> {
        let over = if gap.width <= gap::STICKS * self.cell { lengths.kick } else { 0.0 };
        Touching {
            collider: self.collider,
            normal: self.normal,
            arm: [0.0; D],
            lever: [0.0; D],
            surface,
            bounds: law.bounds(law.across(gap, self.cell, lengths.drift)),
            law,
            // Of an area of 1 m² and a density of 1 kg/m³, until these are known.
            sticking: law.cohesion() * over,
            drag: law.drag() * over,
            area: 1.0,
            compliance: [0.0; 2],
            impulse: [0.0; D],
        }
    }
}
