//! Scenarios of the communication layer.

use std::time::Duration;

use partition::{Comm, NeighbourExchange};

use crate::random::{Random, hash};

pub(crate) fn reductions(comm: &Comm) {
    let (rank, size) = (comm.rank() as u64, comm.size() as u64);
    assert_eq!(comm.min_f64(rank as f64 - 1.5), -1.5);
    assert_eq!(comm.max_f64(rank as f64 - 1.5), size as f64 - 2.5);
    assert!(comm.max_f64(if rank == size - 1 { f64::NAN } else { 1.0 }).is_nan());
    assert!(comm.min_f64(if rank == 0 { f64::NAN } else { 1.0 }).is_nan());
    assert_eq!(comm.max_f64(if rank == 0 { 0.0 } else { -0.0 }).to_bits(), 0f64.to_bits());
    assert_eq!(comm.min_f64(if rank == 0 { -0.0 } else { 0.0 }).to_bits(), (-0f64).to_bits());
    assert_eq!(comm.min_f64(f64::INFINITY), f64::INFINITY);
    let mut pair = [rank as f64, -(rank as f64)];
    comm.min_f64s(&mut pair);
    assert_eq!(pair, [0.0, 1.0 - size as f64]);
    comm.max_f64s(&mut []);

    let large = u64::MAX / size;
    let mut sums = [rank, large, 1 << 32];
    comm.sum_u64(&mut sums);
    assert_eq!(sums, [size * (size - 1) / 2, large * size, size << 32]);
    let small = i64::MIN / size as i64;
    let mut sums = [-(rank as i64), small, if rank == 0 { i64::MAX } else { -1 }];
    comm.sum_i64(&mut sums);
    assert_eq!(sums, [-((size * (size - 1) / 2) as i64), small * size as i64, i64::MAX - size as i64 + 1]);
    assert_eq!(comm.wrapping_sum_u64(u64::MAX), 0u64.wrapping_sub(size));
    let mut extremes = [rank, 7];
    comm.max_u64(&mut extremes);
    assert_eq!(extremes, [size - 1, 7]);
    extremes = [rank + 3, 7];
    comm.min_u64(&mut extremes);
    assert_eq!(extremes, [3, 7]);

    assert!(comm.any(rank == size - 1));
    assert!(!comm.any(false));
    assert_eq!(comm.exclusive_sum_u64(rank + 1), rank * (rank + 1) / 2);
    let expected: Vec<u64> = (0..size).flat_map(|r| [r, r * r]).collect();
    assert_eq!(comm.all_gather_u64(&[rank, rank * rank]), expected);
    comm.barrier();

    for largest in [3, 1 << 30] {
        comm.set_largest_message(largest);
        for root in 0..comm.size() {
            let mut bytes = vec![comm.rank() as u8; comm.rank() * 7];
            comm.broadcast_bytes(root, &mut bytes);
            assert_eq!(bytes, vec![root as u8; root * 7]);
        }
        let gathered = comm.gather_bytes(&vec![comm.rank() as u8; comm.rank() * 5]);
        let expected: Vec<Vec<u8>> = (0..comm.size()).map(|r| vec![r as u8; r * 5]).collect();
        assert_eq!(gathered, (rank == 0).then_some(expected));
    }
}

pub(crate) fn agree(comm: &Comm) {
    let (rank, size) = (comm.rank(), comm.size());
    assert_eq!(comm.agree::<_, String>(Ok(rank)).expect("all agree"), rank);
    for failing in 0..size {
        // All ranks from `failing` on fail; the message of the lowest one is reported.
        let result = if rank >= failing { Err(format!("mishap {rank}")) } else { Ok(()) };
        let error = comm.agree(result).expect_err("some rank failed");
        assert_eq!((error.rank, error.failed), (failing, size - failing));
        assert_eq!(error.to_string(), format!("rank {failing}: mishap {failing}"));
    }
}

/// Random patterns, many rounds without a barrier between them, with ranks held up at random.
pub(crate) fn sparse(comm: &Comm) {
    let (rank, size) = (comm.rank(), comm.size());
    // Messages of `from` in this round, as every rank can know.
    let messages = |round: u64, from: usize| {
        let mut random = Random::new(hash(round, from as u64));
        let count = random.below(2 * size as u64 + 1);
        let mut message = || {
            let to = random.below(size as u64) as usize;
            let len = if random.one_in(3) { 0 } else { random.below(50) };
            (to, (0..len).map(|_| random.next()).collect::<Vec<u64>>())
        };
        (0..count).map(|_| message()).collect::<Vec<_>>()
    };
    for round in 0..120 {
        if round % 40 == 0 {
            comm.barrier();
            comm.set_largest_message([1 << 30, 16, 7][round as usize / 40]);
        }
        if hash(round, 1000 + rank as u64).is_multiple_of(16) {
            std::thread::sleep(Duration::from_millis(2));
        }
        let expected: Vec<(usize, Vec<u64>)> = (0..size)
            .flat_map(|from| messages(round, from).into_iter().map(move |(to, m)| (from, to, m)))
            .filter(|&(_, to, _)| to == rank)
            .map(|(from, _, message)| (from, message))
            .collect();
        assert_eq!(comm.sparse_exchange(messages(round, rank)), expected, "round {round}");
    }
    comm.set_largest_message(1 << 30);
    // Large enough that it cannot be sent before it is received.
    let next = (rank + 1) % size;
    let received = comm.sparse_exchange(vec![(next, vec![rank as u32; 3_000_000])]);
    let previous = (rank + size - 1) % size;
    assert_eq!(received, vec![(previous, vec![previous as u32; 3_000_000])]);
    assert_eq!(comm.sparse_exchange::<[f64; 3]>(vec![]), vec![]);
}

pub(crate) fn neighbours(comm: &Comm) {
    let (rank, size) = (comm.rank(), comm.size());
    let mut ring = vec![(rank + 1) % size, (rank + size - 1) % size, rank];
    ring.sort_unstable();
    ring.dedup();
    let mut exchange = NeighbourExchange::new(comm, ring.clone(), 0);
    let mut other = NeighbourExchange::new(comm, ring.clone(), 1);
    assert!(exchange.is_valid());
    assert_eq!(exchange.neighbours(), ring);
    let message = |round: u64, from: usize, to: usize| {
        let mut random = Random::new(hash(round, (from * size + to) as u64));
        let long = if round % 1000 < 30 { 300_000 } else { 3_000 }; // the latter in many pieces
        let len = if random.one_in(30) { long } else { random.below(40) };
        (0..len).map(|_| random.next() as u8).collect::<Vec<u8>>()
    };
    let outgoing = |round| ring.iter().map(|&to| message(round, rank, to)).collect::<Vec<_>>();
    let expected = |round| ring.iter().map(|&from| message(round, from, rank)).collect::<Vec<_>>();
    let mut bytes = 0;
    for round in 0..60 {
        if round % 30 == 0 {
            comm.barrier();
            comm.set_largest_message([1 << 30, 10][round as usize / 30]);
        }
        if hash(round, rank as u64).is_multiple_of(8) {
            std::thread::sleep(Duration::from_millis(2));
        }
        bytes += outgoing(round).iter().map(Vec::len).sum::<usize>();
        let mut pending = exchange.begin(outgoing(round));
        // Two exchanges under way, finished in the other order; collective calls in between.
        let second = other.begin(outgoing(round + 1000));
        if round % 7 == 0 {
            comm.max_f64(1.0);
        }
        pending.progress();
        assert_eq!(second.finish(), expected(round + 1000), "round {round}");
        if round % 5 == 0 {
            drop(pending); // what arrived is lost, but the next round is not disturbed
        } else {
            assert_eq!(pending.finish(), expected(round), "round {round}");
        }
    }
    assert_eq!(
        (exchange.traffic().messages, exchange.traffic().bytes),
        (60 * ring.len() as u64, bytes as u64)
    );
    comm.barrier();
    comm.set_largest_message(1 << 30);

    let mut nobody = NeighbourExchange::new(comm, vec![], 2);
    assert!(nobody.begin(vec![]).finish().is_empty());
    let lopsided = if rank == 0 { vec![size - 1] } else { vec![] };
    assert_eq!(NeighbourExchange::new(comm, lopsided, 3).is_valid(), size == 1);
}

pub(crate) fn panic_in_a_step(comm: &Comm) {
    comm.begin_step(17);
    panic_on_last(comm);
}

/// On all ranks, on two threads each.
pub(crate) fn panic_everywhere(_: &Comm) {
    let threads = [(); 2].map(|()| std::thread::spawn(|| panic!("deliberate")));
    threads.into_iter().for_each(|thread| drop(thread.join()));
    std::thread::sleep(Duration::from_secs(20));
}

pub(crate) fn panic_on_last(comm: &Comm) {
    if comm.rank() == comm.size() - 1 {
        panic!("deliberate");
    }
    comm.barrier();
}
