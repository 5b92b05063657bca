//! Compressed sparse rows: items by group, made by a counting sort.

/// Items by group; those of one group are in the order in which they were given.
#[derive(Clone, Debug)]
pub struct Csr<T> {
    /// Start of each group, and the end.
    start: Vec<u32>,
    items: Vec<T>,
}

impl<T> Default for Csr<T> {
    fn default() -> Self {
        Self { start: Vec::new(), items: Vec::new() }
    }
}

impl<T: Copy> Csr<T> {
    /// Sorts items into groups with numbers below `groups`.
    pub fn new(groups: usize, given: impl Iterator<Item = (u32, T)> + Clone) -> Self {
        let mut csr = Self::default();
        csr.fill(groups, given);
        csr
    }

    /// As [`Csr::new`], in the memory of this one.
    pub fn fill(&mut self, groups: usize, given: impl Iterator<Item = (u32, T)> + Clone) {
        let Self { start, items } = self;
        starts(start, groups, given.clone().map(|(group, _)| group as usize));
        items.clear();
        if let Some((_, any)) = given.clone().next() {
            items.resize(start[groups] as usize, any);
        }
        for (group, item) in given {
            // Starts serve as places until all are filled.
            let place = &mut start[group as usize];
            items[*place as usize] = item;
            *place += 1;
        }
        start.rotate_right(1);
        start[0] = 0;
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.start.len().saturating_sub(1)
    }

    /// The items of a group.
    #[inline]
    pub fn of(&self, group: usize) -> &[T] {
        &self.items[self.start[group] as usize..self.start[group + 1] as usize]
    }

    /// The items of each group, mutable.
    pub fn each_mut(&mut self) -> impl Iterator<Item = &mut [T]> {
        let mut rest = &mut self.items[..];
        let lengths = self.start.windows(2).map(|range| (range[1] - range[0]) as usize);
        lengths.map(move |len| rest.split_off_mut(..len).unwrap_or_default())
    }

    /// All items, group by group.
    pub fn items(&self) -> &[T] {
        &self.items
    }

    /// Heap bytes held.
    pub fn heap_bytes(&self) -> usize {
        4 * self.start.capacity() + self.items.capacity() * size_of::<T>()
    }
}

/// Counts members of groups: the start of each group in a list of all members by group, and the end.
pub fn starts(start: &mut Vec<u32>, groups: usize, members: impl Iterator<Item = usize>) {
    start.clear();
    start.resize(groups + 1, 0);
    members.for_each(|group| start[group + 1] += 1);
    (0..groups).for_each(|group| start[group + 1] += start[group]);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_order_within_a_group() {
        let mut csr = Csr::new(5, [(2, 'a'), (0, 'b'), (2, 'c'), (3, 'd'), (0, 'e')].into_iter());
        for _ in 0..2 {
            let groups: Vec<String> = (0..csr.groups()).map(|group| csr.of(group).iter().collect()).collect();
            assert_eq!(groups, ["be", "", "ac", "d", ""]);
            assert!(csr.each_mut().map(|items| items.len()).eq([2, 0, 2, 1, 0]));
            assert_eq!(csr.items(), ['b', 'e', 'a', 'c', 'd']);
            // In the memory of other groups.
            csr.fill(1, [(0, 'x')].into_iter());
            assert_eq!((csr.groups(), csr.of(0)), (1, &['x'][..]));
            csr.fill(5, [(3, 'd'), (0, 'b'), (2, 'a'), (0, 'e'), (2, 'c')].into_iter());
        }
        csr.fill(3, std::iter::empty());
        assert!((0..3).all(|group| csr.of(group).is_empty()) && csr.items().is_empty());
    }
}
