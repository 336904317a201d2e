//! Disjoint sets (union-find) with path halving; the smallest member stands for its set, so that
//! the result does not depend on the order of the unions.

/// A partition of `0..n`.
#[derive(Clone, Debug)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Every member alone.
    ///
    /// # Panics
    /// When `n` does not fit into u32.
    pub fn new(n: usize) -> Self {
        let n = u32::try_from(n).expect("members are numbered by u32");
        Self { parent: (0..n).collect() }
    }

    /// The smallest member of the set of `i`.
    pub fn root(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Makes one set of the sets of `a` and `b`.
    pub fn join(&mut self, a: u32, b: u32) {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b) as usize] = a.min(b);
    }

    /// The smallest member of every set, by member.
    pub fn labels(mut self) -> Vec<u32> {
        (0..self.parent.len() as u32).map(|i| self.root(i)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_named_after_their_smallest_member_whatever_the_order() {
        for edges in [[(5, 3), (3, 1), (4, 2)], [(3, 1), (4, 2), (1, 5)]] {
            let mut sets = DisjointSets::new(6);
            edges.iter().for_each(|&(a, b)| sets.join(a, b));
            assert_eq!(sets.labels(), [0, 1, 2, 1, 2, 1]);
        }
    }

    #[test]
    fn nothing_has_no_sets() {
        assert!(DisjointSets::new(0).labels().is_empty());
    }
}
