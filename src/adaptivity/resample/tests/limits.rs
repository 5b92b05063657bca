//! Who splits and merges, and who does not.
use super::*;

#[test]
fn undeformed_particles_stay_undeformed_to_the_last_bit() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<3>(3, 1, 1, None);
    (0..chunk.len())
        .for_each(|p| set_matter(&mut chunk, p, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]));
    split_all(&mut chunk, &setting(&scheme, 2));
    merge_all(&mut chunk, &setting(&scheme, 1), &OPEN);
    for p in 0..chunk.len() {
        assert_eq!(elastic(&chunk, p), [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        assert_eq!(chunk.read::<6>(Layout::<3>::STRESS, p), [0.0; 6]);
    }
}

#[test]
fn limits_are_respected() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let limits = Limits { velocity: 0.1, strain: 1e-3, volume: 1e-3, history: 1e-3, stretch: 1.2 };
    let speed = materials[1].wave_speed();
    let mut family = particles::<2>(4, 1, 1, Some(1)).gathered(&[0]);
    split_all(&mut family, &setting(&scheme, 2));
    let merges = |change: &dyn Fn(&mut Chunk<2>)| {
        let mut chunk = family.clone();
        change(&mut chunk);
        merge_all(&mut chunk, &setting(&scheme, 1), &limits).0.families == 1
    };
    let shift = |column: usize, by: f64| merges(&|chunk: &mut Chunk<2>| chunk.column_mut(column)[2] += by);
    assert!(merges(&|_| ()));
    // Three of four follow an affine field, the fourth differs.
    assert!(shift(Layout::<2>::VELOCITY, 0.1 * speed) && !shift(Layout::<2>::VELOCITY, 0.5 * speed));
    assert!(shift(Layout::<2>::LEFT_CAUCHY_GREEN, 1e-3) && !shift(Layout::<2>::LEFT_CAUCHY_GREEN, 5e-3));
    assert!(shift(Layout::<2>::PLASTIC_STRAIN, 1e-3) && !shift(Layout::<2>::PLASTIC_STRAIN, 2e-3));
    assert!(shift(Layout::<2>::PLASTIC_VOLUME, 1e-3) && !shift(Layout::<2>::PLASTIC_VOLUME, 2e-3));
    assert!(shift(Layout::<2>::POSITION, 0.001) && !shift(Layout::<2>::POSITION, 0.1));
    // Of another material; of a coarser level.
    assert!(!merges(&|chunk| chunk.tags_mut()[2] += 1));
    let mut chunk = family.clone();
    assert_eq!(merge_all(&mut chunk, &setting(&scheme, 2), &limits).0, Merged::default());
    assert_eq!(
        merge(&mut chunk, &setting(&scheme, 1), &limits, Some(&everywhere()), |_| false, &mut |_| ()),
        Merged::default()
    );
}

/// The test by elastic tensors, before strains are known, must refuse no group that the limit on strain
/// admits.
#[test]
fn strains_count_whatever_the_stretch() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let mut family = particles::<2>(4, 1, 1, Some(0)).gathered(&[0]);
    set_matter(&mut family, 0, [2.0, 0.6, 1.1, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    split_all(&mut family, &setting(&scheme, 2));
    for strain in [1e-6, 0.01, 0.2, 0.7] {
        for (child, sign) in [(0, 1.0), (0, -1.0), (3, 1.0), (3, -1.0)] {
            // The mean contains a quarter of the difference of one of four.
            let merges = |difference: f64| {
                let mut chunk = family.clone();
                let xx = &mut chunk.column_mut(Layout::<2>::LEFT_CAUCHY_GREEN)[child];
                *xx *= f64::exp(2.0 * sign * difference / 0.75);
                let limits = Limits { strain, ..OPEN };
                merge_all(&mut chunk, &setting(&scheme, 1), &limits).0.families == 1
            };
            assert!(merges(0.99 * strain) && !merges(1.01 * strain), "{strain} {child} {sign}");
        }
    }
}

#[test]
fn others_do_not_matter() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let setting = setting(&scheme, 1);
    let mut family = particles::<3>(5, 0, 1, Some(2)).gathered(&[1]);
    split_all(&mut family, &setting);
    let mut others = particles::<3>(6, 2, 1, None);
    others.ids_mut().iter_mut().for_each(|id| *id += 1000);
    (0..others.len()).for_each(|p| others.column_mut(0)[p] += 4.0);
    let coarse = Setting { level: 0, ..setting };
    let mut alone = family.clone();
    merge_all(&mut alone, &coarse, &OPEN);
    // The family among others, in the same order.
    let mut mixed = Chunk::<3>::new();
    for p in 0..family.len() {
        mixed.push_from(&others, p % 4);
        mixed.push_from(&family, p);
    }
    let mut kept: Vec<u32> = (0..4).map(|i| 2 * i).collect();
    kept.extend((0..8).map(|i| 2 * i + 1));
    kept.sort_unstable();
    let mut mixed = mixed.gathered(&kept);
    merge(&mut mixed, &coarse, &OPEN, Some(&everywhere()), |x| x[0] < 3.0, &mut |_| ());
    assert_eq!(mixed.len(), 5);
    let p = mixed.ids().iter().position(|&id| id == alone.ids()[0]).unwrap();
    assert_eq!(p, 1);
    assert!((0..Layout::<3>::REALS).all(|c| mixed.column(c)[p].to_bits() == alone.column(c)[0].to_bits()));
    assert!([0, 2, 3, 4].iter().all(|&q| mixed.ids()[q] >= 1000));
}

#[test]
fn stretched_particles_split_once_and_do_not_merge_back() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let setting = setting::<2>(&scheme, 1);
    let mut chunk = particles::<2>(7, 1, 1, Some(0)).gathered(&[0, 1]);
    set_matter(&mut chunk, 0, [1.8 * 1.8, 0.7, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    set_matter(&mut chunk, 1, [1.5 * 1.5, 0.7, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    assert_eq!(needs_split(&chunk, &setting, Some(1.6)), Wanted { which: vec![0], refused: 0 });
    assert_eq!(needs_split(&chunk, &setting, None), Wanted::default());
    let spreads = spreads(&chunk, &setting, &[0]);
    split(&mut chunk, &setting, &[0], &spreads, &mut |_| ());
    assert_eq!(chunk.len(), 5);
    assert_eq!(needs_split(&chunk, &setting, Some(1.6)), Wanted::default());
    let (report, _) = merge_all(&mut chunk, &setting, &Limits::default());
    assert_eq!(report.removed, 0);
    // Children stay in the box of their parent.
    let wide = Limits { stretch: 1.9, ..OPEN };
    assert_eq!(merge_all(&mut chunk, &setting, &wide).0.removed, 3);
}

#[test]
fn generations_are_bounded() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<2>(8, 0, 1, Some(0)).gathered(&[0]);
    for level in 1..=7 {
        split_all(&mut chunk, &setting(&scheme, level));
        chunk = chunk.gathered(&[0]);
    }
    let setting = setting(&scheme, 8);
    assert_eq!(needs_split(&chunk, &setting, None), Wanted { which: vec![], refused: 1 });
    let before = chunk.clone();
    let report = split(&mut chunk, &setting, &[0], &[[1.0; 2]], &mut |_| ());
    assert_eq!(report, Split { split: 0, refused: 1 });
    assert_same(&before, &chunk, 0.0);
}

#[test]
fn boxes_of_one_cell_do_not_put_children_on_each_other() {
    let materials = materials();
    let scheme = Scheme { boxes: BoxPolicy::Cell, ..scheme(&materials, Transfer::Apic) };
    let mut chunk = particles::<2>(9, 0, 1, Some(0)).gathered(&[0]);
    set_matter(&mut chunk, 0, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    let half = chunk.column(Layout::<2>::HALF)[0];
    split_all(&mut chunk, &setting(&scheme, 1));
    let distance = chunk.position(1)[0] - chunk.position(0)[0];
    assert!((distance - half).abs() < 1e-14);
}

/// A face cuts a family, whose parts wait at it; once together they become the parent again.
#[test]
fn families_wait_for_siblings_beyond_a_face() {
    let materials = materials();
    let scheme = scheme(&materials, Transfer::Apic);
    let setting = setting::<2>(&scheme, 1);
    let mut family = particles::<2>(10, 1, 1, Some(0)).gathered(&[0]);
    set_matter(&mut family, 0, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0; HISTORIES]);
    let (x, parent) = (family.position(0), family.ids()[0]);
    split_all(&mut family, &Setting { level: 2, ..setting });
    let upper_leaf = ([x[0], 0.0], [x[0] + 1.0, EXTENT]);
    let mut upper = family.gathered(&[1, 3]);
    let merged = |chunk: &mut Chunk<2>, bounds: &Bounds<2>| {
        merge(chunk, &setting, &OPEN, Some(bounds), |_| true, &mut |_| ()).removed
    };
    assert_eq!(merged(&mut upper.clone(), &upper_leaf), 0);
    assert_eq!(merged(&mut family.gathered(&[0, 2]), &([x[0] - 1.0, 0.0], [x[0], EXTENT])), 0);
    let crossing = separated(&upper, &setting, &OPEN, &upper_leaf, 0b01);
    assert_eq!(crossing.iter().map(|(p, _)| *p).collect::<Vec<_>>(), [0, 1]);
    assert!(crossing.iter().all(|(_, beyond)| beyond[0] < x[0] && beyond[0] > x[0] - 1.0));
    assert_eq!(separated(&upper, &setting, &OPEN, &upper_leaf, 0b10), []);
    assert_eq!(separated(&family, &setting, &OPEN, &upper_leaf, 0b11), []);
    assert_eq!(merged(&mut family, &upper_leaf), 3);
    assert_eq!(family.ids(), [parent]);
    // Far from all faces, the missing siblings cannot come.
    assert_eq!(merged(&mut upper, &everywhere()), 1);
}
