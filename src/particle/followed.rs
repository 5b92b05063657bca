//! Quantities that particles carry of their past.
use super::strain;

/// Quantities that particles carry of their past, in columns behind those of loads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// Mean pressure of contact with other bodies.
    pub contact_pressure: bool,
    /// Motion since the particles came.
    pub motion: Motion,
}

/// Quantities that particles carry of their motion since they came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Motion {
    /// Nothing.
    #[default]
    Nothing,
    /// The displacement.
    Displacement,
    /// Total strain and displacement.
    Strain,
}

impl Followed {
    /// Columns of the pressure of contact, of the total strain (see [`strain`]), and of the displacement, in
    /// their order.
    pub fn columns<const D: usize>(self) -> [usize; 3] {
        let [strain, displacement] = match self.motion {
            Motion::Nothing => [0, 0],
            Motion::Displacement => [0, D],
            Motion::Strain => [strain::columns(D), D],
        };
        [usize::from(self.contact_pressure), strain, displacement]
    }

    /// First columns of the same among `carried` columns, of which they are the last; `None` for those that
    /// particles do not carry.
    pub fn first_columns<const D: usize>(self, carried: usize) -> [Option<usize>; 3] {
        let columns = self.columns::<D>();
        let behind = |which: usize| columns[which..].iter().sum::<usize>();
        std::array::from_fn(|which| carried.checked_sub(behind(which)).filter(|_| columns[which] > 0))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_last_that_particles_carry() {
        let all = Followed { contact_pressure: true, motion: Motion::Strain };
        let [pressure, strain, displacement] = all.columns::<3>();
        assert_eq!((pressure, displacement), (1, 3));
        let first = all.first_columns::<3>(20);
        assert_eq!(first, [Some(20 - 4 - strain), Some(20 - 3 - strain), Some(17)]);
        assert_eq!(all.first_columns::<3>(0), [None; 3]);
        let pressure = Followed { contact_pressure: true, motion: Motion::Nothing };
        assert_eq!(pressure.first_columns::<2>(3), [Some(2), None, None]);
    }
}
