//! The elements of one body that a rank has, and how they get to other ranks. No rank needs to have all of a mesh.

use super::Elements;
use super::curve::{self, on_grid};
use super::wholes::Wholes;
use crate::comm::Comm;
use crate::comm::words::{pack_pairs, unpack_pairs};
use crate::element::Kind;

/// A rank's elements of one body.
#[derive(Clone, Debug, PartialEq)]
pub struct Portion {
    /// Numbers of the elements within the body.
    pub numbers: Vec<u32>,
    /// Elements by places in `nodes`.
    pub elements: Elements,
    /// For each element the region of the body that it is in; once pieces are known its whole, which is a face-connected
    /// piece of one region.
    pub wholes: Vec<u32>,
    /// For each element the part that it is in.
    pub part: Vec<u32>,
    /// Nodes, numbered within the body, ascending.
    pub nodes: Vec<u32>,
    /// Coordinates of the nodes.
    pub points: Vec<[f64; 3]>,
}

impl Portion {
    /// Of a rank's elements with consecutive numbers from `first` on, by the numbers of their nodes within the body.
    /// They are in the first region. `point` tells where a node is.
    pub fn new(kind: Kind, first: u32, of_elements: &[u32], point: impl Fn(u32) -> [f64; 3]) -> Self {
        let mut nodes = of_elements.to_vec();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: &u32| nodes.binary_search(node).expect("every node is listed") as u32;
        let elements = Elements::new(kind, of_elements.iter().map(local).collect());
        let points = nodes.iter().map(|&node| point(node)).collect();
        let zeros = vec![0; elements.len()];
        let numbers = (first..).take(elements.len()).collect();
        Self { wholes: zeros.clone(), part: zeros, numbers, elements, points, nodes }
    }

    /// What identifies a face of an element within the body: three corners.
    pub fn face_key(&self, element: usize, face: usize) -> [u64; 2] {
        let corners = self.elements.kind().cell().corners_of_face();
        let nodes = self.elements.face(element, face);
        let mut nodes: Vec<u64> = nodes[..corners].iter().map(|&node| self.nodes[node as usize].into()).collect();
        nodes.sort_unstable();
        [nodes[0] << 32 | nodes[1], nodes[2]]
    }

    /// The same elements, of which each rank has a piece of a Hilbert curve. Collective.
    pub fn along_curve(mut self, comm: &dyn Comm, elements: u64) -> Self {
        if comm.size() == 1 {
            return self;
        }
        let wholes = Wholes::new(vec![elements], vec![comm.size() as u32]);
        let owners = curve::start(comm, &on_grid(comm, &self.centres()), &vec![0; self.len()], &wholes);
        self.part.fill(0);
        self.sent(comm, |at| owners[at] as usize)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.numbers.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.numbers.is_empty()
    }

    /// Where the nodes of an element are.
    pub fn places(&self, element: usize) -> Vec<[f64; 3]> {
        self.elements.get(element).iter().map(|&node| self.points[node as usize]).collect()
    }

    /// Mean of the corners of each element.
    pub fn centres(&self) -> Vec<[f64; 3]> {
        let corners = self.elements.kind().cell().corners();
        let mean = |nodes: &[u32]| {
            let points = nodes[..corners].iter().map(|&node| self.points[node as usize]);
            let sum = points.fold([0.0; 3], |a, b| [a[0] + b[0], a[1] + b[1], a[2] + b[2]]);
            sum.map(|x| x / corners as f64)
        };
        self.elements.iter().map(mean).collect()
    }

    /// After every element went to the rank that `owner` names for its place here; of one rank those of a part together. Collective.
    pub fn sent(&self, comm: &dyn Comm, owner: impl Fn(usize) -> usize) -> Self {
        let mut places = vec![Vec::new(); comm.size()];
        (0..self.len()).for_each(|at| places[owner(at)].push(at));
        places.iter_mut().for_each(|places| places.sort_by_key(|&at| self.part[at]));
        let mut number = vec![0; self.nodes.len()];
        let outgoing = places.iter().map(|places| self.pack(places, &mut number)).collect();
        drop((places, number));
        let kind = self.elements.kind();
        let received: Vec<Self> = comm.all_to_all(outgoing).iter().map(|message| Self::unpack(kind, message)).collect();
        Self::merged(kind, &received)
    }

    /// Some elements as numbers. `number` is as long as the nodes.
    fn pack(&self, places: &[usize], number: &mut [u32]) -> Vec<u64> {
        let of_elements = || places.iter().flat_map(|&at| self.elements.get(at));
        let mut used: Vec<u32> = of_elements().copied().collect();
        used.sort_unstable();
        used.dedup();
        (0..).zip(&used).for_each(|(k, &node)| number[node as usize] = k);
        let mut message = vec![places.len() as u64, used.len() as u64];
        let per_element = |values: &[u32]| places.iter().map(|&at| values[at]).collect::<Vec<_>>();
        [&self.numbers, &self.wholes, &self.part]
            .into_iter()
            .for_each(|values| pack_pairs(&per_element(values), &mut message));
        pack_pairs(&of_elements().map(|&node| number[node as usize]).collect::<Vec<_>>(), &mut message);
        pack_pairs(&used.iter().map(|&node| self.nodes[node as usize]).collect::<Vec<_>>(), &mut message);
        message.extend(used.iter().flat_map(|&node| self.points[node as usize]).map(f64::to_bits));
        message
    }

    fn unpack(kind: Kind, message: &[u64]) -> Self {
        let mut numbers = message.iter().copied();
        let mut next = || numbers.next().expect("a packed portion is whole");
        let [count, nodes] = [(); 2].map(|()| next() as usize);
        let mut take = |count: usize| unpack_pairs(count, &mut next);
        let [numbers, wholes, part] = [(); 3].map(|()| take(count));
        let elements = Elements::new(kind, take(count * kind.nodes()));
        let of_nodes = take(nodes);
        let points = (0..nodes).map(|_| [(); 3].map(|()| f64::from_bits(next()))).collect();
        Self { numbers, elements, wholes, part, nodes: of_nodes, points }
    }

    fn merged(kind: Kind, portions: &[Self]) -> Self {
        let each = || portions.iter().flat_map(|p| p.nodes.iter().copied().zip(p.points.iter().copied()));
        let mut of_nodes: Vec<(u32, [f64; 3])> = each().collect();
        of_nodes.sort_unstable_by_key(|of_node| of_node.0);
        of_nodes.dedup_by_key(|of_node| of_node.0);
        let (nodes, points): (Vec<u32>, Vec<[f64; 3]>) = of_nodes.into_iter().unzip();
        let mut of_elements = Vec::new();
        for portion in portions {
            let local = |node: &u32| nodes.binary_search(node).expect("every node is listed") as u32;
            let local: Vec<u32> = portion.nodes.iter().map(local).collect();
            of_elements.extend(portion.elements.nodes().iter().map(|&node| local[node as usize]));
        }
        let all = |values: fn(&Self) -> &Vec<u32>| portions.iter().flat_map(values).copied().collect();
        Self {
            numbers: all(|p| &p.numbers),
            elements: Elements::new(kind, of_elements),
            wholes: all(|p| &p.wholes),
            part: all(|p| &p.part),
            nodes,
            points,
        }
    }
}
