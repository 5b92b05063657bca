//! The refinement criteria, one file each, and the list of them.
//!
//! A file holds the parameters of a criterion as they stand in a job file, with ranges and units, its
//! indicator, and its description. A line of the list below makes it a choice of the job file, with schema,
//! checks and reference. `keys.rs` has what all of them ask of the job.
//!
//! | file | requests fine leaves |
//! |---|---|
//! | `region.rs` | near a shape that may move |
//! | `collider.rs` | near a collider |
//! | `free_surface.rs` | at free surfaces |
//! | `head_gradient.rs` | where water seeps fast |
//! | `velocity_gradient.rs` | where the velocity varies |
//! | `plastic_strain.rs` | where a particle has plastic strain |
//! | `plastic_strain_rate.rs` | where the material flows plastically |
//! | `stretch.rs` | where a particle's box is stretched |
//! | `material.rs` | where there is a material |
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Criterion;

pub mod collider;
pub mod free_surface;
pub mod head_gradient;
mod keys;
pub mod material;
pub mod plastic_strain;
pub mod plastic_strain_rate;
pub mod region;
pub mod stretch;
pub mod velocity_gradient;

pub use keys::Way;
pub(crate) use keys::{Job, Keys};

/// Makes the choice of criteria from a list of them.
macro_rules! criteria {
    ($($(#[$description:meta])* $name:ident($parameters:ty),)*) => {
        /// A reason for fine leaves where there are particles.
        #[derive(Clone, Debug, Serialize, Deserialize, JsonSchema)]
        #[serde(tag = "kind", rename_all = "snake_case")]
        #[schemars(rename = "Criterion")]
        pub enum Parameters {
            $($(#[$description])* $name($parameters),)*
        }

        impl Keys for Parameters {
            fn criterion<const D: usize>(&self, job: &mut dyn Job<D>) -> Option<Criterion<D>> {
                match self {
                    $(Self::$name(parameters) => parameters.criterion(job),)*
                }
            }
        }
    };
}

criteria! {
    /// In and near a shape, which may move.
    Region(region::Parameters),
    /// Near a collider.
    Collider(collider::Parameters),
    /// At free surfaces: where nodes of a leaf, or next to it, have next to no mass.
    FreeSurface(free_surface::Parameters),
    /// Where the velocity varies: the root mean square of the norm of its gradient over the leaf.
    VelocityGradient(velocity_gradient::Parameters),
    /// Where a particle has plastic strain.
    PlasticStrain(plastic_strain::Parameters),
    /// Where the material flows plastically: the mean rate of plastic strain over the leaf's particles.
    PlasticStrainRate(plastic_strain_rate::Parameters),
    /// Where water seeps fast: the greatest gradient of the head about a particle. In jobs with seepage, from
    /// the first change of the tree on.
    HeadGradient(head_gradient::Parameters),
    /// Where a particle's box is stretched.
    Stretch(stretch::Parameters),
    /// Where there is a material.
    Material(material::Parameters),
}
