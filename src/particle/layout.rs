//! Columns of a particle: real values and a tag.
use crate::material;

/// Particles of a tile.
pub const TILE: usize = 8;

/// Column numbers of the real-valued components of a particle in `D` dimensions.
///
/// In plane strain (`D == 2`) symmetric tensors keep their out-of-plane `zz` component, so they
/// have 4 components (`xx, yy, zz, xy`); in 3D they have 6 (`xx, yy, zz, xy, xz, yz`).
#[derive(Clone, Copy, Debug)]
pub struct Layout<const D: usize>;

impl<const D: usize> Layout<D> {
    /// Independent components of a symmetric tensor (4 in plane strain, 6 in 3D).
    pub const SYMMETRIC: usize = if D == 2 { 4 } else { 6 };
    /// Position relative to the domain's lower corner, m. `D` columns.
    pub const POSITION: usize = 0;
    /// Velocity, m/s. `D` columns.
    pub const VELOCITY: usize = D;
    /// Affine state, row-major: with APIC `B = Σ w v_j ⊗ (x_j - x_p)` (m²/s), which carries the particle's
    /// angular momentum; else the velocity gradient (1/s).
    pub const AFFINE: usize = 2 * D;
    /// Elastic left Cauchy-Green tensor b = F_e F_eᵀ. `SYMMETRIC` columns.
    pub const LEFT_CAUCHY_GREEN: usize = 2 * D + D * D;
    /// Kirchhoff stress τ, Pa. `SYMMETRIC` columns.
    pub const STRESS: usize = Self::LEFT_CAUCHY_GREEN + Self::SYMMETRIC;
    /// Mass, kg (per metre of thickness in plane strain; of the whole ring in axisymmetry).
    pub const MASS: usize = Self::STRESS + Self::SYMMETRIC;
    /// Half width of the undeformed box, m; the reference volume is `(2 half)^D`. In axisymmetry the half
    /// width of a square with as many m² as the undeformed ring has m³ (see
    /// [`crate::kernel::Coordinates::half_width`]).
    pub const HALF: usize = Self::MASS + 1;
    /// First history variable (see [`material::Material::history_names`]).
    pub const HISTORY: usize = Self::HALF + 1;
    /// Number of history variables.
    pub const HISTORIES: usize = material::HISTORIES;
    /// Measure of plastic strain of the material; 0 for materials that do not flow.
    pub const PLASTIC_STRAIN: usize = Self::HISTORY + material::PLASTIC_STRAIN;
    /// Logarithm of the plastic volume ratio; 0 for materials without.
    pub const PLASTIC_VOLUME: usize = Self::HISTORY + material::PLASTIC_VOLUME;
    /// Plastic work dissipated so far per reference volume, J/m³.
    pub const WORK: usize = Self::HISTORY + Self::HISTORIES;
    /// Number of real-valued columns (33 in 3D, 22 in 2D).
    pub const REALS: usize = Self::WORK + 1;
}

/// Identity of a particle beside its real-valued state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tag {
    /// Index of the material in the job.
    pub material: u16,
    /// Index of the body in the job.
    pub body: u16,
    /// Tree level the particle was made for.
    pub level: u8,
}

impl Tag {
    /// Packs the tag into the 64-bit column.
    pub fn pack(self) -> u64 {
        u64::from(self.material) | u64::from(self.body) << 16 | u64::from(self.level) << 32
    }

    /// Reads the tag back from the 64-bit column.
    pub fn unpack(bits: u64) -> Self {
        Self { material: bits as u16, body: (bits >> 16) as u16, level: (bits >> 32) as u8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_fit_the_memory_budget() {
        assert_eq!(Layout::<3>::REALS, 33);
        assert_eq!(Layout::<2>::REALS, 22);
        const { assert!(8 * (Layout::<3>::REALS + 2) <= 280) };
    }

    #[test]
    fn tag_round_trip() {
        let tag = Tag { material: 513, body: 7, level: 9 };
        assert_eq!(Tag::unpack(tag.pack()), tag);
    }
}
