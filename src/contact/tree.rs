//! A tree of balls around triangles: which of them may meet a line.

use crate::vector::{difference, dot};

/// Triangles a leaf holds at most.
const LEAF: usize = 4;

/// Balls around balls around triangles.
pub struct BallTree {
    /// Triangles and the balls around each, leaf by leaf.
    order: Vec<(usize, Ball)>,
    root: Option<Node>,
}

#[derive(Clone, Copy)]
struct Ball {
    centre: [f64; 3],
    radius: f64,
}

struct Node {
    ball: Ball,
    /// Half the edges of the box around the balls of its triangles.
    half: [f64; 3],
    content: Content,
}

enum Content {
    Halves(Box<[Node; 2]>),
    Leaf(std::ops::Range<usize>),
}

impl BallTree {
    /// Of triangles by their corners.
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        let root = (!order.is_empty()).then(|| build(triangles, &mut order, 0));
        let order = order.into_iter().map(|t| (t, around(&[triangles[t]]).0)).collect();
        Self { order, root }
    }

    /// Triangles whose balls come closer than `distance` to the endless line through `point` along the unit vector
    /// `direction`, ascending: all that do so themselves, and the same whatever other triangles there are.
    pub fn along(&self, point: [f64; 3], direction: [f64; 3], distance: f64) -> Vec<usize> {
        let is_near = |Ball { centre, radius }: &Ball| {
            let arm = difference(*centre, point);
            let along = dot(arm, direction);
            let beside: [f64; 3] = std::array::from_fn(|a| arm[a] - along * direction[a]);
            dot(beside, beside) <= (radius + distance).powi(2)
        };
        let mut found = Vec::new();
        let mut open: Vec<&Node> = self.root.iter().collect();
        while let Some(Node { ball, content, .. }) = open.pop() {
            match content {
                _ if !is_near(ball) => {}
                Content::Halves(halves) => open.extend(halves.iter()),
                Content::Leaf(range) => {
                    found.extend(self.order[range.clone()].iter().filter(|(_, ball)| is_near(ball)).map(|(t, _)| *t));
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// Boxes around the balls of all triangles, at most `most`: least and largest coordinates.
    pub fn boxes(&self, most: usize) -> Vec<[[f64; 3]; 2]> {
        let mut nodes: Vec<&Node> = self.root.iter().collect();
        // The largest falls in two.
        let radius = |node: &&Node| if matches!(node.content, Content::Leaf(_)) { 0.0 } else { node.ball.radius };
        while nodes.len() < most {
            let Some(largest) = (0..nodes.len()).max_by(|&a, &b| radius(&nodes[a]).total_cmp(&radius(&nodes[b])))
            else {
                break;
            };
            let Content::Halves(halves) = &nodes[largest].content else { break };
            nodes[largest] = &halves[0];
            nodes.push(&halves[1]);
        }
        let corner = |node: &Node, sign: f64| std::array::from_fn(|a| node.ball.centre[a] + sign * node.half[a]);
        nodes.into_iter().map(|node| [corner(node, -1.0), corner(node, 1.0)]).collect()
    }
}

/// The ball around the box around some triangles, and half the edges of the box.
fn around(triangles: &[[[f64; 3]; 3]]) -> (Ball, [f64; 3]) {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in triangles.iter().flatten() {
        for a in 0..3 {
            low[a] = low[a].min(corner[a]);
            high[a] = high[a].max(corner[a]);
        }
    }
    let centre = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
    let half: [f64; 3] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
    // Round-off in the centre must not lose a triangle.
    let slack = 1e-12 * dot(centre, centre).sqrt();
    (Ball { centre, radius: (1.0 + 1e-12) * dot(half, half).sqrt() + slack }, half.map(|half| half + slack))
}

/// The ball of some triangles, which are brought into the order of its leaves; these begin at `first`.
fn build(triangles: &[[[f64; 3]; 3]], order: &mut [usize], first: usize) -> Node {
    let own: Vec<[[f64; 3]; 3]> = order.iter().map(|&t| triangles[t]).collect();
    let (Ball { centre, .. }, half) = around(&own);
    // What is near a triangle's ball is near those that it is in.
    let (mut radius, mut around_balls) = (0.0_f64, [0.0_f64; 3]);
    for triangle in &own {
        let ball = around(std::slice::from_ref(triangle)).0;
        let arm = difference(ball.centre, centre);
        radius = radius.max(dot(arm, arm).sqrt() + ball.radius);
        (0..3).for_each(|a| around_balls[a] = around_balls[a].max(arm[a].abs() + ball.radius));
    }
    let ball = Ball { centre, radius: (1.0 + 1e-12) * radius };
    let content = if order.len() <= LEAF {
        Content::Leaf(first..first + order.len())
    } else {
        let axis = (0..3).max_by(|&a, &b| half[a].total_cmp(&half[b])).unwrap_or(0);
        let place = |t: usize| triangles[t].iter().map(|corner| corner[axis]).sum::<f64>();
        let middle = order.len() / 2;
        order.select_nth_unstable_by(middle, |&s, &t| place(s).total_cmp(&place(t)).then(s.cmp(&t)));
        let (left, right) = order.split_at_mut(middle);
        Content::Halves(Box::new([build(triangles, left, first), build(triangles, right, first + middle)]))
    };
    Node { ball, half: around_balls.map(|half| (1.0 + 1e-12) * half), content }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    #[test]
    fn finds_every_triangle_with_a_corner_near_the_line_and_few_others() {
        let mut random = Random::new(7);
        let triangles: Vec<[[f64; 3]; 3]> = (0..500)
            .map(|_| {
                let at: [f64; 3] = std::array::from_fn(|_| 10.0 * random.number());
                std::array::from_fn(|_| at.map(|x| x + 0.3 * random.number()))
            })
            .collect();
        let tree = BallTree::new(&triangles);
        for _ in 0..50 {
            let point: [f64; 3] = std::array::from_fn(|_| 10.0 * random.number());
            let arm: [f64; 3] = std::array::from_fn(|_| random.number());
            let direction = arm.map(|x| x / dot(arm, arm).sqrt());
            let distance = |corner: &[f64; 3]| {
                let arm = difference(*corner, point);
                (dot(arm, arm) - dot(arm, direction).powi(2)).max(0.0).sqrt()
            };
            let found = tree.along(point, direction, 0.5);
            assert!(found.is_sorted() && found.len() < 150, "{}", found.len());
            for (t, triangle) in triangles.iter().enumerate() {
                assert!(found.contains(&t) || triangle.iter().all(|corner| distance(corner) > 0.5));
            }
        }
        let boxes = tree.boxes(8);
        assert_eq!(boxes.len(), 8);
        let is_in = |corner: &[f64; 3], [low, high]: &[[f64; 3]; 2]| {
            (0..3).all(|a| low[a] <= corner[a] && corner[a] <= high[a])
        };
        for triangle in &triangles {
            assert!(boxes.iter().any(|of| triangle.iter().all(|corner| is_in(corner, of))));
        }
        assert!(BallTree::new(&[]).boxes(8).is_empty());
        assert!(BallTree::new(&[]).along([0.0; 3], [1.0, 0.0, 0.0], 1.0).is_empty());
    }
}
