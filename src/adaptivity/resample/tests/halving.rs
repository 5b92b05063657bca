//! Stretched particles become two, and one again.
use super::*;
use crate::adaptivity::resample::halve::{half_widths, halve, rejoin};
use crate::particle::halvings;

/// Elastic particles that are drawn out along an axis of the lattice, with a little of every other strain, to
/// boxes 0.7 cells wide.
fn drawn<const D: usize>(seed: u64, axis: usize, stretch: f64) -> Chunk<D> {
    let mut chunk = particles::<D>(seed, 1, 1, Some(0));
    let across = stretch.powf(-0.4);
    for p in 0..chunk.len() {
        let mut b = elastic(&chunk, p);
        for i in 0..D {
            let factor = if i == axis { stretch } else { across };
            b[i] *= factor * factor;
        }
        set_matter(&mut chunk, p, b, [0.0; HISTORIES]);
    }
    chunk.carry(1 + D);
    (0..chunk.len()).for_each(|p| chunk.carried_mut(0)[p] = p as f64 + 1.0);
    chunk
}

/// Mass, first moments, momentum, angular momentum and volume stay. Halves lie and move as the material did,
/// whatever the transfer.
fn halving_conserves<const D: usize>(seed: u64, transfer: Transfer) {
    let materials = materials();
    let scheme =
        Scheme { shares: 1, displacement: Some(1), has_halves: true, ..scheme(&materials, transfer) };
    let axis = seed as usize % D;
    let mut chunk = drawn::<D>(seed, axis, 1.5);
    let original = chunk.clone();
    let setting = setting::<D>(&scheme, 1);
    let (before, mut energy) = (totals(&chunk), 0.0);
    let report = halve(&mut chunk, &setting, &mut |e| energy += e);
    let number = original.len();
    assert_eq!((report.split, report.refused, chunk.len()), (number as u64, 0, 2 * number));
    let after = totals(&chunk);
    // The rotation of a particle is in its affine matrix with APIC alone.
    let skipped = if transfer == Transfer::Apic { 0 } else { 6 };
    assert_conserved(&before, &after, 4e-14, skipped);
    assert!((after.kinetic - before.kinetic - energy).abs() <= 1e-13 * after.kinetic);
    let mut ids = chunk.ids().to_vec();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 2 * number);
    for p in 0..number {
        let (whole, halves) = (half_widths(&original, p), [2 * p, 2 * p + 1]);
        let [lower, upper] = halves.map(|p| (chunk.position(p), half_widths(&chunk, p)));
        for a in 0..D {
            let width = if a == axis { 0.5 * whole[a] } else { whole[a] };
            for half in [lower.1[a], upper.1[a]] {
                assert!((half / width - 1.0).abs() < 1e-14, "{half} {width}");
            }
        }
        let apart: [f64; D] = std::array::from_fn(|a| upper.0[a] - lower.0[a]);
        let distance = apart.iter().map(|way| way * way).sum::<f64>().sqrt();
        assert!((distance / whole[axis] - 1.0).abs() < 1e-13);
        if transfer != Transfer::Apic {
            let slope = read_matrix(&original, p);
            let [lower, upper]: [[f64; D]; 2] = halves.map(|p| chunk.read(Layout::<D>::VELOCITY, p));
            for i in 0..D {
                let due: f64 = (0..D).map(|k| slope[i][k] * apart[k]).sum();
                assert!((upper[i] - lower[i] - due).abs() < 1e-13);
            }
        }
        assert_eq!(halves.map(|p| chunk.carried(0)[p]), [0.5 * (p as f64 + 1.0); 2]);
        // Half a half width of the undeformed box from its centre, before they went their ways.
        let [undeformed] = original.read(Layout::<D>::HALF, p);
        for a in 0..D {
            let start = distance_at_start(&chunk, halves, a);
            let due = if a == axis { undeformed } else { 0.0 };
            assert!((start - due).abs() < 1e-12 * undeformed, "{start} {due}");
            let way = |side: usize| chunk.carried(1 + a)[halves[side]];
            assert!((way(0) + way(1)).abs() < 1e-15);
        }
    }
    // They are no longer too wide.
    assert_eq!(halve(&mut chunk, &setting, &mut |_| ()).split, 0);
    assert_eq!(rejoin(&mut chunk, &setting, &OPEN, &mut |_| ()).merged, 0, "and still too wide to be one");
    // Once they have the old length, they are one again, with all that they had.
    for p in 0..chunk.len() {
        set_matter(&mut chunk, p, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    }
    let mut removed = 0.0;
    let report = rejoin(&mut chunk, &setting, &OPEN, &mut |e| removed += e);
    assert_eq!((report.merged, report.removed, chunk.len()), (number as u64, number as u64, number));
    assert!((energy - removed).abs() <= 1e-13 * energy);
    assert_eq!((chunk.ids(), chunk.tags()), (original.ids(), original.tags()));
    for column in (0..Layout::<D>::LEFT_CAUCHY_GREEN).chain([Layout::<D>::MASS, Layout::<D>::HALF]) {
        if transfer != Transfer::Apic && column >= Layout::<D>::AFFINE {
            continue;
        }
        for (a, b) in original.column(column).iter().zip(chunk.column(column).iter()) {
            assert!((a - b).abs() < 1e-13, "column {column}: {a} {b}");
        }
    }
}

/// Distance (m) of two particles along an axis before they went their ways.
fn distance_at_start<const D: usize>(chunk: &Chunk<D>, [lower, upper]: [usize; 2], axis: usize) -> f64 {
    let start = |p: usize| chunk.position(p)[axis] - chunk.carried(1 + axis)[p];
    start(upper) - start(lower)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(20))]

    #[test]
    fn halves_are_made_and_joined_without_loss(seed in 1u64..1_000_000) {
        for transfer in [Transfer::Apic, Transfer::Tpic, Transfer::Flip { blend: 0.99 }] {
            halving_conserves::<2>(seed, transfer);
            halving_conserves::<3>(seed, transfer);
        }
    }
}

/// Only elastic particles in tension along their wide axis are halved; those whose identifiers are full are
/// counted.
#[test]
fn only_what_is_drawn_is_halved() {
    let materials = materials();
    let scheme = Scheme { has_halves: true, ..scheme(&materials, Transfer::Apic) };
    let setting = setting::<2>(&scheme, 1);
    let halved = |chunk: &mut Chunk<2>| {
        let report = halve(chunk, &setting, &mut |_| ());
        (report.split, report.refused)
    };
    let chunk = drawn::<2>(5, 0, 1.5);
    let number = chunk.len() as u64;
    assert_eq!(halved(&mut drawn::<2>(5, 0, 1.2)), (0, 0), "little strain");
    let mut flowing = chunk.clone();
    for p in 0..flowing.len() {
        flowing.tags_mut()[p] = Tag { material: 1, ..Tag::unpack(chunk.tags()[p]) }.pack();
    }
    assert_eq!(halved(&mut flowing), (0, 0), "plastic");
    let mut pressed = chunk.clone();
    pressed.column_mut(Layout::<2>::STRESS).into_iter().for_each(|stress| *stress = -1.0);
    assert_eq!(halved(&mut pressed), (0, 0), "widened by pressure from the sides");
    let mut full = chunk.clone();
    full.ids_mut()[3] |= u64::from(ids::GENERATIONS) << 61;
    assert_eq!(halved(&mut full), (number - 1, 1), "no room for another generation");
    // Drawn on, halves become quarters along the same axis.
    let mut more = drawn::<2>(5, 0, 3.0);
    assert_eq!([halved(&mut more).0, halved(&mut more).0, halved(&mut more).0], [number, 2 * number, 0]);
    assert!(more.tags().iter().all(|&tag| halvings::along(tag, 0) == 2 && halvings::along(tag, 1) == 0));
}

/// Where one is halved, all of its material in the leaf are, and none is joined before all may be.
#[test]
fn particles_of_a_leaf_are_halved_together() {
    let materials = materials();
    let scheme = Scheme { has_halves: true, ..scheme(&materials, Transfer::Apic) };
    let setting = setting::<2>(&scheme, 1);
    let (drawn, mut chunk) = (drawn::<2>(5, 0, 1.5), drawn::<2>(5, 0, 1.1));
    let (number, flows) = (chunk.len(), 1);
    set_matter(&mut chunk, 4, elastic(&drawn, 4), [0.0; HISTORIES]);
    chunk.tags_mut()[flows] = Tag { material: 1, ..Tag::unpack(chunk.tags()[flows]) }.pack();
    assert_eq!(halve(&mut chunk, &setting, &mut |_| ()).split, number as u64 - 1);
    assert_eq!(halve(&mut chunk, &setting, &mut |_| ()).split, 0);
    assert_eq!(rejoin(&mut chunk, &setting, &OPEN, &mut |_| ()).merged, 0, "some are still too wide");
    for p in 0..chunk.len() {
        set_matter(&mut chunk, p, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    }
    assert_eq!(rejoin(&mut chunk, &setting, &OPEN, &mut |_| ()).merged, number as u64 - 1);
    assert_eq!(chunk.len(), number);
}

/// Strands of what has torn are not halved, and do not keep the rest from being joined.
#[test]
fn what_has_torn_is_left_as_it_is() {
    let materials = materials();
    let scheme = Scheme { has_halves: true, ..scheme(&materials, Transfer::Apic) };
    let setting = setting::<2>(&scheme, 1);
    let (mut torn, mut chunk) = (drawn::<2>(5, 0, 12.0), drawn::<2>(5, 0, 1.5));
    let number = chunk.len();
    assert_eq!(halve(&mut torn, &setting, &mut |_| ()).split, 0);
    assert_eq!(halve(&mut chunk, &setting, &mut |_| ()).split, number as u64);
    for p in 0..chunk.len() {
        let elastic = if p < 2 { elastic(&torn, 0) } else { [1.0, 1.0, 1.0, 0.0, 0.0, 0.0] };
        set_matter(&mut chunk, p, elastic, [0.0; HISTORIES]);
    }
    assert_eq!(rejoin(&mut chunk, &setting, &OPEN, &mut |_| ()).merged, number as u64 - 1);
}
