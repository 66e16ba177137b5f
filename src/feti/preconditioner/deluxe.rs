//! Deluxe scaling of faces: how the two sides of an interface share a jump, in place of the stiffness scaling of
//! [`super::scaling`].
//!
//! Stiffness scaling takes unknowns, or nodes, one at a time. Where a body hardly changes its volume but gives way otherwise (it
//! flows, or Poisson's ratio is near a half) they are all as stiff as its volume, and what they share out moves volume, which costs
//! up to a million times what it has to. With `S_1` and `S_2` the stiffness of a whole face on either side, a jump `j` costs least if
//! it is shared as `u_1 = P j` and `u_2 = P j - j`, `P = (S_1 + S_2)^-1 S_2`. (Dohrmann and Widlund, "Some recent tools and a BDDC
//! algorithm for 3D problems in H(curl)", Domain Decomposition Methods in Science and Engineering XX (2013), where it is for BDDC.)
//!
//! Dense matrices of faces cost about as much as factors do, so only faces beside a weak subdomain ([`Schur::is_weak`]) are scaled so.

use std::collections::{BTreeMap, HashMap};
use std::rc::Rc;

use faer::prelude::Solve;
use faer::{ColRef, Mat, Side};

use crate::comm::Comm;
use crate::constraint::{Constraints, Kind};
use crate::feti::Torn;
use crate::feti::dual::Interconnection;
use crate::feti::dual::gather::Gather;
use crate::feti::dual::levels::Halo;
use crate::feti::dual::operator::Changes;
use crate::feti::inverse::factor::Symbolic;
use crate::feti::inverse::schur::Schur;
use crate::sparse::cholesky::{Precision, Workspace};
use crate::sparse::submatrix::Submatrix;
use crate::work;

/// The faces of one rank's subdomains.
pub struct Deluxe<'a> {
    comm: &'a dyn Comm,
    halo: &'a Halo<'a>,
    faces: Vec<GluedFace>,
    analyses: Vec<Analysed>,
    /// Of subdomains by place, whether they are weak, and whether their tangents are fresh.
    weak: Vec<bool>,
    fresh: Vec<bool>,
    /// Whether any rank has a face with deluxe scaling.
    active: bool,
}

/// The block of the interior of an own subdomain and of one face, which is eliminated last; others that are alike share it.
struct Analysed {
    own: usize,
    face: Vec<u32>,
    block: Rc<Submatrix>,
}

/// The components of nodes that one row of gluing between two subdomains touches, and no other row.
struct GluedFace {
    rows: Vec<u32>,
    /// Coefficient of each row on the first side; it is the opposite on the other.
    values: Vec<f64>,
    sides: [FaceSide; 2],
    /// `P`, while the face is scaled by it.
    share: Option<Mat<f64>>,
}

/// A face of one of its subdomains.
struct FaceSide {
    /// Its subdomain's place ([`Halo::place`]).
    place: usize,
    rank: usize,
    own: Option<OwnSide>,
    /// Its stiffness, while the face is scaled by it.
    stiffness: Option<Mat<f64>>,
}

/// What is known of own subdomains only, in the order of the rows.
struct OwnSide {
    own: usize,
    dofs: Vec<u32>,
    /// On the boundary.
    places: Vec<u32>,
}

impl<'a> Deluxe<'a> {
    /// Finds the faces. None has deluxe scaling before [`Deluxe::update`].
    pub fn new(connection: &'a Interconnection<'a>, constraints: &Constraints, schur: &Schur) -> Self {
        let Interconnection { gather, halo, tree, .. } = connection;
        // How many rows touch a component of a node.
        let mut touching: HashMap<(u64, usize), usize> = HashMap::new();
        for row in &constraints.rows {
            let mut touched: Vec<(u64, usize)> = row.terms.iter().map(|term| (term.node, term.axis)).collect();
            touched.dedup();
            touched.into_iter().for_each(|component| *touching.entry(component).or_default() += 1);
        }
        let mut rows_of: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (number, row) in constraints.rows.iter().enumerate() {
            if let [a, b] = row.terms[..]
                && row.kind == Kind::Gluing
                && touching[&(a.node, a.axis)] == 1
            {
                rows_of.entry([a.subdomain, b.subdomain]).or_default().push(number as u32);
            }
        }
        let side = |subdomain: u32, rows: &[u32]| {
            let place = halo.place(subdomain) as usize;
            let own = (place < tree.own()).then(|| OwnSide::new(place, rows, gather, schur));
            FaceSide { place, rank: tree.home(subdomain as usize), own, stiffness: None }
        };
        let is_own = |subdomain: &u32| tree.home(*subdomain as usize) == tree.comm().rank();
        rows_of.retain(|pair, _| pair.iter().any(is_own));
        let face = |(pair, rows): ([u32; 2], Vec<u32>)| {
            let sides = pair.map(|subdomain| side(subdomain, &rows));
            let values = rows.iter().map(|&row| constraints.rows[row as usize].terms[0].value).collect();
            GluedFace { rows, values, sides, share: None }
        };
        let faces = rows_of.into_iter().map(face).collect();
        Self {
            comm: tree.comm(),
            halo,
            faces,
            analyses: Vec::new(),
            weak: Vec::new(),
            fresh: Vec::new(),
            active: false,
        }
    }

    /// Learns how subdomains here and beside have changed. One neighbour exchange. Collective.
    pub fn meet(&mut self, changes: &Changes) {
        let flags = changes.weak.iter().zip(&changes.fresh);
        let mut flags: Vec<f64> =
            flags.flat_map(|(weak, fresh)| [weak, fresh].map(|is| f64::from(u8::from(*is)))).collect();
        self.halo.fill(&mut flags, 2);
        (self.weak, self.fresh) = flags.as_chunks().0.iter().map(|[weak, fresh]| (*weak > 0.0, *fresh > 0.0)).unzip();
        self.active = changes.is_any_weak;
    }

    /// Whether an own subdomain is weak or shares a face with one that is.
    pub fn is_beside(&self, own: usize) -> bool {
        let is_own = |side: &FaceSide| side.own.as_ref().is_some_and(|side| side.own == own);
        let is_scaled = |face: &&GluedFace| face.sides.iter().any(|side| self.weak[side.place]);
        self.faces.iter().filter(is_scaled).any(|face| face.sides.iter().any(is_own))
    }

    /// From now on faces beside weak subdomains have deluxe scaling, the others not. The stiffness of a side is taken again if its
    /// subdomain has a new tangent; `stiffness` gives analysis and lower values of an own one. Collective.
    pub fn update<'s>(&mut self, schur: &Schur, stiffness: impl Fn(usize) -> (&'s Symbolic, &'s [f64])) {
        let mut changed = vec![false; self.faces.len()];
        let mut outgoing = vec![Vec::new(); self.comm.size()];
        for (face, changed) in self.faces.iter_mut().zip(&mut changed) {
            let is_scaled = face.sides.iter().any(|side| self.weak[side.place]);
            for side in &mut face.sides {
                side.stiffness = side.stiffness.take().filter(|_| is_scaled && !self.fresh[side.place]);
                *changed |= is_scaled && side.stiffness.is_none();
            }
            face.share = face.share.take().filter(|_| is_scaled && !*changed);
            let ranks = face.sides.each_ref().map(|side| side.rank);
            for (side, other) in face.sides.iter_mut().zip([ranks[1], ranks[0]]) {
                let Some(own) = side.own.as_ref().filter(|_| *changed && side.stiffness.is_none()) else { continue };
                let (symbolic, values) = stiffness(own.own);
                let block = analyse(&mut self.analyses, schur, symbolic, own);
                let matrix = own.stiffness(&block, values);
                if other != side.rank {
                    outgoing[other].extend(lower(matrix.nrows()).map(|(i, j)| matrix[(i, j)].to_bits()));
                }
                side.stiffness = Some(matrix);
            }
        }
        if !self.active {
            return;
        }
        let mut incoming: Vec<_> = self.comm.all_to_all(outgoing).into_iter().map(Vec::into_iter).collect();
        for (face, _) in self.faces.iter_mut().zip(changed).filter(|(_, changed)| *changed) {
            for side in &mut face.sides {
                let (n, numbers) = (face.rows.len(), &mut incoming[side.rank]);
                side.stiffness.get_or_insert_with(|| from_lower(n, numbers));
            }
            let [a, b] = face.sides.each_ref().map(|side| side.stiffness.as_ref().expect("it has come"));
            // A factor, and two solves with as many right-hand sides.
            work::add(7 * a.nrows().pow(3) / 3, 2 * size_of::<f64>() * a.nrows().pow(2));
            face.share = (a + b).llt(Side::Lower).ok().map(|factor| factor.solve(b));
        }
    }

    /// Whether any rank has a face with deluxe scaling.
    pub fn is_active(&self) -> bool {
        self.active
    }

    /// Overwrites `displacements` of own boundaries by `B_D' x` on faces with deluxe scaling. Local.
    pub fn share(&self, x: &[f64], displacements: &mut [Vec<f64>]) {
        for (face, share) in self.scaled() {
            let jumps: Vec<f64> = face.rows.iter().zip(&face.values).map(|(&row, v)| x[row as usize] / v).collect();
            work::each(jumps.len() * jumps.len(), 2, size_of::<f64>());
            let first = share * ColRef::from_slice(&jumps);
            for (number, side) in face.own_sides() {
                for (k, &place) in side.places.iter().enumerate() {
                    displacements[side.own][place as usize] = first[k] - if number == 0 { 0.0 } else { jumps[k] };
                }
            }
        }
    }

    /// The transpose of [`Deluxe::share`]. Moves the `forces` of own boundaries on these faces into `parts`, such that `B parts` is
    /// `B_D` of these forces; leaves zeros. Local.
    pub fn collect(&self, forces: &mut [Vec<f64>], parts: &mut Torn) {
        parts.iter_mut().for_each(|part| part.fill(0.0));
        for (face, share) in self.scaled() {
            for (number, side) in face.own_sides() {
                let taken = |&place: &u32| std::mem::take(&mut forces[side.own][place as usize]);
                let taken: Vec<f64> = side.places.iter().map(taken).collect();
                work::each(taken.len() * taken.len(), 2, size_of::<f64>());
                let first = share.transpose() * ColRef::from_slice(&taken);
                for (k, (&dof, v)) in side.dofs.iter().zip(&face.values).enumerate() {
                    let part = if number == 0 { first[k] } else { taken[k] - first[k] };
                    parts[side.own][dof as usize] = part / (v * v);
                }
            }
        }
    }

    fn scaled(&self) -> impl Iterator<Item = (&GluedFace, &Mat<f64>)> {
        self.faces.iter().filter_map(|face| face.share.as_ref().map(|share| (face, share)))
    }
}

impl GluedFace {
    /// The sides of own subdomains, numbered.
    fn own_sides(&self) -> impl Iterator<Item = (usize, &OwnSide)> {
        self.sides.iter().enumerate().filter_map(|(number, side)| side.own.as_ref().map(|own| (number, own)))
    }
}

impl OwnSide {
    fn new(own: usize, rows: &[u32], gather: &Gather, schur: &Schur) -> Self {
        let entries = gather.entries(own);
        let entry = |&row: &u32| entries[entries.partition_point(|entry| entry.row < row)];
        let entries: Vec<_> = rows.iter().map(entry).collect();
        let boundary = schur.boundary(own);
        let place = |dof| boundary.binary_search(&dof).expect("rows touch boundary unknowns") as u32;
        Self {
            own,
            dofs: entries.iter().map(|entry| entry.dof).collect(),
            places: entries.iter().map(|entry| place(entry.dof)).collect(),
        }
    }

    /// The forces that displacements of the face cause there, while the rest of the boundary is held; not a number if the interior
    /// is not stiff. Where nothing holds the subdomain but the face, they vanish for rigid motions: the face is factorised with
    /// springs, which are taken off again.
    fn stiffness(&self, with_interior: &Submatrix, values: &[f64]) -> Mat<f64> {
        let Submatrix { unknowns, block, cholesky } = with_interior;
        let (n, mut entries) = (self.dofs.len(), block.values(values).collect::<Vec<_>>());
        let mut line = vec![None; unknowns.len()];
        for (k, dof) in self.dofs.iter().enumerate() {
            line[unknowns.binary_search(dof).expect("the face is part of it")] = Some(k);
        }
        let diagonal = || (0..unknowns.len()).filter(|&k| line[k].is_some()).map(|k| block.begin[k] as usize);
        let spring = diagonal().map(|at| entries[at]).sum::<f64>() / n as f64;
        diagonal().for_each(|at| entries[at] += spring);
        let mut factor = with_interior.factor(Precision::Double);
        let outcome = Workspace::new([cholesky]).factorise(cholesky, with_interior.lower(), &entries, &mut factor);
        if outcome.is_err() {
            return Mat::from_fn(n, n, |_, _| f64::NAN);
        }
        let mut stiffness = cholesky.complement(&factor, n, |unknown| line[unknown]);
        (0..n).for_each(|k| stiffness[(k, k)] -= spring);
        stiffness
    }
}

fn analyse(known: &mut Vec<Analysed>, schur: &Schur, symbolic: &Symbolic, side: &OwnSide) -> Rc<Submatrix> {
    let is_alike = |other: &&Analysed| other.face == side.dofs && schur.alike(side.own, other.own);
    if let Some(Analysed { block, .. }) = known.iter().find(is_alike) {
        return Rc::clone(block);
    }
    let boundary = schur.boundary(side.own);
    let interior = symbolic.order.iter().filter(|dof| boundary.binary_search(dof).is_err());
    let order: Vec<u32> = interior.chain(&side.dofs).copied().collect();
    let block = Rc::new(Submatrix::new(&symbolic.pattern, &order));
    known.push(Analysed { own: side.own, face: side.dofs.clone(), block: Rc::clone(&block) });
    block
}

fn lower(n: usize) -> impl Iterator<Item = (usize, usize)> {
    (0..n).flat_map(|i| (0..=i).map(move |j| (i, j)))
}

fn from_lower(n: usize, numbers: &mut impl Iterator<Item = u64>) -> Mat<f64> {
    let mut matrix = Mat::zeros(n, n);
    for (i, j) in lower(n) {
        let value = f64::from_bits(numbers.next().expect("a rank sends what the other waits for"));
        (matrix[(i, j)], matrix[(j, i)]) = (value, value);
    }
    matrix
}
