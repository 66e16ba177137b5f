//! A tree of boxes along the axes: which of many boxes meet another one.
//!
//! Halves by the median of the centres, along the longest side. Built in O(n log^2 n), asked in O(log n) for each box found
//! where boxes are of like size.

/// The lowest and the highest corner; closed.
pub type Box3 = [[f64; 3]; 2];

/// Boxes a leaf holds at most.
const LEAF: usize = 4;

/// Boxes around boxes.
pub struct BoxTree<'a> {
    boxes: &'a [Box3],
    /// Numbers of the boxes, leaf by leaf.
    order: Vec<u32>,
    /// Node by node, parents first; the left half of a node follows it.
    nodes: Vec<Node>,
}

struct Node {
    hull: Box3,
    /// Node of the right half; 0 of a leaf.
    right: u32,
    /// What it holds, as a range of `order`.
    range: [u32; 2],
}

impl<'a> BoxTree<'a> {
    /// Of at most 2^32 boxes.
    pub fn new(boxes: &'a [Box3]) -> Self {
        let mut order: Vec<u32> = (0..boxes.len() as u32).collect();
        let mut nodes = Vec::new();
        if !boxes.is_empty() {
            build(boxes, &mut order, 0, &mut nodes);
        }
        Self { boxes, order, nodes }
    }

    /// Up to eight boxes around all of them.
    pub fn hulls(&self) -> Vec<Box3> {
        let (mut hulls, mut open) = (Vec::new(), Vec::new());
        open.extend((!self.nodes.is_empty()).then_some((0, 3)));
        while let Some((at, depth)) = open.pop() {
            let node: &Node = &self.nodes[at as usize];
            match (node.right, depth) {
                (0, _) | (_, 0) => hulls.push(node.hull),
                (right, _) => open.extend([(at + 1, depth - 1), (right, depth - 1)]),
            }
        }
        hulls
    }

    /// Gives the number of every box that has a point in common with this one.
    pub fn meeting(&self, asked: &Box3, mut give: impl FnMut(u32)) {
        let mut open = Vec::with_capacity(64);
        open.extend((!self.nodes.is_empty()).then_some(0));
        while let Some(at) = open.pop() {
            let node = &self.nodes[at as usize];
            if !meet(&node.hull, asked) {
                continue;
            }
            if node.right > 0 {
                open.extend([node.right, at + 1]);
                continue;
            }
            let [first, end] = node.range.map(|k| k as usize);
            self.order[first..end].iter().filter(|&&k| meet(&self.boxes[k as usize], asked)).for_each(|&k| give(k));
        }
    }

    /// Gives the numbers of every two boxes that have a point in common, once.
    pub fn pairs(&self, mut give: impl FnMut(u32, u32)) {
        let mut open = Vec::with_capacity(64);
        for leaf in self.nodes.iter().filter(|node| node.right == 0) {
            let [first, end] = leaf.range.map(|k| k as usize);
            open.push(0);
            while let Some(at) = open.pop() {
                // What lies before this leaf has met it.
                let node: &Node = &self.nodes[at as usize];
                if node.range[1] <= leaf.range[0] || !meet(&node.hull, &leaf.hull) {
                    continue;
                }
                if node.right > 0 {
                    open.extend([node.right, at + 1]);
                    continue;
                }
                for one in first..end {
                    let others = (node.range[0] as usize).max(one + 1)..node.range[1] as usize;
                    for (a, b) in self.order[others].iter().map(|&other| (self.order[one], other)) {
                        if meet(&self.boxes[a as usize], &self.boxes[b as usize]) {
                            give(a.min(b), a.max(b));
                        }
                    }
                }
            }
        }
    }
}

/// Whether two boxes have a point in common.
pub fn meet([a_low, a_high]: &Box3, [b_low, b_high]: &Box3) -> bool {
    (0..3).all(|i| a_low[i] <= b_high[i] && b_low[i] <= a_high[i])
}

/// The smallest box around points.
pub fn around<'a>(points: impl IntoIterator<Item = &'a [f64; 3]>) -> Box3 {
    points.into_iter().fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], x| {
        [std::array::from_fn(|i| low[i].min(x[i])), std::array::from_fn(|i| high[i].max(x[i]))]
    })
}

fn build(boxes: &[Box3], order: &mut [u32], first: u32, nodes: &mut Vec<Node>) {
    let hull = around(order.iter().flat_map(|&k| &boxes[k as usize]));
    let at = nodes.len();
    nodes.push(Node { hull, right: 0, range: [first, first + order.len() as u32] });
    if order.len() <= LEAF {
        return;
    }
    let side = |i: &usize| hull[1][*i] - hull[0][*i];
    let axis = (0..3).max_by(|a, b| side(a).total_cmp(&side(b))).expect("there are three axes");
    let place = |k: u32| boxes[k as usize][0][axis] + boxes[k as usize][1][axis];
    let middle = order.len() / 2;
    order.select_nth_unstable_by(middle, |&a, &b| place(a).total_cmp(&place(b)).then(a.cmp(&b)));
    let (left, right) = order.split_at_mut(middle);
    build(boxes, left, first, nodes);
    nodes[at].right = nodes.len() as u32;
    build(boxes, right, first + middle as u32, nodes);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn finds_what_comparing_all_pairs_finds() {
        let mut random = Random::new(3);
        let mut some = |count: usize, size: f64| -> Vec<Box3> {
            let one = |_| {
                let [at, end]: [[f64; 3]; 2] = [random.vector(1.0), random.vector(size)];
                around(&[at, std::array::from_fn(|i| at[i] + end[i])])
            };
            (0..count).map(one).collect()
        };
        let (boxes, asked) = ([some(300, 0.6), some(10, 2.0)].concat(), some(40, 0.3));
        let tree = BoxTree::new(&boxes);
        let mut found = Vec::new();
        tree.pairs(|a, b| found.push((a, b)));
        found.sort_unstable();
        let all = (0..boxes.len() as u32).flat_map(|b| (0..b).map(move |a| (a, b)));
        let mut expected: Vec<_> = all.filter(|&(a, b)| meet(&boxes[a as usize], &boxes[b as usize])).collect();
        expected.sort_unstable();
        assert_eq!(found, expected);
        let mut pairs = 0;
        for asked in &asked {
            let mut found = Vec::new();
            tree.meeting(asked, |k| found.push(k));
            found.sort_unstable();
            let expected: Vec<u32> = (0..boxes.len() as u32).filter(|&k| meet(&boxes[k as usize], asked)).collect();
            assert_eq!(found, expected);
            pairs += found.len();
        }
        assert!(pairs > 80, "{pairs}");
        BoxTree::new(&[]).meeting(&asked[0], |_| panic!("there is none"));
    }
}
