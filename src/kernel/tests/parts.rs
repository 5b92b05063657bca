//! Parts of boxes, moments, box policies, other transfers, bits.
use super::*;

/// A box in 2^D parts gives the sums of the box.
fn parts_equal_the_whole<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let mut whole = particles::<D>(23, 8, 1);
    for k in 0..D {
        // Parts must have their centres in the block too.
        for x in whole.column_mut(Layout::<D>::POSITION + k) {
            *x = CELL * 4.5 + (*x - CELL * 4.0) * 0.75;
        }
    }
    let mut parted = whole.clone();
    let mut half = Vec::new();
    domain::half_widths(&whole, Select::All, CELL, &frame.extent, &scheme, &mut half);
    let mut parts = Vec::new();
    for p in 0..whole.len() {
        let spread = spread(whole.position(p), half[p]);
        for corner in 0..1usize << D {
            let side = |k: usize| if corner >> k & 1 == 1 { 0.5 } else { -0.5 };
            parts.push(SubBox {
                particle: p as u32,
                slot: p as u32,
                centre: std::array::from_fn(|k| whole.position(p)[k] + side(k) * half[p][k]),
                half: half[p].map(|h| 0.5 * h),
                whole: half[p][0],
                softening: [1.0; D],
                fraction: 1.0 / (1 << D) as f64,
                spread,
            });
        }
    }
    let mut arena = vec![Row::default(); arena_nodes(D)];
    let mut other = arena.clone();
    scatter(&whole, Select::All, &frame, &scheme, DT, &mut arena, None, Place::default());
    let mut sums = vec![[0.0; D]; parted.len()];
    spread::of_parts(&parted, &parts, &frame, Coordinates::Cartesian, None, |part, own| {
        let part = &parts[part];
        for k in 0..D {
            sums[part.slot as usize][k] += part.fraction * own[k];
        }
    });
    for (sum, part) in sums.iter().zip(parts.iter().step_by(1 << D)) {
        for k in 0..D {
            assert!((sum[k] - part.spread[k]).abs() < 1e-13 * part.spread[k]);
        }
    }
    let (scratch, arena_of_parts) = (&mut Default::default(), &mut other[..]);
    let mut bin = p2g::Scatter {
        scratch,
        chunk: &parted,
        given: &[],
        frame: &frame,
        scheme: &scheme,
        dt: DT,
        arena: arena_of_parts,
        moments: None,
    };
    bin.sub_boxes(&parts);
    for (a, b) in arena.iter().zip(&other) {
        for i in 0..4 {
            assert!((a.0[i] - b.0[i]).abs() < 1e-14, "{a:?} {b:?}");
        }
    }
    let fields = Fields { velocity: &arena, increment: None, fill: None, moments: None };
    gather(&mut whole, Select::All, &frame, &scheme, DT, &fields, Place::default());
    let mut gathered = vec![Gathered::default(); parted.len()];
    let kernel = &mut Default::default();
    g2p::gather_sub_boxes(kernel, &parted, &parts, &frame, Coordinates::Cartesian, &fields, &mut gathered);
    let list: Vec<u32> = (0..parted.len() as u32).collect();
    g2p::advance_gathered(
        &mut Default::default(),
        &mut parted,
        &list,
        &gathered,
        &g2p::Advance { scheme: &scheme, dt: DT, cell: CELL, dilation: &[], filling: None },
        &frame.extent,
        (&mut Leavers::default(), &mut Booked::default()),
    );
    for column in 0..Layout::<D>::REALS {
        for (a, b) in whole.column(column).iter().zip(parted.column(column)) {
            assert!((a - b).abs() <= 1e-11 * a.abs().max(1.0), "column {column}: {a} {b}");
        }
    }
}

#[test]
fn parts_of_a_box_equal_the_box() {
    parts_equal_the_whole::<2>();
    parts_equal_the_whole::<3>();
}

/// First moments: scattered ones are `Σ w m C`, where second moments enter `C = B D⁻¹`; gathered ones add up
/// in B.
fn moments_follow<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let start = particles::<D>(19, 15, 1);
    let mut half = Vec::new();
    domain::half_widths(&start, Select::All, CELL, &frame.extent, &scheme, &mut half);
    let nodes = arena_nodes(D);
    let listed: Vec<usize> = (0..nodes).filter(|node| node % 3 != 1).rev().collect();
    let columns: Vec<(usize, usize)> =
        listed.iter().flat_map(|&node| (0..D).map(move |axis| (node, axis))).collect();
    let constrained = |second: &[Row]| {
        let second = |node: usize| std::array::from_fn(|axis| second[node].0[axis]);
        let with_moments: Vec<MomentNode<D>> =
            listed.iter().map(|&node| MomentNode { node, second: second(node) }).collect();
        ConstrainedNodes::new(&with_moments, HangingNodes::new::<D>(&vec![false; nodes]))
    };
    let scattered = |second: &[Row]| {
        let constrained = constrained(second);
        let (mut arena, mut sums) = (vec![Row::default(); nodes], vec![Row::default(); columns.len()]);
        let moments = MomentSums { nodes: &constrained, sums: &mut sums };
        scatter(&start, Select::All, &frame, &scheme, DT, &mut arena, Some(moments), Place::default());
        (arena, sums)
    };
    let mut plain = vec![Row::default(); nodes];
    scatter(&start, Select::All, &frame, &scheme, DT, &mut plain, None, Place::default());
    // Second moments of zero change nothing.
    assert_eq!(plain, scattered(&vec![Row::default(); nodes]).0);
    let mut numbers = Numbers(12);
    let second: Vec<Row> =
        (0..nodes).map(|_| Row(std::array::from_fn(|_| CELL * CELL * numbers.next()))).collect();
    let (arena, sums) = scattered(&second);
    let affine: Vec<[[f64; D]; D]> = (0..start.len())
        .map(|p| {
            let mut spread = spread(start.position(p), half[p]);
            for &(node, k) in &columns {
                let (w, _) = definition(position::<D>(node), start.position(p), half[p]);
                spread[k] += w * second[node].0[k];
            }
            let at = |i: usize, k: usize| start.column(Layout::<D>::AFFINE + D * i + k)[p];
            std::array::from_fn(|i| std::array::from_fn(|k| at(i, k) / spread[k]))
        })
        .collect();
    for node in 0..nodes {
        let x_j = position::<D>(node);
        let mut momentum = [0.0; D];
        for i in 0..D {
            let mut expected = [0.0; D];
            for p in 0..start.len() {
                let x = start.position(p);
                let (w, gradient) = definition(x_j, x, half[p]);
                let mass = start.column(Layout::<D>::MASS)[p];
                let volume = (2.0 * start.column(Layout::<D>::HALF)[p]).powi(D as i32);
                momentum[i] += w * mass * start.column(Layout::<D>::VELOCITY + i)[p];
                for k in 0..D {
                    let stress = start.column(Layout::<D>::STRESS + symmetric_index::<D>(i, k))[p];
                    momentum[i] += w * mass * affine[p][i][k] * (x_j[k] - x[k]);
                    momentum[i] -= DT * volume * stress * gradient[k];
                    expected[k] += w * mass * affine[p][i][k];
                }
            }
            assert!((arena[node].0[i] - momentum[i]).abs() < 1e-13);
            for (&(_, k), sum) in columns.iter().zip(&sums).filter(|((at, _), _)| *at == node) {
                assert!((sum.0[i] - expected[k]).abs() < 1e-13 * expected[k].abs().max(1.0));
            }
        }
    }
    let (zero, one) = (vec![Row::default(); columns.len()], vec![Row([0.5; 4]); columns.len()]);
    let constrained = constrained(&vec![Row::default(); nodes]);
    let run = |moments: Option<Moments>| {
        let mut chunk = start.clone();
        let fields = Fields { velocity: &plain, increment: None, fill: None, moments };
        gather(&mut chunk, Select::All, &frame, &scheme, DT, &fields, Place::default());
        chunk
    };
    let without = run(None);
    let with_zero = run(Some(Moments { nodes: &constrained, first: &zero }));
    let with_one = run(Some(Moments { nodes: &constrained, first: &one }));
    for p in 0..start.len() {
        assert_eq!(bits(&without, p), bits(&with_zero, p));
        for k in 0..D {
            let along = columns.iter().filter(|(_, axis)| *axis == k);
            let weight =
                |&(node, _): &(usize, usize)| definition(position::<D>(node), start.position(p), half[p]).0;
            let share: f64 = along.map(weight).sum();
            for column in (0..D).map(|i| Layout::<D>::AFFINE + D * i + k) {
                let (plain, moved) = (without.column(column)[p], with_one.column(column)[p]);
                let expected = plain + 0.5 * share;
                assert!((moved - expected).abs() < 1e-14, "{moved} {expected}");
            }
        }
    }
}

#[test]
fn moments_are_scattered_and_gathered() {
    moments_follow::<2>();
    moments_follow::<3>();
}

/// First and last of this list are as far apart as those of a run of particles.
#[test]
fn lists_come_in_any_order() {
    let materials = materials();
    let (chunk, frame, scheme) = (particles::<3>(40, 6, 3), frame::<3>(), scheme(&materials, Transfer::Apic));
    let (mut all, mut listed) = (Vec::new(), Vec::new());
    domain::half_widths(&chunk, Select::All, CELL, &frame.extent, &scheme, &mut all);
    for list in [[0, 10, 11, 12, 13, 6, 3, 7], [8, 9, 11, 10, 12, 13, 14, 15], [3, 3, 4, 5, 6, 7, 8, 10]] {
        domain::half_widths(&chunk, Select::List(&list), CELL, &frame.extent, &scheme, &mut listed);
        assert_eq!(listed, list.map(|p| all[p as usize]), "{list:?}");
    }
}

#[test]
fn boxes_stay_in_the_domain_and_follow_the_policy() {
    let materials = materials();
    let extent = [4.0 * CELL; 3];
    let mut chunk = particles::<3>(40, 2, 3);
    for k in 0..3 {
        let mut numbers = Numbers(k as u64 + 1);
        for x in chunk.column_mut(Layout::<3>::POSITION + k) {
            *x = 4.0 * CELL * numbers.next();
        }
    }
    chunk.column_mut(Layout::<3>::POSITION)[0] = 0.01 * CELL;
    let mut half = Vec::new();
    for boxes in [BoxPolicy::default(), BoxPolicy::Fixed, BoxPolicy::Cell] {
        let scheme = Scheme::new(boxes, CELL, Transfer::Apic, &materials);
        domain::half_widths(&chunk, Select::All, CELL, &extent, &scheme, &mut half);
        assert_eq!(half[0][0], 0.01 * CELL);
        for p in 0..chunk.len() {
            for k in 0..3 {
                let x = chunk.position(p)[k];
                let room = x.min(extent[k] - x);
                let free = match boxes {
                    BoxPolicy::Fixed => chunk.column(Layout::<3>::HALF)[p],
                    BoxPolicy::Cell => 0.5 * CELL,
                    BoxPolicy::Volume { .. } => {
                        let stretch = chunk.column(Layout::<3>::LEFT_CAUCHY_GREEN + k)[p].sqrt();
                        if p % 3 != 0 {
                            continue;
                        }
                        chunk.column(Layout::<3>::HALF)[p] * stretch
                    }
                };
                assert_eq!(half[p][k], free.min(0.5 * CELL).min(room).max(2f64.powi(-46) * CELL));
            }
        }
    }
}

#[test]
fn flip_and_tpic() {
    let (materials, frame) = (materials(), frame::<3>());
    let start = particles::<3>(11, 31, 1);
    let velocity = vec![Row([1.0, 2.0, 3.0, 0.0]); arena_nodes(3)];
    let increment = vec![Row([0.1, 0.2, 0.3, 0.0]); arena_nodes(3)];
    let fields = Fields { velocity: &velocity, increment: Some(&increment), fill: None, moments: None };
    let mut chunk = start.clone();
    let flip = Transfer::Flip { blend: 0.75 };
    gather(&mut chunk, Select::All, &frame, &scheme(&materials, flip), DT, &fields, Place::default());
    for p in 0..start.len() {
        for i in 0..3 {
            let old = start.column(Layout::<3>::VELOCITY + i)[p];
            let (v, dv) = ([1.0, 2.0, 3.0][i], [0.1, 0.2, 0.3][i]);
            let expected = 0.75 * (old + dv) + 0.25 * v;
            assert!((chunk.column(Layout::<3>::VELOCITY + i)[p] - expected).abs() < 1e-14);
            let gradient = chunk.column(Layout::<3>::AFFINE + 4 * i)[p];
            assert!(gradient.abs() < 1e-9, "splits take it from here");
            assert!((chunk.position(p)[i] - start.position(p)[i] - DT * v).abs() < 1e-15);
        }
    }
    let mut chunk = start.clone();
    gather(
        &mut chunk,
        Select::All,
        &frame,
        &scheme(&materials, Transfer::Tpic),
        DT,
        &fields,
        Place::default(),
    );
    assert!(chunk.column(Layout::<3>::AFFINE).iter().all(|c| c.abs() < 1e-9));
}

/// A checksum of everything that the kernels compute, the same in every build: with and without
/// AVX2, optimised or not.
fn checksum<const D: usize>() -> u64 {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let mut chunk = particles::<D>(203, 99, 5);
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut add = |x: f64| hash = (hash ^ x.to_bits()).wrapping_mul(0x0100_0000_01b3);
    for _ in 0..4 {
        let mut arena = vec![Row::default(); arena_nodes(D)];
        scatter(&chunk, Select::All, &frame, &scheme, DT, &mut arena, None, Place::default());
        for row in &mut arena {
            row.0.iter().for_each(|&x| add(x));
            let inverse = if row.0[3] > 0.0 { 1.0 / row.0[3] } else { 0.0 };
            row.0 = row.0.map(|x| x * inverse);
        }
        let fields = Fields { velocity: &arena, increment: None, fill: None, moments: None };
        add(gather(&mut chunk, Select::All, &frame, &scheme, DT, &fields, Place::default()));
    }
    // History variables that no material here uses stay 0.
    let unused = Layout::<D>::HISTORY + scheme.histories..Layout::<D>::HISTORY + Layout::<D>::HISTORIES;
    for p in 0..chunk.len() {
        for (column, x) in bits(&chunk, p).into_iter().enumerate() {
            if unused.contains(&column) {
                assert_eq!(x, 0);
            } else {
                add(f64::from_bits(x));
            }
        }
    }
    assert!(chunk.column(Layout::<D>::WORK).iter().any(|&work| work > 0.0));
    hash
}

/// Remains of other bins in the kernels' memory change no bit.
#[test]
fn bits_do_not_depend_on_earlier_bins() {
    let (materials, frame) = (materials(), frame::<3>());
    let scheme = scheme(&materials, Transfer::Apic);
    let (start, mut wild) = (particles::<3>(13, 5, 5), particles::<3>(29, 6, 5));
    wild.column_mut(Layout::<3>::VELOCITY).fill(f64::NAN);
    wild.column_mut(Layout::<3>::AFFINE).fill(f64::INFINITY);
    let velocity: Vec<Row> = (0..arena_nodes(3)).map(|i| Row([i as f64, -1.0, 0.5, 0.0])).collect();
    let nowhere = vec![Row([f64::NAN; 4]); arena_nodes(3)];
    let step = |used: bool| {
        let (mut to_nodes, mut to_particles) = (p2g::Scratch::default(), g2p::Scratch::default());
        let mut run = |chunk: &mut Chunk<3>, velocity: &[Row]| {
            let (mut arena, mut leavers) = (vec![Row::default(); arena_nodes(3)], Leavers::default());
            let place = Place::default();
            let (frame, scheme, dt) = (&frame, &scheme, DT);
            let (scratch, rows) = (&mut to_nodes, &mut arena[..]);
            p2g::Scatter { scratch, chunk, given: &[], frame, scheme, dt, arena: rows, moments: None }
                .whole_boxes(Select::All, place);
            let fields = &Fields { velocity, increment: None, fill: None, moments: None };
            let (scratch, leavers) = (&mut to_particles, &mut leavers);
            g2p::Gather {
                scratch,
                chunk,
                frame,
                scheme,
                dt,
                fields,
                leavers,
                dilation: &[],
                filling: None,
                booked: &mut Booked::default(),
                rates: None,
            }
            .whole_boxes(Select::All, place);
            arena
        };
        if used {
            run(&mut wild.clone(), &nowhere);
        }
        let mut chunk = start.clone();
        let arena = run(&mut chunk, &velocity);
        let columns = (0..Layout::<3>::REALS).flat_map(|column| chunk.column(column)).copied();
        columns.chain(arena.into_iter().flat_map(|row| row.0)).map(f64::to_bits).collect::<Vec<_>>()
    };
    assert_eq!(step(false), step(true));
}

#[test]
fn bits_do_not_depend_on_the_build() {
    assert_eq!((checksum::<2>(), checksum::<3>()), (17_238_365_504_754_298_304, 13_982_880_333_681_498_063));
}
