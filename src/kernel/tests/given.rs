//! Columns that are given in place of those of the particles.
use super::*;

/// Particles scatter given columns as if they were theirs, bit for bit, whatever a batch is.
fn given_columns_are_as_own<const D: usize>() {
    let materials = materials();
    let (frame, scheme) = (&frame::<D>(), &scheme(&materials, Transfer::Apic));
    let (own, mut other) = (particles::<D>(37, 5, 5), particles::<D>(37, 5, 5));
    let motion = (0..D).map(|axis| Layout::<D>::VELOCITY + axis);
    let columns = motion.chain([Layout::<D>::MASS, Layout::<D>::STRESS + 1]);
    let given: Vec<GivenColumn> = columns
        .map(|column| {
            let values: Vec<f64> = (0..own.len()).map(|p| 0.5 + p as f64).collect();
            other.column_mut(column).into_iter().zip(&values).for_each(|(own, value)| *own = *value);
            GivenColumn { column, values }
        })
        .collect();
    let scattered = |chunk: &Chunk<D>, given: &[GivenColumn], select: Select| {
        let (scratch, mut rows) = (&mut Default::default(), vec![Row::default(); arena_nodes(D)]);
        let arena = &mut rows[..];
        p2g::Scatter { scratch, chunk, given, frame, scheme, dt: DT, arena, moments: None }
            .whole_boxes(select, Place::default());
        rows
    };
    let with_gaps: Vec<u32> = (0..37).filter(|p| p % 3 != 1).collect();
    let far_apart: Vec<u32> = (0..37).filter(|p| p % 9 == 1).collect();
    for select in [Select::All, Select::List(&with_gaps), Select::List(&far_apart)] {
        let as_own = scattered(&other, &[], select);
        assert!(as_own == scattered(&own, &given, select), "{select:?}");
        assert!(as_own != scattered(&own, &[], select), "{select:?}");
    }
}

#[test]
fn given_columns_take_the_place_of_own() {
    given_columns_are_as_own::<2>();
    given_columns_are_as_own::<3>();
}
