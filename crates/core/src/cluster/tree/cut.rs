//! The best cut of a tree: disjoint nodes whose gains add up to most, by dynamic programming (Hu,
//! Held and Ramanan, "Learning to Optimally Segment Point Clouds", 2020).

use super::nodes::Node;

/// The best cut.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Cut {
    /// Nodes that are chosen, ascending.
    pub chosen: Vec<u32>,
    /// The most that disjoint nodes within each node add up to, the node itself among them.
    pub best: Vec<f64>,
}

/// The best cut, given what each node is worth. Of a node and its parts that are worth the same the
/// node is chosen; nodes that are worth nothing are not. Time O(nodes).
pub fn cut(nodes: &[Node], gain: &[f64]) -> Cut {
    let mut best: Vec<f64> = Vec::with_capacity(nodes.len());
    for (node, &gain) in nodes.iter().zip(gain) {
        best.push(gain.max(of_parts(node, &best)));
    }
    let mut is_open = vec![true; nodes.len()];
    let mut chosen = Vec::new();
    for (number, node) in nodes.iter().enumerate().rev() {
        let is_chosen = is_open[number] && gain[number] > 0.0 && gain[number] >= best[number];
        if is_chosen {
            chosen.push(number as u32);
        }
        for &child in node.children.iter().flatten() {
            is_open[child as usize] = is_open[number] && !is_chosen;
        }
    }
    chosen.reverse();
    Cut { chosen, best }
}

/// The most that the parts of a node add up to.
pub fn of_parts(node: &Node, best: &[f64]) -> f64 {
    node.children.iter().flatten().fold(0.0, |sum, &child| sum + best[child as usize])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 0 and 1 become 2; 2 and 3 become 4.
    fn nodes() -> Vec<Node> {
        let node = |parent: Option<u32>, children: Option<[u32; 2]>| Node {
            start: 0,
            len: 5,
            birth: 0.1,
            death: 0.2,
            parent,
            children,
        };
        vec![
            node(Some(2), None),
            node(Some(2), None),
            node(Some(4), Some([0, 1])),
            node(Some(4), None),
            node(None, Some([2, 3])),
        ]
    }

    #[test]
    fn the_sum_decides_and_ties_keep_the_whole() {
        let chosen = |gain: [f64; 5]| cut(&nodes(), &gain).chosen;
        assert_eq!(chosen([0.3, 0.3, 0.5, 0.2, 0.1]), [0, 1, 3]);
        assert_eq!(chosen([0.3, 0.3, 0.6, 0.2, 0.1]), [2, 3]);
        assert_eq!(chosen([0.3, 0.3, 0.6, 0.2, 0.9]), [4]);
        assert_eq!(chosen([0.0, 0.3, 0.0, 0.0, 0.0]), [1]);
        assert_eq!(cut(&nodes(), &[0.0; 5]), Cut { chosen: vec![], best: vec![0.0; 5] });
    }

    proptest::proptest! {
        /// Against every way to choose disjoint nodes.
        #[test]
        fn no_other_choice_is_worth_more(gain in proptest::array::uniform5(0..9_u8)) {
            let gain = gain.map(f64::from);
            let nodes = nodes();
            let tree = super::super::nodes::Tree { nodes: nodes.clone(), pixels: Vec::new() };
            let is_disjoint = |chosen: &[u32]| {
                let has_none_above =
                    |&node: &u32| tree.path(node).skip(1).all(|above| !chosen.contains(&above));
                chosen.iter().all(has_none_above)
            };
            let worth =
                |chosen: &[u32]| chosen.iter().map(|&node| gain[node as usize]).sum::<f64>();
            let subset = |set: u32| (0..5).filter(|i| set >> i & 1 == 1).collect::<Vec<u32>>();
            let subsets = (0..32).map(subset).filter(|chosen| is_disjoint(chosen));
            let most = subsets.map(|chosen| worth(&chosen)).fold(0.0, f64::max);
            let found = cut(&nodes, &gain);
            assert!(is_disjoint(&found.chosen));
            assert_eq!(worth(&found.chosen), most);
        }
    }
}
