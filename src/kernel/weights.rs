//! Tensor-product stencils of a batch of boxes.
use super::stencil::Axis;
use super::{ARENA_EDGE, BASES, Coordinates, Frame, Row, Scheme, SubBox};
use crate::simd::{F64x4, LANES, Lanes, Vector};

/// Factors of one axis, node by node and lane by lane.
#[derive(Clone, Copy)]
pub(super) struct Factors {
    pub weight: [[f64; LANES]; 3],
    /// Weight times (node - particle), m.
    pub arm: [[f64; LANES]; 3],
    /// Derivative of the weight, 1/m.
    pub slope: [[f64; LANES]; 3],
}

/// Stencils of a batch. Made once and filled for batch after batch. Aligned to cache lines, so that lanes
/// are.
#[repr(align(64))]
pub(super) struct Weights<const D: usize> {
    /// Index of the lowest node in the arena; an integer plus 2^52.
    first: [f64; LANES],
    /// Index of the stencil among the bases; an integer plus 2^52.
    base: [f64; LANES],
    pub axis: [Factors; D],
    /// Products of y and z weights, `[b][c]`.
    pub product: [[[f64; LANES]; 3]; 3],
    /// `Σ w (node - particle)²` along each axis.
    pub spread: [[f64; LANES]; D],
    /// Further factors in axisymmetry, if `is_ring`.
    pub ring: Ring,
    pub is_ring: bool,
}

/// Sections of rings: means without the radius.
pub(super) struct Ring {
    /// Weights along the radius of plain means over the box, `∫ N dr / ∫ dr`.
    pub plain: [[f64; LANES]; 3],
    /// Factor that makes rates of the hoop of plain means of the radial velocity: 1 / radius, 1/m.
    pub hoop: [f64; LANES],
}

/// Weights of a batch node by node, `a + 3 b (+ 9 c)`, which only batches with constrained nodes need.
/// Padded, so that no index is out of bounds.
pub(super) struct NodeWeights(pub [[f64; LANES]; 32]);

/// 2^52: integers added to it stand in the low bits.
const TWO_52: f64 = 4_503_599_627_370_496.0;

impl<const D: usize> Weights<D> {
    pub(super) fn new() -> Self {
        let none = [[0.0; LANES]; 3];
        Self {
            first: [TWO_52; LANES],
            base: [TWO_52; LANES],
            axis: [Factors { weight: none, arm: none, slope: none }; D],
            product: [none; 3],
            spread: [[0.0; LANES]; D],
            ring: Ring { plain: none, hoop: [0.0; LANES] },
            is_ring: false,
        }
    }

    /// Whole boxes around `position`.
    #[inline(always)]
    pub(super) fn fill_whole<V: Vector>(
        &mut self,
        scheme: &Scheme,
        frame: &Frame<D>,
        position: &[V; D],
        half: &[V; D],
    ) {
        self.fill(frame, position, position, half);
        if scheme.coordinates == Coordinates::Axisymmetric {
            let [radius, half] = [position[0], half[0]].map(|lanes| Lanes::new(lanes.to_array()));
            self.revolve(frame, radius, radius, half, half);
        }
    }

    /// Parts of boxes around `position`.
    pub(super) fn fill_parts(
        &mut self,
        coordinates: Coordinates,
        frame: &Frame<D>,
        position: &[Lanes; D],
        parts: &[SubBox<D>],
    ) {
        let (centre, half) = SubBox::lanes(parts);
        self.fill(frame, position, &centre, &half);
        if coordinates == Coordinates::Axisymmetric {
            self.revolve(frame, position[0], centre[0], half[0], SubBox::wholes(parts));
        }
        if let Some(factors) = SubBox::softening(parts) {
            self.soften(&factors);
        }
    }

    /// Boxes around `centre`, arms relative to `position`.
    #[inline(always)]
    fn fill<V: Vector>(&mut self, frame: &Frame<D>, position: &[V; D], centre: &[V; D], half: &[V; D]) {
        self.is_ring = false;
        let inverse = 1.0 / frame.cell;
        let mut first = V::splat(0.0);
        let mut base = first;
        for k in (0..D).rev() {
            let corner = V::splat(frame.corner[k]);
            let axis = Axis::new((centre[k] - corner) * inverse, half[k] * inverse, inverse);
            let offset = axis.offsets((position[k] - corner) * inverse, frame.cell);
            let place = axis.base + V::splat(1.0);
            first = first.mul_add(V::splat(ARENA_EDGE as f64), place);
            base = base.mul_add(V::splat(BASES as f64), place);
            let mut spread = V::splat(0.0);
            let to = &mut self.axis[k];
            for i in 0..3 {
                let arm = axis.weight[i] * offset[i];
                spread = arm.mul_add(offset[i], spread);
                axis.weight[i].store(&mut to.weight[i]);
                arm.store(&mut to.arm[i]);
                axis.slope[i].store(&mut to.slope[i]);
            }
            spread.store(&mut self.spread[k]);
        }
        if D == 3 {
            let (y, z) = (&self.axis[1].weight, &self.axis[D - 1].weight);
            for b in 0..3 {
                for c in 0..3 {
                    (V::load(&y[b]) * V::load(&z[c])).store(&mut self.product[b][c]);
                }
            }
        }
        (first + V::splat(TWO_52)).store(&mut self.first);
        (base + V::splat(TWO_52)).store(&mut self.base);
    }

    /// Replaces the factors along the first axis by those of axisymmetry (see [`Axis::revolved`]), for
    /// particles at `radius` whose boxes, or parts of boxes, are these; `whole` is the half width of the
    /// whole box. Arms are relative to the centre of mass of the whole box, to which the velocity belongs.
    /// Out of line: planar kernels have one branch for it, and no registers.
    #[inline(never)]
    fn revolve(&mut self, frame: &Frame<D>, radius: Lanes, centre: Lanes, half: Lanes, whole: Lanes) {
        let (corner, inverse) = (frame.corner[0], 1.0 / frame.cell);
        let local = |x: Lanes| (x - Lanes::splat(corner)) * inverse;
        // No box is narrower than round-off, so one at the axis may reach beyond it by as much.
        let radius = radius.max(whole);
        let mass_centre = radius + whole * whole / (radius * 3.0);
        let axis = Axis::revolved(local(centre), half * inverse, frame.cell, corner, radius);
        let offset = axis.offsets(local(mass_centre), frame.cell);
        let mut spread = Lanes::splat(0.0);
        self.ring.plain = self.axis[0].weight;
        (Lanes::splat(1.0) / radius).store(&mut self.ring.hoop);
        self.is_ring = true;
        let to = &mut self.axis[0];
        for i in 0..3 {
            let arm = axis.weight[i] * offset[i];
            spread = arm.mul_add(offset[i], spread);
            axis.weight[i].store(&mut to.weight[i]);
            arm.store(&mut to.arm[i]);
            axis.slope[i].store(&mut to.slope[i]);
        }
        spread.store(&mut self.spread[0]);
    }

    /// Multiplies slopes and arms along each axis by a factor.
    #[inline(always)]
    pub(super) fn soften<V: Vector>(&mut self, factors: &[V; D]) {
        for (axis, factor) in self.axis.iter_mut().zip(factors) {
            for lanes in axis.slope.iter_mut().chain(&mut axis.arm) {
                (V::load(lanes) * *factor).store(lanes);
            }
        }
        if self.is_ring {
            (V::load(&self.ring.hoop) * factors[0]).store(&mut self.ring.hoop);
        }
    }

    /// Index of the lowest node in the arena.
    #[inline(always)]
    pub(super) fn first(&self, lane: usize) -> usize {
        self.first[lane].to_bits() as u16 as usize
    }

    /// Index in a table of stencils.
    #[inline(always)]
    pub(super) fn base(&self, lane: usize) -> usize {
        self.base[lane].to_bits() as u16 as usize
    }

    /// Calls `f` with the place in the arena, relative to the first node, and the weight of all nodes of a
    /// stencil.
    #[inline(always)]
    pub(super) fn for_each_node(&self, lane: usize, mut f: impl FnMut(usize, F64x4)) {
        let of = |values: &[f64; LANES]| F64x4::splat(values[lane]);
        let x = &self.axis[0].weight;
        let along = [of(&x[0]), of(&x[1]), of(&x[2])];
        for c in 0..if D == 3 { 3 } else { 1 } {
            for b in 0..3 {
                let across = of(if D == 3 { &self.product[b][c] } else { &self.axis[1].weight[b] });
                for a in 0..3 {
                    f(a + ARENA_EDGE * (b + ARENA_EDGE * c), along[a] * across);
                }
            }
        }
    }
}

/// Adds to the nodes of a stencil a sum of products of factors of the axes:
/// `product X_a + x_a (z_c Y_b + y_b Z_c)`, where X, Y and Z are `along` the axes and `product` is `y_b z_c`.
/// In 2D there is no z.
#[inline(always)]
pub(super) fn add_products<V: Vector, const D: usize>(
    nodes: &mut [Row],
    x: &[F64x4; 3],
    y: impl Fn(usize) -> F64x4,
    z: impl Fn(usize) -> F64x4,
    product: impl Fn(usize, usize) -> F64x4,
    along: &[[F64x4; 3]; D],
) {
    let nodes = &mut nodes[..super::stencil_span(D)];
    for c in 0..if D == 3 { 3 } else { 1 } {
        V::keep_wide();
        for b in 0..3 {
            let (product, other) = if D == 3 {
                (product(b, c), z(c).mul_add(along[1][b], y(b) * along[D - 1][c]))
            } else {
                (y(b), along[1][b])
            };
            for a in 0..3 {
                let node = &mut nodes[a + ARENA_EDGE * (b + ARENA_EDGE * c)].0;
                let sum = product.mul_add(along[0][a], F64x4::new(*node));
                *node = x[a].mul_add(other, sum).to_array();
            }
        }
    }
}

/// The nodes of a stencil averaged over all axes but one, for each axis: along x it is
/// `X_a = Σ_bc y_b z_c v_abc`, and so on. All come from one pass over the nodes.
#[inline(always)]
pub(super) fn pencils<V: Vector, const D: usize>(
    nodes: &[Row],
    x: &[F64x4; 3],
    y: impl Fn(usize) -> F64x4,
    z: impl Fn(usize) -> F64x4,
    product: impl Fn(usize, usize) -> F64x4,
) -> [[F64x4; 3]; D] {
    let nodes = &nodes[..super::stencil_span(D)];
    let zero = F64x4::splat(0.0);
    let mut pencil = [[zero; 3]; D];
    for c in 0..if D == 3 { 3 } else { 1 } {
        V::keep_wide();
        for b in 0..3 {
            let product = if D == 3 { product(b, c) } else { y(b) };
            let mut across = zero;
            for a in 0..3 {
                let row = F64x4::new(nodes[a + ARENA_EDGE * (b + ARENA_EDGE * c)].0);
                pencil[0][a] = product.mul_add(row, pencil[0][a]);
                across = x[a].mul_add(row, across);
            }
            if D == 3 {
                pencil[1][b] = z(c).mul_add(across, pencil[1][b]);
                pencil[D - 1][c] = y(b).mul_add(across, pencil[D - 1][c]);
            } else {
                pencil[1][b] = across;
            }
        }
    }
    pencil
}

/// The sum of a pencil with the factors of its axis.
#[inline(always)]
pub(super) fn dot(factors: &[F64x4; 3], pencil: &[F64x4; 3]) -> F64x4 {
    factors[2].mul_add(pencil[2], factors[1].mul_add(pencil[1], factors[0] * pencil[0]))
}

impl NodeWeights {
    pub(super) fn new() -> Self {
        Self([[0.0; LANES]; 32])
    }

    /// Multiplies out the weights of all nodes.
    #[inline(never)]
    pub(super) fn fill<const D: usize>(&mut self, weights: &Weights<D>) {
        let Weights { product, axis, .. } = weights;
        for c in 0..if D == 3 { 3 } else { 1 } {
            for b in 0..3 {
                let across = Lanes::load(if D == 3 { &product[b][c] } else { &axis[1].weight[b] });
                for a in 0..3 {
                    let along = Lanes::load(&axis[0].weight[a]);
                    (along * across).store(&mut self.0[a + 3 * (b + 3 * c)]);
                }
            }
        }
    }
}
