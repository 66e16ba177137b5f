//! Elements of one body on their way from where the mesh is to the ranks that own their parts.

use super::super::subdomain::{pack_pairs, unpack_pairs};
use super::super::{BodyMesh, Shape};
use crate::comm::Comm;
use crate::element::Kind;
use crate::mesh::{Elements, SolidMesh};

/// A rank's elements of one body.
#[derive(Clone)]
pub struct Portion {
    /// Numbers of the elements within the body.
    pub numbers: Vec<u32>,
    /// Elements by places in `nodes`.
    pub elements: Elements,
    /// For each element its whole: a face-connected piece of one region of the body.
    pub wholes: Vec<u32>,
    /// For each element the part that it is in.
    pub part: Vec<u32>,
    /// Nodes, numbered within the body, ascending.
    pub nodes: Vec<u32>,
    /// Coordinates of the nodes.
    pub points: Vec<[f64; 3]>,
}

/// Of this rank's share in some items: consecutive ones, as many as others have, give or take one.
fn share(items: u64, comm: &dyn Comm) -> std::ops::Range<u64> {
    let end = |rank: usize| (u128::from(items) * rank as u128 / comm.size() as u128) as u64;
    end(comm.rank())..end(comm.rank() + 1)
}

impl Portion {
    /// This rank's share in a brick, which it generates.
    fn of_brick(body: &BodyMesh, comm: &dyn Comm) -> Self {
        let lattice = body.lattice().expect("the body is a brick");
        let numbers: Vec<u32> = share(body.counts().elements, comm).map(|number| number as u32).collect();
        let of_elements: Vec<u32> =
            numbers.iter().flat_map(|&number| body.element(u64::from(number))).map(|node| node as u32).collect();
        let mut nodes = of_elements.clone();
        nodes.sort_unstable();
        nodes.dedup();
        let local = |node: &u32| nodes.binary_search(node).expect("every node is listed") as u32;
        let elements = Elements::new(body.kind, of_elements.iter().map(local).collect());
        let point = |&node: &u32| lattice.coordinates(lattice.node_position(u64::from(node)));
        let points = nodes.iter().map(point).collect();
        let zeros = vec![0; numbers.len()];
        Self { wholes: zeros.clone(), part: zeros, numbers, elements, points, nodes }
    }

    /// All of a mesh.
    fn of_mesh(mesh: &SolidMesh, wholes: Vec<u32>) -> Self {
        let count = mesh.elements.len();
        Self {
            numbers: (0..count as u32).collect(),
            elements: mesh.elements.clone(),
            wholes,
            part: vec![0; count],
            nodes: (0..mesh.points.len() as u32).collect(),
            points: mesh.points.clone(),
        }
    }

    /// What identifies a face of an element within the body: three corners.
    pub fn face_key(&self, element: usize, face: usize) -> [u64; 2] {
        let corners = self.elements.kind().cell().corners_of_face();
        let nodes = self.elements.face(element, face);
        let mut nodes: Vec<u64> = nodes[..corners].iter().map(|&node| self.nodes[node as usize].into()).collect();
        nodes.sort_unstable();
        [nodes[0] << 32 | nodes[1], nodes[2]]
    }

    fn none(kind: Kind) -> Self {
        Self {
            numbers: Vec::new(),
            elements: Elements::new(kind, Vec::new()),
            wholes: Vec::new(),
            part: Vec::new(),
            nodes: Vec::new(),
            points: Vec::new(),
        }
    }

    /// This rank's share in a body. `mesh` is that of rank 0, with the wholes of its elements, if the body is no brick. Collective.
    pub fn new(body: &BodyMesh, mesh: Option<(&SolidMesh, Vec<u32>)>, comm: &dyn Comm) -> Self {
        if let Shape::Brick(_) = body.shape {
            return Self::of_brick(body, comm);
        }
        let all = mesh.map_or_else(|| Self::none(body.kind), |(mesh, wholes)| Self::of_mesh(mesh, wholes));
        let count = body.counts().elements.max(1);
        let owner = |at: usize| (at as u128 * comm.size() as u128 / u128::from(count)) as usize;
        all.sent(comm, owner)
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.numbers.len()
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
        let mut number = vec![u32::MAX; self.nodes.len()];
        let outgoing = places.iter().map(|places| self.pack(places, &mut number)).collect();
        drop((places, number));
        let kind = self.elements.kind();
        let received: Vec<Self> = comm.all_to_all(outgoing).iter().map(|message| Self::unpack(kind, message)).collect();
        Self::merged(kind, &received)
    }

    /// Some elements as numbers. `number` is as long as the nodes and holds `u32::MAX`, before and after.
    fn pack(&self, places: &[usize], number: &mut [u32]) -> Vec<u64> {
        let of_elements = || places.iter().flat_map(|&at| self.elements.get(at));
        of_elements().for_each(|&node| number[node as usize] = 0);
        let mut used = Vec::new();
        for (node, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
            *number = used.len() as u32;
            used.push(node);
        }
        let mut message = vec![places.len() as u64, used.len() as u64];
        let per_element = |values: &[u32]| places.iter().map(|&at| values[at]).collect::<Vec<_>>();
        [&self.numbers, &self.wholes, &self.part]
            .into_iter()
            .for_each(|values| pack_pairs(&per_element(values), &mut message));
        pack_pairs(&of_elements().map(|&node| number[node as usize]).collect::<Vec<_>>(), &mut message);
        pack_pairs(&used.iter().map(|&node| self.nodes[node]).collect::<Vec<_>>(), &mut message);
        message.extend(used.iter().flat_map(|&node| self.points[node]).map(f64::to_bits));
        used.into_iter().for_each(|node| number[node] = u32::MAX);
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
