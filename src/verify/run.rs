//! A solved case, and its distance from a closed form.

use std::collections::BTreeMap;

use super::{Case, End, Error, Row};
use crate::assembly::Region;
use crate::assembly::loads::Load;
use crate::comm::{Comm, all_gather_u64, exact, maximum};
use crate::contact::ContactPair;
use crate::decomposition::Subdomain;
use crate::element::Kind;
use crate::element::sample::{Sample, samples};
use crate::estimate::{self, Estimate};
use crate::material::Law;
use crate::model;
use crate::model::discrete::Discrete;
use crate::monitor::table::PhaseTable;
use crate::monitor::timing::Timer;
use crate::record::summary::Summary;
use crate::scene::Scene;
use crate::study;
use crate::study::{Solved, StudyError};
use crate::tensor::{Voigt, apply, contract};

/// A solved case.
pub struct Run<'a> {
    pub level: usize,
    pub discrete: Discrete,
    pub solved: Solved,
    comm: &'a dyn Comm,
    scene: Scene,
    seconds: f64,
    gigabytes: f64,
}

/// A displacement field of closed form; the body is named by its index.
pub trait Exact {
    /// Displacement at a place.
    fn displacement(&self, body: usize, x: [f64; 3]) -> [f64; 3];
    /// Strain (engineering shears) at a place.
    fn strain(&self, body: usize, x: [f64; 3]) -> Voigt;
    /// Stress at a place.
    fn stress(&self, body: usize, x: [f64; 3]) -> Voigt;
}

impl<'a> Run<'a> {
    /// Solves. Collective.
    ///
    /// # Errors
    /// If the scene has no discrete problem.
    pub fn new(case: &dyn Case, scene: Scene, level: usize, comm: &'a dyn Comm) -> Result<Self, StudyError> {
        let timer = Timer::start();
        let mut discrete = model::discretise(&scene, comm)?;
        if let Some(value) = case.force() {
            discrete.loads[0] = Load::Field { body: 0, value, factor: 1.0 };
        }
        if let Some(gap) = case.gap() {
            open(&mut discrete, comm, gap);
        }
        let solved = study::solve(&scene, &discrete, comm, study::Begin::Rest, &timer, &mut ())?;
        let seconds = timer.total_seconds();
        let work = PhaseTable::gather(comm, &timer).work();
        let read = |phase: &str| work.get(phase).map_or(0.0, |work| work.bytes) / 1e9;
        let gigabytes = read("dual operator") + read("preconditioner");
        Ok(Self { level, discrete, solved, comm, scene, seconds, gigabytes })
    }

    /// Numbers of the run.
    pub fn summary(&self) -> &Summary {
        &self.solved.summary
    }

    /// The element of the first body.
    pub fn element(&self) -> Kind {
        self.scene.body.values().next().expect("a scene has bodies").element
    }

    /// The run and its errors as a row of the report.
    pub fn row(&self, errors: Vec<Error>, end: End) -> Row {
        let Summary { sizes, newton_iterations, counters, converged, error, .. } = self.summary();
        Row {
            level: self.level,
            nodes: sizes.nodes,
            elements: sizes.elements,
            subdomains: sizes.subdomains,
            newton_iterations: newton_iterations.unwrap_or_default(),
            hessian_multiplications: counters.hessian_multiplications.unwrap_or_default(),
            primal_dofs: sizes.primal_dofs,
            gigabytes: self.gigabytes,
            seconds: self.seconds,
            ended_well: end == End::Either || *converged == Some(end == End::Reached),
            message: error.clone(),
            errors,
        }
    }

    fn subdomains(&self) -> impl Iterator<Item = (&Subdomain, &Vec<f64>)> {
        self.discrete.decomposition.subdomains.iter().zip(&self.solved.u)
    }

    /// Sums over the elements of all subdomains. Collective.
    fn sum<const N: usize>(&self, of: impl Fn(&Subdomain, &[[f64; 3]]) -> [f64; N]) -> [f64; N] {
        let partial = self.subdomains().flat_map(|(subdomain, u)| of(subdomain, u.as_chunks().0));
        let partial: Vec<f64> = partial.collect();
        let sum = exact::sum(self.comm, &partial, N);
        std::array::from_fn(|k| sum[k])
    }

    /// Errors of strain and displacement: in the energy norm, with the elastic moduli, and in the mean square, relative to
    /// the norms of the closed form. Collective.
    pub fn norms(&self, exact: &dyn Exact) -> [f64; 2] {
        let sums = self.sum(|subdomain, u| {
            let (body, tangent) = (subdomain.body, self.discrete.materials[subdomain.material].hooke().tangent());
            let energy = |strain: &Voigt| contract(&apply(&tangent, strain), strain);
            let mut sums = [0.0; 4];
            each_sample(subdomain, u, |sample, x, u| {
                let (displacement, strain) = (exact.displacement(body, x), exact.strain(body, x));
                let error: Voigt = std::array::from_fn(|k| u.strain[k] - strain[k]);
                let off: [f64; 3] = std::array::from_fn(|i| u.value[i] - displacement[i]);
                let square = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>();
                let terms = [energy(&error), energy(&strain), square(&off), square(&displacement)];
                (0..4).for_each(|k| sums[k] += sample.weight * terms[k]);
            });
            sums
        });
        [(sums[0] / sums[1]).sqrt(), (sums[2] / sums[3]).sqrt()]
    }

    /// Estimated error of the stress over the true one, see [`crate::estimate`]. Collective.
    pub fn effectivity(&self, exact: &dyn Exact) -> f64 {
        let Discrete { decomposition, materials, .. } = &self.discrete;
        let subdomains = &decomposition.subdomains;
        let history = |own: usize| self.solved.histories.get(own).map_or(&[][..], Vec::as_slice);
        let numbered = subdomains.iter().enumerate();
        let regions: Vec<Region> = numbered
            .map(|(own, subdomain)| Region {
                subdomain,
                material: &materials[subdomain.material],
                history: history(own),
            })
            .collect();
        let Estimate { errors, stresses } =
            estimate::error(&regions, &self.solved.u, |own, x| exact.stress(subdomains[own].body, x));
        let partial: Vec<f64> = errors.iter().zip(stresses).flat_map(|(e, s)| [e.iter().sum(), s]).collect();
        let sum = exact::sum(self.comm, &partial, 2);
        let estimated = self.summary().state.errors.discretisation.unwrap_or(f64::NAN);
        estimated / (sum[0] / sum[1]).sqrt()
    }

    /// Largest error of the displacement of a node, relative to the largest displacement of the closed form. Collective.
    pub fn worst_displacement(&self, exact: impl Fn(usize, [f64; 3]) -> [f64; 3]) -> f64 {
        let mut largest = [0.0_f64; 2];
        for (subdomain, u) in self.subdomains() {
            for (&x, u) in subdomain.points.iter().zip(u.as_chunks::<3>().0) {
                let expected = exact(subdomain.body, x);
                for i in 0..3 {
                    largest = [largest[0].max((u[i] - expected[i]).abs()), largest[1].max(expected[i].abs())];
                }
            }
        }
        let largest = maximum(self.comm, &largest);
        largest[0] / largest[1]
    }

    /// Share of the volume of the first body where a strain is as told. Collective.
    pub fn share(&self, holds: impl Fn(usize, &Voigt) -> bool) -> f64 {
        let sums = self.sum(|subdomain, u| {
            let mut sums = [0.0; 2];
            each_sample(subdomain, u, |sample, _, u| {
                sums[0] += if holds(subdomain.body, &u.strain) { sample.weight } else { 0.0 };
                sums[1] += if subdomain.body == 0 { sample.weight } else { 0.0 };
            });
            sums
        });
        sums[0] / sums[1]
    }

    /// Root mean square of a number over those nodes of a body that are at some places. Collective.
    pub fn nodes(&self, wanted: impl Fn(usize, [f64; 3]) -> bool, number: impl Fn([f64; 3], [f64; 3]) -> f64) -> f64 {
        let sums = self.sum(|subdomain, u| {
            let found = subdomain.points.iter().zip(u).filter(|(x, _)| wanted(subdomain.body, **x));
            let numbers = found.map(|(&x, &u)| number(x, u));
            numbers.fold([0.0; 2], |[sum, count], number| [sum + number * number, count + 1.0])
        });
        (sums[0] / sums[1]).sqrt()
    }

    /// Error of a field on cells in the mean square, relative to the closed form, whose mean over each cell is compared.
    /// Collective.
    pub fn cells(&self, field: &str, exact: impl Fn(usize, [f64; 3]) -> f64) -> f64 {
        let found = self.solved.piece.last(field).expect("results have this field");
        let mut cell = 0;
        let mut partial = Vec::new();
        for (subdomain, u) in self.subdomains() {
            let mut sums = [0.0; 2];
            let (mut volume, mut mean, mut count) = (0.0, 0.0, 0);
            each_sample(subdomain, u.as_chunks().0, |sample, x, _| {
                volume += sample.weight;
                mean += sample.weight * exact(subdomain.body, x);
                count += 1;
                if count == SAMPLES {
                    sums[0] += volume * (found[cell] - mean / volume).powi(2);
                    sums[1] += volume * (mean / volume).powi(2);
                    (volume, mean, count) = (0.0, 0.0, 0);
                    cell += 1;
                }
            });
            partial.extend(sums);
        }
        let sums = exact::sum(self.comm, &partial, 2);
        (sums[0] / sums[1]).sqrt()
    }

    /// All contact conditions: place of the slave node, pressure and friction stress, and the area they act on. Collective.
    pub fn contacts(&self) -> Vec<Touch> {
        let found = self.solved.piece.last("contact_pressure").expect("results have this field");
        let rubbed = self.solved.piece.last("friction_traction").map(|found| found.as_chunks::<3>().0);
        let mut mine = Vec::new();
        each_slave(&self.discrete, |number, pair, [x, y, z], node| {
            mine.push(number as u64);
            let [u, v, w] = rubbed.map_or([0.0; 3], |rubbed| rubbed[node]);
            mine.extend([x, y, z, found[node], pair.area, u, v, w].map(f64::to_bits));
        });
        // All copies of a node show the same.
        let all = all_gather_u64(self.comm, &mine);
        let touches = all.as_chunks::<9>().0.iter().map(|&[number, ref numbers @ ..]| {
            let [x, y, z, pressure, area, friction @ ..] = numbers.map(f64::from_bits);
            (number, Touch { place: [x, y, z], pressure, area, friction })
        });
        touches.collect::<BTreeMap<u64, Touch>>().into_values().collect()
    }
}

/// Every own copy of a slave node: number of the condition, the condition, place, and index of the node in the results of the rank.
fn each_slave(discrete: &Discrete, mut tell: impl FnMut(usize, &ContactPair, [f64; 3], usize)) {
    let mut first = 0;
    for subdomain in &discrete.decomposition.subdomains {
        for (number, pair) in discrete.contacts.pairs.iter() {
            if let Some(node) = subdomain.local_node(pair.slave) {
                tell(number, pair, subdomain.points[node], first + node);
            }
        }
        first += subdomain.nodes.len();
    }
}

/// Adds a distance to those of contact rows between surfaces whose nodes meet. Collective.
fn open(discrete: &mut Discrete, comm: &dyn Comm, gap: impl Fn([f64; 3]) -> f64) {
    let mut mine = Vec::new();
    each_slave(discrete, |number, _, x, _| mine.extend([number as u64, gap(x).to_bits()]));
    let all = all_gather_u64(comm, &mine);
    let gaps: BTreeMap<u64, f64> = all.as_chunks().0.iter().map(|&[pair, gap]| (pair, f64::from_bits(gap))).collect();
    let Discrete { constraints, right_hand_sides, .. } = discrete;
    for rhs in right_hand_sides.ends.iter_mut().chain([&mut right_hand_sides.begin]) {
        constraints.add_gaps(|pair| gaps[&(pair as u64)], rhs);
    }
}

/// A contact condition of a run.
#[derive(Clone, Copy, Debug)]
pub struct Touch {
    pub place: [f64; 3],
    pub pressure: f64,
    pub area: f64,
    /// Friction stress on the slave's side.
    pub friction: [f64; 3],
}

/// Distance of contact pressures from those of closed form, in the mean square over the surface, relative to them.
pub fn pressure_error(touches: &[Touch], exact: impl Fn([f64; 3]) -> f64) -> f64 {
    let square = |of: &dyn Fn(&Touch) -> f64| touches.iter().map(|t| t.area * of(t).powi(2)).sum::<f64>();
    (square(&|t| t.pressure - exact(t.place)) / square(&|t| exact(t.place))).sqrt()
}

/// What [`samples`] gives for each element.
const SAMPLES: usize = 27;

/// A displacement at a point.
struct There {
    value: [f64; 3],
    strain: Voigt,
}

/// Every point of every element: the point, its place, and the displacement there.
fn each_sample(subdomain: &Subdomain, u: &[[f64; 3]], mut tell: impl FnMut(&Sample, [f64; 3], There)) {
    for nodes in &subdomain.elements {
        let of = |values: &[[f64; 3]]| nodes.iter().map(|&n| values[n as usize]).collect::<Vec<_>>();
        let (places, u) = (of(&subdomain.points), of(u));
        for sample in samples(subdomain.elements.kind(), &places) {
            tell(&sample, sample.value(&places), There { value: sample.value(&u), strain: sample.strain(&u) });
        }
    }
}
