//! A tree of balls around triangles: which of them may meet a line.

use crate::vector::{difference, dot};

/// Triangles a leaf holds at most.
const LEAF: usize = 4;

/// Balls around balls around triangles.
pub struct BallTree {
    /// Triangles, leaf by leaf.
    order: Vec<usize>,
    root: Option<Ball>,
}

struct Ball {
    centre: [f64; 3],
    radius: f64,
    content: Content,
}

enum Content {
    Halves(Box<[Ball; 2]>),
    Leaf(std::ops::Range<usize>),
}

impl BallTree {
    /// Of triangles by their corners.
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> Self {
        let mut order: Vec<usize> = (0..triangles.len()).collect();
        let root = (!order.is_empty()).then(|| build(triangles, &mut order, 0));
        Self { order, root }
    }

    /// Triangles that may come closer than `distance` to the endless line through `point` along the unit vector
    /// `direction`, ascending. All that do are among them.
    pub fn along(&self, point: [f64; 3], direction: [f64; 3], distance: f64) -> Vec<usize> {
        let mut found = Vec::new();
        let mut open: Vec<&Ball> = self.root.iter().collect();
        while let Some(Ball { centre, radius, content }) = open.pop() {
            let arm = difference(*centre, point);
            let along = dot(arm, direction);
            let beside: [f64; 3] = std::array::from_fn(|a| arm[a] - along * direction[a]);
            if dot(beside, beside) > (radius + distance).powi(2) {
                continue;
            }
            match content {
                Content::Halves(halves) => open.extend(halves.iter()),
                Content::Leaf(range) => found.extend_from_slice(&self.order[range.clone()]),
            }
        }
        found.sort_unstable();
        found
    }
}

/// The ball of some triangles, which are brought into the order of its leaves; these begin at `first`.
fn build(triangles: &[[[f64; 3]; 3]], order: &mut [usize], first: usize) -> Ball {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in order.iter().flat_map(|&t| triangles[t]) {
        for a in 0..3 {
            low[a] = low[a].min(corner[a]);
            high[a] = high[a].max(corner[a]);
        }
    }
    let centre = std::array::from_fn(|a| 0.5 * (low[a] + high[a]));
    let half: [f64; 3] = std::array::from_fn(|a| 0.5 * (high[a] - low[a]));
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
    // Round-off in the centre must not lose a triangle.
    Ball { centre, radius: (1.0 + 1e-12) * dot(half, half).sqrt(), content }
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
        assert!(BallTree::new(&[]).along([0.0; 3], [1.0, 0.0, 0.0], 1.0).is_empty());
    }
}
