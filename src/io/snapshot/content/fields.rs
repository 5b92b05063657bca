//! The particle fields of output files and how they follow from the state.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::averages::{self, mean, principal, von_mises};
use crate::grid::leaf_geometry::{LeafCells, leaf_box};
use crate::io::snapshot::view::{ShownWater, View};
use crate::particle::chunk::{Chunk, Layout, Tag};
use crate::particle::followed::{FirstColumns, head};
use crate::particle::volume::{cauchy_stress, volume, volume_ratio};
use crate::particle::{pores, strain};

/// Names of the components of vectors and tensors, by their number, in the order of the files.
pub const COMPONENTS: [&[&str]; 2] = [&["x", "y", "z"], &["xx", "yy", "zz", "xy", "yz", "xz"]];

/// Makes [`PointField`] of the table of fields: what it is, variant, name in job and output files, unit
/// (empty for pure numbers), values of all particles of a view in order.
macro_rules! fields {
    ($($(#[doc = $meaning:literal])+ $field:ident, $name:literal, $unit:literal, $values:expr;)*) => {
        /// A field of the particles that an output file can show.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, JsonSchema)]
        pub enum PointField {
            $($(#[doc = $meaning])+ #[serde(rename = $name)] $field,)*
        }

        impl PointField {
            /// All fields.
            pub const ALL: [Self; [$($name),*].len()] = [$(Self::$field),*];

            /// Name in job and output files.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$field => $name,)* }
            }

            /// Unit, empty for pure numbers.
            pub const fn unit(self) -> &'static str {
                match self { $(Self::$field => $unit,)* }
            }

            /// Description, a sentence.
            pub const fn meaning(self) -> &'static str {
                match self { $(Self::$field => concat!($($meaning),+).trim_ascii(),)* }
            }

            /// Values of all particles of the view, in order.
            pub fn values<const D: usize>(self, view: &View<'_, D>) -> Values {
                let values: fn(&View<'_, D>) -> Values = match self { $(Self::$field => $values,)* };
                values(view)
            }
        }
    };
}

fields! {
    /// Velocity, m/s.
    Velocity, "velocity", "m/s", |view| each(view, 3, |chunk, p, out| out.extend(velocity(chunk, p)));
    /// Displacement since the particle came, m; followed only where a job asks for this field.
    Displacement, "displacement", "m", |view| each(view, 3, |chunk, p, out| out.extend(displacement(view, chunk, p)));
    /// Total logarithmic strain, elastic and plastic, since the particle came; components as those of
    /// `stress`; followed only where a job asks for it.
    Strain, "strain", "", |view| each(view, 6, |chunk, p, out| out.extend(total_strain(view, chunk, p)));
    /// Equivalent total strain, √(2/3 e : e) of its deviator e; followed only where a job asks for it.
    EquivalentStrain, "equivalent_strain", "", |view| scalars(view, |chunk, p| equivalent(&total_strain(view, chunk, p)));
    /// Magnitude of the velocity, m/s.
    Speed, "speed", "m/s", |view| scalars(view, speed);
    /// Identifier of the particle.
    Id, "id", "", |view| Values::Id(view.chunks.iter().flat_map(|chunk| chunk.ids()).copied().collect());
    /// Number of the material.
    Material, "material", "", |view| of_tags(view, |tag| tag.material);
    /// Number of the body.
    Body, "body", "", |view| of_tags(view, |tag| tag.body);
    /// Tree level that the particle was made for.
    ParticleLevel, "particle_level", "", |view| of_tags(view, |tag| u16::from(tag.level));
    /// Level of the leaf that holds the particle.
    LeafLevel, "leaf_level", "", |view| {
        let leaves = view.leaves.iter().zip(view.chunks);
        let levels = leaves.flat_map(|(leaf, chunk)| vec![i32::from(leaf.level); chunk.len()]);
        Values::Integer(levels.collect())
    };
    /// First history variable of the material, as a rule the accumulated plastic strain.
    PlasticStrain, "plastic_strain", "", |view| scalars(view, plastic_strain);
    /// Damage, 0 for materials without: of elastic ones the part of the stiffness that cracks have taken, 1
    /// where it is broken; of metals plastic strain over failure strain, which fail from 1 on.
    Damage, "damage", "", |view| damages(view);
    /// Mean of the Cauchy stress with the sign changed, Pa; compression is positive.
    Pressure, "pressure", "Pa", |view| scalars(view, |chunk, p| -mean(&cauchy_stress(chunk, p)));
    /// Von Mises equivalent of the Cauchy stress, Pa.
    VonMises, "von_mises", "Pa", |view| scalars(view, |chunk, p| von_mises(&cauchy_stress(chunk, p)));
    /// Cauchy stress, Pa; components xx, yy, zz, xy, yz, xz as VTK orders them.
    Stress, "stress", "Pa", |view| each(view, 6, |chunk, p, out| out.extend(cauchy_stress(chunk, p)));
    /// Greatest principal Cauchy stress, Pa; tension is positive.
    Stress1, "stress_1", "Pa", |view| scalars(view, |chunk, p| principal(&cauchy_stress(chunk, p))[0]);
    /// Middle principal Cauchy stress, Pa; tension is positive.
    Stress2, "stress_2", "Pa", |view| scalars(view, |chunk, p| principal(&cauchy_stress(chunk, p))[1]);
    /// Least principal Cauchy stress, Pa; tension is positive.
    Stress3, "stress_3", "Pa", |view| scalars(view, |chunk, p| principal(&cauchy_stress(chunk, p))[2]);
    /// Cauchy stress, Pa, averaged by volume over the particles of the same cell; components as those of
    /// `stress`.
    StressCell, "stress_cell", "Pa", |view| Values::Real(cell_stresses(view).concat(), 6);
    /// Pressure of the Cauchy stress averaged over the cell, Pa; compression is positive.
    PressureCell, "pressure_cell", "Pa",
        |view| Values::Real(cell_stresses(view).iter().map(|stress| -mean(stress)).collect(), 0);
    /// Von Mises equivalent of the Cauchy stress averaged over the cell, Pa.
    VonMisesCell, "von_mises_cell", "Pa",
        |view| Values::Real(cell_stresses(view).iter().map(von_mises).collect(), 0);
    /// Mass, kg (per metre of thickness in plane strain).
    Mass, "mass", "kg", |view| scalars(view, |chunk, p| chunk.column(Layout::<D>::MASS)[p]);
    /// Density, kg/m³.
    Density, "density", "kg/m³", |view| scalars(view, density);
    /// Pressure of contact with other bodies, Pa, at particles within reach of the surface: a mean over the
    /// last steps, in which a step counts a twentieth less than the next; found only where a job asks for it.
    ContactPressure, "contact_pressure", "Pa", |view| scalars(view, |chunk, p| contact_pressure(view, chunk, p));
    /// Pressure of the water in the pores, Pa: that of `[water]` and the excess; compression is positive.
    /// The field `stress` has the excess, and not the pressure of `[water]`.
    PorePressure, "pore_pressure", "Pa", |view| scalars(view, |chunk, p| pore_pressure(view, chunk, p));
    /// Excess pore pressure of undrained material, Pa; compression is positive, 0 elsewhere.
    ExcessPorePressure, "excess_pore_pressure", "Pa", |view| scalars(view, |chunk, p| excess_pore_pressure(view, chunk, p));
    /// Mean of the effective stress with the sign changed, Pa: the pressure less the excess pore pressure.
    EffectivePressure, "effective_pressure", "Pa",
        |view| scalars(view, |chunk, p| -mean(&effective_stress(view, chunk, p)));
    /// Effective Cauchy stress, Pa: the stress without the excess pore pressure; components as those of
    /// `stress`.
    EffectiveStress, "effective_stress", "Pa", |view| each(view, 6, |chunk, p, out| out.extend(effective_stress(view, chunk, p)));
    /// Mean of the total stress with the sign changed, Pa: the pressure and that of the water in the pores.
    TotalPressure, "total_pressure", "Pa", |view| scalars(view, |chunk, p| -mean(&total_stress(view, chunk, p)));
    /// Total Cauchy stress, Pa: that of skeleton and water; components as those of `stress`.
    TotalStress, "total_stress", "Pa", |view| each(view, 6, |chunk, p, out| out.extend(total_stress(view, chunk, p)));
    /// Head of the water in the pores, m along the vertical, where `[water]` has `seepage`; 0 elsewhere.
    Head, "head", "m", |view| scalars(view, |chunk, p| {
        head(chunk, followed(view, chunk).head, p, &view.origin).map_or(0.0, |head| head.value)
    });
    /// Volume over reference volume, det F.
    VolumeRatio, "volume_ratio", "", |view| scalars(view, volume_ratio);
}

impl PointField {
    /// The fields of a run that names none.
    pub const USUAL: [Self; 8] = [
        Self::Velocity,
        Self::Id,
        Self::Material,
        Self::LeafLevel,
        Self::PlasticStrain,
        Self::Pressure,
        Self::VonMises,
        Self::Density,
    ];

    /// The field of that name.
    pub fn from_name(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|field| field.name() == name)
    }
}

/// Values of a field in the order of the particles.
pub enum Values {
    /// Identifiers.
    Id(Vec<u64>),
    /// Small integers.
    Integer(Vec<i32>),
    /// Real numbers with their number of components (0 for scalars).
    Real(Vec<f64>, usize),
    /// The same in single precision.
    Single(Vec<f32>, usize),
}

impl Values {
    /// Real numbers in single precision; integers stay as they are.
    pub fn into_single(self) -> Self {
        match self {
            Self::Real(values, components) => {
                Self::Single(values.into_iter().map(|v| v as f32).collect(), components)
            }
            other => other,
        }
    }

    /// Infinite values as NaN. A value that follows from a finite state may overflow; programs leave NaN out
    /// of ranges of colours, and it is no reason to end a run.
    pub fn without_infinities(mut self) -> Self {
        match &mut self {
            Self::Real(values, _) => {
                values.iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = f64::NAN);
            }
            Self::Single(values, _) => {
                values.iter_mut().filter(|v| v.is_infinite()).for_each(|v| *v = f32::NAN);
            }
            Self::Id(_) | Self::Integer(_) => {}
        }
        self
    }
}

/// Applies `append` to each particle.
fn each<const D: usize>(
    view: &View<D>,
    components: usize,
    mut append: impl FnMut(&Chunk<D>, usize, &mut Vec<f64>),
) -> Values {
    let particles: usize = view.chunks.iter().map(Chunk::len).sum();
    let mut out = Vec::with_capacity(particles * components.max(1));
    for chunk in view.chunks {
        (0..chunk.len()).for_each(|p| append(chunk, p, &mut out));
    }
    Values::Real(out, components)
}

/// One number for each particle.
fn scalars<const D: usize>(view: &View<D>, value: impl Fn(&Chunk<D>, usize) -> f64) -> Values {
    each(view, 0, |chunk, p, out| out.push(value(chunk, p)))
}

/// A number of each particle's tag.
fn of_tags<const D: usize>(view: &View<D>, get: fn(Tag) -> u16) -> Values {
    let tags = view.chunks.iter().flat_map(|chunk| chunk.tags());
    Values::Integer(tags.map(|&bits| i32::from(get(Tag::unpack(bits)))).collect())
}

/// Stress of the cell of each particle, in their order.
fn cell_stresses<const D: usize>(view: &View<D>) -> Vec<[f64; 6]> {
    let leaves = view.leaves.iter().zip(view.chunks);
    let of_leaf = leaves.flat_map(|(leaf, chunk)| {
        averages::over_cells(&LeafCells::new(&leaf_box(leaf, view.root_edge)), chunk)
    });
    of_leaf.collect()
}

/// Velocity with three components.
fn velocity<const D: usize>(chunk: &Chunk<D>, p: usize) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < D { chunk.column(Layout::<D>::VELOCITY + axis)[p] } else { 0.0 })
}

/// First columns of what is followed, as far as the leaf has them.
fn followed<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>) -> FirstColumns {
    view.followed.first_columns::<D>(chunk.carried_columns())
}

/// Carried value of a particle in a column; 0 where there is none.
fn carried<const D: usize>(chunk: &Chunk<D>, column: Option<usize>, p: usize) -> f64 {
    column.and_then(|column| chunk.carried(column).get(p).copied()).unwrap_or(0.0)
}

/// Mean pressure of contact with other bodies, Pa.
fn contact_pressure<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> f64 {
    carried(chunk, followed(view, chunk).contact_pressure, p)
}

/// Pressure of water that cannot leave the pores, since consolidation, Pa.
fn excess_pore_pressure<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> f64 {
    pores::excess_pressure(view.water_moduli, chunk, p)
}

/// Pressure of the water in the pores, Pa.
fn pore_pressure<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> f64 {
    given_pressure(view, chunk, p) + excess_pore_pressure(view, chunk, p)
}

/// Pressure of the water of `[water]`, Pa.
fn given_pressure<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> f64 {
    let Some(ShownWater { water, since, gravity }) = &view.water else { return 0.0 };
    let carried = (followed(view, chunk).head, &view.origin);
    pores::given_pressure(water, view.time - since, gravity, carried, chunk, p)
}

/// Total Cauchy stress, Pa: the effective one less the pressure of the water in the pores.
fn total_stress<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> [f64; 6] {
    let mut stress = cauchy_stress(chunk, p);
    let pressure = given_pressure(view, chunk, p);
    stress[..3].iter_mut().for_each(|normal| *normal -= pressure);
    stress
}

/// Effective Cauchy stress, Pa.
fn effective_stress<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> [f64; 6] {
    let mut stress = cauchy_stress(chunk, p);
    let pressure = excess_pore_pressure(view, chunk, p);
    stress[..3].iter_mut().for_each(|normal| *normal += pressure);
    stress
}

/// Displacement with three components.
fn displacement<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> [f64; 3] {
    let first = followed(view, chunk).displacement;
    let component = |axis: usize| carried(chunk, first.map(|first| first + axis), p);
    std::array::from_fn(|axis| if axis < D { component(axis) } else { 0.0 })
}

/// Total logarithmic strain.
fn total_strain<const D: usize>(view: &View<'_, D>, chunk: &Chunk<D>, p: usize) -> [f64; 6] {
    followed(view, chunk)
        .strain
        .map_or([0.0; 6], |first| strain::logarithmic(D, &strain::read(chunk, first, p)))
}

/// Magnitude of the velocity, m/s.
pub fn speed<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    velocity(chunk, p).iter().map(|v| v * v).sum::<f64>().sqrt()
}

/// First history variable.
pub fn plastic_strain<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    chunk.column(Layout::<D>::PLASTIC_STRAIN)[p]
}

/// The history variable of that name of each particle.
fn damages<const D: usize>(view: &View<'_, D>) -> Values {
    let slot = |names: &String| names.split(' ').position(|name| name == "damage");
    let slots: Vec<Option<usize>> = view.histories.iter().map(slot).collect();
    scalars(view, |chunk, p| {
        let material = usize::from(Tag::unpack(chunk.tags()[p]).material);
        let slot = slots.get(material).copied().flatten();
        slot.map_or(0.0, |slot| chunk.column(Layout::<D>::HISTORY + slot)[p])
    })
}

/// Mass over current volume, kg/m³.
fn density<const D: usize>(chunk: &Chunk<D>, p: usize) -> f64 {
    chunk.column(Layout::<D>::MASS)[p] / volume(chunk, p)
}

/// Equivalent strain √(2/3 e:e) with the deviator e.
fn equivalent(strain: &[f64; 6]) -> f64 {
    2.0 / 3.0 * von_mises(strain)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_job_files() {
        for field in PointField::ALL {
            assert_eq!(serde_json::to_string(&field).unwrap(), format!("\"{}\"", field.name()));
            assert_eq!(PointField::from_name(field.name()), Some(field));
        }
    }

    /// Pure shear of a plane that is drawn to e^0.7 of its length.
    #[test]
    fn strain_measures() {
        let found = equivalent(&[0.7, -0.7, 0.0, 0.0, 0.0, 0.0]);
        assert!((found - 0.7 * 2.0 / 3.0_f64.sqrt()).abs() < 1e-15, "{found}");
    }

    #[test]
    fn stress_measures() {
        let mut chunk = Chunk::<3>::new();
        let p = chunk.push_zeroed(1, Tag { material: 0, body: 0, level: 0 });
        let b = Layout::<3>::LEFT_CAUCHY_GREEN;
        // F = diag(1, 2, 1): det F = 2.
        for (component, value) in [1.0, 4.0, 1.0].into_iter().enumerate() {
            chunk.column_mut(b + component)[p] = value;
        }
        // Pure shear of 6 Pa in xz on top of a pressure of 2 Pa, as Kirchhoff stress.
        for (component, value) in [-4.0, -4.0, -4.0, 0.0, 12.0, 0.0].into_iter().enumerate() {
            chunk.column_mut(Layout::<3>::STRESS + component)[p] = value;
        }
        let stress = cauchy_stress(&chunk, p);
        assert_eq!(stress, [-2.0, -2.0, -2.0, 0.0, 0.0, 6.0]);
        assert_eq!(-mean(&stress), 2.0);
        approx::assert_relative_eq!(von_mises(&stress), 6.0 * 3.0_f64.sqrt());
    }
}
