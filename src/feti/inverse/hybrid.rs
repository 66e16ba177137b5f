//! Hybrid Total FETI: `K~^+`, the generalised inverse of the stiffness of clusters whose members hold together.
//!
//! Members of a cluster are bound by the averages of [`bonds`] for good, so that a cluster has six rigid motions and the
//! coarse problem six unknowns a cluster; all else between them is left to the multipliers. `K~^+` is local to each
//! cluster: the members' own `K^+`, and a dense problem of the bonds ([`dense`]). Multipliers along the bonds' rows
//! move nothing, which conjugate gradients do not mind: right-hand sides have no part there.
//!
//! Klawonn and Rheinbach, "Highly scalable parallel domain decomposition methods with an application to biomechanics", ZAMM 90
//! (2010), hybrid FETI; Merta, Riha, Meca, Markopoulos, Brzobohaty, Kozubek and Vondrak, "Intel Xeon Phi acceleration of hybrid
//! total FETI solver", Adv. Eng. Software 112 (2017), hybrid Total FETI.

pub mod bonds;
pub mod dense;

use std::collections::HashMap;
use std::ops::Range;
use std::rc::Rc;

use self::bonds::{Bonds, Kinds};
use self::dense::DenseProblem;
use super::factor::Factors;
use super::kernel::MODES;
use crate::decomposition::Subdomain;
use crate::feti::Torn;

/// The own clusters of more than one subdomain.
pub struct Hybrid(Vec<Cluster>);

struct Cluster {
    /// Own subdomains.
    members: Range<usize>,
    bonds: Rc<Bonds>,
    /// Which factors the inverse is of.
    stamps: Vec<u64>,
    inverse: Option<Rc<DenseProblem>>,
    /// Of the last solve.
    multipliers: Vec<f64>,
}

impl Hybrid {
    /// Of clusters, given by their ranges of own subdomains. Nothing is solved before [`Hybrid::update`].
    pub fn new(clusters: impl Iterator<Item = Range<usize>>, subdomains: &[Subdomain]) -> Self {
        let mut kinds = Kinds::default();
        let cluster = |members: Range<usize>| Cluster {
            bonds: kinds.bonds(&subdomains[members.clone()]),
            members,
            stamps: Vec::new(),
            inverse: None,
            multipliers: Vec::new(),
        };
        Self(clusters.filter(|members| members.len() > 1).map(cluster).collect())
    }

    /// Follows the factors that have changed. Congruent clusters with equal factors share all.
    ///
    /// # Errors
    /// An own subdomain of a cluster whose bonds have no inverse.
    pub fn update(&mut self, factors: &mut Factors) -> Result<(), usize> {
        let mut known: HashMap<(*const Bonds, Vec<u64>), Rc<DenseProblem>> = HashMap::new();
        let mut responses: HashMap<(*const Bonds, usize, u64), Rc<Vec<f64>>> = HashMap::new();
        for cluster in &self.0 {
            let Some(inverse) = &cluster.inverse else { continue };
            let kind = Rc::as_ptr(&cluster.bonds);
            for (member, &stamp) in cluster.stamps.iter().enumerate() {
                responses.entry((kind, member, stamp)).or_insert_with(|| Rc::clone(inverse.response(member)));
            }
            known.insert((kind, cluster.stamps.clone()), Rc::clone(inverse));
        }
        for Cluster { members, bonds, stamps, inverse, .. } in &mut self.0 {
            let now: Vec<u64> = members.clone().map(|own| factors.stamp(own)).collect();
            if *stamps == now {
                continue;
            }
            let kind = Rc::as_ptr(bonds);
            if let Some(shared) = known.get(&(kind, now.clone())) {
                (*stamps, *inverse) = (now, Some(Rc::clone(shared)));
                continue;
            }
            let of_members = members.clone().zip(&now).enumerate().map(|(member, (own, &stamp))| {
                let response = responses.entry((kind, member, stamp));
                Rc::clone(response.or_insert_with(|| Rc::new(response_of(factors, bonds, member, own))))
            });
            let new = Rc::new(DenseProblem::new(bonds, of_members.collect()).ok_or(members.start)?);
            known.insert((kind, now.clone()), Rc::clone(&new));
            (*stamps, *inverse) = (now, Some(new));
        }
        Ok(())
    }

    /// `x = K~^+ x`.
    pub fn solve(&mut self, factors: &mut Factors, x: &mut Torn) {
        let resultants: Vec<Vec<f64>> = self.0.iter().map(|cluster| cluster.resultants(x)).collect();
        factors.solve(x);
        for (cluster, resultants) in self.0.iter_mut().zip(resultants) {
            let inverse = cluster.inverse.as_ref().expect("it follows the factors");
            cluster.multipliers = inverse.solve(&cluster.bonds, resultants, &mut x[cluster.members.clone()]);
        }
    }

    /// Closes the bonds of a displacement by forces between the members alone, with the least energy.
    pub fn rejoin(&mut self, u: &mut Torn) {
        for cluster in &mut self.0 {
            let inverse = cluster.inverse.as_ref().expect("it follows the factors");
            let none = vec![0.0; MODES * cluster.members.len()];
            cluster.multipliers = inverse.solve(&cluster.bonds, none, &mut u[cluster.members.clone()]);
        }
    }

    /// Adds `B_c'mu` of the last solve: the forces by which the members hold each other.
    pub fn add_forces(&self, torn: &mut Torn) {
        for Cluster { members, bonds, multipliers, .. } in &self.0 {
            for (member, local) in bonds.members.iter().zip(&mut torn[members.clone()]) {
                for jump in &member.jumps {
                    let mu = multipliers[jump.row];
                    jump.entries.iter().for_each(|&(dof, value)| local[dof as usize] += value * mu);
                }
            }
        }
    }
}

impl Cluster {
    /// `R't` of the members.
    fn resultants(&self, torn: &Torn) -> Vec<f64> {
        let of = |(member, t): (&bonds::Member, &Vec<f64>)| {
            let mut sum = [0.0; MODES];
            for (row, t) in member.modes.iter().zip(t) {
                sum.iter_mut().zip(row).for_each(|(s, r)| *s += r * t);
            }
            sum
        };
        self.bonds.members.iter().zip(&torn[self.members.clone()]).flat_map(of).collect()
    }
}

/// Numbers that a cluster of these members takes, if it shares nothing.
pub fn numbers(members: &[Subdomain]) -> usize {
    let bonds = Bonds::of_faces(members);
    let responses = bonds.members.iter().map(|member| member.jumps.len() * member.modes.len()).sum::<usize>();
    responses + bonds.rows.pow(2) + (MODES * members.len()).pow(2)
}

/// `K^+ B_c'` of a member, by columns.
fn response_of(factors: &mut Factors, bonds: &Bonds, member: usize, own: usize) -> Vec<f64> {
    let bonds::Member { modes, jumps } = &bonds.members[member];
    let mut columns = vec![0.0; modes.len() * jumps.len()];
    for (jump, column) in jumps.iter().zip(columns.chunks_exact_mut(modes.len())) {
        jump.entries.iter().for_each(|&(dof, value)| column[dof as usize] = value);
    }
    factors.solve_columns(own, &mut columns);
    columns
}

#[cfg(test)]
mod tests;
