//! Numbers of a file's nodes within a body, and where they are: asked from the ranks that have the nodes' places.

use super::Msh;
use crate::comm::Comm;
use crate::comm::words::{before, holder, least, share};

/// The numbers of this rank's share in the nodes of a file.
pub(super) struct Numbers<'a> {
    comm: &'a dyn Comm,
    msh: &'a Msh,
    /// `u32::MAX` for nodes that are not in the body.
    numbers: Vec<u32>,
    /// Nodes of the body.
    pub total: u64,
}

impl<'a> Numbers<'a> {
    /// Numbers the nodes in the order of the file that some rank has among its `used` ones. Collective.
    pub fn new(comm: &'a dyn Comm, msh: &'a Msh, used: &[u32]) -> Self {
        let first = share(msh.nodes, comm).start;
        let mut numbers = vec![u32::MAX; msh.points.len()];
        let outgoing = questions(comm, msh, used);
        for node in comm.all_to_all(outgoing).into_iter().flatten() {
            numbers[(node - first) as usize] = 0;
        }
        let mine = numbers.iter().filter(|&&number| number == 0).count();
        let [begin, total] = before(comm, mine as u64);
        let own = numbers.iter_mut().filter(|number| **number == 0);
        own.zip(begin as u32..).for_each(|(number, next)| *number = next);
        Self { comm, msh, numbers, total }
    }

    /// The number of each node, `u32::MAX` if it is not in the body, and where it is; nodes ascend. Collective.
    pub fn of(&self, nodes: &[u32]) -> (Vec<u32>, Vec<[f64; 3]>) {
        let first = share(self.msh.nodes, self.comm).start;
        let answer = |&node: &u64| {
            let own = (node - first) as usize;
            let [x, y, z] = self.msh.points[own].map(f64::to_bits);
            [self.numbers[own].into(), x, y, z]
        };
        let outgoing = questions(self.comm, self.msh, nodes);
        let answers = self.comm.all_to_all(outgoing);
        let answers = answers.iter().map(|theirs| theirs.iter().flat_map(answer).collect()).collect();
        // Ranks have nodes in their order.
        let answers = self.comm.all_to_all(answers);
        let each = answers.iter().flat_map(|theirs| theirs.as_chunks::<4>().0);
        each.map(|&[number, x, y, z]| (number as u32, [x, y, z].map(f64::from_bits))).unzip()
    }
}

impl Msh {
    /// Where a node is, on every rank. Collective.
    pub(super) fn point(&self, comm: &dyn Comm, node: u64) -> [f64; 3] {
        let own = share(self.nodes, comm);
        let point = own.contains(&node).then(|| self.points[(node - own.start) as usize].map(f64::to_bits));
        least(comm, point).expect("some rank has the node").map(f64::from_bits)
    }
}

/// Each node goes to the rank that has its place.
fn questions(comm: &dyn Comm, msh: &Msh, nodes: &[u32]) -> Vec<Vec<u64>> {
    let mut outgoing = vec![Vec::new(); comm.size()];
    nodes.iter().for_each(|&node| outgoing[holder(node.into(), msh.nodes, comm)].push(u64::from(node)));
    outgoing
}
