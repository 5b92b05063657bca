//! Particles as integration points of a load step: deformation since its start, stress, and tangent.
//!
//! Weights are those of the start of the step, with gradients `∇w` there. With displacements u of the nodes
//! since, a particle has `ΔF = 1 + Σ u ⊗ ∇w`, with F-bar the mean dilation of its cell, and the law gives τ
//! from `ΔF b ΔFᵀ` and the history at the start. The forces on nodes are `-Σ V₀ P ∇w` with `P = τ ΔF⁻ᵀ`. A
//! change `δF = Σ δu ⊗ ∇w` changes P by
//! ```text
//! δP = (δτ - τ lᵀ) ΔF⁻ᵀ,   l = δF ΔF⁻¹
//! ```
//! with δτ by the tangent of the law. F-bar is a projection of ΔF; the same projection of P is its adjoint,
//! so the stiffness of an elastic body is symmetric with it as well.
//!
//! While the strength is reduced, forces balance on the shape of the start: `P = τ`, and ΔF is `1 + ε` with
//! the symmetric part ε of the gradients.
use rayon::prelude::*;

use crate::grid::leaf_geometry::{LeafCells, leaf_box};
use crate::grid::sums::node_fields::VelocityArena;
use crate::kernel::{Coordinates, Scheme, g2p};
use crate::material::{self, State, Step, Symmetric, Tangent};
use crate::particle::Chunk;
use crate::particle::chunk::{Layout, TILE, Tag};
use crate::simd::{LANES, Lanes, Vector, VectorMask};
use crate::solver::state::Solver;
use crate::solver::state::grid::velocity_field::VelocityField;
use crate::solver::state::phases::Phase;
use crate::solver::step::transfer::interpolate::Look;
use crate::solver::step::transfer::mean_dilation::MeanDilation;

/// A matrix of each particle of a batch.
pub(super) type Matrix = [[Lanes; 3]; 3];

/// Eight particles that follow each other in a leaf.
#[derive(Clone)]
pub(super) struct Points {
    /// Kirchhoff stress, Pa.
    stress: Symmetric,
    /// Inverse of ΔF.
    inverse: Matrix,
    /// Derivative of the stress.
    tangent: Tangent,
    /// Whether forces balance on the shape of the start.
    keeps_shape: bool,
}

impl Points {
    /// First Piola-Kirchhoff stress on the body at the start of the step, per undeformed volume, Pa.
    fn force(&self) -> Matrix {
        if self.keeps_shape {
            return full(&self.stress);
        }
        times_transposed(&full(&self.stress), &self.inverse)
    }

    /// Its change by a small further displacement with this gradient over the body at the start of the step.
    pub(super) fn change(&self, gradient: &Matrix) -> Matrix {
        if self.keeps_shape {
            return full(&self.tangent.change(&self.stress, &symmetric(gradient)));
        }
        let further = product(gradient, &self.inverse);
        let mut change = full(&self.tangent.change(&self.stress, &further));
        let turned = times_transposed(&full(&self.stress), &further);
        for (row, turned) in change.iter_mut().zip(turned) {
            row.iter_mut().zip(turned).for_each(|(own, turned)| *own = *own - turned);
        }
        times_transposed(&change, &self.inverse)
    }
}

fn full(tensor: &Symmetric) -> Matrix {
    let [xx, yy, zz, xy, xz, yz] = *tensor;
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

/// The symmetric part.
fn symmetric(a: &Matrix) -> Matrix {
    std::array::from_fn(|i| std::array::from_fn(|k| (a[i][k] + a[k][i]) * 0.5))
}

fn product(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|k| (a[i][0] * b[0][k]) + (a[i][1] * b[1][k]) + (a[i][2] * b[2][k]))
    })
}

/// `A Bᵀ`.
fn times_transposed(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|i| {
        std::array::from_fn(|k| (a[i][0] * b[k][0]) + (a[i][1] * b[k][1]) + (a[i][2] * b[k][2]))
    })
}

/// Inverse and determinant.
fn inverse(a: &Matrix) -> (Matrix, Lanes) {
    let minor = |i: usize, k: usize| {
        let [r, s] = [(i + 1) % 3, (i + 2) % 3];
        let [c, d] = [(k + 1) % 3, (k + 2) % 3];
        (a[r][c] * a[s][d]) - (a[r][d] * a[s][c])
    };
    let determinant = a[0][0] * minor(0, 0) + a[0][1] * minor(0, 1) + a[0][2] * minor(0, 2);
    let over = Lanes::splat(1.0) / determinant;
    (std::array::from_fn(|i| std::array::from_fn(|k| minor(k, i) * over)), determinant)
}

/// Gradients of particles that follow each other, and rates along the hoop, from `first` on.
fn batch_of<const D: usize>(gradients: &[([[f64; D]; D], f64)], first: usize) -> Matrix {
    let one = |i: usize, k: usize| {
        Lanes::new(std::array::from_fn(|lane| match gradients.get(first + lane) {
            Some((_, hoop)) if i == 2 && k == 2 && D == 2 => *hoop,
            Some((gradient, _)) if i < D && k < D => gradient[i][k],
            _ => 0.0,
        }))
    };
    std::array::from_fn(|i| std::array::from_fn(|k| one(i, k)))
}

/// Use that the particles make of the gradients of the nodes' displacements.
#[derive(Clone, Copy)]
pub(super) enum Sweep {
    /// They take on the deformation of the displacements since the start of the step.
    Deform {
        /// Length of the step, s.
        dt: f64,
    },
    /// They show the change of their stress.
    Change,
}

/// Memory of a thread.
struct Scratch<const D: usize> {
    kernel: g2p::Scratch<D>,
    arena: VelocityArena<D>,
    gathered: Vec<g2p::Gathered<D>>,
    gradients: Vec<([[f64; D]; D], f64)>,
    mean: MeanDilation,
}

impl<const D: usize> Default for Scratch<D> {
    fn default() -> Self {
        Self {
            kernel: g2p::Scratch::default(),
            arena: VelocityArena::default(),
            gathered: Vec::new(),
            gradients: Vec::new(),
            mean: MeanDilation::default(),
        }
    }
}

impl<const D: usize> Solver<D> {
    /// Not collective. From the displacements of the nodes, which are prolonged, to the stress in the affine
    /// columns of the particles, for [`Scheme::forces`]; in a sweep that deforms them the masses become their
    /// stiffness, Pa m³. Returns whether all states are sound.
    pub(super) fn stress_of_displacements(&mut self, points: &mut [Vec<Points>], sweep: Sweep) -> bool {
        let (physics, plan) = (&self.physics, &self.grid.plan);
        let (scheme, VelocityField { nodes, arenas, lists, .. }) = (physics.scheme(), &self.grid.fields[0]);
        let look = Look { plan, fields: nodes, arenas, scheme: &scheme };
        let leaves = self.chunks.par_iter_mut().zip(points).zip(self.forest.leaves()).enumerate();
        self.phases.time(Phase::Gather, || {
            let sound = leaves.map_init(Scratch::default, |scratch: &mut Scratch<D>, (leaf, all)| {
                let ((chunk, points), octant) = all;
                if chunk.is_empty() {
                    return true;
                }
                let Scratch { kernel, arena, gathered, gradients, mean } = scratch;
                gradients.clear();
                gradients.resize(chunk.len(), ([[0.0; D]; D], 0.0));
                look.at_leaf((kernel, arena, gathered), lists.of_leaf(leaf), leaf, chunk, |p, gathered| {
                    gradients[p] = (gathered.gradient(), gathered.hoop());
                });
                let cells = LeafCells::new(&leaf_box(octant, plan.root_edge));
                if scheme.f_bar {
                    mean.begin(chunk, &cells, physics.coordinates);
                    project(mean, chunk, gradients, physics.coordinates);
                }
                let mut is_sound = true;
                if let Sweep::Deform { dt } = sweep {
                    let step = Step { dt, cell: plan.finest_cell(leaf), ..Step::rest(D == 2) };
                    let keeps_shape = physics.reduction.is_some();
                    is_sound = deform(chunk, &scheme, (&step, keeps_shape), gradients, points);
                }
                for (number, points) in points.iter().enumerate() {
                    let first = number * LANES;
                    let stress = match sweep {
                        Sweep::Deform { .. } => points.force(),
                        Sweep::Change => points.change(&batch_of(gradients, first)),
                    };
                    let stress = stress.map(|row| row.map(Lanes::to_array));
                    for (lane, gradient) in gradients[first..].iter_mut().take(LANES).enumerate() {
                        let component = |i: usize, k: usize| stress[i][k][lane];
                        *gradient = (
                            std::array::from_fn(|i| std::array::from_fn(|k| component(i, k))),
                            component(2, 2),
                        );
                    }
                }
                if scheme.f_bar {
                    project(mean, chunk, gradients, physics.coordinates);
                }
                for (p, (stress, hoop)) in gradients.iter().enumerate() {
                    chunk.write(Layout::<D>::AFFINE, p, stress.as_flattened());
                    if physics.coordinates == Coordinates::Axisymmetric {
                        chunk.write(Layout::<D>::STRESS + 2, p, &[*hoop]);
                    }
                }
                is_sound
            });
            sound.reduce(|| true, |a, b| a && b)
        })
    }
}

/// Gives all particles of a material in a cell their mean trace.
fn project<const D: usize>(
    mean: &mut MeanDilation,
    chunk: &Chunk<D>,
    gradients: &mut [([[f64; D]; D], f64)],
    coordinates: Coordinates,
) {
    let is_ring = coordinates == Coordinates::Axisymmetric;
    for (p, (gradient, hoop)) in gradients.iter().enumerate() {
        mean.note(p, gradient, if is_ring { *hoop } else { 0.0 });
    }
    mean.average(chunk);
    for ((gradient, hoop), added) in gradients.iter_mut().zip(&mean.added) {
        (0..D).for_each(|i| gradient[i][i] += added);
        *hoop += if is_ring { *added } else { 0.0 };
    }
}

/// The states of the particles of a leaf with these gradients of displacements. Returns whether all are
/// sound.
fn deform<const D: usize>(
    chunk: &mut Chunk<D>,
    scheme: &Scheme<'_>,
    (step, keeps_shape): (&Step, bool),
    gradients: &[([[f64; D]; D], f64)],
    points: &mut Vec<Points>,
) -> bool {
    points.clear();
    let len = chunk.len();
    let mut is_sound = true;
    let mut stiffness = [0.0; TILE];
    for first in (0..len).step_by(LANES) {
        let last = (len - first).min(LANES) - 1;
        let tag = |lane: usize| Tag::unpack(chunk.tags()[first + lane.min(last)]);
        let index = std::array::from_fn(|lane| tag(lane).material);
        let size =
            std::array::from_fn(|lane| if scheme.softens { scheme.cell(tag(lane).level) } else { 0.0 });
        let step = Step { size, ..*step };
        // Lanes behind the last particle repeat it.
        let column = |column: usize| {
            let values = chunk.values(column, first);
            Lanes::new(std::array::from_fn(|lane| values[lane.min(last)]))
        };
        let mut deformation = batch_of(gradients, first);
        if keeps_shape {
            deformation = symmetric(&deformation);
        }
        (0..3).for_each(|i| deformation[i][i] += Lanes::splat(1.0));
        let (inverse, determinant) = inverse(&deformation);
        let mut elastic = [Lanes::splat(0.0); 6];
        for c in 0..Layout::<D>::SYMMETRIC {
            elastic[c] = column(Layout::<D>::LEFT_CAUCHY_GREEN + c);
        }
        let strained = times_transposed(&product(&deformation, &full(&elastic)), &deformation);
        let mut trial = State::new([
            strained[0][0],
            strained[1][1],
            strained[2][2],
            strained[0][1],
            strained[0][2],
            strained[1][2],
        ]);
        for h in 0..scheme.histories {
            trial.history[h] = column(Layout::<D>::HISTORY + h);
        }
        let mut state = trial;
        material::update(scheme.materials, &index, &mut state, &step);
        let tangent = material::tangent(scheme.materials, &index, &trial, &step).symmetric();
        let sum = state.stress.iter().fold(tangent.greatest(), |sum, stress| sum + *stress);
        let most = Lanes::splat(f64::MAX);
        is_sound &= (Lanes::splat(0.0).lt(determinant) & sum.abs().le(most)).all();
        points.push(Points { stress: state.stress, inverse, tangent, keeps_shape });
        tangent.greatest().store(&mut stiffness);
        for (lane, stiffness) in stiffness.iter().enumerate().take(last + 1) {
            let [half] = chunk.read(Layout::<D>::HALF, first + lane);
            let volume = (2.0 * half).powi(D as i32);
            chunk.write(Layout::<D>::MASS, first + lane, &[stiffness.max(0.0) * volume]);
        }
    }
    is_sound
}
