//! Conservation in splits and merges.
use super::*;

fn splitting_conserves<const D: usize>(seed: u64) {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<D>(seed, 1, 1, None);
    let original = chunk.clone();
    let before = totals(&chunk);
    let energy = split_all(&mut chunk, &setting(&scheme, 2));
    let after = totals(&chunk);
    assert_conserved(&before, &after, 1e-14, 0);
    assert!((after.kinetic - before.kinetic - energy).abs() <= 1e-14 * after.kinetic);
    for p in 0..original.len() {
        // Mass and centre of each family are those of the parent to the last bit.
        let family = p << D..(p + 1) << D;
        let mass = original.column(Layout::<D>::MASS)[p];
        let is_share = |part: &f64| part * f64::from(1 << D) == mass;
        assert!(family.clone().all(|p| is_share(&chunk.column(Layout::<D>::MASS)[p])));
        for axis in 0..D {
            let x: Vec<f64> = family.clone().map(|p| chunk.column(Layout::<D>::POSITION + axis)[p]).collect();
            let opposite = 0.5 * x[0] + 0.5 * x[(1 << D) - 1];
            assert_eq!(opposite, original.position(p)[axis]);
        }
    }
}

fn merging_undoes_splitting<const D: usize>(seed: u64, transfer: Transfer) {
    let materials = materials();
    let scheme = scheme(&materials, transfer);
    let mut chunk = particles::<D>(seed, 1, 1, None);
    let original = chunk.clone();
    let added = split_all(&mut chunk, &setting(&scheme, 2));
    let limits = Limits { velocity: 0.1, strain: 1e-9, volume: 1e-9, history: 1e-9, stretch: 1.2 };
    let (report, removed) = merge_all(&mut chunk, &setting(&scheme, 1), &limits);
    let number = original.len() as u64;
    assert_eq!((report.merged, report.families, &report.unnamed), (number, number, &vec![]));
    assert!((added - removed).abs() <= 1e-13 * added, "{added} {removed}");
    // Gradients come from differences of velocities over the small distance of children.
    assert_same(&original, &chunk, if transfer == Transfer::Apic { 1e-13 } else { 1e-12 });
}

fn three_generations_return<const D: usize>(seed: u64) {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<D>(seed, 0, 1, None);
    let original = chunk.clone();
    for level in 1..=3 {
        split_all(&mut chunk, &setting(&scheme, level));
    }
    let mut ids = chunk.ids().to_vec();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), original.len() << (3 * D));
    let (report, _) = merge_all(&mut chunk, &setting(&scheme, 0), &OPEN);
    assert_eq!(report.merged, report.families);
    assert_same(&original, &chunk, 1e-12);
}

/// Particles of one size in lattice cells of twice that size, with different states.
fn merging_strangers_conserves<const D: usize>(seed: u64) {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    for kind in 0..KINDS {
        let mut chunk = particles::<D>(seed, 1, 2, Some(kind));
        // Sizes of level 2, for which they are made.
        (0..chunk.len()).for_each(|p| {
            let tag = Tag::unpack(chunk.tags()[p]);
            chunk.tags_mut()[p] = Tag { level: 2, ..tag }.pack();
        });
        let before = totals(&chunk);
        let ids = chunk.ids().to_vec();
        let (report, energy) = merge_all(&mut chunk, &setting(&scheme, 1), &OPEN);
        assert!(report.merged >= 4 && report.families == 0);
        assert_eq!(report.unnamed.len() as u64, report.merged);
        assert!(chunk.ids().iter().all(|id| ids.contains(id)));
        let after = totals(&chunk);
        // Where the return mapping flows, its work is added.
        assert_conserved(&before, &after, 2e-14, 1);
        let work = before.sums.len() - 1;
        assert!(after.sums[work].0 >= before.sums[work].0 * (1.0 - 1e-13));
        if kind == 0 {
            assert_conserved(&before, &after, 2e-14, 0);
        }
        assert!((before.kinetic - after.kinetic - energy).abs() <= 1e-13 * before.kinetic);
        for p in 0..chunk.len() {
            assert_admissible(&chunk, p);
        }
    }
}

/// An update without increment changes nothing but by round-off, and the stored stress is that of the state.
fn assert_admissible<const D: usize>(chunk: &Chunk<D>, p: usize) {
    let mut again = chunk.clone();
    set_matter(&mut again, p, elastic(chunk, p), chunk.read(Layout::<D>::HISTORY, p));
    for column in Layout::<D>::LEFT_CAUCHY_GREEN..Layout::<D>::MASS {
        let scale = if column < Layout::<D>::STRESS { 1.0 } else { 1e6 };
        let (a, b) = (chunk.column(column)[p], again.column(column)[p]);
        assert!((a - b).abs() <= 1e-13 * scale, "column {column}: {a} is returned to {b}");
    }
    assert!(material::eigen::determinant(&elastic(chunk, p).map(Lanes::splat)).to_array()[0] > 0.0);
}

/// Children of a particle that has been stretched know where in the undeformed body they come from.
fn children_come_from_their_places<const D: usize>() {
    let materials = materials();
    let scheme = Scheme { displacement: Some(0), ..scheme(&materials, Transfer::Apic) };
    let mut chunk = particles::<D>(3, 1, 1, Some(0));
    let stretches = [1.4, 0.8, if D == 2 { 1.0 } else { 1.1 }];
    chunk.carry(D);
    for p in 0..chunk.len() {
        let [xx, yy, zz] = stretches.map(|stretch| stretch * stretch);
        set_matter(&mut chunk, p, [xx, yy, zz, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
        (0..D).for_each(|a| chunk.carried_mut(a)[p] = 0.01 * a as f64);
    }
    let original = chunk.clone();
    split_all(&mut chunk, &setting(&scheme, 2));
    let start = |chunk: &Chunk<D>, p: usize, a: usize| chunk.position(p)[a] - chunk.carried(a)[p];
    for p in 0..chunk.len() {
        let whole = p >> D;
        let [half] = original.read(Layout::<D>::HALF, whole);
        for a in 0..D {
            let side: f64 = if p >> a & 1 == 1 { 0.5 } else { -0.5 };
            let due = side.mul_add(half, start(&original, whole, a));
            assert!((start(&chunk, p, a) - due).abs() < 1e-14, "particle {p}, axis {a}");
        }
    }
}

/// Drawn out along some line to three times their width while they get thinner, particles become two, and
/// these again two where the line is not yet filled.
fn closing_gaps_conserves<const D: usize>(seed: u64) {
    let materials = materials();
    let scheme = Scheme { shares: 1, ..scheme(&materials, Transfer::Apic) };
    let mut chunk = particles::<D>(seed, 0, 1, Some(0));
    let columns = crate::particle::strain::columns(D);
    chunk.carry(1 + columns);
    let mut numbers = Numbers(seed);
    for p in 0..chunk.len() {
        let direction: [f64; D] = std::array::from_fn(|_| numbers.next());
        let square: f64 = direction.iter().map(|n| n * n).sum();
        let (along, across) = (9.0_f64, 9.0_f64.powf(-1.0 / (D - 1) as f64));
        let places = crate::particle::strain::places(D);
        for (c, &(i, j)) in places.iter().enumerate() {
            let unit = if i == j { across - 1.0 } else { 0.0 };
            chunk.carried_mut(1 + c)[p] = unit + (along - across) * direction[i] * direction[j] / square;
        }
        chunk.carried_mut(0)[p] = numbers.next();
    }
    let (before, carried) = (totals(&chunk), chunk.carried(0).iter().sum::<f64>());
    let gap = Gap { cells: 1.0, column: 1 };
    let (mut energy, mut passes) = (0.0, 0);
    let setting = setting::<D>(&scheme, 0);
    // The grid's second moment, which is always greater than that of the box.
    let spread =
        |chunk: &Chunk<D>, p: usize| [chunk.column(Layout::<D>::HALF)[p].powi(2) + CELL * CELL / 6.0; D];
    let number = chunk.len();
    while split::close_gaps(&mut chunk, &setting, gap, spread, &mut |e| energy += e) > 0 {
        passes += 1;
    }
    // Half a cell wide at rest, and three times as long.
    assert_eq!((passes, chunk.len()), (1, 2 * number));
    let after = totals(&chunk);
    assert_conserved(&before, &after, 4e-14, 0);
    assert!((after.kinetic - before.kinetic - energy).abs() <= 1e-13 * after.kinetic);
    assert!((chunk.carried(0).iter().sum::<f64>() - carried).abs() <= 1e-13);
    let mut ids = chunk.ids().to_vec();
    ids.sort_unstable();
    ids.dedup();
    assert_eq!(ids.len(), 2 * number);
    // Particles whose space has also grown in volume are torn, and do not split.
    (1..=columns).for_each(|c| {
        chunk.carried_mut(c).iter_mut().for_each(|e| *e = if c <= D.min(2) { 99.0 } else { 0.0 })
    });
    assert_eq!(split::close_gaps(&mut chunk, &setting, gap, spread, &mut |_| ()), 0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(40))]

    #[test]
    fn gaps_are_closed_without_loss(seed in 1u64..1_000_000) {
        closing_gaps_conserves::<2>(seed);
        closing_gaps_conserves::<3>(seed);
    }

    #[test]
    fn splitting_conserves_in_both_dimensions(seed in any::<u64>()) {
        splitting_conserves::<2>(seed);
        splitting_conserves::<3>(seed);
    }

    #[test]
    fn merging_undoes_splitting_in_both_dimensions(seed in any::<u64>()) {
        for transfer in [Transfer::Apic, Transfer::Tpic, Transfer::Flip { blend: 0.9 }] {
            merging_undoes_splitting::<2>(seed, transfer);
            merging_undoes_splitting::<3>(seed, transfer);
        }
    }

    #[test]
    fn merging_strangers_conserves_in_both_dimensions(seed in any::<u64>()) {
        merging_strangers_conserves::<2>(seed);
        merging_strangers_conserves::<3>(seed);
    }
}

#[test]
fn displacements_of_children() {
    children_come_from_their_places::<2>();
    children_come_from_their_places::<3>();
}

#[test]
fn three_generations_and_back() {
    three_generations_return::<2>(1);
    three_generations_return::<3>(2);
}
