use super::*;

#[test]
fn bytes_round_trip() {
    let mut chunk = Chunk::<3>::new();
    for id in 0..11 {
        let p = chunk.push_zeroed(id << 40, Tag { material: 1, body: 2, level: 3 });
        chunk.column_mut(Layout::<3>::WORK)[p] = -0.1 * id as f64;
    }
    let mut bytes = Vec::new();
    chunk.append_to(&mut bytes);
    let back = Chunk::<3>::from_bytes(&bytes);
    assert_eq!(back.ids(), chunk.ids());
    assert_eq!(back.tags(), chunk.tags());
    for column in 0..Layout::<3>::REALS {
        assert_eq!(back.column(column), chunk.column(column));
    }
    assert!(Chunk::<3>::from_bytes(&[1, 2, 3]).is_empty());
}

#[test]
fn a_revision_lasts_until_something_but_appending_happens() {
    type Change = fn(&mut Chunk<2>);
    let tag = Tag { material: 0, body: 0, level: 0 };
    let appending: [Change; 3] = [
        |chunk| _ = chunk.push_zeroed(7, Tag { material: 0, body: 0, level: 0 }),
        |chunk| chunk.push_from(&chunk.clone(), 0),
        |chunk| chunk.reserve_exact(1000),
    ];
    let others: [Change; 9] = [
        |chunk| chunk.column_mut(Layout::<2>::MASS)[0] = 1.0,
        |chunk| chunk.write(Layout::<2>::MASS, 0, &[1.0]),
        |chunk| chunk.tags_mut()[0] = 1,
        |chunk| chunk.ids_mut()[0] = 1,
        |chunk| chunk.tiles_mut_and_tags().0[0][0] = 1.0,
        |chunk| chunk.replace(0, &chunk.clone(), 1),
        |chunk| chunk.remove(&[1]),
        |chunk| chunk.keep(&[0]),
        |chunk| *chunk = chunk.gathered(&[1, 0]),
    ];
    let mut chunk = Chunk::<2>::new();
    (0..20).for_each(|id| _ = chunk.push_zeroed(id, tag));
    for change in others {
        let mut chunk = chunk.clone();
        let first = chunk.revision().unwrap();
        for append in appending {
            append(&mut chunk);
            assert!(chunk.still_has(first) && chunk.revision() == Some(first));
        }
        change(&mut chunk);
        assert!(!chunk.still_has(first));
        assert_ne!(chunk.revision(), Some(first));
    }
    let first = chunk.revision().unwrap();
    chunk.keep(&[]);
    (0..20).for_each(|id| _ = chunk.push_zeroed(id, tag));
    assert!(!chunk.still_has(first));
}

#[test]
fn the_last_fill_the_gaps() {
    let mut chunk = Chunk::<2>::new();
    for id in 0..10 {
        let p = chunk.push_zeroed(id, Tag { material: id as u16, body: 0, level: 0 });
        chunk.column_mut(Layout::<2>::MASS)[p] = id as f64;
        chunk.column_mut(Layout::<2>::HALF)[p] = id as f64;
    }
    chunk.remove(&[0, 2, 3, 7, 9]);
    let expected = [5, 1, 6, 8, 4];
    assert_eq!(chunk.ids(), expected);
    assert!(chunk.column(Layout::<2>::MASS).iter().zip(expected).all(|(m, id)| *m == id as f64));
    assert!(chunk.tags().iter().zip(expected).all(|(t, id)| u64::from(Tag::unpack(*t).material) == id));
    chunk.remove(&[]);
    assert_eq!(chunk.len(), 5);
    chunk.keep(&[1, 2, 4]);
    assert_eq!((chunk.ids(), chunk.greatest_half()), (&[1, 6, 4][..], 6.0));
    assert!(chunk.column(Layout::<2>::MASS).iter().eq(&[1.0, 6.0, 4.0]));
    chunk.remove(&[0, 1, 2]);
    assert!(chunk.is_empty());
}

/// Carried values go wherever their particles go, and columns come with the first that is not zero.
#[test]
fn what_particles_carry_goes_with_them() {
    let tag = Tag { material: 0, body: 0, level: 0 };
    let mut chunk = Chunk::<2>::new();
    (0..20).for_each(|id| _ = chunk.push_zeroed(id, tag));
    assert_eq!((chunk.carried_columns(), chunk.carried(0)), (0, &[][..]));
    let bytes_without = chunk.heap_bytes();
    chunk.carry(2);
    assert!(chunk.heap_bytes() > bytes_without && chunk.carried(1) == [0.0; 20]);
    for p in 0..20 {
        (chunk.carried_mut(0)[p], chunk.carried_mut(1)[p]) = (p as f64, 0.5 * p as f64);
    }
    let check = |chunk: &Chunk<2>, expected: &[u64]| {
        assert_eq!(chunk.ids(), expected);
        for (p, &id) in expected.iter().enumerate() {
            assert_eq!((chunk.carried(0)[p], chunk.carried(1)[p]), (id as f64, 0.5 * id as f64));
        }
    };
    let mut other = chunk.clone();
    other.reserve_exact(500);
    other.remove(&[1, 3, 17]);
    check(&other, &[0, 18, 2, 19, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16]);
    other.keep(&[0, 2, 5]);
    check(&other, &[0, 2, 5]);
    check(&chunk.gathered(&[3, 3, 1]), &[3, 3, 1]);
    other.replace(1, &chunk, 7);
    other.push_from(&chunk, 8);
    check(&other, &[0, 7, 5, 8]);
    let mut bytes = Vec::new();
    other.append_to(&mut bytes);
    check(&Chunk::from_bytes(&bytes), &[0, 7, 5, 8]);

    let mut plain = Chunk::<2>::new();
    let words = [0; Layout::<2>::REALS];
    plain.push_words(&words, 0, tag.pack(), &[0, 0]);
    assert_eq!(plain.carried_columns(), 0);
    plain.push_words(&words, 6, tag.pack(), &[6.0_f64.to_bits(), 3.0_f64.to_bits()]);
    plain.push_zeroed(0, tag);
    check(&plain, &[0, 6, 0]);
    plain.keep(&[]);
    assert_eq!(plain.carried_columns(), 0);
}

/// Whole tiles and single particles, from one time to the next; columns that are not gathered stay zero as
/// room grows.
#[test]
fn some_columns_are_gathered() {
    let mut chunk = Chunk::<2>::new();
    for id in 0..30 {
        let p = chunk.push_zeroed(id, Tag { material: 0, body: id as u16, level: 0 });
        (0..Layout::<2>::REALS).for_each(|c| chunk.column_mut(c)[p] = (100 * c) as f64 + id as f64);
    }
    let columns = [Layout::<2>::POSITION, Layout::<2>::HALF];
    let mut copy = Chunk::<2>::new();
    for source in [vec![3, 9], (8..16).chain(24..30).chain([1, 2, 3]).collect(), vec![], (0..30).collect()] {
        copy.gather_columns(&chunk, &source, &columns);
        let expected = chunk.gathered(&source);
        assert!(copy.ids() == expected.ids() && copy.tags() == expected.tags());
        for column in 0..Layout::<2>::REALS {
            match columns.contains(&column) {
                true => assert_eq!(copy.column(column), expected.column(column)),
                false => assert!(copy.column(column).iter().all(|value| *value == 0.0)),
            }
        }
    }
}
