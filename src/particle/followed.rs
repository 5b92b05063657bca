//! Quantities that particles carry of their past, and of the water about them.
use super::chunk::Chunk;
use super::strain;
use crate::load::water::Head;
use crate::quantity::in_job;

/// Quantities that particles carry of their past, in columns behind those of loads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Followed {
    /// Mean pressure of contact with other bodies.
    pub contact_pressure: bool,
    /// Head of the water that seeps (see [`head`]).
    pub head: bool,
    /// Share of the pores that the water fills.
    pub saturation: bool,
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

/// First columns of what is followed; `None` where particles do not carry it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FirstColumns {
    /// Of [`Followed::contact_pressure`].
    pub contact_pressure: Option<usize>,
    /// Of [`Followed::head`].
    pub head: Option<usize>,
    /// Of [`Followed::saturation`].
    pub saturation: Option<usize>,
    /// Of the total strain (see [`strain`]).
    pub strain: Option<usize>,
    /// Of the displacement.
    pub displacement: Option<usize>,
}

impl Followed {
    /// Columns of all that is followed, in the order of [`FirstColumns`].
    fn columns<const D: usize>(self) -> [usize; 5] {
        let [strain, displacement] = match self.motion {
            Motion::Nothing => [0, 0],
            Motion::Displacement => [0, D],
            Motion::Strain => [strain::columns(D), D],
        };
        let head = if self.head { 1 + D } else { 0 };
        [usize::from(self.contact_pressure), head, usize::from(self.saturation), strain, displacement]
    }

    /// Number of columns.
    pub fn count<const D: usize>(self) -> usize {
        self.columns::<D>().iter().sum()
    }

    /// Columns that follow the motion of particles, the last ones.
    pub fn motion_columns<const D: usize>(self) -> usize {
        let [.., strain, displacement] = self.columns::<D>();
        strain + displacement
    }

    /// First columns among `carried` columns, of which they are the last.
    pub fn first_columns<const D: usize>(self, carried: usize) -> FirstColumns {
        let columns = self.columns::<D>();
        let behind = |which: usize| columns[which..].iter().sum::<usize>();
        let [contact_pressure, head, saturation, strain, displacement] =
            std::array::from_fn(|which| carried.checked_sub(behind(which)).filter(|_| columns[which] > 0));
        FirstColumns { contact_pressure, head, saturation, strain, displacement }
    }
}

/// The head about a particle of a chunk whose columns for it begin with `first`: value `c` at the lower
/// corner of the domain (at `origin` in the job, m), and gradient g, so that it is `c + g x` wherever the
/// particle goes, and halves of it have the same. `None` where the chunk does not carry it.
pub fn head<const D: usize>(
    chunk: &Chunk<D>,
    first: Option<usize>,
    p: usize,
    origin: &[f64; D],
) -> Option<Head> {
    let first = first?;
    let number = |i: usize| chunk.carried(first + i).get(p).copied();
    let at_corner = number(0)?;
    let mut gradient = [0.0; 3];
    for axis in 0..D {
        gradient[axis] = number(1 + axis)?;
    }
    let x = chunk.position(p);
    let value = (0..D).fold(at_corner, |value, a| gradient[a].mul_add(x[a], value));
    Some(Head { place: in_job(origin, &x), value, gradient })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_the_last_that_particles_carry() {
        let all = Followed { contact_pressure: true, head: true, saturation: true, motion: Motion::Strain };
        let [pressure, head, saturation, strain, displacement] = all.columns::<3>();
        assert_eq!((pressure, head, saturation, displacement), (1, 4, 1, 3));
        let [contact_pressure, head, saturation, first] =
            [9, 8, 4, 3].map(|columns| Some(20 - columns - strain));
        let expected =
            FirstColumns { contact_pressure, head, saturation, strain: first, displacement: Some(17) };
        assert_eq!(all.first_columns::<3>(20), expected);
        assert_eq!(all.first_columns::<3>(0), FirstColumns::default());
        let pressure = Followed { contact_pressure: true, ..Followed::default() };
        let expected = FirstColumns { contact_pressure: Some(2), ..FirstColumns::default() };
        assert_eq!(pressure.first_columns::<2>(3), expected);
    }

    /// The head is linear in the place, wherever the particle is.
    #[test]
    fn a_particle_knows_the_head_about_it() {
        let mut chunk = Chunk::<2>::new();
        let p = chunk.push_zeroed(1, crate::particle::chunk::Tag { material: 0, body: 0, level: 0 });
        assert_eq!(head(&chunk, Some(1), p, &[10.0, 20.0]), None);
        chunk.carry(4);
        [7.0, 0.5, -0.25].iter().enumerate().for_each(|(i, value)| chunk.carried_mut(1 + i)[p] = *value);
        chunk.write(crate::particle::Layout::<2>::POSITION, p, &[2.0, 4.0]);
        let found = head(&chunk, Some(1), p, &[10.0, 20.0]).expect("a head");
        assert_eq!((found.value, found.at([14.0, 24.0, 0.0])), (7.0, 8.0));
    }
}
