//! Hanging nodes beside coarser blocks.
use super::*;

/// Velocities around a block some of whose neighbours are coarser: random on real nodes, interpolated on
/// constrained ones, with the first moments of these.
struct BesideCoarser {
    is_hanging: Vec<bool>,
    velocity: Vec<Row>,
    /// By node and axis.
    moments: Vec<[Row; 3]>,
}

impl BesideCoarser {
    /// `coarse` has a bit for each of the `3^D` blocks of the arena.
    fn new<const D: usize>(coarse: u32, seed: u64) -> Self {
        let place = |node: usize, k: usize| node / ARENA_EDGE.pow(k as u32) % ARENA_EDGE;
        // Where nodes of an arena lie in closed blocks: below, in and above the block in the middle.
        let blocks = |at: usize| [at <= 1, (1..=5).contains(&at), at >= 5];
        let is_in = |node: usize, block: usize| {
            (0..D).all(|k| blocks(place(node, k))[block / 3usize.pow(k as u32) % 3])
        };
        let is_hanging: Vec<bool> = (0..arena_nodes(D))
            .map(|node| (0..3usize.pow(D as u32)).any(|block| coarse >> block & 1 == 1 && is_in(node, block)))
            .collect();
        let random = |at: [i32; D]| {
            let number =
                at.iter().fold(seed, |number, &x| number.wrapping_mul(64).wrapping_add((x + 2) as u64));
            let mut numbers = Numbers(number.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
            (0..8).for_each(|_| _ = numbers.next());
            [numbers.next(), numbers.next(), numbers.next()]
        };
        let (mut velocity, mut moments) = (Vec::new(), Vec::new());
        for node in 0..arena_nodes(D) {
            let at: [i32; D] = std::array::from_fn(|k| place(node, k) as i32 - 1);
            let odd: Vec<usize> = (0..D).filter(|&k| is_hanging[node] && at[k] % 2 != 0).collect();
            let (mut mean, mut first) = (Row::default(), [Row::default(); 3]);
            for corner in 0..1 << odd.len() {
                let (mut parent, mut way) = (at, [0.0; 3]);
                for (bit, &k) in odd.iter().enumerate() {
                    let step = 2 * (corner >> bit & 1) - 1;
                    parent[k] += step;
                    way[k] = f64::from(step) * CELL;
                }
                let weight = 0.5f64.powi(odd.len() as i32);
                for (i, value) in random(parent).into_iter().enumerate().take(D) {
                    mean.0[i] += weight * value;
                    (0..3).for_each(|k| first[k].0[i] += weight * value * way[k]);
                }
            }
            velocity.push(mean);
            moments.push(first);
        }
        Self { is_hanging, velocity, moments }
    }
}

/// Hanging nodes with other factors and with first moments give the same: particles gather the same, and what
/// they scatter does the same work in any motion of the real nodes.
fn hanging_nodes_replace_moments<const D: usize>(coarse: u32, seed: u64) {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let BesideCoarser { is_hanging, velocity, moments } = BesideCoarser::new::<D>(coarse, seed);
    // Parents lie beside nodes with an odd coordinate, and the lowest node of an arena has odd ones.
    let second = |node: usize| {
        let is_odd = |axis: usize| (node / ARENA_EDGE.pow(axis as u32) % ARENA_EDGE).is_multiple_of(2);
        std::array::from_fn(|axis| if is_odd(axis) { CELL * CELL } else { 0.0 })
    };
    let listed: Vec<usize> = (0..arena_nodes(D)).filter(|&node| is_hanging[node]).collect();
    let nodes: Vec<MomentNode<D>> =
        listed.iter().map(|&node| MomentNode { node, second: second(node) }).collect();
    let with_moments = ConstrainedNodes::new(&nodes, HangingNodes::new::<D>(&vec![false; arena_nodes(D)]));
    let hanging = ConstrainedNodes::new::<D>(&[], HangingNodes::new::<D>(&is_hanging));
    let start = particles::<D>(61, seed, 1);
    let first: Vec<Row> = listed.iter().flat_map(|&node| moments[node][..D].to_vec()).collect();
    let gathered = |moments: Moments| {
        let mut chunk = start.clone();
        let fields = Fields { velocity: &velocity, increment: None, fill: None, moments: Some(moments) };
        gather(&mut chunk, Select::All, &frame, &scheme, DT, &fields, Place::default());
        chunk
    };
    let expected = gathered(Moments { nodes: &with_moments, first: &first });
    let found = gathered(Moments { nodes: &hanging, first: &[] });
    for column in 0..Layout::<D>::REALS {
        for (a, b) in expected.column(column).iter().zip(found.column(column)) {
            assert!((a - b).abs() <= 1e-13 * a.abs().max(1.0), "{coarse:b}, column {column}: {a} {b}");
        }
    }
    let work = |nodes: &ConstrainedNodes, sums: &mut [Row]| {
        let mut arena = vec![Row::default(); arena_nodes(D)];
        let moments = MomentSums { nodes, sums: &mut *sums };
        scatter(&start, Select::All, &frame, &scheme, DT, &mut arena, Some(moments), Place::default());
        let dot = |a: &Row, b: &Row| (0..3).map(|i| a.0[i] * b.0[i]).sum::<f64>();
        let pairs = arena.iter().zip(&velocity).chain(sums.iter().zip(&first));
        pairs.fold((0.0, 0.0), |(sum, size): (f64, f64), (a, v)| (sum + dot(a, v), size + dot(a, v).abs()))
    };
    let (expected, size) = work(&with_moments, &mut vec![Row::default(); first.len()]);
    let (found, _) = work(&hanging, &mut []);
    assert!((found - expected).abs() <= 1e-14 * size, "{coarse:b}: {found} {expected}");
}

#[test]
fn hanging_nodes_need_no_moments() {
    let mut numbers = Numbers(77);
    for seed in 1..40 {
        hanging_nodes_replace_moments::<2>((512.0 * numbers.next()) as u32, seed);
        // Few and many neighbours, those across a face, and all.
        let (few, many) = ((512.0 * numbers.next()) as u32, (f64::from(1 << 27) * numbers.next()) as u32);
        [few, many, 0x1ff << 18, (1 << 27) - 1]
            .into_iter()
            .for_each(|coarse| hanging_nodes_replace_moments::<3>(coarse, seed));
    }
}
