//! Sorting by counting.

/// Items by number, those of one number in the order given.
pub(super) struct Numbered<T> {
    items: Vec<T>,
    start: Vec<usize>,
}

impl<T: Copy> Numbered<T> {
    /// Items with numbers below `numbers`.
    pub fn new(given: &[(u32, T)], numbers: usize) -> Self {
        let mut start = vec![0; numbers + 1];
        given.iter().for_each(|(number, _)| start[*number as usize + 1] += 1);
        (0..numbers).for_each(|number| start[number + 1] += start[number]);
        let mut next = start.clone();
        let mut items = given.first().map_or_else(Vec::new, |(_, any)| vec![*any; given.len()]);
        for &(number, item) in given {
            items[next[number as usize]] = item;
            next[number as usize] += 1;
        }
        Self { items, start }
    }

    /// Those of each number, which may be none.
    pub fn each(&mut self) -> impl Iterator<Item = &mut [T]> {
        let mut rest = &mut self.items[..];
        self.start.windows(2).map(move |range| rest.split_off_mut(..range[1] - range[0]).unwrap_or_default())
    }

    /// All, number by number.
    pub fn into_items(self) -> Vec<T> {
        self.items
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keeps_the_order_within_a_number() {
        let mut numbered = Numbered::new(&[(2, 'a'), (0, 'b'), (2, 'c'), (3, 'd'), (0, 'e')], 5);
        let each: Vec<String> = numbered.each().map(|items| items.iter().collect()).collect();
        assert_eq!(each, ["be", "", "ac", "d", ""]);
        assert_eq!(numbered.into_items(), ['b', 'e', 'a', 'c', 'd']);
        assert!(Numbered::<u8>::new(&[], 0).into_items().is_empty());
    }
}
