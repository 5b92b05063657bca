//! Nodes inside colliders, and the surfaces that they are behind.
use crate::boundary::{Collider, Contact};
use rustc_hash::FxHashMap;

use crate::boundary::motion::{Motion, Pose};
use crate::grid::GridPlan;
use crate::grid::mask::bits;
use crate::grid::plan::Block;
use crate::solver::physics::Physics;

/// Length, in cells, below which places are the same.
pub(in crate::solver) const SAME: f64 = 1e-6;

/// Depth under a surface, in cells, down to which nodes have a foot on it. No box that touches a surface
/// reaches deeper.
const DEEP: f64 = 2.0;

/// Length, in cells, of the way from a surface at which its other side is looked for.
const WAY: f64 = 1e-3;

/// Properties of nodes inside a collider that are asked for, beside which they are.
#[derive(Clone, Copy, Debug)]
pub(in crate::solver) struct Asked {
    /// Whether the surfaces that they are behind are: for feet and gaps.
    pub planes: bool,
    /// Whether normals are: to hold the nodes themselves.
    pub normals: bool,
}

impl Asked {
    /// Nothing.
    pub(in crate::solver) const NODES: Self = Self { planes: false, normals: false };

    /// Those that the velocity fields of a problem need inside a collider.
    pub(in crate::solver) fn of<const D: usize>(physics: &Physics<D>, collider: &Collider<D>) -> Self {
        let at_feet = |field: usize| physics.acts_at_feet(field, collider);
        let over_gaps = |field: usize| physics.moves_over_gaps(field);
        let fields = 0..physics.body_contacts.fields();
        Self {
            planes: fields.clone().any(|field| at_feet(field) || over_gaps(field)),
            normals: collider.contact != Contact::Sticky && !fields.into_iter().all(at_feet),
        }
    }
}

/// The nodes of one block that lie inside one collider.
#[derive(Clone, Debug, Default)]
pub(in crate::solver) struct Inside<const D: usize> {
    /// Nodes inside or on the surface.
    pub nodes: u64,
    /// Nodes that are so deep inside that only what began there can be at them.
    pub buried: u64,
    /// Nodes, inside or not, that are corners of a cell that the surface may cross, if planes are asked for.
    pub near: u64,
    /// The surfaces that nodes inside are behind, in the order of the nodes, if they are asked for.
    pub planes: Vec<Plane<D>>,
    /// Outward unit normals at nodes inside that are not buried, in the order of the nodes, if they are asked
    /// for.
    pub normals: Vec<[f64; D]>,
}

/// A surface that a node is behind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::solver) struct Plane<const D: usize> {
    /// Bit of the node in its block.
    pub bit: u8,
    /// Foot of the node on the surface, m.
    pub foot: [f64; D],
    /// Outward unit normal.
    pub normal: [f64; D],
}

/// Nodes inside colliders that never move, by block and collider: found once, on demand, since the distance
/// to a mesh or a terrain takes longer than all other work at a node.
pub(in crate::solver) type InsideStill<const D: usize> = Vec<Vec<Option<Inside<D>>>>;

/// Known nodes of blocks by place and real nodes, to carry them from one plan to the next.
pub(in crate::solver) struct KnownInside<const D: usize>(FxHashMap<Place<D>, Vec<Option<Inside<D>>>>);

/// Level and coordinate of a block.
type Place<const D: usize> = (u8, [u32; D]);

fn place<const D: usize>(block: &Block<D>) -> Place<D> {
    (block.level, block.coord)
}

impl<const D: usize> KnownInside<D> {
    /// Known nodes of the blocks of a plan.
    pub(in crate::solver) fn of(plan: &GridPlan<D>, still: InsideStill<D>) -> Self {
        let known = plan.blocks.iter().zip(still).filter(|(_, still)| !still.is_empty());
        Self(known.map(|(block, still)| (place(block), still)).collect())
    }

    /// The known nodes that belong to the blocks of a plan.
    pub(in crate::solver) fn for_plan(mut self, plan: &GridPlan<D>) -> InsideStill<D> {
        if self.0.is_empty() {
            return Vec::new();
        }
        plan.blocks.iter().map(|block| self.0.remove(&place(block)).unwrap_or_default()).collect()
    }
}

impl<const D: usize> Inside<D> {
    /// Nodes inside among `nodes` of a block. Where the surface lies on that of another collider of `beside`,
    /// which may name this one as well, it is none.
    pub(in crate::solver) fn find(
        plan: &GridPlan<D>,
        block: &Block<D>,
        nodes: u64,
        (collider, pose): Placed<'_, D>,
        beside: &[Placed<'_, D>],
        asked: Asked,
    ) -> Self {
        let mut inside = Self::default();
        let cell = plan.cell(block.level);
        let reach = cell * (D as f64).sqrt() * (1.0 + SAME);
        let nodes_box = plan.nodes_box(block);
        if collider.distance_to_box(&nodes_box, pose) > reach {
            return inside;
        }
        let near = |(other, pose): &&Placed<'_, D>| {
            !std::ptr::eq(*other, collider) && other.distance_to_box(&nodes_box, pose) <= reach
        };
        let beside: Vec<Placed<'_, D>> = match asked.planes {
            true => beside.iter().filter(near).copied().collect(),
            false => Vec::new(),
        };
        let surface = Surface { collider, pose, cell, beside: &beside };
        for bit in bits(nodes) {
            let x = plan.node_place(block, bit as usize);
            let distance = collider.distance(&x, pose);
            if distance <= SAME * cell {
                inside.nodes |= 1 << bit;
            }
            if asked.planes && distance.abs() <= reach {
                inside.near |= 1 << bit;
            }
            if distance < -DEEP * cell {
                inside.buried |= 1 << bit;
            } else if distance <= SAME * cell {
                if asked.normals {
                    inside.normals.push(collider.normal(&x, pose));
                }
                if asked.planes {
                    surface.planes_of(&x, distance, |foot, normal| {
                        inside.planes.push(Plane { bit: bit as u8, foot, normal });
                    });
                }
            }
        }
        inside
    }
}

/// A collider in a pose.
pub(in crate::solver) type Placed<'a, const D: usize> = (&'a Collider<D>, &'a Pose<D>);

/// The surface of a collider in a pose, among nodes with cells of this edge, m, and other colliders.
struct Surface<'a, const D: usize> {
    collider: &'a Collider<D>,
    pose: &'a Pose<D>,
    cell: f64,
    beside: &'a [Placed<'a, D>],
}

impl<const D: usize> Surface<'_, D> {
    /// Calls `each` with foot and normal of the surfaces that a node at `x` (m), at this distance (m) of the
    /// collider, is behind.
    ///
    /// Mostly that is one: the nearest point of the surface, with the gradient of the distance as normal. In
    /// an inner corner this gradient has only one of the normals of the corner, or a mean of them, and the
    /// distance of a union knows of faces that two of its parts share and that are no surface. Both show at
    /// the foot: a cell along the normal is nearer to the collider than a cell. There the surfaces of the
    /// nodes around that pass through the foot take the place of the gradient; where the foot is on none of
    /// them, the nearest place that is takes its place.
    fn planes_of(&self, x: &[f64; D], distance: f64, mut each: impl FnMut([f64; D], [f64; D])) {
        let normal = self.collider.normal(x, self.pose);
        let foot = along(x, -distance, &normal);
        if self.is_seam(&foot, &normal) {
            let found = self.way_out_of_all(x);
            if found.is_empty() {
                each(foot, normal);
            }
            return found.into_iter().for_each(|(foot, normal)| each(foot, normal));
        }
        if self.is_free(&foot, &normal, 1.0) {
            return each(foot, normal);
        }
        let own = self.is_free(&foot, &normal, WAY).then_some(normal);
        let mut normals: Vec<[f64; D]> = own.into_iter().collect();
        for (place, normal) in self.around(x) {
            let off: [f64; D] = std::array::from_fn(|a| place[a] - foot[a]);
            let is_through = dot(&off, &normal).abs() <= SAME * self.cell;
            // Beside an outer corner the other surface lies behind the own one.
            let is_inner = own.is_none_or(|own| dot(&off, &own) > SAME * self.cell);
            let is_new = normals.iter().all(|known| dot(known, &normal) < 1.0 - SAME);
            if is_through && is_inner && is_new {
                normals.push(normal);
            }
        }
        // Between two parts of a union, a surface beside may pass through what is no foot.
        let out = normals.iter().fold([0.0; D], |sum, normal| along(&sum, 1.0, normal));
        let is_out = self.collider.distance(&along(&foot, WAY * self.cell, &out), self.pose);
        if own.is_none() && (normals.is_empty() || is_out < -SAME * self.cell) {
            let found = self.nearest(x).or_else(|| self.way_out(x));
            let (foot, normal) = found.unwrap_or((foot, normal));
            return each(foot, normal);
        }
        normals.into_iter().for_each(|normal| each(foot, normal));
    }

    /// The surfaces of the nodes around one at `x`: a place and the normal of each.
    fn around(&self, x: &[f64; D]) -> impl Iterator<Item = ([f64; D], [f64; D])> {
        let offsets = crate::grid::mask::box_offsets::<D>(1).filter(|offset| *offset != [0; D]);
        offsets.filter_map(move |offset| {
            let beside: [f64; D] = std::array::from_fn(|a| f64::from(offset[a]).mul_add(self.cell, x[a]));
            let distance = self.collider.distance(&beside, self.pose);
            if distance > SAME * self.cell || -distance > DEEP * self.cell {
                return None;
            }
            let normal = self.collider.normal(&beside, self.pose);
            let place = along(&beside, -distance, &normal);
            self.is_free(&place, &normal, WAY).then_some((place, normal))
        })
    }

    /// Of the surfaces around, the place that is nearest to one inside, with the way there as normal: of
    /// nodes behind a corner in which two parts of a union meet.
    fn nearest(&self, x: &[f64; D]) -> Option<([f64; D], [f64; D])> {
        let mut best: Option<(f64, [f64; D])> = None;
        for (place, normal) in self.around(x) {
            // Along the surface, as far as it is one.
            let depth = (0..D).fold(0.0, |sum, a| (place[a] - x[a]).mul_add(normal[a], sum));
            let end = along(x, depth, &normal);
            let at = |share: f64| std::array::from_fn(|a| share.mul_add(end[a] - place[a], place[a]));
            let is_surface = |share: f64| self.is_free(&at(share), &normal, SAME);
            let (mut on, mut beyond) = (0.0, 1.0);
            if is_surface(beyond) {
                on = beyond;
            }
            for _ in 0..40 {
                let middle = 0.5 * (on + beyond);
                if is_surface(middle) { on = middle } else { beyond = middle }
            }
            let foot: [f64; D] = at(on);
            let far = (0..D).fold(0.0, |sum, a| (foot[a] - x[a]).mul_add(foot[a] - x[a], sum)).sqrt();
            if best.is_none_or(|(least, _)| far < least) {
                best = Some((far, foot));
            }
        }
        let (far, foot) = best.filter(|(far, _)| *far > SAME * self.cell)?;
        Some((foot, std::array::from_fn(|a| (foot[a] - x[a]) / far)))
    }

    /// Whether a way from a place on the surface along the normal, of so many cells, leads away from all of
    /// the collider.
    fn is_free(&self, place: &[f64; D], normal: &[f64; D], cells: f64) -> bool {
        let way = cells * self.cell;
        self.collider.distance(&along(place, way, normal), self.pose) >= (1.0 - WAY) * way
    }

    /// The nearest place of the surface along an axis from a place inside, with its normal: of nodes behind a
    /// face that two parts share.
    fn way_out(&self, x: &[f64; D]) -> Option<([f64; D], [f64; D])> {
        let axes = (0..D).flat_map(|axis| {
            [1.0, -1.0].map(|side| std::array::from_fn(|a| if a == axis { side } else { 0.0 }))
        });
        let distance = |x: &[f64; D]| self.collider.distance(x, self.pose);
        let (place, beyond) = self.shortest(x, axes, distance)?;
        Some((place, self.collider.normal(&beyond, self.pose)))
    }

    /// The same out of this collider and all beside, also along diagonals, with the normals of all surfaces
    /// there: of nodes behind a face on which another collider stands.
    fn way_out_of_all(&self, x: &[f64; D]) -> Vec<([f64; D], [f64; D])> {
        let offsets = crate::grid::mask::box_offsets::<D>(1).filter(|offset| *offset != [0; D]);
        let ways = offsets.map(|offset| {
            let size = offset.iter().map(|o| f64::from(o * o)).sum::<f64>().sqrt();
            offset.map(|o| f64::from(o) / size)
        });
        let all = || std::iter::once((self.collider, self.pose)).chain(self.beside.iter().copied());
        let distance =
            |x: &[f64; D]| all().map(|(of, pose)| of.distance(x, pose)).fold(f64::INFINITY, f64::min);
        let mut found: Vec<([f64; D], [f64; D])> = Vec::new();
        let Some((place, beyond)) = self.shortest(x, ways, distance) else { return found };
        for (collider, pose) in all() {
            let normal = collider.normal(&beyond, pose);
            let is_new = found.iter().all(|(_, known)| dot(known, &normal) < 1.0 - SAME);
            if is_new && collider.distance(&place, pose) <= SAME * self.cell {
                found.push((place, normal));
            }
        }
        found
    }

    /// Where the shortest of these ways from a place inside leads out, and a place beyond. The first counts
    /// of those that are as short.
    fn shortest(
        &self,
        x: &[f64; D],
        ways: impl Iterator<Item = [f64; D]>,
        distance: impl Fn(&[f64; D]) -> f64,
    ) -> Option<([f64; D], [f64; D])> {
        let mut best: Option<(f64, [f64; D])> = None;
        for way in ways {
            let is_out = |t: f64| distance(&along(x, t, &way)) > 0.0;
            let steps = 8;
            let step = DEEP * self.cell / f64::from(steps);
            let Some(first) =
                (0..=steps).map(|k| f64::from(k).mul_add(step, WAY * self.cell)).find(|t| is_out(*t))
            else {
                continue;
            };
            let (mut within, mut without) = ((first - step).max(0.0), first);
            for _ in 0..40 {
                let middle = 0.5 * (within + without);
                if is_out(middle) { without = middle } else { within = middle }
            }
            if best.is_none_or(|(least, _)| without < least - SAME * self.cell) {
                best = Some((without, way));
            }
        }
        let (t, way) = best?;
        Some((along(x, t, &way), along(x, t + WAY * self.cell, &way)))
    }

    /// Whether another collider stands on a place of the surface with this normal: no material is there, and
    /// the surface holds nothing.
    fn is_seam(&self, foot: &[f64; D], normal: &[f64; D]) -> bool {
        self.beside.iter().any(|(other, pose)| {
            other.distance(&along(foot, WAY * self.cell, normal), pose) < 0.0
                && dot(&other.normal(foot, pose), normal) < -0.5
        })
    }
}

/// The place that lies so far (m) from `x` along a direction.
fn along<const D: usize>(x: &[f64; D], far: f64, direction: &[f64; D]) -> [f64; D] {
    std::array::from_fn(|a| far.mul_add(direction[a], x[a]))
}

/// Inner product.
pub(in crate::solver) fn dot<const D: usize>(a: &[f64; D], b: &[f64; D]) -> f64 {
    (0..D).fold(0.0, |sum, k| a[k].mul_add(b[k], sum))
}

/// Whether a collider never moves while a grid is in use.
pub(in crate::solver) fn is_still<const D: usize>(collider: &Collider<D>) -> bool {
    matches!(collider.motion, Motion::Fixed) && collider.deforming.is_none()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::boundary::ActsOn;
    use crate::geometry::Aabb;
    use crate::geometry::Shape;

    /// Feet and normals of a node among cells of 1 m inside a collider of this shape.
    fn planes<const D: usize>(shape: Shape<D>, x: [f64; D]) -> Vec<([f64; D], [f64; D])> {
        let collider = Collider {
            name: "c".into(),
            shape,
            deforming: None,
            reference: [0.0; D],
            axis: [0.0, 0.0, 1.0],
            contact: Contact::default(),
            acts_on: ActsOn::Nodes,
            motion: Motion::Fixed,
            start: 0.0,
        };
        let pose = collider.state_at(0.0).pose;
        let surface = Surface { collider: &collider, pose: &pose, cell: 1.0, beside: &[] };
        let mut planes = Vec::new();
        let rounded = |x: [f64; D]| x.map(|x| (1e9 * x).round() / 1e9);
        surface.planes_of(&x, collider.distance(&x, &pose), |foot, normal| {
            planes.push((rounded(foot), rounded(normal)));
        });
        planes.sort_by(|a, b| a.1.partial_cmp(&b.1).expect("numbers"));
        planes
    }

    fn part<const D: usize>(lower: [f64; D], upper: [f64; D]) -> Shape<D> {
        Shape::Box(Aabb::new(lower, upper))
    }

    fn tank(corner: [f64; 2]) -> Shape<2> {
        Shape::Difference(Box::new(part([-5.0; 2], [20.0; 2])), vec![part(corner, [10.0, 30.0])])
    }

    const X: [f64; 2] = [1.0, 0.0];
    const Y: [f64; 2] = [0.0, 1.0];

    #[test]
    fn faces_hold_by_their_normal() {
        assert_eq!(planes(part([0.0, -3.0], [9.0, 0.5]), [4.0, 0.0]), [([4.0, 0.5], Y)]);
        assert_eq!(planes(tank([0.25, 0.5]), [4.0, -1.0]), [([4.0, 0.5], Y)]);
        // An outer corner has the normal of one of its faces.
        assert_eq!(planes(part([-3.0, -3.0], [0.0, 0.5]), [0.0, 0.0]).len(), 1);
    }

    #[test]
    fn inner_corners_hold_by_both_normals() {
        for corner in [[0.0, 0.0], [0.25, 0.5], [0.5, 0.5]] {
            assert_eq!(planes(tank(corner), [0.0, 0.0]), [(corner, Y), (corner, X)], "{corner:?}");
        }
        let (floor, wall) = (part([-3.0, -3.0], [9.0, 0.0]), part([-3.0, 0.0], [0.0, 9.0]));
        assert_eq!(planes(Shape::Union(vec![floor, wall]), [0.0, 0.0]), [([0.0, 0.0], Y), ([0.0, 0.0], X)]);
        let room = Shape::Difference(Box::new(part([-5.0; 3], [20.0; 3])), vec![part([0.0; 3], [10.0; 3])]);
        assert_eq!(planes(room, [0.0; 3]).len(), 3);
    }

    #[test]
    fn nodes_behind_the_corner_of_a_union_have_their_foot_on_its_surface() {
        let (floor, wall) = (part([-3.0, -3.0], [9.0, 0.0]), part([-3.0, 0.0], [0.0, 9.0]));
        let union = Shape::Union(vec![floor, wall]);
        for (x, expected, along) in [([-1.0, 0.0], [0.0, 0.0], X), ([-1.0, 1.0], [0.0, 1.0], X)] {
            let found = planes(union.clone(), x);
            let [(foot, normal)] = found[..] else { panic!("{found:?}") };
            let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            assert!(off(foot, expected) < 1e-5 && off(normal, along) < 1e-5, "{found:?}");
        }
    }

    #[test]
    fn faces_on_which_another_collider_stands_are_no_surface() {
        let collider = |shape: Shape<2>| Collider {
            name: "c".into(),
            shape,
            deforming: None,
            reference: [0.0; 2],
            axis: [0.0, 0.0, 1.0],
            contact: Contact::default(),
            acts_on: ActsOn::Nodes,
            motion: Motion::Fixed,
            start: 0.0,
        };
        let floor = collider(part([-9.0, -9.0], [9.0, 0.0]));
        let wall = collider(part([-9.0, 0.0], [0.0, 9.0]));
        let pose = floor.state_at(0.0).pose;
        let all = [(&floor, &pose), (&wall, &pose)];
        let planes = |own: usize, x: [f64; 2]| {
            let (collider, pose) = all[own];
            let surface = Surface { collider, pose, cell: 1.0, beside: &all[1 - own..2 - own] };
            let mut planes = Vec::new();
            surface.planes_of(&x, collider.distance(&x, pose), |foot, normal| planes.push((foot, normal)));
            planes
        };
        let near = |found: &[([f64; 2], [f64; 2])], expected: &[([f64; 2], [f64; 2])]| {
            let off = |a: [f64; 2], b: [f64; 2]| (a[0] - b[0]).hypot(a[1] - b[1]);
            let is_same = found.len() == expected.len()
                && found.iter().zip(expected).all(|(f, e)| off(f.0, e.0) < 1e-6 && off(f.1, e.1) < 1e-6);
            assert!(is_same, "{found:?}, expected {expected:?}");
        };
        near(&planes(0, [4.0, -0.5]), &[([4.0, 0.0], Y)]);
        near(&planes(1, [-1.5, 0.5]), &[([0.0, 0.5], X)]);
        near(&planes(0, [-0.5, -0.5]), &[([0.0, 0.0], Y), ([0.0, 0.0], X)]);
        near(&planes(0, [-1.25, -0.25]), &[([0.0, 1.0], X)]);
    }

    #[test]
    fn faces_that_two_parts_share_are_no_surface() {
        for apart in [0.0, 0.5] {
            let halves = vec![part([-9.0, -3.0], [apart, 0.0]), part([-apart, -3.0], [9.0, 0.0])];
            for depth in [0.0, 1.0] {
                let found = planes(Shape::Union(halves.clone()), [0.0, -depth]);
                assert_eq!(found, [([0.0, 0.0], Y)]);
            }
        }
    }
}
