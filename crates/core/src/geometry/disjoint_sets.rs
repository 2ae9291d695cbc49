//! Sets that only ever grow together (Galler and Fischer 1964).

/// n elements, each in one set, at first on its own.
#[derive(Debug, Clone)]
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// n sets of one element.
    pub fn new(n: usize) -> Self {
        DisjointSets { parent: (0..n as u32).collect() }
    }

    /// The least element of the set of an element.
    pub fn root(&mut self, element: usize) -> usize {
        let mut element = element;
        while self.parent[element] as usize != element {
            self.parent[element] = self.parent[self.parent[element] as usize];
            element = self.parent[element] as usize;
        }
        element
    }

    /// The least elements of the sets of two elements, if they are in two.
    pub fn apart(&mut self, a: usize, b: usize) -> Option<[usize; 2]> {
        // Most of those in one set have one parent: no need to look farther.
        if self.parent[a] == self.parent[b] {
            return None;
        }
        let [a, b] = [self.root(a), self.root(b)];
        (a != b).then_some([a, b])
    }

    /// Whether an element is the least of its set.
    pub fn is_root(&self, element: usize) -> bool {
        self.parent[element] as usize == element
    }

    /// Makes one set of those of two elements. Whether they were two.
    pub fn join(&mut self, a: usize, b: usize) -> bool {
        let (a, b) = (self.root(a), self.root(b));
        self.parent[a.max(b)] = a.min(b) as u32;
        a != b
    }

    /// For each element the number of its set, from 1 in the order of their first elements.
    pub fn numbered(&mut self) -> Vec<u32> {
        let mut count = 0;
        let mut number = vec![0; self.parent.len()];
        for element in 0..number.len() {
            let root = self.root(element);
            if number[root] == 0 {
                count += 1;
                number[root] = count;
            }
            number[element] = number[root];
        }
        number
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_are_numbered_by_their_first_elements() {
        let mut sets = DisjointSets::new(5);
        assert!(sets.join(4, 1) && sets.join(3, 0) && sets.join(0, 2));
        assert!(!sets.join(2, 3));
        assert!(sets.is_root(1) && !sets.is_root(4));
        assert_eq!(sets.numbered(), [1, 2, 1, 1, 2]);
    }
}
