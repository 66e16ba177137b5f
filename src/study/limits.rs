//! The limits of the theory, which is of small strains and small displacements, and of the mesh: how near a solution comes to them,
//! and what to tell where it is beyond.
//!
//! | measure | limit | why |
//! |---|---|---|
//! | strain: Frobenius norm at an integration point | 0.1 | what is left out is half of it, relatively |
//! | rotation: length of half the curl of the displacement | 0.1 rad | what is left out is half its square, as a strain |
//! | displacement over the diagonal of its body's bounding box | 0.1 | loads and contacts stay where they were |
//! | sliding of a closed slave node over the longest edge of its facets | 1 | it presses on what it faced at the start |
//! | gap that closes over the diagonal of the slave's body | 0.1 | normals and partners are those of before |
//! | overlap at the start over the extent of the thinner body along the normal | 0.1 | as a strain |
//! | pressure that is missing where the other side enters faces of the slave between their nodes, as a share | 0.5 | the mesh does not know where it touches |
//! | rounding of coordinates over the largest strain times the diagonal of its body | 1e-3 | gaps are rounded so |
//!
//! Each is the largest over elements or contact conditions, and keeps the place. All but the overlap, which is known at the
//! start, are measured at every increment that converges; the worst is told. Where a strain is singular, as at an edge that
//! presses, it grows without bound on finer meshes.

mod missed;

use std::collections::{BTreeSet, HashMap};

use self::missed::Missed;
use super::cascade::fetch;
use super::contact::ContactState;
use crate::assembly::gradients;
use crate::comm::{Comm, of_largest};
use crate::constraint::Kind;
use crate::constraint::law::Status;
use crate::contact::Site;
use crate::decomposition::Subdomain;
use crate::feti::Torn;
use crate::model::discrete::Discrete;
use crate::model::extent::{diagonal, short, shown};
use crate::newton::Newton;
use crate::newton::path::At;
use crate::record::rows::StepRow;
use crate::record::state::{Extreme, Measures};
use crate::scene::Scene;
use crate::vector::{dot, length};

const STRAIN: f64 = 0.1;
const ROTATION: f64 = 0.1;
const DISPLACEMENT: f64 = 0.1;
const SLIDING: f64 = 1.0;
const CLOSED_GAP: f64 = 0.1;
const MISSED_PRESSURE: f64 = 0.5;
const ROUNDING: f64 = 1e-3;

/// Strains below are round-off.
const NO_STRAIN: f64 = 1e-12;

/// The largest value so far, and where.
#[derive(Clone, Copy)]
struct Worst {
    value: f64,
    of: usize,
    place: [f64; 3],
}

impl Worst {
    const NONE: Self = Self { value: 0.0, of: 0, place: [0.0; 3] };

    fn add(&mut self, value: f64, of: usize, place: impl FnOnce() -> [f64; 3]) {
        if value > self.value {
            *self = Self { value, of, place: place() };
        }
    }
}

/// Measures of bodies: strain, rotation, displacement, and the strain times its body's diagonal (length).
const OF_BODIES: usize = 4;
/// Measures of contacts: sliding, the gap that closes, and the pressure that is missing.
const OF_CONTACTS: usize = 3;

/// How near a solution comes to the limits. Collective.
pub(super) fn measure(
    comm: &dyn Comm,
    scene: &Scene,
    discrete: &Discrete,
    newton: &Newton,
    contact: &[ContactState],
) -> Measures {
    let (problem, at, u) = (newton.problem(), newton.at(), &newton.iterate().u);
    let status: HashMap<usize, Status> = contact.iter().map(|state| (state.pair, state.status)).collect();
    let closed = |row: usize| match problem.constraints.rows[row].kind {
        Kind::Contact { pair } => Some(pair).filter(|pair| status.get(pair).is_some_and(|status| status.is_closed())),
        _ => None,
    };
    let owned = problem.space.owned();
    let pairs = owned.iter().cloned().flatten().filter_map(closed).map(|pair| &discrete.contacts.pairs[pair]);
    let nodes = pairs.flat_map(|pair| pair.slaves.iter().chain(&pair.masters).map(|(node, _)| *node));
    let nodes = nodes.chain(missed::nodes(scene, discrete));
    let of_nodes = displacements(comm, discrete, u, nodes);
    let mut worst = [Worst::NONE; OF_BODIES + OF_CONTACTS];
    let subdomains = problem.subdomains.iter().zip(u).zip(owned);
    for ((subdomain, u), rows) in subdomains {
        add_body(&mut worst, subdomain, u, diagonal(&discrete.extents[subdomain.body]));
        for row in rows.clone() {
            if let Some(pair) = closed(row) {
                add_contact(&mut worst, scene, discrete, pair, at, &of_nodes);
            }
        }
    }
    let strain = worst[0].value;
    Missed { scene, discrete, newton, of_nodes: &of_nodes }.add(&mut worst[6], comm, contact, strain);
    let worst = worst.map(|w| {
        let [value, of, place @ ..] =
            of_largest(comm, w.value, [w.value, w.of as f64, w.place[0], w.place[1], w.place[2]]);
        Worst { value, of: of as usize, place }
    });
    let found = |k: usize, name: &dyn Fn(usize) -> String| {
        let Worst { value, of, place } = worst[k];
        (value > 0.0 && value.is_finite()).then(|| Extreme { value, of: name(of), at: place })
    };
    let body = |of: usize| scene.body.keys().nth(of).cloned().unwrap_or_default();
    let contact = |of: usize| discrete.contacts.names.get(of).cloned().unwrap_or_default();
    Measures {
        max_strain: found(0, &body),
        max_rotation: found(1, &body),
        max_relative_displacement: found(2, &body),
        max_rounding: rounding(scene, discrete, &worst[..OF_BODIES]),
        max_sliding: found(4, &contact),
        max_closed_gap: found(5, &contact),
        max_missed_pressure: found(6, &contact),
    }
}

fn add_body(worst: &mut [Worst], subdomain: &Subdomain, u: &[f64], diagonal: f64) {
    let body = subdomain.body;
    gradients::each(subdomain, u, |element, h| {
        let place = || {
            let nodes = subdomain.elements.get(element);
            let sum = |a: usize| nodes.iter().map(|&n| subdomain.points[n as usize][a]).sum::<f64>();
            std::array::from_fn(|a| sum(a) / nodes.len() as f64)
        };
        let pairs = || (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
        let strain = pairs().map(|(i, j)| (0.5 * (h[i][j] + h[j][i])).powi(2)).sum::<f64>().sqrt();
        let rotation = pairs().map(|(i, j)| 0.5 * (0.5 * (h[i][j] - h[j][i])).powi(2)).sum::<f64>().sqrt();
        worst[0].add(strain, body, place);
        worst[1].add(rotation, body, place);
        worst[3].add(strain * diagonal, body, place);
    });
    for (u, &place) in u.as_chunks::<3>().0.iter().zip(&subdomain.points) {
        worst[2].add(length(*u) / diagonal, body, || place);
    }
}

fn add_contact(
    worst: &mut [Worst],
    scene: &Scene,
    discrete: &Discrete,
    index: usize,
    at: At,
    of_nodes: &HashMap<u64, [f64; 3]>,
) {
    let (pair, Site { place, facet }) = (&discrete.contacts.pairs[index], discrete.contacts.pairs.site(index));
    let (name, contact) = scene.contact.iter().nth(pair.contact).expect("a pair belongs to a contact");
    let moved = contact.displacement().map(|d| -d * obstacle_factor(scene, name, at));
    let motion = pair.nodes().fold(moved, |sum, (node, weight)| {
        let u = of_nodes[&node];
        std::array::from_fn(|a| sum[a] + weight * u[a])
    });
    let along = dot(motion, pair.normal);
    let beside: [f64; 3] = std::array::from_fn(|a| motion[a] - along * pair.normal[a]);
    let body = discrete.bodies.partition_point(|body| body.first_node <= pair.slave) - 1;
    worst[4].add(length(beside) / facet, pair.contact, || place);
    worst[5].add(pair.gap / diagonal(&discrete.extents[body]), pair.contact, || place);
}

/// How much of an obstacle's displacement there is.
fn obstacle_factor(scene: &Scene, name: &str, at: At) -> f64 {
    let end = scene.steps()[at.stage].of_contact(name);
    if scene.step.is_empty() {
        return end;
    }
    let begin = at.stage.checked_sub(1).map_or(0.0, |before| scene.steps()[before].of_contact(name));
    begin + at.fraction * (end - begin)
}

/// Displacements of these nodes of surfaces in contact, those of the first subdomain that has a face there. Collective.
pub(super) fn displacements(
    comm: &dyn Comm,
    discrete: &Discrete,
    u: &Torn,
    nodes: impl Iterator<Item = u64>,
) -> HashMap<u64, [f64; 3]> {
    let of_surfaces = |(subdomain, u): (&Subdomain, &Vec<f64>)| {
        let facets = subdomain.facets.iter().filter(|facet| discrete.contacts.touch(facet.surface));
        let nodes: BTreeSet<u32> = facets.flat_map(|facet| facet.nodes.iter().copied()).collect();
        let of_node = |node: usize| (subdomain.nodes[node], u.as_chunks::<3>().0[node]);
        nodes.into_iter().map(|node| of_node(node as usize)).collect::<Vec<_>>()
    };
    let known = discrete.decomposition.subdomains.iter().zip(u).flat_map(of_surfaces);
    fetch(comm, known, nodes.collect())
}

/// The rounding of coordinates over the largest stretch of a body. It matters to contacts only.
fn rounding(scene: &Scene, discrete: &Discrete, of_bodies: &[Worst]) -> Option<Extreme> {
    let coordinates = discrete.extents.iter().flatten().flatten();
    let farthest = coordinates.fold(0.0_f64, |farthest, x| farthest.max(x.abs()));
    let Worst { value: stretch, of, place } = of_bodies[3];
    let is_strained = of_bodies[0].value > NO_STRAIN && stretch.is_finite() && discrete.contacts.pairs.total() > 0;
    let name = || scene.body.keys().nth(of).cloned().unwrap_or_default();
    is_strained.then(|| Extreme { value: f64::EPSILON * farthest / stretch, of: name(), at: place })
}

/// What to tell of measures beyond their limits, of the increments that converged: the worst of each.
pub(super) fn warnings(scene: &Scene, rows: &[StepRow]) -> Vec<String> {
    // The limit load is that of the theory, and how far mechanisms move is arbitrary.
    if scene.limit.is_some() {
        return Vec::new();
    }
    type Of = fn(&Measures) -> &Option<Extreme>;
    const NOTHING: &str = "results there mean nothing; loads are too large";
    let to_begin_nearer = "start with the bodies nearer to where they end";
    let tell = |of: Of, limit: f64, what: &str, consequence: &dyn Fn(f64) -> String| {
        let reached = rows.iter().filter(|row| row.converged);
        let found = reached.filter_map(|row| Some((row, of(&row.state.measures).as_ref()?)));
        let (row, Extreme { value, of, at }) = found.reduce(|a, b| if b.1.value > a.1.value { b } else { a })?;
        let when = if scene.step.is_empty() { String::new() } else { format!(" at time {}", short(row.time)) };
        let (reached, place) = (short(*value), shown(*at));
        let text = || {
            let consequence = consequence(*value);
            format!("{what} {of} reaches {reached} near {place}{when}, more than is sound ({limit}): {consequence}")
        };
        (*value > limit).then(text)
    };
    let told = [
        tell(|m| &m.max_strain, STRAIN, "the strain of body", &|strain| match strain {
            1.0.. => NOTHING.to_owned(),
            _ => format!("stresses there are off by about {} of themselves; loads are too large", short(0.5 * strain)),
        }),
        tell(|m| &m.max_rotation, ROTATION, "the rotation (radians) of body", &|angle| match angle {
            1.0.. => NOTHING.to_owned(),
            _ => format!("a strain of about {} is missing there; loads are too large", short(0.5 * angle * angle)),
        }),
        tell(|m| &m.max_relative_displacement, DISPLACEMENT, "the displacement, in its sizes, of body", &|_| {
            format!("loads and contacts stay where they were; {to_begin_nearer}")
        }),
        tell(|m| &m.max_sliding, SLIDING, "the sliding, in edges of facets, in contact", &|_| {
            format!("nodes press on what they faced before; {to_begin_nearer}")
        }),
        tell(|m| &m.max_closed_gap, CLOSED_GAP, "the gap that closes, in sizes of its body, in contact", &|_| {
            format!("normals and partners are those of before; {to_begin_nearer}")
        }),
        tell(
            |m| &m.max_missed_pressure,
            MISSED_PRESSURE,
            "the share of the pressure that is missing between nodes of contact",
            &|_| "the other side is inside of faces that it should press on; refine the slave there".to_owned(),
        ),
        tell(
            |m| &m.max_rounding,
            ROUNDING,
            "the rounding of coordinates, as a share of what strains it, of body",
            &|_| "gaps are rounded as coordinates are; move the scene nearer to the origin".to_owned(),
        ),
    ];
    told.into_iter().flatten().collect()
}

#[cfg(test)]
mod tests;
