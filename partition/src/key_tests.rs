//! Properties of octants and keys.

use proptest::prelude::*;

use super::*;

const BRICK_3: Brick<3> = Brick { roots: [64, 5, 17] };
const BRICK_2: Brick<2> = Brick { roots: [3, 64] };

/// Any octant of the brick.
fn octant<const D: usize>(brick: Brick<D>) -> impl Strategy<Value = Octant<D>> {
    (0..=MAX_LEVEL, prop::array::uniform::<_, D>(any::<u32>())).prop_map(move |(level, seeds)| {
        let coord = std::array::from_fn(|a| seeds[a] % (brick.roots[a] << level));
        Octant { level, coord }
    })
}

/// Two octants that are often close to each other.
fn pair<const D: usize>(brick: Brick<D>) -> impl Strategy<Value = (Octant<D>, Octant<D>)> {
    (octant(brick), 0..=MAX_LEVEL, prop::array::uniform::<_, D>(-2i32..=2)).prop_map(
        move |(first, level, offset)| {
            let near = first.neighbour(offset, &brick).unwrap_or(first);
            let near = if level <= near.level {
                near.ancestor(level)
            } else {
                Octant::from_key(near.key_end() - 1, level)
            };
            (first, near)
        },
    )
}

/// One bit at a time.
fn slow_key<const D: usize>(octant: &Octant<D>) -> u64 {
    let low = octant.lower();
    (0..21)
        .flat_map(|bit| (0..D).map(move |a| (bit, a)))
        .fold(0, |key, (bit, a)| key | u64::from(low[a] >> bit & 1) << (bit * D + a))
}

fn check_octant<const D: usize>(octant: Octant<D>, brick: &Brick<D>) -> Result<(), TestCaseError> {
    prop_assert!(brick.contains(&octant));
    prop_assert_eq!(octant.key(), slow_key(&octant));
    prop_assert!(octant.key_end() <= Brick::<D>::KEY_END);
    prop_assert_eq!(Octant::from_key(octant.key(), octant.level), octant);
    prop_assert_eq!(Octant::from_key(octant.key_end() - 1, octant.level), octant);
    prop_assert_eq!(Octant::from_code(octant.code()), Some(octant));
    prop_assert_eq!(octant.neighbour([0; D], brick), Some(octant));
    if let Some(parent) = octant.parent() {
        prop_assert_eq!(parent.child(octant.child_id()), octant);
        prop_assert!(parent < octant && parent.contains(&octant) && !octant.contains(&parent));
        prop_assert!(octant.is_sibling(&parent.child(0)) && !octant.is_sibling(&parent));
    }
    if octant.level < MAX_LEVEL {
        let mut key = octant.key();
        for i in 0..Octant::<D>::CHILDREN {
            let child = octant.child(i);
            prop_assert_eq!(child.child_id(), i);
            prop_assert_eq!(child.key(), key);
            prop_assert!(octant < child);
            key = child.key_end();
        }
        prop_assert_eq!(key, octant.key_end());
    }
    Ok(())
}

fn check_pair<const D: usize>(a: Octant<D>, b: Octant<D>) -> Result<(), TestCaseError> {
    let nested = a.contains(&b) || b.contains(&a);
    let overlap = a.key() < b.key_end() && b.key() < a.key_end();
    prop_assert_eq!(nested, overlap);
    prop_assert_eq!(a.cmp(&b), (a.key(), a.level).cmp(&(b.key(), b.level)));
    prop_assert_eq!(a.cmp(&b) == Ordering::Equal, a == b);
    // Closed boxes share a point exactly if some neighbour of one (or itself) contains the other,
    // seen at the coarser of the two levels.
    let level = a.level.min(b.level);
    let (coarse_a, coarse_b) = (a.ancestor(level), b.ancestor(level));
    let near = (0..D).all(|i| coarse_a.coord[i].abs_diff(coarse_b.coord[i]) <= 1);
    prop_assert!(near || !a.touches(&b));
    if a.level == b.level {
        prop_assert_eq!(near, a.touches(&b));
    }
    prop_assert_eq!(a.touches(&b), b.touches(&a));
    prop_assert!(!overlap || a.touches(&b));
    Ok(())
}

proptest! {
    #[test]
    fn octants_are_consistent_3d(octant in octant(BRICK_3)) { check_octant(octant, &BRICK_3)?; }
    #[test]
    fn octants_are_consistent_2d(octant in octant(BRICK_2)) { check_octant(octant, &BRICK_2)?; }
    #[test]
    fn pairs_are_consistent_3d((a, b) in pair(BRICK_3)) { check_pair(a, b)?; }
    #[test]
    fn pairs_are_consistent_2d((a, b) in pair(BRICK_2)) { check_pair(a, b)?; }
    #[test]
    fn codes_of_nothing_are_refused(code: u64) {
        if let Some(octant) = Octant::<3>::from_code(code) { prop_assert_eq!(octant.code(), code); }
        if let Some(octant) = Octant::<2>::from_code(code) { prop_assert_eq!(octant.code(), code); }
    }
}

#[test]
fn neighbours_end_at_the_brick() {
    let corner = Octant { level: 2, coord: [0, 11] };
    let brick = Brick { roots: [1, 3] };
    assert_eq!(corner.neighbour([-1, 0], &brick), None);
    assert_eq!(corner.neighbour([0, 1], &brick), None);
    assert_eq!(corner.neighbour([1, -1], &brick), Some(Octant { level: 2, coord: [1, 10] }));
}

#[test]
fn roots_on_the_curve_are_sorted_and_complete() {
    for roots in [[1, 1, 1], [5, 3, 2], [64, 1, 2], [7, 9, 11]] {
        let brick = Brick { roots };
        let along: Vec<_> = (0..brick.root_count()).map(|i| brick.root_on_curve(i)).collect();
        assert!(along.is_sorted_by(|a, b| a < b));
        assert!(along.iter().all(|root| brick.contains(root)));
    }
}

#[test]
fn the_last_key_fits() {
    let last = Octant { level: MAX_LEVEL, coord: [(64 << MAX_LEVEL) - 1; 3] };
    assert_eq!(last.key_end(), Brick::<3>::KEY_END);
    assert_eq!(Octant::from_code(last.code()), Some(last));
}
