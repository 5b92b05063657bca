//! Particles that leave a box.
use super::*;

/// Those that have left a box are found, whatever the batches.
fn leavers_are_found<const D: usize>() {
    let (materials, frame) = (materials(), frame::<D>());
    let scheme = scheme(&materials, Transfer::Apic);
    let start = particles::<D>(53, 33, 5);
    let velocity = vec![Row([300.0, -200.0, if D == 3 { 100.0 } else { 0.0 }, 0.0]); arena_nodes(D)];
    let fields = Fields { velocity: &velocity, increment: None, fill: None, moments: None };
    let bounds = ([4.5 * CELL; D], [7.5 * CELL; D]);
    let odd: Vec<u32> = (1..53).step_by(2).collect();
    for select in [Select::All, Select::List(&odd), Select::List(&[7, 20]), Select::List(&[])] {
        let (mut chunk, mut leavers) = (start.clone(), Leavers::default());
        leavers.begin(&bounds);
        let (scratch, frame, scheme) = (&mut Default::default(), &frame, &scheme);
        let bin = g2p::Gather {
            scratch,
            chunk: &mut chunk,
            frame,
            scheme,
            dt: DT,
            fields: &fields,
            leavers: &mut leavers,
            dilation: &[],
            filling: None,
            booked: &mut Booked::default(),
            rates: None,
        };
        bin.whole_boxes(select, Place::default());
        let moved: Vec<u32> = match select {
            Select::All => (0..53).collect(),
            Select::List(list) => list.to_vec(),
        };
        let is_inside =
            |p: u32| chunk.position(p as usize).iter().all(|x| (bounds.0[0]..bounds.1[0]).contains(x));
        let expected: Vec<u32> = moved.iter().copied().filter(|&p| !is_inside(p)).collect();
        assert_eq!(leavers.found, expected);
        assert!(moved.len() < 50 || (5..45).contains(&expected.len()), "{}", expected.len());
    }
}

#[test]
fn particles_that_leave_are_found() {
    leavers_are_found::<2>();
    leavers_are_found::<3>();
}
