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
