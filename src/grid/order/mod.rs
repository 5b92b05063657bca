//! The order in which a node adds up its contributions.
//!
//! Each contribution has a Morton key, and the sum follows the binary tree of these keys: the keys fall into
//! those with and without the highest bit in which any of them differ, the sums of both halves come first,
//! and so on down to single keys. As a rank owns a segment of the curve, its contributions to a node fill few
//! whole subtrees, mostly one, and a neighbour needs only their sums.
//!
//! An absent contribution counts as zero. Adding a zero changes no other number, so it may be added or
//! skipped, but for the sign of a zero sum; sums therefore end with `+ 0.0`.
pub mod region;

/// Where a contribution comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Origin {
    /// An own bin at a position around the block.
    Bin { bin: u32, position: u8 },
    /// A subtree's sum from another rank.
    Piece(u32),
}

/// A contribution to the nodes of a region.
#[derive(Clone, Copy, Debug)]
pub(super) struct Term {
    /// Key; a subtree has one of the keys in it.
    pub key: u64,
    /// Order among those with equal keys.
    pub tie: u64,
    /// See [`separation`], from the term before.
    pub separation: u32,
    /// Nodes of the block that it touches.
    pub touched: u64,
    pub origin: Origin,
}

/// Height in the tree at which two keys part: the number of bits up to the highest that differs.
pub(super) fn separation(a: u64, b: u64) -> u32 {
    u64::BITS - (a ^ b).leading_zeros()
}

/// Sorts terms and computes their separations.
pub(super) fn arrange(terms: &mut [Term]) {
    terms.sort_unstable_by_key(|term| (term.key, term.tie));
    for i in 1..terms.len() {
        terms[i].separation = separation(terms[i - 1].key, terms[i].key);
    }
}

/// The sum of all terms along the tree; `None` if there are none. `stack` is scratch memory.
pub(super) fn fold<T>(
    terms: &[Term],
    stack: &mut Vec<(u32, T)>,
    mut load: impl FnMut(&Term) -> T,
    add: impl Fn(&mut T, &T),
) -> Option<T> {
    stack.clear();
    for (i, term) in terms.iter().enumerate() {
        if i > 0 {
            // Subtrees that end here are complete.
            merge(stack, term.separation, &add);
        }
        stack.push((if i == 0 { u32::MAX } else { term.separation }, load(term)));
    }
    merge(stack, u32::MAX - 1, &add);
    stack.pop().map(|(_, sum)| sum)
}

/// Adds the top of the stack to the entries below, down to the first that parts higher than `separation`.
fn merge<T>(stack: &mut Vec<(u32, T)>, separation: u32, add: &impl Fn(&mut T, &T)) {
    while stack.last().is_some_and(|(last, _)| *last <= separation) {
        if let Some((_, sum)) = stack.pop()
            && let Some((_, below)) = stack.last_mut()
        {
            add(below, &sum);
        }
    }
}

/// Calls `each` for the largest subtrees whose keys all have one owner. `keys` are sorted; equal ones have
/// one owner.
pub(super) fn each_subtree<T>(
    terms: &[T],
    key: &impl Fn(&T) -> u64,
    owner: &impl Fn(&T) -> usize,
    each: &mut impl FnMut(&[T]),
) {
    let [first, .., last] = terms else {
        if !terms.is_empty() {
            each(terms);
        }
        return;
    };
    let height = separation(key(first), key(last));
    if height == 0 || terms.iter().all(|term| owner(term) == owner(first)) {
        return each(terms);
    }
    let upper = key(last) >> (height - 1);
    let (low, high) = terms.split_at(terms.partition_point(|term| key(term) >> (height - 1) < upper));
    each_subtree(low, key, owner, each);
    each_subtree(high, key, owner, each);
}

#[cfg(test)]
mod tests {
    use super::*;

    fn terms(keys: &[u64]) -> Vec<Term> {
        let term = |&key| Term { key, tie: 0, separation: 0, touched: 0, origin: Origin::Piece(0) };
        let mut terms: Vec<Term> = keys.iter().map(term).collect();
        arrange(&mut terms);
        terms
    }

    fn shape(keys: &[u64]) -> String {
        let add = |a: &mut String, b: &String| *a = format!("({a}{b})");
        fold(&terms(keys), &mut Vec::new(), |term| format!("{:x}", term.key), add).unwrap_or_default()
    }

    #[test]
    fn sums_follow_the_tree() {
        assert_eq!(shape(&[]), "");
        assert_eq!(shape(&[5]), "5");
        assert_eq!(shape(&[0, 1, 2, 3, 4, 5, 6, 7]), "(((01)(23))((45)(67)))");
        assert_eq!(shape(&[1, 2, 3, 7]), "((1(23))7)");
        assert_eq!(shape(&[0, 4, 5, 8, 9]), "((0(45))(89))");
        // Equal keys one after the other.
        assert_eq!(shape(&[1, 1, 1, 2]), "(((11)1)2)");
    }

    /// A rank that gets the keys from one to another as one sum builds the same tree.
    #[test]
    fn subtrees_of_owners() {
        let keys: [u64; 8] = [0, 1, 2, 4, 5, 6, 12, 13];
        for cut in 0..=keys.len() {
            let mut found: Vec<Vec<u64>> = Vec::new();
            let owner = |key: &u64| usize::from(*key >= keys.get(cut).copied().unwrap_or(u64::MAX));
            each_subtree(&keys, &|key| *key, &owner, &mut |subtree| found.push(subtree.to_vec()));
            assert_eq!(found.concat(), keys);
            let mut parts: Vec<(u64, String)> = found.iter().map(|keys| (keys[0], shape(keys))).collect();
            let add = |a: &mut String, b: &String| *a = format!("({a}{b})");
            let load = |term: &Term| {
                let part = parts.iter_mut().find(|(key, _)| *key == term.key);
                part.map(|(_, shape)| std::mem::take(shape)).unwrap_or_default()
            };
            let firsts: Vec<u64> = found.iter().map(|keys| keys[0]).collect();
            assert_eq!(fold(&terms(&firsts), &mut Vec::new(), load, add), Some(shape(&keys)));
        }
    }
}
