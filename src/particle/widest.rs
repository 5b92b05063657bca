//! The greatest undeformed half width in a chunk, kept while particles come and go.
use super::column::Column;

/// The greatest half width (0 without particles) and how many particles have it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Widest {
    /// m; not a number where it has to be found anew.
    half: f64,
    count: u32,
}

impl Widest {
    /// To be found anew.
    pub(super) const UNKNOWN: Self = Self { half: f64::NAN, count: 0 };

    /// Finds it among all half widths.
    pub(super) fn of(halves: Column) -> Self {
        let half = halves.greatest();
        Self { half, count: halves.iter().filter(|&&h| h == half).count() as u32 }
    }

    /// The half width, unless it has to be found anew.
    pub(super) fn known(self) -> Option<f64> {
        (!self.half.is_nan()).then_some(self.half)
    }

    /// Updates it for a particle that is added.
    pub(super) fn add(&mut self, half: f64) {
        if half > self.half {
            *self = Self { half, count: 1 };
        } else if half == self.half {
            self.count += 1;
        }
    }

    /// Updates it for a particle that is removed.
    pub(super) fn remove(&mut self, half: f64) {
        if half == self.half {
            self.count -= 1;
            if self.count == 0 {
                *self = Self::UNKNOWN;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::column::tests::lines;
    use super::*;
    use proptest::prelude::*;

    fn of(halves: &[f64]) -> Widest {
        Widest::of(Column::new(&lines(halves), 1, halves.len()))
    }

    proptest! {
        #[test]
        fn is_that_of_the_particles_left(changes in prop::collection::vec((any::<bool>(), 0_usize..40, 0_u8..4), 0..80)) {
            let (mut widest, mut halves) = (Widest::default(), Vec::new());
            for (comes, which, half) in changes {
                if comes || halves.is_empty() {
                    let half = f64::from(half);
                    halves.push(half);
                    widest.add(half);
                } else {
                    let gone = halves.swap_remove(which % halves.len());
                    widest.remove(gone);
                }
                if let Some(half) = widest.known() {
                    prop_assert_eq!(half, halves.iter().copied().fold(0.0, f64::max));
                    prop_assert_eq!(of(&halves).known(), Some(half));
                } else {
                    widest = of(&halves);
                }
            }
        }
    }
}
